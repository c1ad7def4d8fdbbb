//! What a text has for the layout of matrices and the type of numbers that its author chose.

use crate::ast::Math;
use crate::cell::{Cell, Shape};

/// The cell whose matrices have the numbers of its own by columns, if that is chosen: columns are
/// printed as rows.
pub(super) fn laid_out(cell: &Cell) -> Cell {
    let mut cell = cell.clone();
    if !cell.choices.by_columns {
        return cell;
    }
    for solver in &mut cell.solvers {
        let mut order = Vec::new();
        for output in &mut solver.outputs {
            let first = order.len();
            match output.shape {
                Shape::Vector(length) => order.extend(first..first + length),
                Shape::Matrix(rows, columns) => {
                    let column = |at| (0..rows).map(move |row| first + row * columns + at);
                    order.extend((0..columns).flat_map(column));
                    output.shape = Shape::Matrix(columns, rows);
                    output.doc += " By columns.";
                }
            }
        }
        solver.program = solver.program.with_results(&order);
    }
    cell
}

/// The rows of the argument `target`, if it has columns.
pub(super) fn rows_in_rust(cell: &Cell) -> &'static str {
    if cell.choices.by_columns {
        "    let rows: [[f64; 4]; 4] = core::array::from_fn(|row| core::array::from_fn(|column| target[column][row]));\n    \
        let target = &rows;\n"
    } else {
        ""
    }
}

/// The rows of the argument `target`, if it has columns.
pub(super) fn rows_in_c(cell: &Cell) -> &'static str {
    if cell.choices.by_columns {
        "    double rows[4][4];\n    for (int at = 0; at < 16; at++)\n        rows[at / 4][at % 4] = target[at % 4][at / 4];\n    \
        target = rows;\n"
    } else {
        ""
    }
}

/// Functions of `math.h` with a name of their own for numbers of 32 bits, and of the crate `libm`.
const FUNCTIONS: [&str; 8] = [
    "sin", "cos", "sqrt", "atan2", "floor", "round", "hypot", "fabs",
];

/// A text in Rust or C with its numbers of 32 bits, if they are chosen, and its functions.
pub(super) fn typed(cell: &Cell, text: String, is_rust: bool) -> String {
    let is_single = cell.choices.is_single;
    let text = if is_single {
        single(&text, is_rust)
    } else {
        text
    };
    if !is_rust || cell.choices.math == Math::Std {
        return text;
    }
    let (kind, end) = if is_single { ("f32", "f") } else { ("f64", "") };
    FUNCTIONS.iter().fold(text, |text, name| {
        text.replace(&format!("{kind}::{name}("), &format!("libm::{name}{end}("))
    })
}

/// How long a comment or a text in quotes is.
fn quoted(text: &str) -> Option<usize> {
    let end = |close: &str, from: usize| {
        let length = text[from..].find(close).map(|at| from + at + close.len());
        Some(length.unwrap_or(text.len()))
    };
    match text.as_bytes() {
        [b'/', b'/', ..] => end("\n", 2),
        [b'/', b'*', ..] => end("*/", 2),
        [b'#', b'i', ..] => end("\n", 0),
        [b'"', rest @ ..] => {
            let mut is_escaped = false;
            let length = rest.iter().position(|byte| {
                let is_end = *byte == b'"' && !is_escaped;
                is_escaped = *byte == b'\\' && !is_escaped;
                is_end
            });
            Some(length.map_or(text.len(), |length| length + 2))
        }
        _ => None,
    }
}

/// A number with a point or an exponent as one of 32 bits.
fn literal(word: &str, is_rust: bool) -> String {
    let least = f64::from(f32::MIN_POSITIVE);
    let value: f64 = word.parse().unwrap_or(0.0);
    let word = if value > 0.0 && value < least {
        // It keeps a quotient from 0.
        format!("{least:e}")
    } else {
        word.to_owned()
    };
    if is_rust { word } else { word + "f" }
}

fn single(text: &str, is_rust: bool) -> String {
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        if let Some(length) = quoted(rest) {
            out.push_str(&rest[..length]);
            at += length;
            continue;
        }
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        if first.is_ascii_digit() {
            let mut length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            if rest[..length].ends_with('e') && rest[length..].starts_with(['-', '+']) {
                let sign = length + 1;
                let digits = |c: char| !c.is_ascii_digit();
                length = sign + rest[sign..].find(digits).unwrap_or(rest.len() - sign);
            }
            let word = &rest[..length];
            if word.contains(['.', 'e']) && !word.contains("..") {
                out += &literal(word, is_rust);
            } else {
                out.push_str(word);
            }
            at += length;
            continue;
        }
        let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if is_letter(first) {
            let length = rest.find(|c| !is_letter(c)).unwrap_or(rest.len());
            let (word, next) = rest.split_at(length);
            out.push_str(match word {
                "f64" if is_rust => "f32",
                "double" if !is_rust => "float",
                "DBL_EPSILON" if !is_rust => "FLT_EPSILON",
                word => word,
            });
            if !is_rust && next.starts_with('(') && FUNCTIONS.contains(&word) {
                out.push('f');
            }
            at += length;
            continue;
        }
        out.push(first);
        at += first.len_utf8();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::single;

    #[test]
    fn numbers_and_types_become_those_of_32_bits() {
        let c = "#include <math.h>\n/* double 1.0 */ double v1 = sin(v0[2]) * 1e-7, \"1.0 double\\\" 2.0\", 0.5 - 1e-300; sin_ = 3;";
        let found = single(c, false);
        let expected = "#include <math.h>\n/* double 1.0 */ float v1 = sinf(v0[2]) * 1e-7f, \"1.0 double\\\" 2.0\", 0.5f - 1.1754943508222875e-38f; sin_ = 3;";
        assert_eq!(found, expected);
        let rust = "/// f64 1.0\nlet v1: f64 = f64::sin(v0) * 1.5e300; // f64\n[0.0; 3] 0..2";
        let expected = "/// f64 1.0\nlet v1: f32 = f32::sin(v0) * 1.5e300; // f64\n[0.0; 3] 0..2";
        assert_eq!(single(rust, true), expected);
    }
}
