//! The graph, and single attributes, at earlier times.

use crate::Time;
use crate::edit::Edit;
use crate::element::Element;
use crate::error::Error;
use crate::names::Symbol;
use crate::snapshot::Snapshot;
use crate::tree::Frame;
use crate::value::Value;
pub use innermodel::Keep;
use innermodel::Transform;
use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

#[derive(Debug)]
pub(crate) struct History {
    keep: Keep,
    versions: VecDeque<Arc<Snapshot>>,
}

impl History {
    pub(crate) fn new(first: Arc<Snapshot>) -> Self {
        Self {
            keep: Keep::default(),
            versions: VecDeque::from([first]),
        }
    }

    pub(crate) fn keep(&mut self, keep: Keep) {
        self.keep = keep;
        self.forget();
    }

    pub(crate) fn push(&mut self, version: Arc<Snapshot>) {
        while self
            .versions
            .back()
            .is_some_and(|last| last.time > version.time)
        {
            self.versions.pop_back();
        }
        self.versions.push_back(version);
        self.forget();
    }

    fn forget(&mut self) {
        let Some(now) = self.versions.back().map(|last| last.time) else {
            return;
        };
        let start = now.saturating_sub(self.keep.duration);
        // The version before the start holds at the start.
        while self.versions.len() > self.keep.versions.max(1)
            || self
                .versions
                .get(1)
                .is_some_and(|second| second.time <= start)
        {
            self.versions.pop_front();
        }
    }

    pub(crate) fn at(&self, time: Time) -> Result<Arc<Snapshot>, Error> {
        let after = self
            .versions
            .partition_point(|version| version.time <= time);
        let before = after.checked_sub(1).ok_or(Error::TooEarly)?;
        Ok(Arc::clone(&self.versions[before]))
    }
}

/// The graph at one time of the past.
#[derive(Clone, Debug)]
pub struct Moment {
    pub(crate) version: Arc<Snapshot>,
    pub(crate) tree: innermodel::Moment,
}

impl Moment {
    /// The version at that time, without interpolation.
    pub fn version(&self) -> &Arc<Snapshot> {
        &self.version
    }

    /// The transform that takes coordinates in `from` to those in `to`, at that time. Between two
    /// changes of a pose, it is interpolated.
    pub fn between(&self, to: Frame, from: Frame) -> Result<Transform, Error> {
        self.version.between(to, from)?;
        Ok(self.tree.between(to.0, from.0)?)
    }
}

/// How many values of one attribute are kept at most.
const MOST_VALUES: usize = 1024;

/// Earlier values of attributes.
#[derive(Debug, Default)]
pub(crate) struct Rings {
    rings: HashMap<(Element, Symbol), VecDeque<(Time, Value)>>,
    /// At so many rings, those of removed elements go.
    limit: usize,
}

impl Rings {
    /// Keeps the values that a change has set.
    pub(crate) fn push(&mut self, edit: &Edit) {
        let (next, time) = (&edit.next, edit.next.time);
        for (element, attribute) in &edit.kept {
            let Ok(kind) = next.kind(*element) else {
                self.rings.remove(&(*element, *attribute));
                continue;
            };
            let described = next.types.attribute(kind, *attribute);
            let Some(duration) = described.and_then(|attribute| attribute.history) else {
                continue;
            };
            let Some(value) = next.get(*element, *attribute) else {
                continue;
            };
            let ring = self.rings.entry((*element, *attribute)).or_default();
            // The clock was set back, or the change has set the value several times.
            while ring.back().is_some_and(|(last, _)| *last >= time) {
                ring.pop_back();
            }
            ring.push_back((time, value.clone()));
            let start = time.saturating_sub(duration);
            while ring.len() > MOST_VALUES || ring.get(1).is_some_and(|(t, _)| *t <= start) {
                ring.pop_front();
            }
        }
        if self.rings.len() > self.limit {
            self.rings
                .retain(|(element, _), _| next.kind(*element).is_ok());
            self.limit = self.rings.len() * 2 + 1024;
        }
    }

    pub(crate) fn get(&self, element: Element, attribute: Symbol) -> Vec<(Time, Value)> {
        let ring = self.rings.get(&(element, attribute));
        ring.into_iter().flatten().cloned().collect()
    }
}
