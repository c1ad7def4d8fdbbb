//! Covariances: `J C Jᵀ` with the Jacobian of a change of units and axes.
//!
//! The covariance of a vector is that of its cartesian components, in its unit and axes, whatever
//! its coordinates are. That of an orientation is about small turns in radians, about the fixed
//! axes as in messages of ROS, or about the moving ones, those of the body. A change of frames
//! follows that of axes: the rotation of the transform for each part, and the vector product with
//! its translation for twists and wrenches.

use crate::edge;
use crate::refusal::Refusal;
use crate::rotation;
use crate::shape::{Leaf, Shape};
use crate::values::{Notes, stored};
use crate::vector;
use rc_formula::{NOT_NEGATIVE, Term};
use rc_prototypes::model::{Covariance, Prototype};
use rc_quantity::rotation::{IDENTITY, Matrix, product, transposed, turned};
use rc_quantity::{Axes, Real, Transform, Unit};
use rc_vocabulary::Primitive;
use std::ops::Range;

/// Three components, or the one of a range.
struct Block<'s> {
    meaning: &'static str,
    leaf: &'s Leaf,
    /// Its numbers among those of the whole.
    numbers: Range<usize>,
}

/// The meanings whose components have covariances, in the order of these.
fn meanings(semantic: &str) -> &'static [&'static str] {
    match semantic {
        "Position" | "PointSet" => &["Position"],
        "Orientation" => &["Orientation"],
        "Pose" => &["Position", "Orientation"],
        "LinearVelocity" => &["LinearVelocity"],
        "AngularVelocity" => &["AngularVelocity"],
        "Twist" => &["LinearVelocity", "AngularVelocity"],
        "Acceleration" => &["Acceleration"],
        "Force" => &["Force"],
        "Torque" => &["Torque"],
        "Wrench" => &["Force", "Torque"],
        "Range" => &["Range"],
        _ => &[],
    }
}

fn blocks<'s>(shape: &'s Shape, semantic: &str) -> Option<Vec<Block<'s>>> {
    let block = |meaning: &&'static str| {
        let (leaf, numbers) = match shape {
            Shape::Leaf(leaf) => (leaf, 0..leaf.values.len()),
            Shape::Parts(_) => match shape.part(meaning)? {
                (Shape::Leaf(leaf), numbers) => (leaf, numbers),
                _ => return None,
            },
        };
        leaf.in_geometry.then_some(Block {
            meaning,
            leaf,
            numbers,
        })
    };
    meanings(semantic).iter().map(block).collect()
}

/// How many numbers the covariance of a prototype has if a plan converts it.
pub(crate) fn count(shape: &Shape, of: &Prototype) -> usize {
    if of.covariance.is_none() || of.domain != "geometry" {
        return 0;
    }
    let blocks = blocks(shape, &of.semantic).unwrap_or_default();
    let side: usize = blocks.iter().map(Block::side).sum();
    side * side
}

/// Both ends of a conversion.
#[derive(Clone, Copy)]
pub(crate) struct Ends<'s, 'p> {
    pub(crate) from: (&'s Shape, &'p Prototype),
    pub(crate) to: (&'s Shape, &'p Prototype),
}

/// Converts a covariance, whose numbers are `own`, of the values `input`. With a transform, the
/// covariance in the frame to which it leads, from that of the values.
pub(crate) fn convert<'r>(
    ends: &Ends<'_, '_>,
    (input, own): (&[Term<'r>], &[Term<'r>]),
    transform: Option<&Transform<Term<'r>>>,
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let of = |(shape, prototype): (&'_ Shape, &'_ Prototype)| {
        let covariance = prototype.covariance.clone().ok_or(Refusal::NoWay)?;
        Ok((shape.clone(), covariance, prototype.semantic.clone()))
    };
    let (from, from_says, semantic) = of(ends.from)?;
    let (to, to_says, wanted) = of(ends.to)?;
    let (Some(sources), Some(targets)) = (blocks(&from, &semantic), blocks(&to, &wanted)) else {
        return Err(Refusal::NoWay);
    };
    let turns = (is_moving(&from_says), is_moving(&to_says));
    let mut jacobians = Vec::new();
    for (source, target) in sources.iter().zip(&targets) {
        let input = input.get(source.numbers.clone()).ok_or(Refusal::NoWay)?;
        jacobians.push(source.jacobian(target, turns, input, notes)?);
    }
    let places = (places(&sources, &from_says), places(&targets, &to_says));
    let side: usize = targets.iter().map(Block::side).sum();
    // A change of frames mixes numbers of several units: it is done in those of the meanings.
    let unit = |of: &Block<'_>, at: usize| match transform {
        Some(_) => of.base_unit(),
        None => of.unit(at),
    };
    let mut parts: Parts<'r> = Vec::with_capacity(sources.len());
    for (row, (source, target)) in sources.iter().zip(&targets).enumerate() {
        let mut of_row = Vec::with_capacity(sources.len());
        for (column, (other, goal)) in sources.iter().zip(&targets).enumerate() {
            let mut part = [[Term::constant(0.0); 3]; 3];
            for (at, next) in cells(source, other) {
                let place = (places.0[row] + at) * side + places.0[column] + next;
                part[at][next] = own.get(place).copied().ok_or(Refusal::NoWay)?;
            }
            let part = product(&jacobians[row], &part);
            let mut part = product(&part, &transposed(&jacobians[column]));
            for (at, next) in cells(target, goal) {
                let value = scaled(part[at][next], &source.unit(at), &unit(target, at))?;
                part[at][next] = scaled(value, &other.unit(next), &unit(goal, next))?;
            }
            of_row.push(part);
        }
        parts.push(of_row);
    }
    if let Some(transform) = transform {
        parts = moved(&parts, &motion(&targets, transform, turns.1)?);
    }
    let mut out = vec![Term::constant(0.0); side * side];
    let number = to_says.number.unwrap_or(Primitive::F64);
    for (row, (target, of_row)) in targets.iter().zip(&parts).enumerate() {
        for (column, (goal, part)) in targets.iter().zip(of_row).enumerate() {
            for (at, next) in cells(target, goal) {
                let value = scaled(part[at][next], &unit(target, at), &target.unit(at))?;
                let value = scaled(value, &unit(goal, next), &goal.unit(next))?;
                let place = (places.1[row] + at) * side + places.1[column] + next;
                out[place] = stored(value, number, notes);
            }
        }
    }
    Ok(out)
}

