//! Collects the records of the components on chains from their management sockets, on a thread of
//! its own, so a component that does not answer delays only this thread.

use super::join::{Coverage, JoinedHop, Joiner};
use super::stalls::Stalls;
use super::{Chains, News, NewsSender};
use rc_deploy_network::plan::Plan;
use rc_deploy_network::planned_chain::{PlannedMessage, ReactsIn};
use rc_deploy_network::process_name;
use rc_management::chains::ChainStatus;
use rc_management::component::Request;
use rc_management::hops::{Following, Hop, HopReport, MOST_PAIRS, Message, Pair, Way};
use rc_management::{CallError, Client};
use rc_middleware::{RunDirectory, now};
use rc_observe::{Estimate, MachineClock, RemoteClock};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The time from one round to the next one.
const ROUND: Duration = Duration::from_millis(250);
/// The longest time for a component to answer. Its management has a thread of its own.
const LIMIT: Duration = Duration::from_secs(1);
/// Rounds before a component that did not answer is asked again.
const PAUSE: u32 = 2;
/// The most times in one answer to a tool, three for each component that a message passes: about
/// half of what an answer may have.
const MOST_TIMES: usize = 3 << 16;

/// The part of a pair in a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Its output begins the chain.
    Source,
    /// Its output goes to programs outside, before the hop with this number.
    Stamps(usize),
    /// It is the hop with this number.
    Hop(usize),
}

/// The connection to a component on a chain.
struct Connection {
    network: String,
    name: String,
    socket: PathBuf,
    pairs: Vec<Pair>,
    client: Option<Client>,
    /// Since when it is followed, and its senders, until they are handed over.
    following: Option<(u64, Following)>,
    /// Rounds until it is asked again.
    pause: u32,
    is_remote: bool,
    /// The clock of its machine, if that is another one.
    clock: Option<RemoteClock>,
}

/// The answer of a component in one round.
#[derive(Debug, Default)]
pub(super) struct Answer {
    /// Since when it is followed, if that has begun in this round, and its senders.
    pub(super) following: Option<(u64, Following)>,
    pub(super) taken: HopReport,
    /// How far its clock is ahead, and the greatest error.
    pub(super) ahead: (i64, u64),
}

/// A component on a chain.
#[derive(Debug)]
struct Followed {
    name: String,
    /// For each pair, its parts in chains.
    parts: Vec<Vec<(usize, Part)>>,
    /// For each pair, the first identity of what sends its output.
    own: Vec<u32>,
    coverage: Coverage,
    /// Why it cannot be followed.
    missing: Option<String>,
    taken: u64,
    overwritten: u64,
}

/// All chains of a network.
#[derive(Debug)]
pub(super) struct Collector {
    components: Vec<Followed>,
    pub(super) joiners: Vec<Joiner>,
    places: Vec<Places>,
}

/// Where the pairs of a chain are: indices of a component and one of its pairs.
#[derive(Debug)]
struct Places {
    source: Option<(usize, usize)>,
    hops: Vec<(usize, usize)>,
    /// The messages to programs outside, each with the number of the hop behind them.
    stamps: Vec<(usize, (usize, usize))>,
}

fn signed(ns: u64) -> i64 {
    i64::try_from(ns).unwrap_or(i64::MAX)
}

/// Nanoseconds since 1970.
fn unix_time() -> i64 {
    let time = SystemTime::now().duration_since(UNIX_EPOCH);
    signed(u64::try_from(time.unwrap_or_default().as_nanos()).unwrap_or(u64::MAX))
}

/// How far the wall clock is ahead of the monotonic one, in nanoseconds.
fn wall_clock() -> i64 {
    let look = |_| {
        let before = signed(now());
        let wall = unix_time();
        let took = signed(now()) - before;
        (took, wall - before - took / 2)
    };
    // The thread may be interrupted between two looks at clocks.
    let fastest = (0..4).map(look).min();
    fastest.map_or(0, |(_, ahead)| ahead)
}

fn message(of: &PlannedMessage) -> Message {
    Message {
        slot: of.slot.clone(),
        operation: of.operation.clone(),
    }
}

