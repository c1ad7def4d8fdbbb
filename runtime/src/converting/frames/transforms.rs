//! Transforms between frames over time, as those of tf.

use rc_conversion::Transform;
use rc_diagnostics::foreign::clean;
use rc_quantity::rotation::{Quaternion, turned};
use std::collections::{BTreeMap, VecDeque};
use std::fmt;

/// How long a transform is kept before the newest one of its frame, as in tf2: 10 s, in
/// nanoseconds.
const KEPT: i64 = 10_000_000_000;
/// The most frames of a history, and the most transforms of all of them.
pub(super) const MOST_FRAMES: usize = 4096;
const MOST: usize = 100_000;
/// The most transforms of one frame: 10 s at 1 kHz.
const MOST_OF_FRAME: usize = 10_000;
/// The most frames from one to its root. A message visits all of them.
const DEEPEST: usize = 256;
/// One of this many transforms without room searches for frames to forget.
const LOOK: usize = 64;
/// The longest name of a frame, in bytes.
const LONGEST: usize = 256;
/// How far the norm of a quaternion may be from 1, as in tf2.
const TOLERANCE: f64 = 0.01;

/// The pose of a frame in its parent, in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    turn: Quaternion,
    place: [f64; 3],
}

/// The transforms of one frame.
#[derive(Debug)]
struct Edge {
    parent: String,
    /// With their times in nanoseconds, which grow.
    poses: VecDeque<(i64, Pose)>,
}

/// The received transforms of a slot.
#[derive(Debug, Default)]
pub(crate) struct History {
    edges: BTreeMap<String, Edge>,
    /// The number of poses.
    count: usize,
    /// How many transforms found no room.
    refused: usize,
    /// Whether transforms hold for all times, as those of `/tf_static`.
    pub(super) is_constant: bool,
}

/// Why a transform is not known.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::converting) enum Missing {
    /// Nothing is known about this frame.
    Unknown(String),
    /// No chain of transforms connects the frames.
    Unconnected,
    /// The frames form a circle, or are too many.
    Circle,
    /// The newest transform of the frame is of this time, in nanoseconds.
    Newer(String, i64),
    /// The oldest one that is kept is of this time.
    Older(String, i64),
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(frame) => write!(f, "no transform of `{}` has come", clean(frame)),
            Self::Unconnected => f.write_str("no chain of transforms connects them"),
            Self::Circle => write!(
                f,
                "their transforms form a cycle, or a chain of more than {DEEPEST} frames"
            ),
            Self::Newer(frame, time) => {
                let frame = clean(frame);
                write!(f, "the newest transform of `{frame}` is of {time} ns")
            }
            Self::Older(frame, time) => {
                let frame = clean(frame);
                write!(f, "the oldest transform of `{frame}` is of {time} ns")
            }
        }
    }
}

impl Pose {
    /// From a message. `None` if it is not a pose.
    pub(super) fn new(place: [f64; 3], xyzw: [f64; 4]) -> Option<Self> {
        let turn = Quaternion::xyzw(xyzw).unit(TOLERANCE).ok()?;
        let is_finite = place.iter().all(|length| length.is_finite());
        is_finite.then_some(Self { turn, place })
    }

    const IDENTITY: Self = Self {
        turn: Quaternion::xyzw([0.0, 0.0, 0.0, 1.0]),
        place: [0.0; 3],
    };

    /// The pose of what has the pose `inner` in this frame.
    fn times(&self, inner: &Self) -> Self {
        let by = turned(&self.turn.matrix(), inner.place);
        let [ax, ay, az, aw] = self.turn.to_xyzw();
        let [bx, by_, bz, bw] = inner.turn.to_xyzw();
        Self {
            turn: Quaternion::xyzw([
                aw * bx + ax * bw + ay * bz - az * by_,
                aw * by_ - ax * bz + ay * bw + az * bx,
                aw * bz + ax * by_ - ay * bx + az * bw,
                aw * bw - ax * bx - ay * by_ - az * bz,
            ]),
            place: [0, 1, 2].map(|at| self.place[at] + by[at]),
        }
    }

