//! The worst-case time of a chain of messages: an analysis of components as event loops.
//!
//! A component has one thread. It runs its handlers as messages arrive, one message of each port in
//! turn, and `compute()` once a period, after the handlers. Nothing interrupts a run. So a message is
//! handled, and a period is computed, at the latest at the end of the longest time in which the
//! thread is never idle: the busy window. It is the least `w` with
//!
//! ```text
//! w = ceil(w / P) · C + Σ ceil((w + J) / T) · B
//! ```
//!
//! over all streams of messages: period `P` and budget `C` of `compute()`, period `T` and jitter `J`
//! of a stream, budget `B` of its handler (Tindell, Clark: "Holistic schedulability analysis for
//! distributed hard real-time systems", 1994, without priorities). A message that passes a component
//! gets its busy window as jitter.
//!
//! Where the rate of a stream is not known, or there is more work than time, the limits of the event
//! loop are the bound: those of a turn, and the depth of queues whose ports take turns.
//!
//! All times are in nanoseconds.

/// The work of a component.
#[derive(Clone, Debug, Default)]
pub struct Component {
    /// The period of `compute()`.
    pub period: u64,
    /// The longest run of `compute()`.
    pub compute: u64,
    /// Its handlers.
    pub handlers: Vec<Handler>,
}

/// The handler of one operation.
#[derive(Clone, Debug, Default)]
pub struct Handler {
    /// Its longest run.
    pub budget: u64,
    /// The most messages that wait for it.
    pub depth: u32,
    /// Its senders.
    pub arrivals: Vec<Arrival>,
}

/// A sender of messages.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// When it sends.
    pub rate: Rate,
    /// The longest time on the way.
    pub transport: u64,
}

/// When a component sends a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// Once in a run of the `compute()` of this component.
    Compute(usize),
    /// Once in a run of a handler: a component, and one of its handlers.
    Handler(usize, usize),
    /// Any time: it is not part of the network.
    Unknown,
}

/// The way from a message to what follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Its handler sends it.
    Handler,
    /// The handler keeps the message for the next `compute()`.
    Compute,
}

/// A component on a chain.
#[derive(Clone, Copy, Debug)]
pub struct Hop {
    /// The component.
    pub component: usize,
    /// The handler of the message.
    pub handler: usize,
    /// The way to its output. The last component of a chain only handles the message.
    pub way: Way,
    /// The longest time of the message on its way to this component.
    pub transport: u64,
    /// The longest time until the messages come with which it is collected.
    pub collected: u64,
}

/// The longest times of a hop. Their sum is the bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// The way of the message to the component.
    pub transport: u64,
    /// Waiting for the messages with which it is collected, and for the next period.
    pub period: u64,
    /// Budgets: its own, and those of everything that the component does before.
    pub work: u64,
}

impl Cost {
    /// All of it.
    pub fn total(&self) -> u64 {
        self.transport
            .saturating_add(self.period)
            .saturating_add(self.work)
    }
}

/// Messages with a period, each late by at most the jitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stream {
    period: u64,
    jitter: u64,
}

impl Stream {
    /// The most messages in a time.
    fn count(self, time: u64) -> u64 {
        time.saturating_add(self.jitter)
            .div_ceil(self.period.max(1))
    }
}

/// The response of a component.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// For each handler, the longest time from the arrival of a message until its handler has run.
    /// `None`: there is no bound.
    pub handled: Vec<Option<u64>>,
    /// The longest time from the beginning of a period until `compute()` has run.
    pub computed: Option<u64>,
    /// The longest time from the beginning of the turn in which `compute()` runs until it has run. It
    /// uses the messages that are there when the turn begins, if they are handled in order.
    turn: u64,
    /// Whether a message that arrives before a period is handled before it.
    pub is_orderly: bool,
    /// Whether it has more work than time.
    pub is_overloaded: bool,
    /// For each handler, the streams that it receives. `None`: the rate is not known.
    streams: Vec<Option<Vec<Stream>>>,
}

