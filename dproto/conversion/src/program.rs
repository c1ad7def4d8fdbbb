//! The flat program that converts the numbers of a message where they are.

use crate::fault::Fault;
use crate::formula::{Formula, Rejected, Scratch};
use crate::item::Item;
use crate::kernel::Kernel;
use crate::lanes::Marks;
use crate::moves::{Frame, Move, Needed, Transform};
use crate::number::Stored;
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;
use rc_quantity::{Conversion, Factor};
use rc_vocabulary::Primitive;

/// Converts the numbers of a message. The bytes keep their places.
#[derive(Clone, Debug)]
pub struct Program {
    steps: Vec<Step>,
    /// The transforms that it takes.
    moves: Vec<Move>,
    /// Finds the values that these need, and converts nothing.
    looks: Option<Box<Program>>,
}

/// How many elements of a block that is refused run by single steps.
const BLOCK: usize = 64;
/// The fewest elements for which a block is made.
const FEWEST: usize = 16;

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
        number: Primitive,
        conversion: Conversion,
    },
    /// Numbers of the group around them.
    Marked {
        count: usize,
        number: Primitive,
    },
    Group {
        end: usize,
        formula: Formula,
        /// If its numbers have fixed places, and are only moved and scaled.
        fixed: Option<Box<Fixed>>,
    },
    Text,
    /// What a change of frames needs.
    KeptNumber(Primitive),
    KeptText,
    Sequence {
        end: usize,
        record: Option<Record>,
    },
    Array {
        count: usize,
        end: usize,
        record: Option<Record>,
    },
    Bounded {
        bound: usize,
        padding: usize,
        stride: usize,
        end: usize,
        record: Option<Record>,
    },
}

/// Appends the values of a message as they are, without the groups around them.
fn looked_at(out: &mut Vec<Item>, items: &[Item]) {
    let below = |items: &[Item]| {
        let mut out = Vec::new();
        looked_at(&mut out, items);
        out
    };
    for item in items {
        out.push(match item {
            Item::Numbers(count, number, _) | Item::Marked(count, number) => {
                Item::Numbers(*count, *number, None)
            }
            Item::Group { items, .. } => {
                looked_at(out, items);
                continue;
            }
            Item::Sequence(items) => Item::Sequence(below(items)),
            Item::Array(count, items) => Item::Array(*count, below(items)),
            Item::Bounded {
                bound,
                padding,
                stride,
                items,
            } => Item::Bounded {
                bound: *bound,
                padding: *padding,
                stride: *stride,
                items: below(items),
            },
            other => other.clone(),
        });
    }
}

/// A text of a message, without the zero at its end.
fn text(bytes: &[u8], place: Option<&(usize, usize)>) -> Result<String, Fault> {
    let (at, length) = *place.ok_or(Fault::Value(0))?;
    let text = at.checked_add(length).and_then(|end| bytes.get(at..end));
    let text = text.map(|text| text.strip_suffix(&[0]).unwrap_or(text));
    let text = text.and_then(|text| core::str::from_utf8(text).ok());
    text.map(String::from).ok_or(Fault::Value(at))
}

/// The layout of the elements of a loop without inner loops and texts: each begins where the one
/// before ends, and its numbers have the same offsets.
#[derive(Clone, Debug)]
struct Record {
    /// Bytes of an element.
    size: usize,
    /// The greatest alignment, which divides the size.
    align: usize,
    /// That of the first number.
    first: usize,
    /// The numbers of the only group of an element, if nothing else is converted.
    marks: Option<Marks>,
}

/// The layout of a group without loops and texts, with its kernel.
#[derive(Clone, Debug)]
struct Fixed {
    record: Record,
    kernel: Kernel,
}

impl Fixed {
    fn new(body: &[Step], formula: &Formula) -> Option<Self> {
        let record = layout(body, Some(Marks::default()))?;
        let kernel = Kernel::new(formula, &record.marks.as_ref()?.0)?;
        Some(Self { record, kernel })
    }

    /// Converts the group behind byte `at`, and returns where it ends. `None` if single steps have to
    /// do it, or to say what is wrong.
    #[inline]
    fn run(&self, bytes: &mut [u8], at: usize) -> Option<usize> {
        let start = next_multiple(at, self.record.first)?;
        if !start.is_multiple_of(self.record.align) {
            return None;
        }
        let end = start.checked_add(self.record.size)?;
        let group = bytes.get_mut(start..end)?;
        self.kernel.run(group).then_some(end)
    }
}

impl Program {
    /// The program that converts these values.
    #[must_use]
    pub fn new(items: &[Item]) -> Self {
        let mut steps = Vec::new();
        add(&mut steps, items);
        Self {
            steps,
            moves: Vec::new(),
            looks: None,
        }
    }

