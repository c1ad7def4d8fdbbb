//! `[middleware.NAME]`: the settings of middlewares.

use crate::checker::{Checker, duration_help};
use crate::document;
use crate::model;
use rc_diagnostics::{Diagnostic, Span};
use rc_vocabulary::qos::PolicyName;
use rc_vocabulary::ros::Remapping;
use rc_vocabulary::{
    Key, Kind, Middleware, Scalar, Value, ValueError, key, keys, qos, unknown_key_help,
};
use std::collections::BTreeMap;
use toml_edit::{Item, TableLike};

/// The settings, by the names of middleware and key.
pub type Settings = BTreeMap<String, BTreeMap<String, Setting>>;

/// One setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The value.
    pub value: Value,
    /// The location of the value.
    pub span: Span,
}

impl Checker {
    pub(crate) fn middlewares(&mut self, table: &dyn TableLike, at: Span) -> Settings {
        let mut settings = Settings::new();
        for (name, item) in table.iter() {
            let place = self
                .locator
                .span(table.key(name).and_then(toml_edit::Key::span), at);
            if keys(name).is_none() {
                self.redact_item(item);
                let message = format!("unknown middleware `{name}`");
                let names = Middleware::words();
                let error = Diagnostic::error("unknown-middleware", place, message);
                self.found.push(error.suggest(name, names));
                continue;
            }
            let Some(inner) = item.as_table_like() else {
                self.wrong_type(item, &format!("middleware.{name}"), at, "a table");
                continue;
            };
            let inside = self.locator.span(item.span(), place);
            let set = settings.entry(name.to_owned()).or_default();
            for (word, item) in inner.iter() {
                let Some(key) = key(name, word) else {
                    self.redact_item(item);
                    let at = inner.key(word).and_then(toml_edit::Key::span);
                    let message = format!("unknown key `middleware.{name}.{word}`");
                    let error =
                        Diagnostic::error("unknown-key", self.locator.span(at, inside), message);
                    self.found.push(error.help(unknown_key_help(name, word)));
                    continue;
                };
                let path = format!("middleware.{name}.{word}");
                if let Some(setting) = self.setting(key, item, &path, inside) {
                    set.insert(word.to_owned(), setting);
                }
            }
        }
        settings
    }

    /// Reads one setting. Reports an error and returns `None` if it is invalid.
    fn setting(&mut self, key: &Key, item: &Item, path: &str, at: Span) -> Option<Setting> {
        let span = self.locator.span(item.span(), at);
        let value = if key.kind.is_list() {
            key.kind.join(self.list(key, item, path, span)?)?
        } else {
            self.single(key, item, path, span)?
        };
        Some(Setting { value, span })
    }

    fn list(&mut self, key: &Key, item: &Item, path: &str, place: Span) -> Option<Vec<Value>> {
        match (&key.kind, item.as_table_like()) {
            (Kind::Remappings, Some(table)) => return self.remappings(key, table, path, place),
            (Kind::Qos, Some(table)) => return self.qos(table, path, place),
            _ => {}
        }
        let Some(array) = item.as_array() else {
            let allowed = format!("an array, each element {}", key.kind.allowed());
            self.refuse("wrong-type", item, path, place, &allowed);
            return None;
        };
        let elements = array.iter().enumerate();
        let values: Vec<Option<Value>> = elements
            .map(|(index, value)| {
                let item = Item::Value(value.clone());
                let place = self.locator.span(value.span(), place);
                self.single(key, &item, &format!("{path}[{index}]"), place)
            })
            .collect();
        values.into_iter().collect()
    }

