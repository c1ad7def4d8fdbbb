//! A chain of five components on a scripted clock.

mod outside;

use super::collector::{Answer, Collector};
use super::join::Change;
use super::stalls::Stalls;
use super::{News, join};
use rc_deploy_network::plan::Plan;
use rc_deploy_network::planned_chain::{
    LateAction, PlannedChain, PlannedHop, PlannedMessage, ReactsIn,
};
use rc_management::chains::ChainStatus;
use rc_management::hops::{Following, Hop, HopReport, Kind, RING};
use rc_runtime::fastrand;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The components behind the one that begins the chain.
const HOPS: usize = 5;
const MS: u64 = 1_000_000;
const SECOND: u64 = 1000 * MS;
/// When the first message is sent.
const BEGIN: u64 = 5000 * SECOND;
/// The period of the messages.
const PERIOD: u64 = 50 * MS;
/// The times of a message: on the way, until the reaction, and in it.
type Delays = [[u64; 3]; HOPS];
/// 41 ms in all.
const USUAL: Delays = [
    [MS, 0, 2 * MS],
    [2 * MS, 10 * MS, MS],
    [MS, 0, 3 * MS],
    [MS, 15 * MS, MS],
    [2 * MS, 0, 2 * MS],
];

fn message(at: usize, operation: &str) -> PlannedMessage {
    PlannedMessage {
        component: format!("c{at}"),
        slot: "Slot".to_owned(),
        operation: operation.to_owned(),
    }
}

fn plan() -> Plan {
    let hops = (1..=HOPS).map(|at| PlannedHop {
        input: message(at, "in"),
        output: (at < HOPS).then(|| message(at, "out")),
        reacts_in: if at % 2 == 0 {
            ReactsIn::Compute
        } else {
            ReactsIn::Handler
        },
        outside: None,
        worst: Some([3 * MS, 20 * MS, 5 * MS].map(Duration::from_nanos)),
    });
    let chain = PlannedChain {
        name: "brake".to_owned(),
        from: "c0.Slot.out".to_owned(),
        to: "c5.Slot.in".to_owned(),
        within: Some(Duration::from_millis(80)),
        age: Some(Duration::from_millis(140)),
        late: LateAction::Warn,
        source: Some(message(0, "out")),
        hops: hops.collect(),
    };
    Plan {
        chains: vec![chain],
        ..Plan::new("net", "net.ddsl", [])
    }
}

struct Network {
    collector: Collector,
    /// The records of each component, with the time of each.
    noted: Vec<Vec<Hop>>,
    /// How far the clock of each component is ahead.
    ahead: [i64; HOPS + 1],
    /// The identity of each component as a sender, and whether it begins to be followed.
    senders: [(u32, bool); HOPS + 1],
    runs: [bool; HOPS + 1],
    sent: u32,
    changes: Vec<Change>,
    stalls: Arc<Mutex<Stalls>>,
}

impl Network {
    fn new() -> Self {
        let stalls = Arc::default();
        Self {
            collector: Collector::new(&plan(), &stalls),
            stalls,
            noted: vec![Vec::new(); HOPS + 1],
            ahead: [0; HOPS + 1],
            senders: std::array::from_fn(|at| (100 + at as u32, true)),
            runs: [true; HOPS + 1],
            sent: 0,
            changes: Vec::new(),
        }
    }

    /// When the next message is sent.
    fn next(&self) -> u64 {
        BEGIN + u64::from(self.sent) * PERIOD
    }

    /// Sends a message that takes so long, as far as the component `until`.
    fn send(&mut self, delays: &Delays, until: usize) {
        let number = self.sent + 1;
        let at = self.next();
        self.sent = number;
        self.note(0, (0, 0, Kind::Sent, number), [0, at, at, at]);
        let mut sent = at;
        for (hop, delay) in delays.iter().enumerate().take(until) {
            let begun = sent + delay[0];
            let used = begun + delay[1];
            let left = used + delay[2];
            let (kind, output) = if hop + 1 == HOPS {
                (Kind::Ended, 0)
            } else {
                (Kind::Sent, number)
            };
            let (sender, _) = self.senders[hop];
            self.note(
                hop + 1,
                (sender, number, kind, output),
                [sent, begun, used, left],
            );
            sent = left;
        }
    }

