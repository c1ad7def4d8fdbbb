//! Decodes texts of other processes, for `#[serde(deserialize_with = "foreign::text")]`. Each is
//! cleaned where it enters, see [`rc_diagnostics::foreign`].

use rc_diagnostics::foreign::{clean, clean_lines};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// How many characters of a text of several lines are kept, such as a reason with the end of a log.
const LONGEST: usize = 8 * 1024;
/// How many texts of a list are kept.
const LISTED: usize = 1024;

/// One line.
pub fn text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Ok(clean(&Cow::<str>::deserialize(deserializer)?))
}

/// The code of a diagnostic.
pub fn code<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Cow<'static, str>, D::Error> {
    text(deserializer).map(Cow::Owned)
}

/// One line, or nothing.
pub fn optional<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    let text = Option::<Cow<'_, str>>::deserialize(deserializer)?;
    Ok(text.map(|text| clean(&text)))
}

/// Several lines, of at most 8 Ki characters.
pub fn lines<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Ok(clean_lines(
        &Cow::<str>::deserialize(deserializer)?,
        LONGEST,
    ))
}

/// [`lines`], or nothing.
pub fn optional_lines<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = Option::<Cow<'_, str>>::deserialize(deserializer)?;
    Ok(text.map(|text| clean_lines(&text, LONGEST)))
}

/// A list of lines, of which the first 1024 are kept.
pub fn texts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    let mut texts = Vec::<String>::deserialize(deserializer)?;
    texts.truncate(LISTED);
    for text in &mut texts {
        *text = clean(text);
    }
    Ok(texts)
}

/// A map whose keys are lines.
pub fn keys<'de, D: Deserializer<'de>, V: Deserialize<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, V>, D::Error> {
    let map = BTreeMap::<String, V>::deserialize(deserializer)?;
    Ok(map
        .into_iter()
        .map(|(key, value)| (clean(&key), value))
        .collect())
}