/// The pairs of each component on a chain, and where those of each chain are.
fn pairs_of(plan: &Plan) -> (Vec<(String, Vec<Pair>)>, Vec<Places>) {
    let mut components: Vec<(String, Vec<Pair>)> = Vec::new();
    let mut place = |name: &str, pair: Pair| {
        let at = components.iter().position(|(known, _)| known == name);
        let at = at.unwrap_or_else(|| {
            components.push((name.to_owned(), Vec::new()));
            components.len() - 1
        });
        let pairs = &mut components[at].1;
        let known = pairs.iter().position(|known| *known == pair);
        let number = known.unwrap_or_else(|| {
            pairs.push(pair);
            pairs.len() - 1
        });
        (at, number)
    };
    let places = plan.chains.iter().map(|chain| {
        let source = chain.source.as_ref().map(|source| {
            let pair = Pair {
                input: None,
                output: Some(message(source)),
                way: Way::Any,
                stamp: None,
            };
            place(&source.component, pair)
        });
        let outside = chain.hops.iter().enumerate();
        let outside = outside.filter_map(|(hop, planned)| Some((hop, planned.outside.as_ref()?)));
        let stamps = outside.map(|(hop, outside)| {
            let pair = Pair {
                input: None,
                output: Some(message(&outside.sent)),
                way: Way::Any,
                stamp: Some(outside.stamps[0].clone()),
            };
            (hop, place(&outside.sent.component, pair))
        });
        let stamps = stamps.collect();
        let hops = chain.hops.iter().map(|planned| {
            let outside = planned.outside.as_ref();
            let pair = Pair {
                input: Some(message(&planned.input)),
                output: planned.output.as_ref().map(message),
                way: match planned.reacts_in {
                    ReactsIn::Handler => Way::Handler,
                    ReactsIn::Compute => Way::Compute,
                    ReactsIn::Unknown => Way::Any,
                },
                stamp: outside.map(|outside| outside.stamps[1].clone()),
            };
            place(&planned.input.component, pair)
        });
        let hops = hops.collect();
        Places {
            source,
            hops,
            stamps,
        }
    });
    let places = places.collect();
    (components, places)
}

/// Starts the thread, which ends when the other end of `stopped` is dropped.
pub(super) fn start(
    plan: &Plan,
    directory: &RunDirectory,
    reporter: NewsSender,
    stopped: Receiver<()>,
) -> std::io::Result<Arc<Mutex<Collector>>> {
    let (components, _) = pairs_of(plan);
    let is_remote = |name: &str| {
        let mut all = plan.components.iter();
        all.any(|component| component.name == name && component.host.is_some())
    };
    let connections = components.into_iter().map(|(name, mut pairs)| {
        // The chains behind it are not measured, and report that.
        pairs.truncate(MOST_PAIRS);
        Connection {
            network: plan.network.clone(),
            socket: directory.socket(&process_name(&name)),
            is_remote: is_remote(&name),
            name,
            pairs,
            client: None,
            following: None,
            pause: 0,
            clock: None,
        }
    });
    let mut connections: Vec<Connection> = connections.collect();
    let collector = Arc::new(Mutex::new(Collector::new(plan, &Stalls::watch()?)));
    let shared = Arc::clone(&collector);
    std::thread::Builder::new()
        .name("chains".to_owned())
        .spawn(move || {
            while stopped.recv_timeout(ROUND) == Err(RecvTimeoutError::Timeout) {
                let begun = now();
                let answers = connections.iter_mut().map(Connection::ask).collect();
                let mut collector = shared.lock().unwrap_or_else(PoisonError::into_inner);
                let news = collector.round(signed(begun), answers);
                drop(collector);
                news.into_iter().for_each(|news| reporter.send(news));
            }
        })?;
    Ok(collector)
}

impl Connection {
    /// Requests the records. The error says why they are not available.
    fn ask(&mut self) -> Result<Answer, String> {
        if self.pause > 0 {
            self.pause -= 1;
            return Err("does not answer".to_owned());
        }
        let answer = self.exchange();
        if let Err(error) = &answer {
            self.client = None;
            self.clock = None;
            self.pause = PAUSE;
            return Err(match error {
                CallError::Io(_) | CallError::Closed => "does not run".to_owned(),
                CallError::Refused(error) => error.message.clone(),
                other @ (CallError::TimedOut(_) | CallError::Unexpected(_)) => other.to_string(),
            });
        }
        let ahead = self.ahead();
        let taken = answer.map_err(|error| error.to_string())?;
        if let (Err(_), Some((since, _))) = (&ahead, &mut self.following) {
            // The records of this round are lost.
            *since = now();
        }
        Ok(Answer {
            ahead: ahead?,
            following: self.following.take(),
            taken,
        })
    }

