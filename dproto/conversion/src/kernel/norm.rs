//! Conditions: the length of a vector is in a range.

use crate::formula::{Formula, Operand, Operation, Step};
use alloc::vec::Vec;

/// The length of a vector of these numbers of a group is in a range.
#[derive(Clone, Debug)]
pub(super) struct Norm {
    of: Vec<usize>,
    /// The least and the greatest sum of squares.
    sums: (f64, f64),
}

impl Norm {
    /// The length that a step requires: the root of a sum of squares.
    pub(super) fn new(formula: &Formula, required: &Step) -> Option<Self> {
        let step = |operand: &Operand| match operand {
            Operand::Step(at) => formula.steps.get(*at as usize),
            _ => None,
        };
        let [length, Operand::Constant(least), Operand::Constant(most)] = required.operands[..]
        else {
            return None;
        };
        let root = step(&length).filter(|step| step.operation == Operation::Root)?;
        let mut of = Vec::new();
        let mut rest = step(root.operands.first()?)?;
        let square = |of: &Step| match of.operands[..] {
            [Operand::Input(one), Operand::Input(other)]
                if one == other && of.operation == Operation::Multiply =>
            {
                Some(one as usize)
            }
            _ => None,
        };
        // The sum is from left to right, so its last term is the outermost one.
        while rest.operation == Operation::Add {
            of.push(square(step(rest.operands.get(1)?)?)?);
            rest = step(rest.operands.first()?)?;
        }
        of.push(square(rest)?);
        of.reverse();
        let [least, most] = [least, most].map(f64::from_bits);
        // Roots have the order of their squares, so nothing has to be computed but sums.
        let root = |bits: u64| libm::sqrt(f64::from_bits(bits));
        let below = first(|bits| root(bits) >= least)?;
        let above = first(|bits| root(bits) > most)?;
        let sums = (f64::from_bits(below), f64::from_bits(above.checked_sub(1)?));
        Some(Self { of, sums })
    }

    /// Calls the numbers by other places.
    pub(super) fn placed(&mut self, place: impl Fn(usize) -> usize) {
        self.of.iter_mut().for_each(|of| *of = place(*of));
    }

    #[inline]
    pub(super) fn holds(&self, number: impl Fn(usize) -> f64) -> bool {
        let mut squares = self.of.iter().map(|at| {
            let number = number(*at);
            number * number
        });
        let first = squares.next().unwrap_or(f64::NAN);
        let sum = squares.fold(first, |sum, square| sum + square);
        (self.sums.0..=self.sums.1).contains(&sum)
    }
}

/// The first number from 0 to infinity, by its bits, from which a condition holds.
fn first(holds: impl Fn(u64) -> bool) -> Option<u64> {
    let (mut least, mut most) = (0, f64::INFINITY.to_bits());
    if !holds(most) {
        return None;
    }
    while least < most {
        let middle = least + (most - least) / 2;
        if holds(middle) {
            most = middle;
        } else {
            least = middle + 1;
        }
    }
    Some(least)
}
