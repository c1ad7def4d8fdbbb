//! "Did you mean …?"

/// The candidate that `name` most probably was meant to be, if one is near enough.
///
/// Upper and lower case count as equal here, so that `laser` finds `Laser`.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = name.to_lowercase();
    let length = wanted.chars().count();
    // A name of which no letter stays is another name.
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
    fn case_and_swapped_letters_are_near_and_other_words_are_not() {
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
