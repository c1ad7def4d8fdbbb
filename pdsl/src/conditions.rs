//! Resolves the conditions of rules: resolves names, checks types, and compiles trees into steps.

use crate::ast::{self, Expression, ExpressionKind, Path, ProductOperator, SumOperator};
use crate::block::Block;
use crate::limits::{described, integer};
use rc_configuration::condition::{Comparator, Condition, Function, Reference, Step};
use rc_configuration::model::{Kind, Parameter, Rule, Type, Value};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::{Literal, LiteralKind, Name};
use std::collections::BTreeSet;

/// Resolves the rule `tree` in the groups and lists `scope` of `declared`. Reports errors and
/// returns `None` if the rule is invalid. Declarations in `invalid` have been reported.
pub(crate) fn resolve(
    declared: &Block<'_>,
    invalid: &BTreeSet<Vec<String>>,
    scope: &[String],
    tree: &ast::Rule,
    found: &mut Diagnostics,
) -> Option<Rule> {
    let mut blocks = vec![declared];
    for name in scope {
        blocks.push(blocks.last()?.inner(name)?);
    }
    let mut checker = ConditionResolver {
        blocks,
        scope,
        invalid,
        steps: Vec::new(),
        found,
    };
    checker.boolean(&tree.condition)?;
    Some(Rule {
        scope: scope.to_vec(),
        condition: Condition {
            steps: checker.steps,
        },
        text: tree.text.clone(),
        message: tree.message.clone(),
    })
}

/// Resolves rules over `parameters`, each in the groups `scope`. Rules about a group in `unknown`,
/// whose contents are not known, are left out.
pub fn resolve_rules<'r>(
    parameters: &[Parameter],
    unknown: &BTreeSet<Vec<String>>,
    rules: impl IntoIterator<Item = (&'r [String], &'r ast::Rule)>,
    found: &mut Diagnostics,
) -> Vec<Option<Rule>> {
    let declared = Block::new(parameters);
    let rules = rules.into_iter();
    rules
        .map(|(scope, rule)| resolve(&declared, unknown, scope, rule, found))
        .collect()
}

/// The type of an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OperandType {
    Bool,
    Number,
    Time,
    Text,
}

impl OperandType {
    fn of(ty: Type) -> Self {
        match ty {
            Type::Bool => Self::Bool,
            Type::Int | Type::Long | Type::Float | Type::Double => Self::Number,
            Type::Duration => Self::Time,
            Type::String | Type::Path => Self::Text,
        }
    }

    fn described(self) -> &'static str {
        match self {
            Self::Bool => "`true` or `false`",
            Self::Number => "a number",
            Self::Time => "a duration",
            Self::Text => "a string",
        }
    }
}

struct ConditionResolver<'m> {
    /// The blocks around the rule, the outermost first.
    blocks: Vec<&'m Block<'m>>,
    scope: &'m [String],
    invalid: &'m BTreeSet<Vec<String>>,
    steps: Vec<Step>,
    found: &'m mut Diagnostics,
}

/// The target of a path.
struct Target<'m> {
    reference: Reference,
    parameter: &'m Parameter,
    /// The list on the path.
    list: Option<&'m str>,
}

/// Why a path has no target.
enum PathError<'m> {
    /// The declaration of a name has errors.
    Invalid,
    /// The index of an unknown name, and the known names.
    Unknown(usize, Vec<&'m Parameter>),
    /// The index of a scalar, though the path goes on.
    NotATable(usize),
}

