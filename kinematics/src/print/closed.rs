//! Prints the closed form of an inverse solver: a function in straight lines, and the positions where a search begins.

use super::inverse::{IN_C, IN_PYTHON, IN_RUST};
use crate::inverse::Inverse;
use crate::search::{ClosedForm, Search};
use rc_formula::{c as c_text, python as python_text, results, rust as rust_text};
use std::fmt::Write;

/// The work of a closed form, for the comment of a solver.
pub(super) fn about(form: &ClosedForm) -> String {
    let work = crate::work::Work::of(&form.positions);
    format!(
        "Positions have a closed form ({work}), where the search begins: {}.",
        form.kind.describe()
    )
}

fn target(at: usize) -> String {
    format!("target[{}][{}]", at / 4, at % 4)
}

/// A function inside another one, and the variable `closed`: the beginnings for `aim`.
pub(super) fn rust(search: &Search, first: &str) -> String {
    let Some(form) = &search.closed else {
        return "    let closed: [f64; 0] = [];\n    let kept = 0;\n".to_owned();
    };
    let numbers = results(&form.positions);
    let mut out = format!(
        "    fn closed_form(target: &[[f64; 4]; 4], out: &mut [f64; {}]) {{\n",
        numbers.len()
    );
    for line in rust_text::statements(&form.positions, target).lines() {
        let _ = writeln!(out, "    {line}");
    }
    for (at, number) in numbers.iter().enumerate() {
        let _ = writeln!(out, "        out[{at}] = {number};");
    }
    let _ = write!(
        out,
        "    }}\n    let mut closed = [0.0; {}];\n    closed_form(target, &mut closed);\n\
        \x20   let kept = _inverse::nearest(&mut closed, &[{}], lower, upper, &[{first}]);\n",
        numbers.len(),
        IN_RUST.list(&form.turns),
    );
    out
}

/// A function before the solver.
pub(super) fn c(prefix: &str, inverse: &Inverse, search: &Search) -> String {
    let Some(form) = &search.closed else {
        return String::new();
    };
    let mut out = format!(
        "\nstatic inline void {prefix}__{}_closed(double target[4][4], double *out)\n{{\n{}",
        inverse.name,
        c_text::statements(&form.positions, target)
    );
    for (at, number) in results(&form.positions).iter().enumerate() {
        let _ = writeln!(out, "    out[{at}] = {number};");
    }
    out + "}\n"
}

/// The declaration of `closed`, and the statements that fill it. The aim has it already.
pub(super) fn c_call(prefix: &str, inverse: &Inverse, search: &Search) -> (String, String) {
    let Some(form) = &search.closed else {
        return ("    const double *closed = 0;\n".to_owned(), String::new());
    };
    let (name, count) = (&inverse.name, search.closed_numbers());
    let turns = IN_C.list(&form.turns);
    let joints = form.turns.len();
    let declared = format!(
        "    static const double turns[{joints}] = {{{turns}}};\n    double closed[{count}];\n"
    );
    let called = format!(
        "    {prefix}__{name}_closed(target, closed);\n\
        \x20   aim.closings = {prefix}__nearest(closed, {count}, turns, lower, upper, {joints}, found);\n"
    );
    (declared, called)
}

/// A function before the solver.
pub(super) fn python(inverse: &Inverse, search: &Search) -> String {
    let Some(form) = &search.closed else {
        return String::new();
    };
    let numbers = results(&form.positions);
    let rows = numbers.chunks(inverse.joints.len());
    let rows = rows.map(|row| format!("[{}]", row.join(", ")));
    format!(
        "\n\ndef _{}_closed(target: list[list[float]]) -> list[list[float]]:\n{}    return [{}]\n",
        inverse.name,
        python_text::statements(&form.positions, target),
        rows.collect::<Vec<_>>().join(", ")
    )
}

/// The beginnings of a search before `starts`, as an expression.
pub(super) fn python_call(inverse: &Inverse, search: &Search) -> String {
    match &search.closed {
        Some(form) => format!(
            "_{}_closed(wanted),\n        [{}]",
            inverse.name,
            IN_PYTHON.list(&form.turns)
        ),
        None => "[],\n        []".to_owned(),
    }
}
