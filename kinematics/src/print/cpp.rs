//! Prints the solvers of a cell as C++: the code in C, and functions with matrices of Eigen around it.

use super::{about, arrays, c};
use crate::cell::{Cell, Output, Shape};
use crate::inverse::{Inverse, Question};
use crate::names::type_name;
use std::fmt::Write;

/// A type of Eigen, with the numbers as C has them; a column of Eigen is one of these, too.
fn matrix(rows: usize, columns: usize, by_columns: bool) -> String {
    let order = if by_columns || columns == 1 {
        "ColMajor"
    } else {
        "RowMajor"
    };
    format!("Eigen::Matrix<double, {rows}, {columns}, Eigen::{order}>")
}

fn kind(cell: &Cell, output: &Output) -> String {
    match output.shape {
        Shape::Vector(length) => matrix(length, 1, false),
        Shape::Matrix(rows, columns) => matrix(rows, columns, cell.choices.by_columns),
    }
}

/// An argument that has these numbers.
fn argument(rows: usize, columns: usize) -> String {
    format!("const {} &", matrix(rows, columns, false))
}

fn comment(out: &mut String, lines: &[String]) {
    for line in lines {
        let _ = writeln!(out, "/// {line}");
    }
}

/// All solvers as C++ 11 over Eigen, in a namespace with the name of the cell. The functions in C are in it as
/// [`c`] prints them.
pub fn cpp(cell: &Cell) -> String {
    let name = &cell.name;
    let mut out = c(cell);
    // They have their types already.
    let solvers = out.len();
    let _ = write!(
        out,
        "\n#ifndef {upper}_HPP\n#define {upper}_HPP\n\n#include <Eigen/Core>\n\nnamespace {name}\n{{\n",
        upper = name.to_ascii_uppercase()
    );
    for solver in &cell.solvers {
        let of = type_name(&solver.name);
        let _ = writeln!(out, "\n/// The result of {}.\nstruct {of}\n{{", solver.name);
        for output in &solver.outputs {
            let _ = writeln!(
                out,
                "    /// {}\n    {} {};",
                output.doc,
                kind(cell, output),
                output.name
            );
        }
        out.push_str("};\n\n");
        comment(&mut out, &about(solver));
        let taken = arrays(cell, solver);
        let typed = taken
            .iter()
            .map(|(array, size)| format!("{}{array}", argument(*size, 1)));
        let passed = taken.iter().map(|(array, _)| format!("{array}.data(), "));
        let _ = writeln!(
            out,
            "inline {of} {}({})\n{{\n    {name}_{}_result found;\n    {name}_{}({}&found);\n    {of} result;",
            solver.name,
            typed.collect::<Vec<_>>().join(", "),
            solver.name,
            solver.name,
            passed.collect::<String>()
        );
        for output in &solver.outputs {
            let first = match output.shape {
                Shape::Vector(_) => "[0]",
                Shape::Matrix(..) => "[0][0]",
            };
            let _ = writeln!(
                out,
                "    result.{field} = Eigen::Map<const {}>(&found.{field}{first});",
                kind(cell, output),
                field = output.name
            );
        }
        out.push_str("    return result;\n}\n");
    }
    for inverse in &cell.inverses {
        out += &asked(cell, inverse);
    }
    let text = out.split_off(solvers) + "}\n\n#endif\n";
    out + &super::choices::typed(cell, text, false)
}

/// An inverse solver: its result is that of C.
fn asked(cell: &Cell, inverse: &Inverse) -> String {
    let (name, count) = (&cell.name, cell.robot.coordinates.len());
    let own = &inverse.name;
    let of = type_name(own);
    let mut out = format!("\nusing {of} = {name}_{own}_result;\n\n");
    comment(&mut out, &super::inverse::about(inverse));
    comment(&mut out, std::slice::from_ref(&inverse.question));
    let (typed, before, passed) = match &inverse.asked {
        Question::Pose(search) => {
            let target = format!("{}target", argument(4, 4));
            let last = format!(", {}last", argument(count, 1));
            let copy = format!(
                "    double goal[4][4];\n    Eigen::Map<{}> rows(&goal[0][0]);\n    rows = target;\n",
                matrix(4, 4, cell.choices.by_columns)
            );
            match search.seed {
                Some(_) => (target, copy, "goal, "),
                None => (target + &last, copy, "goal, last.data(), "),
            }
        }
        Question::Velocity(_) => (
            format!(
                "{}positions, {}velocity",
                argument(count, 1),
                argument(6, 1)
            ),
            String::new(),
            "positions.data(), velocity.data(), ",
        ),
    };
    let _ = write!(
        out,
        "inline {of} {own}({typed})\n{{\n{before}    {of} result;\n    {name}_{own}({passed}&result);\n    return result;\n}}\n"
    );
    out
}
