//! Losses and assumptions of a conversion: limits, axes, frames, numbers.

use super::Network;
use crate::loss::Bound;
use crate::refusal::Refusal;
use crate::shape::{Shape, Value};
use crate::values::Notes;
use rc_formula::fits;
use rc_prototypes::model::{Content, Prototype};
use rc_prototypes::semantic;
use rc_quantity::Axes;
use rc_vocabulary::Primitive;

impl<'l> Network<'l> {
    /// Whether two prototypes may convert: they and their parts mean the same, in the same frames.
    pub(super) fn agree(&self, one: &'l Prototype, other: &'l Prototype) -> Result<(), Refusal> {
        let mut pairs = Vec::new();
        self.pairs(&[one], &[other], &mut pairs);
        for (from, to) in &pairs {
            let (Some(one), Some(other)) = (from.first(), to.first()) else {
                continue;
            };
            let meaning = (&one.domain, &one.semantic) == (&other.domain, &other.semantic);
            if from.len() == to.len() && !meaning {
                return Err(Refusal::Meaning(
                    one.semantic.clone(),
                    other.semantic.clone(),
                ));
            }
            for end in ["of", "with_respect_to"] {
                if let Some((one, other)) = frame(from, end).zip(frame(to, end))
                    && one != other
                {
                    return Err(Refusal::Frame(end.to_owned(), one, other));
                }
            }
            if one.sequence.is_some() != other.sequence.is_some() {
                return Err(Refusal::Sequence);
            }
        }
        Ok(())
    }

    /// The losses of a step that concern none of its numbers, for both prototypes and, if `deep`,
    /// for their parts.
    pub(super) fn notes(&self, from: &str, to: &str, deep: bool) -> Result<Notes, Refusal> {
        let mut notes = Notes::default();
        let mut pairs = Vec::new();
        let (one, other) = (self.prototype(from)?, self.prototype(to)?);
        self.pairs(&[one], &[other], &mut pairs);
        if !deep {
            pairs.truncate(1);
        }
        if deep {
            // The functions take and give float64.
            for (name, end) in [(from, "of the input"), (to, "of the output")] {
                let values = self.shape(name)?.values();
                let is_wide = |value: &&Value| {
                    value.number.limits().is_some() && !fits(value.number, Primitive::F64)
                };
                if values.iter().any(is_wide) {
                    notes.lose(
                        format!("float64 {end} above 2^53"),
                        Bound::Relative(f64::powi(2.0, -53)),
                    );
                }
            }
        }
        for (from, to) in &pairs {
            let (Some(one), Some(other)) = (from.first(), to.first()) else {
                continue;
            };
            let own: Vec<&str> = match &one.content {
                Content::Parts(own) => own.iter().map(|part| part.name.as_str()).collect(),
                Content::Values { .. } => {
                    let of = semantic(&one.semantic).map_or(&[][..], |of| of.parts);
                    of.iter().map(|(name, _)| *name).collect()
                }
            };
            if let Content::Parts(wanted) = &other.content {
                for name in own {
                    if wanted.iter().all(|part| part.name != name) && from.len() == to.len() {
                        notes.lose(format!("`{name}` is not kept"), Bound::None);
                    }
                }
            }
        }
        Ok(notes)
    }

    /// The smallest `loss` that a prototype or one of its parts allows.
    pub(super) fn limit(&self, name: &str) -> Result<Option<f64>, Refusal> {
        let prototype = self.prototype(name)?;
        let mut limit = prototype.loss;
        if let Content::Parts(parts) = &prototype.content {
            for part in parts {
                let own = self.limit(&part.prototype)?;
                limit = limit.into_iter().chain(own).reduce(f64::min);
            }
        }
        Ok(limit)
    }
}

/// The numbers of a prototype for comments: its values, then its covariances.
pub(super) fn numbers(shape: &Shape, covariances: impl Iterator<Item = String>) -> Vec<String> {
    let values = shape.values().into_iter().map(described);
    values.chain(covariances).collect()
}

/// `points.X in mm, float32`
fn described(value: &Value) -> String {
    let unit = value.unit.as_deref().filter(|unit| *unit != "1");
    let unit = unit.map(|unit| format!(" in {unit}")).unwrap_or_default();
    format!("{}{unit}, {}", value.member, value.number.word())
}

/// Whether a plan between these axes may lead over a prototype with those of `inner`: the turns along
/// the way must be that of the direct step. Unknown axes are taken as those of the neighbour, so a
/// turn before or after them is lost, or one that no one asked for remains.
pub(super) fn keeps_axes(
    from: &[Option<Axes>],
    to: &[Option<Axes>],
    inner: &[Option<Axes>],
) -> bool {
    let ends = || from.iter().chain(to);
    if ends().all(Option::is_some) {
        return inner.iter().all(Option::is_some);
    }
    let mut known = ends().flatten();
    let first = known.next();
    known.all(|axes| Some(axes) == first) && inner.iter().flatten().all(|axes| Some(axes) == first)
}

/// A prototype without axes has those of the other end of the plan: that is not known, but taken so.
pub(super) fn taken_axes(from: (&str, &Shape), to: (&str, &Shape)) -> Vec<String> {
    let taken = |(name, own): (&str, &Shape), (other, with): (&str, &Shape)| {
        let is_taken = own.axes().contains(&None) && with.axes().iter().any(Option::is_some);
        is_taken.then(|| format!("`{name}` has no axes: they are taken as those of `{other}`"))
    };
    [taken(from, to), taken(to, from)]
        .into_iter()
        .flatten()
        .collect()
}

/// A prototype, and the wholes that it is a part of: the innermost one first.
pub(super) type Chain<'l> = Vec<&'l Prototype>;

/// The frame at one end of a part: its own one, or that of the whole.
fn frame(chain: &[&Prototype], end: &str) -> Option<String> {
    let mut frames = chain.iter().flat_map(|of| &of.frames);
    let frame = frames.find(|(name, _)| name == end).map(|(_, frame)| frame);
    // A frame in a message is known when it arrives.
    frame.filter(|frame| !frame.starts_with("member ")).cloned()
}
