//! `[parameters]` against the model: every fault is found, and every default is filled in.

use super::document::{self, Place};
use super::values::{Entry, Values};
use crate::model::{Kind, Length, Misfit, Parameter, Type, Value};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use toml_edit::{Item, TableLike};

/// Reads the values of parameters, and keeps what is wrong.
pub(super) struct Reader<'a> {
    pub(super) place: Place,
    pub(super) found: &'a mut Diagnostics,
    /// The paths that have neither a value nor a default.
    pub(super) missing: Vec<String>,
}

impl Reader<'_> {
    /// The values of `parameters` in `table`, which is called `path` and stands at `at`.
    pub(super) fn values(
        &mut self,
        parameters: &[Parameter],
        table: Option<&dyn TableLike>,
        path: &str,
        at: Span,
    ) -> Values {
        let mut values = Values::default();
        for parameter in parameters {
            let path = if path.is_empty() {
                parameter.name.clone()
            } else {
                format!("{path}.{}", parameter.name)
            };
            let item = table.and_then(|table| table.get_key_value(&parameter.name));
            let entry = match item {
                Some((key, item)) => {
                    let at = self.place.of(item.span().or(key.span()), at);
                    self.given(parameter, item, &path, at)
                }
                None => self.absent(parameter, &path, at),
            };
            if let Some(entry) = entry {
                values.push(&parameter.name, entry);
            }
        }
        for (name, _) in table.into_iter().flat_map(TableLike::iter) {
            if !parameters.iter().any(|p| p.name == name) {
                let full = if path.is_empty() {
                    name.to_owned()
                } else {
                    format!("{path}.{name}")
                };
                let span = self.place.of(
                    table
                        .and_then(|t| t.key(name))
                        .and_then(toml_edit::Key::span),
                    at,
                );
                let known = parameters.iter().map(|p| p.name.as_str());
                let message = format!("unknown parameter `{full}`");
                let diagnostic = Diagnostic::error("unknown-parameter", span, message);
                self.found.push(if parameters.is_empty() {
                    diagnostic.help("there are no parameters here")
                } else {
                    diagnostic.suggest(name, known)
                });
            }
        }
        values
    }

    fn absent(&mut self, parameter: &Parameter, path: &str, at: Span) -> Option<Entry> {
        match &parameter.kind {
            Kind::Group(inner) => return Some(Entry::Group(self.values(inner, None, path, at))),
            Kind::List { length, .. } if length.min == 0 => return Some(Entry::List(Vec::new())),
            _ => {}
        }
        if let Some(default) = &parameter.default {
            return Some(Entry::Value(default.clone(), parameter.secret));
        }
        self.missing.push(path.to_owned());
        let message = format!("`{path}` must be set");
        let help = format!("allowed is {}", parameter.allowed());
        self.found
            .push(Diagnostic::error("missing-parameter", at, message).help(help));
        None
    }

    fn given(&mut self, parameter: &Parameter, item: &Item, path: &str, at: Span) -> Option<Entry> {
        match &parameter.kind {
            Kind::Scalar { ty, array: None } => {
                let value = self.scalar(parameter, *ty, item, path, at)?;
                Some(Entry::Value(value, parameter.secret))
            }
            Kind::Scalar {
                ty,
                array: Some(length),
            } => {
                let Some(array) = item.as_array() else {
                    return self.wrong_type(parameter, item, path, at);
                };
                self.length(*length, array.len(), path, at);
                let mut values = Vec::new();
                for (index, value) in array.iter().enumerate() {
                    let span = self.place.of(value.span(), at);
                    let path = format!("{path}[{index}]");
                    values.extend(self.scalar(
                        parameter,
                        *ty,
                        &Item::Value(value.clone()),
                        &path,
                        span,
                    ));
                }
                Some(Entry::Value(Value::Array(values), parameter.secret))
            }
            Kind::Group(inner) => {
                let Some(table) = item.as_table_like() else {
                    return self.wrong_type(parameter, item, path, at);
                };
                Some(Entry::Group(self.values(inner, Some(table), path, at)))
            }
            Kind::List { length, parameters } => {
                let Some(tables) = document::tables(item) else {
                    return self.wrong_type(parameter, item, path, at);
                };
                self.length(*length, tables.len(), path, at);
                let mut elements = Vec::new();
                for (index, (table, span)) in tables.into_iter().enumerate() {
                    let at = self.place.of(span, at);
                    elements.push(self.values(
                        parameters,
                        Some(table),
                        &format!("{path}[{index}]"),
                        at,
                    ));
                }
                Some(Entry::List(elements))
            }
        }
    }

    fn length(&mut self, length: Length, count: usize, path: &str, at: Span) {
        if !length.allows(count) {
            let message = format!("`{path}` has length {count}");
            let help = format!("allowed are {}", length.described());
            self.found
                .push(Diagnostic::error("wrong-length", at, message).help(help));
        }
    }

    fn wrong_type(
        &mut self,
        parameter: &Parameter,
        item: &Item,
        path: &str,
        at: Span,
    ) -> Option<Entry> {
        let message = format!(
            "`{path}` cannot be {}",
            document::described(item, parameter.secret)
        );
        let help = format!("allowed is {}", parameter.allowed());
        self.found
            .push(Diagnostic::error("wrong-type", at, message).help(help));
        None
    }

    /// One value, or one element of an array.
    fn scalar(
        &mut self,
        parameter: &Parameter,
        ty: Type,
        item: &Item,
        path: &str,
        at: Span,
    ) -> Option<Value> {
        let (code, value) = match document::value(item)
            .ok_or(Misfit::Type)
            .and_then(|value| ty.accept(&value))
        {
            Err(Misfit::Type) => ("wrong-type", None),
            Err(Misfit::Size) => ("out-of-range", None),
            Ok(value)
                if parameter
                    .range
                    .as_ref()
                    .is_some_and(|range| !range.contains(&value)) =>
            {
                ("out-of-range", Some(value))
            }
            Ok(value) if !parameter.choices.is_empty() && !parameter.choices.contains(&value) => {
                ("invalid-choice", Some(value))
            }
            Ok(value) => return Some(value),
        };
        let message = format!(
            "`{path}` cannot be {}",
            document::described(item, parameter.secret)
        );
        let allowed = parameter.allowed_near(value.as_ref().unwrap_or(&Value::Bool(false)));
        self.found
            .push(Diagnostic::error(code, at, message).help(format!("allowed is {allowed}")));
        None
    }
}
