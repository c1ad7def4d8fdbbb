//! The values of a formula, from the numbers of a message.

use crate::fault::Outside;
use crate::formula::{Formula, Operand};
use crate::lanes::Lanes;
use crate::number::Stored;
use alloc::vec::Vec;
use rc_quantity::rotation::LOCKED;
use rc_vocabulary::Primitive;

/// The numbers that a program works on. It keeps its memory from group to group.
#[derive(Default)]
pub(crate) struct Scratch {
    /// The places of the numbers of all groups that are open.
    pub(crate) marks: Vec<(usize, Primitive)>,
    /// The numbers of one group, then the values of its steps.
    values: Vec<f64>,
    /// Those of many groups.
    pub(crate) lanes: Lanes,
    /// The numbers of the transforms of the message.
    pub(crate) transforms: Vec<f64>,
    /// The parts of a message that changes of frames need: where texts begin and how long they are.
    pub(crate) texts: Vec<(usize, usize)>,
    /// Where numbers are.
    pub(crate) numbers: Vec<(usize, Primitive)>,
    /// Whether a formula has met a gimbal lock.
    pub(crate) is_locked: bool,
}

/// Why a formula gives no values, and at which byte.
pub(crate) enum Rejected {
    Value(usize),
    Outside(usize, Outside),
    Overflow(usize),
}

impl Formula {
    /// Converts the numbers at the marks from `first`. Fails with the place of a number that the
    /// formula refuses, or that its type cannot hold.
    pub(crate) fn run(
        &self,
        bytes: &mut [u8],
        scratch: &mut Scratch,
        first: usize,
    ) -> Result<(), Rejected> {
        let Scratch {
            marks,
            values,
            transforms,
            is_locked,
            ..
        } = scratch;
        let marks = marks.get(first..).unwrap_or_default();
        let start = marks.first().map_or(0, |(at, _)| *at);
        if marks.len() != self.outputs.len() {
            return Err(Rejected::Value(start));
        }
        values.clear();
        values.reserve(marks.len() + self.steps.len());
        let numbers = marks.iter().map(|(at, number)| number.read(bytes, *at));
        values.extend(numbers);
        let is_finite = values.iter().all(|value| value.is_finite());
        let inputs = values.len();
        for step in &self.steps {
            let mut operands = [0.0; 4];
            for (operand, value) in operands.iter_mut().zip(&step.operands) {
                *operand = value.of(values, inputs, transforms);
            }
            let value = step.operation.apply(operands);
            let [found, least, most, _] = operands;
            let outside = || Rejected::Outside(start, Outside::new([found, least, most]));
            values.push(value.ok_or_else(outside)?);
        }
        let mut locks = self.locks.iter();
        *is_locked |= locks.any(|of| of.of(values, inputs, transforms) < LOCKED);
        for (own, ((at, number), output)) in (0..).zip(marks.iter().zip(&self.outputs)) {
            if *output == Operand::Input(own) {
                // It keeps its bits.
                continue;
            }
            let fits = number.write(bytes, *at, output.of(values, inputs, transforms));
            if !fits || is_finite && !number.read(bytes, *at).is_finite() {
                return Err(Rejected::Overflow(*at));
            }
        }
        Ok(())
    }
}
