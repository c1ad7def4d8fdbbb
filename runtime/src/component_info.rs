//! The status and the heartbeats of a component.

use crate::ages::moment;
use crate::description::Description;
use crate::lifecycle::Lifecycle;
use crate::machine_record::MachineRecord;
use crate::settings::topic_qos;
use crate::slots::{OpenSlot, SlotTable};
use crate::status::{self, Shared};
use rc_management::component::{ClockKind, ClockStatus, Role, SlotStatus, Status};
use rc_management::link::Heartbeat;
use rc_management::observation::{Described, OperationDescription, SlotDescription};
use rc_middleware::{Address, Environment, Linked, Settings};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Facts that do not change while the component runs.
pub(crate) struct ComponentInfo {
    description: &'static Description,
    pub(crate) name: String,
    network: String,
    settings: Settings,
    slots: Arc<SlotTable>,
    /// Whether the middlewares are open, so that the slots can be found at their addresses.
    is_open: AtomicBool,
}

impl ComponentInfo {
    pub(crate) fn new(
        description: &'static Description,
        environment: &Environment,
        slots: &Arc<SlotTable>,
    ) -> Self {
        Self {
            description,
            slots: Arc::clone(slots),
            name: environment.instance.clone(),
            network: environment.network.clone(),
            settings: environment.settings.clone(),
            is_open: AtomicBool::new(false),
        }
    }

    /// Sets the addresses of the slots from now on.
    pub(crate) fn set_open(&self) {
        self.is_open.store(true, Ordering::Relaxed);
    }

    /// The slots that may have connections, each with its number.
    fn slots(&self) -> impl Iterator<Item = (usize, Arc<OpenSlot>)> {
        let all = self.slots.all().into_iter().enumerate();
        all.filter(|(_, slot)| !slot.is_whole_array())
    }

    fn address(&self, slot: &OpenSlot) -> Option<String> {
        let is_open = self.is_open.load(Ordering::Relaxed);
        slot.address
            .as_ref()
            .filter(|_| is_open)
            .map(Address::to_string)
    }

    /// The connections with their types.
    pub(crate) fn describe(&self, shared: &Shared) -> Described {
        let operations = |slot: &OpenSlot| {
            let operations = slot.operations.iter().enumerate();
            let operations = operations.map(|(at, operation)| OperationDescription {
                name: operation.name.to_owned(),
                hash: format!("{:016x}", operation.type_hash),
                qos: match slot.role {
                    Role::Publishes | Role::SubscribesTo => {
                        topic_qos(slot, at, slot.middleware(), &self.settings)
                    }
                    Role::Implements | Role::Requires => slot.qos,
                },
                external_type: slot.external_types.get(at).map(|ty| (*ty).to_owned()),
            });
            operations.collect()
        };
        let slots = self.slots().map(|(_, slot)| SlotDescription {
            name: slot.name.to_string(),
            role: slot.role,
            interface: slot.type_name.to_owned(),
            middleware: slot.middleware().to_owned(),
            further: slot
                .transports
                .iter()
                .skip(1)
                .map(|one| (*one).to_owned())
                .collect(),
            address: self.address(&slot),
            hash: format!("{:016x}", slot.type_hash),
            operations: operations(&slot),
        });
        let settings = |linked: &Linked| {
            let keys = rc_vocabulary::keys(linked.name).unwrap_or_default().iter();
            let set = keys.filter_map(|key| {
                let value = self.settings.value(linked.name, key.name)?;
                Some((key.name.to_owned(), value.to_string()))
            });
            let mut set: BTreeMap<String, String> = set.collect();
            (linked.variables)(&mut set, &|name| std::env::var(name).ok());
            set
        };
        let middlewares = self.description.backends.iter();
        let types = self.description.types.iter();
        Described {
            component: self.description.name.to_owned(),
            name: self.name.clone(),
            network: self.network.clone(),
            pid: std::process::id(),
            middlewares: middlewares
                .map(|linked| (linked.name.to_owned(), settings(linked)))
                .collect(),
            slots: slots.collect(),
            world: shared.status().schema.clone(),
            types: types
                .filter_map(|text| serde_json::from_str(text).ok())
                .collect(),
        }
    }

    /// The network of the component.
    pub(crate) fn network(&self) -> &str {
        &self.network
    }

    /// The health of the component, with its observations since the last heartbeat.
    pub(crate) fn heartbeat(&self, shared: &Shared) -> Heartbeat {
        let mut status = shared.status();
        let delta = std::mem::take(&mut status.delta);
        let all = self.slots.all();
        let slots = all.iter().zip(&status.slots);
        let slots = slots.filter(|(slot, _)| !slot.is_whole_array());
        let lost = slots.clone().filter(|(_, counters)| counters.lost > 0);
        let converted = self
            .slots()
            .filter_map(|(at, slot)| Some((slot.name.to_string(), status.converted(at)?)));
        let forwarded = self
            .slots()
            .filter_map(|(at, slot)| Some((slot.name.to_string(), status.forwarded(at)?)));
        let needing =
            slots.filter(|(slot, _)| matches!(slot.role, Role::Requires | Role::SubscribesTo));
        Heartbeat {
            age_ms: shared.age_ms(),
            lost: lost
                .map(|(slot, counters)| (slot.name.to_string(), counters.lost))
                .collect(),
            forwarded: forwarded.collect(),
            converted: converted.collect(),
            peers: needing
                .map(|(slot, counters)| (slot.name.to_string(), counters.peers))
                .collect(),
            overruns: delta.overruns(&all, status.period),
            silent: delta.silences(&all),
            mismatches: status.mismatches.clone(),
            clock: Some(Box::new(clock(shared, &status)))
                .filter(|clock| clock.kind != ClockKind::System),
            machine: status
                .machine
                .as_ref()
                .map(|machine| Box::new(machine.status())),
            world: status.world.clone().map(Box::new),
            jumps: delta.jumps,
        }
    }

    pub(crate) fn status(&self, shared: &Shared) -> Status {
        let status = shared.status();
        let is_simulated = shared.time.kind != ClockKind::System;
        let now = moment(is_simulated.then_some(&*shared.time.clock));
        // The counters of members are there once the worker is initialised.
        let slots = self
            .slots()
            .filter_map(|(at, slot)| Some((at, slot, status.slots.get(at)?)));
        let slots = slots.map(|(at, slot, counters)| SlotStatus {
            name: slot.name.to_string(),
            role: slot.role,
            interface: slot.type_name.to_owned(),
            middleware: slot.transports.join(", "),
            transports: status.transports(at, &slot.transports),
            address: self.address(&slot),
            peers: counters.peers,
            handlers: counters.handlers.timing(),
            refused: counters.refused,
            sent: status.sent(at),
            withheld: status.withheld(at),
            converted: status.converted(at),
            freshness: status.freshness(at, now),
            forwarded: status.forwarded(at),
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
            lifecycle: shared.lifecycle.as_deref().map(Lifecycle::state),
            uptime_s: shared.uptime().as_secs_f64(),
            age_ms: shared.age_ms(),
            model: format!("{:016x}", self.description.model_hash),
            middleware: self.description.middleware.to_owned(),
            period_ms: status.period.as_secs_f64() * 1e3,
            overruns: status.overruns,
            compute: status.compute.timing(),
            last_error: status.last_error.clone(),
            clock: clock(shared, &status),
            world: status.world.clone(),
            slots: slots.collect(),
            done_beside: shared.beside.list(),
            group: status.group.clone(),
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
