//! Writes a body of CDR, in one pass or, for large arrays, in two.

use super::{Cdr, DecodeError, EncodeError, Reader};

/// Arrays of numbers from this size on, in bytes, are written straight into the memory of the
/// middleware. A second pass over the value costs less than copying them once more.
const BULK: usize = 8 * 1024;

/// Serializes values, one after the other. Keeps the first error until [`Writer::finish`].
///
/// ```
/// use rc_middleware::Writer;
///
/// let mut writer = Writer::default();
/// writer.put(&1_u8);
/// writer.put(&2_u32); // aligned to 4 bytes
/// assert_eq!(writer.finish(), Ok(&[1, 0, 0, 0, 2, 0, 0, 0][..]));
/// ```
#[derive(Debug, Default)]
pub struct Writer<'m> {
    output: Output<'m>,
    /// Bytes of large arrays that were counted and not written.
    skipped: usize,
    error: Option<EncodeError>,
}

#[derive(Debug)]
enum Output<'m> {
    /// A buffer that grows. If `skips` is set, large arrays are only counted.
    Buffer { bytes: Vec<u8>, skips: bool },
    /// Memory of the size of the body, filled up to `at`.
    Memory { memory: &'m mut [u8], at: usize },
    /// Nothing: only the length of the body counts, whether it can be encoded, and the memory that
    /// its value takes.
    Count(Counted),
}

/// The memory of a value.
#[derive(Clone, Copy, Debug)]
struct Counted {
    /// The length of the encoding so far.
    at: usize,
    /// The allocated memory of the value, in bytes.
    memory: usize,
    /// Whether the value itself is sent, not a copy, which has no spare capacity.
    is_moved: bool,
}

/// The memory of an allocation of this many bytes: allocators add a word, and round up.
pub(crate) const fn allocation(bytes: usize) -> usize {
    if bytes == 0 {
        return 0;
    }
    let whole = bytes.saturating_add(size_of::<usize>());
    if whole < 32 {
        32
    } else {
        whole.div_ceil(16).saturating_mul(16)
    }
}

impl Default for Output<'_> {
    fn default() -> Self {
        Self::Buffer {
            bytes: Vec::new(),
            skips: false,
        }
    }
}

impl Writer<'static> {
    /// Appends to `bytes`.
    pub fn over(bytes: Vec<u8>) -> Self {
        Self {
            output: Output::Buffer {
                bytes,
                skips: false,
            },
            skipped: 0,
            error: None,
        }
    }

    /// Counts the bytes of a body that begins at this offset, and the memory of its value, which is
    /// sent itself or copied.
    pub(crate) fn counting(at: usize, is_moved: bool) -> Self {
        Self {
            output: Output::Count(Counted {
                at,
                memory: 0,
                is_moved,
            }),
            skipped: 0,
            error: None,
        }
    }

    /// Starts a new body in the same buffer.
    pub fn clear(&mut self) {
        self.restart(false);
    }

    /// Starts a new body in the same buffer, in which large arrays are only counted.
    pub(crate) fn measure(&mut self) {
        self.restart(true);
    }

    fn restart(&mut self, skip: bool) {
        if let Output::Buffer { bytes, skips } = &mut self.output {
            bytes.clear();
            *skips = skip;
        }
        self.skipped = 0;
        self.error = None;
    }

    /// Whether [`Writer::measure`] has left out large arrays, so that the body is not complete.
    pub(crate) fn has_skipped(&self) -> bool {
        self.skipped > 0
    }

    /// The bytes written so far, even after an error.
    pub fn into_bytes(self) -> Vec<u8> {
        match self.output {
            Output::Buffer { bytes, .. } => bytes,
            Output::Memory { memory, at } => memory[..at].to_vec(),
            Output::Count(_) => Vec::new(),
        }
    }
}

impl<'m> Writer<'m> {
    /// Writes into `memory`, which has the size of the body.
    pub(crate) fn into_memory(memory: &'m mut [u8]) -> Self {
        Self {
            output: Output::Memory { memory, at: 0 },
            skipped: 0,
            error: None,
        }
    }

    /// The body, or the first error.
    pub fn finish(&mut self) -> Result<&[u8], EncodeError> {
        match self.error.take() {
            Some(error) => Err(error),
            None => Ok(match &self.output {
                Output::Buffer { bytes, .. } => bytes,
                Output::Memory { memory, at } => &memory[..*at],
                Output::Count(_) => &[],
            }),
        }
    }

