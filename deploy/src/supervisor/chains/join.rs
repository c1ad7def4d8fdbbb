//! Joins the records of the components of one chain: a message that one has sent is the message
//! that the next one has received from the same sender with the same number.
//!
//! This module knows hops and times, no sockets or threads, so its tests need no others. All times
//! are nanoseconds of the monotonic clock of the supervisor.

use super::report::{Completed, Measured};
use super::stage::{Key, MOST_OPEN, Open, Stage, Stamps, Trace};
use super::stalls::Stalls;
use rc_deploy_network::planned_chain::{PlannedChain, PlannedMessage};
use rc_management::chains::ChainStatus;
use rc_management::hops::Kind;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How long a message may be on its way, in addition to the worst case, before it counts as lost.
const PATIENCE: Duration = Duration::from_secs(2);
/// The shortest time without any effect that breaks a chain.
const BROKEN: Duration = Duration::from_secs(1);
/// How long a chain must be in time before a condition ends.
const CALM: Duration = Duration::from_secs(5);

/// A hop with the times of the supervisor's clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct JoinedHop {
    pub(super) sender: u32,
    pub(super) kind: Kind,
    pub(super) input: u32,
    pub(super) output: u32,
    /// When the input was sent, as its header says.
    pub(super) sent: i64,
    /// The stamp of the message, if its pair has one.
    pub(super) stamp: u64,
    pub(super) begun: i64,
    pub(super) used: i64,
    pub(super) left: i64,
}

/// The records of one component on the chain.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Coverage {
    /// Whether it has ever been followed.
    pub(super) was_followed: bool,
    /// The time since which all of its hops are known; none while it is not followed.
    pub(super) since: Option<i64>,
    /// The time until which it had more hops than it keeps.
    pub(super) overwritten_until: i64,
    /// Whether it handles messages: a managed component that is not active does not.
    pub(super) is_active: bool,
    /// The greatest error of its times.
    pub(super) uncertainty: u64,
}

/// A condition of a chain begins or ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Begun { code: &'static str, text: String },
    Ended { code: &'static str, text: String },
}

pub(super) const LATE: &str = "chain-late";
pub(super) const OLD: &str = "chain-old";
pub(super) const BROKEN_CODE: &str = "chain-broken";

/// A condition that holds.
#[derive(Debug)]
struct Condition {
    code: &'static str,
    /// When it was last seen.
    last: i64,
}

/// One chain.
#[derive(Debug)]
pub(super) struct Joiner {
    plan: PlannedChain,
    stages: Vec<Stage>,
    pub(super) measured: Measured,
    conditions: Vec<Condition>,
    /// The time of the last effect that was in time.
    in_time: Option<i64>,
    changes: Vec<Change>,
    stalls: Arc<Mutex<Stalls>>,
    patience: i64,
    broken_after: i64,
}

