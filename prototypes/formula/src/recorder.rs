//! Records the operations of a formula while it is computed with terms instead of numbers.

use crate::program::{Node, Operand, Operation, Program, fits};
use rc_quantity::Real;
use rc_vocabulary::{Class, Primitive};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The operations so far. Equal operations are recorded once.
pub struct Recorder {
    inputs: usize,
    state: RefCell<State>,
}

#[derive(Default)]
struct State {
    nodes: Vec<Node>,
    known: HashMap<Node, usize>,
    /// How the value of each node is stored exactly.
    numbers: Vec<Primitive>,
    /// The nodes whose values tell a gimbal lock.
    locks: Vec<usize>,
}

/// A number of a formula: one that is known, or what an operation gives.
#[derive(Clone, Copy)]
pub enum Term<'r> {
    /// It is known.
    Constant(f64),
    /// The value of the node at this place of the recorder.
    Node(&'r Recorder, usize),
}

impl Recorder {
    /// The recorder of a formula over so many numbers.
    pub fn new(inputs: usize) -> Self {
        Self {
            inputs,
            state: RefCell::default(),
        }
    }

    /// The number at a place of the input.
    pub fn input(&self, at: usize, number: Primitive) -> Term<'_> {
        let node = Node {
            operation: Operation::Input(at),
            operands: Vec::new(),
        };
        self.push(node, number)
    }

    fn push(&self, node: Node, number: Primitive) -> Term<'_> {
        let mut state = self.state.borrow_mut();
        if let Some(at) = state.known.get(&node) {
            return Term::Node(self, *at);
        }
        let at = state.nodes.len();
        state.known.insert(node.clone(), at);
        state.nodes.push(node);
        state.numbers.push(number);
        Term::Node(self, at)
    }

    fn record(&self, operation: Operation, operands: &[Term<'_>], number: Primitive) -> Term<'_> {
        let operands = operands.iter().map(Term::operand).collect();
        let node = Node {
            operation,
            operands,
        };
        self.push(node, number)
    }

    /// How the value of a node is stored exactly.
    pub fn number(&self, at: usize) -> Primitive {
        let state = self.state.borrow();
        state.numbers.get(at).copied().unwrap_or(Primitive::F64)
    }

    /// The number of which a node is the opposite, with the bits that it had.
    fn opposite(&self, at: usize) -> Option<Term<'_>> {
        let state = self.state.borrow();
        let node = state.nodes.get(at)?;
        match (&node.operation, node.operands.as_slice()) {
            (Operation::Negate, [Operand::Node(of)]) => Some(Term::Node(self, *of)),
            _ => None,
        }
    }

    /// The results of a function of the user for some terms.
    pub fn call(
        &self,
        function: &str,
        arguments: &[Term<'_>],
        results: &[Primitive],
    ) -> Vec<Term<'_>> {
        let operation = Operation::Call {
            function: function.to_owned(),
            results: results.len(),
        };
        let call = self.record(operation, arguments, Primitive::F64);
        let results = results.iter().enumerate();
        results
            .map(|(at, number)| self.record(Operation::Result(at), &[call], *number))
            .collect()
    }

    /// The operations that these terms need, in their order. Requirements are kept.
    pub fn program(&self, outputs: &[Term<'_>]) -> Program {
        let outputs: Vec<Operand> = outputs.iter().map(Term::operand).collect();
        let state = self.state.borrow();
        Program::new(self.inputs, state.nodes.clone(), outputs, &state.locks)
    }
}

/// Terms are equal if they are one number: of one recorder, or of equal bits.
impl PartialEq for Term<'_> {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Constant(one), Self::Constant(other)) => one.to_bits() == other.to_bits(),
            (Self::Node(one, at), Self::Node(other, place)) => {
                std::ptr::eq(*one, *other) && at == place
            }
            _ => false,
        }
    }
}

impl<'r> Term<'r> {
    fn operand(&self) -> Operand {
        match self {
            Self::Constant(value) => Operand::Constant(value.to_bits()),
            Self::Node(_, at) => Operand::Node(*at),
        }
    }

