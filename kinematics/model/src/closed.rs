//! Arms of six turning joints whose positions for a pose have a closed form.
//!
//! Each step is one of the subproblems of B. Paden (1986) and W. Kahan as A. J. Elias and J. T. Wen put them together ("IK-Geo:
//! Unified robot inverse kinematics using subproblem decomposition", 2022): which turn about an axis brings a point to another
//! one, or to a level.

use crate::chain::Chain;
use crate::robot::{Motion, State};
use crate::vectors::{dot, scaled, sum, vector};
use rc_quantity::Real;
use rc_quantity::rotation::{Matrix, cross, product, transposed, turned};

/// Axes that are parallel up to this angle in rad, or that meet up to this distance in m, count as such: positions that miss the
/// pose by it are good beginnings of a search.
const NEAR: f64 = 1e-5;

/// How far out of reach a point may be by rounding: a part of the square of its distance.
const EDGE: f64 = 1e-10;

/// The same with numbers of 32 bits.
const EDGE_OF_SINGLE: f64 = 1e-5;

/// How many positions a closed form has.
pub const SOLUTIONS: usize = 8;

/// The kind of an arm with a closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The last three axes meet, the second and the third one are parallel: most industrial arms.
    ParallelAndWrist,
    /// The last three axes meet, and so do the first two.
    CrossingAndWrist,
    /// The second, third and fourth axis are parallel, the last two meet: the arms of Universal Robots.
    ThreeParallel,
}

impl Kind {
    /// In words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::ParallelAndWrist => {
                "axes 2 and 3 are parallel, and axes 4, 5 and 6 meet in a point"
            }
            Self::CrossingAndWrist => "axes 1 and 2 meet, and axes 4, 5 and 6 meet in a point",
            Self::ThreeParallel => "axes 2, 3 and 4 are parallel, and axes 5 and 6 meet",
        }
    }
}

/// An arm of six turning joints, while all of them are at 0. All vectors are in the base of its chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Closed {
    /// Why it has a closed form.
    pub kind: Kind,
    /// The coordinates of the joints, from the base on.
    pub coordinates: [usize; 6],
    /// The angle of each joint for a unit of its coordinate; the sign is in the axis.
    pub ratios: [f64; 6],
    axes: [[f64; 3]; 6],
    /// Points of axes 1 to 3, then the point where the last axes meet; of three parallel axes, one of the fourth before it.
    points: [[f64; 3]; 5],
    rotation: Matrix,
    translation: [f64; 3],
    edge: f64,
}

/// The sine and the cosine of an angle.
#[derive(Clone, Copy)]
struct Turn<T>([T; 2]);

fn minus<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    sum(a, b.map(|part| -part))
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Numbers that are integers but for rounding.
fn clean(vector: [f64; 3]) -> [f64; 3] {
    vector.map(|part| {
        let whole = part.round();
        if (part - whole).abs() < 1e-12 {
            whole
        } else {
            part
        }
    })
}

impl<T: Real> Turn<T> {
    /// Of the angle of the point (x, y).
    fn of(y: T, x: T) -> Self {
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let square = y * y + x * x;
        let length = square.root();
        // No angle is better than another one.
        let least = T::constant(1e-200);
        Self([
            square.if_below(least, zero, y / length),
            square.if_below(least, one, x / length),
        ])
    }

    fn angle(self) -> T {
        self.0[0].angle_over(self.0[1])
    }

    /// A vector, turned about an axis of length 1.
    fn about(self, axis: [f64; 3], of: [T; 3]) -> [T; 3] {
        let axis = vector(axis);
        let [sine, cosine] = self.0;
        let along = dot(axis, of) * (T::constant(1.0) - cosine);
        sum(
            sum(scaled(of, cosine), scaled(cross(axis, of), sine)),
            scaled(axis, along),
        )
    }

