//! Rules for names of components that hold for all languages of workers.

/// The length of a name, in characters.
const LONGEST: usize = 64;

/// Whether a name has the letters and the length that all languages take.
///
/// # Errors
/// The reason against it.
pub(crate) fn fits(name: &str) -> Result<(), &'static str> {
    let follows = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        Err("it must begin with a letter")
    } else if !name.chars().all(follows) {
        Err("it must consist of letters, digits and `_`")
    } else if name.len() > LONGEST {
        Err("it is longer than 64 characters")
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_short_word() {
        assert_eq!(fits("eyes_2"), Ok(()));
        assert_eq!(fits("2eyes"), Err("it must begin with a letter"));
        let letters = "it must consist of letters, digits and `_`";
        assert_eq!(fits("my-eyes_2"), Err(letters));
        assert_eq!(
            fits(&"e".repeat(65)),
            Err("it is longer than 64 characters")
        );
    }
}
