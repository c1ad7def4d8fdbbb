//! The graph as its readers and writers share it.

use crate::Time;
use crate::adopt;
use crate::check;
use crate::edit::Edit;
use crate::element::Element;
use crate::error::Error;
use crate::history::{History, Keep, Moment, Rings};
use crate::names::Named;
use crate::snapshot::Snapshot;
use crate::tree;
use crate::value::Value;
use arc_swap::ArcSwap;
use graph_schema::Schema;
use innermodel::InnerModel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The graph as its readers and writers share it.
#[derive(Debug)]
pub struct Graph {
    current: ArcSwap<Snapshot>,
    /// Writers wait for each other; readers never wait.
    writing: Mutex<()>,
    tree: InnerModel,
    /// Held for a moment only, never while a change is made.
    history: Mutex<History>,
    rings: Mutex<Rings>,
}

impl Graph {
    /// An empty graph. The number of the writer is part of the ids that it makes: two writers of
    /// one graph need different ones.
    pub fn new(schema: Arc<Schema>, writer: u64) -> Self {
        Self::of(Snapshot::empty(schema, writer), InnerModel::new())
    }

    fn of(snapshot: Snapshot, tree: InnerModel) -> Self {
        let first = Arc::new(snapshot);
        Self {
            history: Mutex::new(History::new(Arc::clone(&first))),
            current: ArcSwap::new(first),
            writing: Mutex::new(()),
            tree,
            rings: Mutex::new(Rings::default()),
        }
    }

    /// The present version.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        self.current.load_full()
    }

    fn writing(&self) -> MutexGuard<'_, ()> {
        // A writer that panicked has published nothing.
        self.writing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn history(&self) -> MutexGuard<'_, History> {
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn rings(&self) -> MutexGuard<'_, Rings> {
        self.rings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes changes, checks them against the schema, and publishes them as one new version, which
    /// was made at `time`. If `make` fails, or the check does, nothing has changed. If `time` is
    /// before that of the present version, the clock was set back: later versions leave the
    /// history. `make` changes the graph by its [`Edit`] alone: for another change of it, it would
    /// wait for itself.
    pub fn change<T, E: From<Error>>(
        &self,
        time: Time,
        make: impl FnOnce(&mut Edit) -> Result<T, E>,
    ) -> Result<T, E> {
        let _alone = self.writing();
        let before = self.current.load();
        let mut next = Snapshot::clone(&before);
        next.version += 1;
        next.time = time;
        let mut edit = Edit::new(next);
        let result = make(&mut edit)?;
        check::check(&mut edit, &before)?;
        tree::apply(&mut edit, &self.tree, time)?;
        if !edit.kept.is_empty() {
            self.rings().push(&edit);
        }
        edit.note_touched(&before);
        edit.next.settle();
        let next = Arc::new(edit.next);
        self.current.store(Arc::clone(&next));
        self.history().push(next);
        Ok(result)
    }

    /// An independent graph that starts with the present version. Both share memory for what
    /// neither changes. Its ids have the number of another writer.
    #[must_use]
    pub fn fork(&self, writer: u64) -> Self {
        let alone = self.writing();
        let mut snapshot = Snapshot::clone(&self.current.load());
        let tree = self.tree.fork();
        drop(alone);
        snapshot.tree = tree.snapshot();
        if snapshot.shape.writer != writer {
            let shape = Arc::make_mut(&mut snapshot.shape);
            shape.writer = writer;
            shape.next = 1;
        }
        Self::of(snapshot, tree)
    }

    /// Makes this graph equal to a version of another one, in one change at `time`: a replica, or a
    /// file that was read again. Elements are identified by their ids. Equal elements stay as they
    /// are, with their history and their place, so that [`NodeId`](crate::NodeId)s remain valid;
    /// the present version stays if all are equal. The schemas need not be equal.
    ///
    /// # Errors
    /// The schema of this graph does not allow what the other one holds, also two attributes that are one
    /// value here ([`Error::SaidTwice`]), or the change would have too many steps ([`Error::TooLarge`]).
    /// Nothing has changed then.
    pub fn adopt(&self, time: Time, wanted: &Snapshot) -> Result<(), Error> {
        match self.change(time, |edit| adopt::adopt(edit, wanted)) {
            Ok(()) | Err(adopt::Refused::Equal) => Ok(()),
            Err(adopt::Refused::Wrong(error)) => Err(error),
        }
    }

    /// How much of the past is kept.
    pub fn keep(&self, keep: Keep) {
        self.tree.keep(keep);
        self.history().keep(keep);
    }

    /// The graph as it was at `time`. Between two changes of a pose, it is interpolated.
    ///
    /// # Errors
    /// The history starts after `time`.
    pub fn at(&self, time: Time) -> Result<Moment, Error> {
        let version = self.history().at(time)?;
        let tree = self.tree.at(time)?;
        Ok(Moment { version, tree })
    }

    /// The values of an attribute that the schema keeps, with the times at which they were set,
    /// oldest first.
    pub fn history_of(
        &self,
        element: impl Into<Element>,
        attribute: impl Named,
    ) -> Vec<(Time, Value)> {
        let snapshot = self.current.load();
        let Some(attribute) = snapshot.symbol(attribute) else {
            return Vec::new();
        };
        self.rings().get(element.into(), attribute)
    }
}
