//! What conversions know of one end of a connection.

use rc_idsl::Library;
use rc_idsl::model::InterfaceId;

/// One end of a connection.
#[derive(Clone, Copy)]
pub(crate) struct End<'a> {
    /// `INSTANCE.SLOT`
    pub(crate) name: &'a str,
    pub(crate) library: &'a Library,
    /// What its types mean.
    pub(crate) prototypes: &'a rc_prototypes::model::Library,
    pub(crate) interface: InterfaceId,
    /// Whether it is a consumer of topics, which receives all values.
    pub(crate) subscribes: bool,
}
