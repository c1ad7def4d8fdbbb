//! Parses the condition of a rule, for each language whose grammar has `condition.pest`.
//!
//! Between two brackets, pest gives a flat list of operands and operators. This module splits it
//! at the operators in the order of their precedence: `or`, `and`, `not`, comparisons, `+` and
//! `-`, `*` and `/`, sign.

use crate::ast::{self, Expression, ExpressionKind, Path, ProductOperator, SumOperator};
use pest::RuleType;
use pest::iterators::Pair;
use rc_configuration::condition::Comparator;
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::{Language, Name, ParseContext, Terminal, Trivia};

/// The meaning of a rule of `condition.pest`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A condition in brackets.
    Condition,
    /// An operator between two operands.
    Operator,
    /// `or`
    Or,
    /// `and`
    And,
    /// `not`
    Not,
    /// `==`, `<` and others.
    Comparator,
    /// `+` or `-`
    Add,
    /// `*` or `/`
    Multiply,
    /// The sign of an operand.
    Minus,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `max(motors.max)`
    Call,
    /// `motors.max`
    Path,
    /// A literal.
    Literal,
}

/// The `Rule` enumeration of a grammar with `condition.pest`; `condition_rules!` implements it.
pub trait ConditionRule: RuleType {
    /// The meaning of the rule.
    fn part(self) -> Part;
}

/// Implements [`ConditionRule`] for the `Rule` that pest generates.
#[macro_export]
macro_rules! condition_rules {
    () => {
        impl $crate::condition::ConditionRule for Rule {
            fn part(self) -> $crate::condition::Part {
                use $crate::condition::Part;
                match self {
                    Self::condition => Part::Condition,
                    Self::operator => Part::Operator,
                    Self::kw_or => Part::Or,
                    Self::kw_and => Part::And,
                    Self::kw_not => Part::Not,
                    Self::comparator => Part::Comparator,
                    Self::add_operator => Part::Add,
                    Self::mul_operator => Part::Multiply,
                    Self::minus => Part::Minus,
                    Self::open_bracket => Part::Open,
                    Self::close_bracket => Part::Close,
                    Self::call => Part::Call,
                    Self::path => Part::Path,
                    _ => Part::Literal,
                }
            }
        }
    };
}

/// Parses `require CONDITION "MESSAGE";`. Reports an error and returns `None` if the operators of the
/// condition are misplaced.
pub fn require<R: ConditionRule + Language>(
    r: &mut ParseContext<'_>,
    pair: Pair<'_, R>,
) -> Option<ast::Rule> {
    let (mut condition, mut message) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule().terminal() {
            Some(Terminal::String) => message = Some(r.string(&part).text),
            Some(Terminal::Semicolon) => r.semicolon(&part),
            _ if part.as_rule().part() == Part::Condition => condition = Some(part),
            _ => {}
        }
    }
    let condition = read(r, condition?)?;
    let text = &r.text[condition.span.start..condition.span.end];
    let text = Trivia::new(text).significant().trim_end().to_owned();
    Some(ast::Rule {
        condition,
        text,
        message: message?,
    })
}

/// Parses one condition. Reports an error and returns `None` if its operators are misplaced.
fn read<R: ConditionRule>(r: &mut ParseContext<'_>, pair: Pair<'_, R>) -> Option<Expression> {
    let mut operands = Vec::new();
    let mut before = None;
    for part in pair.into_inner() {
        match part.as_rule().part() {
            Part::Operator => {
                let sign = part.into_inner().next()?;
                before = Some((sign.as_rule().part(), r.name(&sign)));
            }
            _ => operands.push(operand(r, part, before.take())?),
        }
    }
    any(r, operands)
}

/// An operand with the operators around it.
struct Operand {
    /// The operator before it; `None` for the first operand.
    before: Option<(Part, Name)>,
    nots: Vec<Name>,
    minuses: usize,
    value: Expression,
}

