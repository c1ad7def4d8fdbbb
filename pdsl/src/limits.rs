//! Checks lengths, ranges, choices and defaults against the type of their parameter.

use crate::ast;
use rc_configuration::model::{Length, Parameter, Range, Type, Value};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::{Literal, LiteralKind, home_in_path};
use rc_vocabulary::duration;

/// Checks limits, and reports errors.
pub(crate) struct LimitChecker<'f> {
    pub(crate) found: &'f mut Diagnostics,
}

impl LimitChecker<'_> {
    fn error(&mut self, code: &'static str, span: Span, message: impl Into<String>) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    pub(crate) fn length(&mut self, tree: Option<&ast::Length>) -> Length {
        let Some(tree) = tree else {
            return Length::default();
        };
        let mut bound = |literal: &Literal| {
            let value = literal.as_i64().and_then(|v| u32::try_from(v).ok());
            if value.is_none() {
                let message = format!("a length is an integer from 0 to {}", u32::MAX);
                self.error("bad-length", literal.span, message);
            }
            value
        };
        let (min, max) = (bound(&tree.min), bound(&tree.max));
        match (min, max) {
            (Some(min), Some(max)) if min > max => {
                let message = format!("the minimum length {min} is above the maximum {max}");
                self.error("bad-length", tree.min.span.to(tree.max.span), message);
                Length::default()
            }
            (_, Some(0)) => {
                self.error("bad-length", tree.max.span, "the maximum length is 0");
                Length::default()
            }
            _ => Length {
                min: min.unwrap_or_default(),
                max,
            },
        }
    }

    pub(crate) fn range(&mut self, ty: Type, tree: &ast::Range) -> Option<Range> {
        if !ty.is_ordered() {
            let message = format!(
                "only numbers and durations have a range; this is of type `{}`",
                ty.word()
            );
            self.error("bad-range", tree.span, message);
            return None;
        }
        let mut end = |literal: Option<&Literal>| {
            let literal = literal?;
            let value = value_of(ty, literal, false);
            if value.is_none() {
                let message = format!(
                    "{} cannot limit `{}`; allowed is {}",
                    described(literal),
                    ty.word(),
                    ty.described()
                );
                self.error("bad-range", literal.span, message);
            }
            value
        };
        let range = Range {
            min: end(tree.min.as_ref()),
            max: end(tree.max.as_ref()),
        };
        if let (Some(_), Some(max)) = (&range.min, &range.max)
            && !range.contains(max)
        {
            self.error(
                "bad-range",
                tree.span,
                "this range is empty: its end is below its start",
            );
            return None;
        }
        (range.min.is_some() || range.max.is_some()).then_some(range)
    }

    pub(crate) fn choices(&mut self, ty: Type, literals: &[Literal]) -> Vec<Value> {
        let mut choices: Vec<(Value, Span)> = Vec::new();
        for literal in literals {
            let Some(value) = value_of(ty, literal, true) else {
                let message = format!(
                    "{} is not of type `{}`; allowed is {}",
                    described(literal),
                    ty.word(),
                    ty.described()
                );
                self.error("bad-choice", literal.span, message);
                continue;
            };
            if let Some((_, first)) = choices.iter().find(|(choice, _)| *choice == value) {
                let message = format!("duplicate choice {}", described(literal));
                self.found.push(
                    Diagnostic::error("bad-choice", literal.span, message)
                        .label(*first, "first used here"),
                );
                continue;
            }
            choices.push((value, literal.span));
        }
        choices.into_iter().map(|(value, _)| value).collect()
    }

    pub(crate) fn default(
        &mut self,
        parameter: &Parameter,
        ty: Type,
        array: Option<Length>,
        default: &ast::DefaultValue,
        tree: &ast::Param,
    ) -> Option<Value> {
        match (default, array) {
            (ast::DefaultValue::One(literal), None) => {
                self.default_value(parameter, ty, literal, tree)
            }
            (ast::DefaultValue::Many(literals, span), Some(length)) => {
                if !length.allows(literals.len()) {
                    let count = literals.len();
                    let message = format!(
                        "the default has length {count}; allowed are {}",
                        length.described()
                    );
                    self.error("bad-default", *span, message);
                }
                let values = literals
                    .iter()
                    .map(|literal| self.default_value(parameter, ty, literal, tree));
                let values: Vec<Option<Value>> = values.collect();
                Some(Value::Array(values.into_iter().collect::<Option<_>>()?))
            }
            (ast::DefaultValue::One(literal), Some(_)) => {
                let message = format!(
                    "expected the default of an array in brackets, found {}",
                    described(literal)
                );
                self.error("bad-default", literal.span, message);
                None
            }
            (ast::DefaultValue::Many(_, span), None) => {
                let diagnostic = Diagnostic::error(
                    "bad-default",
                    *span,
                    "only an array has a list of values as default",
                );
                let ty = ty.word();
                self.found.push(diagnostic.help(format!(
                    "an array is declared with `{ty}[]`, or with the range of its length: `{ty}[3:3]`"
                )));
                None
            }
        }
    }

    fn default_value(
        &mut self,
        parameter: &Parameter,
        ty: Type,
        literal: &Literal,
        tree: &ast::Param,
    ) -> Option<Value> {
        let Some(value) = value_of(ty, literal, !tree.choices.is_empty()) else {
            let message = format!(
                "{} cannot be the default of `{}`",
                described(literal),
                ty.word()
            );
            let text = match &literal.kind {
                LiteralKind::String(text) if ty == Type::Duration => text.as_str(),
                _ => "",
            };
            let help = duration::help(text, ty.described());
            self.found
                .push(Diagnostic::error("bad-default", literal.span, message).help(help));
            return None;
        };
        if let (Type::Path, Value::Text(path)) = (ty, &value)
            && let Some(error) = home_in_path(path, literal.span)
        {
            self.found.push(error);
            return None;
        }
        if let Some(range) = parameter
            .range
            .as_ref()
            .filter(|range| !range.contains(&value))
        {
            let message = format!("the default {} is outside the range", value.to_toml());
            let diagnostic = Diagnostic::error("default-out-of-range", literal.span, message);
            let span = tree.range.as_ref().map_or(literal.span, |range| range.span);
            self.found.push(
                diagnostic
                    .label(span, "the range")
                    .help(format!("allowed is {}", range.described())),
            );
            return None;
        }
        if !parameter.choices.is_empty() && !parameter.choices.contains(&value) {
            let message = format!("the default {} is not one of the choices", value.to_toml());
            let diagnostic = Diagnostic::error("default-not-a-choice", literal.span, message);
            self.found
                .push(diagnostic.help(format!("allowed is {}", parameter.allowed_near(&value))));
            return None;
        }
        Some(value)
    }
}

