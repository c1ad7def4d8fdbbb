//! The known units of numbers, and conversions between them.

use crate::ast::{Expr, InUnit, Name};
use property_graph::schema::conversion;
use rc_diagnostics::{Span, foreign};

/// The known unit of an expression's numbers.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub(crate) unit: String,
    /// The attribute. `None` if the query says the unit: such a number is converted where another
    /// unit is expected.
    pub(crate) attribute: Option<String>,
    pub(crate) span: Span,
}

impl Measured {
    pub(crate) fn told(&self) -> String {
        let unit = foreign::clean(&self.unit);
        match &self.attribute {
            Some(name) => format!("`{}` is in `{unit}`", foreign::clean(name)),
            None => format!("a number is in `{unit}`"),
        }
    }
}

/// Puts a conversion around an expression. Returns whether there is one. In a sum, it may only
/// multiply: 5 K more is not -268 °C more.
pub(crate) fn convert(expr: &mut Expr, from: &Measured, to: &Measured, is_sum: bool) -> bool {
    let conversion = conversion(&from.unit, &to.unit);
    let Some(conversion) = conversion.filter(|way| !is_sum || way.factor().is_scale()) else {
        return false;
    };
    let of = std::mem::replace(expr, Expr::List(Vec::new()));
    let unit = Name {
        text: to.unit.clone(),
        span: from.span,
    };
    *expr = Expr::InUnit(Box::new(InUnit {
        of,
        unit,
        factor: Some(conversion.factor()),
    }));
    true
}
