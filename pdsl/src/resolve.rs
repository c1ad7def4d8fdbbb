//! From the tree to the model: every limit and default is checked against its type.

use crate::ast::{self, FlagKind, Item};
use crate::model::{Kind, Length, Parameter, Parameters, Range, Rule, Type, Value};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Literal, LiteralKind, Name};

/// Reads and resolves one `.pdsl` text; none where nothing of it could be read.
pub fn load(sources: &SourceMap, source: SourceId) -> (Option<Parameters>, Diagnostics) {
    let (file, found) = parse(sources, source);
    let mut resolver = Resolver {
        found,
        rules: Vec::new(),
    };
    for import in &file.imports {
        let message = format!(
            "`{}` is not read: imports between .pdsl files do not exist yet",
            import.text
        );
        resolver.found.push(Diagnostic::warning(
            "not-supported-yet",
            import.span,
            message,
        ));
    }
    let parameters = file.params.map(|params| Parameters {
        parameters: resolver.items(&params.items, ""),
        name: params.name.text,
        doc: params.doc,
        rules: std::mem::take(&mut resolver.rules),
    });
    (parameters, resolver.found)
}

struct Resolver {
    found: Diagnostics,
    rules: Vec<Rule>,
}

impl Resolver {
    fn error(&mut self, code: &'static str, span: Span, message: impl Into<String>) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    fn items(&mut self, items: &[Item], scope: &str) -> Vec<Parameter> {
        self.duplicates(items.iter().filter_map(Item::name));
        let inner = |name: &Name| {
            if scope.is_empty() {
                name.text.clone()
            } else {
                format!("{scope}.{}", name.text)
            }
        };
        let mut out = Vec::new();
        for item in items {
            match item {
                Item::Param(param) => out.extend(self.param(param)),
                Item::Group(group) => {
                    let parts = self.items(&group.items, &inner(&group.name));
                    let mut parameter = Parameter::new(&group.name.text, Kind::Group(parts));
                    parameter.doc.clone_from(&group.doc);
                    out.push(parameter);
                }
                Item::List(list) => {
                    let parameters = self.items(&list.items, &inner(&list.name));
                    let length = self.length(list.length.as_ref());
                    let mut parameter =
                        Parameter::new(&list.name.text, Kind::List { length, parameters });
                    parameter.doc.clone_from(&list.doc);
                    out.push(parameter);
                }
                Item::Rule(rule) => {
                    let message = "this rule is kept, but nothing checks it yet";
                    self.found
                        .push(Diagnostic::warning("not-checked-yet", rule.span, message));
                    let (condition, message) = (rule.condition.clone(), rule.message.clone());
                    self.rules.push(Rule {
                        scope: scope.to_owned(),
                        condition,
                        message,
                    });
                }
            }
        }
        out
    }

