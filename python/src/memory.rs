//! The memory of an image: that of a sample which a publisher has lent or a subscriber has received,
//! or a copy.
//!
//! `NumPy` reads and writes it by the buffer protocol. While an array is there, nothing takes the
//! memory away.
#![allow(
    unsafe_code,
    reason = "the buffer protocol hands out addresses; each block has its argument"
)]

use pyo3::exceptions::PyBufferError;
use pyo3::ffi;
use pyo3::prelude::*;
use rc_host::{Aligned, Image, KeptCount, Lent};
use rc_middleware::in_place::{FromBytes, IntoBytes};
use rc_middleware::{KeptSample, LoanedSample};
use std::ffi::{CString, c_int, c_void};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The memory of an image. Its address does not change until it is taken.
#[pyclass(frozen, module = "robocomp._native")]
pub(crate) struct Memory {
    start: NonNull<u8>,
    length: usize,
    writable: bool,
    /// The number of buffers that are in use.
    exports: AtomicUsize,
    /// Whether it was discarded while buffers were in use: the last one gives the memory back.
    discarded: AtomicBool,
    backing: Mutex<Backing>,
}

/// A number of which every pattern of bytes is a value, so that an array may write any.
pub(crate) trait Number: FromBytes + IntoBytes + Send + 'static {}

impl<T: FromBytes + IntoBytes + Send + 'static> Number for T {}

/// Owner of the bytes.
enum Backing {
    Owned(#[expect(dead_code, reason = "it owns the memory")] Aligned),
    /// The memory of a test's loan: it counts the loans of a topic.
    Counted(
        #[expect(dead_code, reason = "it owns the memory")] Aligned,
        #[expect(dead_code, reason = "it counts the loan")] Arc<()>,
    ),
    /// The numbers of a value.
    Numbers(#[expect(dead_code, reason = "it owns the memory")] Box<dyn Send>),
    Lent(Lent),
    /// A received sample, which lets its publisher have the memory again when it is dropped.
    Kept(
        #[expect(dead_code, reason = "it owns the memory")] Box<dyn KeptSample>,
        #[expect(dead_code, reason = "it counts the sample")] KeptCount,
    ),
    /// The memory was sent or given away.
    Empty,
}

// SAFETY: `start` is the address of the memory that `backing` owns. It is read and written only
// while the interpreter is attached, in `bytes`, `write` and through buffers, whose users keep
// Python's rules for shared arrays.
unsafe impl Send for Memory {}
// SAFETY: as above.
unsafe impl Sync for Memory {}

impl Memory {
    /// An image of its own, which is only read.
    pub(crate) fn owned(image: Aligned) -> Self {
        Self::of(image, false, Backing::Owned)
    }

    /// The image of a received sample, which is only read.
    pub(crate) fn received(image: Image) -> Self {
        match image {
            Image::Copied(image) => Self::owned(image),
            Image::Kept(sample, count) => Self::kept(sample, count),
        }
    }

    /// Zeros for an image that is copied when it is sent.
    pub(crate) fn zeros(length: usize) -> Self {
        Self::of(Aligned::zeros(length), true, Backing::Owned)
    }

    /// Zeros for a loan of a test. `loan` is held for as long as the memory is.
    pub(crate) fn counted(length: usize, loan: Arc<()>) -> Self {
        let of = |image| Backing::Counted(image, loan);
        Self::of(Aligned::zeros(length), true, of)
    }

    fn of(mut image: Aligned, writable: bool, backing: impl FnOnce(Aligned) -> Backing) -> Self {
        let memory = image.bytes_mut();
        Self {
            start: NonNull::from(&mut *memory).cast(),
            length: memory.len(),
            writable,
            exports: AtomicUsize::new(0),
            discarded: AtomicBool::new(false),
            backing: Mutex::new(backing(image)),
        }
    }

    /// The memory of a sample of this thread's publisher.
    pub(crate) fn lent(mut sample: Box<dyn LoanedSample>) -> Self {
        let memory = sample.memory_mut();
        Self {
            start: NonNull::from(&mut *memory).cast(),
            length: memory.len(),
            writable: true,
            exports: AtomicUsize::new(0),
            discarded: AtomicBool::new(false),
            backing: Mutex::new(Backing::Lent(Lent::new(sample))),
        }
    }

    /// The memory of numbers, which becomes that of an array.
    pub(crate) fn numbers<T: Number>(mut numbers: Vec<T>) -> Self {
        let memory = numbers.as_mut_bytes();
        Self {
            start: NonNull::from(&mut *memory).cast(),
            length: memory.len(),
            writable: true,
            exports: AtomicUsize::new(0),
            discarded: AtomicBool::new(false),
            backing: Mutex::new(Backing::Numbers(Box::new(numbers))),
        }
    }

    fn kept(sample: Box<dyn KeptSample>, kept_count: KeptCount) -> Self {
        let memory = sample.memory();
        Self {
            start: NonNull::from(memory).cast(),
            length: memory.len(),
            writable: false,
            exports: AtomicUsize::new(0),
            discarded: AtomicBool::new(false),
            backing: Mutex::new(Backing::Kept(sample, kept_count)),
        }
    }

    pub(crate) fn is_writable(&self) -> bool {
        self.writable
    }

    /// Passes a part of the image to `read`.
    pub(crate) fn read<T>(
        &self,
        at: usize,
        length: usize,
        read: impl FnOnce(&[u8]) -> T,
    ) -> PyResult<T> {
        let backing = self.backing.lock().unwrap_or_else(PoisonError::into_inner);
        self.check(&backing, at, length)?;
        // SAFETY: `check` has compared the part with the length, and `backing` owns the memory for
        // as long as the lock is held. Bytes have no invalid values.
        let bytes = unsafe { std::slice::from_raw_parts(self.start.as_ptr().add(at), length) };
        Ok(read(bytes))
    }

    /// Calls `write` with the bytes.
    pub(crate) fn write<T>(
        &self,
        at: usize,
        length: usize,
        write: impl FnOnce(&mut [u8]) -> T,
    ) -> PyResult<T> {
        let backing = self.backing.lock().unwrap_or_else(PoisonError::into_inner);
        self.check(&backing, at, length)?;
        if !self.writable {
            return Err(PyBufferError::new_err("a received sample is only read"));
        }
        // SAFETY: as in `read`. The lock excludes other calls of `read` and `write`.
        let bytes = unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr().add(at), length) };
        Ok(write(bytes))
    }

