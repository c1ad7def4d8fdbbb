//! Evaluates the rules across parameters, and reports violations.

use crate::block::{Block, Content, Field, Origin};
use crate::condition::{
    EvaluationError, Function, Reference, ReferenceValues, first_duplicate, position_of_extreme,
};
use crate::document::Locator;
use crate::model::{Parameters, Rule, Value};
use crate::values::Values;
use rc_diagnostics::{Diagnostic, Span};

/// The rules of `parameters` that `values` violate, each by its index and with an explanation. The
/// values have been checked otherwise, as those of running components.
pub fn violations_by(parameters: &Parameters, values: &Values) -> Vec<(usize, String)> {
    let at = Locator::nowhere().start();
    let root = Block::of(&parameters.parameters, values, "", at);
    let broken = violations(&parameters.rules, &root).into_iter();
    broken
        .map(|(at, violation)| (at, violation.explanation))
        .collect()
}

/// A violated rule.
pub(crate) struct Violation<'a> {
    rule: &'a Rule,
    /// The value to point to first. A value that the user set takes precedence over a default.
    primary: InvolvedValue,
    related: Vec<InvolvedValue>,
    /// The condition, and the values that violate it.
    pub(crate) explanation: String,
}

/// A value that takes part in a violation.
struct InvolvedValue {
    path: String,
    at: Span,
    origin: Origin,
    /// The state of the value: "is 3".
    what: String,
}

/// The violated rules, each by its index, once for each element of the lists around it. A rule
/// that refers to an invalid value is not evaluated.
pub(crate) fn violations<'a>(rules: &'a [Rule], root: &Block) -> Vec<(usize, Violation<'a>)> {
    let mut all = Vec::new();
    for (at, rule) in rules.iter().enumerate() {
        visit_scope(&mut vec![root], &rule.scope, &mut |blocks| {
            all.extend(evaluate_rule(rule, blocks).map(|broken| (at, broken)));
        });
    }
    all
}

/// Calls `visit` for each block that `scope` leads to, with the blocks around it, the outermost
/// first.
fn visit_scope<'b>(
    blocks: &mut Vec<&'b Block>,
    scope: &[String],
    visit: &mut dyn FnMut(&[&'b Block]),
) {
    let Some((name, rest)) = scope.split_first() else {
        visit(blocks);
        return;
    };
    let field = blocks.last().and_then(|block| block.field(name));
    for block in field.into_iter().flat_map(Field::blocks) {
        blocks.push(block);
        visit_scope(blocks, rest, visit);
        blocks.pop();
    }
}

fn evaluate_rule<'a>(rule: &'a Rule, blocks: &[&Block]) -> Option<Violation<'a>> {
    let references = rule.condition.references();
    let named: Option<Vec<ResolvedReference<'_>>> = references
        .map(|(function, reference)| ResolvedReference::find(function, reference, blocks))
        .collect();
    let named = named?;
    let given: Vec<ReferenceValues<'_>> = named.iter().map(ResolvedReference::given).collect();
    let verdict = match rule.condition.holds(&given) {
        Ok(true) => return None,
        Ok(false) => "does not hold",
        Err(EvaluationError::DivisionByZero) => "divides by zero",
        Err(EvaluationError::Overflow) => "gives a number that is too large",
        Err(EvaluationError::NotANumber) => "cannot be computed with nan, which is not a number",
        Err(EvaluationError::EmptyList | EvaluationError::Malformed) => "cannot be computed",
    };
    let mut involved_values: Vec<InvolvedValue> = Vec::new();
    for involved_value in named
        .iter()
        .zip(&given)
        .flat_map(|(n, g)| n.involved_values(g))
    {
        if involved_values
            .iter()
            .all(|known| known.path != involved_value.path)
        {
            involved_values.push(involved_value);
        }
    }
    let values: Vec<String> = involved_values
        .iter()
        .map(InvolvedValue::described)
        .collect();
    let explanation = format!("`{}` {verdict}: {}", rule.text, values.join(", "));
    // A default has no location of its own; a value may have one.
    let origin = involved_values
        .iter()
        .map(|involved_value| involved_value.origin)
        .max();
    let primary = involved_values
        .iter()
        .position(|involved_value| Some(involved_value.origin) == origin);
    // The language refuses a condition without parameters.
    let primary = involved_values.remove(primary?);
    Some(Violation {
        rule,
        primary,
        related: involved_values,
        explanation,
    })
}

impl Violation<'_> {
    /// The finding for the author of the configuration.
    pub(crate) fn diagnostic(self) -> Diagnostic {
        let message = format!(
            "`{}` breaks a rule: {}",
            self.primary.path, self.rule.message
        );
        let diagnostic =
            Diagnostic::error("rule-broken", self.primary.at, message).help(self.explanation);
        let related = self
            .related
            .into_iter()
            .filter(|involved_value| involved_value.origin == Origin::UntypedValue);
        related.fold(diagnostic, |diagnostic, involved_value| {
            diagnostic.label(involved_value.at, format!("`{}`", involved_value.path))
        })
    }
}

