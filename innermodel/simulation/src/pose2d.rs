//! Poses, speeds and motions on a floor.

use innermodel::kinds::Robot;
use innermodel::{Transform, Vector};
use nalgebra::Matrix3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The greatest speed of a base or of a motor whose own limit is greater or missing, in mm/s or
/// rad/s. No place gets infinite by it.
pub(crate) const FASTEST: f64 = 1e6;
/// A place on the floor, as `GenericBase` has it: x and z of the root, and a heading that is 0
/// along x and grows towards z, counter-clockwise seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose2D {
    /// In millimetres.
    pub x: f64,
    /// In millimetres.
    pub z: f64,
    /// From −π to π.
    pub alpha: f64,
}

impl Pose2D {
    /// The place of a frame on the floor. Its heading is that of its z axis.
    pub fn of(place: &Transform) -> Self {
        let front = place.rotation.column(2);
        Self {
            x: place.translation.x,
            z: place.translation.z,
            alpha: front[2].atan2(front[0]),
        }
    }

    /// The angle of a rotation about y that has this heading.
    pub fn turn_about_y(&self) -> f64 {
        FRAC_PI_2 - self.alpha
    }

    /// The place after a motion of the base.
    #[must_use]
    pub fn after(&self, motion: &Motion) -> Self {
        let (sin, cos) = self.alpha.sin_cos();
        Self {
            x: self.x + motion.front * cos + motion.right * sin,
            z: self.z + motion.front * sin - motion.right * cos,
            alpha: wrapped(self.alpha + motion.turn),
        }
    }
}

/// An angle from −π to π.
pub(crate) fn wrapped(angle: f64) -> f64 {
    if angle.abs() <= PI {
        return angle;
    }
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// How a base moves, in its own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Speed {
    /// To the right, in mm/s. 0 for a differential base.
    pub side: f64,
    /// Forwards, in mm/s.
    pub advance: f64,
    /// Counter-clockwise seen from above, in rad/s.
    pub turn: f64,
}

impl Speed {
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            side: self.side * factor,
            advance: self.advance * factor,
            turn: self.turn * factor,
        }
    }

    /// The nearest speed that a robot can have.
    pub(crate) fn limited(&self, robot: &Robot) -> Self {
        let (fastest, turn) = (robot.max_speed.min(FASTEST), robot.max_turn.min(FASTEST));
        // The greatest numbers would make an infinite length.
        let greatest = self.side.abs().max(self.advance.abs());
        let unit = if greatest > fastest { greatest } else { 1.0 };
        let (side, advance) = (self.side / unit, self.advance / unit);
        let way = side.hypot(advance) * unit;
        let factor = if way > fastest {
            fastest / side.hypot(advance)
        } else {
            unit
        };
        Self {
            side: side * factor,
            advance: advance * factor,
            turn: self.turn.max(-turn).min(turn),
        }
    }
}

/// Where a base is after a motion, in its own frame before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Along x of the base.
    pub(crate) right: f64,
    /// Along z of the base.
    pub(crate) front: f64,
    /// Counter-clockwise.
    pub(crate) turn: f64,
}

impl Motion {
    /// The arc that a constant speed of the base makes in `seconds`.
    pub(crate) fn arc(speed: &Speed, seconds: f64) -> Self {
        let turn = speed.turn * seconds;
        // sin(t)/t and (1 − cos t)/t, by their series where they would lose digits.
        let (along, across) = if turn.abs() < 1e-4 {
            (1.0 - turn * turn / 6.0, turn / 2.0 - turn.powi(3) / 24.0)
        } else {
            (turn.sin() / turn, (1.0 - turn.cos()) / turn)
        };
        let (front, right) = (speed.advance * seconds, speed.side * seconds);
        Self {
            right: right * along - front * across,
            front: front * along + right * across,
            turn,
        }
    }

    /// Takes coordinates in the base after the motion to those in the base before.
    pub(crate) fn transform(&self) -> Transform {
        let (sin, cos) = self.turn.sin_cos();
        Transform {
            rotation: Matrix3::new(cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos),
            translation: Vector::new(self.right, 0.0, self.front),
        }
    }
}
