//! Formulas: how several numbers of a value become others.

use alloc::vec::Vec;
use core::fmt::{self, Write};
use rc_quantity::Real;

/// A formula over the numbers of a group. Equal formulas have equal operations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Formula {
    /// Operations, each of which may take the values of earlier ones.
    pub steps: Vec<Step>,
    /// The new value of each number of the group.
    pub outputs: Vec<Operand>,
    /// Where one of these is below [`LOCKED`](rc_quantity::rotation::LOCKED), three turns among the outputs are at a gimbal lock.
    pub locks: Vec<Operand>,
}

/// An operation with its operands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The operation.
    pub operation: Operation,
    /// With which numbers, as many as the operation has.
    pub operands: Vec<Operand>,
}

/// An operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// The number of the group at this place.
    Input(u32),
    /// The value of the step at this place.
    Step(u32),
    /// A number, by its bits.
    Constant(u64),
    /// The number at this place of the transforms of the message, which are 12 each.
    Transform(u32),
}

/// An operation. All of them compute as `f64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
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
    /// As a `float32`.
    Single,
    /// The first operand, which must be from the second to the third one.
    Require,
}

impl Operation {
    /// All operations, with their letters in the texts of plans, and how many operands they take.
    const ALL: [(Self, char, usize); 15] = [
        (Self::Negate, 'n', 1),
        (Self::Add, 'a', 2),
        (Self::Subtract, 's', 2),
        (Self::Multiply, 'm', 2),
        (Self::Divide, 'd', 2),
        (Self::Root, 'r', 1),
        (Self::Floor, 'f', 1),
        (Self::Nearest, 'i', 1),
        (Self::Sine, 'S', 1),
        (Self::Cosine, 'C', 1),
        (Self::Angle, 'A', 2),
        (Self::Length, 'L', 2),
        (Self::IfBelow, 'b', 4),
        (Self::Single, 't', 1),
        (Self::Require, 'q', 3),
    ];

    pub(crate) fn from_letter(letter: char) -> Option<(Self, usize)> {
        let mut all = Self::ALL.iter();
        let found = all.find(|(_, own, _)| *own == letter)?;
        Some((found.0, found.2))
    }

    fn letter(self) -> char {
        let mut all = Self::ALL.iter();
        let found = all.find(|(operation, ..)| *operation == self);
        found.map_or('n', |(_, letter, _)| *letter)
    }

    /// The value for these operands. `None` if a number is not in its range.
    pub(crate) fn apply(self, [one, two, three, four]: [f64; 4]) -> Option<f64> {
        Some(match self {
            Self::Negate => -one,
            Self::Add => one + two,
            Self::Subtract => one - two,
            Self::Multiply => one * two,
            Self::Divide => one / two,
            Self::Root => one.root(),
            Self::Floor => libm::floor(one),
            Self::Nearest => libm::round(one),
            Self::Sine => one.sine(),
            Self::Cosine => one.cosine(),
            Self::Angle => one.angle_over(two),
            Self::Length => one.length_with(two),
            Self::IfBelow => one.if_below(two, three, four),
            #[expect(clippy::cast_possible_truncation, reason = "rounded to the nearest")]
            Self::Single => f64::from(one as f32),
            Self::Require => return (two..=three).contains(&one).then_some(one),
        })
    }
}

impl Formula {
    /// Whether each operand is a number of the group, of which there are `inputs`, one of as many
    /// numbers of `transforms`, or an earlier step.
    pub(crate) fn is_closed(&self, inputs: usize, transforms: usize) -> bool {
        let known = |operand: &Operand, before: usize| match operand {
            Operand::Input(at) => (*at as usize) < inputs,
            Operand::Step(at) => (*at as usize) < before,
            Operand::Constant(_) => true,
            Operand::Transform(at) => (*at as usize) < transforms,
        };
        let mut steps = self.steps.iter().enumerate();
        let all = steps.all(|(at, step)| step.operands.iter().all(|of| known(of, at)));
        all && self.outputs.len() == inputs
            && self.outputs.iter().all(|of| known(of, self.steps.len()))
            && self.locks.iter().all(|of| known(of, self.steps.len()))
    }
}

impl Operand {
    pub(crate) fn of(self, values: &[f64], inputs: usize, transforms: &[f64]) -> f64 {
        let value = match self {
            Self::Input(at) => values.get(at as usize),
            Self::Step(at) => values.get(inputs + at as usize),
            Self::Constant(bits) => return f64::from_bits(bits),
            Self::Transform(at) => transforms.get(at as usize),
        };
        value.copied().unwrap_or(f64::NAN)
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(at) => write!(f, "@{at}"),
            Self::Step(at) => write!(f, "${at}"),
            Self::Constant(bits) => write!(f, "{:e}", f64::from_bits(*bits)),
            Self::Transform(at) => write!(f, "^{at}"),
        }
    }
}

struct Operands<'a>(&'a [Operand]);

impl fmt::Display for Operands<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, operand) in self.0.iter().enumerate() {
            if at > 0 {
                f.write_char('&')?;
            }
            write!(f, "{operand}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Formula {
    /// In the form of the texts of plans.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in &self.steps {
            write!(
                f,
                "{}{};",
                step.operation.letter(),
                Operands(&step.operands)
            )?;
        }
        write!(f, "={}", Operands(&self.outputs))?;
        if !self.locks.is_empty() {
            write!(f, "%{}", Operands(&self.locks))?;
        }
        Ok(())
    }
}
