//! The inertia of a body.

use crate::refusal::Refusal;
use crate::shape::Leaf;
use crate::values::{Notes, read, write};
use rc_formula::Term;
use rc_quantity::rotation::Matrix;
use rc_quantity::{Inertia, Real, Transform};

/// The names of the tensor, which is symmetric, by rows.
const TENSOR: [[&str; 3]; 3] = [["xx", "xy", "xz"], ["xy", "yy", "yz"], ["xz", "yz", "zz"]];

/// From a leaf, in the units of the SI.
pub(crate) fn load<'r>(
    leaf: &Leaf,
    input: &[Term<'r>],
    notes: &mut Notes,
) -> Result<Inertia<Term<'r>>, Refusal> {
    let mut get = |role: &str, unit: &str| read(leaf, input, role, unit, notes);
    let mass = get("mass", "kg")?;
    let centre = [get("x", "m")?, get("y", "m")?, get("z", "m")?];
    let mut tensor = [[mass; 3]; 3];
    for (row, names) in tensor.iter_mut().zip(TENSOR) {
        for (cell, name) in row.iter_mut().zip(names) {
            *cell = get(name, "kg*m^2")?;
        }
    }
    Ok(Inertia {
        mass,
        centre,
        tensor,
    })
}

/// Along other axes, to which the matrix leads.
pub(crate) fn changed<'r>(
    inertia: Inertia<Term<'r>>,
    change: Option<&Matrix>,
) -> Inertia<Term<'r>> {
    let Some(change) = change else {
        return inertia;
    };
    let transform = Transform {
        rotation: change.map(|row| row.map(Term::constant)),
        translation: [Term::constant(0.0); 3],
    };
    transform.inertia(&inertia)
}

/// As the numbers of a leaf.
pub(crate) fn store<'r>(
    inertia: &Inertia<Term<'r>>,
    to: &Leaf,
    notes: &mut Notes,
) -> Result<Vec<Term<'r>>, Refusal> {
    let mut out = Vec::with_capacity(to.values.len());
    for value in &to.values {
        let role = value.role.as_str();
        let cell = || {
            let mut rows = TENSOR.iter().zip(&inertia.tensor);
            rows.find_map(|(names, row)| {
                let at = names.iter().position(|name| *name == role)?;
                Some(row[at])
            })
        };
        let (term, unit) = match role {
            "mass" => (inertia.mass, "kg"),
            "x" => (inertia.centre[0], "m"),
            "y" => (inertia.centre[1], "m"),
            "z" => (inertia.centre[2], "m"),
            _ => (cell().ok_or(Refusal::NoWay)?, "kg*m^2"),
        };
        out.push(write(term, Some(unit), value, notes)?);
    }
    Ok(out)
}
