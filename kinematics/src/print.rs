//! Prints the solvers of a cell as code without dependencies.

mod choices;
mod closed;
mod cpp;
mod ctypes;
mod frames;
mod inverse;

pub use cpp::cpp;
pub use ctypes::{library, loader};

use self::frames::Frames;
use crate::cell::{Cell, Output, PAYLOAD, Shape, Solver};
use crate::names::{ARRAYS, type_name};
use rc_formula::{c as in_c, python as in_python, results, rust as in_rust};
use std::fmt::Write;

/// How long a line of numbers may be.
const LINE: usize = 90;

/// The name of an array and the place in it, for a place of the input.
fn input(cell: &Cell, solver: &Solver, at: usize) -> String {
    let count = cell.robot.coordinates.len();
    match at.checked_sub(4 * count) {
        None => format!("{}[{}]", ARRAYS[at / count], at % count),
        Some(at) => format!("{}[{}]", solver.payloads[at / PAYLOAD].name, at % PAYLOAD),
    }
}

/// The arrays that a solver takes, and how many numbers they have.
fn arrays<'a>(cell: &Cell, solver: &'a Solver) -> Vec<(&'a str, usize)> {
    let count = cell.robot.coordinates.len();
    let taken = [
        true,
        solver.takes_velocities,
        solver.takes_accelerations,
        solver.takes_efforts,
    ];
    let taken = ARRAYS
        .into_iter()
        .zip(taken)
        .filter(|(_, is_taken)| *is_taken);
    let payloads = solver.payloads.iter();
    let payloads = payloads.map(|payload| (payload.name.as_str(), PAYLOAD));
    taken
        .map(|(name, _)| (name, count))
        .chain(payloads)
        .collect()
}

/// The numbers of an output, by rows: `[[v1, v2], [v3, v4]]` between `open` and `close`.
fn rows(output: &Output, numbers: &[String], open: &str, close: &str) -> String {
    let list = |numbers: &[String]| format!("{open}{}{close}", numbers.join(", "));
    match output.shape {
        Shape::Vector(_) => list(numbers),
        Shape::Matrix(_, columns) => {
            let rows = numbers.chunks(columns.max(1)).map(list);
            list(&rows.collect::<Vec<_>>())
        }
    }
}

/// The outputs of a solver with their numbers.
fn outputs(solver: &Solver) -> Vec<(&Output, Vec<String>)> {
    let mut numbers = results(&solver.program).into_iter();
    let outputs = solver.outputs.iter();
    outputs
        .map(|output| (output, numbers.by_ref().take(output.shape.size()).collect()))
        .collect()
}

/// The comment of a solver.
fn about(solver: &Solver) -> Vec<String> {
    let mut lines = solver.doc.clone();
    lines.push(format!("{}, in each call.", solver.work()));
    lines.extend(solver.payloads.iter().map(|payload| payload.doc.clone()));
    lines
}

/// The limits of all coordinates, as (least, greatest) positions.
fn limits(cell: &Cell) -> (Vec<f64>, Vec<f64>) {
    let limits = cell.robot.limits().into_iter();
    limits
        .map(|limits| limits.map_or((f64::NEG_INFINITY, f64::INFINITY), |l| (l.lower, l.upper)))
        .map(|range| cell.choices.limits(range))
        .unzip()
}

/// A text in quotes. Names of joints may have any character of XML.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            // C99 and Python read UTF-8, too. Characters that turn the direction of a line are refused
            // by compilers.
            c if c.is_control() || ('\u{202a}'..='\u{202e}').contains(&c) => out.push(' '),
            c if ('\u{2066}'..='\u{2069}').contains(&c) => out.push(' '),
            c => out.push(c),
        }
    }
    out + "\""
}

fn names(cell: &Cell) -> String {
    let names: Vec<String> = cell
        .robot
        .coordinates
        .iter()
        .map(|name| quoted(name))
        .collect();
    names.join(", ")
}

/// All solvers as Rust. The text is a module. With `math libm` it needs the crate `libm` in place of the standard
/// library.
pub fn rust(cell: &Cell) -> String {
    choices::typed(cell, rust_of(&choices::laid_out(cell)), true)
}

