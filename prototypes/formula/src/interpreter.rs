//! Runs a formula without printed code and without allocation.

use crate::program::{Operand, Operation, Program, Rejected};
use rc_quantity::Real;

/// The most operands of an operation other than a call.
const OPERANDS: usize = 4;

/// A formula with the memory that it needs. Each run computes in it and allocates nothing.
#[derive(Clone, Debug)]
pub struct Interpreter {
    inputs: usize,
    steps: Vec<Step>,
    /// Operations that are rare, with their operands.
    others: Vec<(Operation, [u32; OPERANDS], usize)>,
    /// The places of the outputs.
    outputs: Vec<u32>,
    /// The constants, then the values of the steps.
    values: Vec<f64>,
    constants: usize,
}

/// An operation whose operands are values at these places. Its own value comes next.
#[derive(Clone, Copy, Debug)]
enum Step {
    Input(u32),
    Negate(u32),
    Add(u32, u32),
    Subtract(u32, u32),
    Multiply(u32, u32),
    Divide(u32, u32),
    Sine(u32),
    Cosine(u32),
    Other(u32),
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
        let nodes = program.nodes().iter().flat_map(|node| &node.operands);
        let all = nodes.chain(program.results());
        let mut constants: Vec<u64> = all
            .filter_map(|operand| match operand {
                Operand::Constant(bits) => Some(*bits),
                Operand::Node(_) => None,
            })
            .collect();
        constants.sort_unstable();
        constants.dedup();
        let slot = |operand: &Operand| match operand {
            Operand::Constant(bits) => place(constants.binary_search(bits).unwrap_or_default()),
            Operand::Node(at) => place(constants.len() + at),
        };
        let (mut steps, mut others) = (Vec::with_capacity(program.nodes().len()), Vec::new());
        for node in program.nodes() {
            let mut slots = [0; OPERANDS];
            if node.operands.len() > OPERANDS {
                return Err(Rejected::Count);
            }
            for (slot_of, operand) in slots.iter_mut().zip(&node.operands) {
                *slot_of = slot(operand)?;
            }
            let [a, b, ..] = slots;
            steps.push(match &node.operation {
                Operation::Input(at) => Step::Input(place(*at)?),
                Operation::Negate => Step::Negate(a),
                Operation::Add => Step::Add(a, b),
                Operation::Subtract => Step::Subtract(a, b),
                Operation::Multiply => Step::Multiply(a, b),
                Operation::Divide => Step::Divide(a, b),
                Operation::Sine => Step::Sine(a),
                Operation::Cosine => Step::Cosine(a),
                other => {
                    others.push((other.clone(), slots, node.operands.len()));
                    Step::Other(place(others.len() - 1)?)
                }
            });
        }
        let outputs = program.results().iter().map(slot);
        let outputs = outputs.collect::<Result<Vec<u32>, Rejected>>()?;
        let mut values: Vec<f64> = constants.iter().map(|bits| f64::from_bits(*bits)).collect();
        values.resize(constants.len() + steps.len(), 0.0);
        Ok(Self {
            inputs: program.inputs(),
            steps,
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
        for (at, step) in self.steps.iter().enumerate() {
            let of = |place: u32| self.values[place as usize];
            let value = match *step {
                Step::Input(at) => input[at as usize],
                Step::Negate(a) => -of(a),
                Step::Add(a, b) => of(a) + of(b),
                Step::Subtract(a, b) => of(a) - of(b),
                Step::Multiply(a, b) => of(a) * of(b),
                Step::Divide(a, b) => of(a) / of(b),
                Step::Sine(a) => of(a).sine(),
                Step::Cosine(a) => of(a).cosine(),
                Step::Other(other) => {
                    let (operation, places, count) = &self.others[other as usize];
                    operation.apply(&places.map(of)[..*count])?
                }
            };
            self.values[self.constants + at] = value;
        }
        for (number, place) in output.iter_mut().zip(&self.outputs) {
            *number = self.values[*place as usize];
        }
        Ok(())
    }
}