    /// The same program, whose formulas take transforms. `items` are those of the program.
    #[must_use]
    pub fn with_moves(mut self, moves: &[Move], items: &[Item]) -> Self {
        if !moves.is_empty() {
            let mut seen = Vec::new();
            looked_at(&mut seen, items);
            while seen
                .last()
                .is_some_and(|last| !matches!(last, Item::KeptNumber(_) | Item::KeptText))
            {
                seen.pop();
            }
            self.looks = Some(Box::new(Self::new(&seen)));
            self.moves = moves.to_vec();
        }
        self
    }

    /// Whether a message needs transforms: then [`Self::needed`] says which ones.
    #[must_use]
    pub fn takes_transforms(&self) -> bool {
        !self.moves.is_empty()
    }

    /// The transforms that a message needs, whose values begin at byte `at`. The bytes stay as they
    /// are.
    ///
    /// # Errors
    /// The message is too short, has no name of a frame, or a time that is none.
    pub fn needed(&self, bytes: &mut [u8], at: usize) -> Result<Vec<Needed<'_>>, Fault> {
        let mut scratch = Scratch::default();
        if let Some(looks) = &self.looks {
            looks.steps(0..looks.steps.len(), bytes, at, &mut scratch)?;
        }
        let mut out = Vec::with_capacity(self.moves.len());
        for one in &self.moves {
            let from = match &one.from {
                Frame::Named(name) => name.clone(),
                Frame::Kept(at) => text(bytes, scratch.texts.get(*at as usize))?,
            };
            let mut time = 0_i128;
            for (number, unit) in &one.stamp {
                let place = scratch.numbers.get(*number as usize).copied();
                let (at, number) = place.ok_or(Fault::Value(at))?;
                let part = number.times(bytes, at, *unit).ok_or(Fault::Value(at))?;
                time = time.saturating_add(part);
            }
            let time = i64::try_from(time).map_err(|_| Fault::Value(at))?;
            let to = one.to.as_str();
            out.push(Needed { from, to, time });
        }
        Ok(out)
    }

    /// Converts a message as [`Self::run`] does, with the transforms that [`Self::needed`] asks for.
    ///
    /// # Errors
    /// As [`Self::run`]; a transform is missing.
    pub fn run_with(
        &self,
        bytes: &mut [u8],
        at: usize,
        transforms: &[Transform],
    ) -> Result<usize, Fault> {
        if transforms.len() != self.moves.len() {
            return Err(Fault::Value(at));
        }
        let mut scratch = Scratch::default();
        scratch.transforms.extend(transforms.iter().flatten());
        self.steps(0..self.steps.len(), bytes, at, &mut scratch)
    }

    /// Converts a message, whose values begin at byte `at`. Alignment counts from the start of
    /// `bytes`. NaN and infinite numbers stay what they are. Returns where the values end.
    ///
    /// # Errors
    /// The message is too short, or holds a number that its type cannot hold in the other unit.
    pub fn run(&self, bytes: &mut [u8], at: usize) -> Result<usize, Fault> {
        self.run_with(bytes, at, &[])
    }

    fn steps(
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

    /// Runs the formula of a loop of groups for all elements, a block at a time. What a block cannot
    /// tell, such as which number is refused, single steps do.
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
                    Primitive::F32 => Step::Singles {
                        count,
                        factor: conversion.factor(),
                    },
                    Primitive::F64 => Step::Doubles {
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
            Item::Marked(count, number) => steps.push(Step::Marked {
                count: *count as usize,
                number: *number,
            }),
            Item::Group { items, formula } => {
                steps.push(Step::Text);
                add(steps, items);
                let end = steps.len();
                let formula = formula.clone();
                let fixed = Fixed::new(&steps[open + 1..], &formula).map(Box::new);
                steps[open] = Step::Group {
                    end,
                    formula,
                    fixed,
                };
            }
            Item::KeptNumber(number) => steps.push(Step::KeptNumber(*number)),
            Item::KeptText => steps.push(Step::KeptText),
            Item::Bytes(count) => steps.push(Step::Bytes(*count as usize)),
            Item::Text => steps.push(Step::Text),
            Item::Sequence(items) => {
                steps.push(Step::Text);
                add(steps, items);
                let behind = steps.len();
                steps[open] = Step::Sequence {
                    end: behind,
                    record: record(&steps[open + 1..]),
                };
            }
            Item::Array(count, items) => {
                steps.push(Step::Text);
                add(steps, items);
                let behind = steps.len();
                steps[open] = Step::Array {
                    count: *count as usize,
                    end: behind,
                    record: record(&steps[open + 1..]),
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
                    record: record(&steps[open + 1..]),
                };
            }
        }
    }
}

