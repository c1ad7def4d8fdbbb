//! The conditions of a network as a whole, and the files that it restores.
//!
//! The environment chooses the run directory, and any process may remove it: a logout does, and a
//! cleaner of temporary files. A network whose socket is missing could neither be stopped nor seen
//! by a second `up`, so the supervisor checks every second and restores what is missing.

use crate::guard::lock;
use crate::guard::network_guard::NetworkGuard;
use crate::log::reporter::Reporter;
use crate::supervisor::control::Control;
use crate::supervisor::network_logs::NetworkLogs;
use rc_deploy_client::error::advice;
use rc_files::DiskChange;
use rc_management::event::{Event, Severity};
use rc_management::supervisor::Trouble;
use std::collections::BTreeMap;
use std::time::SystemTime;

/// The logs as the subject of a condition.
const LOGS: &str = "logs";

/// The conditions that have started and not ended, by their codes and their subjects. Each is reported
/// when it starts and when it ends.
#[derive(Debug)]
pub(super) struct NetworkTroubles<'p> {
    report: &'p Reporter,
    all: BTreeMap<(&'static str, String), (SystemTime, String)>,
}

impl<'p> NetworkTroubles<'p> {
    /// No condition; `report` takes those that start and end.
    pub(super) fn new(report: &'p Reporter) -> Self {
        Self {
            report,
            all: BTreeMap::new(),
        }
    }

    /// Reports a condition of the network when it starts.
    pub(super) fn begin(&mut self, severity: Severity, code: &'static str, text: &str) {
        self.begin_of("", severity, code, text);
    }

    /// Reports a condition of `about`, a part of the network, when it starts.
    pub(super) fn begin_of(
        &mut self,
        about: &str,
        severity: Severity,
        code: &'static str,
        text: &str,
    ) {
        if self.note(code, about, text) {
            self.report.event(Event::network(severity, code, text));
        }
    }

    /// Reports that a condition has ended, if there was one.
    pub(super) fn end(&mut self, code: &'static str, end: &'static str, text: &str) {
        self.end_of("", code, end, text);
    }

    /// Reports that a condition of a part has ended, if there was one.
    pub(super) fn end_of(
        &mut self,
        about: &str,
        code: &'static str,
        end: &'static str,
        text: &str,
    ) {
        if self.remove(code, about) {
            self.report.event(Event::network(Severity::Info, end, text));
        }
    }

    /// Notes a condition with its latest text, and reports nothing. Returns whether it starts.
    pub(super) fn note(&mut self, code: &'static str, about: &str, text: &str) -> bool {
        let new = (SystemTime::now(), text.to_owned());
        let key = (code, about.to_owned());
        match self.all.get_mut(&key) {
            Some((_, known)) => {
                text.clone_into(known);
                false
            }
            None => self.all.insert(key, new).is_none(),
        }
    }

    /// Ends a condition, and reports nothing. Returns whether there was one.
    pub(super) fn remove(&mut self, code: &'static str, about: &str) -> bool {
        self.all.remove(&(code, about.to_owned())).is_some()
    }

    /// Whether a condition holds.
    pub(super) fn holds(&self, code: &'static str, about: &str) -> bool {
        self.all.contains_key(&(code, about.to_owned()))
    }

    /// Drops the conditions of a part of which nothing is known any more, but for `code`.
    pub(super) fn forget_all_but(&mut self, code: &'static str, about: &str) {
        self.all
            .retain(|(known, part), _| part != about || *known == code);
    }

    /// The present conditions.
    pub(super) fn list(&self) -> Vec<Trouble> {
        let troubles = self.all.iter();
        troubles
            .map(|((code, _), (since, message))| Trouble {
                code: (*code).to_owned(),
                message: message.clone(),
                since: rc_management::event::time_text(*since),
            })
            .collect()
    }

    /// Reports that the disk of the logs has become full, or has room again.
    pub(super) fn disk_changed(&mut self, logs: &NetworkLogs, change: Option<DiskChange>) {
        let directory = logs.directory().display();
        match change {
            Some(DiskChange::Full { free }) => {
                let text = format!(
                    "the disk of {directory} is full: {} KiB are free. Older parts of logs are removed; components whose output cannot be written decide themselves what that means",
                    free >> 10
                );
                self.begin(Severity::Error, "disk-full", &text);
            }
            Some(DiskChange::Free { free }) => {
                let text = format!("the disk of {directory} has room again: {} MiB", free >> 20);
                self.end("disk-full", "disk-free", &text);
            }
            None => {}
        }
    }

