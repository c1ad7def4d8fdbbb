//! Maps: each value on the left belongs to one on the right.

use crate::ast::{Entry, Map, Operand};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use std::collections::{HashMap, HashSet};

/// The forms that one side of a map may have.
pub(crate) struct Side<'a> {
    /// The kind of the values, for messages: `position`.
    pub(crate) of: &'a str,
    /// The values. Without any, all names are right.
    pub(crate) known: Option<&'a [String]>,
    /// Whether each value must be there.
    pub(crate) all: bool,
    /// Whether a value may occur only once.
    pub(crate) once: bool,
}

impl<'a> Side<'a> {
    /// Each of these values once.
    pub(crate) fn all(of: &'a str, known: &'a [String]) -> Self {
        Self {
            of,
            known: Some(known),
            all: true,
            once: true,
        }
    }

    /// Some of these values, each once.
    pub(crate) fn some(of: &'a str, known: &'a [String]) -> Self {
        Self {
            all: false,
            ..Self::all(of, known)
        }
    }

    /// Any names, each once.
    pub(crate) fn any(of: &'a str) -> Self {
        Self {
            of,
            known: None,
            all: false,
            once: true,
        }
    }

    /// Any names, as often as one likes.
    pub(crate) fn free(of: &'a str) -> Self {
        Self {
            once: false,
            ..Self::any(of)
        }
    }

    /// Whether a value fits. Reports it if not.
    fn fits(
        &self,
        operand: &Operand,
        seen: &mut HashMap<String, Span>,
        found: &mut Diagnostics,
    ) -> bool {
        let text = operand.text();
        if self.once {
            if let Some(first) = seen.get(&text) {
                let message = format!("`{text}` is given twice");
                let diagnostic = Diagnostic::error("repeated-key", operand.span, message);
                found.push(diagnostic.label(*first, "first named here"));
                return false;
            }
            seen.insert(text.clone(), operand.span);
        }
        let Some(known) = self.known.filter(|known| !known.contains(&text)) else {
            return true;
        };
        let message = format!("{} has no value `{text}`", self.of);
        let diagnostic = Diagnostic::error("unknown-symbol", operand.span, message);
        found.push(diagnostic.suggest(&text, known.iter().map(String::as_str)));
        false
    }

    /// Reports the values that are missing.
    fn complete(&self, map: &Map, seen: &HashMap<String, Span>, found: &mut Diagnostics) {
        let Some(known) = self.known.filter(|_| self.all) else {
            return;
        };
        let missing = known.iter().filter(|value| !seen.contains_key(*value));
        let missing: Vec<String> = missing.take(4).map(|value| format!("`{value}`")).collect();
        if !missing.is_empty() {
            let message = format!("the map lacks {} of {}", missing.join(", "), self.of);
            found.push(Diagnostic::error("missing-symbol", map.span, message));
        }
    }
}

/// The pairs of a map whose sides fit.
pub(crate) fn pairs<'m>(
    map: &'m Map,
    left: &Side<'_>,
    right: &Side<'_>,
    found: &mut Diagnostics,
) -> Vec<(&'m Operand, &'m Operand)> {
    let all = pairs_with(map, (left, right), false, found);
    all.into_iter()
        .map(|(one, other, _)| (one, other))
        .collect()
}

/// The pairs of a map whose sides fit, and whether a `-` stands between them, if it may.
pub(crate) fn pairs_with<'m>(
    map: &'m Map,
    (left, right): (&Side<'_>, &Side<'_>),
    takes_opposites: bool,
    found: &mut Diagnostics,
) -> Vec<(&'m Operand, &'m Operand, bool)> {
    let (mut on_left, mut on_right) = (HashMap::new(), HashMap::new());
    let mut pairs = Vec::new();
    let mut wrong = HashSet::new();
    for entry in &map.entries {
        let Some((one, other)) = sides(entry, takes_opposites, found) else {
            wrong.insert(entry.span.start);
            continue;
        };
        let fits = left.fits(one, &mut on_left, found);
        if right.fits(other, &mut on_right, found) && fits {
            pairs.push((one, other, entry.minus.is_some()));
        }
    }
    if wrong.is_empty() {
        left.complete(map, &on_left, found);
        right.complete(map, &on_right, found);
    }
    pairs
}

/// Both sides of an entry with `=`. `takes_opposites`: a `-` may stand before the right one.
pub(crate) fn sides<'m>(
    entry: &'m Entry,
    takes_opposites: bool,
    found: &mut Diagnostics,
) -> Option<(&'m Operand, &'m Operand)> {
    match &entry.right {
        Some((relation, right)) if relation.text == "=" => {
            if let Some(minus) = entry.minus.filter(|_| !takes_opposites) {
                let message = "only members of `dr` are the opposite of a value";
                found.push(Diagnostic::error("wrong-entry", minus, message));
                return None;
            }
            Some((&entry.left, right))
        }
        _ => {
            let message = format!("expected `{} = VALUE`", entry.left.text());
            found.push(Diagnostic::error("wrong-entry", entry.span, message));
            None
        }
    }
}
