//! Units of the values of a query: numbers that are written with a unit are converted, and numbers
//! of different units are not compared.

use crate::ast::{Expr, Name, Operator};
use crate::check::Checker;
use crate::measured::{Measured, convert};
use property_graph::schema::{Attribute, Kind, compared_units, conversion, is_same_unit};
use rc_diagnostics::{Diagnostic, Span, foreign};
use rc_quantity::Unit;

impl Checker<'_> {
    /// The unit of an attribute of a variable; of one number of it, if there is an index.
    pub(crate) fn unit_of(
        &self,
        variable: usize,
        name: &Name,
        index: Option<usize>,
    ) -> Option<Measured> {
        let kind = self.nodes.get(&variable).or(self.edges.get(&variable))?;
        let mut all = self.schema.attributes(kind)?.iter();
        let attribute: &Attribute = all.find(|attribute| attribute.name == name.text)?;
        let unit = match (&attribute.kind, index) {
            (Kind::Block(block), Some(index)) => {
                let number = block.numbers.get(index % block.numbers.len().max(1))?;
                number.unit.as_deref()
            }
            _ => attribute.common_unit(),
        };
        Some(Measured {
            unit: unit?.to_owned(),
            attribute: Some(name.text.clone()),
            span: name.span,
        })
    }

    /// The unit of both sides of a comparison or a sum. A number with a unit that the query says
    /// becomes one in the unit of the other side.
    pub(crate) fn same_unit(
        &mut self,
        (a, one): (&mut Expr, Option<Measured>),
        (b, other): (&mut Expr, Option<Measured>),
        is_sum: bool,
    ) -> Option<Measured> {
        let (Some(one), Some(other)) = (&one, &other) else {
            return one.or(other);
        };
        if other.attribute.is_some()
            && one.attribute.is_none()
            && !is_same_unit(&one.unit, &other.unit)
            && convert(a, one, other, is_sum)
        {
            return Some(other.clone());
        }
        self.converted(Some(one), b, Some(other), is_sum);
        let attribute = one.attribute.as_ref().or(other.attribute.as_ref());
        Some(Measured {
            attribute: attribute.cloned(),
            ..one.clone()
        })
    }

    /// Makes an expression one in the unit of something else, or reports that it is in another one.
    pub(crate) fn in_unit_of(
        &mut self,
        known: Option<&Measured>,
        expr: &mut Expr,
        own: Option<&Measured>,
    ) {
        self.converted(known, expr, own, false);
    }

    fn converted(
        &mut self,
        known: Option<&Measured>,
        expr: &mut Expr,
        own: Option<&Measured>,
        is_sum: bool,
    ) {
        let (Some(known), Some(own)) = (known, own) else {
            return;
        };
        let is_equal = is_same_unit(&known.unit, &own.unit);
        if is_equal || own.attribute.is_none() && convert(expr, own, known, is_sum) {
            return;
        }
        let message = format!("{}, but {}", known.told(), own.told());
        self.mismatch(own.span, message, &own.unit, &known.unit, is_sum);
    }

    fn mismatch(&mut self, span: Span, message: String, from: &str, to: &str, is_sum: bool) {
        let (one, other) = (foreign::clean(from), foreign::clean(to));
        let mut help = compared_units(&one, &other);
        if let Some(way) = conversion(from, to) {
            let hint = if is_sum && !way.factor().is_scale() {
                format!("write a difference without a unit, as a number in `{other}`")
            } else {
                format!("`unit \"{other}\"` after a value converts it")
            };
            help = format!("{help}; {hint}");
        }
        let diagnostic = Diagnostic::error("unit-mismatch", span, message);
        self.found.push(diagnostic.help(help));
    }

    /// `unit "kg"` after a value: the unit of a number without one; others are converted.
    pub(crate) fn stated(
        &mut self,
        unit: &Name,
        inner: Option<Measured>,
    ) -> (Measured, Option<rc_quantity::Factor>) {
        let warning = rc_syntax::unknown_unit(&foreign::clean(&unit.text), unit.span);
        self.found.extend(warning);
        let mut measured = Measured {
            unit: unit.text.clone(),
            attribute: None,
            span: unit.span,
        };
        let Some(inner) = inner else {
            return (measured, None);
        };
        measured.attribute.clone_from(&inner.attribute);
        if is_same_unit(&inner.unit, &unit.text) {
            return (measured, None);
        }
        let factor = conversion(&inner.unit, &unit.text).map(|way| way.factor());
        if factor.is_none() {
            let wanted = foreign::clean(&unit.text);
            let message = format!("{}, expected `{wanted}`", inner.told());
            self.mismatch(unit.span, message, &inner.unit, &unit.text, false);
        }
        (measured, factor)
    }

    /// The unit of a product or a quotient. A number without a unit is a plain number.
    pub(crate) fn product(
        operator: Operator,
        one: Option<Measured>,
        other: Option<Measured>,
    ) -> Option<Measured> {
        let is_product = operator == Operator::Multiply;
        let (unit, first) = match (one, other) {
            (None, None) => return None,
            (Some(one), None) => return Some(one),
            (None, Some(other)) if is_product => return Some(other),
            (None, Some(other)) => (format!("1/({})", other.unit), other),
            (Some(one), Some(other)) => {
                let sign = if is_product { '*' } else { '/' };
                (format!("({}){sign}({})", one.unit, other.unit), one)
            }
        };
        // A unit that is in no table, or too long, has no name.
        Unit::parse(&unit).ok()?;
        Some(Measured { unit, ..first })
    }
}
