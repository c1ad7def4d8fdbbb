//! Names in printed code.

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
