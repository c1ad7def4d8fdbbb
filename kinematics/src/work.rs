//! The number of operations of a solver.

use rc_formula::{Operation, Program};
use std::fmt;

/// The operations of a solver. Their number is equal in each call: no operation depends on a
/// condition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Sums and differences.
    pub sums: usize,
    /// Products and quotients.
    pub products: usize,
    /// Sines, cosines and roots.
    pub functions: usize,
    /// Choices between two numbers, of which both are computed.
    pub choices: usize,
}

impl Work {
    /// The operations of a formula.
    pub(crate) fn of(program: &Program) -> Self {
        let mut work = Self::default();
        for node in program.nodes() {
            match node.operation {
                Operation::Add | Operation::Subtract => work.sums += 1,
                Operation::Multiply | Operation::Divide => work.products += 1,
                Operation::Input(_) | Operation::Negate => {}
                Operation::Root
                | Operation::Floor
                | Operation::Nearest
                | Operation::Sine
                | Operation::Cosine
                | Operation::Angle
                | Operation::Length
                | Operation::Store(_)
                | Operation::Require(..)
                | Operation::Call { .. }
                | Operation::Result(_) => work.functions += 1,
                Operation::IfBelow => work.choices += 1,
            }
        }
        work
    }
}

impl fmt::Display for Work {
    /// `12 sums, 9 products, 3 sines, cosines and roots`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            sums,
            products,
            functions,
            choices,
        } = self;
        write!(
            f,
            "{sums} sums, {products} products, {functions} sines, cosines and roots"
        )?;
        match choices {
            0 => Ok(()),
            _ => write!(f, ", {choices} choices between two numbers"),
        }
    }
}