impl InvolvedValue {
    fn described(&self) -> String {
        let default = match self.origin {
            Origin::Default => " by default",
            Origin::Existing | Origin::UntypedValue => "",
        };
        format!("`{}` {}{default}", self.path, self.what)
    }
}

/// A reference with its values.
struct ResolvedReference<'b> {
    function: Option<Function>,
    reference: &'b Reference,
    referenced_values: Vec<ReferencedValue<'b>>,
    /// The list or array that a function takes, or the parameter itself.
    field: &'b Field,
    count: usize,
}

/// A value, with its index if it is an element of an array.
struct ReferencedValue<'b> {
    value: &'b Value,
    field: &'b Field,
    element: Option<usize>,
}

impl<'b> ResolvedReference<'b> {
    /// Resolves a reference. `None` if a value on the path is invalid.
    fn find(
        function: Option<Function>,
        reference: &'b Reference,
        blocks: &[&'b Block],
    ) -> Option<Self> {
        let mut within: Vec<&'b Block> = vec![*blocks.get(reference.level)?];
        let (mut referenced_values, mut about, mut count) = (Vec::new(), None, 0);
        for name in &reference.path {
            count = 0;
            let mut inner = Vec::new();
            for block in within {
                let field = block.field(name).filter(|field| !field.faulty)?;
                match field.content.as_ref()? {
                    Content::Value(Value::Array(values)) => {
                        about = about.or(Some(field));
                        count += values.len();
                        let referenced_value = |(at, value)| ReferencedValue {
                            value,
                            field,
                            element: Some(at),
                        };
                        referenced_values.extend(values.iter().enumerate().map(referenced_value));
                    }
                    Content::Value(value) => {
                        about = about.or(Some(field));
                        referenced_values.push(ReferencedValue {
                            value,
                            field,
                            element: None,
                        });
                    }
                    Content::Group(block) => inner.push(block),
                    Content::List(elements) => {
                        about = about.or(Some(field));
                        count += elements.len();
                        inner.extend(elements);
                    }
                }
            }
            within = inner;
        }
        Some(Self {
            function,
            reference,
            referenced_values,
            field: about?,
            count,
        })
    }

    fn given(&self) -> ReferenceValues<'b> {
        ReferenceValues {
            values: self
                .referenced_values
                .iter()
                .map(|referenced_value| referenced_value.value)
                .collect(),
            count: self.count,
        }
    }

    /// The values that decide the condition.
    fn involved_values(&self, given: &ReferenceValues<'_>) -> Vec<InvolvedValue> {
        let whole = |what: &str| vec![self.field.involved_value(what.to_owned())];
        let referenced_value = |at: usize| {
            self.referenced_values
                .get(at)
                .map(ReferencedValue::involved_value)
        };
        match self.function {
            None => referenced_value(0).into_iter().collect(),
            Some(function @ (Function::Min | Function::Max)) => {
                let at = position_of_extreme(function, &given.values).and_then(referenced_value);
                at.map_or_else(|| whole("is empty"), |involved_value| vec![involved_value])
            }
            Some(Function::Len) => match self.reference.path.last() {
                Some(name) if *name != self.field.name => {
                    whole(&format!("has {} `{name}` in all", self.count))
                }
                _ => whole(&format!("has length {}", self.count)),
            },
            Some(Function::Unique) => match first_duplicate(&given.values) {
                // The later one of two equal values is the likely mistake.
                Some((first, second)) => [referenced_value(second), referenced_value(first)]
                    .into_iter()
                    .flatten()
                    .collect(),
                None => whole("has no value twice"),
            },
        }
    }
}

impl ReferencedValue<'_> {
    fn involved_value(&self) -> InvolvedValue {
        let what = if self.field.secret {
            "is secret".to_owned()
        } else {
            format!("is {}", self.value.to_toml())
        };
        let mut involved_value = self.field.involved_value(what);
        if let Some(at) = self.element {
            involved_value.path.push_str(&format!("[{at}]"));
            involved_value.at = *self.field.elements.get(at).unwrap_or(&involved_value.at);
        }
        involved_value
    }
}

impl Field {
    /// The tables in the field.
    fn blocks(&self) -> &[Block] {
        match &self.content {
            Some(Content::Group(block)) => std::slice::from_ref(block),
            Some(Content::List(elements)) => elements,
            Some(Content::Value(_)) | None => &[],
        }
    }

    fn involved_value(&self, what: String) -> InvolvedValue {
        InvolvedValue {
            path: self.path.clone(),
            at: self.at,
            origin: self.origin,
            what,
        }
    }
}
