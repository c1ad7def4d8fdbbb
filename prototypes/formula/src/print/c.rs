//! C99, with `math.h`.

use super::{Binding, Texts};
use crate::program::{Operation, Program, limits};
use rc_vocabulary::Primitive;
use std::fmt::Write;

/// How long a line with several values may be.
const WIDTH: usize = 98;

/// The statements of a function that returns an `int`: 1 for numbers that are refused. `input` names
/// the number at a place of the input.
///
/// Compilers that fuse a product and a sum give other last bits (`-ffp-contract=off` tells GCC not
/// to).
pub fn statements(program: &Program, input: impl Fn(usize) -> String) -> String {
    let mut out = String::new();
    let mut texts = Texts::tight(program);
    // Whether the declaration of the line before goes on, and how long that line is.
    let (mut is_open, mut width) = (false, 0);
    for node in &program.nodes {
        if let Operation::Call { function, results } = &node.operation {
            let of = texts.operands(node).join(", ");
            if let Some((name, _)) = texts.variable(Binding::Atom, String::new()) {
                out.push_str(if is_open { ";\n" } else { "" });
                let _ = writeln!(out, "    double {name}[{results}];");
                let _ = writeln!(out, "    {function}((const double[]){{{of}}}, {name});");
                is_open = false;
            }
            continue;
        }
        let of = texts.operands(node);
        let (binding, value) = texts.arithmetic(node).unwrap_or_else(|| {
            let value = match &node.operation {
                Operation::Input(at) => input(*at),
                Operation::Root => format!("sqrt({})", of[0]),
                Operation::Floor => format!("floor({})", of[0]),
                Operation::Nearest => format!("round({})", of[0]),
                Operation::Sine => format!("sin({})", of[0]),
                Operation::Cosine => format!("cos({})", of[0]),
                Operation::Angle => format!("atan2({}, {})", of[0], of[1]),
                Operation::Length => format!("hypot({}, {})", of[0], of[1]),
                Operation::IfBelow => format!("{} < {} ? {} : {}", of[0], of[1], of[2], of[3]),
                Operation::Store(Primitive::F32) => format!("(double)(float){}", of[0]),
                Operation::Store(number) if limits(*number).is_some() => {
                    format!("round({})", of[0])
                }
                Operation::Result(place) => format!("{}[{place}]", of[0]),
                _ => of.first().cloned().unwrap_or_default(),
            };
            (Binding::Atom, value)
        });
        let Some((name, value)) = texts.variable(binding, value) else {
            continue;
        };
        let value = format!("{name} = {value}");
        // One declaration for all: types would be a third of the text.
        let before = if !is_open {
            "    const double "
        } else if width + value.len() < WIDTH {
            ", "
        } else {
            ",\n    "
        };
        if before != ", " {
            width = 0;
        }
        out.push_str(before);
        out.push_str(&value);
        width += before.len() + value.len();
        is_open = true;
        if let Some((least, most)) = node.operation.range() {
            let _ = writeln!(
                out,
                ";\n    if (!({name} >= {least:?} && {name} <= {most:?})) return 1;"
            );
            is_open = false;
        }
    }
    if is_open {
        out.push_str(";\n");
    }
    out
}