impl Step {
    /// The size of its numbers, and how many there are. 0 for a loop or a text.
    fn numbers(&self) -> (usize, usize) {
        match self {
            Self::Skip { size, count } => (*size, *count),
            Self::Bytes(count) => (1, *count),
            Self::Singles { count, .. } => (4, *count),
            Self::Doubles { count, .. } => (8, *count),
            Self::Integers { count, number, .. } => (number.size(), *count),
            Self::Marked { .. }
            | Self::Group { .. }
            | Self::KeptNumber(_)
            | Self::KeptText
            | Self::Text
            | Self::Sequence { .. }
            | Self::Array { .. }
            | Self::Bounded { .. } => (0, 0),
        }
    }
}

/// The layout of the elements of a loop with this body, if all elements have one.
fn record(body: &[Step]) -> Option<Record> {
    let [first, _, ..] = body else {
        // One step takes all elements anyway.
        return None;
    };
    let record = match first {
        Step::Group { .. } => layout(&body[1..], Some(Marks::default())),
        _ => layout(body, None),
    };
    // Otherwise elements that follow each other begin at different alignments.
    record.filter(|record| record.size.is_multiple_of(record.align))
}

/// The layout of numbers that follow each other. `marks` are those of a group, if it is one.
fn layout(body: &[Step], mut marks: Option<Marks>) -> Option<Record> {
    let (mut size, mut align) = (0_usize, 1);
    for step in body {
        let (one, count) = match (step, &mut marks) {
            (Step::Marked { count, number }, Some(_)) => (number.size(), *count),
            // Only the formula converts numbers of a group.
            (Step::Singles { .. } | Step::Doubles { .. } | Step::Integers { .. }, Some(_)) => {
                return None;
            }
            (step, _) => step.numbers(),
        };
        if one == 0 {
            return None;
        }
        let start = next_multiple(size, one)?;
        size = start.checked_add(one.checked_mul(count)?)?;
        align = align.max(one);
        if let (Step::Marked { number, .. }, Some(Marks(marks))) = (step, &mut marks) {
            marks.extend((start..size).step_by(one).map(|at| (at, *number)));
        }
    }
    let first = match body.first()? {
        Step::Marked { number, .. } => number.size(),
        step => step.numbers().0,
    };
    Some(Record {
        size,
        align,
        first,
        marks,
    })
}

/// The next multiple of a power of 2.
#[inline]
fn next_multiple(at: usize, size: usize) -> Option<usize> {
    let mask = size.wrapping_sub(1);
    Some(at.checked_add(mask)? & !mask)
}

/// The range of `count` numbers of `size` bytes behind `at`.
#[inline]
fn span(bytes: &[u8], at: usize, size: usize, count: usize) -> Result<Range<usize>, Fault> {
    let start = next_multiple(at, size);
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
    match factor.fraction() {
        Some((numerator, denominator)) => {
            singles_by(bytes, |value| value * numerator / denominator)
        }
        None => singles_by(bytes, |value| factor.apply(value)),
    }
}

#[inline]
fn singles_by(bytes: &mut [u8], convert: impl Fn(f64) -> f64) -> Result<(), usize> {
    let (items, _) = bytes.as_chunks_mut::<4>();
    let mut overflows = false;
    // One pass without branches, which the compiler turns into vector instructions.
    for item in items.iter_mut() {
        let value = f32::from_le_bytes(*item);
        #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
        let converted = convert(f64::from(value)) as f32;
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
    match factor.fraction() {
        Some((numerator, denominator)) => {
            doubles_by(bytes, |value| value * numerator / denominator)
        }
        None => doubles_by(bytes, |value| factor.apply(value)),
    }
}

#[inline]
fn doubles_by(bytes: &mut [u8], convert: impl Fn(f64) -> f64) -> Result<(), usize> {
    let (items, _) = bytes.as_chunks_mut::<8>();
    let mut overflows = false;
    for item in items.iter_mut() {
        let value = f64::from_le_bytes(*item);
        let converted = convert(value);
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
fn integers(bytes: &mut [u8], number: Primitive, conversion: &Conversion) -> Result<(), usize> {
    let size = number.size();
    let (least, most) = number.whole_limits().unwrap_or_default();
    let is_signed = least < 0;
    for (index, item) in bytes.chunks_exact_mut(size).enumerate() {
        let mut wide = [0; 16];
        wide[..size].copy_from_slice(item);
        if is_signed && item[size - 1] >= 0x80 {
            wide[size..].fill(0xff);
        }
        let converted = conversion.apply_integer(i128::from_le_bytes(wide));
        let converted = converted.filter(|value| (least..=most).contains(value));
        let bytes = converted.ok_or(index * size)?.to_le_bytes();
        item.copy_from_slice(&bytes[..size]);
    }
    Ok(())
}
