//! A data block: the numbers of a prototype one after the other, as a store holds them.

use crate::covariance;
use crate::refusal::Refusal;
use crate::rotation;
use crate::shape::{MOST, Shape, Shapes};
use crate::spread::spreads;
use rc_formula::{Program, Recorder, Term};
use rc_prototypes::model::Library;
use rc_quantity::Axes;
use rc_vocabulary::Primitive;

/// The numbers of a prototype, in the order in which plans take them.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The numbers: those of the value, then those of the covariances.
    pub numbers: Vec<Number>,
    /// Their meaning in one line: meaning, coordinates, units and axes.
    pub meaning: String,
    /// Refuses numbers without meaning, such as a quaternion whose length is not 1. It has no
    /// results.
    pub check: Program,
}

/// A number of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Its name: `Position.x`.
    pub name: String,
    /// Its unit.
    pub unit: Option<String>,
    /// How the type of the prototype stores it.
    pub number: Primitive,
}

/// The block of a prototype; of one with a sequence, that of an element.
///
/// # Errors
/// There is no prototype with this name, or it has too many numbers.
pub fn block(library: &Library, name: &str) -> Result<Block, Refusal> {
    let shapes = Shapes::new(library);
    let unknown = || Refusal::Unknown(name.to_owned());
    let prototype = shapes.prototype(name).ok_or_else(unknown)?;
    if shapes.count(name) > MOST {
        return Err(Refusal::TooMany(name.to_owned()));
    }
    let shape = shapes.shape(name, None).ok_or_else(unknown)?;
    let mut numbers = Vec::new();
    named(&shape, "", &mut numbers);
    let own = spreads((&shape, prototype), &|name| shapes.prototype(name));
    for spread in &own {
        numbers.extend(spread.names("covariance").map(|name| Number {
            name,
            unit: None,
            number: spread.number(),
        }));
    }
    let recorder = Recorder::new(numbers.len());
    let terms = numbers.iter().enumerate();
    let terms: Vec<Term> = terms
        .map(|(at, own)| recorder.input(at, own.number))
        .collect();
    let (values, mut rest) = terms.split_at(shape.len());
    rotation::require_length(&shape, values)?;
    for spread in &own {
        let (of_part, behind) = rest.split_at(spread.count);
        covariance::require_positive(of_part);
        rest = behind;
    }
    let mut meaning = described(&shape, &prototype.semantic);
    for (end, frame) in &prototype.frames {
        meaning += &format!(", {end} {frame}");
    }
    Ok(Block {
        check: recorder.program(&[]),
        numbers,
        meaning,
    })
}

fn named(shape: &Shape, above: &str, out: &mut Vec<Number>) {
    match shape {
        Shape::Leaf(leaf) => out.extend(leaf.values.iter().map(|value| Number {
            name: format!("{above}{}", value.role),
            unit: value.unit.clone(),
            number: value.number,
        })),
        Shape::Parts(parts) => {
            for (name, part) in parts {
                named(part, &format!("{above}{name}."), out);
            }
        }
    }
}

/// `Pose { Position (cartesian, m, ahead-left-up), Orientation (quaternion, 1, ahead-left-up) }`
fn described(shape: &Shape, semantic: &str) -> String {
    match shape {
        Shape::Leaf(leaf) => {
            let mut words = vec![leaf.coordinate.clone()];
            for value in &leaf.values {
                let unit = value.unit.clone().unwrap_or_else(|| "no unit".to_owned());
                if !words.contains(&unit) {
                    words.push(unit);
                }
            }
            let opposites = leaf.values.iter().filter(|value| value.is_opposite);
            words.extend(opposites.map(|value| format!("{} = -{}", value.member, value.role)));
            let directions = |axes: Axes| axes.to_string().replace(", ", "-");
            words.extend(leaf.axes.map(directions));
            let body = leaf.body.filter(|body| Some(*body) != leaf.axes);
            words.extend(body.map(|body| format!("body {}", directions(body))));
            format!("{semantic} ({})", words.join(", "))
        }
        Shape::Parts(parts) => {
            let parts = parts.iter().map(|(name, part)| described(part, name));
            format!("{semantic} {{ {} }}", parts.collect::<Vec<_>>().join(", "))
        }
    }
}
