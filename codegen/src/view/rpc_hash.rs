//! Hashes of names for the envelope of calls.

/// The hash of a name in the envelope of calls: the first four bytes of its MD5 sum, little endian
/// (OMG DDS-RPC 1.0, 7.5.1.1.3).
pub(crate) fn of(name: &str) -> i32 {
    use md5::{Digest, Md5};
    let digest = Md5::digest(name.as_bytes());
    let mut bytes = [0; 4];
    bytes.copy_from_slice(&digest[..4]);
    i32::from_le_bytes(bytes)
}
