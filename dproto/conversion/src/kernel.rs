//! Formulas that only move and scale numbers, as those of other units and axes, without the steps of
//! an interpreter.

mod norm;
mod packed;
mod scaled;
mod triple;

use crate::formula::{Formula, Operand, Operation};
use alloc::vec::Vec;
use norm::Norm;
use packed::{Packed, Wide};
use rc_vocabulary::Primitive;
use scaled::{Scale, scaled};
use triple::Triple;

/// How many numbers of a group a kernel takes.
const COUNTS: core::ops::RangeInclusive<usize> = 2..=8;

/// A formula in which each number is one number of the group times a factor. The numbers are
/// neighbours of one type.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    numbers: Numbers,
    /// Over many elements, if there are three numbers of 4 bytes without conditions.
    triple: Option<Triple>,
}

/// How the numbers are stored and computed: 2 or 3, or from 4 to 8.
#[derive(Clone, Debug)]
enum Numbers {
    FewSingles(Packed<f32, 2>),
    Singles(Packed<f32, 4>),
    /// Stored as `float32`, computed as `float64`.
    FewWide(Packed<Wide, 2>),
    Wide(Packed<Wide, 4>),
    FewDoubles(Packed<f64, 2>),
    Doubles(Packed<f64, 4>),
}

impl Kernel {
    /// The kernel of a formula over numbers at these offsets. `None` if it does more than move and
    /// scale floating-point numbers.
    pub(crate) fn new(formula: &Formula, marks: &[(usize, Primitive)]) -> Option<Self> {
        let &(first, number) = marks.first()?;
        let mut expected = (first..).step_by(number.size());
        let are_neighbours = marks
            .iter()
            .all(|(at, own)| *own == number && Some(*at) == expected.next());
        let is_whole = marks.len() == formula.outputs.len() && formula.locks.is_empty();
        if !are_neighbours || !COUNTS.contains(&marks.len()) || !is_whole {
            return None;
        }
        let outputs = (0_u32..).zip(&formula.outputs).map(|(own, output)| {
            if *output == Operand::Input(own) {
                return Some((own as usize, Scale::default()));
            }
            let (from, scale, is_single) = scaled(formula, *output)?;
            (from < marks.len() && !(is_single && number == Primitive::F64))
                .then_some((from, scale))
        });
        let outputs = outputs.collect::<Option<Vec<_>>>()?;
        let required = formula.steps.iter();
        let required = required.filter(|step| step.operation == Operation::Require);
        let norms = required.map(|step| Norm::new(formula, step));
        let norms = norms.collect::<Option<Vec<_>>>()?;
        let are_few = marks.len() < 4;
        let are_single = outputs.iter().all(|(_, scale)| scale.is_single());
        let is_triple = number == Primitive::F32 && norms.is_empty();
        let triple = Triple::new(first, &outputs).filter(|_| is_triple);
        let outputs = outputs.as_slice();
        let numbers = match number {
            Primitive::F32 => match (are_single, are_few) {
                (true, true) => Numbers::FewSingles(Packed::new(first, outputs, norms)),
                (true, false) => Numbers::Singles(Packed::new(first, outputs, norms)),
                (false, true) => Numbers::FewWide(Packed::new(first, outputs, norms)),
                (false, false) => Numbers::Wide(Packed::new(first, outputs, norms)),
            },
            Primitive::F64 if are_few => Numbers::FewDoubles(Packed::new(first, outputs, norms)),
            Primitive::F64 => Numbers::Doubles(Packed::new(first, outputs, norms)),
            _ => return None,
        };
        Some(Self { numbers, triple })
    }

    /// Converts one element, unless a number is refused or not finite: then it stays as it is, and
    /// the result is `false`.
    #[inline]
    pub(crate) fn run(&self, element: &mut [u8]) -> bool {
        match &self.numbers {
            Numbers::FewSingles(numbers) => numbers.run(element),
            Numbers::Singles(numbers) => numbers.run(element),
            Numbers::FewWide(numbers) => numbers.run(element),
            Numbers::Wide(numbers) => numbers.run(element),
            Numbers::FewDoubles(numbers) => numbers.run(element),
            Numbers::Doubles(numbers) => numbers.run(element),
        }
    }

    /// Converts elements of `size` bytes that fill `bytes`, up to the first one that is refused, or
    /// the first block with one. Returns how many elements are converted.
    pub(crate) fn run_all(&self, bytes: &mut [u8], size: usize) -> usize {
        if let Some(triple) = &self.triple {
            return triple.run_all(bytes, size);
        }
        let mut elements = bytes.chunks_exact_mut(size.max(1));
        let count = elements.len();
        elements
            .position(|element| !self.run(element))
            .unwrap_or(count)
    }
}
