//! One step: the conversion between two shapes.

use crate::inertia;
use crate::loss::Bound;
use crate::plan::Kind;
use crate::refusal::Refusal;
use crate::rotation;
use crate::shape::{Leaf, Shape, Value};
use crate::values::{Notes, read, write};
use crate::vector::{self, Vector, is_axial};
use rc_formula::Term;
use rc_prototypes::model::Alias;
use rc_quantity::Real;
use rc_quantity::rotation::Matrix;
use std::collections::BTreeSet;

/// Converts the numbers of one shape into those of another one that means the same.
pub(crate) fn convert<'r>(
    from: &Shape,
    to: &Shape,
    aliases: &[Alias],
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    if from.opposites() != to.opposites() {
        notes.kinds.insert(Kind::Sign);
    }
    let out = meanings(from, to, aliases, &from.signed(input), notes)?;
    Ok(to.signed(&out))
}

fn meanings<'r>(
    from: &Shape,
    to: &Shape,
    aliases: &[Alias],
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    match (from, to) {
        (Shape::Leaf(from), Shape::Leaf(to)) => leaves(from, to, aliases, input, notes),
        (Shape::Parts(_), Shape::Parts(parts)) => {
            notes.kinds.insert(Kind::Composition);
            let mut out = Vec::new();
            for (name, to) in parts {
                let missing = || Refusal::Missing(name.clone());
                let (from, range) = from.part(name).ok_or_else(missing)?;
                let input = input.get(range).ok_or_else(missing)?;
                out.extend(meanings(from, to, aliases, input, notes)?);
            }
            Ok(out)
        }
        (Shape::Parts(_), Shape::Leaf(to)) => {
            notes.kinds.insert(Kind::Composition);
            let (position, turn, (place, body)) = pose_of_parts(from, input, notes)?;
            let turn_change = rotation::leaves(body, to, notes);
            let change = vector::change(place.axes, to.axes, false, notes);
            let position = vector::changed(position, change.as_ref());
            let turn = rotation::changed(turn, &turn_change);
            homogeneous(position, &turn, to, notes)
        }
        (Shape::Leaf(from), Shape::Parts(parts)) => {
            notes.kinds.insert(Kind::Composition);
            let (position, turn) = pose_of_leaf(from, input, notes)?;
            let mut out = Vec::new();
            for (name, part) in parts {
                let Shape::Leaf(to) = part else {
                    return Err(Refusal::NoWay);
                };
                out.extend(match name.as_str() {
                    "Position" => {
                        let change = vector::change(from.axes, to.axes, false, notes);
                        vector::store(vector::changed(position, change.as_ref()), to, notes)?
                    }
                    "Orientation" => {
                        let change = rotation::leaves(from, to, notes);
                        rotation::store(&rotation::changed(turn, &change), to, notes)?
                    }
                    _ => return Err(Refusal::NoWay),
                });
            }
            Ok(out)
        }
    }
}

/// A position, a rotation, and the leaves with both.
type Pose<'r, 's> = (Vector<'r>, Matrix<Term<'r>>, (&'s Leaf, &'s Leaf));

fn pose_of_parts<'r, 's>(
    from: &'s Shape,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Pose<'r, 's>, Refusal> {
    let part = |name: &str| match from.part(name) {
        Some((Shape::Leaf(leaf), range)) => Ok((leaf, range)),
        _ => Err(Refusal::Missing(name.to_owned())),
    };
    let (position, own) = part("Position")?;
    let (turn, range) = part("Orientation")?;
    let numbers = |range| input.get(range).ok_or(Refusal::NoWay);
    let place = vector::load(position, numbers(own)?, notes)?;
    let matrix = rotation::load(turn, numbers(range)?, notes)?;
    Ok((place, matrix, (position, turn)))
}

/// The place of a number of a homogeneous matrix for column vectors, as a role of these coordinates.
pub(crate) fn role(coordinate: &str, row: usize, column: usize) -> String {
    let (row, column) = match coordinate {
        "homogeneous_row_vectors" => (column, row),
        _ => (row, column),
    };
    (4 * row + column).to_string()
}

