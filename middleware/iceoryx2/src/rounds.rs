//! Counts the clean-ups of a network, so that many processes that wait for one share it.
//!
//! A round finds every node that died before it began. A process that needs the places of dead
//! endpoints therefore waits for the end of any round that began after its request, whichever
//! process does the work.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// The counters, in a file that only the leader writes.
pub(crate) struct RoundCounter {
    path: PathBuf,
}

/// The counters at one time. All zero: no round yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rounds {
    /// Number of the last round that began.
    pub(crate) begun: u64,
    /// Number of the last round that was completed. A round whose leader was killed never is.
    pub(crate) completed: u64,
    /// Nodes removed so far.
    pub(crate) removed: u64,
}

impl RoundCounter {
    /// The counters of the network with the root folder `root`.
    pub(crate) fn of(root: &Path) -> Self {
        Self {
            path: root.join("cleaning.rounds"),
        }
    }

    /// The counters now.
    pub(crate) fn read(&self) -> Rounds {
        let mut bytes = [0; 24];
        let read = File::open(&self.path).and_then(|file| file.read_exact_at(&mut bytes, 0));
        if read.is_err() {
            return Rounds::default();
        }
        let [begun, completed, removed] = [0, 8, 16].map(|at| {
            let mut number = [0; 8];
            number.copy_from_slice(&bytes[at..at + 8]);
            u64::from_le_bytes(number)
        });
        Rounds {
            begun,
            completed,
            removed,
        }
    }

    /// Begins a round. Returns its number.
    pub(crate) fn begin(&self) -> io::Result<u64> {
        let mut rounds = self.read();
        rounds.begun += 1;
        self.write(rounds)?;
        Ok(rounds.begun)
    }

    /// Notes that `count` nodes were removed, and with `completed` the end of that round.
    pub(crate) fn note(&self, count: u64, completed: Option<u64>) -> io::Result<()> {
        let mut rounds = self.read();
        rounds.removed += count;
        rounds.completed = rounds.completed.max(completed.unwrap_or(0));
        self.write(rounds)
    }

    fn write(&self, rounds: Rounds) -> io::Result<()> {
        let mut options = File::options();
        let file = options.create(true).truncate(false).write(true);
        let numbers = [rounds.begun, rounds.completed, rounds.removed];
        let bytes = numbers.map(u64::to_le_bytes).concat();
        file.open(&self.path)?.write_all_at(&bytes, 0)
    }
}
