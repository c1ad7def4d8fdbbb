//! A formula as a list of operations, and its computation.

use rc_quantity::Real;
use rc_vocabulary::{Class, Primitive};
use std::fmt;

/// An operation. The numbers of its operands are computed before.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// The number at this place of the input.
    Input(usize),
    /// The opposite.
    Negate,
    /// The sum.
    Add,
    /// The first operand without the second one.
    Subtract,
    /// The product.
    Multiply,
    /// The first operand over the second one.
    Divide,
    /// The square root.
    Root,
    /// The greatest integer that is not above.
    Floor,
    /// The nearest integer; away from zero in the middle.
    Nearest,
    /// The sine of an angle in radians.
    Sine,
    /// The cosine of an angle in radians.
    Cosine,
    /// The angle of the point `(x, y)` of the operands y and x.
    Angle,
    /// The length of the vector of both operands.
    Length,
    /// The third operand if the first one is below the second one, else the fourth one.
    IfBelow,
    /// As a number of this kind.
    Store(Primitive),
    /// The operand, which must be from the first to the second number, given by their bits.
    Require(u64, u64),
    /// A function of the user.
    Call {
        /// Its name.
        function: String,
        /// The number of its results.
        results: usize,
    },
    /// The result at this place of the function in the operand.
    Result(usize),
}

/// An operation with its operands.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Node {
    /// The operation.
    pub operation: Operation,
    /// With which numbers, in the order that the operation names.
    pub operands: Vec<Operand>,
}

/// An operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operand {
    /// A number that is known, by its bits.
    Constant(u64),
    /// The value of the node at this place.
    Node(usize),
}

/// Whether each number of one kind is one of the other kind, exactly.
pub fn fits(number: Primitive, wanted: Primitive) -> bool {
    let integers = |of: Primitive| match (of.class(), of.size()) {
        (Class::Bool, _) => Some((0, 1)),
        (Class::Signed | Class::Unsigned, _) => of.limits(),
        (Class::Float, _) => None,
    };
    // A float has all integers up to this one.
    let is_short = wanted == Primitive::F32;
    let digits = if is_short {
        f32::MANTISSA_DIGITS
    } else {
        f64::MANTISSA_DIGITS
    };
    let whole = 1_i128 << digits;
    match (integers(number), integers(wanted)) {
        (Some((least, most)), Some((low, high))) => low <= least && most <= high,
        (Some((least, most)), None) => -whole <= least && most <= whole,
        (None, Some(_)) => false,
        (None, None) => number == wanted || wanted == Primitive::F64,
    }
}

/// The least and the greatest `f64` that are numbers of an integer type.
pub(crate) fn limits(number: Primitive) -> Option<(f64, f64)> {
    let (least, most) = number.limits()?;
    #[expect(clippy::cast_precision_loss, reason = "rounded, and taken back below")]
    let (low, high) = (least as f64, most as f64);
    // The greatest numbers of 64 bits are not f64: the next one below.
    #[expect(clippy::cast_possible_truncation, reason = "within the range of i128")]
    let is_above = high as i128 > most;
    Some((low, if is_above { high.next_down() } else { high }))
}

/// The nearest integer; away from zero in the middle.
fn nearest(value: f64) -> f64 {
    value.round()
}

/// The range that is required of a covariance: of its pivots, and of how far it is symmetric.
pub const NOT_NEGATIVE: (f64, f64) = (0.0, f64::MAX);

/// The input of a program is refused, or a function of the user is missing.
#[derive(Clone, Debug, PartialEq)]
pub enum Rejected {
    /// A number is not in its range: a norm that is not 1, or an integer that does not fit.
    Value {
        /// The number.
        value: f64,
        /// The least one.
        least: f64,
        /// The greatest one.
        most: f64,
    },
    /// The formula calls this function, which only printed code can.
    Function(String),
    /// There are too few or too many numbers.
    Count,
}

impl fmt::Display for Rejected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value { value, most, .. } if *most >= NOT_NEGATIVE.1 => write!(
                f,
                "the covariance is not symmetric or not positive: {value} is not at least 0"
            ),
            Self::Value { value, least, most } if most <= least => {
                write!(f, "{value} is not {most}")
            }
            Self::Value { value, least, most } => {
                write!(f, "{value} is not from {least} to {most}")
            }
            Self::Function(name) => write!(f, "the function `{name}` is not part of the formula"),
            Self::Count => f.write_str("the formula has another number of values"),
        }
    }
}

impl std::error::Error for Rejected {}

