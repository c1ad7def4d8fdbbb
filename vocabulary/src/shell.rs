//! Words of a command line of `sh`.

/// A text as one word. Quotes are left out where the word needs none.
///
/// ```
/// use rc_vocabulary::shell;
///
/// assert_eq!(shell::word("/opt/robot-1"), "/opt/robot-1");
/// assert_eq!(shell::word("/a b/it's"), r"'/a b/it'\''s'");
/// assert_eq!(shell::word(""), "''");
/// ```
pub fn word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+@%:,=".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}