/// "the number 1.0", for messages.
pub(crate) fn described(literal: &Literal) -> String {
    match &literal.kind {
        LiteralKind::Float(value) if !value.is_finite() => "a number that is too large".to_owned(),
        LiteralKind::Float(value) => format!("the number {value:?}"),
        LiteralKind::Duration(u64::MAX) => "a duration that is too long".to_owned(),
        LiteralKind::Duration(value) => format!("the duration {}", duration::text(*value)),
        _ => literal.described(),
    }
}

/// The value of an integer; beyond 64 bits only floating-point types have it.
pub(crate) fn integer(value: i128) -> Value {
    i64::try_from(value).map_or(Value::Float(value as f64), Value::Int)
}

/// Converts a literal into a value of `ty`. A bare name is a string only if there are `choices`.
fn value_of(ty: Type, literal: &Literal, choices: bool) -> Option<Value> {
    let value = match &literal.kind {
        LiteralKind::Int(value) => integer(*value),
        LiteralKind::Float(value) if value.is_finite() => Value::Float(*value),
        LiteralKind::Bool(value) => Value::Bool(*value),
        LiteralKind::Duration(value) => Value::Duration(*value),
        LiteralKind::String(value) => Value::Text(value.clone()),
        LiteralKind::Name(value) if choices => Value::Text(value.clone()),
        LiteralKind::Float(_) | LiteralKind::Name(_) => return None,
    };
    ty.convert(&value).ok()
}
