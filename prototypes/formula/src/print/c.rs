//! C99, with `math.h`.

use super::operands;
use crate::program::{Operation, Program, limits};
use rc_vocabulary::Primitive;
use std::fmt::Write;

/// The statements of a function that returns an `int`: 1 for numbers that are refused. `input` names
/// the number at a place of the input.
///
/// Compilers that fuse a product and a sum give other last bits (`-ffp-contract=off` tells GCC not
/// to).
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
            Operation::Root => format!("sqrt({})", of[0]),
            Operation::Floor => format!("floor({})", of[0]),
            Operation::Nearest => format!("round({})", of[0]),
            Operation::Sine => format!("sin({})", of[0]),
            Operation::Cosine => format!("cos({})", of[0]),
            Operation::Angle => format!("atan2({}, {})", of[0], of[1]),
            Operation::Length => format!("hypot({}, {})", of[0], of[1]),
            Operation::IfBelow => format!("{} < {} ? {} : {}", of[0], of[1], of[2], of[3]),
            Operation::Store(Primitive::F32) => format!("(double)(float){}", of[0]),
            Operation::Store(number) => match limits(*number) {
                Some(_) => format!("round({})", of[0]),
                None => of[0].clone(),
            },
            Operation::Require(..) => of[0].clone(),
            Operation::Call { function, results } => {
                let _ = writeln!(out, "    double v{at}[{results}];");
                let _ = writeln!(
                    out,
                    "    {function}((const double[]){{{}}}, v{at});",
                    of.join(", ")
                );
                continue;
            }
            Operation::Result(place) => format!("{}[{place}]", of[0]),
        };
        let _ = writeln!(out, "    const double v{at} = {value};");
        if let Some((least, most)) = node.operation.range() {
            let _ = writeln!(
                out,
                "    if (!(v{at} >= {least:?} && v{at} <= {most:?})) return 1;"
            );
        }
    }
    out
}