impl Load {
    /// The most messages that may wait for a handler. `None` where only its queue bounds them, or where
    /// others come at any rate, which seldom all come at once.
    pub fn waiting(&self, handler: usize) -> Option<u64> {
        if self.is_overloaded || self.streams.iter().any(Option::is_none) {
            return None;
        }
        let window = self.handled.get(handler).copied().flatten()?;
        let streams = self.streams.get(handler)?.as_ref()?;
        Some(streams.iter().map(|stream| stream.count(window)).sum())
    }

    /// The longest time between two messages for a handler.
    fn gap(&self, handler: usize) -> Option<u64> {
        let streams = self.streams.get(handler)?.as_ref()?;
        let gaps = streams.iter().map(|s| s.period.saturating_add(s.jitter));
        gaps.min()
    }
}

/// The most handlers in a turn of the event loop of a component, and the time after which none begins.
const HANDLERS_A_TURN: u64 = 64;
const HANDLING_A_TURN: u64 = 100_000_000;
/// The most events that the event loop takes at once, less those of its timer and its waker.
const PORTS_A_TURN: usize = 14;
/// The most streams that are distinguished.
const STREAMS: usize = 64;
/// The most steps of a search for a fixed point. A load that needs more is near its limit.
const STEPS: usize = 10_000;
const ROUNDS: usize = 200;

/// The response of all components. Direct reactions must be free of cycles.
pub fn loads(components: &[Component]) -> Vec<Load> {
    let mut loads: Vec<Load> = components.iter().map(idle).collect();
    for round in 0..ROUNDS {
        let next: Vec<Load> = components
            .iter()
            .map(|component| {
                let streams = component.handlers.iter();
                let streams = streams.map(|handler| streams_of(handler, components, &loads));
                load(component, streams.collect())
            })
            .collect();
        if next == loads {
            return loads;
        }
        let is_last = round + 1 == ROUNDS;
        let before = std::mem::replace(&mut loads, next);
        if is_last {
            // A value that still grows is bounded only by its queues.
            for ((load, before), component) in loads.iter_mut().zip(before).zip(components) {
                if *load != before {
                    let streams = std::mem::take(&mut load.streams);
                    *load = by_queues(component, streams, true);
                }
            }
        }
    }
    loads
}

/// A component before anything is known of its peers.
fn idle(component: &Component) -> Load {
    let none = component.handlers.iter();
    let none = none.map(|handler| {
        let is_known = handler.arrivals.iter().all(|a| a.rate != Rate::Unknown);
        is_known.then(Vec::new)
    });
    load(component, none.collect())
}

fn streams_of(handler: &Handler, components: &[Component], loads: &[Load]) -> Option<Vec<Stream>> {
    let mut streams = Vec::new();
    for arrival in &handler.arrivals {
        match arrival.rate {
            Rate::Unknown => return None,
            Rate::Compute(at) => streams.push(Stream {
                period: components[at].period,
                jitter: loads[at].computed?.saturating_add(arrival.transport),
            }),
            Rate::Handler(at, handler) => {
                let late = loads[at].handled[handler]?.saturating_add(arrival.transport);
                let passed = loads[at].streams[handler].as_ref()?.iter();
                streams.extend(passed.map(|stream| Stream {
                    jitter: stream.jitter.saturating_add(late),
                    ..*stream
                }));
            }
        }
        if streams.len() > STREAMS {
            return None;
        }
    }
    Some(streams)
}