fn operand<R: ConditionRule>(
    r: &mut ParseContext<'_>,
    pair: Pair<'_, R>,
    before: Option<(Part, Name)>,
) -> Option<Operand> {
    let (mut nots, mut minuses) = (Vec::new(), 0);
    let end = r.span(&pair).end;
    let mut open = None;
    for part in pair.into_inner() {
        match part.as_rule().part() {
            Part::Not => {
                let not = r.name(&part);
                report_foreign_operator(r, &not, "not");
                if minuses > 0 {
                    report_misplaced_not(r, &not);
                    return None;
                }
                nots.push(not);
            }
            Part::Minus => minuses += 1,
            Part::Open => {
                open = Some(Span {
                    end,
                    ..r.span(&part)
                });
            }
            _ => {
                let mut value = value(r, part)?;
                value.span = open.unwrap_or(value.span);
                return Some(Operand {
                    before,
                    nots,
                    minuses,
                    value,
                });
            }
        }
    }
    None
}

fn value<R: ConditionRule>(r: &mut ParseContext<'_>, pair: Pair<'_, R>) -> Option<Expression> {
    let span = r.span(&pair);
    let kind = match pair.as_rule().part() {
        Part::Condition => return read(r, pair),
        Part::Call => {
            let mut parts = pair.into_inner();
            let function = r.name(&parts.next()?);
            ExpressionKind::Call(function, path(r, parts.next()?))
        }
        Part::Path => ExpressionKind::Path(path(r, pair)),
        _ => ExpressionKind::Literal(r.literal(&pair)),
    };
    Some(Expression { kind, span })
}

fn path<R: RuleType>(r: &ParseContext<'_>, pair: Pair<'_, R>) -> Path {
    Path {
        span: r.span(&pair),
        names: pair.into_inner().map(|part| r.name(&part)).collect(),
    }
}

/// Splits `operands` at each operator `at`. The operator is removed from the first operand of
/// each part.
fn split(operands: Vec<Operand>, at: Part) -> Vec<(Option<Name>, Vec<Operand>)> {
    let mut parts: Vec<(Option<Name>, Vec<Operand>)> = Vec::new();
    for mut operand in operands {
        let sign = operand.before.take_if(|(before, _)| *before == at);
        match parts.last_mut() {
            Some((_, part)) if sign.is_none() => part.push(operand),
            _ => parts.push((sign.map(|(_, sign)| sign), vec![operand])),
        }
    }
    parts
}

fn any(r: &mut ParseContext<'_>, operands: Vec<Operand>) -> Option<Expression> {
    let mut parts = Vec::new();
    for (sign, part) in split(operands, Part::Or) {
        sign.iter()
            .for_each(|sign| report_foreign_operator(r, sign, "or"));
        parts.push(all(r, part)?);
    }
    joined(parts, ExpressionKind::Any)
}

fn all(r: &mut ParseContext<'_>, operands: Vec<Operand>) -> Option<Expression> {
    let mut parts = Vec::new();
    for (sign, part) in split(operands, Part::And) {
        sign.iter()
            .for_each(|sign| report_foreign_operator(r, sign, "and"));
        parts.push(truth(r, part)?);
    }
    joined(parts, ExpressionKind::All)
}

fn joined(
    mut parts: Vec<Expression>,
    kind: fn(Vec<Expression>) -> ExpressionKind,
) -> Option<Expression> {
    if parts.len() < 2 {
        return parts.pop();
    }
    let span = parts.first()?.span.to(parts.last()?.span);
    let kind = kind(parts);
    Some(Expression { kind, span })
}

