//! Prototypes as the conversions see them: leaves with numbers, and their parts.

use rc_prototypes::model::{Content, Library, Prototype};
use rc_prototypes::{coordinate, semantic};
use rc_quantity::Axes;
use rc_vocabulary::Primitive;
use std::collections::HashMap;

/// How far the norm of a quaternion, of an axis, and the determinant of a matrix may be from 1 where
/// the prototype says nothing.
const TOLERANCE: f64 = 1e-3;

/// Numbers, or parts with numbers.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    Leaf(Leaf),
    /// The parts with their names, in the order of the prototype.
    Parts(Vec<(String, Shape)>),
}

/// The numbers of one prototype.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    pub(crate) in_geometry: bool,
    pub(crate) semantic: String,
    pub(crate) coordinate: String,
    pub(crate) algebraic: String,
    pub(crate) axes: Option<Axes>,
    pub(crate) tolerance: f64,
    pub(crate) values: Vec<Value>,
}

/// A number.
#[derive(Clone, Debug)]
pub(crate) struct Value {
    /// What it is among its coordinates: `x`, or its place where places have no names. In domains
    /// other than `geometry`, its name in the abstract type.
    pub(crate) role: String,
    /// Its unit: in `geometry` that of the meaning, where the prototype says none.
    pub(crate) unit: Option<String>,
    pub(crate) number: Primitive,
    /// Where it is, for comments in code.
    pub(crate) member: String,
}

impl Shape {
    /// All numbers, in their order.
    pub(crate) fn values(&self) -> Vec<&Value> {
        match self {
            Self::Leaf(leaf) => leaf.values.iter().collect(),
            Self::Parts(parts) => {
                let parts = parts.iter().map(|(_, part)| part.values());
                parts.flatten().collect()
            }
        }
    }

    /// The number of values.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Leaf(leaf) => leaf.values.len(),
            Self::Parts(parts) => parts.iter().map(|(_, part)| part.len()).sum(),
        }
    }

    /// The part with this name, and which numbers are its own.
    pub(crate) fn part(&self, name: &str) -> Option<(&Self, std::ops::Range<usize>)> {
        let Self::Parts(parts) = self else {
            return None;
        };
        let mut start = 0;
        for (own, part) in parts {
            let end = start + part.len();
            if own == name {
                return Some((part, start..end));
            }
            start = end;
        }
        None
    }
}

impl Leaf {
    /// The place of the number with this role.
    pub(crate) fn place(&self, role: &str) -> Option<usize> {
        self.values.iter().position(|value| value.role == role)
    }
}

/// Shapes of the prototypes of a library.
pub(crate) struct Shapes<'l> {
    library: &'l Library,
    prototypes: HashMap<&'l str, &'l Prototype>,
    symbols: HashMap<&'l str, &'l [String]>,
}

impl<'l> Shapes<'l> {
    pub(crate) fn new(library: &'l Library) -> Self {
        let prototypes = library.prototypes.iter();
        let algebraics = library.algebraics.iter();
        Self {
            library,
            prototypes: prototypes.map(|one| (one.name.as_str(), one)).collect(),
            symbols: algebraics
                .map(|one| (one.name.as_str(), one.symbols.as_slice()))
                .collect(),
        }
    }

