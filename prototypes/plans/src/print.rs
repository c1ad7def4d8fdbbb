//! Prints the formula of a plan as a function.
//!
//! The functions take and give numbers in the order of the prototypes; a comment names each with its
//! member and unit.

mod c;
mod python;
mod rust;

pub use c::c;
pub use python::python;
pub use rust::rust;

use crate::plan::Plan;
use crate::program::{Node, Operand};

/// The name of the function.
fn name(plan: &Plan) -> String {
    format!("{}_to_{}", plan.from, plan.to())
}

/// An operand: `v3`, or a number. Negative numbers are in parentheses.
fn operand(operand: Operand) -> String {
    match operand {
        Operand::Node(at) => format!("v{at}"),
        Operand::Constant(bits) => {
            let value = f64::from_bits(bits);
            if value.is_sign_negative() {
                format!("({value:?})")
            } else {
                format!("{value:?}")
            }
        }
    }
}

fn operands(node: &Node) -> Vec<String> {
    node.operands.iter().copied().map(operand).collect()
}

/// `from[0]: X in mm, float32`, for each number.
fn list<'p>(plan: &'p Plan, from: &'p str, to: &'p str) -> impl Iterator<Item = String> + 'p {
    let lines = |array: &'p str, values: &'p [String]| {
        let values = values.iter().enumerate();
        values.map(move |(at, text)| format!("{array}[{at}]: {text}"))
    };
    lines(from, &plan.input).chain(lines(to, &plan.output))
}
