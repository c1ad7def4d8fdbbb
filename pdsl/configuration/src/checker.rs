//! Findings about the tables of a configuration, and what they must not show.

use crate::document::{self, Locator};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use toml_edit::{Item, Key, TableLike};

/// Collects the findings of a configuration, and the locations of its secrets.
pub(crate) struct Checker {
    pub(crate) locator: Locator,
    /// Whether a misplaced value may be a secret.
    pub(crate) has_secrets: bool,
    /// The locations of values that findings must not show.
    pub(crate) secrets: Vec<Span>,
    pub(crate) found: Diagnostics,
    /// The paths of parameters without a value and without a default.
    pub(crate) missing: Vec<String>,
}

impl Checker {
    /// The table `name` of `root`, with its location.
    pub(crate) fn table<'a>(
        &mut self,
        root: &'a dyn TableLike,
        name: &str,
    ) -> Option<(&'a dyn TableLike, Span)> {
        let (key, item) = root.get_key_value(name)?;
        let at = self
            .locator
            .span(item.span().or(key.span()), self.locator.start());
        let table = item.as_table_like();
        if table.is_none() {
            self.wrong_type(item, name, at, "a table");
        }
        table.map(|table| (table, at))
    }

    pub(crate) fn unknown_keys(
        &mut self,
        table: &dyn TableLike,
        known: &[&str],
        prefix: &str,
        at: Span,
    ) {
        for (name, item) in table.iter().filter(|(name, _)| !known.contains(name)) {
            self.redact_item(item);
            let span = self.locator.span(table.key(name).and_then(Key::span), at);
            let message = format!("unknown key `{prefix}{name}`");
            self.found.push(
                Diagnostic::error("unknown-key", span, message)
                    .suggest(name, known.iter().copied()),
            );
        }
    }

    pub(crate) fn redact(&mut self, values: Vec<std::ops::Range<usize>>) {
        let source = self.locator.source;
        let spans = values.into_iter();
        self.secrets
            .extend(spans.map(|value| Span::new(source, value.start, value.end)));
    }

    /// Redacts a value under an unknown key. It may belong to a secret parameter.
    pub(crate) fn redact_item(&mut self, item: &Item) {
        if self.has_secrets {
            let mut values = Vec::new();
            document::values_in(item, &mut values);
            self.redact(values);
        }
    }

    pub(crate) fn wrong_type(&mut self, item: &Item, path: &str, at: Span, allowed: &str) {
        // The keys of `[component]` are not secret.
        let has_secrets = self.has_secrets && !path.starts_with("component.");
        if has_secrets {
            self.redact_item(item);
        }
        let what = document::described(item, has_secrets);
        let message = format!("`{path}` cannot be {what}");
        let span = self.locator.span(item.span(), at);
        let help = duration_help(item, allowed);
        self.found
            .push(Diagnostic::error("wrong-type", span, message).help(help));
    }
}

/// The values that are allowed in place of `item`. For a duration, also what is wrong with its
/// unit.
pub(crate) fn duration_help(item: &Item, allowed: &str) -> String {
    let text = item.as_str().filter(|_| allowed.contains("duration"));
    rc_vocabulary::duration::help(text.unwrap_or_default(), allowed)
}
