//! The flat program that converts the numbers of a message where they are.

use crate::fault::Fault;
use crate::item::Item;
use crate::number::Number;
use alloc::vec::Vec;
use core::ops::Range;
use rc_quantity::{Conversion, Factor};

/// Converts the numbers of a message. The bytes keep their places.
#[derive(Clone, Debug)]
pub struct Program {
    steps: Vec<Step>,
}

/// A step. `end` is the step behind the body of a loop.
#[derive(Clone, Debug)]
enum Step {
    /// Numbers of this size that stay as they are.
    Skip {
        size: usize,
        count: usize,
    },
    /// Bytes that stay as they are.
    Bytes(usize),
    /// Floating-point numbers of 4 bytes.
    Singles {
        count: usize,
        factor: Factor,
    },
    /// Floating-point numbers of 8 bytes.
    Doubles {
        count: usize,
        factor: Factor,
    },
    /// Integers.
    Integers {
        count: usize,
        number: Number,
        conversion: Conversion,
    },
    Text,
    Sequence {
        end: usize,
    },
    Array {
        count: usize,
        end: usize,
    },
    Bounded {
        bound: usize,
        padding: usize,
        stride: usize,
        end: usize,
    },
}

impl Program {
    /// The program that converts these values.
    #[must_use]
    pub fn new(items: &[Item]) -> Self {
        let mut steps = Vec::new();
        add(&mut steps, items);
        Self { steps }
    }

    /// Converts a message, whose values begin at byte `at`. Alignment counts from the start of
    /// `bytes`. NaN and infinite numbers stay what they are. Returns where the values end.
    ///
    /// # Errors
    /// The message is too short, or holds a number that its type cannot hold in the other unit.
    pub fn run(&self, bytes: &mut [u8], at: usize) -> Result<usize, Fault> {
        self.steps(0..self.steps.len(), bytes, at)
    }