    fn note(
        &mut self,
        at: usize,
        (sender, input, kind, output): (u32, u32, Kind, u32),
        times: [u64; 4],
    ) {
        let here = |time: u64| match time {
            0 => 0,
            time => time.checked_add_signed(self.ahead[at]).expect("a time"),
        };
        let [sent, begun, used, left] = times.map(here);
        self.noted[at].push(Hop {
            sender,
            pair: 0,
            kind,
            input,
            output,
            sent,
            begun,
            used,
            left,
        });
    }

    /// Asks all components, each a millisecond after the one before it, the last one first.
    fn round(&mut self, now: u64) {
        let answers = (0..=HOPS).map(|at| {
            if !self.runs[at] {
                return Err("does not run".to_owned());
            }
            let asked = now + (HOPS - at) as u64 * MS;
            let local = asked.checked_add_signed(self.ahead[at]).expect("a time");
            let (mut is_told, waits): (Vec<Hop>, Vec<Hop>) =
                self.noted[at].iter().partition(|hop| hop.left <= local);
            self.noted[at] = waits;
            is_told.sort_by_key(|hop| hop.left);
            let (sender, begins) = &mut self.senders[at];
            let senders = vec![vec![*sender, 7000 + *sender]];
            Ok(Answer {
                following: std::mem::take(begins).then_some((now, Following { senders })),
                taken: HopReport {
                    active: true,
                    overwritten: 0,
                    hops: is_told,
                },
                ahead: (self.ahead[at], MS / 10),
            })
        });
        let answers = answers.collect();
        for news in self.collector.round(now as i64, answers) {
            match news {
                News::Changed(0, change) => self.changes.push(change),
                other => panic!("{other:?}"),
            }
        }
    }

    /// Sends so many messages, and asks four times a second.
    fn run(&mut self, count: u32, mut delays: impl FnMut(u32) -> (Delays, usize)) {
        for number in 0..count {
            let (delays, until) = delays(number);
            if self.next().is_multiple_of(250 * MS) {
                self.round(self.next());
            }
            self.send(&delays, until);
        }
    }

    fn usual(&mut self, count: u32) {
        self.run(count, |_| (USUAL, HOPS));
    }

    /// Begins to follow the components, and lets some messages pass.
    fn up() -> Self {
        let mut network = Self::new();
        network.round(BEGIN - SECOND);
        network.usual(100);
        network
    }

    fn status(&self) -> ChainStatus {
        self.collector.status(None).chains.remove(0)
    }

    /// Codes and texts of what has changed.
    fn changed(&mut self) -> Vec<(&'static str, String)> {
        let changes = std::mem::take(&mut self.changes).into_iter();
        changes
            .map(|change| match change {
                Change::Begun { code, text } => (code, text),
                Change::Ended { text, .. } => ("over", text),
            })
            .collect()
    }
}

#[test]
fn a_late_message_says_that_the_machine_stood_still() {
    // From and to, in ms after the message was sent.
    for (from, to, told) in [(5, 44, true), (2000, 2039, false)] {
        let mut network = Network::up();
        let at = |ms: u64| (network.next() + ms * MS) as i64;
        let mut stalls = network.stalls.lock().expect("the stalls");
        stalls.add(at(from), at(to));
        drop(stalls);
        let mut delays = USUAL;
        delays[2][2] += 150 * MS;
        network.run(1, |_| (delays, HOPS));
        network.usual(100);
        let (code, text) = network.changed().remove(0);
        assert_eq!(code, join::LATE);
        let tells = text.ends_with("; this machine stood still for 39.0 ms of them");
        assert_eq!(tells, told, "{text}");
    }
}

