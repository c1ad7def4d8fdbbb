//! The condition of a rule, and its evaluation.
//!
//! A condition is a list of steps for a stack machine, not a tree. A component reads any
//! condition from JSON without recursion, however deep its brackets are.

use crate::value::Value;
use rc_vocabulary::Number;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// A condition whose operands were checked when the `.pdsl` was read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Condition {
    /// The steps in the order of their evaluation.
    pub steps: Vec<Step>,
}

/// One step. It pops up to two values from the stack and pushes one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Step {
    /// Pushes a constant.
    Value(Value),
    /// Pushes the value of a parameter.
    Parameter(Reference),
    /// Pushes the result of a function for a parameter in all elements of its lists.
    Call(Function, Reference),
    /// `-a`
    Negate,
    /// `a + b`
    Add,
    /// `a - b`
    Subtract,
    /// `a * b`
    Multiply,
    /// `a / b`
    Divide,
    /// `a < b`
    Compare(Comparator),
    /// `not a`
    Not,
    /// `a and b`
    And,
    /// `a or b`
    Or,
}

/// A reference to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// The block in which the path begins. 0 is the outermost block around the rule.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub level: usize,
    /// The names of the path.
    pub path: Vec<String>,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde calls it with a reference"
)]
fn is_zero(value: &usize) -> bool {
    *value == 0
}

/// The functions of lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Function {
    /// `min`: the smallest value.
    Min,
    /// `max`: the largest value.
    Max,
    /// `len`: the number of elements.
    Len,
    /// `unique`: whether all values are different.
    Unique,
}

impl Function {
    /// All functions with their names.
    pub const WORDS: [(&'static str, Self); 4] = [
        ("min", Self::Min),
        ("max", Self::Max),
        ("len", Self::Len),
        ("unique", Self::Unique),
    ];

    /// The function of that name, in upper or lower case.
    pub fn from_word(word: &str) -> Option<Self> {
        let mut words = Self::WORDS.iter();
        words
            .find(|(w, _)| w.eq_ignore_ascii_case(word))
            .map(|(_, function)| *function)
    }
}

/// The comparison operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Comparator {
    /// `==`
    #[serde(rename = "==")]
    Equal,
    /// `!=`
    #[serde(rename = "!=")]
    Unequal,
    /// `<`
    #[serde(rename = "<")]
    Less,
    /// `<=`
    #[serde(rename = "<=")]
    AtMost,
    /// `>`
    #[serde(rename = ">")]
    Greater,
    /// `>=`
    #[serde(rename = ">=")]
    AtLeast,
}

impl Comparator {
    const SIGNS: [(&'static str, Self); 6] = [
        ("==", Self::Equal),
        ("!=", Self::Unequal),
        ("<", Self::Less),
        ("<=", Self::AtMost),
        (">", Self::Greater),
        (">=", Self::AtLeast),
    ];

    /// The operator that `sign` stands for.
    pub fn from_sign(sign: &str) -> Option<Self> {
        let mut signs = Self::SIGNS.iter();
        signs.find(|(s, _)| *s == sign).map(|(_, c)| *c)
    }

    /// Whether the operator needs no order of the values.
    pub fn is_equality(self) -> bool {
        matches!(self, Self::Equal | Self::Unequal)
    }

    fn accepts(self, ordering: Ordering) -> bool {
        match self {
            Self::Equal => ordering.is_eq(),
            Self::Unequal => ordering.is_ne(),
            Self::Less => ordering.is_lt(),
            Self::AtMost => ordering.is_le(),
            Self::Greater => ordering.is_gt(),
            Self::AtLeast => ordering.is_ge(),
        }
    }
}

/// Why a condition has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EvaluationError {
    /// `min` or `max` of an empty list. A condition about it holds.
    EmptyList,
    /// A division by zero.
    DivisionByZero,
    /// An integer beyond 128 bits.
    Overflow,
    /// NaN, for which every comparison is false and so every `not` of one is true.
    NotANumber,
    /// The steps are not those of a condition: another version wrote the JSON.
    Malformed,
}