    /// Names that differ only in case would become one name in some language.
    fn duplicates<'a>(&mut self, names: impl Iterator<Item = &'a Name>) {
        let mut seen: Vec<&Name> = Vec::new();
        for name in names {
            let Some(first) = seen
                .iter()
                .find(|s| s.text.eq_ignore_ascii_case(&name.text))
            else {
                seen.push(name);
                continue;
            };
            let message = if first.text == name.text {
                format!("parameter `{}` is declared twice", name.text)
            } else {
                format!(
                    "parameter `{}` differs from `{}` only in case",
                    name.text, first.text
                )
            };
            let diagnostic = Diagnostic::error("duplicate-name", name.span, message);
            self.found
                .push(diagnostic.label(first.span, "first declared here"));
        }
    }

    fn param(&mut self, tree: &ast::Param) -> Option<Parameter> {
        let Some(ty) = Type::from_word(&tree.ty.text) else {
            let message = format!("unknown type `{}`", tree.ty.text);
            let words = Type::WORDS.iter().map(|(word, _)| *word);
            self.found.push(
                Diagnostic::error("unknown-type", tree.ty.span, message)
                    .suggest(&tree.ty.text, words),
            );
            return None;
        };
        let array = tree
            .array
            .as_ref()
            .map(|array| self.length(array.length.as_ref()));
        let mut parameter = Parameter::new(&tree.name.text, Kind::Scalar { ty, array });
        parameter.doc.clone_from(&tree.doc);
        parameter.range = tree.range.as_ref().and_then(|range| self.range(ty, range));
        parameter.choices = self.choices(ty, &tree.choices);
        parameter.default = tree
            .default
            .as_ref()
            .and_then(|default| self.default(&parameter, ty, array, default, tree));
        self.flags(&mut parameter, &tree.flags);
        Some(parameter)
    }

    fn length(&mut self, tree: Option<&ast::Length>) -> Length {
        let Some(tree) = tree else {
            return Length::default();
        };
        let mut bound = |literal: &Literal| {
            let value = literal.as_i64().and_then(|v| u32::try_from(v).ok());
            if value.is_none() {
                let message = format!("a length is a whole number from 0 to {}", u32::MAX);
                self.error("bad-length", literal.span, message);
            }
            value
        };
        let (min, max) = (bound(&tree.min), bound(&tree.max));
        match (min, max) {
            (Some(min), Some(max)) if min > max => {
                let message = format!("no length is at least {min} and at most {max}");
                self.error("bad-length", tree.min.span.to(tree.max.span), message);
                Length::default()
            }
            (_, Some(0)) => {
                self.error(
                    "bad-length",
                    tree.max.span,
                    "this could never have an element",
                );
                Length::default()
            }
            _ => Length {
                min: min.unwrap_or_default(),
                max,
            },
        }
    }

    fn range(&mut self, ty: Type, tree: &ast::Range) -> Option<Range> {
        if !ty.is_ordered() {
            let message = format!(
                "a range is only possible for numbers and times; this is of type `{}`",
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
                    literal.described(),
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
                "this range is empty: its end is below its begin",
            );
            return None;
        }
        (range.min.is_some() || range.max.is_some()).then_some(range)
    }

    fn choices(&mut self, ty: Type, literals: &[Literal]) -> Vec<Value> {
        let mut choices: Vec<(Value, Span)> = Vec::new();
        for literal in literals {
            let Some(value) = value_of(ty, literal, true) else {
                let message = format!(
                    "{} is not of type `{}`; allowed is {}",
                    literal.described(),
                    ty.word(),
                    ty.described()
                );
                self.error("bad-choice", literal.span, message);
                continue;
            };
            if let Some((_, first)) = choices.iter().find(|(choice, _)| *choice == value) {
                let message = format!("{} is a choice already", literal.described());
                self.found.push(
                    Diagnostic::error("bad-choice", literal.span, message)
                        .label(*first, "first here"),
                );
                continue;
            }
            choices.push((value, literal.span));
        }
        choices.into_iter().map(|(value, _)| value).collect()
    }

    fn default(
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
                    "the default of an array stands in brackets, not {}",
                    literal.described()
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
                self.found
                    .push(diagnostic.help(format!("an array is declared with `{}[]`", ty.word())));
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
                literal.described(),
                ty.word()
            );
            let help = format!("allowed is {}", ty.described());
            self.found
                .push(Diagnostic::error("bad-default", literal.span, message).help(help));
            return None;
        };
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

    fn flags(&mut self, parameter: &mut Parameter, flags: &[ast::Flag]) {
        for (at, flag) in flags.iter().enumerate() {
            let class = |kind: &FlagKind| match kind {
                FlagKind::Editable | FlagKind::Fixed => 0,
                FlagKind::Unit(_) => 1,
                FlagKind::Restart => 2,
                FlagKind::Secret => 3,
            };
            if let Some(first) = flags[..at]
                .iter()
                .find(|f| class(&f.kind) == class(&flag.kind))
            {
                let message = if class(&flag.kind) == 0 && first.kind != flag.kind {
                    "a parameter is either `T`, changeable while the component runs, or `F`, fixed"
                } else {
                    "this was said already"
                };
                self.found.push(
                    Diagnostic::error("repeated-flag", flag.span, message)
                        .label(first.span, "first here"),
                );
                continue;
            }
            match &flag.kind {
                FlagKind::Editable => parameter.editable = true,
                FlagKind::Fixed => {}
                FlagKind::Unit(unit) => parameter.unit = Some(unit.clone()),
                FlagKind::Restart => parameter.restart = true,
                FlagKind::Secret => parameter.secret = true,
            }
        }
    }
}

/// A literal as a value of `ty`. A word is a text only beside `choices`, where it cannot be a slip of the pen.
fn value_of(ty: Type, literal: &Literal, choices: bool) -> Option<Value> {
    let value = match &literal.kind {
        LiteralKind::Int(value) => Value::Int(*value),
        LiteralKind::Float(value) if value.is_finite() => Value::Float(*value),
        LiteralKind::Bool(value) => Value::Bool(*value),
        LiteralKind::Duration(value) => Value::Duration(*value),
        LiteralKind::Text(value) => Value::Text(value.clone()),
        LiteralKind::Name(value) if choices => Value::Text(value.clone()),
        LiteralKind::Float(_) | LiteralKind::Name(_) => return None,
    };
    ty.accept(&value).ok()
}
