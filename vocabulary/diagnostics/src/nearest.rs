//! Suggestions for misspelled names.

/// The candidate with the smallest edit distance to `name`, if it is near enough.
///
/// Case is ignored: `laser` finds `Laser`. The distance is at most a third of the length of `name`.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = name.to_lowercase();
    let length = wanted.chars().count();
    // At least one letter stays unchanged.
    let allowed = (length / 3).max(1).min(length.saturating_sub(1));
    candidates
        .into_iter()
        .map(|c| (strsim::damerau_levenshtein(&wanted, &c.to_lowercase()), c))
        .filter(|(distance, _)| *distance <= allowed)
        .min_by_key(|(distance, c)| (*distance, *c))
        .map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn case_and_swapped_letters_are_near() {
        assert_eq!(nearest("laser", ["Laser", "Lasso"]), Some("Laser"));
        assert_eq!(
            nearest("GenericBsae", ["GenericBase", "Laser"]),
            Some("GenericBase")
        );
        assert_eq!(nearest("Speech", ["Laser"]), None);
        assert_eq!(nearest("a", ["b", "A"]), Some("A"));
        assert_eq!(nearest("a", ["b"]), None);
    }
}
