//! The bound beside a simulation of event loops, event by event, with random phases. The simulation
//! shares no code with the analysis: it runs turns as a component does.

use super::*;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

const US: u64 = 1_000;
const MS: u64 = 1_000_000;

/// Random numbers (Marsaglia, xorshift64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end.max(1)
    }

    /// The longest time often, else any shorter one.
    fn at_most(&mut self, longest: u64) -> u64 {
        if self.next().is_multiple_of(4) {
            self.below(longest + 1)
        } else {
            longest
        }
    }
}

/// Where a message goes: a component, its handler, its time on the way.
type Target = (usize, usize, u64);

/// A component of the simulation.
#[derive(Clone, Default)]
struct Node {
    period: u64,
    compute: u64,
    /// Targets of the messages of `compute()`.
    sends: Vec<Target>,
    handlers: Vec<Reception>,
}

#[derive(Clone, Default)]
struct Reception {
    budget: u64,
    depth: usize,
    /// Targets of the messages of its handler.
    sends: Vec<Target>,
    /// Whether `compute()` uses its messages.
    kept: bool,
}

/// A net, with the chain from the messages of `first` to the handler `last`.
struct Net {
    nodes: Vec<Node>,
    /// The component whose `compute()` begins the chain.
    first: usize,
    /// The component and the handler that end it.
    last: (usize, usize),
    hops: Vec<Hop>,
    /// A handler that gets bursts of messages from outside: component, handler.
    outside: Option<(usize, usize)>,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    Tick(usize),
    /// A message arrives, made of the first message that was sent at this time.
    Arrives(usize, usize, u64),
    /// A run has ended.
    Ends(usize),
}

/// The work of a thread.
#[derive(Clone, Copy)]
enum Run {
    Handler(usize, u64),
    Compute,
}

#[derive(Default)]
struct Thread {
    queues: Vec<VecDeque<u64>>,
    ticked: bool,
    /// The newest first message that a handler has kept.
    kept: u64,
    running: Option<Run>,
    in_turn: bool,
    ready: Vec<bool>,
    due: bool,
    left: u32,
    next: usize,
    first: usize,
}

struct Simulation<'n> {
    net: &'n Net,
    random: Random,
    threads: Vec<Thread>,
    events: BinaryHeap<Reverse<(u64, u64, Event)>>,
    count: u64,
    /// First messages that have no effect yet.
    pending: VecDeque<u64>,
    slowest: u64,
    oldest: u64,
    begun: u64,
}

impl<'n> Simulation<'n> {
    fn new(net: &'n Net, seed: u64) -> Self {
        let threads = net.nodes.iter().map(|node| Thread {
            queues: vec![VecDeque::new(); node.handlers.len()],
            ready: vec![false; node.handlers.len()],
            ..Thread::default()
        });
        let mut simulation = Self {
            net,
            random: Random(seed | 1),
            threads: threads.collect(),
            events: BinaryHeap::new(),
            count: 0,
            pending: VecDeque::new(),
            slowest: 0,
            oldest: 0,
            begun: 0,
        };
        for _ in 0..8 {
            simulation.random.next();
        }
        for (at, node) in net.nodes.iter().enumerate() {
            let phase = simulation.random.below(node.period);
            simulation.at(phase, Event::Tick(at));
        }
        simulation
    }

    fn at(&mut self, time: u64, event: Event) {
        self.count += 1;
        self.events.push(Reverse((time, self.count, event)));
    }

    fn run(&mut self, until: u64, warm: u64) {
        self.begun = warm;
        while let Some(Reverse((now, _, event))) = self.events.pop() {
            if now > until {
                return;
            }
            match event {
                Event::Tick(at) => {
                    self.threads[at].ticked = true;
                    let period = self.net.nodes[at].period;
                    self.at(now + period, Event::Tick(at));
                    if let Some((to, handler)) = self.net.outside
                        && at == to
                    {
                        for _ in 0..self.random.below(6) {
                            let late = self.random.below(period);
                            self.at(now + late, Event::Arrives(to, handler, 0));
                        }
                    }
                    self.wake(at, now);
                }
                Event::Arrives(at, handler, origin) => {
                    let queue = &mut self.threads[at].queues[handler];
                    queue.push_back(origin);
                    if queue.len() > self.net.nodes[at].handlers[handler].depth {
                        queue.pop_front();
                    }
                    self.wake(at, now);
                }
                Event::Ends(at) => self.ends(at, now),
            }
        }
    }

