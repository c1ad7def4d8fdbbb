//! How long messages are on their way over the connections of a network, as the components that
//! receive them note it.

use crate::clock::{Estimate, MachineClock, RemoteClock};
use crate::network::{Component, End, Network, connect, failed};
use rc_deploy_client::connection;
use rc_diagnostics::foreign::clean;
use rc_management::Client;
use rc_management::chains::Times;
use rc_management::component::{Request, Role};
use rc_management::hops::{Following, Hop, HopReport, MOST_PAIRS, Message, Pair, Way};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::time::{Duration, Instant};

/// The time from one round to the next one: a component keeps 640 notes of each operation.
const ROUND: Duration = Duration::from_millis(200);
/// How long a component may take to reply.
const LIMIT: Duration = Duration::from_secs(1);
/// How many times of a connection are kept: the last ones.
const MOST_TIMES: usize = 1 << 16;

/// The latencies of a network.
#[derive(Debug, Default)]
pub struct Latencies {
    /// The connections, by their ends.
    pub connections: Vec<ConnectionLatency>,
    /// What could not be measured, and why.
    pub notes: Vec<String>,
}

/// The latency of one operation between two components.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConnectionLatency {
    /// The sender: `COMPONENT.SLOT`, or the component. `None`: a program outside of the network.
    pub from: Option<String>,
    /// The receiver, `COMPONENT.SLOT.OPERATION`.
    pub to: String,
    /// The middleware of the receiver.
    pub middleware: String,
    /// How many messages arrived. `None`: the supervisor has measured them since the network is up,
    /// for a chain.
    pub messages: Option<u64>,
    /// From sending a sample or a request to the begin of its handler.
    pub times: Option<Times>,
    /// The greatest error of the times, in milliseconds, if the ends are on different machines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_ms: Option<f64>,
}

/// How far a clock is ahead, and the greatest error, in nanoseconds. `None`: that is unknown.
type Ahead = Option<(i64, u64)>;

/// A component whose messages are followed.
struct Followed<'n> {
    network: &'n str,
    component: &'n Component,
    client: Client,
    inputs: Vec<Input<'n>>,
    /// The clock of its machine, if that is another one.
    clock: Option<RemoteClock>,
    ahead: Ahead,
    /// Why it gives no more notes.
    lost: Option<String>,
}

/// An operation that a component receives.
struct Input<'n> {
    slot: &'n str,
    operation: &'n str,
    middleware: &'n str,
    /// The sender, if there is one only.
    only: Option<End>,
    /// The messages, by their sender.
    messages: BTreeMap<Option<End>, Collected>,
}

/// The messages of one connection.
#[derive(Default)]
struct Collected {
    count: u64,
    ns: Vec<u64>,
    worst: u64,
    error: u64,
}

/// Measures all connections of a network for so long. Calls count from their client to the handler
/// of their server.
pub fn latencies(network: &Network, time: Duration) -> Latencies {
    let mut all = Latencies::default();
    all.notes
        .extend(network.silent.iter().map(|why| clean(why)));
    let on_chains = all.take_chains(network);
    let mut senders: HashMap<u32, End> = HashMap::new();
    let mut followed = Vec::new();
    let only = only_senders(network);
    for component in &network.components {
        if on_chains.contains(&component.name) {
            continue;
        }
        match Followed::begin(network, component, &only, &mut senders) {
            Ok((one, 0)) => followed.push(one),
            Ok((one, left_out)) => {
                let name = clean(&component.name);
                let note = format!(
                    "{name} notes {MOST_PAIRS} operations at a time; {left_out} are not measured"
                );
                all.notes.push(note);
                followed.push(one);
            }
            Err(reason) => all.notes.push(reason),
        }
    }
    let begun = Instant::now();
    loop {
        let is_last = begun.elapsed() >= time;
        let reports: Vec<HopReport> = followed.iter_mut().map(Followed::take).collect();
        let clocks = followed.iter();
        let clocks: HashMap<&str, Ahead> = clocks
            .map(|one| (one.component.name.as_str(), one.ahead))
            .collect();
        for (one, report) in followed.iter_mut().zip(&reports) {
            report
                .hops
                .iter()
                .for_each(|hop| one.add(hop, &senders, &clocks));
        }
        if is_last {
            break;
        }
        std::thread::sleep(ROUND.min(time.saturating_sub(begun.elapsed())));
    }
    for one in followed {
        all.notes.extend(one.lost.clone());
        all.connections.extend(one.connections());
    }
    let key = |one: &ConnectionLatency| (one.from.clone(), one.to.clone());
    all.connections.sort_by_key(key);
    all
}

