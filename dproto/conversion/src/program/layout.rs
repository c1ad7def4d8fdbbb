//! Numbers that have the same offsets in all elements of a loop, or in each group.

use crate::fault::Fault;
use crate::formula::Formula;
use crate::kernel::Kernel;
use crate::lanes::Marks;
use core::ops::Range;

/// The layout of the elements of a loop without inner loops and texts: each begins where the one
/// before ends, and its numbers have the same offsets.
#[derive(Clone, Debug)]
pub(super) struct Record {
    /// Bytes of an element.
    pub(super) size: usize,
    /// The greatest alignment, which divides the size.
    pub(super) align: usize,
    /// The offset of the first number.
    pub(super) first: usize,
    /// The numbers of the only group of an element, if nothing else is converted.
    pub(super) marks: Option<Marks>,
}

/// The layout of a group without loops and texts, with its kernel.
#[derive(Clone, Debug)]
pub(super) struct Fixed {
    record: Record,
    pub(super) kernel: Kernel,
}

impl Fixed {
    pub(super) fn new(record: Record, formula: &Formula) -> Option<Self> {
        let kernel = Kernel::new(formula, &record.marks.as_ref()?.0)?;
        Some(Self { record, kernel })
    }

    /// Converts the group after byte `at`, and returns where it ends. `None` if single steps have
    /// to convert it, or to report an error.
    #[inline]
    pub(super) fn run(&self, bytes: &mut [u8], at: usize) -> Option<usize> {
        let start = next_multiple(at, self.record.first)?;
        // A power of 2.
        if start & (self.record.align - 1) != 0 {
            return None;
        }
        let end = start.checked_add(self.record.size)?;
        let group = bytes.get_mut(start..end)?;
        self.kernel.run(group).then_some(end)
    }
}

/// The next multiple of a power of 2.
#[inline]
pub(super) fn next_multiple(at: usize, size: usize) -> Option<usize> {
    let mask = size.wrapping_sub(1);
    Some(at.checked_add(mask)? & !mask)
}

/// The range of `count` numbers of `size` bytes after `at`.
#[inline]
pub(super) fn span(
    bytes: &[u8],
    at: usize,
    size: usize,
    count: usize,
) -> Result<Range<usize>, Fault> {
    let start = next_multiple(at, size);
    let end = start.and_then(|start| start.checked_add(size.checked_mul(count)?));
    match (start, end) {
        (Some(start), Some(end)) if end <= bytes.len() => Ok(start..end),
        _ => Err(Fault::Truncated(at.min(bytes.len()))),
    }
}

/// The number of elements that follows, and the byte after it.
pub(super) fn length(bytes: &[u8], at: usize) -> Result<(usize, usize), Fault> {
    let range = span(bytes, at, 4, 1)?;
    let mut number = [0; 4];
    number.copy_from_slice(&bytes[range.clone()]);
    Ok((u32::from_le_bytes(number) as usize, range.end))
}
