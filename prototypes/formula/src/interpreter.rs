//! Runs a formula without printed code and without allocation.

mod steps;
#[cfg(test)]
mod tests;

use crate::program::{Operand, Operation, Program, Rejected};
use rc_quantity::Real;
use steps::{Kind, Ordered, steps};

/// The most operands of an operation other than a call.
const OPERANDS: usize = 4;

/// A formula with the memory that it needs. Each run computes in it and allocates nothing.
///
/// Operations that do not wait for each other are computed by their kinds, so that a processor does not have
/// to guess the next one. A product that one sum alone needs is computed with it, and rounded as before.
#[derive(Clone, Debug)]
pub struct Interpreter {
    inputs: usize,
    /// Operations of one kind that do not wait for each other, and how many they are.
    runs: Vec<(Kind, usize)>,
    /// The operands of each operation of one or two: places of values, or of another operation.
    short: Vec<[u32; 2]>,
    /// The operands of each operation of three or four.
    long: Vec<[u32; OPERANDS]>,
    /// Operations that are rare, with their operands.
    others: Vec<(Operation, [u32; OPERANDS], usize)>,
    /// The places of the outputs.
    outputs: Vec<u32>,
    /// The constants, then the input, then the values of the operations.
    values: Vec<f64>,
    constants: usize,
}

/// Computes operations of one kind from the values before them.
fn each(values: (&[f64], &mut [f64]), run: &[[u32; 2]], operation: impl Fn(f64, f64) -> f64) {
    let (known, next) = values;
    for (value, [a, b]) in next.iter_mut().zip(run) {
        *value = operation(known[*a as usize], known[*b as usize]);
    }
}

/// Computes sums of products from the values before them.
fn each_long(
    values: (&[f64], &mut [f64]),
    run: &[[u32; OPERANDS]],
    operation: impl Fn([f64; OPERANDS]) -> f64,
) {
    let (known, next) = values;
    for (value, places) in next.iter_mut().zip(run) {
        *value = operation(places.map(|place| known[place as usize]));
    }
}

impl Interpreter {
    /// The interpreter of a formula.
    ///
    /// # Errors
    /// The formula calls a function of the user, or is too long.
    pub fn new(program: &Program) -> Result<Self, Rejected> {
        if let Some(function) = program.functions().next() {
            return Err(Rejected::Function(function.to_owned()));
        }
        let place = |at: usize| u32::try_from(at).map_err(|_| Rejected::Count);
        let Ordered {
            steps,
            runs,
            results,
        } = steps(program);
        let used = steps.iter().flat_map(|step| &step.operands);
        let all = used.chain(&results);
        let mut constants: Vec<u64> = all
            .filter_map(|operand| match operand {
                Operand::Constant(bits) => Some(*bits),
                Operand::Node(_) => None,
            })
            .collect();
        constants.sort_unstable();
        constants.dedup();
        let before = constants.len() + program.inputs();
        // Those of nodes and of their opposites.
        let mut places = vec![0; 2 * program.nodes().len()];
        for (at, node) in program.nodes().iter().enumerate() {
            if let Operation::Input(input) = node.operation {
                places[at] = constants.len() + input;
            }
        }
        for (at, step) in steps.iter().enumerate() {
            places[step.node] = before + at;
        }
        let slot = |operand: &Operand| match operand {
            Operand::Constant(bits) => place(constants.binary_search(bits).unwrap_or_default()),
            Operand::Node(at) => place(places[*at]),
        };
        let (mut short, mut long, mut others) = (Vec::new(), Vec::new(), Vec::new());
        for step in &steps {
            let mut slots = [0; OPERANDS];
            if step.operands.len() > OPERANDS {
                return Err(Rejected::Count);
            }
            for (slot_of, operand) in slots.iter_mut().zip(&step.operands) {
                *slot_of = slot(operand)?;
            }
            if step.kind.is_long() {
                long.push(slots);
            } else if step.kind == Kind::Other {
                let operation = program.nodes()[step.node].operation.clone();
                others.push((operation, slots, step.operands.len()));
                short.push([place(others.len() - 1)?, 0]);
            } else {
                short.push([slots[0], slots[1]]);
            }
        }
        let outputs = results.iter().map(slot);
        let outputs = outputs.collect::<Result<Vec<u32>, Rejected>>()?;
        let mut values: Vec<f64> = constants.iter().map(|bits| f64::from_bits(*bits)).collect();
        values.resize(before + steps.len(), 0.0);
        Ok(Self {
            inputs: program.inputs(),
            runs,
            short,
            long,
            others,
            outputs,
            constants: constants.len(),
            values,
        })
    }

    /// How many numbers it takes.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// How many numbers it gives.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Computes the formula. Nothing is allocated.
    ///
    /// # Errors
    /// There are more or fewer numbers of input or output, or one is out of its range.
    pub fn run(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), Rejected> {
        if input.len() != self.inputs || output.len() != self.outputs.len() {
            return Err(Rejected::Count);
        }
        let mut at = self.constants + self.inputs;
        self.values[self.constants..at].copy_from_slice(input);
        let (mut shorts, mut longs) = (self.short.as_slice(), self.long.as_slice());
        for (kind, count) in &self.runs {
            // The operands of a run are before it.
            let (known, next) = self.values.split_at_mut(at);
            let values = (&*known, next);
            at += count;
            if kind.is_long() {
                let (run, rest) = longs.split_at(*count);
                longs = rest;
                match kind {
                    Kind::ProductAndProduct => each_long(values, run, |[a, b, c, d]| a * b + c * d),
                    _ => each_long(values, run, |[a, b, c, d]| a * b - c * d),
                }
                continue;
            }
            let (run, rest) = shorts.split_at(*count);
            shorts = rest;
            match kind {
                Kind::Add => each(values, run, |a, b| a + b),
                Kind::Subtract => each(values, run, |a, b| a - b),
                Kind::Multiply => each(values, run, |a, b| a * b),
                Kind::Divide => each(values, run, |a, b| a / b),
                Kind::Sine => each(values, run, |a, _| a.sine()),
                Kind::Cosine => each(values, run, |a, _| a.cosine()),
                _ => {
                    let (known, next) = values;
                    for (value, [other, _]) in next.iter_mut().zip(run) {
                        let (operation, places, count) = &self.others[*other as usize];
                        *value = operation
                            .apply(&places.map(|place| known[place as usize])[..*count])?;
                    }
                }
            }
        }
        for (number, place) in output.iter_mut().zip(&self.outputs) {
            *number = self.values[*place as usize];
        }
        Ok(())
    }
}