    /// The remappings of a table, whose keys are the names to replace.
    fn remappings(
        &mut self,
        key: &Key,
        table: &dyn TableLike,
        path: &str,
        place: Span,
    ) -> Option<Vec<Value>> {
        let rules: Vec<Option<Value>> = table
            .iter()
            .map(|(from, item)| {
                let path = format!("{path}.\"{from}\"");
                let place = self.locator.span(item.span(), place);
                let Some(to) = item.as_str() else {
                    self.refuse("wrong-type", item, &path, place, "the new name");
                    return None;
                };
                let rule = Remapping::new(from, to);
                if rule.is_none() {
                    self.refuse("bad-setting", item, &path, place, &key.kind.allowed());
                }
                Some(Value::Remappings(vec![rule?]))
            })
            .collect();
        rules.into_iter().collect()
    }

    /// The rules of a table whose keys are slots or operations, and whose values are tables of
    /// policies.
    fn qos(&mut self, table: &dyn TableLike, path: &str, place: Span) -> Option<Vec<Value>> {
        let mut rules: Vec<Option<Value>> = Vec::new();
        for (of, item) in table.iter() {
            let path = format!("{path}.\"{of}\"");
            let inside = self.locator.span(item.span(), place);
            let Some(policies) = item.as_table_like() else {
                let policies: Vec<&str> = PolicyName::of_topics().map(PolicyName::word).collect();
                let allowed = format!("a table of {}", policies.join(", "));
                self.refuse("wrong-type", item, &path, inside, &allowed);
                rules.push(None);
                continue;
            };
            for (name, item) in policies.iter() {
                let at = self.locator.span(item.span(), inside);
                let written = document::value(item);
                let value = match &written {
                    Some(model::Value::Int(number)) if !is_word(name) => Scalar::Int(*number),
                    Some(model::Value::Text(text)) if !is_count(name) => Scalar::Text(text),
                    // A value of the wrong type, or an unknown policy, which is reported below.
                    _ => match qos::allowed(name) {
                        Some(allowed) => {
                            let path = format!("{path}.{name}");
                            self.refuse("wrong-type", item, &path, at, &allowed);
                            rules.push(None);
                            continue;
                        }
                        None => Scalar::Other,
                    },
                };
                match qos::Rule::new(of, name, value) {
                    Ok(rule) => rules.push(Some(Value::Qos(vec![rule]))),
                    Err(reason) => {
                        let message = format!("`{path}`: {reason}");
                        self.found
                            .push(Diagnostic::error("bad-setting", at, message));
                        rules.push(None);
                    }
                }
            }
        }
        rules.into_iter().collect()
    }

    fn single(&mut self, key: &Key, item: &Item, path: &str, place: Span) -> Option<Value> {
        let given = document::value(item);
        let scalar = match &given {
            Some(model::Value::Int(number)) => Scalar::Int(*number),
            Some(model::Value::Bool(choice)) => Scalar::Bool(*choice),
            Some(model::Value::Text(text)) => Scalar::Text(text),
            _ => Scalar::Other,
        };
        let code = match key.kind.convert(scalar) {
            Ok(value) => return Some(value),
            Err(ValueError::Type) => "wrong-type",
            Err(ValueError::Range) => "out-of-range",
            Err(ValueError::Format) => "bad-setting",
        };
        self.refuse(code, item, path, place, &key.kind.allowed());
        None
    }

    /// Reports an error. Settings are never secret.
    fn refuse(&mut self, code: &'static str, item: &Item, path: &str, at: Span, allowed: &str) {
        let what = document::described(item, false);
        let message = format!("`{path}` cannot be {what}");
        // A duration that is out of range has a valid unit.
        let help = match code {
            "wrong-type" | "bad-setting" => duration_help(item, allowed),
            _ => format!("allowed is {allowed}"),
        };
        self.found
            .push(Diagnostic::error(code, at, message).help(help));
    }
}

/// Whether a policy takes a whole number, and nothing else.
fn is_count(policy: &str) -> bool {
    PolicyName::from_word(policy).is_some_and(PolicyName::counts)
}

/// Whether a policy takes a word, not a number.
fn is_word(policy: &str) -> bool {
    !is_count(policy) && !PolicyName::from_word(policy).is_some_and(PolicyName::is_time)
}
