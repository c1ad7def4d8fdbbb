//! A plan: the steps from one prototype to another one, with their costs and losses.

use crate::loss::{Bound, Loss};
use rc_formula::{Operation, Program};
use std::fmt;
use std::ops::Add;

/// How many numbers a transform has: the rows of `[R | t]`, between two frames with the axes of
/// ROS, in metres.
pub const TRANSFORM: usize = 12;

/// The kind of a step. A plan has the last kind of its steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Copies numbers to their places.
    Plain,
    /// Names numbers otherwise.
    Alias,
    /// Changes units.
    Unit,
    /// Takes the opposite of numbers.
    Sign,
    /// Changes the directions of axes.
    Axes,
    /// Changes coordinates.
    Coordinate,
    /// Converts the parts of a composite.
    Composition,
    /// Changes the frame, by a transform that is known when a message comes.
    Frames,
    /// Calls a function of the user.
    Declared,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plain => "plain",
            Self::Alias => "alias",
            Self::Unit => "unit",
            Self::Sign => "signs",
            Self::Axes => "axes",
            Self::Coordinate => "coordinate",
            Self::Composition => "composition",
            Self::Frames => "frames",
            Self::Declared => "conversion",
        })
    }
}

/// The cost of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Steps.
    pub steps: u64,
    /// Operations of arithmetic.
    pub operations: u64,
    /// Sines, cosines, angles and lengths.
    pub functions: u64,
    /// Calls of functions of the user.
    pub calls: u64,
    /// Losses with a bound.
    pub bounded: u64,
    /// Losses without a bound.
    pub unbounded: u64,
}

impl Cost {
    pub(crate) fn of(program: &Program, lost: &[Loss]) -> Self {
        let mut cost = Self {
            steps: 1,
            ..Self::default()
        };
        for node in program.nodes() {
            match &node.operation {
                Operation::Input(_) | Operation::Result(_) => {}
                Operation::Call { .. } => cost.calls += 1,
                other if other.is_transcendental() => cost.functions += 1,
                _ => cost.operations += 1,
            }
        }
        for loss in lost {
            if loss.is_bounded() {
                cost.bounded += 1;
            } else {
                cost.unbounded += 1;
            }
        }
        cost
    }

    /// The operations, functions and losses without a bound beyond those of a part.
    pub(crate) fn beyond(self, part: Self) -> Self {
        Self {
            operations: self.operations.saturating_sub(part.operations),
            functions: self.functions.saturating_sub(part.functions),
            unbounded: self.unbounded,
            ..Self::default()
        }
    }

    /// The cost as one number: a step and an operation are 1, a transcendental function 20, a call
    /// 100, a loss with a bound 1,000, and one without 1,000,000.
    pub fn total(&self) -> u64 {
        self.steps
            + self.operations
            + 20 * self.functions
            + 100 * self.calls
            + 1_000 * self.bounded
            + 1_000_000 * self.unbounded
    }
}

impl Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            operations: self.operations + other.operations,
            functions: self.functions + other.functions,
            calls: self.calls + other.calls,
            bounded: self.bounded + other.bounded,
            unbounded: self.unbounded + other.unbounded,
        }
    }
}

/// A step of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The prototype that it gives.
    pub to: String,
    /// Its kind.
    pub kinds: Vec<Kind>,
}

/// The conversion of one prototype into another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The first prototype.
    pub from: String,
    /// The steps. Without any, the prototypes are one.
    pub steps: Vec<Step>,
    /// The cost of all steps.
    pub cost: Cost,
    /// Their losses.
    pub lost: Vec<Loss>,
    /// Its assumptions.
    pub notes: Vec<String>,
    /// The formula.
    pub program: Program,
    /// How many numbers of a transform it takes after all others: 0, or [`TRANSFORM`].
    pub transform: usize,
    /// The covariances that it takes after the numbers of the first prototype, and gives after those
    /// of the second one: the names of their parts with dots, empty for the whole, and how many
    /// numbers each has.
    pub covariances: [Vec<(String, usize)>; 2],
    /// The numbers of both prototypes, for comments in code.
    pub(crate) input: Vec<String>,
    pub(crate) output: Vec<String>,
}

impl Plan {
    /// The last prototype.
    pub fn to(&self) -> &str {
        self.steps.last().map_or(&self.from, |step| &step.to)
    }

    /// The number of steps: D's distance.
    pub fn distance(&self) -> usize {
        self.steps.len()
    }

    /// The kind of the plan: the last one of the kinds of its steps.
    pub fn kind(&self) -> Kind {
        let kinds = self.steps.iter().flat_map(|step| &step.kinds);
        kinds.copied().max().unwrap_or(Kind::Plain)
    }

    /// The relative error that the plan may have. `None` if it has no bound.
    pub(crate) fn error(&self) -> Option<f64> {
        let mut error = if self.program.is_exact() {
            0.0
        } else {
            ROUNDING
        };
        for loss in &self.lost {
            match loss.bound {
                Bound::Relative(part) => error += part,
                Bound::Absolute(_) | Bound::None => return None,
            }
        }
        Some(error)
    }
}

/// The relative error of arithmetic with numbers of 64 bits.
const ROUNDING: f64 = 1e-12;

impl fmt::Display for Plan {
    /// A few lines, each with a name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cost = &self.cost;
        let mut steps = Vec::new();
        for step in &self.steps {
            let kinds: Vec<String> = step.kinds.iter().map(Kind::to_string).collect();
            steps.push(format!("{} ({})", step.to, kinds.join(", ")));
        }
        writeln!(f, "{} -> {}", self.from, self.to())?;
        writeln!(f, "type      {}", self.kind())?;
        writeln!(f, "distance  {}", self.distance())?;
        for (at, step) in steps.iter().enumerate() {
            writeln!(f, "{:9} {step}", if at == 0 { "steps" } else { "" })?;
        }
        write!(f, "cost      {}: ", cost.total())?;
        write!(f, "{} operations, ", cost.operations)?;
        write!(f, "{} transcendental functions", cost.functions)?;
        if cost.calls > 0 {
            write!(f, ", {} functions of the user", cost.calls)?;
        }
        writeln!(f)?;
        for note in &self.notes {
            writeln!(f, "note      {note}")?;
        }
        match (self.lost.as_slice(), self.program.is_exact()) {
            ([], true) => writeln!(f, "lost      nothing: the plan is exact"),
            ([], false) => writeln!(f, "lost      rounding of float64 only"),
            (lost, _) => {
                for (at, loss) in lost.iter().enumerate() {
                    writeln!(f, "{:9} {loss}", if at == 0 { "lost" } else { "" })?;
                }
                Ok(())
            }
        }
    }
}
