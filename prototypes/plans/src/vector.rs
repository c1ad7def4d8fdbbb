//! Points, directions and axial vectors in all their coordinates.

use crate::loss::Bound;
use crate::plan::Kind;
use crate::refusal::Refusal;
use crate::shape::Leaf;
use crate::values::{Notes, read, write};
use rc_formula::Term;
use rc_prototypes::semantic;
use rc_quantity::{Axes, Real, rotation};

/// x, y and z in the unit of the meaning. A vector in a plane has no z.
pub(crate) type Vector<'r> = [Option<Term<'r>>; 3];

const NAMES: [&str; 3] = ["x", "y", "z"];

/// Whether the sense of a vector changes where the hand of the axes does.
pub(crate) fn is_axial(meaning: &str) -> bool {
    matches!(meaning, "AngularVelocity" | "Torque")
}

/// The unit of a meaning.
pub(crate) fn unit_of(meaning: &str) -> &'static str {
    semantic(meaning).map_or("1", |of| of.unit)
}

/// The change of axes between two leaves. `None` where nothing changes, or one of them says nothing.
pub(crate) fn change(
    from: Option<Axes>,
    to: Option<Axes>,
    is_axial: bool,
    notes: &mut Notes,
) -> Option<rotation::Matrix> {
    let (from, to) = from.zip(to)?;
    if from == to {
        return None;
    }
    notes.kinds.insert(Kind::Axes);
    Some(if is_axial {
        from.axial_matrix_to(to)
    } else {
        from.matrix_to(to)
    })
}

/// The number of the direction that becomes this one, and its sign.
pub(crate) fn origin(row: &[f64; 3]) -> (usize, f64) {
    let place = row.iter().position(|value| *value != 0.0).unwrap_or(0);
    (place, row[place])
}

/// A number with the sign of ±1.
pub(crate) fn signed(term: Term<'_>, sign: f64) -> Term<'_> {
    if sign < 0.0 { -term } else { term }
}

/// The vector with other axes.
pub(crate) fn changed<'r>(vector: Vector<'r>, matrix: Option<&rotation::Matrix>) -> Vector<'r> {
    let Some(matrix) = matrix else { return vector };
    matrix.map(|row| {
        let (place, sign) = origin(&row);
        vector[place].map(|term| signed(term, sign))
    })
}

/// Reads cartesian coordinates out of any others.
pub(crate) fn load<'r>(
    leaf: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vector<'r>, Refusal> {
    let unit = unit_of(&leaf.semantic);
    let mut get = |role: &str, unit: &str| read(leaf, input, role, unit, notes);
    Ok(match leaf.coordinate.as_str() {
        "polar" | "cylindrical" => {
            let (distance, angle) = (get("distance", unit)?, get("angle", "rad")?);
            let z = if leaf.place("z").is_some() {
                Some(get("z", unit)?)
            } else {
                None
            };
            [
                Some(distance * angle.cosine()),
                Some(distance * angle.sine()),
                z,
            ]
        }
        "spherical" => {
            let distance = get("distance", unit)?;
            let (azimuth, elevation) = (get("azimuth", "rad")?, get("elevation", "rad")?);
            let in_plane = distance * elevation.cosine();
            [
                Some(in_plane * azimuth.cosine()),
                Some(in_plane * azimuth.sine()),
                Some(distance * elevation.sine()),
            ]
        }
        _ => {
            let mut out = [None; 3];
            for (place, name) in out.iter_mut().zip(NAMES) {
                if leaf.place(name).is_some() {
                    *place = Some(get(name, unit)?);
                }
            }
            out
        }
    })
}

/// Writes cartesian coordinates as any others, in the order of the leaf.
pub(crate) fn store<'r>(
    vector: Vector<'r>,
    to: &Leaf,
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let unit = unit_of(&to.semantic);
    let part = |at: usize| vector[at].ok_or_else(|| Refusal::Missing(NAMES[at].to_owned()));
    let (x, y) = (part(0)?, part(1)?);
    let keeps_z = to.place("z").is_some() || to.coordinate == "spherical";
    if !keeps_z && vector[2].is_some() {
        notes.lose("z is not kept", Bound::None);
    }
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let (term, unit) = match (to.coordinate.as_str(), value.role.as_str()) {
            ("spherical", "distance") => {
                let z = part(2)?;
                ((x * x + y * y + z * z).root(), unit)
            }
            ("spherical", "elevation") => (part(2)?.angle_over(x.length_with(y)), "rad"),
            (_, "distance") => (x.length_with(y), unit),
            (_, "angle" | "azimuth") => (y.angle_over(x), "rad"),
            (_, "x") => (x, unit),
            (_, "y") => (y, unit),
            _ => (part(2)?, unit),
        };
        out.push(write(term, Some(unit), value, notes)?);
    }
    Ok(out)
}

/// Converts cartesian coordinates without a detour over the unit of their meaning.
pub(crate) fn cartesian<'r>(
    from: &Leaf,
    to: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let matrix = change(from.axes, to.axes, is_axial(&from.semantic), notes);
    let mut used = [false; 3];
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let row = NAMES.iter().position(|name| *name == value.role);
        let row = row.ok_or_else(|| Refusal::Missing(value.role.clone()))?;
        let (place, sign) = matrix.map_or((row, 1.0), |matrix| origin(&matrix[row]));
        let missing = || Refusal::Missing(NAMES[place].to_owned());
        let at = from.place(NAMES[place]).ok_or_else(missing)?;
        let term = input.get(at).copied().ok_or_else(missing)?;
        used[place] = true;
        let unit = from.values.get(at).and_then(|of| of.unit.as_deref());
        out.push(write(signed(term, sign), unit, value, notes)?);
    }
    for (name, used) in NAMES.iter().zip(used) {
        if !used && from.place(name).is_some() {
            notes.lose(format!("{name} is not kept"), Bound::None);
        }
    }
    Ok(out)
}
