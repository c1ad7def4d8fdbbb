//! Runs a program over the bytes of a message.

use super::Program;
use super::layout::{Record, length, next_multiple, span};
use super::numbers::{doubles, integers, singles};
use super::steps::Step;
use crate::fault::Fault;
use crate::lanes::Marks;
use crate::scratch::{Rejected, Scratch};
use core::ops::Range;

/// How many elements of a refused block run by single steps.
const BLOCK: usize = 64;
/// The fewest elements for which a block is made.
const FEWEST: usize = 16;

impl Program {
    /// Runs the first steps, up to one that needs memory of its own. Returns that step, and the byte
    /// at which it begins.
    #[inline]
    pub(super) fn begin(&self, bytes: &mut [u8], start: usize) -> Result<(usize, usize), Fault> {
        let (mut step, mut at) = (0, start);
        while let Some(next) = self.steps.get(step) {
            match next {
                Step::Skip { size, count } => at = span(bytes, at, *size, *count)?.end,
                Step::Bytes(count) => at = span(bytes, at, 1, *count)?.end,
                Step::Text => {
                    let (length, behind) = length(bytes, at)?;
                    at = span(bytes, behind, 1, length)?.end;
                }
                Step::Group {
                    end,
                    fixed: Some(fixed),
                    ..
                } => {
                    let Some(behind) = fixed.run(bytes, at) else {
                        break;
                    };
                    at = behind;
                    step = *end;
                    continue;
                }
                _ => break,
            }
            step += 1;
        }
        Ok((step, at))
    }

    pub(super) fn steps(
        &self,
        range: Range<usize>,
        bytes: &mut [u8],
        start: usize,
        scratch: &mut Scratch,
    ) -> Result<usize, Fault> {
        let (mut step, mut at) = (range.start, start);
        while step < range.end {
            let body = step + 1;
            step += 1;
            match &self.steps[body - 1] {
                Step::Skip { size, count } => at = span(bytes, at, *size, *count)?.end,
                Step::Bytes(count) => at = span(bytes, at, 1, *count)?.end,
                Step::Singles { .. } | Step::Doubles { .. } | Step::Integers { .. } => {
                    at = self.convert(body - 1, bytes, at, 1)?;
                }
                Step::Marked { count, number } => {
                    let size = number.size();
                    let range = span(bytes, at, size, *count)?;
                    at = range.end;
                    let marks = range.step_by(size).map(|at| (at, *number));
                    scratch.marks.extend(marks);
                }
                Step::Group {
                    end,
                    formula,
                    fixed,
                } => {
                    if let Some(behind) = fixed.as_ref().and_then(|of| of.run(bytes, at)) {
                        at = behind;
                        step = *end;
                        continue;
                    }
                    let first = scratch.marks.len();
                    scratch.marks.reserve(formula.outputs.len());
                    at = self.steps(body..*end, bytes, at, scratch)?;
                    let result = formula.run(bytes, scratch, first);
                    scratch.marks.truncate(first);
                    result.map_err(|rejected| match rejected {
                        Rejected::Value(at) => Fault::Value(at),
                        Rejected::Outside(at, outside) => Fault::Outside(at, outside),
                        Rejected::Overflow(at) => Fault::Overflow(at),
                    })?;
                    step = *end;
                }
                Step::KeptNumber(number) => {
                    let range = span(bytes, at, number.size(), 1)?;
                    at = range.end;
                    scratch.numbers.push((range.start, *number));
                }
                Step::KeptText => {
                    let (length, behind) = length(bytes, at)?;
                    at = span(bytes, behind, 1, length)?.end;
                    scratch.texts.push((behind, length));
                }
                Step::Text => {
                    let (length, behind) = length(bytes, at)?;
                    at = span(bytes, behind, 1, length)?.end;
                }
                Step::Sequence { end, record } => {
                    let (length, behind) = length(bytes, at)?;
                    let record = record.as_ref();
                    at = self.elements((body..*end, record), bytes, (behind, length), scratch)?;
                    step = *end;
                }
                Step::Array { count, end, record } => {
                    let record = record.as_ref();
                    at = self.elements((body..*end, record), bytes, (at, *count), scratch)?;
                    step = *end;
                }
                Step::Bounded {
                    bound,
                    padding,
                    stride,
                    end,
                    record,
                } => {
                    let (length, behind) = length(bytes, at)?;
                    let items = span(bytes, behind, 1, *padding)?.end;
                    let size = stride.saturating_mul(*bound);
                    at = span(bytes, items, 1, size)?.end;
                    let length = length.min(*bound);
                    let groups = record.as_ref().and_then(|record| {
                        let is_aligned = items.is_multiple_of(record.align);
                        let fits = record.size == *stride && is_aligned;
                        Some((record, record.marks.as_ref().filter(|_| fits)?))
                    });
                    if let Some((record, marks)) = groups {
                        let body = (body..*end, record, marks);
                        self.groups(body, bytes, (items, length), scratch)?;
                    } else if self.packed(&(body..*end)) == Some(*stride) {
                        self.repeat(body..*end, bytes, (items, length), scratch)?;
                    } else {
                        for index in 0..length {
                            self.steps(body..*end, bytes, items + index * stride, scratch)?;
                        }
                    }
                    step = *end;
                }
            }
        }
        Ok(at)
    }

