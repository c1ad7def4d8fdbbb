//! The content of a generation, neutral of the language of its output: names of the description
//! languages, types, operations, facts. [`crate::rust`] adds the names of Rust; templates hold all
//! code.

pub(crate) mod checks;
pub mod component;
mod description;
pub(crate) mod documentation;
pub(crate) mod in_place;
pub mod library;
pub mod machine;
pub mod members;
pub mod parameters;
pub mod types;

pub(crate) use checks::range_text;
pub use component::{Component, Slot};
pub use machine::Machine;
pub use parameters::{Parameter, Parameters};

/// The hash of a name in the envelope of calls: the first four bytes of its MD5 sum, little endian
/// (OMG DDS-RPC 1.0, 7.5.1.1.3).
pub(crate) fn rpc_hash(name: &str) -> i32 {
    use md5::{Digest, Md5};
    let digest = Md5::digest(name.as_bytes());
    let mut bytes = [0; 4];
    bytes.copy_from_slice(&digest[..4]);
    i32::from_le_bytes(bytes)
}
