//! Rust, without dependencies.

use super::{Binding, Texts};
use crate::program::{Operation, Program, limits};
use rc_vocabulary::Primitive;
use std::fmt::Write;

/// The statements of a function that returns an `Option`: `None` for numbers that are refused.
/// `input` names the number at a place of the input.
pub fn statements(program: &Program, input: impl Fn(usize) -> String) -> String {
    let mut out = String::new();
    let mut texts = Texts::new(program);
    for node in &program.nodes {
        let of = texts.operands(node);
        let mut kind = "f64".to_owned();
        let (binding, value) = texts.arithmetic(node).unwrap_or_else(|| {
            let value = match &node.operation {
                Operation::Input(at) => input(*at),
                Operation::Root => format!("f64::sqrt({})", of[0]),
                Operation::Floor => format!("f64::floor({})", of[0]),
                Operation::Nearest => format!("f64::round({})", of[0]),
                Operation::Sine => format!("f64::sin({})", of[0]),
                Operation::Cosine => format!("f64::cos({})", of[0]),
                Operation::Angle => format!("f64::atan2({}, {})", of[0], of[1]),
                Operation::Length => format!("f64::hypot({}, {})", of[0], of[1]),
                Operation::IfBelow => format!(
                    "if {} < {} {{ {} }} else {{ {} }}",
                    of[0], of[1], of[2], of[3]
                ),
                Operation::Store(Primitive::F32) => format!("f64::from({} as f32)", of[0]),
                Operation::Store(number) if limits(*number).is_some() => {
                    format!("f64::round({})", of[0])
                }
                Operation::Call { function, results } => {
                    kind = format!("[f64; {results}]");
                    format!("{function}(&[{}])", of.join(", "))
                }
                Operation::Result(place) => format!("{}[{place}]", of[0]),
                _ => of.first().cloned().unwrap_or_default(),
            };
            (Binding::Atom, value)
        });
        let Some((name, value)) = texts.variable(binding, value) else {
            continue;
        };
        let _ = writeln!(out, "    let {name}: {kind} = {value};");
        if let Some((least, most)) = node.operation.range() {
            let _ = writeln!(out, "    if !({least:?}..={most:?}).contains(&{name}) {{");
            out.push_str("        return None;\n    }\n");
        }
    }
    out
}