fn nanoseconds(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

/// Milliseconds with as many digits as a person reads.
pub(super) fn text_of(nanoseconds: i64) -> String {
    let ms = nanoseconds as f64 / 1e6;
    match ms.abs() {
        ms_abs if ms_abs >= 100.0 => format!("{ms:.0} ms"),
        ms_abs if ms_abs >= 1.0 => format!("{ms:.1} ms"),
        _ => format!("{ms:.3} ms"),
    }
}

impl Joiner {
    pub(super) fn new(plan: PlannedChain, stalls: Arc<Mutex<Stalls>>) -> Self {
        let hops = plan.hops.len();
        let worst = plan.hops.iter().filter_map(|hop| hop.worst);
        let worst: Duration = worst.flatten().sum();
        let slowest = worst.max(plan.within.unwrap_or_default());
        let patience = PATIENCE.saturating_add(slowest.saturating_mul(2));
        let has_source = plan.source.is_some();
        let stages = (0..hops).map(|at| Stage {
            senders: (at > 0 || has_source).then(HashMap::new),
            stamps: plan.hops[at].outside.as_ref().map(|_| Stamps::default()),
            ..Stage::default()
        });
        Self {
            stages: stages.collect(),
            measured: Measured::new(hops),
            conditions: Vec::new(),
            in_time: None,
            changes: Vec::new(),
            stalls,
            patience: nanoseconds(patience),
            broken_after: nanoseconds(BROKEN.max(slowest.saturating_mul(4))),
            plan,
        }
    }

    /// Status for tools. `coverage`: the part of the messages that was followed.
    pub(super) fn status(&self, coverage: f64, missing: Vec<String>) -> ChainStatus {
        let conditions = self.conditions().map(str::to_owned).collect();
        let measured = &self.measured;
        measured.status(&self.plan, conditions, coverage, missing)
    }

    /// The codes of the conditions that hold.
    pub(super) fn conditions(&self) -> impl Iterator<Item = &'static str> {
        self.conditions.iter().map(|condition| condition.code)
    }

    /// Conditions that have begun or ended since the last call.
    pub(super) fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// The senders of the messages to the component at `hop` have these identities from now on.
    pub(super) fn set_senders(&mut self, hop: usize, identities: &[u32]) {
        let stage = self.stages.get_mut(hop);
        let known = stage.and_then(|stage| stage.senders.as_mut());
        if let (Some(known), Some(first)) = (known, identities.first()) {
            // Messages of earlier runs may still be on their way; a few runs are enough.
            if known.len() > 256 {
                known.clear();
            }
            known.extend(identities.iter().map(|identity| (*identity, *first)));
        }
    }

    /// A message that begins the chain was sent by `sender`, the first one of its identities.
    pub(super) fn begin(&mut self, sender: u32, number: u32, at: i64) {
        self.measured.begun += 1;
        let trace = Trace {
            began: at,
            parts: Vec::new(),
            is_first: true,
        };
        self.send(0, (sender, number), trace, at);
    }

    /// A message with a stamp was sent to the programs outside before the component at `hop`.
    pub(super) fn stamped(&mut self, hop: usize, key: Key, noted: &JoinedHop) {
        let Some(stamps) = &mut self.stages[hop].stamps else {
            return;
        };
        // Nobody has set this stamp.
        stamps.lacks_newest = noted.stamp == 0;
        if stamps.lacks_newest {
            return;
        }
        stamps.keys.insert(noted.stamp, key);
        stamps.order.push_back((noted.left, noted.stamp, key));
        if stamps.order.len() > MOST_OPEN {
            stamps.forget();
        }
    }

    /// A message is on its way to the component at `hop`.
    fn send(&mut self, hop: usize, key: Key, trace: Trace, left: i64) {
        let stage = &mut self.stages[hop];
        let open = Open {
            trace,
            left,
            has_arrived: false,
            is_used: false,
        };
        stage.waits_since.get_or_insert(left);
        stage.waiting += 1;
        stage.open.insert(key, open);
        stage.order.push_back((left, key));
        if stage.order.len() > MOST_OPEN
            && let Some((_, oldest)) = stage.order.pop_front()
        {
            stage.open.remove(&oldest);
        }
    }

    /// Whether what the other components noted of a message may be forgotten that was sent at `left`.
    pub(super) fn has_forgotten(&self, left: i64, now: i64) -> bool {
        left < now.saturating_sub(self.patience)
    }

    /// Adds the records of the component at `hop`. `own`: the first of the identities by which it
    /// sends.
    pub(super) fn add(&mut self, hop: usize, noted: JoinedHop, own: u32) {
        let stage = &mut self.stages[hop];
        let key = match (&stage.stamps, &stage.senders) {
            (Some(stamps), _) => match stamps.keys.get(&noted.stamp) {
                Some(key) => Some(*key),
                None => return stage.wait(noted),
            },
            (None, Some(known)) => known
                .get(&noted.sender)
                .map(|sender| (*sender, noted.input)),
            (None, None) => Some((noted.sender, noted.input)),
        };
        // Others may send this message, too, and are not on the chain.
        let Some(key) = key else {
            return;
        };
        let (sender, number) = key;
        if stage.senders.is_none() && !stage.open.contains_key(&key) {
            // By a clock that was set back, it is sent later than it came.
            let at = match noted.sent {
                0 => noted.begun,
                sent => sent.min(noted.begun),
            };
            // Data that are used forever are forgotten as the beginning of anything.
            if noted.left - at > self.patience {
                return;
            }
            self.begin(sender, number, at);
        }
        let stage = &mut self.stages[hop];
        let Some(open) = stage.open.get_mut(&key) else {
            return stage.wait(noted);
        };
        if !open.has_arrived {
            open.has_arrived = true;
            (stage.waits_since, stage.waiting) = (None, 0);
            let newest = stage.newest.entry(sender);
            let (newest, at) = newest.or_insert((number, noted.begun));
            // Numbers have 32 bits, so they may begin again.
            let is_older = (newest.wrapping_sub(number) as i32) > 0;
            if is_older && noted.begun > *at {
                self.measured.hops[hop].swapped += 1;
            } else if !is_older {
                (*newest, *at) = (number, noted.begun);
            }
        }
        let counts = &mut self.measured.hops[hop];
        let ends_here = self.plan.hops[hop].output.is_none();
        match noted.kind {
            Kind::Kept => {}
            Kind::Replaced => counts.replaced += 1,
            Kind::Ended if !ends_here => counts.ended += 1,
            Kind::Ended | Kind::Sent => {
                let mut trace = open.trace.clone();
                trace.is_first &= !open.is_used;
                open.is_used = true;
                trace.parts.push([
                    noted.begun - open.left,
                    noted.used - noted.begun,
                    noted.left - noted.used,
                ]);
                if hop + 1 == self.stages.len() {
                    self.complete(&trace, noted.left);
                } else {
                    self.send(hop + 1, (own, noted.output), trace, noted.left);
                }
            }
        }
    }

    /// Looks again at hops whose messages were not known. After all components of a round.
    pub(super) fn add_early(&mut self, own: &[u32]) {
        for (hop, own) in own.iter().enumerate() {
            let early = std::mem::take(&mut self.stages[hop].early);
            for noted in early {
                self.add(hop, noted, *own);
            }
        }
    }

    /// A message has come to the end.
    fn complete(&mut self, trace: &Trace, end: i64) {
        let age = end - trace.began;
        self.measured.oldest = self.measured.oldest.max(age);
        let uncertainty = i64::try_from(self.measured.uncertainty).unwrap_or(i64::MAX);
        let exceeds = |limit: Option<Duration>| {
            limit.is_some_and(|limit| age > nanoseconds(limit).saturating_add(uncertainty))
        };
        let is_late = trace.is_first && exceeds(self.plan.within);
        let is_old = exceeds(self.plan.age);
        if trace.is_first {
            self.measured.complete(Completed {
                began: trace.began,
                total: age,
                parts: trace.parts.as_slice().into(),
                is_late,
            });
        }
        if is_late {
            self.measured.late += 1;
            let limit = self.plan.within.unwrap_or_default();
            let text = format!(
                "chain `{}` took {}, more than {}: {}{}",
                self.plan.name,
                text_of(age),
                text_of(nanoseconds(limit)),
                self.guilty(&trace.parts),
                self.stood_still(trace.began, end)
            );
            self.note(LATE, text, end);
        }
        if is_old {
            self.measured.old += 1;
            let limit = self.plan.age.unwrap_or_default();
            let text = format!(
                "an effect of chain `{}` is made of data that are {} old, more than {}: {}{}",
                self.plan.name,
                text_of(age),
                text_of(nanoseconds(limit)),
                self.guilty(&trace.parts),
                self.stood_still(trace.began, end)
            );
            self.note(OLD, text, end);
        }
        if !is_late && !is_old {
            self.in_time = self.in_time.max(Some(end));
        }
    }

    /// The component that took the most time beyond its worst case, in words.
    fn guilty(&self, parts: &[[i64; 3]]) -> String {
        let hops = self.plan.hops.iter().zip(parts);
        let over = |worst: Option<[Duration; 3]>, total: i64| {
            let worst: Duration = worst.into_iter().flatten().sum();
            total - nanoseconds(worst)
        };
        let guilty = hops.max_by_key(|(hop, part)| over(hop.worst, part.iter().sum()));
        let Some((hop, part)) = guilty else {
            return String::new();
        };
        let [way, period, work] = part.map(text_of);
        let total: i64 = part.iter().sum();
        let worst = hop.worst.map(|worst| worst.into_iter().sum());
        let expected = worst.map_or_else(String::new, |worst: Duration| {
            format!(", at worst {}", text_of(nanoseconds(worst)))
        });
        let period = if part[1] > 0 {
            format!(", {period} until `compute`")
        } else {
            String::new()
        };
        format!(
            "{} of them at {} ({way} on the way{period}, {work} work{expected})",
            text_of(total),
            hop.input.component
        )
    }

    /// How long this machine stood still between these times, in words.
    fn stood_still(&self, begin: i64, end: i64) -> String {
        let stalls = self.stalls.lock().unwrap_or_else(PoisonError::into_inner);
        match stalls.during(begin, end) {
            0 => String::new(),
            time => format!("; this machine stood still for {} of them", text_of(time)),
        }
    }

    fn note(&mut self, code: &'static str, text: String, at: i64) {
        let mut known = self.conditions.iter_mut();
        if let Some(condition) = known.find(|condition| condition.code == code) {
            condition.last = condition.last.max(at);
        } else {
            self.conditions.push(Condition { code, last: at });
            self.changes.push(Change::Begun { code, text });
        }
    }

    /// Ends a round: all components were asked at `now` or later. `source` and `coverage`: the
    /// state of the component that begins the chain, and of those on it.
    pub(super) fn end_round(&mut self, now: i64, source: Option<Coverage>, coverage: &[Coverage]) {
        self.find_lost(now, coverage);
        let ends: Vec<&Coverage> = source.iter().chain(coverage).collect();
        let (first, last) = (ends.first(), ends.last());
        self.measured.uncertainty = match (first, last) {
            (Some(first), Some(last)) => first.uncertainty.saturating_add(last.uncertainty),
            _ => 0,
        };
        let is_judged = ends
            .iter()
            .all(|end| end.was_followed && (end.is_active || end.since.is_none()));
        if is_judged {
            self.find_broken(now, coverage);
        } else {
            for stage in &mut self.stages {
                (stage.waits_since, stage.waiting) = (None, 0);
            }
        }
        self.end_conditions(now);
    }

    /// Counts messages that should have arrived.
    fn find_lost(&mut self, now: i64, coverage: &[Coverage]) {
        let until = now - self.patience;
        for (hop, stage) in self.stages.iter_mut().enumerate() {
            while stage.order.front().is_some_and(|(left, _)| *left < until) {
                let Some((left, key)) = stage.order.pop_front() else {
                    break;
                };
                let open = stage.open.remove(&key);
                let is_known = coverage[hop].since.is_some_and(|since| since <= left);
                if open.is_some_and(|open| !open.has_arrived) && is_known {
                    self.measured.hops[hop].lost += 1;
                }
            }
            let left = stage.early.iter().filter(|noted| noted.begun < until);
            let restamped = left.filter(|noted| stage.is_restamped(noted));
            self.measured.hops[hop].restamped += restamped.count() as u64;
            stage.early.retain(|noted| noted.begun >= until);
            if let Some(stamps) = &mut stage.stamps {
                let early = until.saturating_sub(self.patience);
                while stamps.order.front().is_some_and(|(left, ..)| *left < early) {
                    stamps.forget();
                }
            }
        }
    }

    /// Finds the first component to which messages are sent without arriving. One that handles
    /// them and sends nothing may have a reason.
    fn find_broken(&mut self, now: i64, coverage: &[Coverage]) {
        let mut stages = self.stages.iter().zip(&self.plan.hops).zip(coverage);
        let broken = stages.find_map(|((stage, hop), coverage)| {
            // A message may have arrived without a record.
            let since = stage.waits_since?.max(coverage.overwritten_until);
            let is_broken = stage.waiting > 1 && now - since >= self.broken_after;
            is_broken.then_some((now - since, stage, hop, coverage))
        });
        let Some((time, stage, hop, coverage)) = broken else {
            return;
        };
        let input = &hop.input;
        let received = format!("{}.{}", input.slot, input.operation);
        let fault = hop.outside.as_ref().and_then(|outside| {
            let PlannedMessage {
                component,
                slot,
                operation,
            } = &outside.sent;
            stage.fault_of_stamps(&format!("{component}.{slot}.{operation}"), &received)
        });
        let why = match fault {
            Some(why) => why,
            None if coverage.since.is_some() => format!("receives no {received}"),
            None => "does not answer".to_owned(),
        };
        let text = format!(
            "chain `{}` is broken for {}: {} {why}",
            self.plan.name,
            text_of(time),
            input.component
        );
        self.note(BROKEN_CODE, text, now);
    }

    /// Ends conditions that did not come again for a while.
    fn end_conditions(&mut self, now: i64) {
        let is_over = |condition: &mut Condition| {
            let since = now - condition.last;
            if condition.code == BROKEN_CODE {
                // Each round notes it again.
                return since > 0;
            }
            since > nanoseconds(CALM) && self.in_time > Some(condition.last)
        };
        let over: Vec<Condition> = self.conditions.extract_if(.., is_over).collect();
        for condition in over {
            let text = if self.conditions.is_empty() {
                format!("chain `{}` is in time again", self.plan.name)
            } else {
                String::new()
            };
            let code = condition.code;
            self.changes.push(Change::Ended { code, text });
        }
    }

    /// A component on the chain was started again.
    pub(super) fn restarted(&mut self, hop: usize) {
        self.measured.hops[hop].restarts += 1;
    }
}