    fn wake(&mut self, at: usize, now: u64) {
        if self.threads[at].running.is_none() {
            self.turn(at, now);
        }
    }

    /// Goes on with a turn of the loop, or begins one.
    fn turn(&mut self, at: usize, now: u64) {
        let node = &self.net.nodes[at];
        let thread = &mut self.threads[at];
        loop {
            if !thread.in_turn {
                let mut work = thread.ticked;
                for (queue, ready) in thread.queues.iter().zip(&mut thread.ready) {
                    *ready |= !queue.is_empty();
                    work |= *ready;
                }
                if !work {
                    return;
                }
                thread.in_turn = true;
                thread.due = std::mem::take(&mut thread.ticked);
                thread.left = 64;
                let ports = thread.queues.len().max(1);
                thread.first = (thread.first + 1) % ports;
                thread.next = thread.first;
            }
            if thread.left > 0 && thread.ready.iter().any(|ready| *ready) {
                let port = thread.next;
                thread.next = (port + 1) % thread.queues.len();
                if !thread.ready[port] {
                    continue;
                }
                let Some(origin) = thread.queues[port].pop_front() else {
                    thread.ready[port] = false;
                    continue;
                };
                thread.left -= 1;
                thread.running = Some(Run::Handler(port, origin));
                let took = self.random.at_most(node.handlers[port].budget);
                return self.at(now + took, Event::Ends(at));
            }
            thread.in_turn = false;
            if std::mem::take(&mut thread.due) {
                thread.running = Some(Run::Compute);
                let took = self.random.at_most(node.compute);
                return self.at(now + took, Event::Ends(at));
            }
        }
    }

    fn ends(&mut self, at: usize, now: u64) {
        let node = &self.net.nodes[at];
        match self.threads[at].running.take() {
            Some(Run::Handler(port, origin)) => {
                let handler = &node.handlers[port];
                if handler.kept {
                    let kept = &mut self.threads[at].kept;
                    *kept = (*kept).max(origin);
                }
                if (at, port) == self.net.last {
                    self.effect(origin, now);
                }
                self.send(&handler.sends, origin, now);
            }
            Some(Run::Compute) => {
                let begins = at == self.net.first;
                let origin = if begins { now } else { self.threads[at].kept };
                if begins && now >= self.begun {
                    self.pending.push_back(now);
                }
                self.send(&node.sends, origin, now);
            }
            None => {}
        }
        self.turn(at, now);
    }

    fn send(&mut self, targets: &[Target], origin: u64, now: u64) {
        for (to, handler, transport) in targets {
            let time = now + self.random.at_most(*transport);
            self.at(time, Event::Arrives(*to, *handler, origin));
        }
    }

    fn effect(&mut self, origin: u64, now: u64) {
        while self.pending.front().is_some_and(|sent| *sent <= origin) {
            if let Some(sent) = self.pending.pop_front() {
                self.slowest = self.slowest.max(now - sent);
            }
        }
        if origin >= self.begun {
            self.oldest = self.oldest.max(now - origin);
        }
    }
}

impl Net {
    /// The components for the analysis, from the same net.
    fn analysed(&self) -> Vec<Component> {
        let mut all: Vec<Component> = self
            .nodes
            .iter()
            .map(|node| Component {
                period: node.period,
                compute: node.compute,
                handlers: node
                    .handlers
                    .iter()
                    .map(|handler| Handler {
                        budget: handler.budget,
                        depth: handler.depth as u32,
                        arrivals: Vec::new(),
                    })
                    .collect(),
            })
            .collect();
        for (at, node) in self.nodes.iter().enumerate() {
            let computed = node.sends.iter().map(|target| (Rate::Compute(at), target));
            let handled = node.handlers.iter().enumerate().flat_map(|(number, of)| {
                let rate = Rate::Handler(at, number);
                of.sends.iter().map(move |target| (rate, target))
            });
            for (rate, (to, handler, transport)) in computed.chain(handled) {
                let transport = *transport;
                let arrivals = &mut all[*to].handlers[*handler].arrivals;
                arrivals.push(Arrival { rate, transport });
            }
        }
        if let Some((to, handler)) = self.outside {
            let arrivals = &mut all[to].handlers[handler].arrivals;
            arrivals.push(Arrival {
                rate: Rate::Unknown,
                transport: 0,
            });
        }
        all
    }