    /// Length of the body so far, in bytes.
    #[inline]
    pub fn len(&self) -> usize {
        match &self.output {
            Output::Buffer { bytes, .. } => bytes.len() + self.skipped,
            Output::Memory { at, .. } | Output::Count(Counted { at, .. }) => *at,
        }
    }

    /// Whether the body is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Keeps the first error.
    pub fn fail(&mut self, error: EncodeError) {
        self.error.get_or_insert(error);
    }

    /// Writes one value.
    #[inline]
    pub fn put<T: Cdr>(&mut self, value: &T) {
        value.encode(self);
    }

    /// Fails if `length` exceeds the bound of `what`.
    pub fn bound(&mut self, what: &'static str, length: usize, bound: usize) {
        if length > bound {
            self.fail(EncodeError::TooLong {
                what,
                length,
                bound,
            });
        }
    }

    /// Fails if `value` is outside `min..=max`; NaN is outside every range.
    pub fn range(
        &mut self,
        what: &'static str,
        value: f64,
        (min, max): (f64, f64),
        range: &'static str,
    ) {
        if !(min..=max).contains(&value) {
            self.fail(EncodeError::OutOfRange { what, value, range });
        }
    }

    /// Fails if an integer is outside `min..=max`. 64 bits have more digits than an `f64`.
    pub fn integer_range(
        &mut self,
        what: &'static str,
        value: i128,
        (min, max): (i128, i128),
        range: &'static str,
    ) {
        if !(min..=max).contains(&value) {
            self.fail(EncodeError::IntegerOutOfRange { what, value, range });
        }
    }

    /// Writes bytes without alignment.
    #[inline]
    pub fn raw(&mut self, bytes: &[u8]) {
        match &mut self.output {
            Output::Buffer { bytes: buffer, .. } => buffer.extend_from_slice(bytes),
            Output::Memory { memory, at } => {
                let end = *at + bytes.len();
                if let Some(place) = memory.get_mut(*at..end) {
                    place.copy_from_slice(bytes);
                    *at = end;
                } else {
                    // Nothing may follow in the rest of the memory.
                    *at = memory.len();
                    self.fail(EncodeError::Changed);
                }
            }
            Output::Count(counted) => counted.at += bytes.len(),
        }
    }

    /// Counts an allocation of the value, of which it uses `used` bytes and has `room`.
    #[inline]
    pub(super) fn holds(&mut self, used: usize, room: usize) {
        if let Output::Count(counted) = &mut self.output {
            let bytes = if counted.is_moved { room } else { used };
            counted.memory = counted.memory.saturating_add(allocation(bytes));
        }
    }

    /// The counted memory of the value, in bytes.
    pub(crate) fn memory(&self) -> usize {
        match &self.output {
            Output::Count(counted) => counted.memory,
            Output::Buffer { .. } | Output::Memory { .. } => 0,
        }
    }

    /// Writes the bytes of an array of numbers without alignment.
    pub(super) fn array(&mut self, bytes: &[u8]) {
        match &mut self.output {
            Output::Buffer { skips: true, .. } if bytes.len() >= BULK => {
                self.skipped += bytes.len();
            }
            _ => self.raw(bytes),
        }
    }

    /// Copies `count` numbers of `size` bytes each, which follow in `reader`.
    pub fn copy_numbers(
        &mut self,
        reader: &mut Reader<'_>,
        count: usize,
        size: usize,
    ) -> Result<(), DecodeError> {
        if count == 0 {
            return Ok(());
        }
        reader.align(size);
        let bytes = reader.raw(count.saturating_mul(size))?;
        self.align(size);
        self.array(bytes);
        Ok(())
    }

    /// Writes a length as uint32.
    pub fn length(&mut self, length: usize) {
        self.put(&u32::try_from(length).unwrap_or(u32::MAX));
    }

    /// Writes zeros up to the next multiple of `size` bytes; `size` is at most 8.
    #[inline]
    pub(crate) fn align(&mut self, size: usize) {
        let rest = self.len() % size;
        if rest != 0 {
            self.raw(&[0; 8][..size - rest]);
        }
    }
}
