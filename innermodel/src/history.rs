//! Where something was at an earlier time.

use crate::error::Error;
use crate::link::{self, NONE, TOP};
use crate::snapshot::{Key, Snapshot};
use crate::transform::Transform;
use crate::{Point, Time};
use graph_pages::{Timed, Versions};
use innermodel_language::model::{Kind, Pose};
use std::sync::Arc;
use std::time::Duration;

/// How much of the past is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keep {
    /// At most so many versions.
    pub versions: usize,
    /// No version that is older than the present one by more.
    pub duration: Duration,
    /// A node moved between two changes if these are so near to each other; otherwise it stood
    /// still until the second one.
    pub gap: Duration,
}

impl Default for Keep {
    fn default() -> Self {
        Self {
            versions: 1024,
            duration: Duration::from_secs(10),
            gap: Duration::from_secs(1),
        }
    }
}

impl Timed for Snapshot {
    fn time(&self) -> Time {
        self.time
    }
}

#[derive(Debug)]
pub(crate) struct History {
    gap: Duration,
    versions: Versions<Snapshot>,
}

impl History {
    pub(crate) fn new(first: Arc<Snapshot>) -> Self {
        let keep = Keep::default();
        Self {
            gap: keep.gap,
            versions: Versions::new(first, keep.versions, keep.duration),
        }
    }

    pub(crate) fn keep(&mut self, keep: Keep) {
        self.gap = keep.gap;
        self.versions.keep(keep.versions, keep.duration);
    }

    pub(crate) fn clear(&mut self) {
        self.versions.clear();
    }

    pub(crate) fn push(&mut self, version: Arc<Snapshot>) {
        self.versions.push(version);
    }

    pub(crate) fn at(&self, time: Time) -> Result<Moment, Error> {
        let Some(since) = self.versions.since(time) else {
            let first = self.versions.start();
            return Err(Error::TooEarly { first });
        };
        let end = time.saturating_add(self.gap);
        let near = since.take_while(|version| version.time <= end);
        Ok(Moment {
            time,
            gap: self.gap,
            versions: near.cloned().collect(),
        })
    }
}

/// The tree at one time of the past.
#[derive(Clone, Debug)]
pub struct Moment {
    time: Time,
    gap: Duration,
    /// The version at that time, and those that follow within the gap.
    versions: Vec<Arc<Snapshot>>,
}

impl Moment {
    /// The version at that time, without interpolation.
    pub fn version(&self) -> &Arc<Snapshot> {
        &self.versions[0]
    }

    /// The transform that takes coordinates in `from` to those in `to`.
    pub fn between(&self, to: impl Key, from: impl Key) -> Result<Transform, Error> {
        let tree = self.version();
        let (to, from) = (tree.place(to)?, tree.place(from)?);
        Ok(self.to_root(to).inverse() * self.to_root(from))
    }

    /// The coordinates in `to` of a point with these coordinates in `from`.
    pub fn transform(&self, to: impl Key, point: Point, from: impl Key) -> Result<Point, Error> {
        Ok(self.between(to, from)?.point(&point))
    }

    /// The pose of `from` in `to`.
    pub fn pose(&self, to: impl Key, from: impl Key) -> Result<Pose, Error> {
        Ok(self.between(to, from)?.pose())
    }

    fn to_root(&self, place: u32) -> Transform {
        let mut transform = Transform::identity();
        let mut place = place;
        while place != TOP && place != NONE {
            let Some(link) = self.version().link(place) else {
                break;
            };
            transform = self.local(place) * transform;
            place = link.parent;
        }
        transform
    }

    /// Takes coordinates in a node to those in its parent.
    fn local(&self, place: u32) -> Transform {
        let Some(now) = self.version().link(place) else {
            return Transform::identity();
        };
        let same = |version: &Arc<Snapshot>| {
            let link = version.link(place);
            link.is_some_and(|link| link.version == now.version)
        };
        let next = self.versions.partition_point(same);
        let next = self
            .versions
            .get(next)
            .and_then(|version| version.link(place));
        let Some(next) = next else {
            return now.local;
        };
        let took = next.time.saturating_sub(now.time);
        let elsewhere = next.generation != now.generation || next.parent != now.parent;
        if elsewhere || took > self.gap || took.is_zero() {
            return now.local;
        }
        let past = self.time.saturating_sub(now.time);
        let t = past.as_secs_f64() / took.as_secs_f64();
        let kind = self.version().data(place).map(|data| &*data.kind);
        match kind {
            // A joint turns about its axis, also by more than half a turn.
            Some(kind @ (Kind::Joint(_) | Kind::Prismatic(_))) if now.pose == next.pose => {
                let position = now.position + (next.position - now.position) * t;
                link::local(kind, &now.pose, position)
            }
            _ => now.local.between(&next.local, t),
        }
    }
}
