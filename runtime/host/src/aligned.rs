//! Memory for an image that no middleware lends.

use rc_middleware::in_place::IntoBytes;

/// Bytes that begin at a multiple of 16, as those of every image. Their address does not change.
pub struct Aligned {
    words: Box<[u128]>,
    length: usize,
}

impl Aligned {
    /// This many zeros.
    pub fn zeros(length: usize) -> Self {
        Self {
            words: vec![0; length.div_ceil(16)].into_boxed_slice(),
            length,
        }
    }

    /// A copy.
    pub fn copied(bytes: &[u8]) -> Self {
        let mut copy = Self::zeros(bytes.len());
        copy.bytes_mut().copy_from_slice(bytes);
        copy
    }

    /// The bytes.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.words.as_mut_bytes()[..self.length]
    }
}