#[test]
fn the_whole_is_the_sum_of_its_parts_for_each_message() {
    let mut network = Network::new();
    // The clocks of two other machines are ahead and behind.
    network.ahead[2] = 2 * SECOND as i64;
    network.ahead[3] = 2 * SECOND as i64;
    network.ahead[5] = -700 * SECOND as i64;
    network.round(BEGIN - SECOND);
    let mut random = fastrand::Rng::with_seed(7);
    let mut expected = Vec::new();
    network.run(1000, |_| {
        let mut delays = USUAL;
        for delay in delays.iter_mut().flatten() {
            *delay = random.u64(0..4 * MS);
        }
        expected.push(delays);
        (delays, HOPS)
    });
    network.round(network.next() + SECOND);
    let last = &network.collector.joiners[0].measured.last;
    assert_eq!(last.len(), 1000);
    for (message, delays) in last.iter().zip(expected) {
        let sum: i64 = message.parts.iter().flatten().sum();
        assert_eq!(message.total, sum);
        let parts: Vec<[u64; 3]> = message
            .parts
            .iter()
            .map(|part| part.map(|ns| ns as u64))
            .collect();
        assert_eq!(parts, delays);
    }
    let status = network.status();
    assert_eq!((status.begun, status.complete), (1000, 1000));
    assert!((status.uncertainty_ms - 0.2).abs() < 1e-9);
    assert_eq!(network.changed(), []);
}

#[test]
fn ten_minutes_without_a_fault_are_ten_minutes_without_an_event() {
    let mut network = Network::up();
    let mut random = fastrand::Rng::with_seed(8);
    network.run(12_000, |_| {
        let mut delays = USUAL;
        for delay in delays.iter_mut().flatten() {
            *delay += random.u64(0..2 * MS);
        }
        (delays, HOPS)
    });
    assert_eq!(network.changed(), []);
    let lost: u64 = network.status().hops.iter().map(|hop| hop.lost).sum();
    assert_eq!(lost, 0);
}

#[test]
fn a_slow_component_is_named_once_and_the_end_is_reported() {
    let mut network = Network::up();
    let mut slow = USUAL;
    slow[2][2] += 50 * MS;
    network.run(40, |number| {
        (if number % 4 == 0 { slow } else { USUAL }, HOPS)
    });
    network.round(network.next());
    let changed = network.changed();
    let [(code, text)] = &changed[..] else {
        panic!("{changed:?}");
    };
    assert_eq!(*code, join::LATE);
    assert_eq!(
        text,
        "chain `brake` took 91.0 ms, more than 80.0 ms: 54.0 ms of them at c3 (1.0 ms on the way, 53.0 ms work, at worst 28.0 ms)"
    );
    assert_eq!(network.status().conditions, [join::LATE]);
    network.usual(200);
    network.round(network.next());
    let in_time = ("over", "chain `brake` is in time again".to_owned());
    assert_eq!(network.changed(), [in_time]);
    assert_eq!(network.status().late, 10);
}

#[test]
fn data_that_are_used_for_long_are_old_and_not_late() {
    let mut network = Network::up();
    // c2 uses message 100 again and again.
    for again in 0..4 {
        let at = BEGIN + 99 * PERIOD + 3 * MS;
        let used = at + 12 * MS + again * PERIOD;
        let times = [at, at + 2 * MS, used, used + MS];
        network.note(2, (101, 100, Kind::Sent, 5000 + again as u32), times);
        let sent = used + MS;
        let times = [sent, sent + MS, sent + MS, sent + 4 * MS];
        let number = 5000 + again as u32;
        network.note(3, (102, number, Kind::Sent, number), times);
        let sent = sent + 4 * MS;
        let times = [sent, sent + MS, sent + 16 * MS, sent + 17 * MS];
        network.note(4, (103, number, Kind::Sent, number), times);
        let sent = sent + 17 * MS;
        let times = [sent, sent + 2 * MS, sent + 2 * MS, sent + 4 * MS];
        network.note(5, (104, number, Kind::Ended, 0), times);
    }
    network.round(network.next() + SECOND);
    let changed = network.changed();
    assert_eq!(changed.len(), 1, "{changed:?}");
    assert_eq!(changed[0].0, join::OLD);
    assert!(
        changed[0].1.contains("141 ms old, more than 140 ms"),
        "{changed:?}"
    );
    assert!(changed[0].1.contains("at c2"), "{changed:?}");
    let status = network.status();
    assert_eq!((status.late, status.old), (0, 2));
    assert_eq!(status.oldest_ms, Some(191.0));
}

