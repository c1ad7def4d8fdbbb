//! Hints at how a value could be written so that it fits.

use graph_schema::{Attribute, Kind};
use property_graph::{Value, fits};

/// A help for an empty array, whose type no item says.
pub(crate) fn empty(attribute: &Attribute, value: &Value) -> Option<String> {
    let is_empty = matches!(value, Value::Floats(all) if all.is_empty());
    let word = match attribute.kind {
        Kind::Ints(None) if is_empty => "ints",
        Kind::Texts if is_empty => "strings",
        _ => return None,
    };
    Some(format!(
        "write an empty array of them as `{{\"{word}\": []}}`"
    ))
}

/// A help for lengths that are a thousand times too large: the usual mistake.
pub(crate) fn thousandth(attribute: &Attribute, value: &Value) -> Option<String> {
    if attribute.unit.as_deref() != Some("m") {
        return None;
    }
    let smaller = match value {
        Value::Float(number) => Value::Float(number / 1000.0),
        Value::Int(number) => Value::Float(*number as f64 / 1000.0),
        Value::Floats(all) => Value::Floats(all.iter().map(|number| number / 1000.0).collect()),
        _ => return None,
    };
    let fits = fits(attribute, &smaller).is_ok();
    fits.then(|| "the schema says metres, and the value fits if it is in millimetres".to_owned())
}
