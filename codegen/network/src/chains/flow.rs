//! The flow of messages in a network: connections, and the reactions of components.

use super::{ASSUMED_BUDGET, Port};
use crate::bounds::{Rate, Way};
use crate::model::Network;
use rc_cdsl::model::{Component, Reaction, Role, Step};
use rc_ddsl::Endpoint;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Whether messages of a slot are received or sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    In,
    Out,
}

impl Direction {
    /// Whether a component receives the messages of a slot of this role.
    fn of(role: Role) -> Self {
        match role {
            Role::Implements | Role::SubscribesTo => Self::In,
            Role::Requires | Role::Publishes => Self::Out,
        }
    }
}

/// A slot, as far as messages flow through it.
#[derive(Debug)]
pub(crate) struct FlowSlot {
    pub(crate) direction: Direction,
    pub(crate) optional: bool,
    pub(crate) depth: u32,
    operations: usize,
    is_external: bool,
}

/// A component, as far as messages flow through it.
#[derive(Debug)]
pub(crate) struct FlowComponent {
    pub(crate) slots: Vec<FlowSlot>,
    /// The operations that it receives.
    pub(crate) handlers: Vec<Port>,
    /// Its reactions. `None`: every message may follow every other one, through `compute()`.
    reactions: Option<Vec<FlowReaction>>,
    /// Its collections of samples.
    collects: Vec<FlowCollect>,
    /// The operations that it sends.
    outputs: Vec<Port>,
    period: u64,
}

/// Messages that one handler gets together.
#[derive(Debug)]
struct FlowCollect {
    ports: Vec<Port>,
    /// The most time between sending two of them.
    within: u64,
}

#[derive(Debug)]
struct FlowReaction {
    /// `None` for `compute()`.
    causes: Option<Vec<Port>>,
    sends: Vec<Port>,
    computes: bool,
    budget: Option<u64>,
}

/// The flow of messages.
#[derive(Debug)]
pub(crate) struct Flow {
    pub(crate) components: Vec<FlowComponent>,
    receivers: BTreeMap<Port, Vec<Port>>,
    senders: BTreeMap<Port, Vec<Port>>,
}

impl Flow {
    /// The flow of a network whose components could all be read.
    pub(crate) fn new(network: &Network) -> Self {
        let projects = network.projects.iter().flatten().enumerate();
        let components: Vec<FlowComponent> = projects
            .map(|(at, project)| {
                let period = nanoseconds(network.periods[at]);
                let externals = &network.connections.externals;
                let is_external = |slot: usize| {
                    let end = Endpoint { instance: at, slot };
                    externals.contains_key(&end)
                };
                component(at, &project.component, period, is_external)
            })
            .collect();
        let (mut receivers, mut senders) = (BTreeMap::new(), BTreeMap::new());
        for connection in &network.connections.connections {
            let (consumer, provider) = (connection.consumer, connection.provider);
            let slot = &components[consumer.instance].slots[consumer.slot];
            let (from, to) = match slot.direction {
                Direction::In => (provider, consumer),
                Direction::Out => (consumer, provider),
            };
            for operation in 0..slot.operations {
                let port = |end: Endpoint| Port {
                    instance: end.instance,
                    slot: end.slot,
                    operation,
                };
                let to_port: &mut Vec<Port> = receivers.entry(port(from)).or_default();
                to_port.push(port(to));
                let from_port: &mut Vec<Port> = senders.entry(port(to)).or_default();
                from_port.push(port(from));
            }
        }
        Self {
            components,
            receivers,
            senders,
        }
    }

    pub(crate) fn direction(&self, port: Port) -> Direction {
        self.components[port.instance].slots[port.slot].direction
    }

