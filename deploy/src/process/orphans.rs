//! What a component leaves behind when it ends: it is gone before the component starts again.
//!
//! A thread looks for it. All processes of the machine are asked for their environment, and one that hangs in the
//! kernel may keep whoever asks waiting; the supervision does not wait.

use crate::process::identity::Mark;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long a new start waits for what is left of the last one.
const PATIENCE: Duration = Duration::from_secs(1);
/// Between two looks whether a thread is done.
const LOOK: Duration = Duration::from_millis(5);

/// The threads that look.
#[derive(Debug, Default)]
pub(crate) struct OrphanSweeps(Vec<Sweep>);

#[derive(Debug)]
struct Sweep {
    component: String,
    thread: JoinHandle<usize>,
    patience: Instant,
}

impl OrphanSweeps {
    /// Begins to end what this run of a component has left. Where there can be no thread, that is done at the end of the
    /// network.
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

    /// Whether a start of this component waits.
    pub(crate) fn hold_back(&self, component: &str) -> bool {
        let now = Instant::now();
        let mut sweeps = self.0.iter();
        sweeps.any(|sweep| sweep.component == component && now < sweep.patience)
    }

    /// When to look again.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let now = Instant::now();
        let waited_for = self.0.iter().any(|sweep| now < sweep.patience);
        waited_for.then(|| now + LOOK)
    }

    /// Those that are done: the component, and how many processes were killed.
    pub(crate) fn done(&mut self) -> Vec<(String, usize)> {
        let done = self.0.extract_if(.., |sweep| sweep.thread.is_finished());
        done.map(|sweep| (sweep.component, sweep.thread.join().unwrap_or(0)))
            .collect()
    }
}