impl Latencies {
    /// Takes what the supervisor has measured for the chains of the network, whose components note
    /// messages for it alone. Returns them.
    fn take_chains(&mut self, network: &Network) -> BTreeSet<String> {
        let chains = connection::chains(&network.name, None).map(|report| report.chains);
        let mut on_chains = BTreeSet::new();
        for chain in chains.unwrap_or_default() {
            let first = chain.from.rsplit_once('.').map_or("", |(end, _)| end);
            let mut from = first.to_owned();
            on_chains.extend(
                first
                    .rsplit_once('.')
                    .map(|(component, _)| component.to_owned()),
            );
            for hop in chain.hops {
                let to = format!("{}.{}", hop.component, hop.receives);
                let slot = hop.receives.split('.').next();
                let component = network.component(&hop.component);
                let mut slots = component.iter().flat_map(|one| &one.described.slots);
                let slot = slots.find(|one| Some(one.name.as_str()) == slot);
                let error = Some(chain.uncertainty_ms).filter(|error| *error > 0.0);
                let one = ConnectionLatency {
                    from: Some(std::mem::replace(&mut from, hop.component.clone())),
                    to,
                    middleware: slot.map(|slot| slot.middleware.clone()).unwrap_or_default(),
                    messages: None,
                    times: hop.way,
                    error_ms: error,
                };
                let is_new =
                    |known: &ConnectionLatency| known.from != one.from || known.to != one.to;
                if self.connections.iter().all(is_new) {
                    self.connections.push(one);
                }
                on_chains.insert(hop.component);
            }
        }
        if !on_chains.is_empty() {
            let names: Vec<&str> = on_chains.iter().map(String::as_str).collect();
            let names = clean(&names.join(", "));
            self.notes.push(format!(
                "{names}: the supervisor follows their messages for chains; only the connections on chains are shown, since the network is up"
            ));
        }
        on_chains
    }
}

impl<'n> Followed<'n> {
    /// Learns who sends as this component, then follows what it receives. Also returns how many
    /// operations are left out.
    fn begin(
        network: &'n Network,
        component: &'n Component,
        only: &HashMap<(&str, &str, &str), End>,
        senders: &mut HashMap<u32, End>,
    ) -> Result<(Self, usize), String> {
        let name = component.name.as_str();
        let client = connect(&network.name, name, LIMIT);
        let mut client = client.map_err(|error| error.to_string())?;
        let operations = |receives: bool| {
            let slots = component.described.slots.iter();
            let slots = slots.filter(move |slot| {
                let is_input = matches!(slot.role, Role::Implements | Role::SubscribesTo);
                is_input == receives
            });
            slots.flat_map(|slot| {
                slot.operations
                    .iter()
                    .map(move |operation| (slot, operation))
            })
        };
        let outputs: Vec<_> = operations(false).take(MOST_PAIRS).collect();
        let message = |slot: &str, operation: &str| {
            Some(Message {
                slot: slot.to_owned(),
                operation: operation.to_owned(),
            })
        };
        let pairs = outputs.iter().map(|(slot, operation)| Pair {
            input: None,
            output: message(&slot.name, &operation.name),
            way: Way::Any,
            stamp: None,
        });
        let mut follow = |pairs: Vec<Pair>| {
            let answer = client.call::<Following>(&Request::Follow { pairs }, LIMIT);
            answer.map_err(|error| failed(name, &error).to_string())
        };
        let following = follow(pairs.collect())?;
        for ((slot, _), own) in outputs.iter().zip(following.senders) {
            let end = End {
                component: name.to_owned(),
                slot: slot.name.clone(),
                host: component.host.clone(),
                middlewares: Vec::new(),
            };
            senders.extend(own.into_iter().map(|sender| (sender, end.clone())));
        }
        let inputs = operations(true)
            .take(MOST_PAIRS)
            .map(|(slot, operation)| Input {
                slot: &slot.name,
                operation: &operation.name,
                middleware: &slot.middleware,
                only: only.get(&(name, &*slot.name, &*operation.name)).cloned(),
                messages: BTreeMap::new(),
            });
        let inputs: Vec<Input<'n>> = inputs.collect();
        let pairs = inputs.iter().map(|input| Pair {
            input: message(input.slot, input.operation),
            output: None,
            way: Way::Handler,
            stamp: None,
        });
        follow(pairs.collect())?;
        let one = Self {
            network: &network.name,
            component,
            client,
            inputs,
            clock: None,
            ahead: Some((0, 0)),
            lost: None,
        };
        Ok((one, operations(true).count().saturating_sub(MOST_PAIRS)))
    }