    fn check(&self, backing: &Backing, at: usize, length: usize) -> PyResult<()> {
        if matches!(backing, Backing::Empty) || self.discarded.load(Ordering::Acquire) {
            return Err(gone());
        }
        match at.checked_add(length) {
            Some(end) if end <= self.length => Ok(()),
            _ => Err(PyBufferError::new_err("the image ends too early")),
        }
    }

    /// Takes the memory away, for sending or for dropping it. `None`: it is a copy. It fails while
    /// an array is there.
    pub(crate) fn take(&self) -> PyResult<Option<Box<dyn LoanedSample>>> {
        let mut backing = self.backing.lock().unwrap_or_else(PoisonError::into_inner);
        match &*backing {
            Backing::Empty => return Err(gone()),
            _ if self.discarded.load(Ordering::Acquire) => return Err(gone()),
            _ if self.exports.load(Ordering::Acquire) > 0 => {
                return Err(PyBufferError::new_err(
                    "a writable view of the sample exists; delete the arrays that were taken from \
                     it before send()",
                ));
            }
            Backing::Owned(_) | Backing::Counted(..) | Backing::Numbers(_) | Backing::Kept(..) => {
                return Ok(None);
            }
            Backing::Lent(lent) if !lent.is_here() => {
                // This error runs Python, which may hand the interpreter's lock to a thread that waits
                // for this one.
                drop(backing);
                return Err(crate::errors::wrong_thread());
            }
            Backing::Lent(_) => {}
        }
        match std::mem::replace(&mut *backing, Backing::Empty) {
            Backing::Lent(mut lent) => Ok(lent.take()),
            _ => Ok(None),
        }
    }

    /// Discards the sample. Arrays that share its memory stay valid: the last one gives the memory
    /// back.
    pub(crate) fn discard(&self) {
        let mut backing = self.backing.lock().unwrap_or_else(PoisonError::into_inner);
        self.discarded.store(true, Ordering::Release);
        if self.exports.load(Ordering::Acquire) == 0 {
            *backing = Backing::Empty;
        }
    }

    /// Ends a copy that was sent.
    pub(crate) fn end(&self) {
        let mut backing = self.backing.lock().unwrap_or_else(PoisonError::into_inner);
        if self.exports.load(Ordering::Acquire) == 0 {
            *backing = Backing::Empty;
        }
    }
}

fn gone() -> PyErr {
    PyBufferError::new_err("the sample was sent or discarded")
}

#[pymethods]
impl Memory {
    /// Fills in a buffer of bytes.
    #[allow(clippy::needless_pass_by_value, reason = "the protocol passes it so")]
    unsafe fn __getbuffer__(
        slf: Bound<'_, Self>,
        view: *mut ffi::Py_buffer,
        flags: c_int,
    ) -> PyResult<()> {
        let memory = slf.get();
        let backing = memory
            .backing
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        memory.check(&backing, 0, 0)?;
        if flags & ffi::PyBUF_WRITABLE == ffi::PyBUF_WRITABLE && !memory.writable {
            return Err(PyBufferError::new_err("a received sample is only read"));
        }
        let length = ffi::Py_ssize_t::try_from(memory.length)?;
        let format = if flags & ffi::PyBUF_FORMAT == ffi::PyBUF_FORMAT {
            CString::from(c"B").into_raw()
        } else {
            std::ptr::null_mut()
        };
        // SAFETY: the interpreter passes a buffer that may be filled in. The memory lives as long
        // as `obj`, which the buffer holds, and is not taken while `exports` counts the buffer.
        unsafe {
            (*view).obj = slf.clone().into_any().into_ptr();
            (*view).buf = memory.start.as_ptr().cast::<c_void>();
            (*view).len = length;
            (*view).readonly = c_int::from(!memory.writable);
            (*view).itemsize = 1;
            (*view).format = format;
            (*view).ndim = 1;
            (*view).shape = if flags & ffi::PyBUF_ND == ffi::PyBUF_ND {
                &raw mut (*view).len
            } else {
                std::ptr::null_mut()
            };
            (*view).strides = if flags & ffi::PyBUF_STRIDES == ffi::PyBUF_STRIDES {
                &raw mut (*view).itemsize
            } else {
                std::ptr::null_mut()
            };
            (*view).suboffsets = std::ptr::null_mut();
            (*view).internal = std::ptr::null_mut();
        }
        memory.exports.fetch_add(1, Ordering::AcqRel);
        Ok(())
    }

    /// Releases a buffer.
    unsafe fn __releasebuffer__(&self, view: *mut ffi::Py_buffer) {
        // SAFETY: `__getbuffer__` made the format by `into_raw`, or left it null.
        unsafe {
            if !(*view).format.is_null() {
                drop(CString::from_raw((*view).format));
            }
        }
        let mut backing = self.backing.lock().unwrap_or_else(PoisonError::into_inner);
        let was_last = self.exports.fetch_sub(1, Ordering::AcqRel) == 1;
        if was_last && self.discarded.load(Ordering::Acquire) {
            *backing = Backing::Empty;
        }
    }
}
