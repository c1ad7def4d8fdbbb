//! Memory of samples: received ones, and those that this process writes.

use crate::{Identity, raw};
use raw::CSample;
use std::ffi::c_void;
use std::fmt;
use std::ops::Deref;

/// The bytes in front of a sample's encapsulation that its only owner may write.
pub(crate) const HEADROOM: usize = 36;
/// The bytes of an encapsulation.
const ENCAPSULATION: usize = 4;
/// The bytes in front of the body of a sample that its only owner may write: an envelope, for
/// example.
pub const BEFORE_BODY: usize = HEADROOM + ENCAPSULATION;

/// A sample that this process writes.
#[derive(Debug)]
pub struct Loan {
    data: *mut c_void,
    body: *mut u8,
    size: usize,
}

impl Loan {
    /// `data` comes from `rc_loan`, `body` and `size` are its body.
    pub(crate) fn new(data: *mut c_void, body: *mut u8, size: usize) -> Self {
        Self { data, body, size }
    }

    /// The reference, which no longer ends with this value.
    pub(crate) fn into_data(self) -> *mut c_void {
        let data = self.data;
        std::mem::forget(self);
        data
    }

    /// Body, after [`BEFORE_BODY`] bytes.
    pub fn memory(&mut self) -> &mut [u8] {
        // SAFETY: `rc_loan` gave the address and the size of initialised memory with that many
        // bytes in front of it, which this value alone holds.
        unsafe {
            std::slice::from_raw_parts_mut(self.body.sub(BEFORE_BODY), BEFORE_BODY + self.size)
        }
    }

    /// The memory, for reading.
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts(self.body.sub(BEFORE_BODY), BEFORE_BODY + self.size) }
    }
}

impl Drop for Loan {
    fn drop(&mut self) {
        // SAFETY: `rc_loan` gave this reference to this value alone.
        unsafe { raw::rc_release(self.data) };
    }
}

/// A received sample with its encapsulation. Its memory may belong to the library, which gets it
/// back when the sample is dropped.
pub struct Sample(CSample);

// SAFETY: the memory is counted atomically by the library. After the sample was made, only its last
// owner writes it (`unique`).
unsafe impl Send for Sample {}

impl Sample {
    pub(crate) fn new(sample: CSample) -> Self {
        Self(sample)
    }

    /// Number among the samples of its writer, from 1.
    pub fn sequence(&self) -> u64 {
        self.0.sequence
    }

    /// The handle of its writer.
    pub fn writer(&self) -> u64 {
        self.0.writer
    }

    /// Time of sending, in nanoseconds since 1970.
    pub fn stamp(&self) -> i64 {
        self.0.stamp
    }

    /// The identity in its inline quality of service.
    pub fn related(&self) -> Option<Identity> {
        if self.0.related.is_null() {
            return None;
        }
        // SAFETY: not null, so it points into memory that lives until `rc_release`.
        Some(unsafe { *self.0.related }.into())
    }
}

impl Sample {
    /// The sample after [`BEFORE_BODY`] bytes, the last of which are its encapsulation, for
    /// writing. `None` if another reader in this process also has it, or if there is no room before
    /// it.
    pub fn unique(&mut self) -> Option<&mut [u8]> {
        // SAFETY: `data` is a sample of `rc_take` until `rc_release`.
        if unsafe { raw::rc_is_unique(self.0.data) } == 0 {
            return None;
        }
        let (begin, size) = (self.0.bytes.cast_mut(), HEADROOM + self.0.size);
        // SAFETY: `rc_is_unique` has found `HEADROOM` bytes in front of the sample, in the same
        // memory (`blob_new` of `shim.c` initialises them), and no other reference.
        Some(unsafe { std::slice::from_raw_parts_mut(begin.sub(HEADROOM), size) })
    }
}

impl Deref for Sample {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        // SAFETY: `rc_take` gave the address and the size of memory that lives until `rc_release`.
        unsafe { std::slice::from_raw_parts(self.0.bytes, self.0.size) }
    }
}

impl fmt::Debug for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Sample {} of {} bytes", self.sequence(), self.len())
    }
}

impl Drop for Sample {
    fn drop(&mut self) {
        // SAFETY: `rc_take` gave this reference to this sample alone, which returns it once.
        unsafe { raw::rc_release(self.0.data) };
    }
}
