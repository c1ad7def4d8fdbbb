//! The restart of a network whose shared memory was removed.
//!
//! Names in `/dev/shm` vanish while processes use what they name: `RemoveIPC=` of logind.conf removes
//! them at the logout of the user. Components that run go on with each other, and a component that
//! starts finds none of them, for ever. No name can be given back, so all components of this machine
//! end in order, what is left is removed, a new guard creates the services, and they start in order.

use crate::supervisor::control::ClientRequest;
use crate::supervisor::supervise::{StopReason, Supervisor};
use crate::supervisor::unit::Unit;
use rc_management::event::Severity;
use rc_management::supervisor::{Request, Verb};
use std::collections::BTreeSet;

impl Supervisor<'_> {
    /// Restarts all components of this machine if its guard misses files of their services.
    pub(super) fn check_memory(&mut self) {
        let missing = self.custody.take_missing();
        if missing.is_empty() || self.ending.is_some() {
            return;
        }
        let text = format!(
            "shared memory of the network was removed ({}, …; a logout does that, see `loginctl enable-linger` and RemoveIPC in logind.conf): \
             a component that starts would not find those that run, so all restart in order",
            missing.join(", ")
        );
        self.trouble(Severity::Error, "memory-lost", &text);
        self.is_renewed = true;
        self.custody.hold_starts();
        let restarts = |i: &usize| {
            let unit = &self.units[*i];
            self.host_of[*i].is_none() && !unit.is_gone()
        };
        let members: BTreeSet<usize> = (0..self.units.len()).filter(restarts).collect();
        let names = members.iter().map(|&i| self.units[i].name().to_owned());
        let request = ClientRequest::own(Request::Restart {
            names: names.collect(),
        });
        let units = &mut self.units;
        self.commands.take(request, Verb::Restart, members, units);
    }

    /// Creates the services anew once no component of this machine runs.
    pub(super) fn renew(&mut self, cleanup: &dyn Fn()) {
        let here = self.units.iter().zip(&self.host_of);
        let mut here = here.filter(|(_, host)| host.is_none());
        if !self.is_renewed || here.any(|(unit, _)| unit.is_alive()) {
            return;
        }
        self.is_renewed = false;
        if self.ending.is_some() {
            return;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.renew();
        }
        match self.custody.begin_anew(cleanup) {
            Ok(()) => self.is_restarting = true,
            Err(error) => {
                let text = error.to_string();
                self.stop(StopReason::Failed(text), "it has no guard");
            }
        }
    }

    /// Notes that all components are ready again.
    pub(super) fn note_renewed(&mut self) {
        let lets_work = |unit: &Unit| unit.is_gone() || unit.lets_others_work();
        if self.is_restarting && self.units.iter().all(lets_work) {
            self.is_restarting = false;
            let text = "all components have restarted with new shared memory";
            self.no_trouble("memory-lost", "memory-back", text);
        }
    }
}
