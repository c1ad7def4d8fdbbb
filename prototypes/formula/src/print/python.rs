//! Python, with its standard library.

use super::operands;
use crate::program::{Operand, Operation, Program, limits};
use rc_vocabulary::Primitive;
use std::fmt::Write;

/// Functions that give infinities and NaN where those of Python raise an exception.
const HELPERS: [(&str, &str); 7] = [
    (
        "_divide",
        "def _divide(a: float, b: float) -> float:
    if b != 0.0:
        return a / b
    if a == 0.0 or a != a:
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)
",
    ),
    (
        "_root",
        "def _root(a: float) -> float:
    return math.sqrt(a) if a >= 0.0 else math.nan
",
    ),
    (
        "_sine",
        "def _sine(a: float) -> float:
    return math.sin(a) if math.isfinite(a) else math.nan
",
    ),
    (
        "_cosine",
        "def _cosine(a: float) -> float:
    return math.cos(a) if math.isfinite(a) else math.nan
",
    ),
    (
        "_floor",
        "def _floor(a: float) -> float:
    return math.copysign(float(math.floor(a)), a) if math.isfinite(a) else a
",
    ),
    (
        "_nearest",
        "def _nearest(a: float) -> float:
    if not math.isfinite(a):
        return a
    whole = math.trunc(abs(a))
    return math.copysign(float(whole + (abs(a) - whole >= 0.5)), a)
",
    ),
    (
        "_single",
        "def _single(a: float) -> float:
    return ctypes.c_float(a).value
",
    ),
];

/// Whether a divisor is known, and not 0.
fn is_constant(divisor: Operand) -> bool {
    matches!(divisor, Operand::Constant(bits) if f64::from_bits(bits) != 0.0)
}

/// The statements of a function, which raises `ValueError` for numbers that are refused. `input` is
/// the number at a place of the input, a float. The text needs the [`preamble`] before it.
pub fn statements(program: &Program, input: impl Fn(usize) -> String) -> String {
    let mut body = String::new();
    for (at, node) in program.nodes.iter().enumerate() {
        let of = operands(node);
        let value = match &node.operation {
            Operation::Input(at) => input(*at),
            Operation::Negate => format!("-{}", of[0]),
            Operation::Add => format!("{} + {}", of[0], of[1]),
            Operation::Subtract => format!("{} - {}", of[0], of[1]),
            Operation::Multiply => format!("{} * {}", of[0], of[1]),
            Operation::Divide if is_constant(node.operands[1]) => format!("{} / {}", of[0], of[1]),
            Operation::Divide => format!("_divide({}, {})", of[0], of[1]),
            Operation::Root => format!("_root({})", of[0]),
            Operation::Floor => format!("_floor({})", of[0]),
            Operation::Nearest => format!("_nearest({})", of[0]),
            Operation::Sine => format!("_sine({})", of[0]),
            Operation::Cosine => format!("_cosine({})", of[0]),
            Operation::Angle => format!("math.atan2({}, {})", of[0], of[1]),
            Operation::Length => format!("math.hypot({}, {})", of[0], of[1]),
            Operation::IfBelow => format!("{} if {} < {} else {}", of[2], of[0], of[1], of[3]),
            Operation::Store(Primitive::F32) => format!("_single({})", of[0]),
            Operation::Store(number) => match limits(*number) {
                Some(_) => format!("_nearest({})", of[0]),
                None => of[0].clone(),
            },
            Operation::Require(..) => of[0].clone(),
            Operation::Call { function, .. } => format!("{function}([{}])", of.join(", ")),
            Operation::Result(place) => format!("{}[{place}]", of[0]),
        };
        let _ = writeln!(body, "    v{at} = {value}");
        if let Some((least, most)) = node.operation.range() {
            let _ = writeln!(body, "    if not {least:?} <= v{at} <= {most:?}:");
            let _ = writeln!(
                body,
                "        raise ValueError(f\"{{v{at}}} is not from {least:?} to {most:?}\")"
            );
        }
    }
    body
}

/// The imports and the functions that a text of [`statements`] needs before it.
pub fn preamble(body: &str) -> String {
    let used = |name: &str| body.contains(&format!("{name}("));
    let mut out = String::new();
    if used("_single") {
        out.push_str("import ctypes\n");
    }
    out.push_str("import math\n\n");
    for (name, text) in HELPERS {
        if used(name) {
            let _ = write!(out, "\n{text}\n");
        }
    }
    out + "\n"
}