/// The values of one reference: one for a parameter, any number for a function.
pub(crate) struct ReferenceValues<'a> {
    pub(crate) values: Vec<&'a Value>,
    /// The number of elements, for `len`.
    pub(crate) count: usize,
}

impl Condition {
    /// The references with their functions, in the order of the text.
    pub fn references(&self) -> impl Iterator<Item = (Option<Function>, &Reference)> {
        self.steps.iter().filter_map(|step| match step {
            Step::Parameter(reference) => Some((None, reference)),
            Step::Call(function, reference) => Some((Some(*function), reference)),
            _ => None,
        })
    }

    /// The result of a condition that names no parameter; `None` if it names one.
    pub fn constant(&self) -> Option<Result<bool, EvaluationError>> {
        let is_constant = self.references().next().is_none();
        is_constant.then(|| self.holds(&[]))
    }

    /// Whether the condition holds for these values, one [`ReferenceValues`] for each reference.
    pub(crate) fn holds(&self, given: &[ReferenceValues<'_>]) -> Result<bool, EvaluationError> {
        match evaluate(&self.steps, given) {
            Ok(Operand::Bool(holds)) => Ok(holds),
            Ok(_) => Err(EvaluationError::Malformed),
            Err(EvaluationError::EmptyList) => Ok(true),
            Err(trouble) => Err(trouble),
        }
    }
}

type EvaluationResult<'a> = Result<Operand<'a>, EvaluationError>;

#[derive(Clone, Copy, Debug)]
enum Operand<'a> {
    Bool(bool),
    Number(Number),
    /// In nanoseconds. A difference of durations may be negative.
    Time(Number),
    Text(&'a str),
}

fn evaluate<'a>(steps: &'a [Step], given: &[ReferenceValues<'a>]) -> EvaluationResult<'a> {
    let mut given = given.iter();
    let mut stack: Vec<EvaluationResult<'a>> = Vec::new();
    for step in steps {
        let outcome = match step {
            Step::Value(value) => operand(value),
            Step::Parameter(_) => {
                let values = given.next().map_or(&[][..], |given| &given.values);
                values
                    .first()
                    .map_or(Err(EvaluationError::Malformed), |v| operand(v))
            }
            Step::Call(function, _) => given
                .next()
                .map_or(Err(EvaluationError::Malformed), |given| {
                    call(*function, given)
                }),
            Step::Negate => unary(&mut stack, negative),
            Step::Not => unary(&mut stack, |a| match a {
                Operand::Bool(a) => Ok(Operand::Bool(!a)),
                _ => Err(EvaluationError::Malformed),
            }),
            Step::Add => binary(&mut stack, |a, b| sum(a, b, plus)),
            Step::Subtract => binary(&mut stack, |a, b| sum(a, b, minus)),
            Step::Multiply => binary(&mut stack, multiply),
            Step::Divide => binary(&mut stack, divide),
            Step::Compare(comparator) => binary(&mut stack, |a, b| compare(*comparator, a, b)),
            Step::And => logical(&mut stack, false),
            Step::Or => logical(&mut stack, true),
        };
        stack.push(outcome);
    }
    stack.pop().unwrap_or(Err(EvaluationError::Malformed))
}

fn take<'a>(stack: &mut Vec<EvaluationResult<'a>>) -> EvaluationResult<'a> {
    stack.pop().unwrap_or(Err(EvaluationError::Malformed))
}

fn unary<'a>(
    stack: &mut Vec<EvaluationResult<'a>>,
    operation: impl Fn(Operand<'a>) -> EvaluationResult<'a>,
) -> EvaluationResult<'a> {
    take(stack).and_then(operation)
}

fn binary<'a>(
    stack: &mut Vec<EvaluationResult<'a>>,
    operation: impl Fn(Operand<'a>, Operand<'a>) -> EvaluationResult<'a>,
) -> EvaluationResult<'a> {
    let (b, a) = (take(stack), take(stack));
    operation(a?, b?)
}