fn load(component: &Component, streams: Vec<Option<Vec<Stream>>>) -> Load {
    let known: Option<Vec<(u64, &[Stream])>> = component
        .handlers
        .iter()
        .zip(&streams)
        .map(|(handler, streams)| Some((handler.budget, streams.as_deref()?)))
        .collect();
    let Some(known) = known else {
        return by_queues(component, streams, false);
    };
    let Some(window) = busy_window(component, &known) else {
        return by_queues(component, streams, true);
    };
    let counts = known.iter().map(|(budget, streams)| {
        let count: u64 = streams.iter().map(|stream| stream.count(window)).sum();
        (count, count.saturating_mul(*budget))
    });
    let (messages, work) = counts.fold((0, 0_u64), |(messages, work), (count, time)| {
        (messages + count, work.saturating_add(time))
    });
    Load {
        handled: vec![Some(window); component.handlers.len()],
        computed: Some(window),
        turn: window,
        is_orderly: messages <= HANDLERS_A_TURN
            && work <= HANDLING_A_TURN
            && component.handlers.len() <= PORTS_A_TURN,
        is_overloaded: false,
        streams,
    }
}

/// An hour, in ns. No component is that late.
const LONGEST_WINDOW: u64 = 3_600_000_000_000;

/// The busy window of a component. `None` if it has more work than time.
fn busy_window(component: &Component, handlers: &[(u64, &[Stream])]) -> Option<u64> {
    let period = component.period.max(1);
    let share = |work: u64, period: u64| work as f64 / period.max(1) as f64;
    let streams = || {
        let handlers = handlers.iter();
        handlers.flat_map(|(budget, streams)| streams.iter().map(move |s| (*budget, *s)))
    };
    let of_handlers: f64 = streams().map(|(budget, s)| share(budget, s.period)).sum();
    if share(component.compute, period) + of_handlers >= 1.0 {
        return None;
    }
    let work = |window: u64| {
        let computes = window.div_ceil(period).max(1);
        let mut work = computes.saturating_mul(component.compute);
        for (budget, stream) in streams() {
            work = work.saturating_add(stream.count(window).max(1).saturating_mul(budget));
        }
        work
    };
    let mut window = work(0);
    for _ in 0..STEPS {
        let next = work(window);
        if next <= window {
            return Some(window);
        }
        // Components that feed each other may have no end of work.
        if next > LONGEST_WINDOW {
            return None;
        }
        window = next;
    }
    None
}

/// The response of a component whose work is not known, or too much. Its turns have an end, and in
/// each one its ports take turns.
///
/// A message waits at most for the run that has begun, or, if its port was empty when the turn began,
/// for the others in that turn. Then one message of each port runs before each one of its own port.
fn by_queues(
    component: &Component,
    streams: Vec<Option<Vec<Stream>>>,
    is_overloaded: bool,
) -> Load {
    let (period, compute) = (component.period.max(1), component.compute);
    let budgets = || component.handlers.iter().map(|handler| handler.budget);
    let round: u64 = budgets().fold(0, u64::saturating_add);
    let turn = turn(budgets());
    let has_time = compute < period;
    let rounds = rounds_a_turn(component.handlers.len(), round);
    let mut is_orderly = component.handlers.len() <= PORTS_A_TURN;
    let handlers = component.handlers.iter().zip(&streams).enumerate();
    let handled = handlers.map(|(at, (handler, streams))| {
        let others = budgets().enumerate().filter(|(other, _)| *other != at);
        // The turn may end before its port in a round.
        let longest = budgets().max().unwrap_or(0).max(compute);
        let begun = longest.saturating_add(round);
        let begun = begun.max(self::turn(others.map(|(_, budget)| budget)));
        let depth = u64::from(handler.depth.max(1));
        // Messages of its port, itself included.
        let own = |window: u64| match streams {
            Some(streams) if !is_overloaded => {
                let counts = streams.iter().map(|stream| stream.count(window));
                counts.fold(0, u64::saturating_add).clamp(1, depth)
            }
            _ => depth,
        };
        let work = |window: u64| {
            let own = own(window);
            let Some(rounds) = rounds else {
                // One message in a turn, of one of the ports.
                let turns = own.saturating_mul(component.handlers.len() as u64);
                return turns.saturating_mul(turn.saturating_add(compute));
            };
            let turns = own.div_ceil(rounds);
            let computes = turns.min(window.div_ceil(period).saturating_add(1));
            begun
                .saturating_add((own + turns - 1).saturating_mul(round))
                .saturating_add(computes.saturating_mul(compute))
        };
        let mut window = work(0);
        for _ in 0..STEPS {
            let next = work(window);
            if next <= window {
                is_orderly &= rounds.is_some_and(|rounds| own(window) <= rounds);
                return has_time.then_some(window);
            }
            window = next;
        }
        None
    });
    let handled = handled.collect();
    // The turn that runs when the period begins, then the one that computes.
    let computed = turn.saturating_add(compute).saturating_mul(2);
    Load {
        handled,
        computed: has_time.then_some(computed),
        turn: turn.saturating_add(compute),
        is_orderly,
        is_overloaded: is_overloaded || !has_time,
        streams,
    }
}