pub(crate) fn pose_of_leaf<'r>(
    from: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<(Vector<'r>, Matrix<Term<'r>>), Refusal> {
    let unit = vector::unit_of(&from.semantic);
    let mut matrix = [[Term::constant(0.0); 3]; 3];
    let mut position = [None; 3];
    for (row, (values, place)) in matrix.iter_mut().zip(&mut position).enumerate() {
        for (column, value) in values.iter_mut().enumerate() {
            let role = role(&from.coordinate, row, column);
            *value = read(from, input, &role, "1", notes)?;
        }
        let role = role(&from.coordinate, row, 3);
        *place = Some(read(from, input, &role, unit, notes)?);
    }
    rotation::proper(&matrix, from.tolerance);
    for (column, wanted) in [0.0, 0.0, 0.0, 1.0].into_iter().enumerate() {
        let role = role(&from.coordinate, 3, column);
        let place = from.place(&role).and_then(|at| input.get(at));
        let value = place.ok_or(Refusal::Missing(role))?;
        value.required(wanted - from.tolerance, wanted + from.tolerance);
    }
    Ok((position, matrix))
}

pub(crate) fn homogeneous<'r>(
    position: Vector<'r>,
    turn: &Matrix<Term<'r>>,
    to: &Leaf,
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let unit = vector::unit_of(&to.semantic);
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let place = (0..16).find(|at| role(&to.coordinate, at / 4, at % 4) == value.role);
        let place = place.ok_or_else(|| Refusal::Missing(value.role.clone()))?;
        let (term, unit) = match (place / 4, place % 4) {
            (3, column) => (Term::constant(if column == 3 { 1.0 } else { 0.0 }), "1"),
            (row, 3) => {
                let missing = || Refusal::Missing(["x", "y", "z"][row].to_owned());
                (position[row].ok_or_else(missing)?, unit)
            }
            (row, column) => (turn[row][column], "1"),
        };
        // The last row has no lengths.
        let unit = if place / 4 == 3 {
            value.unit.as_deref()
        } else {
            Some(unit)
        };
        out.push(write(term, unit, value, notes)?);
    }
    Ok(out)
}

fn leaves<'r>(
    from: &Leaf,
    to: &Leaf,
    aliases: &[Alias],
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    if from.algebraic != to.algebraic {
        notes.kinds.insert(Kind::Alias);
    }
    if !from.in_geometry {
        return elsewhere(from, to, aliases, input, notes);
    }
    if from.coordinate != to.coordinate {
        notes.kinds.insert(Kind::Coordinate);
    }
    match from.semantic.as_str() {
        "Orientation" => {
            if let Some(done) = rotation::same(from, to, input, notes) {
                return done;
            }
            let matrix = rotation::load(from, input, notes)?;
            let change = rotation::leaves(from, to, notes);
            rotation::store(&rotation::changed(matrix, &change), to, notes)
        }
        "Pose" => {
            let axes = |of: &Leaf| (of.axes, of.body);
            let same = axes(from) == axes(to) || from.axes.is_none() || to.axes.is_none();
            if same && from.coordinate == to.coordinate {
                return roles(from, to, input, notes);
            }
            let (position, turn) = pose_of_leaf(from, input, notes)?;
            let change = vector::change(from.axes, to.axes, false, notes);
            let position = vector::changed(position, change.as_ref());
            let change = rotation::leaves(from, to, notes);
            homogeneous(position, &rotation::changed(turn, &change), to, notes)
        }
        "Inertia" => {
            let change = vector::change(from.axes, to.axes, false, notes);
            if change.is_none() {
                return roles(from, to, input, notes);
            }
            let own = inertia::load(from, input, notes)?;
            inertia::store(&inertia::changed(own, change.as_ref()), to, notes)
        }
        "TimeStamp" if from.coordinate != to.coordinate => time(from, to, input, notes),
        "TimeStamp" | "Range" | "JointState" => roles(from, to, input, notes),
        meaning => {
            let both = |name: &str| from.coordinate == name && to.coordinate == name;
            if both("cartesian") {
                return vector::cartesian(from, to, input, notes);
            }
            let change = vector::change(from.axes, to.axes, is_axial(meaning), notes);
            if from.coordinate == to.coordinate && change.is_none() {
                return roles(from, to, input, notes);
            }
            let loaded = vector::load(from, input, notes)?;
            vector::store(vector::changed(loaded, change.as_ref()), to, notes)
        }
    }
}

