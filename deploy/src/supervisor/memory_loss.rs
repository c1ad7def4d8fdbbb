//! A network whose shared memory was removed: a logout does that (`RemoveIPC` of systemd), and
//! everything that empties `/dev/shm`.
//!
//! Running components still reach each other, because they have it mapped, but one that starts
//! finds nothing. No name can be given back, so all components of that machine end in order, the
//! remains are removed, a new guard creates the services, and they start in order. On another
//! machine, its agent does the part between the end and the start.

use crate::supervisor::control::ClientRequest;
use crate::supervisor::supervise::{StopReason, Supervisor};
use crate::supervisor::unit::Unit;
use rc_management::event::Severity;
use rc_management::supervisor::{Request, Verb};

impl Supervisor<'_> {
    /// Restarts all components of this machine if its guard misses files of their services.
    pub(super) fn check_memory(&mut self) {
        let missing = self.network_guard.take_missing();
        if missing.is_empty() || self.ending.is_some() {
            return;
        }
        self.renewal.is_due = true;
        self.network_guard.hold_starts();
        self.restart_all_of(None, &missing.join(", "));
    }

    /// Restarts all components of a machine whose agent misses these files.
    pub(super) fn memory_lost_on(&mut self, h: usize, files: &str) {
        if self.ending.is_none() {
            self.restart_all_of(Some(h), files);
        }
    }

    fn restart_all_of(&mut self, place: Option<usize>, files: &str) {
        let text = format!(
            "shared memory of the network was removed ({files}, …; a logout does that, see `loginctl enable-linger` and RemoveIPC in logind.conf): \
             a component that starts would not find those that run, so all restart in order"
        );
        let (about, text) = self.of_place(place, &text);
        self.troubles
            .begin_of(&about, Severity::Error, "memory-lost", &text);
        self.renewal.restarting.insert(place);
        let mut members = self.hosts.members(place);
        let runs = |i: &usize| !self.units[*i].is_gone();
        members.retain(|&i| self.order.mates(i).iter().any(runs));
        let names = members.iter().map(|&i| self.units[i].name().to_owned());
        let request = ClientRequest::own(Request::Restart {
            names: names.collect(),
        });
        let units = &mut self.units;
        self.commands.take(request, Verb::Restart, members, units);
    }

    /// The name of a machine as the subject of a condition, and a text about it.
    fn of_place(&self, place: Option<usize>, text: &str) -> (String, String) {
        match place {
            None => (String::new(), text.to_owned()),
            Some(h) => {
                let name = self.hosts.name(h).to_owned();
                let text = format!("host {name}: {text}");
                (name, text)
            }
        }
    }

    /// Creates the services again once no component of this machine runs.
    pub(super) fn renew(&mut self, cleanup: &dyn Fn()) {
        let mut here = self.hosts.members(None).into_iter();
        if !self.renewal.is_due || here.any(|i| self.units[i].is_alive()) {
            return;
        }
        self.renewal.is_due = false;
        if self.ending.is_some() {
            return;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.renew();
        }
        match self.network_guard.restart(cleanup) {
            Ok(()) => self
                .troubles
                .end("guard-lost", "guard-back", "a new guard runs"),
            Err(error) => {
                let text = error.to_string();
                self.stop(StopReason::Failed(text), "it has no guard");
            }
        }
    }

    /// Notes that all components of a machine are ready again.
    pub(super) fn note_renewed(&mut self) {
        for place in self.renewal.restarting.clone() {
            let members = self.hosts.members(place);
            let lets_work = |unit: &Unit| unit.is_gone() || unit.lets_others_work();
            if !self.commands.has_own(&members)
                && members.iter().all(|&i| lets_work(&self.units[i]))
            {
                self.renewal.restarting.remove(&place);
                let text = "all components have restarted with new shared memory";
                let (about, text) = self.of_place(place, text);
                self.troubles
                    .end_of(&about, "memory-lost", "memory-back", &text);
            }
        }
    }
}