    fn inverse(&self) -> Self {
        let [x, y, z, w] = self.turn.to_xyzw();
        let turn = Quaternion::xyzw([-x, -y, -z, w]);
        let place = turned(&turn.matrix(), self.place).map(|length| -length);
        Self { turn, place }
    }

    /// The pose between this one (0) and another one (1): a straight line, and a turn about one axis.
    fn towards(&self, other: &Self, part: f64) -> Self {
        let (a, mut b) = (self.turn.to_xyzw(), other.turn.to_xyzw());
        let mut cosine: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
        if cosine < 0.0 {
            // An equal rotation, on the shorter way.
            b = b.map(|part| -part);
            cosine = -cosine;
        }
        let angle = cosine.min(1.0).acos();
        let (one, two) = if angle < 1e-9 {
            (1.0 - part, part)
        } else {
            let of = |part: f64| (part * angle).sin() / angle.sin();
            (of(1.0 - part), of(part))
        };
        let turn = [0, 1, 2, 3].map(|at| one * a[at] + two * b[at]);
        let norm = turn.iter().map(|part| part * part).sum::<f64>().sqrt();
        let place = |at: usize| self.place[at] + part * (other.place[at] - self.place[at]);
        Self {
            turn: Quaternion::xyzw(turn.map(|part| part / norm)),
            place: [0, 1, 2].map(place),
        }
    }

    fn transform(&self) -> Transform {
        let turn = self.turn.matrix();
        let mut numbers = [0.0; 12];
        let (rows, _) = numbers.as_chunks_mut::<4>();
        for (row, ([x, y, z], by)) in rows.iter_mut().zip(turn.iter().zip(self.place)) {
            *row = [*x, *y, *z, by];
        }
        numbers
    }
}

/// The name of a frame as tf2 compares it.
fn plain(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl History {
    /// Takes the pose of a frame in its parent at a time. One that is too old or too far ahead of the
    /// time now, or has no fitting name, is left out.
    pub(super) fn put(
        &mut self,
        (parent, child): (&str, &str),
        (time, now): (i64, i64),
        pose: Pose,
    ) {
        let (parent, child) = (plain(parent), plain(child));
        let fits = |name: &str| !name.is_empty() && name.len() <= LONGEST;
        // One that is further ahead would make all later ones too old.
        let last = now.saturating_add(KEPT);
        let is_ahead = !self.is_constant && time > last;
        if parent == child || !fits(parent) || !fits(child) || is_ahead {
            return;
        }
        if !self.edges.contains_key(child) {
            if !self.has_room(now) {
                return;
            }
            let edge = Edge {
                parent: parent.to_owned(),
                poses: VecDeque::new(),
            };
            self.edges.insert(child.to_owned(), edge);
        }
        let Some(edge) = self.edges.get_mut(child) else {
            return;
        };
        // Simulated time may begin again.
        let is_past = edge.poses.back().is_some_and(|(newest, _)| *newest > last);
        if edge.parent != parent || self.is_constant || is_past {
            self.count -= edge.poses.len();
            edge.poses.clear();
            parent.clone_into(&mut edge.parent);
        }
        let newest = edge.poses.back().map_or(time, |(newest, _)| *newest);
        if time < newest.saturating_sub(KEPT) {
            return;
        }
        let at = edge.poses.partition_point(|(other, _)| *other < time);
        if let Some((_, known)) = edge.poses.get_mut(at).filter(|(other, _)| *other == time) {
            *known = pose;
        } else {
            edge.poses.insert(at, (time, pose));
            self.count += 1;
        }
        let newest = newest.max(time);
        while edge.poses.len() > 1
            && (self.count > MOST
                || edge.poses.len() > MOST_OF_FRAME
                || edge.poses[0].0 < newest.saturating_sub(KEPT))
        {
            edge.poses.pop_front();
            self.count -= 1;
        }
    }

    /// Makes room for a further frame: forgets those that have no transform of the last seconds.
    /// Returns whether there is room.
    fn has_room(&mut self, now: i64) -> bool {
        if self.edges.len() >= MOST_FRAMES && self.refused.is_multiple_of(LOOK) && !self.is_constant
        {
            let oldest = now.saturating_sub(KEPT);
            self.edges.retain(|_, edge| {
                let newest = edge.poses.back();
                newest.is_some_and(|(newest, _)| *newest >= oldest)
            });
            self.count = self.edges.values().map(|edge| edge.poses.len()).sum();
        }
        let has_room = self.edges.len() < MOST_FRAMES;
        self.refused += usize::from(!has_room);
        has_room
    }

    /// The pose of a frame in its parent at a time.
    fn pose(&self, frame: &str, edge: &Edge, time: i64) -> Result<Pose, Missing> {
        let poses = &edge.poses;
        let (Some((oldest, _)), Some((newest, last))) = (poses.front(), poses.back()) else {
            return Err(Missing::Unknown(frame.to_owned()));
        };
        if self.is_constant {
            return Ok(*last);
        }
        if time > *newest {
            return Err(Missing::Newer(frame.to_owned(), *newest));
        }
        if time < *oldest {
            return Err(Missing::Older(frame.to_owned(), *oldest));
        }
        let at = poses.partition_point(|(other, _)| *other < time);
        let (after, next) = &poses[at];
        if *after == time {
            return Ok(*next);
        }
        let (before, previous) = &poses[at - 1];
        #[expect(
            clippy::cast_precision_loss,
            reason = "the times of a history differ by 10 s at most"
        )]
        let part = (time - before) as f64 / (after - before) as f64;
        Ok(previous.towards(next, part))
    }
}

