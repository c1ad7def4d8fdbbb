//! The tree as its readers and writers share it.

use crate::Time;
use crate::cache::Cache;
use crate::clouds::Clouds;
use crate::edit::Edit;
use crate::error::Error;
use crate::files::{self, Folders, LoadError};
use crate::history::{History, Keep, Moment};
use crate::link::NodeId;
use crate::snapshot::Snapshot;
use arc_swap::ArcSwap;
use innermodel_language::model::Document;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The tree as its readers and writers share it.
#[derive(Debug)]
pub struct InnerModel {
    current: ArcSwap<Snapshot>,
    /// Writers wait for each other; readers never wait.
    history: Mutex<History>,
    pub(crate) clouds: ArcSwap<Clouds>,
}

impl Default for InnerModel {
    fn default() -> Self {
        Self::new()
    }
}

impl InnerModel {
    /// A tree of nothing but its root.
    pub fn new() -> Self {
        Self::of(Snapshot::empty())
    }

    fn of(snapshot: Snapshot) -> Self {
        let first = Arc::new(snapshot);
        Self {
            history: Mutex::new(History::new(Arc::clone(&first))),
            current: ArcSwap::new(first),
            clouds: ArcSwap::default(),
        }
    }

    /// Reads a file with all that it includes. Warnings are dropped: [`read`](crate::read) returns
    /// them, and `rcgen check` shows them.
    pub fn load(path: &Path, folders: &Folders) -> Result<Self, LoadError> {
        let (document, _) = files::read(path, folders)?;
        Ok(Self::from_document(&document)?)
    }

    /// Reads a text that includes no file.
    pub fn parse(text: &str) -> Result<Self, LoadError> {
        let (document, _) = files::parse(text)?;
        Ok(Self::from_document(&document)?)
    }

    /// The tree of a file. Joints are at 0, or at the nearest end of their limits.
    ///
    /// # Errors
    /// The document was made by hand, and is none that a file could say.
    pub fn from_document(document: &Document) -> Result<Self, Error> {
        let model = Self::new();
        model.change(Time::ZERO, |edit| edit.add_document(NodeId::ROOT, document))?;
        // No reader has seen the empty tree.
        let snapshot = Snapshot::clone(&model.snapshot());
        Ok(Self::of(snapshot))
    }

    /// The present version.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        self.current.load_full()
    }

    pub(crate) fn history(&self) -> MutexGuard<'_, History> {
        // A writer that panicked has published nothing.
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes changes, and publishes them as one new version, which was made at `time`. If `make`
    /// fails, nothing has changed. If `time` is before that of the present version, the clock was
    /// set back: later versions leave the history. `make` changes the model by its [`Edit`] alone:
    /// for another change of it, it would wait for itself.
    pub fn change<T, E>(
        &self,
        time: Time,
        make: impl FnOnce(&mut Edit) -> Result<T, E>,
    ) -> Result<T, E> {
        let mut history = self.history();
        let mut next = Snapshot::clone(&self.current.load());
        next.version += 1;
        next.time = time;
        next.open = true;
        let mut edit = Edit { next };
        let result = make(&mut edit)?;
        edit.next.open = false;
        edit.next.links.settle();
        edit.next.data.settle();
        let next = Arc::new(edit.next);
        history.push(Arc::clone(&next));
        self.current.store(next);
        Ok(result)
    }

    /// Replaces the whole tree by that of another version, such as one that was kept.
    pub fn restore(&self, time: Time, to: &Snapshot) {
        let mut history = self.history();
        let mut next = to.clone();
        next.version = self.current.load().version + 1;
        next.time = time;
        next.cache = Arc::new(Cache::new());
        let next = Arc::new(next);
        history.clear();
        history.push(Arc::clone(&next));
        self.current.store(next);
    }

    /// An independent model that starts with the present version. Both share memory for what
    /// neither changes.
    #[must_use]
    pub fn fork(&self) -> Self {
        let mut snapshot = Snapshot::clone(&self.current.load());
        // Versions with one number differ from now on.
        snapshot.cache = Arc::new(Cache::new());
        let fork = Self::of(snapshot);
        fork.clouds.store(self.clouds.load_full());
        fork
    }

    /// How much of the past is kept.
    pub fn keep(&self, keep: Keep) {
        self.history().keep(keep);
    }

    /// The tree as it was at `time`. Between two changes of a node, its place is interpolated.
    ///
    /// # Errors
    /// The history starts after `time`.
    pub fn at(&self, time: Time) -> Result<Moment, Error> {
        self.history().at(time)
    }
}