/// `and` and `or`. If one side is `decisive`, an error of the other side does not matter: users
/// write `b == 0 or a / b > 2`.
fn logical<'a>(stack: &mut Vec<EvaluationResult<'a>>, decisive: bool) -> EvaluationResult<'a> {
    let (b, a) = (take(stack), take(stack));
    match (a, b) {
        (Ok(Operand::Bool(side)), _) | (_, Ok(Operand::Bool(side))) if side == decisive => {
            Ok(Operand::Bool(decisive))
        }
        // An empty list is the least severe error.
        (Err(trouble), Ok(_) | Err(EvaluationError::EmptyList)) | (_, Err(trouble)) => Err(trouble),
        (Ok(Operand::Bool(_)), Ok(Operand::Bool(_))) => Ok(Operand::Bool(!decisive)),
        (Ok(_), Ok(_)) => Err(EvaluationError::Malformed),
    }
}

fn operand(value: &Value) -> EvaluationResult<'_> {
    Ok(match value {
        Value::Bool(value) => Operand::Bool(*value),
        Value::Int(value) => Operand::Number(Number::Int(i128::from(*value))),
        Value::Float(value) => Operand::Number(number(*value)?),
        Value::Text(value) => Operand::Text(value),
        Value::Duration(value) => Operand::Time(Number::Int(i128::from(*value))),
        Value::Array(_) => return Err(EvaluationError::Malformed),
    })
}

fn call<'a>(function: Function, given: &ReferenceValues<'a>) -> EvaluationResult<'a> {
    match function {
        Function::Min | Function::Max => {
            let at =
                position_of_extreme(function, &given.values).ok_or(EvaluationError::EmptyList)?;
            operand(given.values[at])
        }
        Function::Len => Ok(Operand::Number(Number::Int(given.count as i128))),
        Function::Unique => Ok(Operand::Bool(first_duplicate(&given.values).is_none())),
    }
}

/// The index of the smallest or largest of `values`. NaN is both.
pub(crate) fn position_of_extreme(function: Function, values: &[&Value]) -> Option<usize> {
    let is_nan = |value: &&Value| matches!(value, Value::Float(float) if float.is_nan());
    let nan = values.iter().position(is_nan);
    let indices = 0..values.len();
    let by_value = |a: &usize, b: &usize| order(values[*a], values[*b]);
    nan.or_else(|| match function {
        Function::Max => indices.max_by(by_value),
        _ => indices.min_by(by_value),
    })
}

/// The first value that equals an earlier one, as (earlier, later).
pub(crate) fn first_duplicate(values: &[&Value]) -> Option<(usize, usize)> {
    let mut indices: Vec<usize> = (0..values.len()).collect();
    indices.sort_by(|a, b| order(values[*a], values[*b]));
    let pairs = indices.windows(2).map(|pair| (pair[0], pair[1]));
    pairs
        .filter(|(a, b)| order(values[*a], values[*b]).is_eq())
        .min_by_key(|(_, second)| *second)
}

/// The order of two values of one type.
fn order(a: &Value, b: &Value) -> Ordering {
    match (a, b) {
        (Value::Bool(a), Value::Bool(b)) => a.cmp(b),
        (Value::Int(a), Value::Int(b)) => a.cmp(b),
        // Adding zero turns -0.0 into 0.0.
        (Value::Float(a), Value::Float(b)) => (a + 0.0).total_cmp(&(b + 0.0)),
        (Value::Text(a), Value::Text(b)) => a.cmp(b),
        (Value::Duration(a), Value::Duration(b)) => a.cmp(b),
        _ => Ordering::Equal,
    }
}

