//! Identity of an endpoint, for its own component and for others.

use crate::EndpointInfo;
use rc_middleware::qos::Contract;

/// The two kinds of endpoints of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// It sends.
    Writer,
    /// It receives.
    Reader,
}

impl EndpointKind {
    /// The kind of its peers.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Writer => Self::Reader,
            Self::Reader => Self::Writer,
        }
    }
}

/// Names, kind and announcement of an endpoint.
#[derive(Clone, Debug)]
pub struct Identity {
    /// The name of its topic in DDS.
    pub topic: String,
    /// Writer or reader.
    pub kind: EndpointKind,
    /// Announcement in the user data of DDS.
    pub info: EndpointInfo,
    /// The quality of service that it offers or requests.
    pub contract: Contract,
}