impl<'m> ConditionResolver<'m> {
    fn error(&mut self, code: &'static str, span: Span, message: String, help: Option<String>) {
        let diagnostic = Diagnostic::error(code, span, message);
        self.found.push(match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }

    /// Compiles an operand that must be a condition and must refer to a parameter.
    fn boolean(&mut self, tree: &Expression) -> Option<()> {
        let from = self.steps.len();
        let operand_type = self.operand_type(tree, None)?;
        if operand_type != OperandType::Bool {
            let message = format!("this is {}, not a condition", operand_type.described());
            let help = "compare it with something: `a < b`".to_owned();
            self.error("condition-type", tree.span, message, Some(help));
            return None;
        }
        let condition = Condition {
            steps: self.steps[from..].to_vec(),
        };
        if let Some(result) = condition.constant() {
            let says = match result {
                Ok(true) => "it always holds",
                Ok(false) => "it never holds",
                Err(_) => "it cannot be computed",
            };
            let message = format!("no parameter is named here: {says}");
            self.error("constant-condition", tree.span, message, None);
            return None;
        }
        Some(())
    }

    /// Compiles `tree`, and returns its type. If a name is not a parameter, it may be a choice of
    /// `compared_with`, the other side of a comparison.
    fn operand_type(
        &mut self,
        tree: &Expression,
        compared_with: Option<&'m Parameter>,
    ) -> Option<OperandType> {
        match &tree.kind {
            ExpressionKind::Literal(literal) => self.literal(literal),
            ExpressionKind::Path(path) => self.path(path, compared_with),
            ExpressionKind::Call(function, path) => self.call(function, path),
            ExpressionKind::Negative(inner) => {
                let operand_type = self.operand_type(inner, None)?;
                self.arithmetic(inner, operand_type)?;
                self.steps.push(Step::Negate);
                Some(operand_type)
            }
            ExpressionKind::Not(inner) => {
                self.boolean(inner)?;
                self.steps.push(Step::Not);
                Some(OperandType::Bool)
            }
            ExpressionKind::All(parts) => self.join(parts, &Step::And),
            ExpressionKind::Any(parts) => self.join(parts, &Step::Or),
            ExpressionKind::Sum(first, rest) => self.sum(first, rest),
            ExpressionKind::Product(first, rest) => self.product(first, rest),
            ExpressionKind::Comparison(left, comparator, right) => {
                self.comparison(left, *comparator, right)
            }
        }
    }

    fn join(&mut self, parts: &[Expression], step: &Step) -> Option<OperandType> {
        let mut fits = true;
        for (at, part) in parts.iter().enumerate() {
            fits &= self.boolean(part).is_some();
            if at > 0 {
                self.steps.push(step.clone());
            }
        }
        fits.then_some(OperandType::Bool)
    }

    fn literal(&mut self, literal: &Literal) -> Option<OperandType> {
        let (value, operand_type) = match &literal.kind {
            LiteralKind::Int(value) => (integer(*value), OperandType::Number),
            LiteralKind::Float(value) if value.is_finite() => {
                (Value::Float(*value), OperandType::Number)
            }
            LiteralKind::Bool(value) => (Value::Bool(*value), OperandType::Bool),
            LiteralKind::String(value) => (Value::Text(value.clone()), OperandType::Text),
            LiteralKind::Duration(value) if *value < u64::MAX => {
                (Value::Duration(*value), OperandType::Time)
            }
            // A negative duration is only possible in a condition.
            LiteralKind::Name(text) => match negative_time(text) {
                Some(value) => {
                    self.steps.push(Step::Value(Value::Duration(value)));
                    self.steps.push(Step::Negate);
                    return Some(OperandType::Time);
                }
                None => return self.too_large(literal, text),
            },
            LiteralKind::Float(_) => return self.too_large(literal, "this number"),
            LiteralKind::Duration(_) => return self.too_large(literal, "this duration"),
        };
        self.steps.push(Step::Value(value));
        Some(operand_type)
    }

    fn too_large(&mut self, literal: &Literal, what: &str) -> Option<OperandType> {
        let message = format!("{what} is too large");
        self.error("condition-type", literal.span, message, None);
        None
    }

    fn path(&mut self, path: &Path, compared_with: Option<&'m Parameter>) -> Option<OperandType> {
        if let ([name], Some(chosen)) = (path.names.as_slice(), compared_with)
            && let choice = Value::Text(name.text.clone())
            && (self.level(&name.text).is_none()
                || (self.is_group(&name.text) && chosen.choices.contains(&choice)))
        {
            if chosen.choices.contains(&choice) {
                self.steps.push(Step::Value(choice));
                return Some(OperandType::Text);
            }
            self.not_a_choice(chosen, &name.text, &format!("`{}`", name.text), name.span);
            return None;
        }
        let target = self.resolve_path(path)?;
        let Kind::Scalar { ty, array } = &target.parameter.kind else {
            let what = match target.parameter.kind {
                Kind::List { .. } => "a list",
                _ => "a group",
            };
            let message = format!("`{}` is {what} and has no value", path.text(usize::MAX));
            let help = "name one of the parameters in it".to_owned();
            self.error("condition-type", path.span, message, Some(help));
            return None;
        };
        let list = target.list.map(str::to_owned);
        if let Some(list) = list.or_else(|| array.map(|_| path.text(usize::MAX))) {
            let message = format!(
                "`{}` has a value for every element of `{list}`",
                path.text(usize::MAX)
            );
            let ways = if ty.is_ordered() {
                format!("write `min({0})` or `max({0})`", path.text(usize::MAX))
            } else {
                format!("write `unique({})`", path.text(usize::MAX))
            };
            let help = match target.list {
                Some(_) => format!("{ways}, or put the rule into the list"),
                None => ways,
            };
            self.error("condition-type", path.span, message, Some(help));
            return None;
        }
        self.steps.push(Step::Parameter(target.reference));
        Some(OperandType::of(*ty))
    }

    fn call(&mut self, name: &Name, path: &Path) -> Option<OperandType> {
        let Some(function) = Function::from_word(&name.text) else {
            let message = format!("unknown function `{}`", name.text);
            let words = Function::WORDS.iter().map(|(word, _)| *word);
            self.found.push(
                Diagnostic::error("unknown-function", name.span, message)
                    .suggest(&name.text, words),
            );
            return None;
        };
        let target = self.resolve_path(path)?;
        let word = name.text.to_lowercase();
        let (ty, many) = match &target.parameter.kind {
            Kind::Scalar { ty, array } => (Some(*ty), array.is_some() || target.list.is_some()),
            Kind::List { .. } => (None, true),
            Kind::Group(_) => (None, false),
        };
        let is_array = matches!(target.parameter.kind, Kind::Scalar { array: Some(_), .. });
        let (message, help) = match (function, ty) {
            (Function::Len, Some(_)) if !is_array && many => (
                format!("`{}` is one value in each element", path.text(usize::MAX)),
                format!("write `len({})`", path.text(path.names.len() - 1)),
            ),
            _ if !many => {
                let what = if ty.is_some() { "one value" } else { "a group" };
                let message = format!(
                    "`{word}` takes a list; `{}` is {what}",
                    path.text(usize::MAX)
                );
                let help = "a list, an array, or a parameter in the elements of a list".to_owned();
                (message, help)
            }
            (Function::Len, _) => {
                self.steps.push(Step::Call(function, target.reference));
                return Some(OperandType::Number);
            }
            (_, None) => (
                format!("`{}` is a list of structures", path.text(usize::MAX)),
                format!(
                    "name one of their parameters: `{word}({}.…)`",
                    path.text(usize::MAX)
                ),
            ),
            (Function::Unique, Some(_)) => {
                self.steps.push(Step::Call(function, target.reference));
                return Some(OperandType::Bool);
            }
            (Function::Min | Function::Max, Some(ty)) if ty.is_ordered() => {
                self.steps.push(Step::Call(function, target.reference));
                return Some(OperandType::of(ty));
            }
            (Function::Min | Function::Max, Some(ty)) => (
                format!(
                    "`{word}` takes numbers or durations; `{}` is of type `{}`",
                    path.text(usize::MAX),
                    ty.word()
                ),
                "only numbers and durations have an order".to_owned(),
            ),
        };
        self.error("condition-type", path.span, message, Some(help));
        None
    }

    /// The innermost block that declares `name`.
    fn level(&self, name: &str) -> Option<usize> {
        (0..self.blocks.len()).rev().find(|level| {
            let declared = self.blocks[*level].parameter(name);
            declared.is_some() || self.is_invalid(*level, [name])
        })
    }

    /// Whether `name` is that of a group, which has no value to compare: a choice may have it, too.
    fn is_group(&self, name: &str) -> bool {
        let level = self.level(name);
        let declared = level.and_then(|level| self.blocks[level].parameter(name));
        declared.is_some_and(|declared| matches!(declared.kind, Kind::Group(_)))
    }

    fn is_invalid<'n>(&self, level: usize, names: impl IntoIterator<Item = &'n str>) -> bool {
        let mut full = self.scope[..level].to_vec();
        full.extend(names.into_iter().map(str::to_owned));
        self.invalid.contains(&full)
    }

