//! Requests of tools about the connections of a component: their description, copies of messages,
//! and messages of tools, which the worker handles as if a peer had sent them.

use crate::commands::{Command, CommandQueue};
use crate::component_info::ComponentInfo;
use crate::hops::{FollowedEnd, FollowedPair, SharedHops};
use crate::losses::{Losses, Tapping};
use crate::slots::{OpenSlot, SlotTable};
use crate::status::Shared;
use crate::tap::{Copied, Taps};
use crate::tool_message::ToolMessage;
use crate::waker::Waker;
use rc_diagnostics::foreign::clean;
use rc_diagnostics::nearest;
use rc_management::component::{Done, Role};
use rc_management::hops::{Following, HopReport, Message, Pair};
use rc_management::observation::{Called, Clocks, Notification, Tapped};
use rc_management::rpc::{self, Error};
use rc_management::{LONGEST, Server as Socket};
use rc_middleware::Encoding;
use rc_middleware::backend::Profile;
use rustix::time::{ClockId, clock_gettime};
use serde_json::Value;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The most bytes of copies that wait for one client, unless one copy alone is longer.
const MOST_WAITING: usize = 3 << 20;
/// How long the worker may take to handle a sample of a tool.
const SAMPLE_LIMIT: Duration = Duration::from_secs(3);
/// How long messages on chains are noted for a client that has left: it may ask again on another
/// connection.
const NOTED: Duration = Duration::from_secs(5);

/// A client, the identifier of its request, and the result.
type Answered = (u64, Option<Value>, Result<Value, Error>);

/// The part of the management thread that serves tools.
pub(crate) struct ToolRequests {
    slots: Arc<SlotTable>,
    taps: Arc<Taps>,
    hops: Arc<SharedHops>,
    /// The client for which messages on chains are noted.
    follower: Option<u64>,
    /// Since when it has left.
    left: Option<Instant>,
    commands: Arc<CommandQueue>,
    management: Waker,
    pending: Vec<(u64, Option<Value>, Arc<ToolMessage>)>,
}

impl ToolRequests {
    pub(crate) fn new(
        slots: Arc<SlotTable>,
        (taps, hops): (Arc<Taps>, Arc<SharedHops>),
        commands: Arc<CommandQueue>,
        management: Waker,
    ) -> Self {
        Self {
            slots,
            taps,
            hops,
            follower: None,
            left: None,
            commands,
            management,
            pending: Vec::new(),
        }
    }

    /// The description of the component.
    pub(crate) fn describe(info: &ComponentInfo, shared: &Shared) -> Result<Value, Error> {
        rpc::result(&info.describe(shared))
    }

    /// The clocks of this machine, now.
    pub(crate) fn clocks() -> Result<Value, Error> {
        let system = clock_gettime(ClockId::Realtime);
        rpc::result(&Clocks {
            system_ns: system.tv_sec * 1_000_000_000 + system.tv_nsec,
            monotonic_ns: rc_middleware::now(),
        })
    }

    /// Switches the tap of a slot for a client. Counting starts again.
    pub(crate) fn tap(
        &self,
        socket: &mut Socket<Tapping>,
        client: u64,
        slot: &str,
        on: bool,
    ) -> Result<Value, Error> {
        let (slot, _) = self.slot(slot)?;
        if let Some(client) = socket.client_mut(client) {
            if on {
                let before = self.taps.dropped(slot);
                client.state.entry(slot).or_insert(Losses {
                    before,
                    dropped: 0,
                    told: 0,
                });
            } else {
                client.state.remove(&slot);
            }
            client.follows = !client.state.is_empty();
        }
        self.update(socket);
        rpc::result(&Done {})
    }

    /// Notes messages on chains for a client.
    pub(crate) fn follow(
        &mut self,
        socket: &mut Socket<Tapping>,
        client: u64,
        pairs: &[Pair],
    ) -> Result<Value, Error> {
        let other = self.follower.filter(|other| *other != client);
        if other.is_some_and(|other| is_there(socket, other)) {
            let message = "another client follows the messages of this component";
            return Err(Error::new(Error::INVALID_PARAMS, message));
        }
        let pairs = pairs.iter().map(|pair| {
            Ok(FollowedPair {
                input: pair.input.as_ref().map(|end| self.found(end)).transpose()?,
                output: pair
                    .output
                    .as_ref()
                    .map(|end| self.found(end))
                    .transpose()?,
                way: pair.way,
                stamp: pair.stamp.clone(),
            })
        });
        let pairs: Vec<FollowedPair> = pairs.collect::<Result<_, Error>>()?;
        self.follower = (!pairs.is_empty()).then_some(client);
        self.left = None;
        let senders = self.hops.follow(pairs);
        rpc::result(&Following { senders })
    }

