//! Where a source of time and its followers meet, and by which types.

use crate::{Address, TypeIdentity};

/// The hash of the types: a name and a version, `rcTime` and 1.
pub const TYPE_HASH: u64 = 0x7263_5469_6d65_0001;

/// The address of the calls. Its `tick` is the topic. No component or slot can have an address with
/// `rc-time`: their names have no `-`.
pub fn address(network: &str) -> Result<Address, String> {
    Address::parse(&format!("{network}/rc-time"))
}

/// The types of the topic.
pub fn topic_types() -> TypeIdentity {
    types("RcTime::Time/tick")
}

/// The types of the calls.
pub fn call_types() -> TypeIdentity {
    types("RcTime::Time")
}

fn types(name: &str) -> TypeIdentity {
    TypeIdentity {
        name: name.to_owned(),
        hash: TYPE_HASH,
    }
}
