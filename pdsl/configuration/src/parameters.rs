//! Checks `[parameters]` against the model, and fills in the defaults.

use crate::block::{Block, Content, Field, Origin, inner};
use crate::document::{self, Locator};
use crate::model::{ConversionError, Kind, Length, Parameter, Type, Value};
use crate::untyped_value::UntypedValue;
use rc_diagnostics::{Diagnostic, Diagnostics, Span, nearest};
use rc_vocabulary::duration;
use std::collections::{BTreeMap, HashSet};
use toml_edit::{Item, TableLike};

/// Reads the values of parameters, and collects the findings.
pub(crate) struct Reader<'a> {
    pub(crate) locator: Locator,
    /// Values for parameters that are not set and have no default, by their paths.
    pub(crate) given: &'a BTreeMap<String, UntypedValue>,
    pub(crate) found: &'a mut Diagnostics,
    /// The paths of parameters without a value and without a default.
    pub(crate) missing: Vec<String>,
    /// The locations of values that are secret or may be.
    pub(crate) secrets: Vec<Span>,
    /// Whether there are secrets. Then a misplaced value may be one.
    pub(crate) has_secrets: bool,
    /// Whether a missing list has one element, so that the rules in it can be evaluated.
    pub(crate) with_sample_elements: bool,
}

