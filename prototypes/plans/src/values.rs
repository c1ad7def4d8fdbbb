//! Numbers of leaves: read in a unit, and stored in one.

use crate::loss::{Bound, Loss};
use crate::plan::Kind;
use crate::refusal::Refusal;
use crate::shape::{Leaf, Value};
use rc_formula::Term;
use rc_formula::fits;
use rc_quantity::Unit;
use rc_vocabulary::Primitive;
use std::collections::BTreeSet;

/// The operations and losses of a conversion.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notes {
    pub(crate) kinds: BTreeSet<Kind>,
    pub(crate) lost: Vec<Loss>,
}

impl Notes {
    /// Adds a loss, unless it is listed.
    pub(crate) fn lose(&mut self, what: impl Into<String>, bound: Bound) {
        let loss = Loss::new(what, bound);
        if !self.lost.contains(&loss) {
            self.lost.push(loss);
        }
    }

    /// Adds what another part loses. Losses that it shares are listed as often as in one of both.
    pub(crate) fn add(&mut self, other: Self) {
        self.kinds.extend(other.kinds);
        for loss in &other.lost {
            let count = |all: &[Loss]| all.iter().filter(|own| *own == loss).count();
            if count(&self.lost) < count(&other.lost) {
                self.lost.push(loss.clone());
            }
        }
    }

    /// Adds the loss of the next step. Earlier losses keep a bound only if this step scales.
    pub(crate) fn then(&mut self, next: Self, is_scaling: bool) {
        if !is_scaling {
            for loss in &mut self.lost {
                loss.bound = Bound::None;
            }
        }
        self.kinds.extend(next.kinds);
        self.lost.extend(next.lost);
    }
}

/// A number in another unit. Texts that are not units must be equal.
pub(crate) fn in_unit<'r>(
    term: Term<'r>,
    from: Option<&str>,
    to: Option<&str>,
    notes: &mut Notes,
) -> Result<Term<'r>, Refusal> {
    if from == to {
        return Ok(term);
    }
    let text = |unit: Option<&str>| unit.map_or("a number without unit".to_owned(), str::to_owned);
    let refusal = || Refusal::Unit(text(from), text(to));
    let (one, other) = (from.ok_or_else(refusal)?, to.ok_or_else(refusal)?);
    let unit = |text: &str| Unit::parse(text).map_err(|_| refusal());
    let conversion = unit(one)?
        .conversion_to(&unit(other)?)
        .ok_or_else(refusal)?;
    if conversion.is_identity() {
        return Ok(term);
    }
    notes.kinds.insert(Kind::Unit);
    Ok(conversion.factor().apply(term))
}

/// The number of a leaf with this role, in `unit`.
pub(crate) fn read<'r>(
    leaf: &Leaf,
    input: &[Term<'r>],
    role: &str,
    unit: &str,
    notes: &mut Notes,
) -> Result<Term<'r>, Refusal> {
    let missing = || Refusal::Missing(role.to_owned());
    let place = leaf.place(role).ok_or_else(missing)?;
    let value = leaf.values.get(place).ok_or_else(missing)?;
    let term = input.get(place).copied().ok_or_else(missing)?;
    in_unit(term, value.unit.as_deref(), Some(unit), notes)
}

/// A number in `unit`, as one of a leaf.
pub(crate) fn write<'r>(
    term: Term<'r>,
    unit: Option<&str>,
    to: &Value,
    notes: &mut Notes,
) -> Result<Term<'r>, Refusal> {
    let term = in_unit(term, unit, to.unit.as_deref(), notes)?;
    Ok(stored(term, to.number, notes))
}

/// A number as one of a type.
pub(crate) fn stored<'r>(term: Term<'r>, number: Primitive, notes: &mut Notes) -> Term<'r> {
    if let Term::Node(recorder, at) = term
        && !fits(recorder.number(at), number)
    {
        match number {
            Primitive::F32 => notes.lose(
                "float32, in the range of float32",
                Bound::Relative(f64::powi(2.0, -24)),
            ),
            Primitive::F64 => notes.lose("float64", Bound::Relative(f64::powi(2.0, -53))),
            number => notes.lose(number.word(), Bound::Absolute(0.5)),
        }
    }
    term.stored(number)
}
