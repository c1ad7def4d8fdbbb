//! The agent's reports about its machine: conditions when they begin and end, and the memory of
//! components. The supervisor keeps the conditions, and evaluates the memory.

use super::agent_process::Running;
use crate::guard::network_guard::NetworkGuard;
use crate::log::rotation;
use crate::process::memory::{MemoryRounds, resident};
use rc_deploy_client::error::advice;
use rc_files::{Disk, DiskChange};
use rc_management::Output;
use rc_management::agent::AgentMessage;
use rc_management::lines;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

/// The longest pause between two readings of the memory.
const LONGEST_PAUSE: Duration = Duration::from_hours(1);

/// Reported conditions of this machine, and the data for evaluating them.
pub(super) struct Health {
    /// The conditions that hold.
    told: BTreeSet<&'static str>,
    disk: Disk,
    /// Free disk that exact recordings keep, if there are some.
    recordings: Option<Disk>,
    rounds: MemoryRounds,
}

impl Health {
    /// Nothing was reported yet. The memory is read after each `pause`.
    pub(super) fn new(pause: Duration) -> Self {
        Self {
            told: BTreeSet::new(),
            disk: Disk::with(rotation::LIMIT, rotation::LIMIT * 4),
            recordings: None,
            rounds: MemoryRounds::new(pause.min(LONGEST_PAUSE)),
        }
    }

    /// Notes that there are exact recordings next to this log.
    pub(super) fn note_exact_recordings(&mut self, log: &Path) {
        let disk = || Disk::new(Disk::usual_floor(log));
        self.recordings.get_or_insert_with(disk);
    }

    pub(super) fn deadline(&self) -> Instant {
        self.rounds.deadline()
    }

    /// Reports that a condition holds, when it begins.
    pub(super) fn begin(&mut self, out: &mut Output, code: &'static str, text: String) {
        if self.told.insert(code) {
            let code = code.to_owned();
            send(out, &AgentMessage::Trouble { code, text });
        }
    }

    /// Reports that a condition has ended, if there was one.
    pub(super) fn end(&mut self, out: &mut Output, code: &'static str, text: &str) {
        if self.told.remove(code) {
            send(
                out,
                &AgentMessage::TroubleOver {
                    code: code.to_owned(),
                    text: text.to_owned(),
                },
            );
        }
    }

    /// Looks at what may have changed in the last second. `logs`: their folder.
    pub(super) fn look_around(&mut self, guard: &mut NetworkGuard, logs: &Path, out: &mut Output) {
        self.restore_files(guard, out);
        let Ok(free) = Disk::free(logs) else {
            return;
        };
        self.look_at_recordings(logs, free, out);
        match self.disk.look(free) {
            Some(DiskChange::Full { free }) => {
                let text = format!(
                    "the disk of {} is full: {} KiB are free; components whose output cannot be written decide themselves what that means",
                    logs.display(),
                    free >> 10
                );
                self.begin(out, "disk-full", text);
            }
            Some(DiskChange::Free { free }) => {
                let text = format!(
                    "the disk of {} has room again: {} MiB",
                    logs.display(),
                    free >> 20
                );
                self.end(out, "disk-full", &text);
            }
            None => {}
        }
    }

    /// Reports when exact recordings end because of their disk.
    fn look_at_recordings(&mut self, logs: &Path, free: u64, out: &mut Output) {
        let disk = self.recordings.as_mut();
        let change = disk.and_then(|disk| Some((disk.look(free)?, disk.floor() >> 20)));
        let shown = logs.display();
        match change {
            Some((DiskChange::Full { .. }, kept)) => {
                let text = format!(
                    "the disk of {shown} has less than {kept} MiB free, which recordings keep free: exact recordings end"
                );
                self.begin(out, "recordings-stopped", text);
            }
            Some((DiskChange::Free { free }, _)) => {
                let text = format!(
                    "the disk of {shown} has room for recordings again: {} MiB; an exact one begins with the next start of its component",
                    free >> 20
                );
                self.end(out, "recordings-stopped", &text);
            }
            None => {}
        }
    }

    /// Reports the memory of the components when that is due.
    pub(super) fn measure(
        &mut self,
        now: Instant,
        running: &BTreeMap<String, Running>,
        out: &mut Output,
    ) {
        if !self.rounds.is_due(now) {
            return;
        }
        let read = running.iter().filter_map(|(name, running)| {
            let bytes = resident(running.process()?.pid())?;
            Some(AgentMessage::Memory {
                name: name.clone(),
                bytes,
            })
        });
        for message in read {
            send(out, &message);
        }
    }

    /// Makes the run directory again if it was removed.
    fn restore_files(&mut self, guard: &mut NetworkGuard, out: &mut Output) {
        match guard.restore() {
            Ok(is_new) => {
                self.end(out, "directory-lost", "the run directory is there again");
                if is_new {
                    let note = "the run directory there was removed, and is made again";
                    send(out, &AgentMessage::Note(note.to_owned()));
                }
            }
            Err(error) => {
                let text = format!(
                    "the run directory there was removed, and cannot be made again: {error}"
                );
                self.begin(out, "directory-lost", text);
            }
        }
    }

    /// Writes the process registry. It is needed only if all of rcdeploy is killed.
    pub(super) fn save(&mut self, guard: &mut NetworkGuard, out: &mut Output) {
        match guard.save() {
            Ok(false) => {}
            Ok(true) => self.end(out, "not-written", "wrote to the run directory"),
            Err(error) => {
                let text = format!(
                    "cannot write to the run directory: {error}{}",
                    advice(&error)
                );
                self.begin(out, "not-written", text);
            }
        }
    }
}

fn send(out: &mut Output, message: &AgentMessage) {
    out.push(&lines::encode(message));
}
