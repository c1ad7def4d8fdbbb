//! The changes since a reader last looked.

use crate::rights::type_of;
use property_graph::{Change, Element, Snapshot, Symbol};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The changes between two versions.
#[derive(Clone, Debug)]
pub struct News {
    /// The earlier version.
    pub before: Arc<Snapshot>,
    /// The later version.
    pub after: Arc<Snapshot>,
    /// All differences.
    pub changes: Vec<Change>,
}

/// The changes of one type, and of those that inherit from it. Added elements are not also changed.
#[derive(Clone, Debug, Default)]
pub struct NewsOf {
    /// New elements, of the later version.
    pub added: Vec<Element>,
    /// Elements with other attributes, and which these are.
    pub changed: BTreeMap<Element, Vec<Symbol>>,
    /// Removed elements, of the earlier version.
    pub removed: Vec<Element>,
}

impl NewsOf {
    /// Whether nothing has changed.
    pub fn is_empty(&self) -> bool {
        self.added.is_empty() && self.changed.is_empty() && self.removed.is_empty()
    }
}

impl News {
    /// The changes of a type, and of those that inherit from it.
    pub fn of(&self, kind: &str) -> NewsOf {
        let mut news = NewsOf::default();
        let is_wanted = |of: &Snapshot, element: Element| {
            let own = type_of(of, element);
            own.is_ok_and(|own| of.schema().is_a(own, kind))
        };
        for change in &self.changes {
            match change {
                Change::NodeRemoved(node, _) => {
                    let gone = Element::Node(*node);
                    news.removed
                        .extend(is_wanted(&self.before, gone).then_some(gone));
                }
                Change::EdgeRemoved(edge, _) => {
                    let gone = Element::Edge(*edge);
                    news.removed
                        .extend(is_wanted(&self.before, gone).then_some(gone));
                }
                Change::NodeAdded(node) => {
                    let new = Element::Node(*node);
                    news.added
                        .extend(is_wanted(&self.after, new).then_some(new));
                }
                Change::EdgeAdded(edge) => {
                    let new = Element::Edge(*edge);
                    news.added
                        .extend(is_wanted(&self.after, new).then_some(new));
                }
                Change::Attribute(element, symbol) => {
                    if is_wanted(&self.after, *element) {
                        news.changed.entry(*element).or_default().push(*symbol);
                    }
                }
            }
        }
        news
    }
}

/// Remembers which version somebody has seen.
#[derive(Clone, Debug)]
pub struct Reader {
    pub(crate) seen: Arc<Snapshot>,
}

impl Reader {
    /// The changes until this version since the last call. `None` if there are none.
    pub(crate) fn until(&mut self, now: Arc<Snapshot>) -> Option<News> {
        if now.version() == self.seen.version() {
            return None;
        }
        let before = std::mem::replace(&mut self.seen, Arc::clone(&now));
        let changes = now.since(&before);
        (!changes.is_empty()).then_some(News {
            before,
            after: now,
            changes,
        })
    }
}
