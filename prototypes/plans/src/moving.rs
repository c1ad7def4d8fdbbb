//! Converts values to another frame, by a transform that is known when a message comes.

use crate::edge::{homogeneous, pose_of_leaf};
use crate::inertia;
use crate::refusal::Refusal;
use crate::rotation;
use crate::shape::{Leaf, Shape};
use crate::values::Notes;
use crate::vector::{self, Vector, is_axial};
use rc_formula::Term;
use rc_quantity::rotation::{Matrix, product, turned};
use rc_quantity::{Axes, Inertia, Spatial, Transform};

/// The linear and the angular part of a twist and of a wrench, which depend on the origin of their
/// frame.
const TWIST: [&str; 2] = ["LinearVelocity", "AngularVelocity"];
const WRENCH: [&str; 2] = ["Force", "Torque"];

/// The values at one place: vectors by their meanings, and an orientation, with the axes of ROS.
#[derive(Default)]
struct Placed<'r> {
    vectors: Vec<(&'static str, Vector<'r>)>,
    turn: Option<Matrix<Term<'r>>>,
    inertia: Option<Inertia<Term<'r>>>,
}

/// The transform whose numbers these are.
pub(crate) fn transform<'r>(numbers: &[Term<'r>]) -> Result<Transform<Term<'r>>, Refusal> {
    let (&[first, second, third], []) = numbers.as_chunks::<4>() else {
        return Err(Refusal::NoWay);
    };
    let rows = [first, second, third];
    Ok(Transform {
        rotation: rows.map(|[x, y, z, _]| [x, y, z]),
        translation: rows.map(|[.., by]| by),
    })
}

/// Converts the numbers of one shape into those of another one in a frame to which the transform
/// leads.
pub(crate) fn convert<'r>(
    from: &Shape,
    to: &Shape,
    (input, transform): (&[Term<'r>], &Transform<Term<'r>>),
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    if is_one(from) && is_one(to) {
        return placed(from, to, (input, transform), notes);
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

/// Whether a shape has one place: it is a leaf, or its parts are leaves that mean different things.
fn is_one(shape: &Shape) -> bool {
    let Shape::Parts(parts) = shape else {
        return true;
    };
    let mut seen = Vec::with_capacity(parts.len());
    parts.iter().all(|(_, part)| {
        let Shape::Leaf(leaf) = part else {
            return false;
        };
        // A pose in one leaf is both a position and an orientation.
        let meaning = vector_of(leaf).unwrap_or(leaf.semantic.as_str());
        let is_new = meaning != "Pose" && !seen.contains(&meaning);
        seen.push(meaning);
        is_new
    })
}

/// Converts what has one place.
fn placed<'r>(
    from: &Shape,
    to: &Shape,
    (input, transform): (&[Term<'r>], &Transform<Term<'r>>),
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let mut there = Placed::default();
    load(from, input, notes, &mut there)?;
    let mut here = Placed {
        vectors: Vec::with_capacity(there.vectors.len()),
        turn: there.turn.map(|own| product(&transform.rotation, &own)),
        inertia: there.inertia.map(|own| transform.inertia(&own)),
    };
    // Velocities beside a position are those of this point, which stays the same one.
    let is_spatial = matches!(from, Shape::Parts(_)) && there.vector("Position").is_none();
    for pair in [TWIST, WRENCH].iter().filter(|_| is_spatial) {
        let Some(own) = there.spatial(pair)? else {
            continue;
        };
        let moved = if *pair == TWIST {
            transform.twist(&own)
        } else {
            transform.wrench(&own)
        };
        here.vectors.push((pair[0], moved.linear.map(Some)));
        here.vectors.push((pair[1], moved.angular.map(Some)));
    }
    for (meaning, own) in &there.vectors {
        if here.vector(meaning).is_some() {
            continue;
        }
        let own = whole(*own)?;
        let moved = match *meaning {
            "Position" => transform.point(own),
            _ => turned(&transform.rotation, own),
        };
        here.vectors.push((meaning, moved.map(Some)));
    }
    store(to, &here, notes)
}

/// The components of a vector, which a turn needs all.
fn whole(vector: Vector<'_>) -> Result<[Term<'_>; 3], Refusal> {
    match vector {
        [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
        _ => Err(Refusal::Missing("z".to_owned())),
    }
}

impl<'r> Placed<'r> {
    fn vector(&self, meaning: &str) -> Option<Vector<'r>> {
        let mut all = self.vectors.iter();
        let found = all.find(|(own, _)| *own == meaning);
        found.map(|(_, vector)| *vector)
    }

    /// The twist or the wrench with these parts. `None` if it has neither.
    fn spatial(&self, parts: &[&str; 2]) -> Result<Option<Spatial<Term<'r>>>, Refusal> {
        let [linear, angular] = parts.map(|part| self.vector(part));
        let missing = |at: usize| Refusal::Missing(parts[at].to_owned());
        if linear.is_none() && angular.is_none() {
            return Ok(None);
        }
        Ok(Some(Spatial {
            linear: whole(linear.ok_or_else(|| missing(0))?)?,
            angular: whole(angular.ok_or_else(|| missing(1))?)?,
        }))
    }
}

/// The axes of a leaf, which a change of frames needs.
fn axes(leaf: &Leaf) -> Result<Axes, Refusal> {
    leaf.axes
        .ok_or_else(|| Refusal::NoAxes(leaf.semantic.clone()))
}

/// The change between two axes, which is not a step of its own.
fn change(from: Axes, to: Axes, is_axial: bool) -> Option<Matrix> {
    vector::change(Some(from), Some(to), is_axial, &mut Notes::default())
}

/// The meaning of vectors that change their frame.
fn vector_of(leaf: &Leaf) -> Option<&'static str> {
    Some(match leaf.semantic.as_str() {
        "Position" | "PointSet" => "Position",
        "LinearVelocity" => "LinearVelocity",
        "AngularVelocity" => "AngularVelocity",
        "Acceleration" => "Acceleration",
        "Force" => "Force",
        "Torque" => "Torque",
        _ => return None,
    })
}