    fn steps(&self, range: Range<usize>, bytes: &mut [u8], start: usize) -> Result<usize, Fault> {
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
                Step::Text => {
                    let (length, behind) = length(bytes, at)?;
                    at = span(bytes, behind, 1, length)?.end;
                }
                Step::Sequence { end } => {
                    let (length, behind) = length(bytes, at)?;
                    at = self.repeat(body..*end, bytes, behind, length)?;
                    step = *end;
                }
                Step::Array { count, end } => {
                    at = self.repeat(body..*end, bytes, at, *count)?;
                    step = *end;
                }
                Step::Bounded {
                    bound,
                    padding,
                    stride,
                    end,
                } => {
                    let (length, behind) = length(bytes, at)?;
                    let items = span(bytes, behind, 1, *padding)?.end;
                    let size = stride.saturating_mul(*bound);
                    at = span(bytes, items, 1, size)?.end;
                    let length = length.min(*bound);
                    if self.packed(&(body..*end)) == Some(*stride) {
                        self.repeat(body..*end, bytes, items, length)?;
                    } else {
                        for index in 0..length {
                            self.steps(body..*end, bytes, items + index * stride)?;
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

    /// Runs the body of a loop `times` times.
    fn repeat(
        &self,
        body: Range<usize>,
        bytes: &mut [u8],
        start: usize,
        times: usize,
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
            at = self.steps(body.clone(), bytes, at)?;
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

/// Appends the steps of values. Loops without values, and arrays of nothing, have none.
fn add(steps: &mut Vec<Step>, items: &[Item]) {
    for item in items {
        let open = steps.len();
        match item {
            Item::Numbers(count, number, None) => steps.push(Step::Skip {
                size: number.size(),
                count: *count as usize,
            }),
            Item::Numbers(count, number, Some(conversion)) => {
                let count = *count as usize;
                steps.push(match number {
                    Number::F32 => Step::Singles {
                        count,
                        factor: conversion.factor(),
                    },
                    Number::F64 => Step::Doubles {
                        count,
                        factor: conversion.factor(),
                    },
                    number => Step::Integers {
                        count,
                        number: *number,
                        conversion: *conversion,
                    },
                });
            }
            Item::Bytes(count) => steps.push(Step::Bytes(*count as usize)),
            Item::Text => steps.push(Step::Text),
            Item::Sequence(items) => {
                steps.push(Step::Sequence { end: 0 });
                add(steps, items);
                let behind = steps.len();
                steps[open] = Step::Sequence { end: behind };
            }
            Item::Array(count, items) => {
                steps.push(Step::Array { count: 0, end: 0 });
                add(steps, items);
                let behind = steps.len();
                steps[open] = Step::Array {
                    count: *count as usize,
                    end: behind,
                };
                if behind == open + 1 {
                    steps.pop();
                }
            }
            Item::Bounded {
                bound,
                padding,
                stride,
                items,
            } => {
                steps.push(Step::Text);
                add(steps, items);
                let behind = steps.len();
                steps[open] = Step::Bounded {
                    bound: *bound as usize,
                    padding: *padding as usize,
                    stride: *stride as usize,
                    end: behind,
                };
            }
        }
    }
}

/// The range of `count` numbers of `size` bytes behind `at`.
fn span(bytes: &[u8], at: usize, size: usize, count: usize) -> Result<Range<usize>, Fault> {
    let start = at.checked_next_multiple_of(size);
    let end = start.and_then(|start| start.checked_add(size.checked_mul(count)?));
    match (start, end) {
        (Some(start), Some(end)) if end <= bytes.len() => Ok(start..end),
        _ => Err(Fault::Truncated(at.min(bytes.len()))),
    }
}

/// The number of elements that follows, and the byte behind it.
fn length(bytes: &[u8], at: usize) -> Result<(usize, usize), Fault> {
    let range = span(bytes, at, 4, 1)?;
    let mut number = [0; 4];
    number.copy_from_slice(&bytes[range.clone()]);
    Ok((u32::from_le_bytes(number) as usize, range.end))
}

/// Converts numbers of 4 bytes. Fails with the offset of the first one that does not fit.
fn singles(bytes: &mut [u8], factor: &Factor) -> Result<(), usize> {
    let (items, _) = bytes.as_chunks_mut::<4>();
    let mut overflows = false;
    let convert = |value: f32| {
        #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
        let converted = factor.apply(f64::from(value)) as f32;
        converted
    };
    // One pass without branches, which the compiler turns into vector instructions.
    for item in items.iter_mut() {
        let value = f32::from_le_bytes(*item);
        let converted = convert(value);
        overflows |= converted.is_infinite() & value.is_finite();
        *item = converted.to_le_bytes();
    }
    if !overflows {
        return Ok(());
    }
    let infinite = |item: &[u8; 4]| f32::from_le_bytes(*item).is_infinite();
    Err(items.iter().position(infinite).unwrap_or(0) * 4)
}

/// Converts numbers of 8 bytes. Fails as [`singles`].
fn doubles(bytes: &mut [u8], factor: &Factor) -> Result<(), usize> {
    let (items, _) = bytes.as_chunks_mut::<8>();
    let mut overflows = false;
    for item in items.iter_mut() {
        let value = f64::from_le_bytes(*item);
        let converted = factor.apply(value);
        overflows |= converted.is_infinite() & value.is_finite();
        *item = converted.to_le_bytes();
    }
    if !overflows {
        return Ok(());
    }
    let infinite = |item: &[u8; 8]| f64::from_le_bytes(*item).is_infinite();
    Err(items.iter().position(infinite).unwrap_or(0) * 8)
}

/// Converts integers. Fails with the offset of the first one that does not fit.
fn integers(bytes: &mut [u8], number: Number, conversion: &Conversion) -> Result<(), usize> {
    let size = number.size();
    let is_signed = matches!(number, Number::I8 | Number::I16 | Number::I32 | Number::I64);
    let bits = 8 * size;
    for (index, item) in bytes.chunks_exact_mut(size).enumerate() {
        let mut wide = [0; 16];
        wide[..size].copy_from_slice(item);
        if is_signed && item[size - 1] >= 0x80 {
            wide[size..].fill(0xff);
        }
        let converted = conversion.apply_integer(i128::from_le_bytes(wide));
        let (least, most) = if is_signed {
            (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1)
        } else {
            (0, (1_i128 << bits) - 1)
        };
        let converted = converted.filter(|value| (least..=most).contains(value));
        let bytes = converted.ok_or(index * size)?.to_le_bytes();
        item.copy_from_slice(&bytes[..size]);
    }
    Ok(())
}