/// The edge of a frame, in the first history that has one.
fn edge<'h>(histories: &[&'h History], frame: &str) -> Option<(&'h History, &'h Edge)> {
    let mut all = histories.iter();
    all.find_map(|history| Some((*history, history.edges.get(frame)?)))
}

/// The frames from this one up to a root, with it.
fn ancestors<'h>(histories: &[&'h History], frame: &'h str) -> Result<Vec<&'h str>, Missing> {
    let mut all = vec![frame];
    let mut last = frame;
    while let Some((_, edge)) = edge(histories, last) {
        if all.len() > DEEPEST {
            return Err(Missing::Circle);
        }
        last = &edge.parent;
        all.push(last);
    }
    Ok(all)
}

/// The transform that takes coordinates in one frame to those in another one, at a time.
pub(super) fn lookup(
    histories: &[&History],
    (from, to): (&str, &str),
    time: i64,
) -> Result<Transform, Missing> {
    let (from, to) = (plain(from), plain(to));
    let (down, up) = (ancestors(histories, from)?, ancestors(histories, to)?);
    let places: BTreeMap<&str, usize> = up.iter().copied().zip(0..).collect();
    let Some((steps, common)) = down
        .iter()
        .enumerate()
        .find_map(|(at, frame)| Some((at, *places.get(frame)?)))
    else {
        let is_parent = |frame: &str| {
            let mut edges = histories.iter().flat_map(|history| history.edges.values());
            edges.any(|edge| edge.parent == frame)
        };
        let alone = [(from, &down), (to, &up)];
        let mut unknown = alone.iter().filter(|(_, all)| all.len() == 1);
        let unknown = unknown.find(|(frame, _)| !is_parent(frame));
        return Err(unknown.map_or(Missing::Unconnected, |(frame, _)| {
            Missing::Unknown((*frame).to_owned())
        }));
    };
    let pose = |frames: &[&str]| {
        frames.iter().try_fold(Pose::IDENTITY, |inner, frame| {
            let (history, edge) =
                edge(histories, frame).ok_or_else(|| Missing::Unknown((*frame).to_owned()))?;
            Ok::<_, Missing>(history.pose(frame, edge, time)?.times(&inner))
        })
    };
    let (from, to) = (pose(&down[..steps])?, pose(&up[..common])?);
    Ok(to.inverse().times(&from).transform())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(place: [f64; 3], xyzw: [f64; 4]) -> Pose {
        Pose::new(place, xyzw).expect("a pose")
    }

    /// A turn about z by these degrees.
    fn left(degrees: f64) -> [f64; 4] {
        let half = degrees.to_radians() / 2.0;
        [0.0, 0.0, half.sin(), half.cos()]
    }

    /// Where a point is.
    fn point(transform: &Transform, point: [f64; 3]) -> [f64; 3] {
        let (rows, _) = transform.as_chunks::<4>();
        [0, 1, 2].map(|at| {
            let [x, y, z, by] = rows[at];
            let sum = x * point[0] + y * point[1] + z * point[2] + by;
            (sum * 1e9).round() / 1e9
        })
    }

    /// A robot that drives from the origin to 2 m ahead within a second and turns by 90°, with a
    /// lidar 1 m above and 1 m ahead of it, and a map next to odom.
    fn histories() -> [History; 2] {
        let (mut moving, mut constant) = (History::default(), History::default());
        constant.is_constant = true;
        let second = 1_000_000_000;
        moving.put(("odom", "/base"), (0, 0), pose([0.0; 3], left(0.0)));
        moving.put(
            ("odom", "base"),
            (second, second),
            pose([2.0, 0.0, 0.0], left(90.0)),
        );
        constant.put(("base", "lidar"), (7, 0), pose([1.0, 0.0, 1.0], left(0.0)));
        constant.put(("odom", "map"), (0, 0), pose([0.0, -5.0, 0.0], left(180.0)));
        [moving, constant]
    }

    #[test]
    fn a_transform_is_that_of_its_time_over_all_frames() {
        let [moving, constant] = &histories();
        let both = [moving, constant];
        let at =
            |time: i64| lookup(&both, ("lidar", "odom"), time).map(|t| point(&t, [1.0, 0.0, 0.0]));
        assert_eq!(at(0), Ok([2.0, 0.0, 1.0]));
        assert_eq!(at(1_000_000_000), Ok([2.0, 2.0, 1.0]));
        // In the middle, it is 1 m ahead and looks to the left by 45°.
        let half = 2.0 * std::f64::consts::FRAC_1_SQRT_2;
        let rounded = |number: f64| (number * 1e9).round() / 1e9;
        assert_eq!(
            at(500_000_000),
            Ok([rounded(1.0 + half), rounded(half), 1.0])
        );
        let map = lookup(&both, ("/lidar", "map"), 0).map(|t| point(&t, [1.0, 0.0, 0.0]));
        assert_eq!(map, Ok([-2.0, -5.0, 1.0]));
        let back = lookup(&both, ("map", "lidar"), 0).map(|t| point(&t, [-2.0, -5.0, 1.0]));
        assert_eq!(back, Ok([1.0, 0.0, 0.0]));
        let own = lookup(&both, ("lidar", "lidar"), 5).map(|t| point(&t, [3.0, 4.0, 5.0]));
        assert_eq!(own, Ok([3.0, 4.0, 5.0]));
    }

    #[test]
    fn what_is_not_known_is_said() {
        let [moving, constant] = &histories();
        let both = [moving, constant];
        let missing = |from: &str, to: &str, time: i64| {
            lookup(&both, (from, to), time).expect_err("no transform")
        };
        let base = "base".to_owned();
        assert_eq!(missing("lidar", "map", -1), Missing::Older(base.clone(), 0));
        let newest = 1_000_000_000;
        assert_eq!(
            missing("lidar", "map", newest + 1),
            Missing::Newer(base, newest)
        );
        assert_eq!(
            missing("lidar", "camera", 0),
            Missing::Unknown("camera".to_owned())
        );
        let mut circle = History::default();
        circle.put(("a", "b"), (0, 0), Pose::IDENTITY);
        circle.put(("b", "a"), (0, 0), Pose::IDENTITY);
        circle.put(("c", "d"), (0, 0), Pose::IDENTITY);
        assert_eq!(lookup(&[&circle], ("a", "d"), 0), Err(Missing::Circle));
        assert_eq!(
            lookup(&[moving, &circle], ("d", "base"), 0),
            Err(Missing::Unconnected)
        );
    }

    #[test]
    fn a_chain_has_a_longest_length() {
        let mut history = History::default();
        for frame in 1..MOST_FRAMES {
            let (parent, child) = (format!("f{}", frame - 1), format!("f{frame}"));
            history.put((&parent, &child), (0, 0), Pose::IDENTITY);
        }
        let from = |frame: usize| lookup(&[&history], (&format!("f{frame}"), "f0"), 0).map(|_| ());
        assert_eq!(from(DEEPEST), Ok(()));
        assert_eq!(from(DEEPEST + 1), Err(Missing::Circle));
        assert_eq!(from(MOST_FRAMES - 1), Err(Missing::Circle));
    }

    #[test]
    fn a_history_has_bounds() {
        let mut history = History::default();
        let now = 19_000_000_000;
        for time in 0..20 {
            history.put(("map", "base"), (time * 1_000_000_000, now), Pose::IDENTITY);
        }
        assert_eq!(history.count, 11);
        history.put(("map", "base"), (0, now), Pose::IDENTITY);
        history.put(("map", "base"), (now, now), Pose::IDENTITY);
        assert_eq!(history.count, 11);
        // One far ahead makes no later one too old.
        history.put(("map", "base"), (now + KEPT + 1, now), Pose::IDENTITY);
        assert_eq!(history.count, 11);
        // A frame that moves to another parent begins a new history.
        history.put(("odom", "base"), (20_000_000_000, now), Pose::IDENTITY);
        assert_eq!(history.count, 1);
        // So does a frame in simulated time that begins again.
        history.put(("odom", "base"), (21_000_000_000, now), Pose::IDENTITY);
        history.put(("odom", "base"), (5, 5), Pose::IDENTITY);
        assert_eq!(history.count, 1);
        for (parent, child) in [("", "a"), ("a", "/a"), ("map", &*"a".repeat(257))] {
            history.put((parent, child), (0, 0), Pose::IDENTITY);
        }
        assert_eq!(history.edges.len(), 1);
        for frame in 0..2 * MOST_FRAMES {
            history.put(("map", &format!("f{frame}")), (0, 0), Pose::IDENTITY);
        }
        assert_eq!(history.edges.len(), MOST_FRAMES);
        // Names that change, such as those of detected objects, take the places of old ones.
        let later = 30 * KEPT;
        for _ in 0..LOOK {
            history.put(("map", "later"), (later, later), Pose::IDENTITY);
        }
        assert_eq!((history.edges.len(), history.count), (1, 1));
        let found = lookup(&[&history], ("later", "map"), later);
        assert_eq!(found, Ok(Pose::IDENTITY.transform()));
        for time in 0..2_000_i64 {
            for frame in 0..100 {
                history.put(("map", &format!("f{frame}")), (time, time), Pose::IDENTITY);
            }
        }
        assert!(history.count <= MOST + MOST_FRAMES, "{}", history.count);
        let mut fast = History::default();
        for time in 0..2 * MOST_OF_FRAME as i64 {
            fast.put(("map", "fast"), (time, time), Pose::IDENTITY);
        }
        assert_eq!(fast.count, MOST_OF_FRAME);
        assert!(Pose::new([0.0; 3], [0.0; 4]).is_none());
        assert!(Pose::new([f64::NAN, 0.0, 0.0], left(0.0)).is_none());
    }
}