/// Each number by its role.
fn roles<'r>(
    from: &Leaf,
    to: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        out.push(one(from, &value.role, value, input, notes)?);
    }
    Ok(out)
}

/// The number with this role as another one.
fn one<'r>(
    from: &Leaf,
    role: &str,
    to: &Value,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Term<'r>, Refusal> {
    let missing = || Refusal::Missing(role.to_owned());
    let at = from.place(role).ok_or_else(missing)?;
    let term = input.get(at).copied().ok_or_else(missing)?;
    let unit = from.values.get(at).and_then(|of| of.unit.as_deref());
    write(term, unit, to, notes)
}

/// Whole seconds with nanoseconds, and seconds.
fn time<'r>(
    from: &Leaf,
    to: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let seconds = read(from, input, "seconds", "s", notes)?;
    let constant = Term::constant;
    if from.place("nanoseconds").is_some() {
        let parts = read(from, input, "nanoseconds", "ns", notes)?;
        let total = seconds + parts / constant(1e9);
        notes.lose("nanoseconds", Bound::Absolute(2.5e-7));
        let value = to.values.first().ok_or(Refusal::NoWay)?;
        return Ok(vec![write(total, Some("s"), value, notes)?]);
    }
    let whole = seconds.floor();
    let parts = ((seconds - whole) * constant(1e9)).nearest();
    notes.lose("less than a nanosecond", Bound::Absolute(5e-10));
    // Rounding to the nearest nanosecond may lead to the next second.
    let billion = constant(1e9);
    let carried = parts.if_below(billion, whole, whole + constant(1.0));
    let parts = parts.if_below(billion, parts, constant(0.0));
    let mut out = Vec::new();
    for value in &to.values {
        let (term, unit) = match value.role.as_str() {
            "seconds" => (carried, "s"),
            _ => (parts, "ns"),
        };
        out.push(write(term, Some(unit), value, notes)?);
    }
    Ok(out)
}

/// Domains other than `geometry` have aliases and units only.
fn elsewhere<'r>(
    from: &Leaf,
    to: &Leaf,
    aliases: &[Alias],
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    if from.coordinate != to.coordinate {
        return Err(Refusal::NoWay);
    }
    if from.algebraic == to.algebraic {
        return roles(from, to, input, notes);
    }
    let mut ways = aliases.iter().filter_map(|alias| {
        let is_forth = alias.left == from.algebraic && alias.right == to.algebraic;
        let is_back = alias.right == from.algebraic && alias.left == to.algebraic;
        (is_forth || is_back).then_some((alias, is_forth))
    });
    let (alias, is_forth) = ways.next().ok_or(Refusal::NoWay)?;
    let pairs = |alias: &Alias, is_forth: bool| {
        let pairs = alias.pairs.iter().cloned();
        let turned = pairs.map(|(left, right)| {
            if is_forth {
                (left, right)
            } else {
                (right, left)
            }
        });
        turned.collect::<BTreeSet<_>>()
    };
    if ways.any(|(other, forth)| pairs(other, forth) != pairs(alias, is_forth)) {
        return Err(Refusal::Aliases(from.algebraic.clone()));
    }
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let pair = alias.pairs.iter().find_map(|(left, right)| {
            let (own, other) = if is_forth {
                (left, right)
            } else {
                (right, left)
            };
            (*other == value.role).then_some(own)
        });
        let role = pair.ok_or_else(|| Refusal::Missing(value.role.clone()))?;
        out.push(one(from, role, value, input, notes)?);
    }
    Ok(out)
}