    /// The slots, or the members of an array, that an end of a pair names.
    fn found(&self, end: &Message) -> Result<FollowedEnd, Error> {
        let all = self.slots.all();
        let is_meant = |slot: &OpenSlot| slot.name == end.slot || slot.slot.name == end.slot;
        let slots = all.iter().enumerate();
        let slots = slots.filter(|(_, slot)| !slot.is_whole_array() && is_meant(slot));
        let slots = slots.map(|(at, _)| at).collect();
        let Some(of) = all.iter().find(|slot| is_meant(slot)) else {
            let names = all.iter().map(|slot| &*slot.name);
            return Err(unknown("slot", &end.slot, names));
        };
        let names = of.operations.iter().map(|operation| operation.name);
        let operation = names.clone().position(|name| name == end.operation);
        let operation = operation.ok_or_else(|| unknown("operation", &end.operation, names))?;
        Ok(FollowedEnd {
            slots,
            operation,
            id: of.operations[operation].id,
        })
    }

    /// Takes the notes since the last time. `active`: whether the component handles messages.
    pub(crate) fn hops(
        &self,
        socket: &mut Socket<Tapping>,
        client: u64,
        active: bool,
    ) -> Result<Value, Error> {
        // The notes wait for the next one if nobody reads the answer.
        if self.follower != Some(client) || !is_there(socket, client) {
            let message = "nothing is followed for this client; ask `follow` first";
            return Err(Error::new(Error::INVALID_PARAMS, message));
        }
        let (hops, overwritten) = self.hops.take();
        rpc::result(&HopReport {
            active,
            overwritten,
            hops: hops.into(),
        })
    }

    /// Stops noting for a client that left a while ago.
    fn end_following(&mut self, socket: &mut Socket<Tapping>) {
        let follower = self.follower;
        if follower.is_none_or(|client| is_there(socket, client)) {
            return;
        }
        let left = *self.left.get_or_insert_with(Instant::now);
        if left.elapsed() >= NOTED {
            (self.follower, self.left) = (None, None);
            self.hops.follow(Vec::new());
        }
    }

    /// Gives a request to the worker.
    pub(crate) fn call(
        &mut self,
        (client, id): (u64, Option<Value>),
        slot: &str,
        body: Vec<u8>,
        limit: Duration,
    ) -> Result<(), Error> {
        let (slot, found) = self.slot(slot)?;
        if found.role != Role::Implements {
            return Err(wrong_role(&found, "call", Role::Implements));
        }
        self.push((client, id), slot, None, body, limit)
    }

    /// Gives a sample to the worker.
    pub(crate) fn sample(
        &mut self,
        (client, id): (u64, Option<Value>),
        slot: &str,
        operation: &str,
        body: Vec<u8>,
    ) -> Result<(), Error> {
        let (slot, found) = self.slot(slot)?;
        if found.role != Role::SubscribesTo {
            return Err(wrong_role(&found, "sample", Role::SubscribesTo));
        }
        let names = found.operations.iter().map(|operation| operation.name);
        let at = names.clone().position(|name| name == operation);
        let at = at.ok_or_else(|| unknown("operation", operation, names))?;
        self.push((client, id), slot, Some(at), body, SAMPLE_LIMIT)
    }

    fn push(
        &mut self,
        (client, id): (u64, Option<Value>),
        slot: usize,
        operation: Option<usize>,
        body: Vec<u8>,
        limit: Duration,
    ) -> Result<(), Error> {
        let (deadline, management) = (Instant::now() + limit, self.management.clone());
        let message = ToolMessage::new((slot, operation), body, deadline, management);
        let message = Arc::new(message);
        if !self.commands.push(Command::Message(Arc::clone(&message))) {
            let message = "too many messages of tools wait for the component";
            return Err(Error::new(Error::WORKER_TIMEOUT, message));
        }
        self.pending.push((client, id, message));
        Ok(())
    }

    fn slot(&self, name: &str) -> Result<(usize, Arc<OpenSlot>), Error> {
        let all = self.slots.all();
        let slots = all.iter().enumerate();
        let mut slots = slots.filter(|(_, slot)| !slot.is_whole_array());
        let found = slots.clone().find(|(_, slot)| slot.name == name);
        let found = found.map(|(at, slot)| (at, Arc::clone(slot)));
        let names = slots
            .by_ref()
            .map(|(_, slot)| &*slot.name)
            .collect::<Vec<_>>();
        found.ok_or_else(|| unknown("slot", name, names.into_iter()))
    }

