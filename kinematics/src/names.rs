//! Names in printed code.

use rc_formula::is_reserved;

/// Names in printed code other than those of solvers, with functions and types that it uses.
const TAKEN: [&str; 27] = [
    "joints",
    "lower",
    "upper",
    "JOINTS",
    "LOWER",
    "UPPER",
    "Solvers",
    "NamedTuple",
    "Sequence",
    "Callable",
    "numpy",
    "pathlib",
    // Built-in functions and types of Python that printed code names.
    "abs",
    "all",
    "bool",
    "dict",
    "enumerate",
    "float",
    "int",
    "list",
    "max",
    "min",
    "object",
    "range",
    "sum",
    "tuple",
    "zip",
];

/// Keywords of C++ that no other printed language has, and namespaces.
const CPP: &str = "and_eq bitand bitor catch co_await co_return co_yield compl concept consteval constexpr \
constinit const_cast decltype delete dynamic_cast Eigen explicit export friend mutable namespace new noexcept \
not_eq operator or_eq private protected public reinterpret_cast requires static_cast std template this throw \
typeid typename using wchar_t xor xor_eq";

/// The arguments of printed functions that have the numbers of joints.
pub(crate) const ARRAYS: [&str; 4] = ["positions", "velocities", "accelerations", "efforts"];

/// The name of the result type of a solver: that of `reach_far` is `ReachFarResult`.
pub(crate) fn type_name(name: &str) -> String {
    let words = name.split('_').map(|word| {
        let mut letters = word.chars();
        let first = letters.next().map(|first| first.to_ascii_uppercase());
        first.into_iter().chain(letters).collect::<String>()
    });
    words.collect::<String>() + "Result"
}

/// A name as one of printed code.
pub(crate) fn identifier(name: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    name.chars().map(letter).collect()
}

/// Whether printed code has a name for something else.
pub(crate) fn is_taken(name: &str) -> bool {
    let ends = name.ends_with("_result") || name.ends_with("Result");
    let is_of_cpp = CPP.split_whitespace().any(|word| word == name);
    is_reserved(name) || is_of_cpp || ends || TAKEN.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::TAKEN;

    /// A solver of this name would take the place of a function that the loops call.
    #[test]
    fn names_of_python_that_loops_use_are_taken() {
        let text = include_str!("print/inverse.py");
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let mut seen = 0;
        for (at, _) in text.match_indices(['(', '[']) {
            let before = &text[..at];
            let start = before.trim_end_matches(is_word).len();
            let (around, name) = before.split_at(start);
            let is_builtin = name.starts_with(|c: char| c.is_ascii_lowercase())
                && !around.ends_with(['.', '_'])
                && !around.ends_with("def ");
            let is_called =
                text[at..].starts_with('(') || ["list", "tuple", "dict"].contains(&name);
            // The function of the solver is an argument.
            if is_builtin && is_called && name != "motion" {
                assert!(
                    TAKEN.contains(&name) || rc_formula::is_reserved(name),
                    "{name}"
                );
                seen += 1;
            }
        }
        assert!(seen > 10, "{seen}");
    }
}