    /// Takes its records. A component that is new, or was started again, is followed first.
    fn exchange(&mut self) -> Result<HopReport, CallError> {
        let client = if let Some(client) = &mut self.client {
            client
        } else {
            let mut client = Client::connect(&self.socket, LIMIT)?;
            let pairs = self.pairs.clone();
            let answer = client.call(&Request::Follow { pairs }, LIMIT)?;
            self.following = Some((now(), answer));
            self.client.insert(client)
        };
        client.call(&Request::Hops, LIMIT)
    }

    /// How far its clock is ahead, and the greatest error.
    fn ahead(&mut self) -> Result<(i64, u64), String> {
        if !self.is_remote {
            return Ok((0, 0));
        }
        let clock = match self.clock.take() {
            Some(clock) => clock,
            None => {
                RemoteClock::start(&self.network, &self.name).map_err(|error| error.to_string())?
            }
        };
        match self.clock.insert(clock).estimate(MachineClock::Monotonic) {
            Estimate::Known(offset) => Ok((offset.ahead_ns, offset.uncertainty_ns)),
            Estimate::Pending => Err("its clock is not known yet".to_owned()),
            Estimate::Failed(why) | Estimate::Refused(why) => Err(why),
        }
    }
}

impl Collector {
    pub(super) fn new(plan: &Plan, stalls: &Arc<Mutex<Stalls>>) -> Self {
        let (components, places) = pairs_of(plan);
        let mut components: Vec<Followed> = components
            .into_iter()
            .map(|(name, pairs)| Followed {
                name,
                parts: vec![Vec::new(); pairs.len()],
                own: vec![0; pairs.len()],
                coverage: Coverage::default(),
                missing: Some("does not run".to_owned()),
                taken: 0,
                overwritten: 0,
            })
            .collect();
        for (number, places) in places.iter().enumerate() {
            if let Some((at, pair)) = places.source {
                components[at].parts[pair].push((number, Part::Source));
            }
            for (hop, (at, pair)) in &places.stamps {
                components[*at].parts[*pair].push((number, Part::Stamps(*hop)));
            }
            for (hop, (at, pair)) in places.hops.iter().enumerate() {
                components[*at].parts[*pair].push((number, Part::Hop(hop)));
            }
        }
        let chains = plan.chains.iter().cloned();
        let joiners = chains.map(|chain| Joiner::new(chain, Arc::clone(stalls)));
        Self {
            components,
            joiners: joiners.collect(),
            places,
        }
    }

    /// Takes the answers of all components, who were asked at `begun` or later. Returns what has
    /// changed.
    pub(super) fn round(&mut self, begun: i64, answers: Vec<Result<Answer, String>>) -> Vec<News> {
        let mut all = Vec::new();
        for (at, answer) in answers.into_iter().enumerate() {
            match answer {
                Ok(answer) => {
                    self.follow(at, &answer);
                    all.push((at, answer));
                }
                Err(why) => {
                    let component = &mut self.components[at];
                    component.coverage.since = None;
                    component.missing = Some(why);
                }
            }
        }
        // All senders are known now.
        for (at, answer) in all {
            self.add(at, &answer, begun);
        }
        let mut news = Vec::new();
        for (number, (joiner, places)) in self.joiners.iter_mut().zip(&self.places).enumerate() {
            let own = |(at, pair): &(usize, usize)| self.components[*at].own[*pair];
            joiner.add_early(&places.hops.iter().map(own).collect::<Vec<_>>());
            let coverage = |(at, pair): &(usize, usize)| {
                let is_followed = *pair < MOST_PAIRS;
                let coverage = self.components[*at].coverage;
                if is_followed {
                    coverage
                } else {
                    Coverage::default()
                }
            };
            let mut hops: Vec<Coverage> = places.hops.iter().map(coverage).collect();
            for (hop, (_, pair)) in &places.stamps {
                if *pair >= MOST_PAIRS {
                    hops[*hop] = Coverage::default();
                }
            }
            joiner.end_round(begun, places.source.as_ref().map(coverage), &hops);
            let changes = joiner.take_changes().into_iter();
            news.extend(changes.map(|change| News::Changed(number, change)));
        }
        news
    }

