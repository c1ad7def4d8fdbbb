//! The fields of a block: each once, each known, and of the right kind.

use crate::ast::{Field, Map, Operand, OperandKind, Representation, Value};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use std::collections::HashMap;

/// The fields of a declaration by their names.
pub(crate) struct Fields<'a> {
    by_name: HashMap<&'a str, &'a Field>,
    /// The name of the declaration.
    of: &'a str,
    at: Span,
}

impl<'a> Fields<'a> {
    /// Reports fields that are not `known`, and repeated ones.
    pub(crate) fn new(
        of: &'a str,
        at: Span,
        fields: &'a [Field],
        known: &[&'static str],
        found: &mut Diagnostics,
    ) -> Self {
        let mut by_name: HashMap<&str, &Field> = HashMap::new();
        for field in fields {
            let name = field.name.text.as_str();
            if let Some(first) = by_name.get(name) {
                let message = format!("`{of}` already has a field `{name}`");
                let diagnostic = Diagnostic::error("repeated-key", field.name.span, message);
                found.push(diagnostic.label(first.name.span, "first given here"));
            } else if known.contains(&name) {
                by_name.insert(name, field);
            } else {
                let message = format!("unknown field `{name}`");
                let diagnostic = Diagnostic::error("unknown-field", field.name.span, message);
                found.push(diagnostic.suggest(name, known.iter().copied()));
            }
        }
        Self { by_name, of, at }
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// The place of a field.
    pub(crate) fn at(&self, name: &str) -> Option<Span> {
        self.by_name.get(name).map(|field| field.name.span)
    }

    fn value(&self, name: &str) -> Option<&'a Value> {
        self.by_name.get(name).map(|field| &field.value)
    }

    /// Reports a mandatory field that is missing.
    pub(crate) fn must_have(&self, name: &str, found: &mut Diagnostics) {
        if !self.has(name) {
            let message = format!("`{}` has no field `{name}`", self.of);
            let diagnostic = Diagnostic::error("missing-field", self.at, message);
            found.push(diagnostic.help(format!("add `{name} = …`")));
        }
    }

    fn wrong(name: &str, wanted: &str, value: &Value, found: &mut Diagnostics) {
        let message = format!("`{name}` is {wanted}");
        found.push(Diagnostic::error("wrong-value", value.span(), message));
    }

    /// A name.
    pub(crate) fn name(&self, name: &str, found: &mut Diagnostics) -> Option<&'a Operand> {
        let value = self.value(name)?;
        if let Value::Operand(operand) = value
            && matches!(operand.kind, OperandKind::Symbol(_))
        {
            return Some(operand);
        }
        Self::wrong(name, "a name", value, found);
        None
    }

    /// A member of the type.
    pub(crate) fn member(&self, name: &str, found: &mut Diagnostics) -> Option<(&'a str, Span)> {
        let value = self.value(name)?;
        if let Value::Operand(operand) = value
            && let OperandKind::Member(path) = &operand.kind
        {
            return Some((path, operand.span));
        }
        Self::wrong(name, "a member: write `member NAME`", value, found);
        None
    }

    /// A number that is not negative.
    pub(crate) fn number(&self, name: &str, found: &mut Diagnostics) -> Option<f64> {
        let value = self.value(name)?;
        let number = match value {
            Value::Operand(operand) if matches!(operand.kind, OperandKind::Symbol(_)) => {
                operand.text().parse::<f64>().ok()
            }
            _ => None,
        };
        let number = number.filter(|number| number.is_finite() && *number >= 0.0);
        if number.is_none() {
            Self::wrong(name, "a number of at least 0", value, found);
        }
        number
    }

    /// A map.
    pub(crate) fn map(&self, name: &str, found: &mut Diagnostics) -> Option<&'a Map> {
        let value = self.value(name)?;
        if let Value::Map(map) = value {
            return Some(map);
        }
        Self::wrong(name, "a map: `{ … }`", value, found);
        None
    }

    /// A type, or the name of a `ddr`.
    pub(crate) fn representation(
        &self,
        name: &str,
        found: &mut Diagnostics,
    ) -> Option<Result<&'a Representation, &'a Operand>> {
        match self.value(name)? {
            Value::Representation(of) => Some(Ok(of)),
            Value::Map(_) => {
                let value = self.value(name)?;
                Self::wrong(name, "a type: `:: c99{double[3]}`", value, found);
                None
            }
            Value::Operand(_) => self.name(name, found).map(Err),
        }
    }

    /// The names of a list: `{ A, B }`.
    pub(crate) fn names(&self, name: &str, found: &mut Diagnostics) -> Vec<String> {
        let Some(map) = self.map(name, found) else {
            return Vec::new();
        };
        for entry in map.entries.iter().filter(|entry| entry.right.is_some()) {
            let message = format!("`{name}` is a list of names");
            found.push(Diagnostic::error("wrong-entry", entry.span, message));
        }
        map.entries.iter().map(|entry| entry.left.text()).collect()
    }
}
