//! Prints the formula of a plan as a function.
//!
//! The functions take and give numbers in the order of the prototypes; a comment names each with its
//! member and unit.

use crate::plan::Plan;
use rc_formula::{c, python, results, rust};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The name of the function.
fn name(plan: &Plan) -> String {
    format!("{}_to_{}", plan.from, plan.to())
}

/// `from[0]: X in mm, float32`, for each number.
fn list<'p>(plan: &'p Plan, from: &'p str, to: &'p str) -> impl Iterator<Item = String> + 'p {
    let lines = |array: &'p str, values: &'p [String]| {
        let values = values.iter().enumerate();
        values.map(move |(at, text)| format!("{array}[{at}]: {text}"))
    };
    lines(from, &plan.input).chain(lines(to, &plan.output))
}

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
    out.push_str(&rust::statements(program, |at| format!("from[{at}]")));
    let _ = writeln!(out, "    Some([{}])\n}}", results(program).join(", "));
    out
}

/// The plan as a function in C. It returns 0, or 1 for numbers that are refused; then `to` is
/// unchanged. Compilers that fuse a product and a sum give other last bits (`-ffp-contract=off`
/// tells GCC not to).
pub fn c(plan: &Plan) -> String {
    let program = &plan.program;
    let mut out = String::from("#include <math.h>\n\n");
    let functions: BTreeMap<&str, (usize, usize)> = program.calls().collect();
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
    if !program.takes_input() {
        out.push_str("    (void)from;\n");
    }
    out.push_str(&c::statements(program, |at| format!("from[{at}]")));
    for (at, of) in results(program).into_iter().enumerate() {
        let _ = writeln!(out, "    to[{at}] = {of};");
    }
    out.push_str("    return 0;\n}\n");
    out
}

/// The plan as a function in Python. It raises `ValueError` for numbers that are refused.
pub fn python(plan: &Plan) -> String {
    let program = &plan.program;
    let mut body = format!("def {}(values):\n", name(plan));
    let _ = writeln!(
        body,
        "    \"\"\"Converts {} into {}.\n",
        plan.from,
        plan.to()
    );
    for line in list(plan, "values", "result") {
        let _ = writeln!(body, "    {line}");
    }
    body.push_str("    \"\"\"\n");
    let _ = writeln!(body, "    if len(values) != {}:", program.inputs());
    let _ = writeln!(
        body,
        "        raise ValueError(\"{} values are expected\")",
        program.inputs()
    );
    body += &python::statements(program, |at| format!("float(values[{at}])"));
    let _ = writeln!(body, "    return [{}]", results(program).join(", "));
    python::preamble(&body) + &body
}
