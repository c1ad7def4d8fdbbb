//! Prints the formula of a plan as a function.
//!
//! The functions take and give numbers in the order of the prototypes; a comment names each with its
//! member and unit.

mod c;
mod python;
mod rust;

pub use c::c;
pub use python::python;
pub use rust::rust;

use crate::plan::Plan;
use crate::program::{Node, Operand};

/// Keywords of the three languages, functions of `math.h`, and what the printed functions use.
const RESERVED: &str = "\
alignas alignof and as assert async atan2 auto await become bool box break case char class const \
constexpr continue crate ctypes def default del do double dyn elif else enum except extern f64 False \
false final finally float fn for from gen global goto if impl import in inline int is lambda len let \
long loop macro main match math mod move mut None nonlocal not nullptr Option or override pass priv \
pub raise ref register restrict result return self Self short signed sizeof Some static \
static_assert struct super switch thread_local to trait True true try type typedef typeof union \
unsafe unsigned unsized use ValueError values virtual void volatile where while with yield \
acos acosh asin asinh atan atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs fdim floor \
fma fmax fmin fmod frexp hypot ilogb j0 j1 jn ldexp lgamma llrint llround log log10 log1p log2 logb \
lrint lround modf nan nearbyint nextafter nexttoward pow remainder remquo rint round scalbln scalbn \
sin sinh sqrt tan tanh tgamma trunc y0 y1 yn";

/// Whether printed code has this name for something else: a function of the user cannot have it.
pub(crate) fn is_reserved(function: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    // Functions of `math.h` end in `f` and `l` for the other floats.
    let stem = function.strip_suffix(['f', 'l']).unwrap_or(function);
    let is_word = |name: &str| RESERVED.split_whitespace().any(|word| word == name);
    is_word(function)
        || is_word(stem)
        || function.starts_with('_')
        || function.strip_prefix('v').is_some_and(is_number)
}

/// The name of the function.
fn name(plan: &Plan) -> String {
    format!("{}_to_{}", plan.from, plan.to())
}

/// An operand: `v3`, or a number. Negative numbers are in parentheses.
fn operand(operand: Operand) -> String {
    match operand {
        Operand::Node(at) => format!("v{at}"),
        Operand::Constant(bits) => {
            let value = f64::from_bits(bits);
            if value.is_sign_negative() {
                format!("({value:?})")
            } else {
                format!("{value:?}")
            }
        }
    }
}

fn operands(node: &Node) -> Vec<String> {
    node.operands.iter().copied().map(operand).collect()
}

/// `from[0]: X in mm, float32`, for each number.
fn list<'p>(plan: &'p Plan, from: &'p str, to: &'p str) -> impl Iterator<Item = String> + 'p {
    let lines = |array: &'p str, values: &'p [String]| {
        let values = values.iter().enumerate();
        values.map(move |(at, text)| format!("{array}[{at}]: {text}"))
    };
    lines(from, &plan.input).chain(lines(to, &plan.output))
}