    pub(crate) fn prototype(&self, name: &str) -> Option<&'l Prototype> {
        self.prototypes.get(name).copied()
    }

    /// The shape of a prototype. `axes` are those of the whole, if it is a part. `None` if a part is
    /// unknown.
    pub(crate) fn shape(&self, name: &str, axes: Option<Axes>) -> Option<Shape> {
        let prototype = self.prototype(name)?;
        let own = prototype.axes.as_ref().and_then(|name| {
            let mut all = self.library.axes.iter();
            let axes = all.find(|axes| axes.name == *name)?;
            axes.directions.parse::<Axes>().ok()
        });
        let axes = own.or(axes);
        let (coordinate_name, algebraic, data) = match &prototype.content {
            Content::Parts(parts) => {
                let parts = parts.iter().map(|part| {
                    let shape = self.shape(&part.prototype, axes)?;
                    Some((part.name.clone(), shape))
                });
                return parts.collect::<Option<Vec<_>>>().map(Shape::Parts);
            }
            Content::Values {
                coordinate,
                algebraic,
                data,
                ..
            } => (coordinate, algebraic, data),
        };
        let in_geometry = prototype.domain == "geometry";
        let of = in_geometry.then(|| coordinate(coordinate_name)).flatten();
        let unit = semantic(&prototype.semantic).map_or("1", |of| of.unit);
        let symbols = self.symbols.get(algebraic.as_str())?;
        let roles = of.map(|of| self.roles(algebraic, symbols, of.values));
        let values = data.iter().map(|datum| {
            let place = symbols.iter().position(|own| *own == datum.symbol);
            let role = roles.as_ref().zip(place).and_then(|(r, at)| r.get(at));
            let known = of.zip(role).and_then(|(of, role)| {
                let mut values = of.values.iter();
                let value = match role.parse::<usize>() {
                    Ok(at) => values.nth(at),
                    Err(_) => values.find(|(name, _)| name == role),
                };
                value.map(|(_, own)| own.unwrap_or(unit).to_owned())
            });
            Value {
                role: role.cloned().unwrap_or_else(|| datum.symbol.clone()),
                unit: datum.unit.clone().or(known),
                number: datum.number.unwrap_or(Primitive::F64),
                member: datum.member.clone(),
            }
        });
        Some(Shape::Leaf(Leaf {
            in_geometry,
            semantic: prototype.semantic.clone(),
            coordinate: coordinate_name.clone(),
            algebraic: algebraic.clone(),
            axes,
            tolerance: prototype.tolerance.unwrap_or(TOLERANCE),
            values: values.collect(),
        }))
    }

    /// The role of each value of an abstract type: by its own names if they are those of the
    /// coordinates, whatever their case; else by an alias to a type with such names; else by place.
    fn roles(
        &self,
        algebraic: &str,
        symbols: &[String],
        values: &[(&str, Option<&str>)],
    ) -> Vec<String> {
        // The numbers of a matrix have no names but row and column.
        let width = if values.len() == 9 { 3 } else { 4 };
        let has_names = values.iter().any(|(name, _)| !name.is_empty());
        let cell = |symbol: &str| {
            let (row, column) = symbol
                .strip_prefix('{')?
                .strip_suffix('}')?
                .split_once(',')?;
            let at = row.parse::<usize>().ok()? * width + column.parse::<usize>().ok()?;
            Some(at.to_string())
        };
        let named = |symbol: &String| {
            if !has_names {
                return cell(symbol);
            }
            let mut values = values.iter().filter(|(name, _)| !name.is_empty());
            let found = values.find(|(name, _)| symbol.eq_ignore_ascii_case(name));
            found.map(|(name, _)| (*name).to_owned())
        };
        let own: Option<Vec<String>> = symbols.iter().map(named).collect();
        let by_alias = || {
            self.library.aliases.iter().find_map(|alias| {
                let is_left = alias.left == algebraic;
                if !is_left && alias.right != algebraic {
                    return None;
                }
                let other = |symbol: &String| {
                    alias.pairs.iter().find_map(|(left, right)| {
                        let (own, other) = if is_left {
                            (left, right)
                        } else {
                            (right, left)
                        };
                        (own == symbol).then_some(other)
                    })
                };
                let mut roles = symbols.iter().map(|symbol| other(symbol).and_then(named));
                roles.by_ref().collect::<Option<Vec<String>>>()
            })
        };
        let by_place = || {
            let name = |at: usize| match values.get(at) {
                Some((name, _)) if !name.is_empty() => (*name).to_owned(),
                _ => at.to_string(),
            };
            (0..symbols.len()).map(name).collect()
        };
        own.or_else(by_alias).unwrap_or_else(by_place)
    }
}