/// The parts of a covariance, by the blocks of their rows and columns.
type Parts<'r> = Vec<Vec<Matrix<Term<'r>>>>;

/// The relation of blocks to those of another frame, by rows and columns: in the axes of the
/// targets, and in the units of their meanings.
fn motion<'r>(
    targets: &[Block<'_>],
    transform: &Transform<Term<'r>>,
    is_moving: bool,
) -> Result<Vec<Vec<Option<Matrix<Term<'r>>>>>, Refusal> {
    let mut out = Vec::with_capacity(targets.len());
    for target in targets {
        let axes = target.leaf.axes;
        let axes = axes.ok_or_else(|| Refusal::NoAxes(target.leaf.semantic.clone()))?;
        let change = Axes::ROS.matrix_to(axes).map(|row| row.map(Term::constant));
        let own = Transform {
            rotation: product(&change, &product(&transform.rotation, &transposed(&change))),
            translation: turned(&change, transform.translation),
        };
        let row = targets.iter().map(|other| {
            match (target.meaning, other.meaning) {
                // A turn about the axes of the body is the same one in all frames.
                ("Orientation", "Orientation") if is_moving => {
                    Some(IDENTITY.map(|row| row.map(Term::constant)))
                }
                (one, other) if one == other => Some(own.rotation),
                ("LinearVelocity", "AngularVelocity") | ("Torque", "Force") => {
                    Some(product(&own.lever(), &own.rotation))
                }
                _ => None,
            }
        });
        out.push(row.collect());
    }
    Ok(out)
}

