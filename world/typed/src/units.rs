//! Numbers in units that are not those of the schema.

use crate::error::Error;
use property_graph::{Edit, Element, Snapshot};
use rc_diagnostics::foreign::clean;
use rc_quantity::{Conversion, Unit};

/// Takes numbers in `from` to those in `to`.
pub(crate) fn conversion(attribute: &str, from: &str, to: &str) -> Result<Conversion, Error> {
    let unit = |text: &str| {
        let parsed = Unit::parse(text);
        parsed.map_err(|error| Error::Unit(format!("`{}`: {error}", clean(text))))
    };
    let (own, other) = (unit(from)?, unit(to)?);
    own.conversion_to(&other).ok_or_else(|| {
        Error::Unit(format!(
            "`{}`: a number in `{}` is none in `{}`",
            clean(attribute),
            clean(from),
            clean(to)
        ))
    })
}

/// The unit of an attribute.
pub(crate) fn unit_of(now: &Snapshot, element: Element, attribute: &str) -> Result<String, Error> {
    let kind = now.type_of(element);
    let kind = kind.ok_or(property_graph::Error::Removed)?;
    let all = now.schema().attributes(now.text(kind)).unwrap_or_default();
    let declared = all.iter().find(|own| own.name == attribute);
    let unit = declared.and_then(|own| own.unit.clone());
    unit.ok_or_else(|| Error::Unit(format!("`{}` has no unit", clean(attribute))))
}

/// Sets an attribute to a number in a unit.
///
/// # Errors
/// The attribute has no unit, or one of another kind.
pub fn set_in(
    edit: &mut Edit,
    element: Element,
    attribute: &str,
    value: f64,
    unit: &str,
) -> Result<(), Error> {
    let own = unit_of(edit.snapshot(), element, attribute)?;
    let value = conversion(attribute, unit, &own)?.apply(value);
    Ok(edit.set(element, attribute, value)?)
}