    /// Takes over whose messages are whose.
    fn follow(&mut self, at: usize, answer: &Answer) {
        let component = &mut self.components[at];
        component.missing = None;
        component.coverage.uncertainty = answer.ahead.1;
        let Some((since, following)) = &answer.following else {
            return;
        };
        let is_restart = component.coverage.was_followed;
        component.coverage.was_followed = true;
        component.coverage.since = Some(signed(*since));
        for (pair, senders) in following.senders.iter().enumerate() {
            let Some(parts) = component.parts.get(pair) else {
                break;
            };
            component.own[pair] = senders.first().copied().unwrap_or_default();
            for (chain, part) in parts {
                let joiner = &mut self.joiners[*chain];
                let next = match part {
                    Part::Source => 0,
                    Part::Hop(hop) => hop + 1,
                    Part::Stamps(_) => continue,
                };
                joiner.set_senders(next, senders);
                if let (Part::Hop(hop), true) = (part, is_restart) {
                    joiner.restarted(*hop);
                }
            }
        }
    }

    /// Adds the hops of a component.
    fn add(&mut self, at: usize, answer: &Answer, now: i64) {
        let component = &mut self.components[at];
        let ahead = answer.ahead.0;
        let here = |time: u64| signed(time).saturating_sub(ahead);
        let taken = &answer.taken;
        let was_active = std::mem::replace(&mut component.coverage.is_active, taken.active);
        let since = if taken.overwritten > 0 {
            // Records before the oldest one are unknown.
            let until = taken.hops.first().map_or(now, |hop| here(hop.left));
            component.coverage.overwritten_until = until;
            Some(until)
        } else if !taken.active || !was_active {
            Some(now)
        } else {
            None
        };
        // Perhaps it was not followed, because its clock was unknown.
        let known = component.coverage.since.or(Some(now));
        component.coverage.since = known.max(since);
        component.taken += taken.hops.len() as u64;
        component.overwritten += taken.overwritten;
        // It may have noted them while it did not answer.
        let may_be_old = answer.following.is_some();
        for hop in &taken.hops {
            let Hop {
                sender,
                pair,
                kind,
                input,
                output,
                ..
            } = *hop;
            let pair = usize::from(pair);
            let noted = JoinedHop {
                sender,
                kind,
                input,
                output,
                sent: if hop.sent == 0 { 0 } else { here(hop.sent) },
                stamp: hop.sent,
                begun: here(hop.begun),
                used: here(hop.used),
                left: here(hop.left),
            };
            let own = component.own.get(pair).copied().unwrap_or_default();
            for (chain, part) in component.parts.get(pair).into_iter().flatten() {
                let joiner = &mut self.joiners[*chain];
                if may_be_old && joiner.has_forgotten(noted.left, now) {
                    continue;
                }
                match part {
                    Part::Source => joiner.begin(own, output, noted.left),
                    Part::Stamps(hop) => joiner.stamped(*hop, (own, output), &noted),
                    Part::Hop(hop) => joiner.add(*hop, noted, own),
                }
            }
        }
    }

    /// The measurements of all chains. With `known`, also the messages that came to the end: for
    /// each chain, those after the first `known` ones, but no more than the newest.
    pub(super) fn status(&self, known: Option<&[u64]>) -> Chains {
        let most = MOST_TIMES / self.joiners.len().max(1);
        let wall_clock = wall_clock();
        let chains =
            self.joiners
                .iter()
                .zip(&self.places)
                .enumerate()
                .map(|(number, (joiner, places))| {
                    let mut on: Vec<(usize, usize)> = places.source.into_iter().collect();
                    on.extend(&places.hops);
                    let component = |(at, _): &(usize, usize)| &self.components[*at];
                    let coverage = on.iter().map(component).map(|component| {
                        let all = component.taken + component.overwritten;
                        if all == 0 {
                            1.0
                        } else {
                            component.taken as f64 / all as f64
                        }
                    });
                    let mut missing: Vec<String> = Vec::new();
                    for place in &on {
                        let Followed {
                            name, missing: why, ..
                        } = component(place);
                        let why = match why {
                            Some(why) => why,
                            None if place.1 >= MOST_PAIRS => "follows as many messages as it can",
                            None => continue,
                        };
                        let text = format!("{name} {why}");
                        if !missing.contains(&text) {
                            missing.push(text);
                        }
                    }
                    let status = joiner.status(coverage.fold(1.0, f64::min), missing);
                    let traces = known.map(|known| {
                        let known = known.get(number).copied().unwrap_or(0);
                        let times = 3 * (1 + places.hops.len());
                        joiner.measured.traces(known, most / times, wall_clock)
                    });
                    ChainStatus {
                        traces: traces.unwrap_or_default(),
                        ..status
                    }
                });
        Chains {
            chains: chains.collect(),
        }
    }
}
