//! Which value of its coordinates each value of an abstract type is.

use crate::geometry::Coordinate;
use crate::model::Alias;
use std::collections::HashSet;

/// The meanings that may leave out z. Others have three values in a plane as well: a turn in the plane
/// of x and y is about z.
const PLANAR: [&str; 5] = [
    "Position",
    "PointSet",
    "LinearVelocity",
    "Acceleration",
    "Force",
];

/// The names of the values of an abstract type.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Scalar,
    Vector,
    Matrix,
}

impl Form {
    fn of(symbols: &[String]) -> Self {
        match symbols.first().and_then(|symbol| symbol.bytes().next()) {
            Some(b'{') => Self::Matrix,
            Some(b'0'..=b'9') => Self::Vector,
            _ => Self::Scalar,
        }
    }
}

/// The row and the column of `{0,1}`.
fn cell(symbol: &str) -> Option<(usize, usize)> {
    let inner = symbol.strip_prefix('{')?.strip_suffix('}')?;
    let (row, column) = inner.split_once(',')?;
    Some((row.parse().ok()?, column.parse().ok()?))
}

/// The coordinates of a meaning, and an abstract type for them.
pub(crate) struct Roles<'a> {
    pub(crate) semantic: &'a str,
    pub(crate) coordinate: &'a Coordinate,
    pub(crate) algebraic: &'a str,
    pub(crate) symbols: &'a [String],
}

impl Roles<'_> {
    /// Whether the abstract type has room for the coordinates.
    pub(crate) fn has_room(&self) -> bool {
        let values = self.symbols.len();
        let may_be_planar = self.coordinate.name == "cartesian" && PLANAR.contains(&self.semantic);
        self.coordinate.values.len() == values || may_be_planar && values == 2
    }

    /// The width of coordinates that are a square matrix.
    fn width(&self) -> Option<usize> {
        let values = self.coordinate.values;
        let is_matrix = values.iter().all(|(name, _)| name.is_empty());
        is_matrix.then_some(if values.len() == 9 { 3 } else { 4 })
    }

    /// The place among the coordinates that a symbol names, whatever its case.
    fn named(&self, symbol: &str) -> Option<usize> {
        if let Some(width) = self.width() {
            let (row, column) = cell(symbol)?;
            return (row < width && column < width).then_some(row * width + column);
        }
        let mut values = self.coordinate.values.iter().take(self.symbols.len());
        values.position(|(name, _)| symbol.eq_ignore_ascii_case(name))
    }

    /// The names of another abstract type with the same values.
    fn by_alias(&self, alias: &Alias) -> Option<Vec<usize>> {
        let is_left = alias.left == self.algebraic;
        if !is_left && alias.right != self.algebraic {
            return None;
        }
        let places = self.symbols.iter().map(|symbol| {
            let other = alias.pairs.iter().find_map(|(left, right)| {
                let (own, other) = if is_left {
                    (left, right)
                } else {
                    (right, left)
                };
                (own == symbol).then_some(other)
            });
            self.named(other?)
        });
        places.collect()
    }

    /// The place of each value among the coordinates: by its own name, else by an alias to a type with
    /// such names, else by the order of the type. The error says what the type must have.
    pub(crate) fn places(&self, aliases: &[Alias]) -> Result<Vec<usize>, String> {
        let own: Option<Vec<usize>> = self.symbols.iter().map(|own| self.named(own)).collect();
        // `x` and `X` are one value.
        let own = own.filter(|all| all.iter().collect::<HashSet<_>>().len() == all.len());
        let mut by_alias = aliases.iter().filter_map(|of| self.by_alias(of));
        if let Some(places) = own {
            return Ok(places);
        }
        if let Some(places) = by_alias.next() {
            // The order of their lines must not decide the role of a number.
            if by_alias.any(|other| other != places) {
                return Err("one order of its values; its aliases give several".to_owned());
            }
            return Ok(places);
        }
        let names = self.coordinate.values.iter().take(self.symbols.len());
        let names: Vec<String> = names.map(|(name, _)| format!("`{name}`")).collect();
        let names = names.join(", ");
        match (Form::of(self.symbols), self.width()) {
            (Form::Vector, _) | (Form::Scalar, Some(_)) => Ok((0..self.symbols.len()).collect()),
            (Form::Scalar, None) => Err(format!("the names {names}")),
            (Form::Matrix, None) => Err(format!("the names {names}, or is a `Vector`")),
            (Form::Matrix, Some(width)) => Err(format!("{width} rows and {width} columns")),
        }
    }
}

/// The name of a place among coordinates: `x`, or the place where they are a matrix.
pub(crate) fn role(coordinate: &Coordinate, place: usize) -> String {
    match coordinate.values.get(place) {
        Some((name, _)) if !name.is_empty() => (*name).to_owned(),
        _ => place.to_string(),
    }
}

/// The places in a homogeneous matrix of the values of a part: of `cartesian` the translation, of
/// `rot_matrix` the rotation. `None` for coordinates that a homogeneous matrix does not hold.
pub(crate) fn part_of_matrix(whole: &str, part: &str, coordinate: &str) -> Option<Vec<usize>> {
    let is_row = match whole {
        "homogeneous_transformation" => false,
        "homogeneous_row_vectors" => true,
        _ => return None,
    };
    let place = |row: usize, column: usize| {
        if is_row {
            column * 4 + row
        } else {
            row * 4 + column
        }
    };
    match (part, coordinate) {
        ("Position", "cartesian") => Some((0..3).map(|row| place(row, 3)).collect()),
        ("Orientation", "rot_matrix") => Some((0..9).map(|at| place(at / 3, at % 3)).collect()),
        _ => None,
    }
}
