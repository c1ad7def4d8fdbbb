//! Python, with its standard library.

use super::{Binding, Texts};
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
    let mut texts = Texts::new(program);
    for node in &program.nodes {
        let of = texts.operands(node);
        let is_guarded = node.operation == Operation::Divide && !is_constant(node.operands[1]);
        let plain = texts.arithmetic(node).filter(|_| !is_guarded);
        let (binding, value) = plain.unwrap_or_else(|| {
            let value = match &node.operation {
                Operation::Input(at) => input(*at),
                Operation::Divide => format!("_divide({}, {})", of[0], of[1]),
                Operation::Root => format!("_root({})", of[0]),
                Operation::Floor => format!("_floor({})", of[0]),
                Operation::Nearest => format!("_nearest({})", of[0]),
                Operation::Sine => format!("_sine({})", of[0]),
                Operation::Cosine => format!("_cosine({})", of[0]),
                Operation::Angle => format!("math.atan2({}, {})", of[0], of[1]),
                Operation::Length => format!("math.hypot({}, {})", of[0], of[1]),
                Operation::IfBelow => {
                    format!("{} if {} < {} else {}", of[2], of[0], of[1], of[3])
                }
                Operation::Store(Primitive::F32) => format!("_single({})", of[0]),
                Operation::Store(number) if limits(*number).is_some() => {
                    format!("_nearest({})", of[0])
                }
                Operation::Call { function, .. } => format!("{function}([{}])", of.join(", ")),
                Operation::Result(place) => format!("{}[{place}]", of[0]),
                _ => of.first().cloned().unwrap_or_default(),
            };
            (Binding::Atom, value)
        });
        let Some((name, value)) = texts.variable(binding, value) else {
            continue;
        };
        let _ = writeln!(body, "    {name} = {value}");
        if let Some((least, most)) = node.operation.range() {
            let _ = writeln!(body, "    if not {least:?} <= {name} <= {most:?}:");
            let _ = writeln!(
                body,
                "        raise ValueError(f\"{{{name}}} is not from {least:?} to {most:?}\")"
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
