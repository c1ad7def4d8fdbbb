//! The path of a robot, made of its poses.

use planar_map::Pose;

/// A pose nearer than this to the last kept one adds nothing to a picture, in mm.
const SPACING: f64 = 20.0;

/// The path of a robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    /// The number of poses.
    pub(crate) count: usize,
    /// The length of the path, in mm.
    pub(crate) length: f64,
    /// The last pose.
    pub(crate) last: Option<Pose>,
    /// The poses that a picture shows, each with its number among all poses.
    pub(crate) kept: Vec<(usize, Pose)>,
}

impl Track {
    /// Adds a pose.
    pub(crate) fn add(&mut self, pose: Pose) {
        self.count += 1;
        if let Some(last) = self.last.replace(pose) {
            self.length += last.point().distance_to(pose.point());
        }
        let far = |(_, kept): &(usize, Pose)| kept.point().distance_to(pose.point()) >= SPACING;
        if self.kept.last().is_none_or(far) {
            self.kept.push((self.count, pose));
        }
    }

    /// The length of the path, in m.
    pub(crate) fn metres(&self) -> f64 {
        self.length / 1000.0
    }

    /// The state in one line.
    pub(crate) fn line(&self) -> String {
        let Some(Pose { x, y, heading }) = self.last else {
            return "pose unknown poses=0".to_owned();
        };
        let (metres, count) = (self.metres(), self.count);
        format!("pose x={x:.0} y={y:.0} heading={heading:.2} path={metres:.1} m poses={count}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pose_counts_and_distant_ones_are_kept() {
        let mut track = Track::default();
        assert_eq!(track.line(), "pose unknown poses=0");
        (0..=100).for_each(|step| track.add(Pose::new(f64::from(step) * 8.0, 0.0, 0.5)));
        assert_eq!(
            track.line(),
            "pose x=800 y=0 heading=0.50 path=0.8 m poses=101"
        );
        assert_eq!(track.kept.len(), 34);
        assert_eq!(track.kept[1].0, 4);
    }
}
