//! Rust, without dependencies.

use super::{list, name, operand, operands};
use crate::plan::Plan;
use crate::program::{Operation, limits};
use rc_vocabulary::Primitive;
use std::fmt::Write;

/// The plan as a function in Rust. It gives `None` for numbers that are refused.
pub fn rust(plan: &Plan) -> String {
    let program = &plan.program;
    let mut out = format!("/// Converts `{}` into `{}`.\n///\n", plan.from, plan.to());
    for line in list(plan, "from", "to") {
        let _ = writeln!(out, "/// - {line}");
    }
    if program.functions().next().is_some() {
        out.push_str("///\n/// The functions that it calls take and give arrays of f64.\n");
    }
    out.push_str("#[allow(clippy::all, clippy::pedantic, reason = \"generated\")]\n");
    let (inputs, outputs) = (program.inputs(), program.outputs());
    let _ = writeln!(
        out,
        "pub fn {}(from: &[f64; {inputs}]) -> Option<[f64; {outputs}]> {{",
        name(plan)
    );
    for (at, node) in program.nodes.iter().enumerate() {
        let of = operands(node);
        let value = match &node.operation {
            Operation::Input(at) => format!("from[{at}]"),
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
    let outputs: Vec<String> = program.outputs.iter().copied().map(operand).collect();
    let _ = writeln!(out, "    Some([{}])\n}}", outputs.join(", "));
    out
}