    /// The bytes of the body of a loop, if it has numbers of one type only.
    fn packed(&self, body: &Range<usize>) -> Option<usize> {
        match self.steps.get(body.clone())? {
            [Step::Singles { count, .. }] => count.checked_mul(4),
            [Step::Doubles { count, .. }] => count.checked_mul(8),
            [Step::Integers { count, number, .. }] => count.checked_mul(number.size()),
            _ => None,
        }
    }

    /// Runs the body of a loop for all elements at once if they have one layout, else one by one.
    fn elements(
        &self,
        (body, record): (Range<usize>, Option<&Record>),
        bytes: &mut [u8],
        (at, count): (usize, usize),
        scratch: &mut Scratch,
    ) -> Result<usize, Fault> {
        let aligned = record.and_then(|record| {
            let start = next_multiple(at, record.first)?;
            start
                .is_multiple_of(record.align)
                .then_some((record, start))
        });
        let Some((record, start)) = aligned.filter(|_| count > 0) else {
            return self.repeat(body, bytes, (at, count), scratch);
        };
        if let Some(marks) = &record.marks {
            return self.groups((body, record, marks), bytes, (start, count), scratch);
        }
        let all = span(bytes, start, 1, record.size.saturating_mul(count))?;
        let mut offset = 0;
        for step in &self.steps[body] {
            let (size, count) = step.numbers();
            offset = next_multiple(offset, size).unwrap_or(offset);
            let numbers = offset..offset + size * count;
            offset = numbers.end;
            let elements = bytes[all.clone()].chunks_exact_mut(record.size);
            for (element, bytes) in elements.enumerate() {
                let bytes = &mut bytes[numbers.clone()];
                let result = match step {
                    Step::Singles { factor, .. } => singles(bytes, factor),
                    Step::Doubles { factor, .. } => doubles(bytes, factor),
                    Step::Integers {
                        number, conversion, ..
                    } => integers(bytes, *number, conversion),
                    _ => break,
                };
                result.map_err(|at| {
                    Fault::Overflow(all.start + element * record.size + numbers.start + at)
                })?;
            }
        }
        Ok(all.end)
    }

    /// Runs the formula of a loop of groups for all elements, a block at a time. Single steps find
    /// what a block cannot, such as which number is refused.
    fn groups(
        &self,
        (body, record, marks): (Range<usize>, &Record, &Marks),
        bytes: &mut [u8],
        (start, count): (usize, usize),
        scratch: &mut Scratch,
    ) -> Result<usize, Fault> {
        let all = span(bytes, start, 1, record.size.saturating_mul(count))?;
        let Some(Step::Group { formula, fixed, .. }) =
            self.steps.get(body.start).filter(|_| count >= FEWEST)
        else {
            return self.repeat(body, bytes, (start, count), scratch);
        };
        let mut done = 0;
        while done < count {
            let rest = all.start + done * record.size..all.end;
            done += match fixed {
                Some(fixed) => fixed.kernel.run_all(&mut bytes[rest], record.size),
                None => scratch.lanes.run(
                    (formula, &scratch.transforms),
                    marks,
                    &mut bytes[rest],
                    record.size,
                ),
            };
            let single = BLOCK.min(count - done);
            let at = all.start + done * record.size;
            self.repeat(body.clone(), bytes, (at, single), scratch)?;
            done += single;
        }
        Ok(all.end)
    }

    /// Runs the body of a loop `times` times.
    fn repeat(
        &self,
        body: Range<usize>,
        bytes: &mut [u8],
        (start, times): (usize, usize),
        scratch: &mut Scratch,
    ) -> Result<usize, Fault> {
        // An empty sequence has no alignment.
        if body.is_empty() || times == 0 {
            return Ok(start);
        }
        match &self.steps[body.clone()] {
            // Each element ends where the next one begins, so one step takes all.
            [Step::Skip { size, count }] => {
                return Ok(span(bytes, start, *size, count.saturating_mul(times))?.end);
            }
            [Step::Bytes(count)] => {
                return Ok(span(bytes, start, 1, count.saturating_mul(times))?.end);
            }
            [Step::Singles { .. } | Step::Doubles { .. } | Step::Integers { .. }] => {
                return self.convert(body.start, bytes, start, times);
            }
            _ => {}
        }
        let mut at = start;
        for _ in 0..times {
            at = self.steps(body.clone(), bytes, at, scratch)?;
        }
        Ok(at)
    }

    /// Converts the numbers of a step, `times` times as many.
    fn convert(
        &self,
        step: usize,
        bytes: &mut [u8],
        at: usize,
        times: usize,
    ) -> Result<usize, Fault> {
        match &self.steps[step] {
            Step::Singles { count, factor } => {
                let range = span(bytes, at, 4, count.saturating_mul(times))?;
                singles(&mut bytes[range.clone()], factor)
                    .map_err(|offset| Fault::Overflow(range.start + offset))?;
                Ok(range.end)
            }
            Step::Doubles { count, factor } => {
                let range = span(bytes, at, 8, count.saturating_mul(times))?;
                doubles(&mut bytes[range.clone()], factor)
                    .map_err(|offset| Fault::Overflow(range.start + offset))?;
                Ok(range.end)
            }
            Step::Integers {
                count,
                number,
                conversion,
            } => {
                let range = span(bytes, at, number.size(), count.saturating_mul(times))?;
                integers(&mut bytes[range.clone()], *number, conversion)
                    .map_err(|offset| Fault::Overflow(range.start + offset))?;
                Ok(range.end)
            }
            _ => Ok(at),
        }
    }
}