    /// How long the next message may still take.
    pub(crate) fn time_left(&self) -> Option<Duration> {
        let deadlines = self.pending.iter().map(|(.., message)| message.deadline());
        let next = deadlines.min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    /// The results that are due, each with its client and the identifier of its request.
    pub(crate) fn results(&mut self) -> Vec<Answered> {
        let now = Instant::now();
        let mut results = Vec::new();
        self.pending.retain_mut(|(client, id, message)| {
            let Some(result) = message.result(now) else {
                return true;
            };
            let result = result.and_then(|body| match message.operation {
                None => rpc::result(&Called { body }),
                Some(_) => rpc::result(&Done {}),
            });
            results.push((*client, id.take(), result));
            false
        });
        results
    }

    /// Switches off the taps that no client has any more, and sends the copies that wait.
    pub(crate) fn turn(&mut self, socket: &mut Socket<Tapping>) {
        self.end_following(socket);
        self.update(socket);
        let copies = self.taps.take();
        if !copies.is_empty() {
            for copied in copies {
                self.send(socket, copied);
            }
            socket.flush();
        }
        if self.tell_losses(socket) {
            socket.flush();
        }
    }

    /// Reports their losses to the clients that have read everything. Returns whether any has
    /// losses.
    fn tell_losses(&self, socket: &mut Socket<Tapping>) -> bool {
        let mut any = false;
        for client in socket.clients_mut().filter(|client| client.waiting() == 0) {
            let mut lines = Vec::new();
            for (number, losses) in &mut client.state {
                let dropped = losses.total(self.taps.dropped(*number));
                let Some(slot) = self.slots.get(*number).filter(|_| dropped > losses.told) else {
                    continue;
                };
                losses.told = dropped;
                let slot = slot.name.to_string();
                lines.push(rpc::notification(&Notification::Dropped { slot, dropped }));
            }
            any |= !lines.is_empty();
            lines.iter().for_each(|line| client.push(line));
        }
        any
    }

    fn update(&self, socket: &mut Socket<Tapping>) {
        let wanted: BTreeSet<usize> = socket
            .clients_mut()
            .flat_map(|client| client.state.keys().copied())
            .collect();
        for slot in 0..self.slots.len() {
            self.taps.set(slot, wanted.contains(&slot));
        }
    }

    fn send(&self, socket: &mut Socket<Tapping>, copied: Copied) {
        let number = copied.slot;
        let Some(slot) = self.slots.get(number) else {
            return;
        };
        let operation = copied.operation.and_then(|at| slot.operations.get(at));
        let Copied { header, .. } = copied;
        let mut copy = Notification::Tapped(Box::new(Tapped {
            slot: slot.name.to_string(),
            kind: copied.kind,
            operation: operation.map(|operation| operation.name.to_owned()),
            type_hash: header.type_hash,
            sequence: header.sequence,
            sent: header.sent,
            image: header.encoding == Encoding::Image,
            ros: copied.profile == Profile::Bare,
            dropped: 0,
            body: copied.body,
        }));
        // Clients with equally many losses get the same line.
        let mut line: Option<(u64, Vec<u8>)> = None;
        for client in socket.clients_mut() {
            let waiting = client.waiting();
            let Some(losses) = client.state.get_mut(&number) else {
                continue;
            };
            let dropped = losses.total(copied.dropped);
            let known = line.take().filter(|(of, _)| *of == dropped);
            let (_, line) = line.insert(known.unwrap_or_else(|| {
                if let Notification::Tapped(tapped) = &mut copy {
                    tapped.dropped = dropped;
                }
                (dropped, rpc::notification(&copy))
            }));
            // A long message, such as a picture, finds room when the client has read all before.
            let most = if waiting == 0 { LONGEST } else { MOST_WAITING };
            if waiting + line.len() > most {
                losses.dropped += 1;
            } else {
                losses.told = losses.told.max(dropped);
                client.push(line);
            }
        }
    }

    /// The results of all messages: the component ends.
    pub(crate) fn end(&mut self) -> Vec<Answered> {
        let mut results = self.results();
        let ends = || Error::new(Error::WORKER_REFUSES, "the component ends");
        let rest = self.pending.drain(..);
        results.extend(rest.map(|(client, id, _)| (client, id, Err(ends()))));
        results
    }
}

fn wrong_role(slot: &OpenSlot, what: &str, role: Role) -> Error {
    let (name, is) = (&slot.name, slot.role.word());
    let message = format!("`{what}` wants a slot that {role}; `{name}` {is}");
    Error::new(Error::INVALID_PARAMS, message)
}

fn unknown<'a>(what: &str, name: &str, names: impl Iterator<Item = &'a str> + Clone) -> Error {
    let near = nearest(name, names.clone());
    let help = match near {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are: {}", names.collect::<Vec<_>>().join(", ")),
    };
    let name = clean(name);
    Error::new(
        Error::INVALID_PARAMS,
        format!("there is no {what} `{name}`; {help}"),
    )
}

/// Whether a client reads answers.
fn is_there(socket: &mut Socket<Tapping>, client: u64) -> bool {
    let client = socket.client_mut(client);
    client.is_some_and(|client| !client.is_gone())
}

#[cfg(test)]
pub(crate) mod tests;