    /// The turn about an axis that brings a vector nearest to another one.
    fn aligning(from: [T; 3], to: [T; 3], axis: [f64; 3]) -> Self {
        let axis = vector(axis);
        let x = dot(from, to) - dot(axis, from) * dot(axis, to);
        Self::of(dot(cross(axis, from), to), x)
    }

    /// The two turns of a vector about an axis that bring it to a level over the normal of a plane.
    fn to_level(normal: [T; 3], of: [T; 3], axis: [f64; 3], level: T, edge: f64) -> [Self; 2] {
        let axis = vector(axis);
        let fixed = dot(normal, axis) * dot(axis, of);
        let (a, b) = (dot(normal, cross(axis, of)), dot(normal, of) - fixed);
        let level = level - fixed;
        let most = a * a + b * b;
        let rest = most - level * level;
        let zero = T::constant(0.0);
        // A level out of reach has no turn: the root is not a number. At the edge of reach, it is but rounding.
        let known = rest.if_below(zero, zero, rest);
        let root = rest.if_below(most * T::constant(-edge), rest, known).root();
        [
            Self::of(a * level + b * root, b * level - a * root),
            Self::of(a * level - b * root, b * level + a * root),
        ]
    }
}

fn opposite(axis: [f64; 3]) -> [f64; 3] {
    axis.map(|part| -part)
}

fn parallel(a: [f64; 3], b: [f64; 3]) -> bool {
    length(cross(a, b)) < NEAR
}

/// The point of an axis that is nearest to another point.
fn foot(axis: [f64; 3], point: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    let along = dot(axis, minus(other, point));
    sum(point, scaled(axis, along))
}

/// Where two axes meet.
fn meeting(a: ([f64; 3], [f64; 3]), b: ([f64; 3], [f64; 3])) -> Option<[f64; 3]> {
    let normal = cross(a.0, b.0);
    let square = dot(normal, normal);
    if square < NEAR * NEAR {
        return None;
    }
    let way = minus(b.1, a.1);
    let far = dot(cross(way, b.0), normal) / square;
    let point = sum(a.1, scaled(a.0, far));
    let other = foot(b.0, b.1, point);
    (length(minus(point, other)) < NEAR).then_some(point)
}

impl Chain<'_> {
    /// The closed form of the positions for a pose of its end, if the arm has one: six joints that turn, each on its own, with
    /// axes of one [`Kind`].
    pub fn closed(&self, coordinates: usize) -> Option<Closed> {
        let moving = self.joints().filter(|joint| joint.motion != Motion::Fixed);
        let moving = moving.map(|joint| match joint.motion {
            Motion::Turns { coordinate, .. } => Some(coordinate),
            _ => None,
        });
        let moving: Vec<usize> = moving.collect::<Option<_>>()?;
        let order: [usize; 6] = moving.try_into().ok()?;
        if self.coordinates().len() != 6 {
            return None;
        }
        let zero = self.moved(&State::still(vec![0.0; coordinates]));
        let tip = zero.pose.translation;
        let columns = order.map(|coordinate| zero.jacobian[coordinate]);
        let ratios = columns.map(|column| length(column.angular));
        if ratios.iter().any(|ratio| !(1e-6..=1e6).contains(ratio)) {
            return None;
        }
        let mut axes = [[0.0; 3]; 6];
        let mut points = [[0.0; 3]; 6];
        for (at, column) in columns.iter().enumerate() {
            axes[at] = clean(scaled(column.angular, 1.0 / ratios[at]));
            let arm = scaled(
                cross(column.angular, column.linear),
                1.0 / (ratios[at] * ratios[at]),
            );
            points[at] = sum(tip, arm);
        }
        let line = |at: usize| (axes[at], points[at]);
        let last = meeting(line(4), line(5))?;
        let meets = |at: usize, point: [f64; 3]| {
            length(minus(foot(axes[at], points[at], point), point)) < NEAR
        };
        let is_wrist = meets(3, last) && !parallel(axes[3], axes[4]);
        let pair = parallel(axes[1], axes[2]) && !parallel(axes[0], axes[1]);
        let crossing = meeting(line(0), line(1));
        let kind = match (is_wrist, pair, crossing) {
            (true, true, _) => Kind::ParallelAndWrist,
            (true, false, Some(_)) => Kind::CrossingAndWrist,
            (false, true, _) if parallel(axes[1], axes[3]) && !parallel(axes[3], axes[4]) => {
                Kind::ThreeParallel
            }
            _ => return None,
        };
        let mut at = [[0.0; 3]; 5];
        at[0] = foot(axes[0], points[0], [0.0; 3]);
        at[1] = foot(axes[1], points[1], at[0]);
        if let (Kind::CrossingAndWrist, Some(point)) = (kind, crossing) {
            (at[0], at[1]) = (point, point);
        }
        at[2] = foot(axes[2], points[2], at[1]);
        at[3] = foot(axes[3], points[3], at[2]);
        at[4] = last;
        let [one, two, three] = zero.pose.rotation;
        Some(Closed {
            kind,
            coordinates: order,
            ratios,
            axes,
            points: at.map(clean),
            rotation: [clean(one), clean(two), clean(three)],
            translation: clean(tip),
            edge: EDGE,
        })
    }
}