#[test]
fn a_lost_message_and_a_swapped_one_are_counted_at_their_component() {
    let mut network = Network::up();
    network.run(100, |number| (USUAL, if number == 50 { 1 } else { HOPS }));
    // The message to c4 overtakes the one before it.
    let mut delays = USUAL;
    delays[3][0] = 55 * MS;
    network.run(2, |number| (if number == 0 { delays } else { USUAL }, HOPS));
    network.usual(200);
    network.round(network.next() + 5 * SECOND);
    let status = network.status();
    let count = |of: fn(&rc_management::chains::HopStatus) -> u64| -> Vec<u64> {
        status.hops.iter().map(of).collect()
    };
    assert_eq!(count(|hop| hop.lost), [0, 1, 0, 0, 0]);
    assert_eq!(count(|hop| hop.swapped), [0, 0, 0, 1, 1]);
    assert_eq!(status.begun - status.complete, 1);
}

#[test]
fn a_component_that_stalls_or_is_gone_breaks_the_chain() {
    let mut network = Network::up();
    network.run(60, |_| (USUAL, 2));
    network.round(network.next());
    let changed = network.changed();
    let text = |changed: &[(&str, String)]| changed.first().map(|(_, text)| text.clone());
    assert_eq!(changed[0].0, join::BROKEN_CODE);
    let broken = text(&changed).expect("a text");
    assert!(broken.ends_with("c3 receives no Slot.in"), "{broken}");
    assert_eq!(changed.len(), 1, "{changed:?}");
    network.usual(20);
    network.round(network.next());
    assert_eq!(network.changed()[0].0, "over");
    // c2 ends, and is started again as another sender.
    let lost =
        |network: &Network| -> u64 { network.status().hops.iter().map(|hop| hop.lost).sum() };
    network.runs[2] = false;
    network.run(60, |_| (USUAL, 1));
    network.round(network.next());
    let broken = text(&network.changed()).expect("a text");
    assert!(broken.ends_with("c2 does not answer"), "{broken}");
    network.runs[2] = true;
    network.senders[2] = (300, true);
    network.round(network.next());
    network.usual(100);
    network.round(network.next());
    assert_eq!(network.changed()[0].0, "over");
    let restarts: Vec<u64> = network
        .status()
        .hops
        .iter()
        .map(|hop| hop.restarts)
        .collect();
    assert_eq!(restarts, [0, 1, 0, 0, 0]);
    // The messages that nobody followed are not counted as lost.
    network.usual(200);
    network.round(network.next());
    assert_eq!(lost(&network), 60);
}

#[test]
fn many_messages_are_followed_in_part_and_none_counts_as_lost() {
    let mut network = Network::up();
    network.round(network.next());
    // Half of what c3 has noted had no room.
    network.run(4, |_| (USUAL, HOPS));
    network.noted[3].drain(..2);
    let now = network.next() + SECOND;
    let answers = (0..=HOPS).map(|at| {
        Ok(Answer {
            taken: HopReport {
                active: true,
                overwritten: if at == 3 { 100 } else { 0 },
                hops: std::mem::take(&mut network.noted[at]),
            },
            ..Answer::default()
        })
    });
    let answers = answers.collect();
    assert!(network.collector.round(now as i64, answers).is_empty());
    network.round(now + 10 * SECOND);
    let status = network.status();
    assert!((status.coverage - 102.0 / 202.0).abs() < 1e-4, "{status:?}");
    assert!(status.hops.iter().all(|hop| hop.lost == 0), "{status:?}");
}

