//! Profiles of calls.

/// The relation of the body of a call to its envelope, see [`rpc`](crate::rpc).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// OMG DDS-RPC: the envelope travels with the body. A reply holds a result or one exception.
    #[default]
    Rpc,
    /// Only the body travels, and the backend says which request and operation it belongs to. It
    /// begins at a multiple of 8 bytes. Where an operation throws, its reply holds a code, every
    /// exception and the result.
    Bare,
}