    /// Finds the target of `path`.
    fn find(&self, path: &Path) -> Result<Target<'m>, PathError<'m>> {
        let first = path.names.first().map_or("", |name| &name.text);
        let Some(level) = self.level(first) else {
            let known = self.blocks.iter().rev();
            let known = known.flat_map(|block| block.parameters);
            return Err(PathError::Unknown(0, known.collect()));
        };
        let (mut within, mut list) = (self.blocks[level], None);
        for (at, name) in path.names.iter().enumerate() {
            let names = path.names[..=at].iter().map(|n| n.text.as_str());
            let Some(parameter) = within.parameter(&name.text) else {
                return Err(if self.is_invalid(level, names) {
                    PathError::Invalid
                } else {
                    PathError::Unknown(at, within.parameters.iter().collect())
                });
            };
            if at + 1 == path.names.len() {
                let path = names.map(str::to_owned).collect();
                return Ok(Target {
                    reference: Reference { level, path },
                    parameter,
                    list,
                });
            }
            if matches!(parameter.kind, Kind::List { .. }) {
                list = Some(parameter.name.as_str());
            }
            within = within.inner(&name.text).ok_or(PathError::NotATable(at))?;
        }
        Err(PathError::Invalid)
    }

    /// Finds the target of `path`. Reports an error if there is none.
    fn resolve_path(&mut self, path: &Path) -> Option<Target<'m>> {
        match self.find(path) {
            Ok(target) => return Some(target),
            Err(PathError::Invalid) => {}
            Err(PathError::Unknown(at, known)) => {
                let message = format!("unknown parameter `{}`", path.text(at + 1));
                let name = &path.names[at];
                let known = known.iter().map(|p| p.name.as_str());
                self.found.push(
                    Diagnostic::error("unknown-parameter", name.span, message)
                        .suggest(&name.text, known),
                );
            }
            Err(PathError::NotATable(at)) => {
                let (value, next) = (path.text(at + 1), &path.names[at + 1]);
                let message = format!("`{value}` is one value; there is no `{}` in it", next.text);
                self.error("unknown-parameter", next.span, message, None);
            }
        }
        None
    }

    fn not_a_choice(&mut self, chosen: &Parameter, word: &str, described: &str, at: Span) {
        let message = format!("{described} is not one of the choices of `{}`", chosen.name);
        let texts = chosen.choices.iter().filter_map(Value::as_text);
        let diagnostic = Diagnostic::error("bad-choice", at, message);
        self.found.push(match texts.clone().next() {
            Some(_) => diagnostic.suggest(word, texts),
            None => diagnostic.help(format!("allowed is {}", chosen.allowed())),
        });
    }

    fn arithmetic(&mut self, tree: &Expression, operand_type: OperandType) -> Option<()> {
        if matches!(operand_type, OperandType::Number | OperandType::Time) {
            return Some(());
        }
        let message = format!("{} cannot be computed with", operand_type.described());
        self.error("condition-type", tree.span, message, None);
        None
    }

    fn sum(
        &mut self,
        first: &Expression,
        rest: &[(SumOperator, Expression)],
    ) -> Option<OperandType> {
        let mut sum = self.operand(first);
        for (operator, part) in rest {
            let operand_type = self.operand(part);
            self.steps.push(match operator {
                SumOperator::Add => Step::Add,
                SumOperator::Subtract => Step::Subtract,
            });
            sum = match (sum, operand_type) {
                (Some(sum), Some(operand_type)) if sum != operand_type => {
                    let message = format!(
                        "{} and {} cannot be added",
                        sum.described(),
                        operand_type.described()
                    );
                    self.error(
                        "condition-type",
                        first.span.to(part.span),
                        message,
                        unit_help(sum, operand_type),
                    );
                    None
                }
                (Some(sum), Some(_)) => Some(sum),
                _ => None,
            };
        }
        sum
    }

    fn product(
        &mut self,
        first: &Expression,
        rest: &[(ProductOperator, Expression)],
    ) -> Option<OperandType> {
        let mut product = self.operand(first);
        for (operator, part) in rest {
            let operand_type = self.operand(part);
            self.steps.push(match operator {
                ProductOperator::Multiply => Step::Multiply,
                ProductOperator::Divide => Step::Divide,
            });
            product = match (operator, product, operand_type) {
                (_, None, _) | (_, _, None) => None,
                (_, Some(operand_type), Some(OperandType::Number))
                | (ProductOperator::Multiply, Some(OperandType::Number), Some(operand_type)) => {
                    Some(operand_type)
                }
                (ProductOperator::Divide, Some(OperandType::Time), Some(OperandType::Time)) => {
                    Some(OperandType::Number)
                }
                (operator, Some(left), Some(right)) => {
                    let how = match operator {
                        ProductOperator::Multiply => "multiplied with",
                        ProductOperator::Divide => "divided by",
                    };
                    let (left, right) = (left.described(), right.described());
                    let message = format!("{left} cannot be {how} {right}");
                    self.error("condition-type", first.span.to(part.span), message, None);
                    None
                }
            };
        }
        product
    }

    /// Compiles an operand of a sum or a product.
    fn operand(&mut self, tree: &Expression) -> Option<OperandType> {
        let operand_type = self.operand_type(tree, None)?;
        self.arithmetic(tree, operand_type)?;
        Some(operand_type)
    }

    fn comparison(
        &mut self,
        left: &Expression,
        comparator: Comparator,
        right: &Expression,
    ) -> Option<OperandType> {
        let (chosen_left, chosen_right) =
            (self.choice_parameter(left), self.choice_parameter(right));
        let a = self.operand_type(left, chosen_right);
        let b = self.operand_type(right, chosen_left);
        self.steps.push(Step::Compare(comparator));
        let (a, b) = (a?, b?);
        let span = left.span.to(right.span);
        if a != b {
            let message = format!(
                "{} cannot be compared with {}",
                a.described(),
                b.described()
            );
            self.error("condition-type", span, message, unit_help(a, b));
            return None;
        }
        if !comparator.is_equality() && !matches!(a, OperandType::Number | OperandType::Time) {
            let message = format!("{} has no order", a.described());
            let help = "only `==` and `!=` compare it".to_owned();
            self.error("condition-type", span, message, Some(help));
            return None;
        }
        if comparator.is_equality() {
            self.check_choice(left, chosen_right)?;
            self.check_choice(right, chosen_left)?;
        }
        Some(OperandType::Bool)
    }

    /// The parameter that `tree` names, if it has choices.
    fn choice_parameter(&self, tree: &Expression) -> Option<&'m Parameter> {
        let ExpressionKind::Path(path) = &tree.kind else {
            return None;
        };
        let target = self.find(path).ok()?;
        Some(target.parameter).filter(|p| !p.choices.is_empty())
    }

    /// Reports a comparison with a value that the parameter cannot have. Its result would be
    /// constant.
    fn check_choice(&mut self, tree: &Expression, chosen: Option<&Parameter>) -> Option<()> {
        let (ExpressionKind::Literal(literal), Some(chosen)) = (&tree.kind, chosen) else {
            return Some(());
        };
        let Kind::Scalar { ty, .. } = chosen.kind else {
            return Some(());
        };
        let (value, word) = match &literal.kind {
            LiteralKind::Int(value) => (integer(*value), ""),
            LiteralKind::Float(value) => (Value::Float(*value), ""),
            LiteralKind::Duration(value) => (Value::Duration(*value), ""),
            LiteralKind::String(value) => (Value::Text(value.clone()), value.as_str()),
            LiteralKind::Bool(_) | LiteralKind::Name(_) => return Some(()),
        };
        if ty
            .convert(&value)
            .is_ok_and(|v| chosen.choices.contains(&v))
        {
            return Some(());
        }
        self.not_a_choice(chosen, word, &described(literal), literal.span);
        None
    }
}

/// A plain number counts milliseconds elsewhere. In a condition it could also be a factor.
fn unit_help(a: OperandType, b: OperandType) -> Option<String> {
    let classes = [a, b];
    (classes.contains(&OperandType::Time) && classes.contains(&OperandType::Number))
        .then(|| "a duration needs a unit here: `100ms`".to_owned())
}

fn negative_time(text: &str) -> Option<u64> {
    rc_vocabulary::duration::parse(text.strip_prefix('-')?).filter(|ns| *ns < u64::MAX)
}