impl Closed {
    /// The same with numbers of 32 bits.
    #[must_use]
    pub fn in_single(self) -> Self {
        let edge = EDGE_OF_SINGLE;
        Self { edge, ..self }
    }

    /// The positions of the joints, from the base on, for a pose of the end of the chain. Those that the arm does not have are not
    /// numbers, and some may be equal. Angles are not within limits.
    pub fn positions<T: Real>(&self, rotation: &Matrix<T>, translation: [T; 3]) -> Vec<[T; 6]> {
        let own: Matrix<T> = transposed(&self.rotation).map(|row| row.map(T::constant));
        let whole = product(rotation, &own);
        let wrist = minus(self.translation, self.points[4]);
        let wrist = minus(translation, turned(&whole, vector(wrist)));
        let target = minus(wrist, vector(self.points[0]));
        let angles = match self.kind {
            Kind::ThreeParallel => self.three_parallel(&whole, target),
            Kind::ParallelAndWrist | Kind::CrossingAndWrist => self.with_wrist(&whole, target),
        };
        let scaled =
            |angles: [T; 6]| std::array::from_fn(|at| angles[at] / T::constant(self.ratios[at]));
        angles.into_iter().map(scaled).collect()
    }

    fn step(&self, from: usize, to: usize) -> [f64; 3] {
        clean(minus(self.points[to], self.points[from]))
    }

    /// The turns of joint 3 that bring the point at `arm` as far from axis 2 as `target` is.
    fn elbow<T: Real>(&self, arm: [f64; 3], target: [T; 3]) -> [Turn<T>; 2] {
        let upper = self.step(1, 2);
        let known = dot(upper, upper) + dot(arm, arm);
        let level = (dot(target, target) - T::constant(known)) * T::constant(0.5);
        Turn::to_level(vector(upper), vector(arm), self.axes[2], level, self.edge)
    }

    fn with_wrist<T: Real>(&self, whole: &Matrix<T>, target: [T; 3]) -> Vec<[T; 6]> {
        let [first, second, third, ..] = self.axes;
        let (shoulder, upper, arm) = (self.step(0, 1), self.step(1, 2), self.step(2, 4));
        let mut arms = Vec::new();
        let extended = |three: Turn<T>| sum(vector(upper), three.about(third, vector(arm)));
        if self.kind == Kind::ParallelAndWrist {
            let level = T::constant(dot(second, sum(shoulder, sum(upper, arm))));
            for one in Turn::to_level(vector(second), target, opposite(first), level, self.edge) {
                let rest = minus(one.about(opposite(first), target), vector(shoulder));
                for three in self.elbow(arm, rest) {
                    let two = Turn::aligning(extended(three), rest, second);
                    arms.push([one, two, three]);
                }
            }
        } else {
            for three in self.elbow(arm, target) {
                let reach = extended(three);
                let level = dot(vector(second), reach);
                for one in Turn::to_level(vector(second), target, opposite(first), level, self.edge)
                {
                    let rest = one.about(opposite(first), target);
                    arms.push([one, Turn::aligning(reach, rest, second), three]);
                }
            }
        }
        let mut all = Vec::new();
        for turns in arms {
            // What is left for the wrist, as a function of vectors.
            let left = |of: [f64; 3]| {
                let steps = turns.iter().zip(self.axes);
                steps.fold(turned(whole, vector(of)), |of, (turn, axis)| {
                    turn.about(opposite(axis), of)
                })
            };
            let last = left(self.axes[5]);
            let side = self.side();
            let turned_side = left(side);
            for wrist in self.wrist(last, turned_side, side) {
                let angles = turns.map(Turn::angle);
                all.push([
                    angles[0], angles[1], angles[2], wrist[0], wrist[1], wrist[2],
                ]);
            }
        }
        all
    }