fn negative(a: Operand<'_>) -> EvaluationResult<'_> {
    let zero = Number::Int(0);
    Ok(match a {
        Operand::Number(a) => Operand::Number(minus(zero, a)?),
        Operand::Time(a) => Operand::Time(minus(zero, a)?),
        Operand::Bool(_) | Operand::Text(_) => return Err(EvaluationError::Malformed),
    })
}

fn sum<'a>(
    a: Operand<'a>,
    b: Operand<'a>,
    operation: fn(Number, Number) -> Result<Number, EvaluationError>,
) -> EvaluationResult<'a> {
    Ok(match (a, b) {
        (Operand::Number(a), Operand::Number(b)) => Operand::Number(operation(a, b)?),
        (Operand::Time(a), Operand::Time(b)) => Operand::Time(operation(a, b)?),
        _ => return Err(EvaluationError::Malformed),
    })
}

fn multiply<'a>(a: Operand<'a>, b: Operand<'a>) -> EvaluationResult<'a> {
    Ok(match (a, b) {
        (Operand::Number(a), Operand::Number(b)) => Operand::Number(times(a, b)?),
        (Operand::Time(a), Operand::Number(b)) | (Operand::Number(a), Operand::Time(b)) => {
            Operand::Time(times(a, b)?)
        }
        _ => return Err(EvaluationError::Malformed),
    })
}

fn divide<'a>(a: Operand<'a>, b: Operand<'a>) -> EvaluationResult<'a> {
    Ok(match (a, b) {
        (Operand::Number(a), Operand::Number(b)) | (Operand::Time(a), Operand::Time(b)) => {
            Operand::Number(over(a, b)?)
        }
        (Operand::Time(a), Operand::Number(b)) => Operand::Time(over(a, b)?),
        _ => return Err(EvaluationError::Malformed),
    })
}

fn compare<'a>(comparator: Comparator, a: Operand<'a>, b: Operand<'a>) -> EvaluationResult<'a> {
    let ordering = match (a, b) {
        (Operand::Number(a), Operand::Number(b)) | (Operand::Time(a), Operand::Time(b)) => {
            a.partial_cmp(&b).ok_or(EvaluationError::NotANumber)?
        }
        (Operand::Text(a), Operand::Text(b)) => a.cmp(b),
        (Operand::Bool(a), Operand::Bool(b)) => a.cmp(&b),
        _ => return Err(EvaluationError::Malformed),
    };
    Ok(Operand::Bool(comparator.accepts(ordering)))
}

fn number(value: f64) -> Result<Number, EvaluationError> {
    if value.is_nan() {
        return Err(EvaluationError::NotANumber);
    }
    Ok(Number::Float(value))
}

fn apply(
    a: Number,
    b: Number,
    ints: fn(i128, i128) -> Option<i128>,
    floats: fn(f64, f64) -> f64,
) -> Result<Number, EvaluationError> {
    match (a, b) {
        (Number::Int(a), Number::Int(b)) => {
            ints(a, b).map(Number::Int).ok_or(EvaluationError::Overflow)
        }
        (Number::Int(_) | Number::Float(_), _) => number(floats(a.as_float(), b.as_float())),
    }
}

fn plus(a: Number, b: Number) -> Result<Number, EvaluationError> {
    apply(a, b, i128::checked_add, |a, b| a + b)
}

fn minus(a: Number, b: Number) -> Result<Number, EvaluationError> {
    apply(a, b, i128::checked_sub, |a, b| a - b)
}

fn times(a: Number, b: Number) -> Result<Number, EvaluationError> {
    apply(a, b, i128::checked_mul, |a, b| a * b)
}

/// `6 / 2` is an integer, `5 / 2` is 2.5.
fn over(a: Number, b: Number) -> Result<Number, EvaluationError> {
    if b.as_float() == 0.0 {
        return Err(EvaluationError::DivisionByZero);
    }
    match (a, b) {
        (Number::Int(a), Number::Int(b)) if a.checked_rem(b) == Some(0) => a
            .checked_div(b)
            .map(Number::Int)
            .ok_or(EvaluationError::Overflow),
        (Number::Int(_) | Number::Float(_), _) => number(a.as_float() / b.as_float()),
    }
}

#[cfg(test)]
mod tests;
