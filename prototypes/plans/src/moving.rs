//! Values in a frame that moves, as those in another one: by a transform that is known when a message
//! comes.

use crate::edge::{homogeneous, pose_of_leaf};
use crate::refusal::Refusal;
use crate::rotation;
use crate::shape::{Leaf, Shape};
use crate::values::Notes;
use crate::vector::{self, Vector};
use rc_formula::Term;
use rc_quantity::Axes;
use rc_quantity::rotation::{Matrix, product, turned};

/// How many numbers a transform has: the rows of `[R | t]`. It is that between two frames with the
/// axes of ROS, in metres.
pub const TRANSFORM: usize = 12;

/// A position and an orientation, with the axes of ROS.
struct Placed<'r> {
    position: Option<Vector<'r>>,
    turn: Option<Matrix<Term<'r>>>,
}

/// Converts the numbers of one shape into those of another one in a frame to which the transform
/// leads.
pub(crate) fn convert<'r>(
    from: &Shape,
    to: &Shape,
    (input, transform): (&[Term<'r>], &[Term<'r>]),
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let (&[first, second, third], []) = transform.as_chunks::<4>() else {
        return Err(Refusal::NoWay);
    };
    let rows = [first, second, third];
    if is_one(from) && is_one(to) {
        return placed(from, to, (input, &rows), notes);
    }
    let (Shape::Parts(_), Shape::Parts(wanted)) = (from, to) else {
        return Err(Refusal::NoWay);
    };
    let mut out = Vec::new();
    for (name, part) in wanted {
        let missing = || Refusal::Missing(name.clone());
        let (own, range) = from.part(name).ok_or_else(missing)?;
        let input = input.get(range).ok_or_else(missing)?;
        out.extend(convert(own, part, (input, transform), notes)?);
    }
    Ok(out)
}

/// Whether a shape has one place: it is a leaf, or a position and an orientation.
fn is_one(shape: &Shape) -> bool {
    let Shape::Parts(parts) = shape else {
        return true;
    };
    let count = |meaning: &str| {
        let own = |part: &Shape| matches!(part, Shape::Leaf(leaf) if leaf.semantic == meaning);
        parts.iter().filter(|(_, part)| own(part)).count()
    };
    let (positions, turns) = (count("Position"), count("Orientation"));
    positions <= 1 && turns <= 1 && positions + turns == parts.len()
}

/// Converts what has one place.
fn placed<'r>(
    from: &Shape,
    to: &Shape,
    (input, rows): (&[Term<'r>], &[[Term<'r>; 4]; 3]),
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let turn = rows.map(|[x, y, z, _]| [x, y, z]);
    let by = rows.map(|[.., by]| by);
    let there = load(from, input, notes)?;
    let position = there.position.map(|position| {
        let [Some(x), Some(y), Some(z)] = position else {
            return Err(Refusal::Missing("z".to_owned()));
        };
        let [x, y, z] = turned(&turn, [x, y, z]);
        Ok([Some(x + by[0]), Some(y + by[1]), Some(z + by[2])])
    });
    let here = Placed {
        position: position.transpose()?,
        turn: there.turn.map(|own| product(&turn, &own)),
    };
    store(to, &here, notes)
}

/// The axes of a leaf, which a change of frames needs.
fn axes(leaf: &Leaf) -> Result<Axes, Refusal> {
    leaf.axes
        .ok_or_else(|| Refusal::NoAxes(leaf.semantic.clone()))
}

/// The change between two axes, which is no step of its own.
fn change(from: Axes, to: Axes) -> Option<Matrix> {
    vector::change(Some(from), Some(to), false, &mut Notes::default())
}

fn load<'r>(shape: &Shape, input: &[Term<'r>], notes: &mut Notes) -> Result<Placed<'r>, Refusal> {
    let leaf = match shape {
        Shape::Leaf(leaf) => leaf,
        Shape::Parts(parts) => {
            let mut all = Placed {
                position: None,
                turn: None,
            };
            let mut rest = input;
            for (_, part) in parts {
                let (own, behind) = rest.split_at_checked(part.len()).ok_or(Refusal::NoWay)?;
                let part = load(part, own, notes)?;
                all.position = all.position.or(part.position);
                all.turn = all.turn.or(part.turn);
                rest = behind;
            }
            return Ok(all);
        }
    };
    if !leaf.in_geometry {
        return Err(Refusal::Still(leaf.semantic.clone()));
    }
    let change = change(axes(leaf)?, Axes::ROS);
    let (position, turn) = match leaf.semantic.as_str() {
        "Position" | "PointSet" => (Some(vector::load(leaf, input, notes)?), None),
        "Orientation" => (None, Some(rotation::load(leaf, input, notes)?)),
        "Pose" => {
            let (position, turn) = pose_of_leaf(leaf, input, notes)?;
            (Some(position), Some(turn))
        }
        other => return Err(Refusal::Still(other.to_owned())),
    };
    Ok(Placed {
        position: position.map(|own| vector::changed(own, change.as_ref())),
        turn: turn.map(|own| rotation::changed(own, change.as_ref())),
    })
}

fn store<'r>(
    shape: &Shape,
    here: &Placed<'r>,
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let leaf = match shape {
        Shape::Leaf(leaf) => leaf,
        Shape::Parts(parts) => {
            let mut out = Vec::new();
            for (_, part) in parts {
                out.extend(store(part, here, notes)?);
            }
            return Ok(out);
        }
    };
    let change = change(Axes::ROS, axes(leaf)?);
    let position = || {
        let own = here.position.ok_or(Refusal::NoWay)?;
        Ok(vector::changed(own, change.as_ref()))
    };
    let turn = || {
        let own = here.turn.ok_or(Refusal::NoWay)?;
        Ok(rotation::changed(own, change.as_ref()))
    };
    match leaf.semantic.as_str() {
        "Position" | "PointSet" => vector::store(position()?, leaf, notes),
        "Orientation" => rotation::store(&turn()?, leaf, notes),
        "Pose" => homogeneous(position()?, &turn()?, leaf, notes),
        other => Err(Refusal::Still(other.to_owned())),
    }
}