fn rust_of(cell: &Cell) -> String {
    let count = cell.robot.coordinates.len();
    let numbers = |all: Vec<f64>| {
        let all = all.into_iter().map(|value| match value {
            f64::INFINITY => "f64::INFINITY".to_owned(),
            f64::NEG_INFINITY => "f64::NEG_INFINITY".to_owned(),
            value => format!("{value:?}"),
        });
        all.collect::<Vec<_>>().join(", ")
    };
    let (lower, upper) = limits(cell);
    let slides = cell.choices.length();
    let mut out = format!(
        "//! Solvers of `{}` for the robot {}. Printed by rcgen.\n\
        #![allow(clippy::all, clippy::pedantic, dead_code, non_camel_case_types, non_snake_case, unused_parens, unused_variables)]\n\n\
        /// The joints, in the order of all arrays. Positions are in rad, of joints that slide in {slides}.\n\
        pub const JOINTS: [&str; {count}] = [{}];\n\n\
        /// The least positions of the joints.\npub const LOWER: [f64; {count}] = [{}];\n\n\
        /// The greatest positions of the joints.\npub const UPPER: [f64; {count}] = [{}];\n",
        cell.name,
        quoted(&cell.robot.name),
        names(cell),
        numbers(lower),
        numbers(upper),
    );
    let frames = Frames::of(cell);
    out += &frames.text(cell);
    for solver in &cell.solvers {
        let of = type_name(&solver.name);
        let _ = writeln!(
            out,
            "\n/// The result of [`{}`].\n#[derive(Clone, Copy, Debug, PartialEq)]\npub struct {of} {{",
            solver.name
        );
        for output in &solver.outputs {
            let kind = match output.shape {
                Shape::Vector(length) => format!("[f64; {length}]"),
                Shape::Matrix(rows, columns) => format!("[[f64; {columns}]; {rows}]"),
            };
            let kind = frames.of_output(output).unwrap_or(kind);
            let _ = writeln!(
                out,
                "    /// {}\n    pub {}: {kind},",
                output.doc, output.name
            );
        }
        out.push_str("}\n\n");
        for line in about(solver) {
            let _ = writeln!(out, "/// {line}");
        }
        let taken = arrays(cell, solver).into_iter();
        let taken = taken.map(|(array, count)| format!("{array}: &[f64; {count}]"));
        let _ = writeln!(
            out,
            "pub fn {}({}) -> {of} {{",
            solver.name,
            taken.collect::<Vec<_>>().join(", ")
        );
        out += &in_rust::statements(&solver.program, |at| input(cell, solver, at));
        let _ = writeln!(out, "    {of} {{");
        for (output, numbers) in outputs(solver) {
            let mut numbers = rows(output, &numbers, "[", "]");
            if frames.of_output(output).is_some() {
                numbers = format!("Pose::new({numbers})");
            }
            let _ = writeln!(out, "        {}: {numbers},", output.name);
        }
        out.push_str("    }\n}\n");
    }
    for one in &cell.inverses {
        out += &inverse::rust(cell, &frames, one);
    }
    if !cell.inverses.is_empty() {
        out += &inverse::rust_loops();
    }
    out
}

/// All solvers as Rust, and as methods of the type `Solvers`, for a context that has them as a field.
pub fn rust_methods(cell: &Cell) -> String {
    let count = cell.robot.coordinates.len();
    let frames = Frames::of(cell);
    let mut out = rust_of(&choices::laid_out(cell));
    out.push_str(
        "\n/// The solvers as methods.\n#[derive(Clone, Copy, Debug, Default)]\npub struct Solvers;\n\nimpl Solvers {\n",
    );
    let mut method = |name: &str, doc: Vec<String>, taken: Vec<(String, String)>| {
        for line in doc {
            let _ = writeln!(out, "    /// {line}");
        }
        let typed = taken.iter().map(|(name, kind)| format!(", {name}: {kind}"));
        let passed: Vec<&str> = taken.iter().map(|(name, _)| name.as_str()).collect();
        let _ = writeln!(
            out,
            "    pub fn {name}(&self{}) -> {} {{\n        {name}({})\n    }}\n",
            typed.collect::<String>(),
            type_name(name),
            passed.join(", ")
        );
    };
    for solver in &cell.solvers {
        let taken = arrays(cell, solver).into_iter();
        let taken = taken.map(|(array, size)| (array.to_owned(), format!("&[f64; {size}]")));
        method(&solver.name, about(solver), taken.collect());
    }
    for one in &cell.inverses {
        let taken = frames.arguments(count, one);
        method(&one.name, inverse::about(one), taken);
    }
    let _ = write!(
        out,
        "    /// The joints, in the order of all arrays.\n    pub fn joints(&self) -> &'static [&'static str; {count}] {{\n        &JOINTS\n    }}\n\n    \
        /// The least positions of the joints.\n    pub fn lower(&self) -> &'static [f64; {count}] {{\n        &LOWER\n    }}\n\n    \
        /// The greatest positions of the joints.\n    pub fn upper(&self) -> &'static [f64; {count}] {{\n        &UPPER\n    }}\n}}\n"
    );
    choices::typed(cell, out, true)
}

