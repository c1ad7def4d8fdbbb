//! The steps of a program, and how they are made of the values of a message.

use super::layout::{Fixed, Record, next_multiple};
use crate::formula::Formula;
use crate::item::Item;
use crate::lanes::Marks;
use alloc::boxed::Box;
use alloc::vec::Vec;
use rc_quantity::{Conversion, Factor};
use rc_vocabulary::Primitive;

/// A step. `end` is the step after the body of a loop.
#[derive(Clone, Debug)]
pub(super) enum Step {
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
    /// The inputs of a change of frames.
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

/// Appends the steps of values. Loops without values, and empty arrays, have none.
pub(super) fn add(steps: &mut Vec<Step>, items: &[Item]) {
    for item in items {
        let open = steps.len();
        match item {
            Item::Numbers(count, number, None) => steps.push(Step::Skip {
                size: number.size(),
                count: *count as usize,
            }),
            Item::Numbers(..) | Item::KeptNumber(_, Some(_)) => {
                let (count, number, conversion) = match item {
                    Item::Numbers(count, number, Some(conversion)) => (*count, number, conversion),
                    Item::KeptNumber(number, Some(conversion)) => (1, number, conversion),
                    _ => continue,
                };
                let count = count as usize;
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
                let record = layout(&steps[open + 1..], Some(Marks::default()));
                let fixed = record.and_then(|record| Fixed::new(record, &formula));
                let fixed = fixed.map(Box::new);
                steps[open] = Step::Group {
                    end,
                    formula,
                    fixed,
                };
            }
            Item::KeptNumber(number, None) => steps.push(Step::KeptNumber(*number)),
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

impl Step {
    /// The size of its numbers, and how many there are. 0 for a loop or a text.
    pub(super) fn numbers(&self) -> (usize, usize) {
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
