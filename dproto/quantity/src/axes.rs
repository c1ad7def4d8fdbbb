//! Where the axes of a frame point: `ahead, left, up`.

use crate::rotation::{Matrix, determinant, product, transposed};
use core::fmt;
use core::str::FromStr;

/// A direction of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "directions")]
pub enum Direction {
    Ahead,
    Back,
    Left,
    Right,
    Up,
    Down,
}

/// All directions with their words: of ahead, left and up, the number of the line, and the sense.
const DIRECTIONS: [(Direction, &str, usize, f64); 6] = [
    (Direction::Ahead, "ahead", 0, 1.0),
    (Direction::Back, "back", 0, -1.0),
    (Direction::Left, "left", 1, 1.0),
    (Direction::Right, "right", 1, -1.0),
    (Direction::Up, "up", 2, 1.0),
    (Direction::Down, "down", 2, -1.0),
];

impl Direction {
    fn row(self) -> (Self, &'static str, usize, f64) {
        let mut all = DIRECTIONS.into_iter();
        all.find(|(own, ..)| *own == self).unwrap_or(DIRECTIONS[0])
    }
}

/// The directions of x, y and z. They are three different lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes([Direction; 3]);

impl Axes {
    /// REP 103 of ROS: x ahead, y left, z up.
    pub const ROS: Self = Self([Direction::Ahead, Direction::Left, Direction::Up]);
    /// The optical frames of ROS: x right, y down, z ahead.
    pub const ROS_OPTICAL: Self = Self([Direction::Right, Direction::Down, Direction::Ahead]);
    /// Points of `RoboComp`: x right, y ahead, z up.
    pub const ROBOCOMP: Self = Self([Direction::Right, Direction::Ahead, Direction::Up]);
    /// `InnerModel`: x right, y up, z ahead; left-handed.
    pub const INNER_MODEL: Self = Self([Direction::Right, Direction::Up, Direction::Ahead]);

    /// The axes in these directions. `None` if two are along one line.
    #[must_use]
    pub fn new(directions: [Direction; 3]) -> Option<Self> {
        let lines = directions.map(|direction| direction.row().2);
        let differ = lines[0] != lines[1] && lines[1] != lines[2] && lines[0] != lines[2];
        differ.then_some(Self(directions))
    }

    /// Takes coordinates in these axes to ahead, left, up.
    fn to_body(self) -> Matrix {
        let mut out = [[0.0; 3]; 3];
        for (column, direction) in self.0.into_iter().enumerate() {
            let (_, _, line, sense) = direction.row();
            out[line][column] = sense;
        }
        out
    }

    /// Whether the axes are a right-handed system.
    #[must_use]
    pub fn is_right_handed(self) -> bool {
        determinant(&self.to_body()) > 0.0
    }

    /// Takes the coordinates of a direction in these axes to those in `other`. Each row has one
    /// number that is not 0: 1 or -1.
    #[must_use]
    pub fn matrix_to(self, other: Self) -> Matrix {
        product(&transposed(&other.to_body()), &self.to_body())
    }

    /// Takes an axial vector, as an angular velocity or a torque, to `other`: its sense changes
    /// where the hand does.
    #[must_use]
    pub fn axial_matrix_to(self, other: Self) -> Matrix {
        let matrix = self.matrix_to(other);
        let sign = determinant(&matrix);
        matrix.map(|row| row.map(|value| value * sign))
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, direction) in self.0.into_iter().enumerate() {
            f.write_str(if at > 0 { ", " } else { "" })?;
            f.write_str(direction.row().1)?;
        }
        Ok(())
    }
}

/// A text names no axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoAxes;

impl fmt::Display for NoAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("expected the directions of x, y and z along three lines, as in `ahead, left, up`; there are ahead, back, left, right, up and down")
    }
}

impl core::error::Error for NoAxes {}

impl FromStr for Axes {
    type Err = NoAxes;

    fn from_str(text: &str) -> Result<Self, NoAxes> {
        let mut words = text.split(',').map(str::trim);
        let mut direction = || {
            let word = words.next().ok_or(NoAxes)?;
            let found = DIRECTIONS.iter().find(|(_, own, ..)| *own == word);
            found.map(|(direction, ..)| *direction).ok_or(NoAxes)
        };
        let directions = [direction()?, direction()?, direction()?];
        let axes = Self::new(directions).filter(|_| words.next().is_none());
        axes.ok_or(NoAxes)
    }
}