/// `not not a < b`
fn truth(r: &mut ParseContext<'_>, mut operands: Vec<Operand>) -> Option<Expression> {
    let nots = std::mem::take(&mut operands.first_mut()?.nots);
    if let Some(not) = operands.iter().find_map(|operand| operand.nots.first()) {
        report_misplaced_not(r, not);
        return None;
    }
    let inner = comparison(r, operands)?;
    Some(match nots.first() {
        // Two of them cancel each other.
        Some(first) if nots.len() % 2 == 1 => Expression {
            span: first.span.to(inner.span),
            kind: ExpressionKind::Not(Box::new(inner)),
        },
        _ => inner,
    })
}

fn comparison(r: &mut ParseContext<'_>, operands: Vec<Operand>) -> Option<Expression> {
    let mut parts = split(operands, Part::Comparator).into_iter();
    let left = sum(parts.next()?.1)?;
    let Some((Some(sign), right)) = parts.next() else {
        return Some(left);
    };
    report_foreign_operator(r, &sign, "==");
    let comparator = Comparator::from_sign(&sign.text).unwrap_or(Comparator::Equal);
    let right = sum(right)?;
    if let Some((Some(second), _)) = parts.next() {
        let message = format!(
            "`{}` after `{}`: two values are compared",
            second.text, sign.text
        );
        r.found.push(
            Diagnostic::error("syntax-error", second.span, message)
                .help("three values are compared like this: `a < b and b < c`"),
        );
        return None;
    }
    Some(Expression {
        span: left.span.to(right.span),
        kind: ExpressionKind::Comparison(Box::new(left), comparator, Box::new(right)),
    })
}

fn sum(operands: Vec<Operand>) -> Option<Expression> {
    let parts = split(operands, Part::Add).into_iter();
    let operator = |sign: Name| match sign.text.as_str() {
        "+" => SumOperator::Add,
        _ => SumOperator::Subtract,
    };
    let parts = parts.map(|(sign, part)| Some((sign.map(operator), product(part)?)));
    chain(parts.collect::<Option<_>>()?, ExpressionKind::Sum)
}

fn product(operands: Vec<Operand>) -> Option<Expression> {
    let parts = split(operands, Part::Multiply).into_iter();
    let operator = |sign: Name| match sign.text.as_str() {
        "*" => ProductOperator::Multiply,
        _ => ProductOperator::Divide,
    };
    let parts = parts.map(|(sign, part)| Some((sign.map(operator), signed(part)?)));
    chain(parts.collect::<Option<_>>()?, ExpressionKind::Product)
}

fn chain<Operator>(
    parts: Vec<(Option<Operator>, Expression)>,
    kind: fn(Box<Expression>, Vec<(Operator, Expression)>) -> ExpressionKind,
) -> Option<Expression> {
    let mut parts = parts.into_iter();
    let (_, first) = parts.next()?;
    let rest: Vec<(Operator, Expression)> = parts
        .filter_map(|(operator, part)| Some((operator?, part)))
        .collect();
    let Some((_, last)) = rest.last() else {
        return Some(first);
    };
    Some(Expression {
        span: first.span.to(last.span),
        kind: kind(Box::new(first), rest),
    })
}

fn signed(operands: Vec<Operand>) -> Option<Expression> {
    let Operand { minuses, value, .. } = operands.into_iter().next()?;
    if minuses % 2 == 0 {
        return Some(value);
    }
    Some(Expression {
        span: value.span,
        kind: ExpressionKind::Negative(Box::new(value)),
    })
}

fn report_misplaced_not(r: &mut ParseContext<'_>, not: &Name) {
    let message = "`not` comes before a whole condition";
    let diagnostic = Diagnostic::error("syntax-error", not.span, message);
    r.found
        .push(diagnostic.help("put brackets around it: `a == (not b)`"));
}

/// Reports an operator of another language.
fn report_foreign_operator(r: &mut ParseContext<'_>, operator: &Name, word: &str) {
    if matches!(operator.text.as_str(), "&&" | "||" | "!" | "=") {
        let message = format!("`{}` is written `{word}` here", operator.text);
        r.found.push(Diagnostic::error(
            "foreign-operator",
            operator.span,
            message,
        ));
    }
}
