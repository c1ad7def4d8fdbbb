//! Points, poses and segments of a plane.

use std::f64::consts::{PI, TAU};

/// Turns slower than this in one motion are driven as a straight line, in rad; the arc would divide
/// by it.
const STRAIGHT: f64 = 1e-9;

/// A place on the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// In mm.
    pub x: f64,
    /// In mm.
    pub y: f64,
}

impl Point {
    /// A place, in mm.
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The distance to `other`, in mm.
    pub fn distance_to(self, other: Self) -> f64 {
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        (dx * dx + dy * dy).sqrt()
    }
}

/// A place and a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// In mm.
    pub x: f64,
    /// In mm.
    pub y: f64,
    /// In rad, from -π to π.
    pub heading: f64,
}

impl Pose {
    /// A pose, in mm and rad.
    pub fn new(x: f64, y: f64, heading: f64) -> Self {
        Self {
            x,
            y,
            heading: wrapped(heading),
        }
    }

    /// The place alone.
    pub fn point(self) -> Point {
        Point::new(self.x, self.y)
    }

    /// Where one is after driving `advance` mm along an arc that turns by `turn` rad.
    ///
    /// This is the exact motion of a differential drive whose two wheels keep their speed
    /// meanwhile.
    #[must_use]
    pub fn after(self, advance: f64, turn: f64) -> Self {
        let heading = self.heading + turn;
        if turn.abs() < STRAIGHT {
            let (sin, cos) = libm::sincos(self.heading);
            return Self::new(self.x + advance * cos, self.y + advance * sin, heading);
        }
        let radius = advance / turn;
        let ((sin0, cos0), (sin1, cos1)) = (libm::sincos(self.heading), libm::sincos(heading));
        let (x, y) = (
            self.x + radius * (sin1 - sin0),
            self.y - radius * (cos1 - cos0),
        );
        Self::new(x, y, heading)
    }
}

/// The equal angle from -π (excluded) to π, in rad.
pub fn wrapped(angle: f64) -> f64 {
    let rest = angle.rem_euclid(TAU);
    if rest > PI { rest - TAU } else { rest }
}

/// A straight piece of wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end.
    pub a: Point,
    /// The other end.
    pub b: Point,
}

impl Segment {
    /// The shortest distance to `point`, in mm.
    pub fn distance_to(&self, point: Point) -> f64 {
        let (dx, dy) = (self.b.x - self.a.x, self.b.y - self.a.y);
        let length2 = dx * dx + dy * dy;
        let along = (point.x - self.a.x) * dx + (point.y - self.a.y) * dy;
        let t = if length2 > 0.0 {
            (along / length2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        point.distance_to(Point::new(self.a.x + t * dx, self.a.y + t * dy))
    }

    /// The distance that a ray from `origin` in the unit direction (`cos`, `sin`) goes until it
    /// hits, in mm; none if it never does.
    ///
    /// A ray along the segment itself does not hit it.
    pub fn hit_from(&self, origin: Point, cos: f64, sin: f64) -> Option<f64> {
        let (dx, dy) = (self.b.x - self.a.x, self.b.y - self.a.y);
        let (ox, oy) = (self.a.x - origin.x, self.a.y - origin.y);
        let across = cos * dy - sin * dx;
        if across == 0.0 {
            return None;
        }
        let far = (ox * dy - oy * dx) / across;
        let part = (ox * sin - oy * cos) / across;
        (far >= 0.0 && (0.0..=1.0).contains(&part)).then_some(far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn near(left: Pose, right: Pose) -> bool {
        left.point().distance_to(right.point()) < 1e-6
            && wrapped(left.heading - right.heading).abs() < 1e-9
    }

    #[test]
    fn a_quarter_circle_to_the_left_ends_beside_its_centre() {
        let end = Pose::default().after(1000.0 * FRAC_PI_2, FRAC_PI_2);
        assert!(near(end, Pose::new(1000.0, 1000.0, FRAC_PI_2)), "{end:?}");
    }

    #[test]
    fn a_full_circle_ends_where_it_began() {
        let start = Pose::new(-300.0, 70.0, 1.0);
        assert!(near(start.after(5000.0, TAU), start));
    }

    #[test]
    fn a_hardly_curved_line_is_a_straight_one() {
        let straight = Pose::new(0.0, 0.0, 0.3).after(100.0, 0.0);
        assert!(near(
            Pose::new(0.0, 0.0, 0.3).after(100.0, 1e-8),
            Pose {
                heading: 0.3 + 1e-8,
                ..straight
            }
        ));
    }

    #[test]
    fn angles_are_wrapped_to_half_a_turn() {
        assert!((wrapped(3.0 * PI) - PI).abs() < 1e-12);
        assert!((wrapped(-0.1) + 0.1).abs() < 1e-12);
    }

    #[test]
    fn distances_and_hits_of_a_segment() {
        let wall = Segment {
            a: Point::new(100.0, -50.0),
            b: Point::new(100.0, 50.0),
        };
        assert_eq!(wall.distance_to(Point::default()), 100.0);
        assert_eq!(wall.distance_to(Point::new(100.0, 80.0)), 30.0);
        assert_eq!(wall.hit_from(Point::default(), 1.0, 0.0), Some(100.0));
        assert_eq!(wall.hit_from(Point::default(), -1.0, 0.0), None);
        assert_eq!(wall.hit_from(Point::new(0.0, 60.0), 1.0, 0.0), None);
        assert_eq!(wall.hit_from(Point::new(100.0, -90.0), 0.0, 1.0), None);
    }
}
