//! One end of a connection, as conversions see it.

use rc_idsl::Library;
use rc_idsl::model::InterfaceId;

/// One end of a connection.
#[derive(Clone, Copy)]
pub(crate) struct End<'a> {
    /// `INSTANCE.SLOT`
    pub(crate) name: &'a str,
    pub(crate) library: &'a Library,
    /// The meanings of its types.
    pub(crate) prototypes: &'a rc_prototypes::model::Library,
    pub(crate) interface: InterfaceId,
    /// Whether it is a consumer of topics, which receives all values.
    pub(crate) subscribes: bool,
}