    /// Checks whether the recordings next to the logs end because their disk becomes full.
    pub(super) fn look_at_recordings(&mut self, logs: &mut NetworkLogs) {
        let change = logs.check_recordings();
        let shown = logs.directory().display();
        match change {
            Some((DiskChange::Full { .. }, floor)) => {
                let text = format!(
                    "the disk of {shown} has less than {} MiB free, which recordings keep free: exact recordings end, and the ring is not written",
                    floor >> 20
                );
                self.begin(Severity::Warning, "recordings-stopped", &text);
            }
            Some((DiskChange::Free { free }, _)) => {
                let text = format!(
                    "the disk of {shown} has room for recordings again: {} MiB; an exact one begins with the next start of its component",
                    free >> 20
                );
                self.end("recordings-stopped", "recordings-free", &text);
            }
            None => {}
        }
    }

    /// Takes the abstract socket of the network, by which an `up` in another environment sees it,
    /// as soon as it is free.
    pub(super) fn look_for_name(&mut self, network: &str, control: &mut Control) {
        if self.holds("unseen", "")
            && let Some(listener) = lock::free_name(network)
        {
            control.add(listener);
            let text = "took its abstract socket: an `up` in another environment sees it";
            self.end("unseen", "seen", text);
        }
    }

    /// Writes the process registry if it has changed. The next `up` needs it only if supervisor and
    /// guard are both killed.
    pub(super) fn save(&mut self, guard: &mut NetworkGuard) {
        match guard.save() {
            Ok(false) => {}
            Ok(true) => self.end("not-written", "written", "wrote to the run directory"),
            Err(error) => {
                let text = format!(
                    "cannot write to the run directory: {error}{}",
                    advice(&error)
                );
                self.begin(Severity::Warning, "not-written", &text);
            }
        }
    }

    /// Makes the folder of the logs again where somebody has removed it.
    pub(super) fn restore_logs(&mut self, logs: &mut NetworkLogs) {
        let directory = logs.directory().to_owned();
        let restored = logs.restore();
        let path = directory.display();
        match restored {
            Ok(false) => {
                // It exists again, or the logs are followed again.
                let text = format!("the folder of the logs, {path}, is there again");
                self.end_of(LOGS, "not-written", "written", &text);
            }
            Ok(true) => {
                self.remove("not-written", LOGS);
                let text = format!(
                    "the folder of the logs, {path}, was removed, and is made again; what components print until they restart is lost"
                );
                self.report
                    .event(Event::network(Severity::Warning, "logs-restored", text));
            }
            Err(error) => {
                let text = format!("cannot make the folder of the logs, {path}: {error}");
                self.begin_of(LOGS, Severity::Warning, "not-written", &text);
            }
        }
    }

    /// Makes the run directory, its lock and the supervisor's socket again where they are missing.
    pub(super) fn restore_files(&mut self, guard: &mut NetworkGuard, control: &mut Control) {
        let path = guard.directory().path().to_owned();
        let restored = guard.restore().and_then(|directory| {
            let socket = control.restore()?;
            Ok((directory, socket))
        });
        match restored {
            Ok((false, false)) => {
                self.end("directory-lost", "directory-back", "it is there again");
            }
            Ok((directory, _)) => {
                self.remove("directory-lost", "");
                let what = if directory {
                    format!("its run directory {} was removed", path.display())
                } else {
                    format!("its socket in {} was removed", path.display())
                };
                let text = format!("{what}, and is made again");
                self.report.event(Event::network(
                    Severity::Warning,
                    "directory-restored",
                    text,
                ));
            }
            Err(error) => {
                let text = format!(
                    "its run directory {} was removed, and cannot be made again: {error}{}; \
                     `rcdeploy status` and `down` reach the network all the same, its components are out of reach",
                    path.display(),
                    advice(&error)
                );
                self.begin(Severity::Error, "directory-lost", &text);
            }
        }
    }
}
