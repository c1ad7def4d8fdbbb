//! Kills the orphans of components before they restart.
//!
//! A separate thread searches, because it reads the environment of all processes: one that hangs in
//! the kernel may block the reader. docs/decisions/orphans.md says how orphans are found. One search serves all components that ended before it began.

use crate::process::identity::Mark;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a restart waits for the search.
const PATIENCE: Duration = Duration::from_secs(1);
/// The time between two checks whether a search is done.
const LOOK: Duration = Duration::from_millis(5);

/// The search in progress, and the components that wait for the next one.
#[derive(Debug, Default)]
pub(crate) struct OrphanSweeps {
    running: Option<Sweep>,
    waiting: Vec<Ended>,
}

#[derive(Debug)]
struct Sweep {
    /// Ends with the number of killed processes of each component.
    thread: JoinHandle<Vec<usize>>,
    ended: Vec<Ended>,
}

/// A component that has ended.
#[derive(Debug)]
struct Ended {
    component: String,
    mark: Mark,
    run: String,
    patience: Instant,
}

impl OrphanSweeps {
    /// Begins to kill the orphans of this run of a component of the network with `mark`.
    pub(crate) fn begin(&mut self, component: &str, mark: &Mark, run: String) {
        self.waiting.push(Ended {
            component: component.to_owned(),
            mark: mark.clone(),
            run,
            patience: Instant::now() + PATIENCE,
        });
        self.advance();
    }

    /// Starts the next search. If no thread can start, orphans are killed when the network ends.
    fn advance(&mut self) {
        if self.running.is_some() || self.waiting.is_empty() {
            return;
        }
        let ended = std::mem::take(&mut self.waiting);
        let mark = ended[0].mark.clone();
        let runs: Vec<String> = ended.iter().map(|ended| ended.run.clone()).collect();
        let thread = std::thread::Builder::new().name("left-over".to_owned());
        let thread = thread.spawn(move || mark.sweep_of(&runs)).ok();
        self.running = thread.map(|thread| Sweep { thread, ended });
    }

    /// Whether a restart of this component has to wait.
    pub(crate) fn hold_back(&self, component: &str) -> bool {
        let now = Instant::now();
        let mut ended = self.ended();
        ended.any(|ended| ended.component == component && now < ended.patience)
    }

    fn ended(&self) -> impl Iterator<Item = &Ended> {
        let running = self.running.iter().flat_map(|sweep| &sweep.ended);
        running.chain(&self.waiting)
    }

    /// When to check again.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let now = Instant::now();
        let waited_for = self.ended().any(|ended| now < ended.patience);
        waited_for.then(|| now + LOOK)
    }

    /// The components for which a search is done, with the number of killed processes.
    pub(crate) fn done(&mut self) -> Vec<(String, usize)> {
        let is_done = |sweep: &mut Sweep| sweep.thread.is_finished();
        let Some(sweep) = self.running.take_if(is_done) else {
            return Vec::new();
        };
        self.advance();
        let killed = sweep.thread.join().unwrap_or_default();
        let names = sweep.ended.into_iter().map(|ended| ended.component);
        names.zip(killed).collect()
    }
}
