//! Prints the operations of a formula as statements. The value of node 3 is the variable `v3`.

pub mod c;
pub mod python;
pub mod rust;

use crate::program::{Node, Operand, Program};

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
pub fn is_reserved(function: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    // Functions of `math.h` end in `f` and `l` for the other floats.
    let stem = function.strip_suffix(['f', 'l']).unwrap_or(function);
    let is_word = |name: &str| RESERVED.split_whitespace().any(|word| word == name);
    is_word(function)
        || is_word(stem)
        || function.starts_with('_')
        || function.strip_prefix('v').is_some_and(is_number)
}

/// The results of a formula, after the statements of any language: variables and numbers.
pub fn results(program: &Program) -> Vec<String> {
    program.outputs.iter().copied().map(operand).collect()
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
