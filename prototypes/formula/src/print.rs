//! Prints the operations of a formula as statements. A value that several operations need is a variable, such as `v3`.

pub mod c;
pub mod python;
pub mod rust;

use crate::program::{Node, Operand, Operation, Program};

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
    // Functions of `math.h` end in `f` and `l` for the other floats.
    let stem = function.strip_suffix(['f', 'l']).unwrap_or(function);
    let is_word = |name: &str| RESERVED.split_whitespace().any(|word| word == name);
    is_word(function) || is_word(stem) || function.starts_with('_') || is_variable(function)
}

/// How many variables are numbered, have a digit and a letter, and a digit, a letter and another character.
const SHORT: [usize; 3] = [100, 10 * 52, 10 * 52 * 62];

const LETTERS: &[u8; 62] = b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";

/// The name of a variable. Names are a third of a text with thousands of them.
fn variable(at: usize) -> String {
    let [decimal, two, three] = SHORT;
    let letter = |at: usize| char::from(LETTERS[at]);
    match at.checked_sub(decimal) {
        Some(at) if at < two => format!("v{}{}", at / 52, letter(at % 52)),
        Some(at) if at < two + three => {
            let at = at - two;
            let (first, last) = (at / 62, at % 62);
            format!("v{}{}{}", first / 52, letter(first % 52), letter(last))
        }
        _ => format!("v{at}"),
    }
}

fn is_variable(name: &str) -> bool {
    let Some(rest) = name.strip_prefix('v') else {
        return false;
    };
    let is_short = rest.len() <= 3 && rest.bytes().all(|byte| byte.is_ascii_alphanumeric());
    let is_number = rest.bytes().all(|byte| byte.is_ascii_digit());
    rest.starts_with(|c: char| c.is_ascii_digit()) && (is_short || is_number)
}

/// The results of a formula, after the statements of any language: variables and numbers.
pub fn results(program: &Program) -> Vec<String> {
    let names = names(program);
    let results = program.outputs.iter();
    results
        .map(|operand| match operand {
            Operand::Node(at) => names[*at].clone().unwrap_or_default(),
            Operand::Constant(bits) => number(*bits),
        })
        .collect()
}

/// The most operations of an expression.
const LONGEST: usize = 12;

fn is_arithmetic(operation: &Operation) -> bool {
    matches!(
        operation,
        Operation::Input(_)
            | Operation::Negate
            | Operation::Add
            | Operation::Subtract
            | Operation::Multiply
            | Operation::Divide
    )
}

/// The variables of the nodes. A sum or a product that one other operation needs has none: it is a part of the
/// expression of that one.
fn names(program: &Program) -> Vec<Option<String>> {
    // For each node, the number of its uses, and the one that uses it.
    let mut uses = vec![(0_usize, 0); program.nodes.len()];
    let all = program.nodes.iter().enumerate();
    for (at, operand) in all.flat_map(|(at, node)| node.operands.iter().map(move |of| (at, of))) {
        if let Operand::Node(of) = operand {
            uses[*of] = (uses[*of].0 + 1, at);
        }
    }
    for operand in program.outputs.iter().chain(&program.locks) {
        if let Operand::Node(of) = operand {
            uses[*of].0 += 2;
        }
    }
    let mut lengths = vec![1; program.nodes.len()];
    let mut count = 0;
    let mut names = Vec::with_capacity(program.nodes.len());
    for (at, node) in program.nodes.iter().enumerate() {
        let (used, user) = uses[at];
        // Only one side of a choice is computed if both are expressions.
        let is_part = used == 1
            && is_arithmetic(&node.operation)
            && is_arithmetic(&program.nodes[user].operation)
            && lengths[at] + lengths[user] <= LONGEST;
        if is_part {
            lengths[user] += lengths[at];
            names.push(None);
        } else {
            names.push(Some(variable(count)));
            count += 1;
        }
    }
    names
}

/// Whether a text is an operand of another operation as it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Sign,
    Atom,
}

/// The texts of values, while a formula is printed.
struct Texts {
    names: Vec<Option<String>>,
    /// Those without a variable.
    parts: Vec<(Binding, String)>,
    /// Whether signs have spaces around them.
    has_spaces: bool,
}

impl Texts {
    fn new(program: &Program) -> Self {
        Self {
            names: names(program),
            parts: Vec::with_capacity(program.nodes.len()),
            has_spaces: true,
        }
    }

    /// Without spaces in expressions: they are a tenth of a text.
    fn tight(program: &Program) -> Self {
        Self {
            has_spaces: false,
            ..Self::new(program)
        }
    }

    /// An operand, in parentheses where the operation needs them.
    fn operand(&self, operand: Operand, least: Binding) -> String {
        match operand {
            Operand::Constant(bits) => number(bits),
            Operand::Node(at) => match (&self.names[at], &self.parts[at]) {
                (Some(name), _) => name.clone(),
                (None, (binding, text)) if *binding >= least => text.clone(),
                (None, (_, text)) => format!("({text})"),
            },
        }
    }

    fn operands(&self, node: &Node) -> Vec<String> {
        let operands = node.operands.iter();
        operands
            .map(|of| self.operand(*of, Binding::Atom))
            .collect()
    }

    /// A sum, a difference, a product, a quotient or an opposite. They are the same in all languages.
    fn arithmetic(&self, node: &Node) -> Option<(Binding, String)> {
        let of = |at: usize, least| self.operand(node.operands[at], least);
        let two = |sign, binding, above| {
            let (one, other) = (of(0, binding), of(1, above));
            // Two signs are another operator.
            let text = if self.has_spaces || other.starts_with('-') {
                format!("{one} {sign} {other}")
            } else {
                format!("{one}{sign}{other}")
            };
            Some((binding, text))
        };
        match node.operation {
            Operation::Negate => Some((Binding::Sign, format!("-{}", of(0, Binding::Atom)))),
            Operation::Add => two('+', Binding::Sum, Binding::Product),
            Operation::Subtract => two('-', Binding::Sum, Binding::Product),
            Operation::Multiply => two('*', Binding::Product, Binding::Sign),
            Operation::Divide => two('/', Binding::Product, Binding::Sign),
            _ => None,
        }
    }

    /// The variable of the next node, with its value. `None` if it is a part of another expression.
    fn variable(&mut self, binding: Binding, text: String) -> Option<(String, String)> {
        let name = self.names[self.parts.len()].clone();
        let kept = if name.is_none() {
            (binding, text.clone())
        } else {
            (Binding::Atom, String::new())
        };
        self.parts.push(kept);
        name.map(|name| (name, text))
    }
}

/// A number. Negative ones are in parentheses.
fn number(bits: u64) -> String {
    let value = f64::from_bits(bits);
    if value.is_sign_negative() {
        format!("({value:?})")
    } else {
        format!("{value:?}")
    }
}

#[cfg(test)]
mod tests {
    use super::{SHORT, is_reserved, variable};
    use std::collections::HashSet;

    #[test]
    fn variables_have_short_names_of_their_own() {
        let all: Vec<String> = (0..SHORT.iter().sum::<usize>() + 1_000)
            .map(variable)
            .collect();
        let different: HashSet<&String> = all.iter().collect();
        assert_eq!(different.len(), all.len());
        assert!(all.iter().all(|name| is_reserved(name)));
        let names = [99, 100, 619, 620, 3_000].map(variable);
        assert_eq!(names, ["v99", "v0a", "v9Z", "v0aa", "v0My"]);
        for free in ["v", "velocity", "v_1", "v1_2", "v12ab"] {
            assert!(!is_reserved(free), "{free}");
        }
    }
}