impl Reader<'_> {
    /// Reads the values of `parameters` from `table`, which has the path `path` and the location
    /// `at`.
    pub(crate) fn block(
        &mut self,
        parameters: &[Parameter],
        table: Option<&dyn TableLike>,
        path: &str,
        at: Span,
    ) -> Block {
        let mut block = Block::default();
        for parameter in parameters {
            let path = inner(path, &parameter.name);
            let item = table.and_then(|table| table.get_key_value(&parameter.name));
            let mut field = Field {
                name: parameter.name.clone(),
                path,
                at,
                origin: if item.is_some() {
                    Origin::UntypedValue
                } else {
                    Origin::Default
                },
                faulty: false,
                secret: parameter.secret,
                content: None,
                elements: Vec::new(),
            };
            match item {
                Some((key, item)) => {
                    field.at = self.locator.span(item.span().or(key.span()), at);
                    if parameter.secret {
                        self.redact(item);
                    }
                    self.read_given(parameter, item, &mut field);
                }
                None => self.read_absent(parameter, &mut field),
            }
            block.fields.push(field);
        }
        if let Some(table) = table {
            self.unknown(parameters, table, path, at);
        }
        block
    }

    fn unknown(&mut self, parameters: &[Parameter], table: &dyn TableLike, path: &str, at: Span) {
        let known: HashSet<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
        for (name, item) in table.iter().filter(|(name, _)| !known.contains(name)) {
            if self.has_secrets {
                self.redact(item);
            }
            let span = table.key(name).and_then(toml_edit::Key::span);
            let message = format!("unknown parameter `{}`", inner(path, name));
            let diagnostic =
                Diagnostic::error("unknown-parameter", self.locator.span(span, at), message);
            if parameters.is_empty() {
                self.found
                    .push(diagnostic.help("there are no parameters here"));
                continue;
            }
            // A user rarely means a parameter that the table already sets.
            let absent = parameters.iter().filter(|p| !table.contains_key(&p.name));
            let near = nearest(name, absent.map(|p| p.name.as_str()));
            self.found.push(match near {
                Some(_) => diagnostic.did_you_mean(name, near),
                None => diagnostic.suggest(name, parameters.iter().map(|p| p.name.as_str())),
            });
        }
    }

    /// Redacts the values in `item`.
    fn redact(&mut self, item: &Item) {
        let mut values = Vec::new();
        document::values_in(item, &mut values);
        let source = self.locator.source;
        let spans = values.into_iter();
        self.secrets
            .extend(spans.map(|value| Span::new(source, value.start, value.end)));
    }

    fn read_absent(&mut self, parameter: &Parameter, field: &mut Field) {
        if let (Kind::Scalar { ty, array }, None) = (&parameter.kind, &parameter.default)
            && let Some(given) = self.given.get(&field.path)
            && let Some(item) =
                document::from_json(&given.json(*ty, array.is_some()), ty.is_number())
        {
            self.read_given(parameter, &item, field);
            return;
        }
        let (path, at) = (&field.path, field.at);
        match &parameter.kind {
            Kind::Group(members) => {
                field.content = Some(Content::Group(self.block(members, None, path, at)));
            }
            Kind::List { parameters, .. } if self.with_sample_elements => {
                let path = format!("{path}[0]");
                let element = self.block(parameters, None, &path, at);
                field.content = Some(Content::List(vec![element]));
                field.faulty = true;
            }
            Kind::List { length, .. } if length.min == 0 => {
                field.content = Some(Content::List(Vec::new()));
            }
            Kind::Scalar { .. } if parameter.default.is_some() => {
                field.content = parameter.default.clone().map(Content::Value);
            }
            Kind::Scalar { .. } | Kind::List { .. } => {
                field.faulty = true;
                let message = format!("`{path}` must be set");
                let help = format!("allowed is {}", parameter.allowed());
                self.found
                    .push(Diagnostic::error("missing-parameter", at, message).help(help));
                self.missing.push(field.path.clone());
            }
        }
    }

    /// Reads `item` into the field of `parameter`.
    pub(crate) fn read_given(&mut self, parameter: &Parameter, item: &Item, field: &mut Field) {
        let (path, at) = (field.path.as_str(), field.at);
        let content = match &parameter.kind {
            Kind::Scalar { ty, array: None } => self
                .scalar(parameter, *ty, item, path, at)
                .map(Content::Value),
            Kind::Scalar {
                ty,
                array: Some(length),
            } => item.as_array().map(|array| {
                field.faulty = !self.length(*length, array.len(), path, at);
                let mut values = Vec::new();
                for (index, value) in array.iter().enumerate() {
                    let span = self.locator.span(value.span(), at);
                    let path = format!("{path}[{index}]");
                    let item = Item::Value(value.clone());
                    let value = self.scalar(parameter, *ty, &item, &path, span);
                    field.faulty |= value.is_none();
                    values.extend(value);
                    field.elements.push(span);
                }
                Content::Value(Value::Array(values))
            }),
            Kind::Group(members) => item
                .as_table_like()
                .map(|table| Content::Group(self.block(members, Some(table), path, at))),
            Kind::List { length, parameters } => document::tables(item).map(|tables| {
                field.faulty = !self.length(*length, tables.len(), path, at);
                let mut elements = Vec::new();
                for (index, (table, span)) in tables.into_iter().enumerate() {
                    let at = self.locator.span(span, at);
                    let path = format!("{path}[{index}]");
                    elements.push(self.block(parameters, Some(table), &path, at));
                }
                Content::List(elements)
            }),
        };
        // `scalar` has reported the error of a single value.
        let single = matches!(parameter.kind, Kind::Scalar { array: None, .. });
        if content.is_none() {
            field.faulty = true;
            // A value instead of a table, or a table instead of a value.
            if self.has_secrets && (!single || !item.is_value() || item.is_inline_table()) {
                self.redact(item);
            }
            if !single {
                self.wrong_type(parameter, item, &field.path, at);
            }
        }
        field.content = content;
    }

    /// Checks a length, and returns whether it is allowed.
    fn length(&mut self, length: Length, count: usize, path: &str, at: Span) -> bool {
        if !length.allows(count) {
            let message = format!("`{path}` has length {count}");
            let help = format!("allowed are {}", length.described());
            self.found
                .push(Diagnostic::error("wrong-length", at, message).help(help));
        }
        length.allows(count)
    }

    pub(crate) fn wrong_type(&mut self, parameter: &Parameter, item: &Item, path: &str, at: Span) {
        let what = document::described(item, parameter.has_secrets());
        let message = format!("`{path}` cannot be {what}");
        let help = format!("allowed is {}", parameter.allowed());
        self.found
            .push(Diagnostic::error("wrong-type", at, message).help(help));
    }

    /// Reads one value, or one element of an array.
    pub(crate) fn scalar(
        &mut self,
        parameter: &Parameter,
        ty: Type,
        item: &Item,
        path: &str,
        at: Span,
    ) -> Option<Value> {
        let mut nearest = None;
        let (code, value) = match document::value(item)
            .ok_or(ConversionError::WrongType)
            .and_then(|value| ty.convert(&value))
        {
            Err(ConversionError::WrongType) => ("wrong-type", None),
            Err(ConversionError::OutOfRange) => ("out-of-range", None),
            Ok(value)
                if parameter
                    .range
                    .as_ref()
                    .is_some_and(|range| !range.contains(&value)) =>
            {
                nearest = parameter
                    .range
                    .as_ref()
                    .and_then(|range| range.nearest(&value));
                ("out-of-range", Some(value))
            }
            Ok(Value::Text(text))
                if ty == Type::Path && (text == "~" || text.starts_with("~/")) =>
            {
                let message = format!("`{path}` begins with `~`, which only a shell expands");
                let diagnostic = Diagnostic::error("home-in-path", at, message);
                self.found.push(
                    diagnostic.help("write an absolute path, or one from the working directory"),
                );
                return None;
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
        // Another duration that is not allowed has a known unit.
        let is_unreadable = code == "wrong-type" && ty == Type::Duration;
        let help = match item.as_str().filter(|_| is_unreadable) {
            Some(text) => duration::help(text, &allowed),
            None => format!("allowed is {allowed}"),
        };
        let mut error = Diagnostic::error(code, at, message).help(help);
        // A duration has quotes in a configuration only: another fix would be needed in a network.
        if let (Some(limit), false) = (nearest, item.is_str() || parameter.secret) {
            error = error.likely_fix(item.to_string().trim(), limit.to_toml());
        }
        self.found.push(error);
        None
    }
}

/// Whether `item` is a valid value of `parameter`. Of a group, whether it is a table.
#[cfg(feature = "tools")]
pub(crate) fn is_valid_value(parameter: &Parameter, item: &Item, locator: Locator) -> bool {
    match &parameter.kind {
        Kind::Group(_) => item.is_table_like(),
        Kind::List { .. } => document::tables(item).is_some(),
        Kind::Scalar { .. } => {
            let mut found = Diagnostics::new();
            let mut reader = Reader {
                locator,
                given: &BTreeMap::new(),
                found: &mut found,
                missing: Vec::new(),
                secrets: Vec::new(),
                has_secrets: false,
                with_sample_elements: false,
            };
            let mut field = Field {
                name: String::new(),
                path: String::new(),
                at: locator.start(),
                origin: Origin::UntypedValue,
                faulty: false,
                secret: false,
                content: None,
                elements: Vec::new(),
            };
            reader.read_given(parameter, item, &mut field);
            found.is_empty()
        }
    }
}
