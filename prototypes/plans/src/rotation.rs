//! Rotations in all their representations.

use crate::refusal::Refusal;
use crate::shape::{Leaf, Shape};
use crate::values::{Notes, read, write};
use crate::vector::{change, origin, signed};
use rc_formula::Term;
use rc_quantity::rotation::{
    AxisAngle, EulerOrder, Matrix, Quaternion, determinant, from_rotation_vector, product,
    to_rotation_vector, transposed,
};
use rc_quantity::{Axes, Real};

/// The representations of rotations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Representation {
    Quaternion,
    Matrix,
    AxisAngle,
    Vector,
    Euler(EulerOrder),
}

/// The names of three turns.
const TURNS: [&str; 3] = ["first", "second", "third"];
const ANGLES: [&str; 3] = ["roll", "pitch", "yaw"];

impl Representation {
    /// That of coordinates with this name.
    pub(crate) fn of(coordinate: &str) -> Option<Self> {
        Some(match coordinate {
            "quaternion" | "quaternion_wxyz" => Self::Quaternion,
            "rot_matrix" => Self::Matrix,
            "axis_angle" => Self::AxisAngle,
            "rotation_vector" => Self::Vector,
            "rpy" => Self::Euler(EulerOrder::RPY),
            other => {
                let order = other.strip_prefix("euler_")?.replacen('_', " ", 1);
                Self::Euler(order.parse().ok()?)
            }
        })
    }
}

fn names(coordinate: &str) -> [&'static str; 3] {
    if coordinate == "rpy" { ANGLES } else { TURNS }
}

/// The changes of the axes around a body and of those of the body. `None` where nothing changes.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Changes {
    around: Option<Matrix>,
    body: Option<Matrix>,
}

/// The rotation with other axes.
pub(crate) fn changed<'r>(matrix: Matrix<Term<'r>>, changes: &Changes) -> Matrix<Term<'r>> {
    let terms = |of: Matrix| of.map(|row| row.map(Term::constant));
    let matrix = match changes.body {
        Some(body) => product(&matrix, &transposed(&terms(body))),
        None => matrix,
    };
    match changes.around {
        Some(around) => product(&terms(around), &matrix),
        None => matrix,
    }
}

/// A length that must be 1.
fn one(length: Term<'_>, tolerance: f64) -> Term<'_> {
    length.required(1.0 - tolerance, 1.0 + tolerance)
}

/// Refuses matrices that mirror, stretch or shear: the columns must be of length 1 and at right
/// angles.
pub(crate) fn proper(matrix: &Matrix<Term<'_>>, tolerance: f64) {
    one(determinant(matrix), tolerance);
    let squares = product(&transposed(matrix), matrix);
    for (row, values) in squares.iter().enumerate() {
        one(values[row], tolerance);
        for value in &values[row + 1..] {
            value.required(-tolerance, tolerance);
        }
    }
}

/// The matrix of a rotation in any representation.
pub(crate) fn load<'r>(
    leaf: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Matrix<Term<'r>>, Refusal> {
    let representation = Representation::of(&leaf.coordinate).ok_or(Refusal::NoWay)?;
    let mut get = |role: &str, unit: &str| read(leaf, input, role, unit, notes);
    Ok(match representation {
        Representation::Quaternion => {
            let parts = [
                get("x", "1")?,
                get("y", "1")?,
                get("z", "1")?,
                get("w", "1")?,
            ];
            let norm = one(Quaternion::xyzw(parts).norm(), leaf.tolerance);
            Quaternion::xyzw(parts.map(|part| part / norm)).matrix()
        }
        Representation::Matrix => {
            let mut rows = [[Term::constant(0.0); 3]; 3];
            for (row, values) in rows.iter_mut().enumerate() {
                for (column, value) in values.iter_mut().enumerate() {
                    *value = get(&(3 * row + column).to_string(), "1")?;
                }
            }
            proper(&rows, leaf.tolerance);
            rows
        }
        Representation::AxisAngle => {
            let axis = [get("x", "1")?, get("y", "1")?, get("z", "1")?];
            let [x, y, z] = axis;
            let length = one((x * x + y * y + z * z).root(), leaf.tolerance);
            let turn = AxisAngle {
                axis: axis.map(|part| part / length),
                angle: get("angle", "rad")?,
            };
            turn.matrix()
        }
        Representation::Vector => {
            from_rotation_vector([get("x", "rad")?, get("y", "rad")?, get("z", "rad")?])
        }
        Representation::Euler(order) => {
            let [first, second, third] = names(&leaf.coordinate);
            order.matrix([get(first, "rad")?, get(second, "rad")?, get(third, "rad")?])
        }
    })
}