/// All solvers as C99. Each name begins with that of the cell.
///
/// Compilers that fuse a product and a sum give other last bits than Rust (`-ffp-contract=off`
/// tells GCC not to).
pub fn c(cell: &Cell) -> String {
    choices::typed(cell, c_of(&choices::laid_out(cell)), false)
}

fn c_of(cell: &Cell) -> String {
    let count = cell.robot.coordinates.len();
    let prefix = &cell.name;
    let numbers = |all: Vec<f64>| {
        let all = all.into_iter().map(|value| match value {
            f64::INFINITY => "INFINITY".to_owned(),
            f64::NEG_INFINITY => "-INFINITY".to_owned(),
            value => format!("{value:?}"),
        });
        all.collect::<Vec<_>>().join(", ")
    };
    let (lower, upper) = limits(cell);
    let slides = cell.choices.length();
    let guard = format!("{}_H", prefix.to_ascii_uppercase());
    let headers = if cell.inverses.is_empty() {
        "#include <math.h>"
    } else {
        "#include <float.h>\n#include <math.h>"
    };
    let mut out = format!(
        "/* Solvers of {prefix}. Printed by rcgen. */\n#ifndef {guard}\n#define {guard}\n\n{headers}\n\n"
    );
    if count > 0 {
        let _ = write!(
            out,
            "/* The joints, in the order of all arrays. Positions are in rad, of joints that slide in {slides}. */\n\
            static const char *const {prefix}_joints[{count}] = {{{}}};\n\n\
            /* The least and the greatest positions of the joints. */\n\
            static const double {prefix}_lower[{count}] = {{{}}};\n\
            static const double {prefix}_upper[{count}] = {{{}}};\n",
            names(cell).replace("??", "?\\?"),
            numbers(lower),
            numbers(upper),
        );
    }
    for solver in &cell.solvers {
        let name = format!("{prefix}_{}", solver.name);
        let _ = writeln!(out, "\n/* The result of {name}. */\ntypedef struct {{");
        for output in &solver.outputs {
            let shape = match output.shape {
                Shape::Vector(length) => format!("[{length}]"),
                Shape::Matrix(rows, columns) => format!("[{rows}][{columns}]"),
            };
            let doc = output.doc.replace("*/", "* /");
            let _ = writeln!(out, "    /* {doc} */\n    double {}{shape};", output.name);
        }
        let _ = writeln!(out, "}} {name}_result;\n\n/*");
        for line in about(solver) {
            let _ = writeln!(out, " * {}", line.replace("*/", "* /"));
        }
        let taken = arrays(cell, solver).into_iter();
        let taken = taken.map(|(array, size)| format!("const double {array}[{}], ", size.max(1)));
        let taken: Vec<String> = taken.collect();
        let _ = writeln!(
            out,
            " */\nstatic inline void {name}({}{name}_result *result)\n{{",
            taken.concat()
        );
        for (array, _) in arrays(cell, solver) {
            let _ = writeln!(out, "    (void){array};");
        }
        out += &in_c::statements(&solver.program, |at| input(cell, solver, at));
        for (output, numbers) in outputs(solver) {
            let place = match output.shape {
                Shape::Vector(_) => "*const out".to_owned(),
                Shape::Matrix(_, columns) => format!("(*const out)[{columns}]"),
            };
            // Its name at each number would be a quarter of the text.
            let _ = writeln!(
                out,
                "    {{\n        double {place} = result->{};",
                output.name
            );
            let mut line = String::new();
            for (at, number) in numbers.iter().enumerate() {
                let own = match output.shape {
                    Shape::Vector(_) => format!(" out[{at}] = {number};"),
                    Shape::Matrix(_, columns) => {
                        format!(" out[{}][{}] = {number};", at / columns, at % columns)
                    }
                };
                if line.len() + own.len() > LINE {
                    let _ = writeln!(out, "       {line}");
                    line.clear();
                }
                line += &own;
            }
            if !line.is_empty() {
                let _ = writeln!(out, "       {line}");
            }
            out.push_str("    }\n");
        }
        out.push_str("}\n");
    }
    if !cell.inverses.is_empty() {
        out += &inverse::c_loops(cell);
    }
    for one in &cell.inverses {
        out += &inverse::c(cell, one);
    }
    out.push_str("\n#endif\n");
    out
}

