//! The status and the heartbeats of a component.

use crate::description::Description;
use crate::machine::MachineRecord;
use crate::status::{self, Shared};
use rc_management::component::{ClockKind, ClockStatus, Role, SlotStatus, Status};
use rc_management::link::Heartbeat;
use rc_middleware::Address;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

/// What does not change while the component runs.
pub(crate) struct ComponentInfo {
    description: &'static Description,
    pub(crate) name: String,
    network: String,
    /// The addresses of the slots; empty until they are open.
    addresses: Mutex<Vec<String>>,
}

impl ComponentInfo {
    pub(crate) fn new(description: &'static Description, name: &str, network: &str) -> Self {
        Self {
            description,
            name: name.to_owned(),
            network: network.to_owned(),
            addresses: Mutex::default(),
        }
    }

    pub(crate) fn set_addresses(&self, addresses: &[Address]) {
        let mut known = self
            .addresses
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *known = addresses.iter().map(ToString::to_string).collect();
    }

    /// The health of the component, with what was noticed since the last heartbeat.
    pub(crate) fn heartbeat(&self, shared: &Shared) -> Heartbeat {
        let mut status = shared.status();
        let delta = std::mem::take(&mut status.delta);
        let slots = self.description.slots.iter().zip(&status.slots);
        let lost = slots.clone().filter(|(_, counters)| counters.lost > 0);
        let needing =
            slots.filter(|(slot, _)| matches!(slot.role, Role::Requires | Role::SubscribesTo));
        Heartbeat {
            age_ms: shared.age_ms(),
            lost: lost
                .map(|(slot, counters)| (slot.name.to_owned(), counters.lost))
                .collect(),
            peers: needing
                .map(|(slot, counters)| (slot.name.to_owned(), counters.peers))
                .collect(),
            overruns: delta.overruns(self.description.slots, status.period),
            silent: delta.silences(self.description.slots),
            mismatches: delta.mismatches(),
            clock: Some(Box::new(clock(shared, &status)))
                .filter(|clock| clock.kind != ClockKind::System),
            jumps: delta.jumps,
        }
    }

    pub(crate) fn status(&self, shared: &Shared) -> Status {
        let status = shared.status();
        let addresses = self
            .addresses
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let slots = self.description.slots.iter().zip(&status.slots);
        let slots = slots.enumerate().map(|(at, (slot, counters))| SlotStatus {
            name: slot.name.to_owned(),
            role: slot.role,
            interface: slot.type_name.to_owned(),
            middleware: slot.backend.to_owned(),
            address: addresses.get(at).cloned(),
            peers: counters.peers,
            handlers: counters.handlers.timing(),
            sent: status.sent(at),
            lost: counters.lost,
            queue: status.queue(at),
        });
        Status {
            machine: status.machine.as_ref().map(MachineRecord::status),
            component: self.description.name.to_owned(),
            name: self.name.clone(),
            network: self.network.clone(),
            pid: std::process::id(),
            state: status.state,
            uptime_s: shared.uptime().as_secs_f64(),
            age_ms: shared.age_ms(),
            model: format!("{:016x}", self.description.model_hash),
            middleware: self.description.middleware.to_owned(),
            period_ms: status.period.as_secs_f64() * 1e3,
            overruns: status.overruns,
            compute: status.compute.timing(),
            last_error: status.last_error.clone(),
            clock: clock(shared, &status),
            slots: slots.collect(),
        }
    }
}

/// The clock of a component.
fn clock(shared: &Shared, status: &status::Status) -> ClockStatus {
    let time = &shared.time;
    let lost_ms = time.lost_ms.load(Ordering::Relaxed);
    ClockStatus {
        kind: time.kind,
        time_s: time.clock.now().as_secs_f64(),
        tick: time.tick.load(Ordering::Relaxed),
        lost_ms: (lost_ms > 0).then_some(lost_ms),
        followers: status.followers.clone(),
        waiting_for: status.waiting_for.clone(),
    }
}
