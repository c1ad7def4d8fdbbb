//! Three turns about axes, in one of 24 orders.

use super::{Matrix, about, product};
use crate::Real;
use core::fmt;
use core::str::FromStr;

/// Which axes the turns are about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turns {
    /// The axes of the fixed frame: extrinsic, as roll, pitch and yaw of ROS.
    Fixed,
    /// The axes of the frame that turns: intrinsic.
    Moving,
}

/// The order of three turns: no two turns that follow each other are about one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EulerOrder {
    /// 0 for x, 1 for y, 2 for z.
    axes: [usize; 3],
    turns: Turns,
}

/// Angles, in the order of the turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Euler {
    /// In radians. The outer two are between -π and π. The middle one is between -π/2 and π/2 for
    /// three axes, and between 0 and π if the first axis is that of the last turn.
    pub angles: [f64; 3],
    /// Whether the first and the last turn are about one line, so that only their sum or difference
    /// is known. Then the first turn about the moving frame is 0.
    pub is_locked: bool,
}

/// The cosine, or the sine, of the middle angle below which the outer turns are about one line.
pub const LOCKED: f64 = 1e-14;

const AXES: [[usize; 3]; 12] = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 1],
    [2, 1, 0],
    [1, 0, 2],
    [0, 1, 0],
    [1, 2, 1],
    [2, 0, 2],
    [0, 2, 0],
    [2, 1, 2],
    [1, 0, 1],
];

impl EulerOrder {
    /// Roll, pitch and yaw of ROS (REP 103) and URDF: about the fixed axes x, y, z.
    pub const RPY: Self = Self {
        axes: [0, 1, 2],
        turns: Turns::Fixed,
    };

    /// About the moving axes x, y, z: `Rx Ry Rz`, as InnerModel has its angles.
    pub const XYZ_MOVING: Self = Self {
        axes: [0, 1, 2],
        turns: Turns::Moving,
    };

    /// All 24 orders.
    pub fn all() -> impl Iterator<Item = Self> {
        let turns = [Turns::Fixed, Turns::Moving].into_iter();
        turns.flat_map(|turns| AXES.into_iter().map(move |axes| Self { axes, turns }))
    }

    /// Which axes the turns are about.
    #[must_use]
    pub const fn turns(self) -> Turns {
        self.turns
    }

    /// The order of the same rotation about moving axes, and whether the angles are reversed.
    fn moving(self) -> ([usize; 3], bool) {
        let [first, middle, last] = self.axes;
        match self.turns {
            Turns::Moving => (self.axes, false),
            Turns::Fixed => ([last, middle, first], true),
        }
    }

    /// The rotation by three angles.
    #[must_use]
    pub fn matrix<T: Real>(self, angles: [T; 3]) -> Matrix<T> {
        let (axes, is_reversed) = self.moving();
        let [a, b, c] = angles;
        let angles = if is_reversed { [c, b, a] } else { angles };
        let outer = product(&about(axes[0], angles[0]), &about(axes[1], angles[1]));
        product(&outer, &about(axes[2], angles[2]))
    }

    /// The angles of a rotation.
    #[must_use]
    pub fn angles(self, r: &Matrix) -> Euler {
        let (angles, size) = self.solved(r);
        Euler {
            angles,
            is_locked: size < LOCKED,
        }
    }

    /// The angles of a rotation, and the size of the cosine, or of the sine, of the middle one. Where
    /// that is 0, the outer turns are about one line, and the first turn about the moving frame is 0.
    #[must_use]
    pub fn solved<T: Real>(self, r: &Matrix<T>) -> ([T; 3], T) {
        let ([i, j, last], is_reversed) = self.moving();
        let k = 3 - i - j;
        // 1 if i, j, k follow each other as x, y, z do.
        let sense = T::constant(if (i + 1) % 3 == j { 1.0 } else { -1.0 });
        let is_proper = i == last;
        let (middle, size, first) = if is_proper {
            let size = r[i][j].length_with(r[i][k]);
            (size.angle_over(r[i][i]), size, (r[j][i], -sense * r[k][i]))
        } else {
            let size = r[i][i].length_with(r[i][j]);
            (
                (sense * r[i][k]).angle_over(size),
                size,
                (-sense * r[j][k], r[k][k]),
            )
        };
        let zero = T::constant(0.0);
        let first = size.if_below(T::constant(LOCKED), zero, first.0.angle_over(first.1));
        // The first turn is taken back before the last one is read, so that both fit each other
        // where they are nearly about one line.
        let (sine, cosine) = (first.sine(), first.cosine());
        let row = |column: usize| cosine * r[j][column] + sense * sine * r[k][column];
        let last = if is_proper {
            (-sense * row(k)).angle_over(row(j))
        } else {
            (sense * row(i)).angle_over(row(j))
        };
        let angles = if is_reversed {
            [last, middle, first]
        } else {
            [first, middle, last]
        };
        (angles, size)
    }
}

impl fmt::Display for EulerOrder {
    /// `xyz fixed` or `zyx moving`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for axis in self.axes {
            f.write_str(["x", "y", "z"][axis])?;
        }
        f.write_str(match self.turns {
            Turns::Fixed => " fixed",
            Turns::Moving => " moving",
        })
    }
}

/// A text is not an order of turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoOrder;

impl fmt::Display for NoOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("expected `rpy`, or three axes and `fixed` or `moving`, as in `zyx moving`")
    }
}

impl core::error::Error for NoOrder {}

impl FromStr for EulerOrder {
    type Err = NoOrder;

    fn from_str(text: &str) -> Result<Self, NoOrder> {
        if text == "rpy" {
            return Ok(Self::RPY);
        }
        let mut words = text.split_ascii_whitespace();
        let (Some(axes), Some(turns), None) = (words.next(), words.next(), words.next()) else {
            return Err(NoOrder);
        };
        let turns = match turns {
            "fixed" => Turns::Fixed,
            "moving" => Turns::Moving,
            _ => return Err(NoOrder),
        };
        let mut letters = axes.bytes().map(|letter| match letter {
            b'x' => Some(0),
            b'y' => Some(1),
            b'z' => Some(2),
            _ => None,
        });
        let mut axis = || letters.next().flatten().ok_or(NoOrder);
        let axes = [axis()?, axis()?, axis()?];
        let is_order = letters.next().is_none() && AXES.contains(&axes);
        is_order.then_some(Self { axes, turns }).ok_or(NoOrder)
    }
}
