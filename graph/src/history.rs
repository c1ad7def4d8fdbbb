//! The graph, and single attributes, at earlier times.

use crate::Time;
use crate::edit::Edit;
use crate::element::Element;
use crate::error::Error;
use crate::names::Symbol;
use crate::snapshot::Snapshot;
use crate::tree::Frame;
use crate::value::Value;
use graph_pages::{Timed, Versions};
pub use innermodel::Keep;
use innermodel::Transform;
use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

impl Timed for Snapshot {
    fn time(&self) -> Time {
        self.time
    }
}

#[derive(Debug)]
pub(crate) struct History(Versions<Snapshot>);

impl History {
    pub(crate) fn new(first: Arc<Snapshot>) -> Self {
        let keep = Keep::default();
        Self(Versions::new(first, keep.versions, keep.duration))
    }

    pub(crate) fn keep(&mut self, keep: Keep) {
        self.0.keep(keep.versions, keep.duration);
    }

    pub(crate) fn push(&mut self, version: Arc<Snapshot>) {
        self.0.push(version);
    }

    pub(crate) fn at(&self, time: Time) -> Result<Arc<Snapshot>, Error> {
        let version = self.0.since(time).and_then(|mut since| since.next());
        version.cloned().ok_or(Error::TooEarly)
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