    /// Takes its notes of this round.
    fn take(&mut self) -> HopReport {
        // Nothing is followed for a component that receives nothing.
        if self.lost.is_some() || self.inputs.is_empty() {
            return HopReport::default();
        }
        self.ahead = self.look_at_clock();
        let answer = self.client.call(&Request::Hops, LIMIT);
        answer.unwrap_or_else(|error| {
            self.lost = Some(failed(&self.component.name, &error).to_string());
            HopReport::default()
        })
    }

    fn look_at_clock(&mut self) -> Ahead {
        if self.component.host.is_none() {
            return Some((0, 0));
        }
        if self.clock.is_none() {
            self.clock = RemoteClock::start(self.network, &self.component.name).ok();
        }
        match self.clock.as_ref()?.estimate(MachineClock::Monotonic) {
            Estimate::Known(offset) => Some((offset.ahead_ns, offset.uncertainty_ns)),
            Estimate::Pending | Estimate::Failed(_) | Estimate::Refused(_) => None,
        }
    }

    /// Adds a message. Ends on different machines need both clocks.
    fn add(&mut self, hop: &Hop, senders: &HashMap<u32, End>, clocks: &HashMap<&str, Ahead>) {
        let Some(input) = self.inputs.get_mut(usize::from(hop.pair)) else {
            return;
        };
        let sender = senders.get(&hop.sender).or(input.only.as_ref());
        // A program outside runs on the machine of the receiver, as far as is known.
        let is_same = sender.is_none_or(|end| end.host == self.component.host);
        let theirs = match sender {
            Some(end) if !is_same => clocks.get(end.component.as_str()).copied().flatten(),
            _ => Some((0, 0)),
        };
        let own = if is_same { Some((0, 0)) } else { self.ahead };
        let one = input.messages.entry(sender.cloned()).or_default();
        one.count += 1;
        let (Some(own), Some(theirs), 1..) = (own, theirs, hop.sent) else {
            return;
        };
        let here = |time: u64, ahead: i64| i128::from(time) - i128::from(ahead);
        let ns = here(hop.begun, own.0) - here(hop.sent, theirs.0);
        let ns = u64::try_from(ns.max(0)).unwrap_or(u64::MAX);
        one.error = one.error.max(own.1.saturating_add(theirs.1));
        one.worst = one.worst.max(ns);
        let timed = (one.count - 1) as usize;
        if one.ns.len() < MOST_TIMES {
            one.ns.push(ns);
        } else {
            one.ns[timed % MOST_TIMES] = ns;
        }
    }

    /// Its connections. One over which nothing came is also one.
    fn connections(self) -> impl Iterator<Item = ConnectionLatency> {
        let name = &self.component.name;
        self.inputs.into_iter().flat_map(move |mut input| {
            if let Some(only) = input.only.take() {
                input.messages.entry(Some(only)).or_default();
            }
            let to = format!("{name}.{}.{}", input.slot, input.operation);
            input
                .messages
                .into_iter()
                .map(move |(end, of)| ConnectionLatency {
                    from: end.map(|end| end.to_string()),
                    to: to.clone(),
                    middleware: input.middleware.to_owned(),
                    messages: Some(of.count),
                    times: Times::of(of.ns.into_iter().map(ms), ms(of.worst)),
                    error_ms: Some(ms(of.error)).filter(|error| *error > 0.0),
                })
        })
    }
}

fn ms(ns: u64) -> f64 {
    ns as f64 / 1e6
}

/// The senders of inputs that have one only, by component, slot and operation.
fn only_senders(network: &Network) -> HashMap<(&str, &str, &str), End> {
    let mut all: Vec<(Vec<End>, Vec<String>, Vec<End>)> = Vec::new();
    for topic in network.topics() {
        all.push((
            topic.subscribers,
            vec![topic.operation.name],
            topic.publishers,
        ));
    }
    for service in network.services() {
        let operations = service.interface.operations.iter();
        let names = operations.map(|operation| operation.name.clone()).collect();
        all.push((service.servers, names, service.clients));
    }
    let mut only = HashMap::new();
    for (receivers, operations, mut senders) in all {
        if senders.len() != 1 {
            continue;
        }
        let Some(sender) = senders.pop() else {
            continue;
        };
        let sender = End {
            middlewares: Vec::new(),
            ..sender
        };
        for component in &network.components {
            for slot in &component.described.slots {
                let is_meant = |end: &End| end.component == component.name && end.slot == slot.name;
                if !receivers.iter().any(is_meant) {
                    continue;
                }
                for operation in &slot.operations {
                    if operations.contains(&operation.name) {
                        let key = (&*component.name, &*slot.name, &*operation.name);
                        only.insert(key, sender.clone());
                    }
                }
            }
        }
    }
    only
}
