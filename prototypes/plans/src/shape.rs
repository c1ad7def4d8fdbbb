//! Prototypes as the conversions see them: leaves with numbers, and their parts.

use rc_formula::Term;
use rc_prototypes::model::{Content, Library, Prototype};
use rc_prototypes::{coordinate, semantic};
use rc_quantity::Axes;
use rc_vocabulary::Primitive;
use std::cell::RefCell;
use std::collections::HashMap;

/// The default for how far the norm of a quaternion, of an axis, and the determinant of a matrix
/// may be from 1.
const TOLERANCE: f64 = 1e-3;

/// The most numbers of a prototype that has plans. Composites of composites multiply.
pub(crate) const MOST: usize = 4096;

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
    /// Those of the body whose rotation it is.
    pub(crate) body: Option<Axes>,
    pub(crate) tolerance: f64,
    pub(crate) values: Vec<Value>,
}

/// A number.
#[derive(Clone, Debug)]
pub(crate) struct Value {
    /// Its name among its coordinates: `x`, or its place where places have no names. In domains
    /// other than `geometry`, its name in the abstract type.
    pub(crate) role: String,
    /// Its unit: in `geometry` that of the meaning, where the prototype says none.
    pub(crate) unit: Option<String>,
    pub(crate) number: Primitive,
    /// Where it is, for comments in code.
    pub(crate) member: String,
    /// Whether the type holds the opposite of it.
    pub(crate) is_opposite: bool,
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

    /// The roles of the numbers of which the type holds the opposite.
    pub(crate) fn opposites(&self) -> Vec<&str> {
        let values = self.values().into_iter();
        let own = values.filter(|value| value.is_opposite);
        own.map(|value| value.role.as_str()).collect()
    }

    /// The numbers of a type as what they mean, or what they mean as the numbers of the type.
    pub(crate) fn signed<'r>(&self, numbers: &[Term<'r>]) -> Vec<Term<'r>> {
        let values = self.values();
        let mut values = values.iter().map(|value| value.is_opposite);
        let numbers = numbers.iter();
        numbers
            .map(|number| match values.next() {
                Some(true) => -*number,
                _ => *number,
            })
            .collect()
    }

    /// The axes of all leaves whose meaning has directions; `None` represents unknown ones.
    pub(crate) fn axes(&self) -> Vec<Option<Axes>> {
        match self {
            Self::Leaf(leaf) if matches!(leaf.semantic.as_str(), "Orientation" | "Pose") => {
                vec![leaf.axes, leaf.body]
            }
            Self::Leaf(leaf) if leaf.has_directions() => vec![leaf.axes],
            Self::Leaf(_) => Vec::new(),
            Self::Parts(parts) => parts.iter().flat_map(|(_, part)| part.axes()).collect(),
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
    /// Whether its numbers are along axes, or about them.
    fn has_directions(&self) -> bool {
        let meaning = self.semantic.as_str();
        self.in_geometry && !matches!(meaning, "TimeStamp" | "Range" | "JointState")
    }

    /// The place of the number with this role.
    pub(crate) fn place(&self, role: &str) -> Option<usize> {
        self.values.iter().position(|value| value.role == role)
    }
}

/// Shapes of the prototypes of a library.
pub(crate) struct Shapes<'l> {
    library: &'l Library,
    prototypes: HashMap<&'l str, &'l Prototype>,
    /// How many numbers the counted prototypes have.
    counts: RefCell<HashMap<&'l str, usize>>,
}

impl<'l> Shapes<'l> {
    pub(crate) fn new(library: &'l Library) -> Self {
        let prototypes = library.prototypes.iter();
        Self {
            library,
            prototypes: prototypes.map(|one| (one.name.as_str(), one)).collect(),
            counts: RefCell::default(),
        }
    }

    pub(crate) fn prototype(&self, name: &str) -> Option<&'l Prototype> {
        self.prototypes.get(name).copied()
    }

    /// How many numbers a prototype has, with those of its parts.
    pub(crate) fn count(&self, name: &str) -> usize {
        if let Some(known) = self.counts.borrow().get(name) {
            return *known;
        }
        let Some(prototype) = self.prototype(name) else {
            return 0;
        };
        let count = match &prototype.content {
            Content::Values { data, .. } => data.len(),
            Content::Parts(parts) => {
                let counts = parts.iter().map(|part| self.count(&part.prototype));
                counts.fold(1, usize::saturating_add)
            }
        };
        self.counts.borrow_mut().insert(&prototype.name, count);
        count
    }

    /// The shape of a prototype. `around` are the axes of the whole and of its body, if it is a part.
    /// `None` if a part is unknown.
    pub(crate) fn shape(&self, name: &str, around: Option<(Axes, Axes)>) -> Option<Shape> {
        let prototype = self.prototype(name)?;
        let named = |name: &Option<String>| {
            let mut all = self.library.axes.iter();
            let axes = all.find(|axes| Some(&axes.name) == name.as_ref())?;
            axes.directions.parse::<Axes>().ok()
        };
        let own = named(&prototype.axes);
        let own = own.map(|axes| (axes, named(&prototype.body).unwrap_or(axes)));
        let all_axes = own.or(around);
        let (coordinate_name, algebraic, data) = match &prototype.content {
            Content::Parts(parts) => {
                let parts = parts.iter().map(|part| {
                    let shape = self.shape(&part.prototype, all_axes)?;
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
        let values = data.iter().map(|datum| {
            let known = of.and_then(|of| {
                let mut values = of.values.iter();
                let value = match datum.role.parse::<usize>() {
                    Ok(at) => values.nth(at),
                    Err(_) => values.find(|(name, _)| *name == datum.role),
                };
                value.map(|(_, own)| own.unwrap_or(unit).to_owned())
            });
            Value {
                role: datum.role.clone(),
                unit: datum.unit.clone().or(known),
                number: datum.number.unwrap_or(Primitive::F64),
                member: datum.member.clone(),
                is_opposite: datum.is_opposite,
            }
        });
        Some(Shape::Leaf(Leaf {
            in_geometry,
            semantic: prototype.semantic.clone(),
            coordinate: coordinate_name.clone(),
            algebraic: algebraic.clone(),
            axes: all_axes.map(|(axes, _)| axes),
            body: all_axes.map(|(_, body)| body),
            tolerance: prototype.tolerance.unwrap_or(TOLERANCE),
            values: values.collect(),
        }))
    }
}
