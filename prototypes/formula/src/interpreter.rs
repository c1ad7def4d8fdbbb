//! Runs a formula without printed code and without allocation.

use crate::program::{Operand, Operation, Program, Rejected};
use rc_quantity::Real;

/// The most operands of an operation other than a call.
const OPERANDS: usize = 4;

/// A formula with the memory that it needs. Each run computes in it and allocates nothing.
///
/// Operations that do not wait for each other are computed by their kinds, so that a processor does not have
/// to guess the next one. A product that one sum alone needs is computed with it, and rounded as before.
#[derive(Clone, Debug)]
pub struct Interpreter {
    inputs: usize,
    /// Operations of one kind, one after the other, and how many they are.
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

/// The kind of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Sine,
    Cosine,
    Other,
    /// `a * b + c`
    ProductAndOne,
    /// `a * b - c`
    ProductLessOne,
    /// `c - a * b`
    OneLessProduct,
    /// `a * b + c * d`
    ProductAndProduct,
    /// `a * b - c * d`
    ProductLessProduct,
}

impl Kind {
    fn of(operation: &Operation) -> Self {
        match operation {
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

    fn is_long(self) -> bool {
        self >= Self::ProductAndOne
    }
}

/// An operation with the products that it computes, too.
struct Step {
    kind: Kind,
    node: usize,
    operands: Vec<Operand>,
    /// No step is on the level of its operands.
    level: usize,
}

/// The steps of a formula, each after its operands, and kinds together.
fn steps(program: &Program) -> Vec<Step> {
    let nodes = program.nodes();
    let mut uses = vec![0_usize; nodes.len()];
    let operands = nodes.iter().flat_map(|node| &node.operands);
    for operand in operands.chain(program.results()) {
        if let Operand::Node(at) = operand {
            uses[*at] += 1;
        }
    }
    // The factors of a product that nothing else needs.
    let product = |operand: &Operand| match operand {
        Operand::Node(at) if uses[*at] == 1 && nodes[*at].operation == Operation::Multiply => {
            Some((*at, nodes[*at].operands.as_slice()))
        }
        _ => None,
    };
    let mut is_part = vec![false; nodes.len()];
    let mut steps = Vec::new();
    for (at, node) in nodes.iter().enumerate() {
        let (kind, operands) = match (&node.operation, node.operands.as_slice()) {
            (Operation::Input(_), _) => continue,
            (operation @ (Operation::Add | Operation::Subtract), [one, other]) => {
                let is_sum = *operation == Operation::Add;
                match (product(one), product(other)) {
                    (Some((first, one)), Some((second, other))) if first != second => {
                        (is_part[first], is_part[second]) = (true, true);
                        let kind = if is_sum {
                            Kind::ProductAndProduct
                        } else {
                            Kind::ProductLessProduct
                        };
                        (kind, [one, other].concat())
                    }
                    (Some((first, factors)), _) => {
                        is_part[first] = true;
                        let kind = if is_sum {
                            Kind::ProductAndOne
                        } else {
                            Kind::ProductLessOne
                        };
                        (kind, [factors, &[*other]].concat())
                    }
                    (None, Some((second, factors))) => {
                        is_part[second] = true;
                        // A sum is the same in both orders.
                        let kind = if is_sum {
                            Kind::ProductAndOne
                        } else {
                            Kind::OneLessProduct
                        };
                        (kind, [factors, &[*one]].concat())
                    }
                    (None, None) => (Kind::of(operation), node.operands.clone()),
                }
            }
            (operation, operands) => (Kind::of(operation), operands.to_vec()),
        };
        steps.push(Step {
            kind,
            node: at,
            operands,
            level: 0,
        });
    }
    steps.retain(|step| !is_part[step.node]);
    let mut levels = vec![0; nodes.len()];
    for step in &mut steps {
        let below = step.operands.iter().filter_map(|operand| match operand {
            Operand::Node(at) => Some(levels[*at] + 1),
            Operand::Constant(_) => None,
        });
        step.level = below.max().unwrap_or_default();
        levels[step.node] = step.level;
    }
    steps.sort_by_key(|step| (step.level, step.kind));
    steps
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
        let before = constants.len() + program.inputs();
        let steps = steps(program);
        let mut places = vec![0; program.nodes().len()];
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
        let mut runs: Vec<(Kind, usize)> = Vec::new();
        let mut level_before = 0;
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
            match runs.last_mut() {
                Some((last, count)) if *last == step.kind && step.level == level_before => {
                    *count += 1;
                }
                _ => runs.push((step.kind, 1)),
            }
            level_before = step.level;
        }
        let outputs = program.results().iter().map(slot);
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
                    Kind::ProductAndOne => each_long(values, run, |[a, b, c, _]| a * b + c),
                    Kind::ProductLessOne => each_long(values, run, |[a, b, c, _]| a * b - c),
                    Kind::OneLessProduct => each_long(values, run, |[a, b, c, _]| c - a * b),
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
                Kind::Negate => each(values, run, |a, _| -a),
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
