//! C99, with `math.h`.

use super::{list, name, operand, operands};
use crate::plan::Plan;
use crate::program::{Operation, limits};
use rc_vocabulary::Primitive;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The plan as a function in C. It gives 0, or 1 for numbers that are refused; then `to` is as it was.
/// Compilers that join a product and a sum give other last bits (`-ffp-contract=off` tells GCC not to).
pub fn c(plan: &Plan) -> String {
    let program = &plan.program;
    let mut out = String::from("#include <math.h>\n\n");
    let mut functions = BTreeMap::new();
    for node in &program.nodes {
        if let Operation::Call { function, results } = &node.operation {
            functions.insert(function, (node.operands.len(), *results));
        }
    }
    for (function, (inputs, outputs)) in functions {
        let _ = writeln!(
            out,
            "void {function}(const double from[{inputs}], double to[{outputs}]);\n"
        );
    }
    let _ = writeln!(out, "/* Converts {} into {}.", plan.from, plan.to());
    for line in list(plan, "from", "to") {
        let _ = writeln!(out, " * {line}");
    }
    out.push_str(" * Returns 0, or 1 for numbers that are refused. */\n");
    let (inputs, outputs) = (program.inputs(), program.outputs());
    let _ = writeln!(
        out,
        "int {}(const double from[{inputs}], double to[{outputs}])\n{{",
        name(plan)
    );
    if !program
        .nodes
        .iter()
        .any(|node| matches!(node.operation, Operation::Input(_)))
    {
        out.push_str("    (void)from;\n");
    }
    for (at, node) in program.nodes.iter().enumerate() {
        let of = operands(node);
        let value = match &node.operation {
            Operation::Input(at) => format!("from[{at}]"),
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
    for (at, of) in program.outputs.iter().enumerate() {
        let _ = writeln!(out, "    to[{at}] = {};", operand(*of));
    }
    out.push_str("    return 0;\n}\n");
    out
}