/// The longest time of handlers in a turn of the event loop.
fn turn(budgets: impl Iterator<Item = u64>) -> u64 {
    let longest = budgets.max().unwrap_or(0);
    let by_time = HANDLING_A_TURN.saturating_add(longest);
    HANDLERS_A_TURN.saturating_mul(longest).min(by_time)
}

/// In how many rounds of a turn each port that was ready is served. `None` if a turn may end before.
fn rounds_a_turn(ports: usize, round: u64) -> Option<u64> {
    let by_number = HANDLERS_A_TURN / (ports as u64).max(1);
    let by_time = HANDLING_A_TURN / round.max(1);
    Some(by_number.min(by_time)).filter(|rounds| *rounds > 0 && ports <= PORTS_A_TURN)
}

/// The longest times of each hop of a chain. `None` if a component has no bound.
pub fn costs(hops: &[Hop], components: &[Component], loads: &[Load]) -> Option<Vec<Cost>> {
    let hops = hops.iter().map(|hop| {
        let load = &loads[hop.component];
        let handled = load.handled[hop.handler]?;
        Some(match hop.way {
            Way::Handler => Cost {
                transport: hop.transport,
                period: hop.collected,
                work: handled,
            },
            // A message that comes before a period is handled before its `compute()`.
            Way::Compute => Cost {
                transport: hop.transport,
                period: components[hop.component]
                    .period
                    .saturating_add(hop.collected),
                work: if load.is_orderly {
                    load.computed?
                } else {
                    handled.saturating_add(load.computed?)
                },
            },
        })
    });
    hops.collect()
}

/// The age of the oldest data in any effect of a chain whose first message comes at the latest after
/// `gap`. `None` if there is no bound.
///
/// A `compute()` uses the newest message that it has. The next one was sent at most a gap later, and had
/// not come yet after the longest time on its way.
pub fn age(
    hops: &[Hop],
    first_gap: Option<u64>,
    components: &[Component],
    loads: &[Load],
) -> Option<u64> {
    // The way is that since the last `compute()`, and the gap that between what it sends.
    let (mut age, mut way, mut gap) = (0_u64, 0_u64, first_gap);
    for hop in hops {
        let load = &loads[hop.component];
        let handled = load.handled[hop.handler]?;
        way = way
            .saturating_add(hop.transport)
            .saturating_add(hop.collected);
        match hop.way {
            Way::Handler => way = way.saturating_add(handled),
            Way::Compute => {
                let computed = load.computed?;
                let waited = if load.is_orderly {
                    load.turn
                } else {
                    handled.saturating_add(computed)
                };
                age = age
                    .saturating_add(way)
                    .saturating_add(gap?)
                    .saturating_add(waited);
                way = 0;
                gap = Some(components[hop.component].period.saturating_add(computed));
            }
        }
    }
    Some(age.saturating_add(way))
}

/// The longest time between two messages of a sender.
pub fn gap(rate: Rate, components: &[Component], loads: &[Load]) -> Option<u64> {
    match rate {
        Rate::Unknown => None,
        Rate::Compute(at) => Some(components[at].period.saturating_add(loads[at].computed?)),
        Rate::Handler(at, handler) => {
            let handled = loads[at].handled[handler]?;
            Some(loads[at].gap(handler)?.saturating_add(handled))
        }
    }
}

#[cfg(test)]
mod tests;
