//! Runs a formula without printed code and without allocation.

use crate::program::{Operand, Operation, Program, Rejected};
use rc_quantity::Real;

/// The most operands of an operation other than a call.
const OPERANDS: usize = 4;

/// A formula with the memory that it needs. Each run computes in it and allocates nothing.
///
/// Operations that do not wait for each other are computed by their kinds, so that a processor does not have
/// to guess the next one.
#[derive(Clone, Debug)]
pub struct Interpreter {
    inputs: usize,
    /// Operations of one kind, one after the other, and how many they are.
    runs: Vec<(Kind, usize)>,
    /// The operands of each operation: places of values, of the input, or of another operation.
    steps: Vec<[u32; 2]>,
    /// Operations that are rare, with their operands.
    others: Vec<(Operation, [u32; OPERANDS], usize)>,
    /// The places of the outputs.
    outputs: Vec<u32>,
    /// The constants, then the values of the steps.
    values: Vec<f64>,
    constants: usize,
}

/// The kind of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Input,
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Sine,
    Cosine,
    Other,
}

impl Kind {
    fn of(operation: &Operation) -> Self {
        match operation {
            Operation::Input(_) => Self::Input,
            Operation::Negate => Self::Negate,
            Operation::Add => Self::Add,
            Operation::Subtract => Self::Subtract,
            Operation::Multiply => Self::Multiply,
            Operation::Divide => Self::Divide,
            Operation::Sine => Self::Sine,
            Operation::Cosine => Self::Cosine,
            _ => Self::Other,
        }
    }
}

/// The order in which nodes are computed: each after its operands, and kinds together. With levels: no node is on
/// that of its operands.
fn order(program: &Program) -> Vec<(usize, usize)> {
    let mut levels: Vec<usize> = Vec::with_capacity(program.nodes().len());
    for node in program.nodes() {
        let below = node.operands.iter().filter_map(|operand| match operand {
            Operand::Node(at) => Some(levels[*at] + 1),
            Operand::Constant(_) => None,
        });
        let level = below.max().unwrap_or_default();
        levels.push(level);
    }
    let mut order: Vec<(usize, usize)> = levels.into_iter().enumerate().collect();
    order.sort_by_key(|(at, level)| (*level, Kind::of(&program.nodes()[*at].operation)));
    order
}

/// Computes operations of one kind from the values before them.
fn each(values: (&[f64], &mut [f64]), run: &[[u32; 2]], operation: impl Fn(f64, f64) -> f64) {
    let (known, next) = values;
    for (value, [a, b]) in next.iter_mut().zip(run) {
        *value = operation(known[*a as usize], known[*b as usize]);
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
        let order = order(program);
        let mut places = vec![0; order.len()];
        for (at, (node, _)) in order.iter().enumerate() {
            places[*node] = constants.len() + at;
        }
        let slot = |operand: &Operand| match operand {
            Operand::Constant(bits) => place(constants.binary_search(bits).unwrap_or_default()),
            Operand::Node(at) => place(places[*at]),
        };
        let mut runs: Vec<(Kind, usize)> = Vec::new();
        let mut level_before = 0;
        let (mut steps, mut others) = (Vec::with_capacity(order.len()), Vec::new());
        for (at, level) in &order {
            let node = &program.nodes()[*at];
            let mut slots = [0; OPERANDS];
            if node.operands.len() > OPERANDS {
                return Err(Rejected::Count);
            }
            for (slot_of, operand) in slots.iter_mut().zip(&node.operands) {
                *slot_of = slot(operand)?;
            }
            let kind = Kind::of(&node.operation);
            steps.push(match &node.operation {
                Operation::Input(at) => [place(*at)?, 0],
                other if kind == Kind::Other => {
                    others.push((other.clone(), slots, node.operands.len()));
                    [place(others.len() - 1)?, 0]
                }
                _ => [slots[0], slots[1]],
            });
            match runs.last_mut() {
                Some((last, count)) if *last == kind && *level == level_before => *count += 1,
                _ => runs.push((kind, 1)),
            }
            level_before = *level;
        }
        let outputs = program.results().iter().map(slot);
        let outputs = outputs.collect::<Result<Vec<u32>, Rejected>>()?;
        let mut values: Vec<f64> = constants.iter().map(|bits| f64::from_bits(*bits)).collect();
        values.resize(constants.len() + steps.len(), 0.0);
        Ok(Self {
            inputs: program.inputs(),
            runs,
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
        let (mut steps, mut at) = (self.steps.as_slice(), self.constants);
        for (kind, count) in &self.runs {
            let (run, rest) = steps.split_at(*count);
            // The operands of a run are before it.
            let (known, next) = self.values.split_at_mut(at);
            match kind {
                Kind::Add => each((known, next), run, |a, b| a + b),
                Kind::Subtract => each((known, next), run, |a, b| a - b),
                Kind::Multiply => each((known, next), run, |a, b| a * b),
                Kind::Divide => each((known, next), run, |a, b| a / b),
                Kind::Negate => each((known, next), run, |a, _| -a),
                Kind::Sine => each((known, next), run, |a, _| a.sine()),
                Kind::Cosine => each((known, next), run, |a, _| a.cosine()),
                Kind::Input => {
                    for (value, [place, _]) in next.iter_mut().zip(run) {
                        *value = input[*place as usize];
                    }
                }
                Kind::Other => {
                    for (value, [other, _]) in next.iter_mut().zip(run) {
                        let (operation, places, count) = &self.others[*other as usize];
                        *value = operation
                            .apply(&places.map(|place| known[place as usize])[..*count])?;
                    }
                }
            }
            (steps, at) = (rest, at + count);
        }
        for (number, place) in output.iter_mut().zip(&self.outputs) {
            *number = self.values[*place as usize];
        }
        Ok(())
    }
}