/// Writes a rotation in the representation of a leaf.
pub(crate) fn store<'r>(
    matrix: &Matrix<Term<'r>>,
    to: &Leaf,
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let representation = Representation::of(&to.coordinate).ok_or(Refusal::NoWay)?;
    let numbers: Vec<(String, Term<'r>, &str)> = match representation {
        Representation::Quaternion => {
            let parts = Quaternion::of_matrix(matrix).to_xyzw();
            named(&["x", "y", "z", "w"], &parts, "1")
        }
        Representation::Matrix => {
            let numbers = matrix.iter().flatten().enumerate();
            numbers
                .map(|(at, term)| (at.to_string(), *term, "1"))
                .collect()
        }
        Representation::AxisAngle => {
            let turn = AxisAngle::of_matrix(matrix);
            let mut all = named(&["x", "y", "z"], &turn.axis, "1");
            all.push(("angle".to_owned(), turn.angle, "rad"));
            all
        }
        Representation::Vector => named(&["x", "y", "z"], &to_rotation_vector(matrix), "rad"),
        Representation::Euler(order) => {
            let (angles, size) = order.solved(matrix);
            size.may_lock();
            named(&names(&to.coordinate), &angles, "rad")
        }
    };
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let number = numbers.iter().find(|(role, ..)| *role == value.role);
        let (_, term, unit) = number.ok_or_else(|| Refusal::Missing(value.role.clone()))?;
        out.push(write(*term, Some(unit), value, notes)?);
    }
    Ok(out)
}

fn named<'r, 'u>(
    names: &[&str],
    terms: &[Term<'r>],
    unit: &'u str,
) -> Vec<(String, Term<'r>, &'u str)> {
    let numbers = names.iter().zip(terms);
    numbers
        .map(|(name, term)| ((*name).to_owned(), *term, unit))
        .collect()
}

/// Refuses quaternions and axes that are not of length 1, also where a plan only moves their
/// numbers.
pub(crate) fn require_length(shape: &Shape, input: &[Term<'_>]) -> Result<(), Refusal> {
    let leaf = match shape {
        Shape::Leaf(leaf) => leaf,
        Shape::Parts(parts) => {
            let mut rest = input;
            for (_, part) in parts {
                let (own, behind) = rest.split_at_checked(part.len()).ok_or(Refusal::NoWay)?;
                require_length(part, own)?;
                rest = behind;
            }
            return Ok(());
        }
    };
    let is_turn = leaf.in_geometry && leaf.semantic == "Orientation";
    let representation = Representation::of(&leaf.coordinate).filter(|_| is_turn);
    let get = |role: &str| read(leaf, input, role, "1", &mut Notes::default());
    let length = match representation {
        Some(Representation::Quaternion) => {
            Quaternion::xyzw([get("x")?, get("y")?, get("z")?, get("w")?]).norm()
        }
        Some(Representation::AxisAngle) => {
            let [x, y, z] = [get("x")?, get("y")?, get("z")?];
            (x * x + y * y + z * z).root()
        }
        _ => return Ok(()),
    };
    one(length, leaf.tolerance);
    Ok(())
}

/// Converts between two leaves of one representation. `None` if that needs the matrix.
pub(crate) fn same<'r>(
    from: &Leaf,
    to: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Option<Result<Vec<Term<'r>>, Refusal>> {
    let representation = Representation::of(&from.coordinate)?;
    if Representation::of(&to.coordinate) != Some(representation) {
        return None;
    }
    let changes = leaves(from, to, &mut Notes::default());
    let by_number = matches!(
        representation,
        Representation::Matrix | Representation::Euler(_)
    );
    // Axes that change on both sides alike turn the axis of the rotation.
    if changes.around != changes.body || by_number && changes.around.is_some() {
        return None;
    }
    Some(by_role(from, to, input, notes))
}

/// Each number by its role. x, y and z are those of an axial vector.
fn by_role<'r>(
    from: &Leaf,
    to: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let matrix = change(from.axes, to.axes, true, notes);
    let (own, other) = (names(&to.coordinate), names(&from.coordinate));
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == value.role);
        let turn = own.iter().position(|turn| *turn == value.role);
        let (role, sign) = match (axis, turn, &matrix) {
            (Some(axis), _, Some(matrix)) => {
                let (place, sign) = origin(&matrix[axis]);
                (["x", "y", "z"][place], sign)
            }
            (_, Some(turn), _) => (other[turn], 1.0),
            _ => (value.role.as_str(), 1.0),
        };
        let missing = || Refusal::Missing(role.to_owned());
        let at = from.place(role).ok_or_else(missing)?;
        let term = input.get(at).copied().ok_or_else(missing)?;
        let unit = from.values.get(at).and_then(|of| of.unit.as_deref());
        out.push(write(signed(term, sign), unit, value, notes)?);
    }
    Ok(out)
}

/// The changes from the axes of one rotation to those of another one.
pub(crate) fn leaves(from: &Leaf, to: &Leaf, notes: &mut Notes) -> Changes {
    Changes {
        around: change(from.axes, to.axes, false, notes),
        body: change(from.body, to.body, false, notes),
    }
}

/// The changes from the axes of a rotation to these, or back.
pub(crate) fn to_axes(from: &Leaf, to: Axes, is_back: bool) -> Changes {
    let one = |own: Option<Axes>| {
        let (from, to) = if is_back {
            (Some(to), own)
        } else {
            (own, Some(to))
        };
        change(from, to, false, &mut Notes::default())
    };
    Changes {
        around: one(from.axes),
        body: one(from.body),
    }
}