/// `G C Gᵀ`, part by part.
fn moved<'r>(parts: &Parts<'r>, motion: &[Vec<Option<Matrix<Term<'r>>>>]) -> Parts<'r> {
    let known = |row: &[Option<Matrix<Term<'r>>>]| -> Vec<(usize, Matrix<Term<'r>>)> {
        let row = row.iter().enumerate();
        row.filter_map(|(at, own)| Some((at, (*own)?))).collect()
    };
    let rows: Vec<_> = motion.iter().map(|row| known(row)).collect();
    let part = |row: &[(usize, Matrix<Term<'r>>)], column: &[(usize, Matrix<Term<'r>>)]| {
        let mut out = [[Term::constant(0.0); 3]; 3];
        for (from, left) in row {
            for (to, right) in column {
                let added = product(&product(left, &parts[*from][*to]), &transposed(right));
                for (own, more) in out.iter_mut().flatten().zip(added.iter().flatten()) {
                    *own = *own + *more;
                }
            }
        }
        out
    };
    let row = |row| rows.iter().map(|column| part(row, column)).collect();
    rows.iter().map(|own| row(own)).collect()
}

/// How far a covariance may deviate from symmetric and from positive, relative to the variances:
/// numbers of 32 bits and those of texts are rounded.
const NEARLY: f64 = 1e-5;

/// Refuses matrices that are not covariances: not symmetric, or with a negative variance in some
/// direction. These have a negative pivot.
pub(crate) fn require_positive(own: &[Term<'_>]) {
    let Some(side) = (0..=own.len()).find(|side| side * side == own.len()) else {
        return;
    };
    let cell = |row: usize, column: usize| own[row * side + column];
    let constant = |value: f64| Term::constant(value);
    let not_negative = |term: Term<'_>| {
        term.required(NOT_NEGATIVE.0, NOT_NEGATIVE.1);
    };
    let mut pivots: Vec<Term<'_>> = Vec::with_capacity(side);
    let mut factors = vec![vec![constant(0.0); side]; side];
    for row in 0..side {
        let mut pivot = cell(row, row) * constant(1.0 + NEARLY);
        for column in 0..row {
            let (own, mirrored) = (cell(row, column), cell(column, row));
            let difference = own - mirrored;
            let allowed = cell(row, row) * cell(column, column) * constant(NEARLY * NEARLY);
            not_negative(allowed - difference * difference);
            let mut rest = own;
            for (inner, other) in pivots.iter().enumerate().take(column) {
                rest = rest - factors[row][inner] * factors[column][inner] * *other;
            }
            let of = pivots[column];
            let zero = constant(0.0);
            // A constant is not correlated with anything.
            zero.if_below(of, zero, rest).required(0.0, 0.0);
            let factor = zero.if_below(of, rest / of, zero);
            pivot = pivot - factor * factor * of;
            factors[row][column] = factor;
        }
        not_negative(pivot);
        pivots.push(pivot);
    }
}

/// The rows and columns of two blocks.
fn cells(one: &Block<'_>, other: &Block<'_>) -> impl Iterator<Item = (usize, usize)> {
    let columns = other.side();
    (0..one.side()).flat_map(move |row| (0..columns).map(move |column| (row, column)))
}

fn is_moving(covariance: &Covariance) -> bool {
    covariance.rotation.as_deref() == Some("moving")
}

/// The first row of each block.
fn places(blocks: &[Block<'_>], says: &Covariance) -> Vec<usize> {
    match (blocks, says.order.as_deref()) {
        ([_, _], Some("rpy_xyz")) => vec![3, 0],
        _ => (0..blocks.len()).map(|at| 3 * at).collect(),
    }
}

/// A number that grows as a component does: without the offset of its unit.
fn scaled<'r>(term: Term<'r>, from: &str, to: &str) -> Result<Term<'r>, Refusal> {
    let refusal = || Refusal::Unit(from.to_owned(), to.to_owned());
    if from == to {
        return Ok(term);
    }
    let unit = |text: &str| Unit::parse(text).map_err(|_| refusal());
    let conversion = unit(from)?.conversion_to(&unit(to)?).ok_or_else(refusal)?;
    match conversion.factor() {
        factor if factor.is_scale() => Ok(factor.apply(term)),
        _ => Err(refusal()),
    }
}

impl Block<'_> {
    fn side(&self) -> usize {
        if self.meaning == "Range" { 1 } else { 3 }
    }

    /// The unit of a component.
    fn unit(&self, at: usize) -> String {
        if self.meaning == "Orientation" {
            return "rad".to_owned();
        }
        let role = match self.leaf.coordinate.as_str() {
            "cartesian" => ["x", "y", "z"][at].to_owned(),
            pose if self.leaf.semantic == "Pose" => edge::role(pose, at, 3),
            _ => "distance".to_owned(),
        };
        // A vector in a plane has no z.
        let place = self.leaf.place(&role).unwrap_or(0);
        let unit = self.leaf.values.get(place).and_then(|of| of.unit.clone());
        unit.unwrap_or_else(|| vector::unit_of(self.meaning).to_owned())
    }

    /// The unit of the components by their meaning: of the SI, and radians.
    fn base_unit(&self) -> String {
        match self.meaning {
            "Orientation" => "rad".to_owned(),
            meaning => vector::unit_of(meaning).to_owned(),
        }
    }

    /// The relation of the components to those of the source, without their units.
    fn jacobian<'r>(
        &self,
        target: &Block<'_>,
        (from_moving, to_moving): (bool, bool),
        input: &[Term<'r>],
        notes: &mut Notes,
    ) -> Result<Matrix<Term<'r>>, Refusal> {
        let is_turn = self.meaning == "Orientation" || vector::is_axial(self.meaning);
        let axes = if self.meaning == "Orientation" && from_moving && to_moving {
            (self.leaf.body, target.leaf.body)
        } else {
            (self.leaf.axes, target.leaf.axes)
        };
        let change = vector::change(axes.0, axes.1, is_turn, notes);
        let jacobian = change.unwrap_or(IDENTITY);
        let jacobian = jacobian.map(|row| row.map(Term::constant));
        if self.meaning != "Orientation" || from_moving == to_moving {
            return Ok(jacobian);
        }
        let matrix = match self.leaf.semantic.as_str() {
            "Pose" => edge::pose_of_leaf(self.leaf, input, notes)?.1,
            _ => rotation::load(self.leaf, input, notes)?,
        };
        Ok(if from_moving {
            // A turn about the axes of the body is one about the fixed axes where the body is.
            product(&jacobian, &matrix)
        } else {
            let change = rotation::leaves(self.leaf, target.leaf, notes);
            let matrix = rotation::changed(matrix, &change);
            product(&transposed(&matrix), &jacobian)
        })
    }
}
