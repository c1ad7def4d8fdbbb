//! Decodes texts of other processes: each is cleaned where it enters, see
//! [`rc_diagnostics::foreign`].

use rc_diagnostics::foreign::{clean, clean_lines};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// How many characters of a text of several lines are kept: a reason with the last lines of a log.
pub(crate) const LONGEST: usize = 8 * 1024;
/// How many texts of a list are kept.
const LISTED: usize = 1024;

pub(crate) fn text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Ok(clean(&Cow::<str>::deserialize(deserializer)?))
}

pub(crate) fn code<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Cow<'static, str>, D::Error> {
    text(deserializer).map(Cow::Owned)
}

pub(crate) fn optional<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = Option::<Cow<'_, str>>::deserialize(deserializer)?;
    Ok(text.map(|text| clean(&text)))
}

pub(crate) fn lines<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Ok(clean_lines(
        &Cow::<str>::deserialize(deserializer)?,
        LONGEST,
    ))
}

pub(crate) fn optional_lines<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<String>, D::Error> {
    let text = Option::<Cow<'_, str>>::deserialize(deserializer)?;
    Ok(text.map(|text| clean_lines(&text, LONGEST)))
}

pub(crate) fn texts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    let mut texts = Vec::<String>::deserialize(deserializer)?;
    texts.truncate(LISTED);
    for text in &mut texts {
        *text = clean(text);
    }
    Ok(texts)
}

pub(crate) fn keys<'de, D: Deserializer<'de>, V: Deserialize<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, V>, D::Error> {
    let map = BTreeMap::<String, V>::deserialize(deserializer)?;
    Ok(map
        .into_iter()
        .map(|(key, value)| (clean(&key), value))
        .collect())
}