/// A component that works and does not answer keeps its notes. The newest ones are measured; what
/// others noted of the messages before is forgotten, so nobody knows whether these arrived.
#[test]
fn what_a_component_noted_while_it_did_not_answer_is_measured() {
    let mut network = Network::up();
    network.runs[1] = false;
    network.usual(200);
    network.runs[1] = true;
    network.senders[1].1 = true;
    network.usual(100);
    network.round(network.next() + 5 * SECOND);
    let status = network.status();
    assert!(status.hops.iter().all(|hop| hop.lost == 0), "{status:?}");
    // More than the last two of ten seconds.
    assert!((240..260).contains(&status.complete), "{status:?}");
}

/// 100,000 messages a second. Each component keeps the newest ones until it is asked, so that the
/// records of two components may have no message in common. Nothing is late, lost or broken by that.
#[test]
fn a_hundred_thousand_messages_a_second_are_no_fault() {
    const PERIOD: u64 = SECOND / 100_000;
    // The way to c3 is longer than the time that its records hold, or shorter.
    for (way, complete) in [(15 * MS, false), (MS / 10, true)] {
        let mut delays = [[MS / 10, 0, MS / 100]; HOPS];
        delays[2][0] = way;
        let mut network = Network::new();
        network.round(BEGIN - SECOND);
        for round in 1..=20 {
            let now = BEGIN + round * 250 * MS;
            // Components are asked one after another.
            let answers: Vec<_> = (0..=HOPS)
                .map(|at| {
                    let asked = now + at as u64 * MS / 10;
                    let until = |at: usize| delays[..at].iter().flatten().sum::<u64>();
                    let newest = (asked - BEGIN - until(at)) / PERIOD;
                    for number in newest + 1 - RING as u64..=newest {
                        let sent = BEGIN + number * PERIOD + until(at.saturating_sub(1));
                        let number = number as u32 + 1;
                        let Some(before) = at.checked_sub(1) else {
                            network.note(0, (0, 0, Kind::Sent, number), [0, sent, sent, sent]);
                            continue;
                        };
                        let [way, _, work] = delays[before];
                        let begun = sent + way;
                        let (kind, output) = match at {
                            HOPS => (Kind::Ended, 0),
                            _ => (Kind::Sent, number),
                        };
                        let (sender, _) = network.senders[before];
                        let times = [sent, begun, begun, begun + work];
                        network.note(at, (sender, number, kind, output), times);
                    }
                    Ok(Answer {
                        taken: HopReport {
                            active: true,
                            overwritten: 25_000 - RING as u64,
                            hops: std::mem::take(&mut network.noted[at]),
                        },
                        ..Answer::default()
                    })
                })
                .collect();
            let news = network.collector.round(now as i64, answers);
            assert!(news.is_empty(), "{news:?}");
        }
        let status = network.status();
        assert!(
            (status.coverage - 640.0 / 25_000.0).abs() < 1e-3,
            "{status:?}"
        );
        assert!(status.hops.iter().all(|hop| hop.lost == 0), "{status:?}");
        assert_eq!(status.complete > 0, complete, "{status:?}");
    }
}

#[test]
fn a_clock_that_is_set_back_is_estimated_anew_and_no_message_is_late() {
    let mut network = Network::up();
    for ahead in [2 * SECOND as i64, -3 * SECOND as i64, 0] {
        // Notes by the old clock were taken with its offset.
        network.round(network.next() + SECOND);
        network.sent += 40;
        network.ahead[2] = ahead;
        network.ahead[3] = ahead;
        network.usual(100);
    }
    network.round(network.next() + SECOND);
    assert_eq!(network.changed(), []);
    let last = &network.collector.joiners[0].measured.last;
    assert_eq!(last.len(), 400);
    assert!(last.iter().all(|message| message.total == 41 * MS as i64));
}
