//! Rust, without dependencies.

use super::operands;
use crate::program::{Operation, Program, limits};
use rc_vocabulary::Primitive;
use std::fmt::Write;

/// The statements of a function that returns an `Option`: `None` for numbers that are refused.
/// `input` names the number at a place of the input.
pub fn statements(program: &Program, input: impl Fn(usize) -> String) -> String {
    let mut out = String::new();
    for (at, node) in program.nodes.iter().enumerate() {
        let of = operands(node);
        let value = match &node.operation {
            Operation::Input(at) => input(*at),
            Operation::Negate => format!("-{}", of[0]),
            Operation::Add => format!("{} + {}", of[0], of[1]),
            Operation::Subtract => format!("{} - {}", of[0], of[1]),
            Operation::Multiply => format!("{} * {}", of[0], of[1]),
            Operation::Divide => format!("{} / {}", of[0], of[1]),
            Operation::Root => format!("f64::sqrt({})", of[0]),
            Operation::Floor => format!("f64::floor({})", of[0]),
            Operation::Nearest => format!("f64::round({})", of[0]),
            Operation::Sine => format!("f64::sin({})", of[0]),
            Operation::Cosine => format!("f64::cos({})", of[0]),
            Operation::Angle => format!("f64::atan2({}, {})", of[0], of[1]),
            Operation::Length => format!("f64::hypot({}, {})", of[0], of[1]),
            Operation::IfBelow => {
                format!(
                    "if {} < {} {{ {} }} else {{ {} }}",
                    of[0], of[1], of[2], of[3]
                )
            }
            Operation::Store(Primitive::F32) => format!("f64::from({} as f32)", of[0]),
            Operation::Store(number) => match limits(*number) {
                Some(_) => format!("f64::round({})", of[0]),
                None => of[0].clone(),
            },
            Operation::Require(..) => of[0].clone(),
            Operation::Call { function, results } => {
                format!(
                    "let v{at}: [f64; {results}] = {function}(&[{}])",
                    of.join(", ")
                )
            }
            Operation::Result(place) => format!("{}[{place}]", of[0]),
        };
        if let Operation::Call { .. } = node.operation {
            let _ = writeln!(out, "    {value};");
            continue;
        }
        let _ = writeln!(out, "    let v{at}: f64 = {value};");
        if let Some((least, most)) = node.operation.range() {
            let _ = writeln!(out, "    if !({least:?}..={most:?}).contains(&v{at}) {{");
            out.push_str("        return None;\n    }\n");
        }
    }
    out
}