    fn bounds(&self) -> (u64, u64) {
        let components = self.analysed();
        let loads = loads(&components);
        let costs = costs(&self.hops, &components, &loads).expect("a bound");
        let first = gap(Rate::Compute(self.first), &components, &loads);
        let age = age(&self.hops, first, &components, &loads);
        (
            costs.iter().map(Cost::total).sum(),
            age.expect("a bound of the age"),
        )
    }

    /// The slowest chain and the oldest data of many schedules.
    fn simulated(&self) -> (u64, u64) {
        let schedules = std::env::var("RC_SCHEDULES").ok();
        let schedules = schedules.and_then(|n| n.parse().ok()).unwrap_or(1000);
        let longest = self.nodes.iter().map(|node| node.period).max();
        let longest = longest.unwrap_or(MS);
        let (mut slowest, mut oldest) = (0, 0);
        for schedule in 0..schedules {
            let seed = (schedule + 1_u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mut simulation = Simulation::new(self, seed);
            simulation.run(12 * longest, 4 * longest);
            slowest = slowest.max(simulation.slowest);
            oldest = oldest.max(simulation.oldest);
        }
        (slowest, oldest)
    }

    /// The bounds are never below the simulation, and within `ratio` of it.
    fn check(&self, name: &str, ratio: f64) {
        let (bound, age) = self.bounds();
        let (slowest, oldest) = self.simulated();
        println!(
            "{name}: bound {bound} of {slowest}, {:.3}; age {age} of {oldest}, {:.3}",
            bound as f64 / slowest as f64,
            age as f64 / oldest as f64
        );
        assert!(slowest > 0 && oldest > 0, "{name}: the chain has effects");
        assert!(bound >= slowest, "{name}: {bound} is below {slowest}");
        assert!(age >= oldest, "{name}: an age of {age} is below {oldest}");
        let within = |bound: u64, seen: u64| bound as f64 <= ratio * seen as f64;
        assert!(
            within(bound, slowest),
            "{name}: {bound} is far from {slowest}"
        );
        assert!(
            within(age, oldest),
            "{name}: an age of {age} is far from {oldest}"
        );
    }
}

fn hop(component: usize, handler: usize, way: Way, transport: u64) -> Hop {
    Hop {
        collected: 0,
        component,
        handler,
        way,
        transport,
    }
}

fn handler(budget: u64, kept: bool, sends: Vec<Target>) -> Reception {
    Reception {
        budget,
        depth: 10,
        sends,
        kept,
    }
}

#[test]
fn a_scan_that_stops_a_robot() {
    let net = Net {
        nodes: vec![
            Node {
                period: 50 * MS,
                compute: 2 * MS,
                sends: vec![(1, 0, 200 * US)],
                handlers: Vec::new(),
            },
            Node {
                period: 100 * MS,
                compute: MS,
                handlers: vec![handler(3 * MS, false, vec![(2, 0, 200 * US)])],
                ..Node::default()
            },
            Node {
                period: 30 * MS,
                compute: 3 * MS,
                sends: vec![(3, 0, 200 * US)],
                handlers: vec![handler(500 * US, true, Vec::new())],
            },
            Node {
                period: 10 * MS,
                compute: MS,
                handlers: vec![handler(MS, false, Vec::new())],
                ..Node::default()
            },
        ],
        first: 0,
        last: (3, 0),
        hops: vec![
            hop(1, 0, Way::Handler, 200 * US),
            hop(2, 0, Way::Compute, 200 * US),
            hop(3, 0, Way::Handler, 200 * US),
        ],
        outside: None,
    };
    net.check("scan", 1.3);
}

/// Periods that never fit each other: each hop waits for one.
#[test]
fn a_chain_of_periods() {
    let node = |period: u64, next: Option<usize>, receives: bool| Node {
        period,
        compute: MS,
        sends: next.map(|next| (next, 0, 100 * US)).into_iter().collect(),
        handlers: if receives {
            vec![handler(200 * US, true, Vec::new())]
        } else {
            Vec::new()
        },
    };
    let net = Net {
        nodes: vec![
            node(13 * MS, Some(1), false),
            node(10 * MS, Some(2), true),
            node(17 * MS, Some(3), true),
            node(23 * MS, None, true),
        ],
        first: 0,
        last: (3, 0),
        hops: vec![
            hop(1, 0, Way::Compute, 100 * US),
            hop(2, 0, Way::Compute, 100 * US),
            hop(3, 0, Way::Handler, 100 * US),
        ],
        outside: None,
    };
    net.check("periods", 1.3);
}

/// Messages of several senders wait for each other in one component.
#[test]
fn several_senders_at_once() {
    let sender = |number: usize| Node {
        period: 20 * MS + number as u64 * 700 * US,
        compute: 100 * US,
        sends: vec![(3, number, 500 * US)],
        handlers: Vec::new(),
    };
    let mut nodes: Vec<Node> = (0..3).map(sender).collect();
    let mut handlers = vec![handler(2 * MS, false, Vec::new()); 3];
    handlers[0].sends = vec![(4, 0, 500 * US)];
    nodes.push(Node {
        period: 40 * MS,
        compute: 4 * MS,
        sends: Vec::new(),
        handlers,
    });
    nodes.push(Node {
        period: 50 * MS,
        compute: 500 * US,
        handlers: vec![handler(500 * US, false, Vec::new())],
        ..Node::default()
    });
    let net = Net {
        nodes,
        first: 0,
        last: (4, 0),
        hops: vec![
            hop(3, 0, Way::Handler, 500 * US),
            hop(4, 0, Way::Handler, 500 * US),
        ],
        outside: None,
    };
    net.check("senders", 1.3);
}

/// The times of messages from outside are unknown: the depth of their queue is the bound. It is far
/// above the real wait, and never below it.
#[test]
fn messages_from_outside() {
    let net = Net {
        nodes: vec![
            Node {
                period: 30 * MS,
                compute: MS,
                sends: vec![(1, 0, 100 * US)],
                handlers: Vec::new(),
            },
            Node {
                period: 20 * MS,
                compute: 2 * MS,
                sends: vec![(2, 0, 100 * US)],
                handlers: vec![
                    handler(MS, true, Vec::new()),
                    handler(3 * MS, false, Vec::new()),
                ],
            },
            Node {
                period: 50 * MS,
                compute: MS,
                handlers: vec![handler(MS, false, Vec::new())],
                ..Node::default()
            },
        ],
        first: 0,
        last: (2, 0),
        hops: vec![
            hop(1, 0, Way::Compute, 100 * US),
            hop(2, 0, Way::Handler, 100 * US),
        ],
        outside: Some((1, 1)),
    };
    net.check("outside", 50.0);
}

#[test]
fn more_work_than_time_is_told() {
    let source = Component {
        period: MS,
        compute: 10 * US,
        handlers: Vec::new(),
    };
    let arrival = Arrival {
        rate: Rate::Compute(0),
        transport: 0,
    };
    let sink = Component {
        period: 10 * MS,
        compute: MS,
        handlers: vec![Handler {
            budget: 2 * MS,
            depth: 10,
            arrivals: vec![arrival],
        }],
    };
    let of = loads(&[source, sink]);
    assert!(!of[0].is_overloaded && of[1].is_overloaded);
    // Ten rounds of 2 ms, a run that has begun, and the periods in between.
    assert_eq!(of[1].handled, [Some(25 * MS)]);
}

/// A component whose `compute()` takes its whole period never gets to its messages.
#[test]
fn a_compute_without_end_has_no_bound() {
    let busy = Component {
        period: MS,
        compute: MS,
        handlers: vec![Handler::default()],
    };
    let of = loads(&[busy]);
    assert_eq!((of[0].handled[0], of[0].computed), (None, None));
}