fn load<'r>(
    shape: &Shape,
    input: &[Term<'r>],
    notes: &mut Notes,
    out: &mut Placed<'r>,
) -> Result<(), Refusal> {
    let leaf = match shape {
        Shape::Leaf(leaf) => leaf,
        Shape::Parts(parts) => {
            let mut rest = input;
            for (_, part) in parts {
                let (own, behind) = rest.split_at_checked(part.len()).ok_or(Refusal::NoWay)?;
                load(part, own, notes, out)?;
                rest = behind;
            }
            return Ok(());
        }
    };
    let meaning = leaf.semantic.as_str();
    if !leaf.in_geometry {
        return Err(Refusal::Still(meaning.to_owned()));
    }
    let change = |is_axial| Ok(change(axes(leaf)?, Axes::ROS, is_axial));
    if let Some(vector) = vector_of(leaf) {
        let change = change(is_axial(meaning))?;
        let own = vector::load(leaf, input, notes)?;
        let own = vector::changed(own, change.as_ref());
        out.vectors.push((vector, own));
        return Ok(());
    }
    let turn = match meaning {
        "Orientation" => rotation::load(leaf, input, notes)?,
        "Pose" => {
            let (position, turn) = pose_of_leaf(leaf, input, notes)?;
            let position = vector::changed(position, change(false)?.as_ref());
            out.vectors.push(("Position", position));
            turn
        }
        "Inertia" => {
            let own = inertia::load(leaf, input, notes)?;
            out.inertia = Some(inertia::changed(own, change(false)?.as_ref()));
            return Ok(());
        }
        other => return Err(Refusal::Still(other.to_owned())),
    };
    axes(leaf)?;
    let changes = rotation::to_axes(leaf, Axes::ROS, false);
    out.turn = Some(rotation::changed(turn, &changes));
    Ok(())
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
    let change = |is_axial| Ok(change(Axes::ROS, axes(leaf)?, is_axial));
    let vector = |meaning: &str| {
        let own = here.vector(meaning).ok_or(Refusal::NoWay)?;
        Ok(vector::changed(own, change(is_axial(meaning))?.as_ref()))
    };
    let turn = || {
        let own = here.turn.ok_or(Refusal::NoWay)?;
        axes(leaf)?;
        let changes = rotation::to_axes(leaf, Axes::ROS, true);
        Ok(rotation::changed(own, &changes))
    };
    if let Some(meaning) = vector_of(leaf) {
        return vector::store(vector(meaning)?, leaf, notes);
    }
    match leaf.semantic.as_str() {
        "Orientation" => rotation::store(&turn()?, leaf, notes),
        "Pose" => homogeneous(vector("Position")?, &turn()?, leaf, notes),
        "Inertia" => {
            let own = here.inertia.ok_or(Refusal::NoWay)?;
            inertia::store(&inertia::changed(own, change(false)?.as_ref()), leaf, notes)
        }
        other => Err(Refusal::Still(other.to_owned())),
    }
}