    fn recorder(self) -> Option<&'r Recorder> {
        match self {
            Self::Constant(_) => None,
            Self::Node(recorder, _) => Some(recorder),
        }
    }

    /// The result of an operation for these terms, computed now if all are known.
    fn of(operation: Operation, operands: &[Self]) -> Self {
        let recorder = operands.iter().find_map(|term| term.recorder());
        let Some(recorder) = recorder else {
            let known: Vec<f64> = operands.iter().map(|term| term.known()).collect();
            return Self::Constant(operation.apply(&known).unwrap_or(f64::NAN));
        };
        recorder.record(operation, operands, Primitive::F64)
    }

    /// The number, if it is known.
    fn known(self) -> f64 {
        match self {
            Self::Constant(value) => value,
            Self::Node(..) => f64::NAN,
        }
    }

    fn is(self, wanted: f64) -> bool {
        #[expect(clippy::float_cmp, reason = "exact constants")]
        let equal = self.known() == wanted;
        equal
    }

    /// How the value is stored exactly.
    fn number(self) -> Primitive {
        match self {
            Self::Constant(_) => Primitive::F64,
            Self::Node(recorder, at) => recorder.number(at),
        }
    }

    /// The value as a number of another kind: rounded where that is needed. Integers out of range
    /// are refused.
    #[must_use]
    pub fn stored(self, number: Primitive) -> Self {
        let Self::Node(recorder, _) = self else {
            return Self::of(Operation::Store(number), &[self]);
        };
        if fits(self.number(), number) {
            return self;
        }
        recorder.record(Operation::Store(number), &[self], number)
    }

    /// Refuses values outside `least..=most`, and NaN. Others pass unchanged.
    #[expect(
        clippy::return_self_not_must_use,
        reason = "a requirement is kept without its value"
    )]
    pub fn required(self, least: f64, most: f64) -> Self {
        let operation = Operation::Require(least.to_bits(), most.to_bits());
        Self::of(operation, &[self])
    }

    /// Three turns are at a gimbal lock where this value is below [`LOCKED`](rc_quantity::rotation::LOCKED).
    pub fn may_lock(self) {
        if let Self::Node(recorder, at) = self {
            recorder.state.borrow_mut().locks.push(at);
        }
    }

    /// The greatest integer that is not above.
    #[must_use]
    pub fn floor(self) -> Self {
        Self::of(Operation::Floor, &[self])
    }

    /// The nearest integer; away from zero in the middle.
    #[must_use]
    pub fn nearest(self) -> Self {
        Self::of(Operation::Nearest, &[self])
    }
}

impl Add for Term<'_> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        if self.is(0.0) {
            return other;
        }
        if other.is(0.0) {
            return self;
        }
        Self::of(Operation::Add, &[self, other])
    }
}

impl Sub for Term<'_> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        if self.is(0.0) {
            return -other;
        }
        if other.is(0.0) {
            return self;
        }
        Self::of(Operation::Subtract, &[self, other])
    }
}

impl Mul for Term<'_> {
    type Output = Self;

    /// A factor that is known to be 0 leaves nothing of the other one.
    fn mul(self, other: Self) -> Self {
        for (one, other) in [(self, other), (other, self)] {
            if one.is(0.0) {
                return Self::Constant(0.0);
            }
            if one.is(1.0) {
                return other;
            }
            if one.is(-1.0) {
                return -other;
            }
        }
        Self::of(Operation::Multiply, &[self, other])
    }
}

impl Div for Term<'_> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        if other.is(1.0) {
            return self;
        }
        Self::of(Operation::Divide, &[self, other])
    }
}

impl Neg for Term<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        let number = self.number();
        let number = match number.class() {
            Class::Float => number,
            // The least integer has no opposite.
            Class::Bool | Class::Signed | Class::Unsigned => Primitive::F64,
        };
        match self {
            Self::Constant(value) => Self::Constant(-value),
            Self::Node(recorder, at) => match recorder.opposite(at) {
                Some(of) => of,
                None => recorder.record(Operation::Negate, &[self], number),
            },
        }
    }
}

impl Real for Term<'_> {
    fn constant(value: f64) -> Self {
        Self::Constant(value)
    }

    fn root(self) -> Self {
        Self::of(Operation::Root, &[self])
    }

    fn sine(self) -> Self {
        Self::of(Operation::Sine, &[self])
    }

    fn cosine(self) -> Self {
        Self::of(Operation::Cosine, &[self])
    }

    fn angle_over(self, x: Self) -> Self {
        Self::of(Operation::Angle, &[self, x])
    }

    fn length_with(self, other: Self) -> Self {
        Self::of(Operation::Length, &[self, other])
    }

    fn if_below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        if then.operand() == otherwise.operand() {
            return then;
        }
        Self::of(Operation::IfBelow, &[self, limit, then, otherwise])
    }
}
