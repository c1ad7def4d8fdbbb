//! Converts names of the description languages into names of types, for every language.

use heck::ToUpperCamelCase;
use std::collections::HashSet;

/// `UpperCamelCase` that begins with a letter. A name that could be one already stays as it is.
pub(crate) fn camel(name: &str) -> String {
    let is_camel = name.starts_with(|c: char| c.is_ascii_uppercase()) && !name.contains('_');
    let shouts = name.len() > 1 && name.chars().all(|c| !c.is_ascii_lowercase());
    let camel = if is_camel && !shouts {
        name.to_owned()
    } else {
        name.to_upper_camel_case()
    };
    if camel.starts_with(|c: char| c.is_ascii_digit()) || camel.is_empty() {
        format!("N{camel}")
    } else {
        camel
    }
}

/// The type of a group of parameters: `laser` becomes `LaserParams`, so that it is not taken for the
/// type `Laser`. The names of the groups around it come first; where `a` in `b` and `b_a` would be
/// one name, the second gets a number. `taken` are the names of all groups so far.
pub(crate) fn group(taken: &mut HashSet<String>, owner: &str, parameter: &str) -> String {
    let owner = owner.strip_suffix("Params").unwrap_or(owner);
    let mut base = format!("{owner}{}", parameter.to_upper_camel_case());
    if base.starts_with(|c: char| c.is_ascii_digit()) {
        base.insert(0, 'N');
    }
    let numbered = (2..).map(|n| format!("{base}{n}Params"));
    let mut all = std::iter::once(format!("{base}Params")).chain(numbered);
    let name = all.find(|name| !taken.contains(name));
    let name = name.unwrap_or(base);
    taken.insert(name.clone());
    name
}