impl Operation {
    /// The value for these operands.
    pub(crate) fn apply(&self, operands: &[f64]) -> Result<f64, Rejected> {
        let at = |at: usize| operands.get(at).copied().ok_or(Rejected::Count);
        Ok(match self {
            Self::Negate => -at(0)?,
            Self::Add => at(0)? + at(1)?,
            Self::Subtract => at(0)? - at(1)?,
            Self::Multiply => at(0)? * at(1)?,
            Self::Divide => at(0)? / at(1)?,
            Self::Root => at(0)?.root(),
            Self::Floor => at(0)?.floor(),
            Self::Nearest => nearest(at(0)?),
            Self::Sine => at(0)?.sine(),
            Self::Cosine => at(0)?.cosine(),
            Self::Angle => at(0)?.angle_over(at(1)?),
            Self::Length => at(0)?.length_with(at(1)?),
            Self::IfBelow => at(0)?.if_below(at(1)?, at(2)?, at(3)?),
            Self::Store(number) => match limits(*number) {
                Some((least, most)) => required(nearest(at(0)?), least, most)?,
                None => single(at(0)?, *number),
            },
            Self::Require(least, most) => {
                required(at(0)?, f64::from_bits(*least), f64::from_bits(*most))?
            }
            Self::Call { function, .. } => return Err(Rejected::Function(function.clone())),
            Self::Input(_) | Self::Result(_) => return Err(Rejected::Count),
        })
    }

    /// The least and the greatest value that it lets pass.
    pub fn range(&self) -> Option<(f64, f64)> {
        match self {
            Self::Require(least, most) => Some((f64::from_bits(*least), f64::from_bits(*most))),
            Self::Store(number) => limits(*number),
            _ => None,
        }
    }

    /// Whether its value may differ in the last bits between mathematical libraries.
    pub fn is_transcendental(&self) -> bool {
        matches!(self, Self::Sine | Self::Cosine | Self::Angle | Self::Length)
    }
}

fn required(value: f64, least: f64, most: f64) -> Result<f64, Rejected> {
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(Rejected::Value { value, least, most })
}

/// As a number of 32 bits, if requested. A number beyond their range is infinite.
fn single(value: f64, number: Primitive) -> f64 {
    #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
    let narrow = value as f32;
    match (number.class(), number.size()) {
        (Class::Float, ..=4) => f64::from(narrow),
        (Class::Float | Class::Bool | Class::Signed | Class::Unsigned, _) => value,
    }
}

/// A formula: operations in their order, and which of their values it gives.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Program {
    pub(crate) inputs: usize,
    pub(crate) nodes: Vec<Node>,
    pub(crate) outputs: Vec<Operand>,
    pub(crate) locks: Vec<Operand>,
}

impl Program {
    /// The nodes that the outputs need, and requirements with the nodes that they need.
    pub(crate) fn new(
        inputs: usize,
        nodes: Vec<Node>,
        outputs: Vec<Operand>,
        locks: &[usize],
    ) -> Self {
        let mut needed = vec![false; nodes.len()];
        let need = |operand: &Operand, needed: &mut Vec<bool>| {
            if let Operand::Node(at) = operand
                && let Some(one) = needed.get_mut(*at)
            {
                *one = true;
            }
        };
        outputs.iter().for_each(|output| need(output, &mut needed));
        for (at, node) in nodes.iter().enumerate().rev() {
            if matches!(node.operation, Operation::Require(..)) {
                needed[at] = true;
            }
            if needed[at] {
                node.operands.iter().for_each(|of| need(of, &mut needed));
            }
        }
        let mut places = vec![0; nodes.len()];
        let mut kept: Vec<Node> = Vec::new();
        let placed = |operand: Operand, places: &[usize]| match operand {
            Operand::Node(at) => Operand::Node(places[at]),
            constant @ Operand::Constant(_) => constant,
        };
        for (at, mut node) in nodes.into_iter().enumerate() {
            if needed[at] {
                places[at] = kept.len();
                for operand in &mut node.operands {
                    *operand = placed(*operand, &places);
                }
                kept.push(node);
            }
        }
        let outputs = outputs.into_iter().map(|of| placed(of, &places)).collect();
        let locks = locks.iter().filter(|at| needed[**at]);
        let locks = locks.map(|at| Operand::Node(places[*at])).collect();
        Self {
            inputs,
            nodes: kept,
            outputs,
            locks,
        }
    }

    /// The number of values that the formula takes.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// The number of values that it gives.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Whether it has functions whose last bits differ between mathematical libraries.
    pub fn is_transcendental(&self) -> bool {
        let mut nodes = self.nodes.iter();
        nodes.any(|node| node.operation.is_transcendental())
    }

    /// The nodes on which the outputs depend. A node that only a requirement needs changes no
    /// result.
    fn contributing(&self) -> impl Iterator<Item = &Node> {
        let mut needed = vec![false; self.nodes.len()];
        let need = |of: &Operand, needed: &mut Vec<bool>| {
            if let Operand::Node(at) = of
                && let Some(known) = needed.get_mut(*at)
            {
                *known = true;
            }
        };
        self.outputs.iter().for_each(|of| need(of, &mut needed));
        for (at, node) in self.nodes.iter().enumerate().rev() {
            if needed[at] {
                node.operands.iter().for_each(|of| need(of, &mut needed));
            }
        }
        self.nodes
            .iter()
            .zip(needed)
            .filter_map(|(node, is_needed)| is_needed.then_some(node))
    }

