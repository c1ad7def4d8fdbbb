//! Bounds and ranges that are checked where values are written and read.

use rc_idsl::Library;
use rc_idsl::model::{Member, Range, Type};
use rc_syntax::{Literal, LiteralKind};
use rc_vocabulary::Primitive;
use serde::Serialize;

/// One check of a value.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Check {
    /// There are at most this many elements, or bytes of a text.
    Bound {
        /// The largest number.
        bound: u32,
    },
    /// A number is between two limits, which are allowed values.
    Range {
        /// The primitive type of the number.
        primitive: Primitive,
        /// The smallest value in decimal notation: of an integer of 64 bits without a point, of
        /// other numbers with a point or an exponent.
        min: Option<String>,
        /// The largest value, likewise.
        max: Option<String>,
        /// The range, as documents print it: "0 to 100".
        text: String,
    },
    /// Checks of every element.
    Each {
        /// The check.
        of: Elements,
        /// The checks of one element.
        checks: Vec<Check>,
    },
}

/// The elements of a value.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Elements {
    /// Those of a sequence or an array.
    Items,
    /// The keys of a dictionary.
    Keys,
    /// The values of a dictionary.
    Values,
}

/// The checks of a member or a parameter; of an optional one, those of its value.
pub(super) fn of(library: &Library, member: &Member) -> Vec<Check> {
    of_value(library, &member.ty, member.range.as_ref())
}

/// The checks of a value of a type, within a range if it is a number.
pub(super) fn of_value(library: &Library, ty: &Type, limits: Option<&Range>) -> Vec<Check> {
    match library.resolved(ty) {
        Type::Primitive(primitive) => range(*primitive, limits),
        ty @ (Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. }
        | Type::Named(_)) => bounds(library, ty),
    }
}

/// The check of a member that is a number with a range.
pub(super) fn of_number(library: &Library, member: &Member) -> Vec<Check> {
    match library.resolved(&member.ty) {
        Type::Primitive(primitive) => range(*primitive, member.range.as_ref()),
        Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. }
        | Type::Named(_) => Vec::new(),
    }
}

/// The check of a number with a range.
fn range(primitive: Primitive, range: Option<&Range>) -> Vec<Check> {
    let is_long = is_long(primitive);
    let end = |literal: &Option<Literal>| match &literal.as_ref()?.kind {
        LiteralKind::Int(value) if is_long => Some(value.to_string()),
        LiteralKind::Int(value) => Some(format!("{value}.0")),
        LiteralKind::Float(value) => Some(format!("{value:?}")),
        LiteralKind::String(_)
        | LiteralKind::Bool(_)
        | LiteralKind::Duration(_)
        | LiteralKind::Name(_) => None,
    };
    match (range, range.and_then(text_of)) {
        (Some(range), Some(text)) => vec![Check::Range {
            primitive,
            min: end(&range.min),
            max: end(&range.max),
            text,
        }],
        _ => Vec::new(),
    }
}

/// Whether a type has integers that no `float64` holds.
pub(crate) fn is_long(primitive: Primitive) -> bool {
    primitive.size() == 8 && !primitive.is_float()
}

/// "0 to 100", "at least 0", for documentation and messages.
pub(crate) fn range_text(member: &Member) -> Option<String> {
    member.range.as_ref().and_then(text_of)
}

fn text_of(range: &Range) -> Option<String> {
    let text = |literal: &Literal| literal.number().map_or(String::new(), |n| n.to_string());
    Some(match (&range.min, &range.max) {
        (Some(min), Some(max)) => format!("{} to {}", text(min), text(max)),
        (Some(min), None) => format!("at least {}", text(min)),
        (None, Some(max)) => format!("at most {}", text(max)),
        (None, None) => return None,
    })
}

/// Bounds, however deep. Members of a structure are checked where the structure is written.
pub(super) fn bounds(library: &Library, ty: &Type) -> Vec<Check> {
    let bound = |bound: &Option<u32>| bound.map(|bound| Check::Bound { bound });
    let each = |of: Elements, element: &Type| {
        let checks = bounds(library, library.resolved(element));
        (!checks.is_empty()).then_some(Check::Each { of, checks })
    };
    match library.resolved(ty) {
        Type::Text { bound: most } => bound(most).into_iter().collect(),
        Type::Sequence {
            element,
            bound: most,
        } => bound(most)
            .into_iter()
            .chain(each(Elements::Items, element))
            .collect(),
        Type::Array { element, .. } => each(Elements::Items, element).into_iter().collect(),
        Type::Dictionary { key, value } => each(Elements::Keys, key)
            .into_iter()
            .chain(each(Elements::Values, value))
            .collect(),
        Type::Primitive(_) | Type::Named(_) => Vec::new(),
    }
}
