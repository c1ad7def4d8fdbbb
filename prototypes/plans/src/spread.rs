//! The covariances of a prototype and of its parts.

use crate::covariance::{self, Ends};
use crate::loss::Bound;
use crate::refusal::Refusal;
use crate::shape::Shape;
use crate::values::Notes;
use rc_formula::{Recorder, Term};
use rc_prototypes::model::{Content, Prototype};
use rc_quantity::Transform;
use rc_vocabulary::Primitive;
use std::ops::Range;

/// A covariance of a prototype, or of a part of it.
pub(crate) struct Spread<'s, 'p> {
    /// The names of the part and of those around it, with dots. Empty for the whole.
    pub(crate) part: String,
    end: (&'s Shape, &'p Prototype),
    /// Whether it is a part of a twist or of a wrench.
    is_spatial: bool,
    /// The numbers of the part among those of the whole.
    values: Range<usize>,
    /// How many numbers it has. 0 if no plan converts it.
    pub(crate) count: usize,
}

/// Finds a prototype by its name.
type Find<'f, 'p> = dyn Fn(&str) -> Option<&'p Prototype> + 'f;

/// The covariances of a prototype and of its parts, in their order.
pub(crate) fn spreads<'s, 'p>(
    end: (&'s Shape, &'p Prototype),
    find: &Find<'_, 'p>,
) -> Vec<Spread<'s, 'p>> {
    let mut out = Vec::new();
    add(end, find, ("", 0, false), &mut out);
    out
}

fn add<'s, 'p>(
    (shape, of): (&'s Shape, &'p Prototype),
    find: &Find<'_, 'p>,
    (around, mut start, is_spatial): (&str, usize, bool),
    out: &mut Vec<Spread<'s, 'p>>,
) {
    if of.covariance.is_some() {
        out.push(Spread {
            part: around.to_owned(),
            end: (shape, of),
            is_spatial,
            values: start..start + shape.len(),
            count: covariance::count(shape, of),
        });
    }
    let (Shape::Parts(shapes), Content::Parts(parts)) = (shape, &of.content) else {
        return;
    };
    for ((name, shape), part) in shapes.iter().zip(parts) {
        let path = match around {
            "" => name.clone(),
            around => format!("{around}.{name}"),
        };
        if let Some(inner) = find(&part.prototype) {
            let is_spatial = matches!(of.semantic.as_str(), "Twist" | "Wrench");
            add((shape, inner), find, (&path, start, is_spatial), out);
        }
        start += shape.len();
    }
}

impl Spread<'_, '_> {
    /// How its numbers are stored.
    pub(crate) fn number(&self) -> Primitive {
        let own = self.end.1.covariance.as_ref();
        own.and_then(|of| of.number).unwrap_or(Primitive::F64)
    }

    /// The names of its numbers: `Position.covariance.0`.
    pub(crate) fn names(&self, member: &str) -> impl Iterator<Item = String> {
        let around = match self.part.as_str() {
            "" => String::new(),
            part => format!("{part}."),
        };
        (0..self.count).map(move |at| format!("{around}{member}.{at}"))
    }

    /// Their names in the type.
    pub(crate) fn members(&self) -> impl Iterator<Item = String> {
        let own = self.end.1.covariance.as_ref();
        self.names(own.map_or("", |of| of.member.as_str()))
    }
}

/// The covariances that both ends of a conversion have.
pub(crate) struct Spreads<'s, 'p> {
    /// Those of each end, in its own order.
    ends: [Vec<Spread<'s, 'p>>; 2],
    /// What the plan does with those that the other end lacks.
    lost: Notes,
}

impl<'s, 'p> Spreads<'s, 'p> {
    pub(crate) fn new(ends: Ends<'s, 'p>, find: &Find<'_, 'p>) -> Self {
        let [mut from, mut to] = [ends.from, ends.to].map(|end| spreads(end, find));
        let mut lost = Notes::default();
        let is_known = |all: &[Spread<'_, '_>], own: &Spread<'_, '_>| {
            let mut same = all.iter().filter(|other| other.part == own.part);
            own.count > 0 && same.any(|other| other.count == own.count)
        };
        let both: [Vec<bool>; 2] = [(&from, &to), (&to, &from)]
            .map(|(all, other)| all.iter().map(|own| is_known(other, own)).collect());
        for (all, both) in [&mut from, &mut to].into_iter().zip(both) {
            let mut both = both.into_iter();
            all.retain(|own| {
                let is_kept = both.next().unwrap_or_default();
                if !is_kept {
                    lost.lose(unconverted(&own.part), Bound::None);
                }
                is_kept
            });
        }
        Self {
            ends: [from, to],
            lost,
        }
    }

    /// The parts with how many numbers their covariances have, for each end.
    pub(crate) fn counts(&self) -> [Vec<(String, usize)>; 2] {
        let count = |of: &Spread<'_, '_>| (of.part.clone(), of.count);
        [0, 1].map(|end| self.ends[end].iter().map(count).collect())
    }

    /// The numbers of all, for each end.
    pub(crate) fn len(&self) -> usize {
        self.ends[0].iter().map(|of| of.count).sum()
    }

    /// The names of the numbers of an end: 0 is the first one.
    pub(crate) fn members(&self, end: usize) -> impl Iterator<Item = String> {
        let own = self.ends.get(end).map_or(&[][..], Vec::as_slice);
        own.iter().flat_map(Spread::members)
    }

    /// The numbers of the first end, which follow so many others.
    pub(crate) fn record<'r>(
        &self,
        recorder: &'r Recorder,
        mut start: usize,
    ) -> Vec<Vec<Term<'r>>> {
        let own = self.ends[0].iter().map(|of| {
            let places = start..start + of.count;
            start = places.end;
            let terms = places.map(|at| recorder.input(at, of.number()));
            terms.collect()
        });
        own.collect()
    }

    /// Converts these numbers of the first end, whose values are `meant`, to those of the second one.
    pub(crate) fn convert<'r>(
        &self,
        (meant, own): (&[Term<'r>], &[Vec<Term<'r>>]),
        transform: Option<&Transform<Term<'r>>>,
        notes: &mut Notes,
    ) -> Result<Vec<Term<'r>>, Refusal> {
        let mut out = Vec::new();
        for to in &self.ends[1] {
            let mut all = self.ends[0].iter().zip(own);
            let same = all.find(|(from, _)| from.part == to.part);
            let (from, own) = same.ok_or(Refusal::NoWay)?;
            if transform.is_some() && from.depends_on_others() {
                return Err(Refusal::Still(format!("covariance of `{}`", from.part)));
            }
            let ends = Ends {
                from: from.end,
                to: to.end,
            };
            let values = meant.get(from.values.clone()).ok_or(Refusal::NoWay)?;
            out.extend(covariance::convert(&ends, (values, own), transform, notes)?);
        }
        notes.add(self.lost.clone());
        Ok(out)
    }
}

impl Spread<'_, '_> {
    /// Whether a change of frames adds a vector product with another part of a twist or of a wrench,
    /// which is correlated with this one in the new frame.
    fn depends_on_others(&self) -> bool {
        let semantic = self.end.1.semantic.as_str();
        self.is_spatial && matches!(semantic, "LinearVelocity" | "Torque")
    }
}

/// What is lost of a part with a covariance that the other end lacks.
fn unconverted(part: &str) -> String {
    match part {
        "" => "the covariance is not converted".to_owned(),
        part => format!("the covariance of `{part}` is not converted"),
    }
}