    pub(crate) fn receivers(&self, port: Port) -> &[Port] {
        self.receivers.get(&port).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn senders(&self, port: Port) -> &[Port] {
        self.senders.get(&port).map_or(&[], Vec::as_slice)
    }

    /// Collections of a message: the ports of each one, and the most time between
    /// sending two of its messages.
    pub(crate) fn collected(&self, port: Port) -> impl Iterator<Item = (&[Port], u64)> {
        let collects = self.components[port.instance].collects.iter();
        let of_port = collects.filter(move |collect| collect.ports.contains(&port));
        of_port.map(|collect| (collect.ports.as_slice(), collect.within))
    }

    /// Whether messages come from outside of the network.
    pub(crate) fn is_external(&self, port: Port) -> bool {
        self.components[port.instance].slots[port.slot].is_external
    }

    /// Whether somebody sends to a port.
    pub(crate) fn is_reached(&self, port: Port) -> bool {
        let mut senders = self.senders(port).iter();
        self.is_external(port) || senders.any(|sender| !self.rates(*sender).is_empty())
    }

    /// The number of a receiving port among those of its component.
    pub(crate) fn handler(&self, port: Port) -> usize {
        let handlers = &self.components[port.instance].handlers;
        handlers.binary_search(&port).unwrap_or(0)
    }

    /// The output of a component after it has received a message, and the way to it. Output of the
    /// handler comes first.
    pub(crate) fn effects(&self, port: Port) -> Vec<(Port, Way)> {
        let component = &self.components[port.instance];
        let Some(reactions) = &component.reactions else {
            let outputs = component.outputs.iter();
            return outputs.map(|output| (*output, Way::Compute)).collect();
        };
        let mut effects: Vec<(Port, Way)> = Vec::new();
        let of_port = reactions.iter().filter(|r| r.begins_with(port));
        for reaction in of_port {
            effects.extend(reaction.sends.iter().map(|sent| (*sent, Way::Handler)));
            let computes = reactions.iter().filter(|r| r.causes.is_none());
            for compute in computes.filter(|_| reaction.computes) {
                for sent in &compute.sends {
                    if !effects.iter().any(|(known, _)| known == sent) {
                        effects.push((*sent, Way::Compute));
                    }
                }
            }
        }
        effects
    }

    /// Whether `compute()` uses a message.
    pub(crate) fn has_compute_way(&self, port: Port) -> bool {
        let reactions = self.components[port.instance].reactions.as_ref();
        reactions.is_none_or(|all| all.iter().any(|r| r.computes && r.begins_with(port)))
    }

    /// When a component sends a message.
    pub(crate) fn rates(&self, port: Port) -> Vec<Rate> {
        let at = port.instance;
        let Some(reactions) = &self.components[at].reactions else {
            return vec![Rate::Compute(at)];
        };
        let mut rates = Vec::new();
        for reaction in reactions.iter().filter(|r| r.sends.contains(&port)) {
            match &reaction.causes {
                None => rates.push(Rate::Compute(at)),
                Some(causes) => {
                    let handlers = causes.iter().map(|cause| self.handler(*cause));
                    rates.extend(handlers.map(|handler| Rate::Handler(at, handler)));
                }
            }
        }
        rates
    }

    /// The budget of a handler, and whether it is assumed.
    pub(crate) fn budget(&self, port: Port) -> (u64, bool) {
        let component = &self.components[port.instance];
        let reactions = component.reactions.iter().flatten();
        let mut own = reactions.filter(|r| r.begins_with(port));
        component.or_assumed(own.find_map(|r| r.budget))
    }

    /// The budget of `compute()`, and whether it is assumed.
    pub(crate) fn compute_budget(&self, at: usize) -> (u64, bool) {
        let component = &self.components[at];
        let reactions = component.reactions.iter().flatten();
        let mut own = reactions.filter(|r| r.causes.is_none());
        component.or_assumed(own.find_map(|r| r.budget))
    }

    /// Reports messages that lead to themselves without a period between. Returns whether there are
    /// any.
    pub(crate) fn report_cycles(&self, network: &Network, found: &mut Diagnostics) -> bool {
        // 1: on the present way; 2: done.
        let mut marks: BTreeMap<Port, u8> = BTreeMap::new();
        let mut has_cycle = false;
        let handlers = self.components.iter().flat_map(|c| &c.handlers);
        for first in handlers {
            let mut way: Vec<(Port, Vec<Port>)> = Vec::new();
            if !marks.contains_key(first) {
                marks.insert(*first, 1);
                way.push((*first, self.direct(*first)));
            }
            while let Some((port, left)) = way.last_mut() {
                let Some(next) = left.pop() else {
                    marks.insert(*port, 2);
                    way.pop();
                    continue;
                };
                match marks.get(&next) {
                    None => {
                        marks.insert(next, 1);
                        way.push((next, self.direct(next)));
                    }
                    Some(1) => {
                        let start = way.iter().position(|(port, _)| *port == next);
                        let ports = way[start.unwrap_or(0)..].iter().map(|(port, _)| *port);
                        found.push(Self::cycle(network, &ports.collect::<Vec<_>>()));
                        has_cycle = true;
                    }
                    Some(_) => {}
                }
            }
        }
        has_cycle
    }

    /// The ports that receive the output of a message's handler.
    fn direct(&self, port: Port) -> Vec<Port> {
        let effects = self.effects(port).into_iter();
        let sent = effects.filter(|(_, way)| *way == Way::Handler);
        sent.flat_map(|(sent, _)| self.receivers(sent).to_vec())
            .collect()
    }

    fn cycle(network: &Network, ports: &[Port]) -> Diagnostic {
        let names = ports.iter().chain(ports.first());
        let names: Vec<String> = names.map(|port| network.port_name(*port)).collect();
        let instances: BTreeSet<usize> = ports.iter().map(|port| port.instance).collect();
        let first = instances.first().copied().unwrap_or(0);
        let message = format!(
            "a message leads to itself without a delay: {}",
            names.join(" → ")
        );
        let span = network.deployment.instances[first].name.span;
        Diagnostic::error("cycle-without-delay", span, message)
            .help("let one of these handlers keep the message for `compute` in its `reactions`")
    }
}

impl FlowComponent {
    fn or_assumed(&self, declared: Option<u64>) -> (u64, bool) {
        let assumed = nanoseconds(ASSUMED_BUDGET).min(self.period / 10);
        declared.map_or((assumed, true), |budget| (budget, false))
    }
}

impl FlowReaction {
    fn begins_with(&self, port: Port) -> bool {
        let causes = self.causes.as_ref();
        causes.is_some_and(|causes| causes.contains(&port))
    }
}

fn component(
    at: usize,
    component: &Component,
    period: u64,
    is_external: impl Fn(usize) -> bool,
) -> FlowComponent {
    let slots = component.slots.iter().enumerate();
    let slots: Vec<FlowSlot> = slots
        .map(|(number, slot)| FlowSlot {
            direction: Direction::of(slot.role),
            optional: slot.optional,
            depth: slot.whole_qos().depth,
            operations: component.library.interface(slot.interface).operations.len(),
            is_external: slot.role == Role::SubscribesTo && is_external(number),
        })
        .collect();
    let ports = |direction: Direction| {
        let numbered = slots.iter().enumerate();
        let wanted = numbered.filter(move |(_, slot)| slot.direction == direction);
        let ports = wanted.flat_map(move |(slot, of)| {
            (0..of.operations).map(move |operation| Port {
                instance: at,
                slot,
                operation,
            })
        });
        ports.collect::<Vec<Port>>()
    };
    let (handlers, outputs) = (ports(Direction::In), ports(Direction::Out));
    let reactions = component.reactions.as_ref();
    let reactions = reactions.map(|all| all.iter().map(|r| reaction(at, component, r)).collect());
    let collects = component.collects.iter().map(|collect| FlowCollect {
        ports: ports_of(at, component, &Step::Collected(collect.name.text.clone())),
        within: nanoseconds(collect.within),
    });
    FlowComponent {
        collects: collects.collect(),
        slots,
        handlers,
        reactions,
        outputs,
        period,
    }
}

fn reaction(at: usize, component: &Component, reaction: &Reaction) -> FlowReaction {
    let causes = match &reaction.cause {
        Step::Compute => None,
        step @ (Step::Operation { .. } | Step::Collected(_)) => Some(ports_of(at, component, step)),
    };
    let effects = reaction.effects.iter();
    FlowReaction {
        causes,
        sends: effects
            .flat_map(|step| ports_of(at, component, step))
            .collect(),
        computes: reaction.effects.contains(&Step::Compute),
        budget: reaction.budget.map(nanoseconds),
    }
}

/// The ports of a step: those of all members of an array.
fn ports_of(at: usize, component: &Component, step: &Step) -> Vec<Port> {
    let (slot, operation) = match step {
        Step::Compute => return Vec::new(),
        Step::Operation { slot, operation } => (slot, operation),
        Step::Collected(name) => {
            let mut collects = component.collects.iter();
            let collect = collects.find(|collect| collect.name.text == *name);
            let topics = collect.iter().flat_map(|collect| &collect.topics);
            let steps = topics.map(|(slot, operation)| Step::Operation {
                slot: slot.clone(),
                operation: operation.clone(),
            });
            return steps
                .flat_map(|step| ports_of(at, component, &step))
                .collect();
        }
    };
    let slots = component.slots.iter().enumerate().filter(|(_, own)| {
        let member = own.name.strip_prefix(slot.as_str());
        member.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    });
    let ports = slots.filter_map(|(number, own)| {
        let interface = component.library.interface(own.interface);
        let mut operations = interface.operations.iter();
        Some(Port {
            instance: at,
            slot: number,
            operation: operations.position(|o| o.name.text == *operation)?,
        })
    });
    ports.collect()
}

pub(super) fn nanoseconds(time: Duration) -> u64 {
    time.as_nanos().try_into().unwrap_or(u64::MAX)
}