    /// Whether it changes no value but in place and sign.
    pub fn is_exact(&self) -> bool {
        let mut nodes = self.contributing();
        nodes.all(|node| matches!(node.operation, Operation::Input(_) | Operation::Negate))
    }

    /// Whether each output is an input times a constant, so that relative errors stay as they are.
    pub fn is_scaling(&self) -> bool {
        let is_constant = |of: Option<&Operand>| matches!(of, Some(Operand::Constant(_)));
        self.contributing().all(|node| {
            let (one, other) = (node.operands.first(), node.operands.get(1));
            match node.operation {
                Operation::Input(_)
                | Operation::Negate
                | Operation::Store(Primitive::F32 | Primitive::F64) => true,
                Operation::Multiply => is_constant(one) || is_constant(other),
                Operation::Divide => is_constant(other),
                _ => false,
            }
        })
    }

    /// Values of operations: where one is below [`LOCKED`](rc_quantity::rotation::LOCKED), three turns
    /// that the formula gives are at a gimbal lock.
    pub fn locks(&self) -> &[Operand] {
        &self.locks
    }

    /// The values that it gives, in their order.
    pub fn results(&self) -> &[Operand] {
        &self.outputs
    }

    /// The same operations, with the values at these places of its results.
    #[must_use]
    pub fn with_results(&self, order: &[usize]) -> Self {
        let outputs = order.iter().map(|at| self.outputs[*at]).collect();
        Self {
            outputs,
            ..self.clone()
        }
    }

    /// Whether all numbers that are known in it are finite.
    pub fn is_finite(&self) -> bool {
        let operands = self.nodes.iter().flat_map(|node| &node.operands);
        let is_finite = |of: &Operand| match of {
            Operand::Constant(bits) => f64::from_bits(*bits).is_finite(),
            Operand::Node(_) => true,
        };
        operands.chain(&self.outputs).all(is_finite)
    }

    /// Whether it has results for any input that is finite and not too large: it has no
    /// requirements, and divides by no number of the input.
    pub fn is_total(&self) -> bool {
        self.nodes.iter().all(|node| match node.operation {
            Operation::Require(..) | Operation::Root | Operation::Call { .. } => false,
            Operation::Store(number) => number.limits().is_none(),
            Operation::Divide => matches!(node.operands.get(1), Some(Operand::Constant(_))),
            _ => true,
        })
    }

    /// Its operations, in their order.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Whether its values depend on its input.
    pub fn takes_input(&self) -> bool {
        let mut nodes = self.nodes.iter();
        nodes.any(|node| matches!(node.operation, Operation::Input(_)))
    }

    /// The functions of the user that it calls, with how many numbers they take and give.
    pub fn calls(&self) -> impl Iterator<Item = (&str, (usize, usize))> {
        self.nodes.iter().filter_map(|node| match &node.operation {
            Operation::Call { function, results } => {
                Some((function.as_str(), (node.operands.len(), *results)))
            }
            _ => None,
        })
    }

    /// The functions of the user that it calls.
    pub fn functions(&self) -> impl Iterator<Item = &str> {
        self.calls().map(|(function, _)| function)
    }

    /// Computes the formula.
    ///
    /// # Errors
    /// The numbers are too few or too many, one is out of its range, or the formula calls a function
    /// of the user.
    pub fn run(&self, input: &[f64]) -> Result<Vec<f64>, Rejected> {
        if input.len() != self.inputs {
            return Err(Rejected::Count);
        }
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        let value = |operand: &Operand, values: &[f64]| match operand {
            Operand::Constant(bits) => f64::from_bits(*bits),
            Operand::Node(at) => values[*at],
        };
        let mut operands = Vec::new();
        for node in &self.nodes {
            operands.clear();
            operands.extend(node.operands.iter().map(|of| value(of, &values)));
            values.push(match &node.operation {
                Operation::Input(at) => input[*at],
                other => other.apply(&operands)?,
            });
        }
        Ok(self.outputs.iter().map(|of| value(of, &values)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::fits;
    use rc_vocabulary::Primitive;

    #[test]
    fn a_type_fits_if_the_other_one_has_all_its_numbers() {
        let wider = |number: Primitive| {
            let all = Primitive::ALL.into_iter();
            let all = all.filter(|&other| other != number && fits(number, other));
            all.map(Primitive::word).collect::<Vec<_>>().join(" ")
        };
        let found = Primitive::ALL.map(|number| format!("{}: {}", number.word(), wider(number)));
        let expected = [
            "bool: int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64",
            "int8: int16 int32 int64 float32 float64",
            "uint8: int16 uint16 int32 uint32 int64 uint64 float32 float64",
            "int16: int32 int64 float32 float64",
            "uint16: int32 uint32 int64 uint64 float32 float64",
            "int32: int64 float64",
            "uint32: int64 uint64 float64",
            "int64: ",
            "uint64: ",
            "float32: float64",
            "float64: ",
        ];
        assert_eq!(found, expected);
    }
}