/// All solvers as Python, with its standard library. A solver returns a named tuple of lists.
/// Its numbers are of 64 bits, whatever the cell says.
pub fn python(cell: &Cell) -> String {
    let cell = &choices::laid_out(cell);
    let numbers = |all: Vec<f64>| {
        let all = all.into_iter().map(|value| match value {
            f64::INFINITY => "math.inf".to_owned(),
            f64::NEG_INFINITY => "-math.inf".to_owned(),
            value => format!("{value:?}"),
        });
        all.collect::<Vec<_>>().join(", ")
    };
    let (lower, upper) = limits(cell);
    let slides = cell.choices.length();
    let mut body = format!(
        "# The joints, in the order of all lists. Positions are in rad, of joints that slide in {slides}.\n\
        JOINTS = [{}]\n\n# The least and the greatest positions of the joints.\n\
        LOWER = [{}]\nUPPER = [{}]\n",
        names(cell),
        numbers(lower),
        numbers(upper),
    );
    for solver in &cell.solvers {
        let of = type_name(&solver.name);
        let _ = writeln!(
            body,
            "\n\nclass {of}(NamedTuple):\n    \"\"\"The result of {}.\"\"\"\n",
            solver.name
        );
        for output in &solver.outputs {
            let kind = match output.shape {
                Shape::Vector(_) => "list[float]",
                Shape::Matrix(..) => "list[list[float]]",
            };
            let _ = writeln!(body, "    # {}\n    {}: {kind}", output.doc, output.name);
        }
        let taken = arrays(cell, solver).into_iter();
        let taken = taken.map(|(array, _)| format!("{array}: Sequence[float]"));
        let _ = writeln!(
            body,
            "\n\ndef {}({}) -> {of}:",
            solver.name,
            taken.collect::<Vec<_>>().join(", ")
        );
        let lines = about(solver)
            .join("\n    ")
            .replace('\\', " ")
            .replace("\"\"\"", "'''");
        let _ = writeln!(body, "    \"\"\"{lines}\"\"\"");
        for (array, count) in arrays(cell, solver) {
            let _ = writeln!(
                body,
                "    if len({array}) != {count}:\n        \
                raise ValueError(f\"expected {count} numbers of {array}, found {{len({array})}}\")"
            );
        }
        body += &in_python::statements(&solver.program, |at| {
            format!("float({})", input(cell, solver, at))
        });
        let fields = outputs(solver).into_iter();
        let fields = fields.map(|(output, numbers)| rows(output, &numbers, "[", "]"));
        let _ = writeln!(
            body,
            "    return {of}({})",
            fields.collect::<Vec<_>>().join(", ")
        );
    }
    if !cell.inverses.is_empty() {
        body += &inverse::python_loops();
    }
    for one in &cell.inverses {
        body += &inverse::python(cell, one);
    }
    let robot = quoted(&cell.robot.name);
    format!(
        "# Solvers of {} for the robot {robot}. Printed by rcgen.\nfrom __future__ import annotations\n\n\
        from collections.abc import {}\nfrom typing import NamedTuple\n\n{}{body}",
        cell.name,
        if cell.inverses.is_empty() {
            "Sequence"
        } else {
            "Callable, Sequence"
        },
        in_python::preamble(&body).trim_start()
    )
}