    /// A vector across the last axis.
    fn side(&self) -> [f64; 3] {
        let last = self.axes[5];
        let mut other = [0.0; 3];
        let least = (0..3).min_by(|a, b| last[*a].abs().total_cmp(&last[*b].abs()));
        other[least.unwrap_or(0)] = 1.0;
        let across = cross(last, other);
        clean(scaled(across, 1.0 / length(across)))
    }

    /// The angles of a wrist whose last axis and side shall be there.
    fn wrist<T: Real>(&self, last: [T; 3], side: [T; 3], own: [f64; 3]) -> Vec<[T; 3]> {
        let [_, _, _, four, five, six] = self.axes;
        let level = dot(vector(four), last);
        let turns = Turn::to_level(vector(four), vector(six), five, level, self.edge);
        let angles = turns.into_iter().map(|turn| {
            let before = Turn::aligning(turn.about(five, vector(six)), last, four);
            let rest = turn.about(opposite(five), before.about(opposite(four), side));
            let after = Turn::aligning(vector(own), rest, six);
            [before, turn, after].map(Turn::angle)
        });
        angles.collect()
    }

    fn three_parallel<T: Real>(&self, whole: &Matrix<T>, target: [T; 3]) -> Vec<[T; 6]> {
        let [first, second, third, fourth, fifth, sixth] = self.axes;
        let (shoulder, upper) = (self.step(0, 1), self.step(1, 2));
        let (fore, hand) = (self.step(2, 3), self.step(3, 4));
        let level = dot(second, sum(sum(shoulder, upper), sum(fore, hand)));
        let side = self.side();
        let mut all = Vec::new();
        let ones = Turn::to_level(
            vector(second),
            target,
            opposite(first),
            T::constant(level),
            self.edge,
        );
        for one in ones {
            let back = |of: [T; 3]| one.about(opposite(first), of);
            let last = back(turned(whole, vector(sixth)));
            let fives = Turn::to_level(
                vector(second),
                vector(sixth),
                fifth,
                dot(vector(second), last),
                self.edge,
            );
            for five in fives {
                let three_together = Turn::aligning(five.about(fifth, vector(sixth)), last, second);
                let rest = back(turned(whole, vector(side)));
                let rest = three_together.about(opposite(second), rest);
                let six = Turn::aligning(vector(side), five.about(opposite(fifth), rest), sixth);
                let reach = minus(back(target), vector(shoulder));
                let reach = minus(reach, three_together.about(second, vector(hand)));
                for three in self.elbow(fore, reach) {
                    let arm = sum(vector(upper), three.about(third, vector(fore)));
                    let two = Turn::aligning(arm, reach, second);
                    // Parallel axes may point into opposite directions.
                    let sense = |axis: [f64; 3]| T::constant(dot(axis, second).signum());
                    let (two, three) = (two.angle(), three.angle());
                    let four = three_together.angle() - two - three * sense(third);
                    let four = four * sense(fourth);
                    all.push([one.angle(), two, three, four, five.angle(), six.angle()]);
                }
            }
        }
        all
    }
}
