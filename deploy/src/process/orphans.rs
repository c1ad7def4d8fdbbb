//! Kills the orphans of a component before it restarts.
//!
//! A separate thread searches, because it reads the environment of all processes: one that hangs in
//! the kernel may block the reader.

use crate::process::identity::Mark;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a restart waits for the search.
const PATIENCE: Duration = Duration::from_secs(1);
/// The time between two checks whether a search is done.
const LOOK: Duration = Duration::from_millis(5);

/// The searches in progress.
#[derive(Debug, Default)]
pub(crate) struct OrphanSweeps(Vec<Sweep>);

#[derive(Debug)]
struct Sweep {
    component: String,
    thread: JoinHandle<usize>,
    patience: Instant,
}

impl OrphanSweeps {
    /// Begins to kill the orphans of this run. If no thread can start, they are killed when the
    /// network ends.
    pub(crate) fn begin(&mut self, component: &str, mark: &Mark, run: String) {
        let mark = mark.clone();
        let thread = std::thread::Builder::new().name("left-over".to_owned());
        if let Ok(thread) = thread.spawn(move || mark.sweep_of(&run)) {
            self.0.push(Sweep {
                component: component.to_owned(),
                thread,
                patience: Instant::now() + PATIENCE,
            });
        }
    }

    /// Whether a restart of this component has to wait.
    pub(crate) fn hold_back(&self, component: &str) -> bool {
        let now = Instant::now();
        let mut sweeps = self.0.iter();
        sweeps.any(|sweep| sweep.component == component && now < sweep.patience)
    }

    /// When to check again.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let now = Instant::now();
        let waited_for = self.0.iter().any(|sweep| now < sweep.patience);
        waited_for.then(|| now + LOOK)
    }

    /// The searches that are done: component and number of killed processes.
    pub(crate) fn done(&mut self) -> Vec<(String, usize)> {
        let done = self.0.extract_if(.., |sweep| sweep.thread.is_finished());
        done.map(|sweep| (sweep.component, sweep.thread.join().unwrap_or(0)))
            .collect()
    }
}
