//! What is known of a running component: its state, its counters, its times.

use crate::component::Slot;
use crate::parameters::Proposal;
use hdrhistogram::Histogram;
use rc_middleware::{Counter, WakeEvent};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Where a component is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Its connections are being opened and its worker initialised.
    Starting,
    /// `compute()` runs on its period.
    Running,
    /// `emergency()` runs on the period.
    Emergency,
    /// It is ending.
    Stopping,
}

impl State {
    /// The word of the management endpoint.
    pub fn word(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Running => "running",
            Self::Emergency => "emergency",
            Self::Stopping => "stopping",
        }
    }
}

/// What the management thread may wish of the worker thread.
#[derive(Debug)]
pub(crate) enum Command {
    Period(Duration),
    Emergency(bool),
    Parameters(Arc<Proposal>),
}

/// What the worker thread and the management thread share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) wake_event: WakeEvent,
    pub(crate) status: Mutex<Status>,
    pub(crate) commands: Mutex<Vec<Command>>,
    born: Instant,
    last_turn: AtomicU64,
}

impl Shared {
    pub(crate) fn new(wake_event: WakeEvent, period: Duration, slots: usize) -> Self {
        Self {
            wake_event,
            status: Mutex::new(Status::new(period, slots)),
            commands: Mutex::new(Vec::new()),
            born: Instant::now(),
            last_turn: AtomicU64::new(0),
        }
    }

    pub(crate) fn status(&self) -> MutexGuard<'_, Status> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn command(&self, command: Command) {
        self.commands
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(command);
        self.wake_event.wake();
    }

    pub(crate) fn take_commands(&self) -> Vec<Command> {
        std::mem::take(&mut *self.commands.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The worker's loop has come round.
    pub(crate) fn turned(&self, now: Instant) {
        let age = now.saturating_duration_since(self.born);
        self.last_turn
            .store(age.as_millis() as u64, Ordering::Relaxed);
    }

    /// How long ago the worker's loop came round, in milliseconds.
    pub(crate) fn age_ms(&self) -> u64 {
        (self.born.elapsed().as_millis() as u64)
            .saturating_sub(self.last_turn.load(Ordering::Relaxed))
    }

    pub(crate) fn uptime(&self) -> Duration {
        self.born.elapsed()
    }
}

/// Counters and times of one component.
#[derive(Debug)]
pub(crate) struct Status {
    pub(crate) state: State,
    pub(crate) period: Duration,
    pub(crate) compute: TimingRecorder,
    pub(crate) overruns: u64,
    pub(crate) slots: Vec<SlotCounters>,
    pub(crate) last_error: Option<String>,
    /// What the sending ends count, each with the number of its slot.
    pub(crate) sent: Vec<(usize, Counter)>,
    /// What the supervisor is to hear with the next heartbeat.
    pub(crate) delta: HeartbeatDelta,
}

/// What was noticed since the last heartbeat.
#[derive(Debug, Default)]
pub(crate) struct HeartbeatDelta {
    /// How often the worker needed longer than its period, and the longest time.
    overruns: u64,
    slowest: Option<(Activity, Duration)>,
    /// Topics, by slot and operation, from which nothing came for longer than their deadline, and for how long.
    silent: BTreeMap<(usize, usize), Duration>,
    /// Other ends that do not fit.
    pub(crate) mismatches: Vec<String>,
}

/// What the worker was doing.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Activity {
    Compute,
    /// A handler of this slot.
    Handler(usize),
}

impl HeartbeatDelta {
    /// Something took longer than the period.
    pub(crate) fn overrun(&mut self, activity: Activity, took: Duration) {
        self.overruns += 1;
        if self.slowest.is_none_or(|(_, longest)| longest < took) {
            self.slowest = Some((activity, took));
        }
    }

    /// Nothing has come from a topic for so long.
    pub(crate) fn silent(&mut self, slot: usize, operation: usize, time: Duration) {
        let longest = self.silent.entry((slot, operation)).or_default();
        *longest = time.max(*longest);
    }

    /// `{"count", "what", "ms"}`, where there was an overrun.
    pub(crate) fn overruns(&self, slots: &[Slot]) -> Option<Value> {
        let (activity, took) = self.slowest?;
        let what = match activity {
            Activity::Compute => "compute()".to_owned(),
            Activity::Handler(slot) => format!("a handler of {}", slots[slot].name),
        };
        let ms = took.as_secs_f64() * 1e3;
        Some(json!({ "count": self.overruns, "what": what, "ms": ms }))
    }

    /// `{TOPIC: MILLISECONDS}`: the slot, and with several operations which.
    pub(crate) fn silences(&self, slots: &[Slot]) -> Map<String, Value> {
        let topic = |slot: &Slot, operation: usize| match slot.operations {
            [_, _, ..] => format!("{}.{}", slot.name, slot.operations[operation].name),
            _ => slot.name.to_owned(),
        };
        let silent = self.silent.iter();
        silent
            .map(|(&(slot, operation), time)| {
                let topic = topic(&slots[slot], operation);
                (topic, (time.as_millis() as u64).into())
            })
            .collect()
    }
}

/// Counters and times of one slot.
#[derive(Debug)]
pub(crate) struct SlotCounters {
    pub(crate) peers: usize,
    pub(crate) work: TimingRecorder,
    /// Values that were sent and never came: newer ones have taken their place.
    pub(crate) lost: u64,
}

/// How often something was done, how often it failed, how long it took.
#[derive(Debug)]
pub(crate) struct TimingRecorder {
    pub(crate) done: u64,
    pub(crate) failed: u64,
    // Two digits from 1 µs to 100 s; none where the bounds were refused, which these are not.
    times: Option<Histogram<u32>>,
}

impl Status {
    fn new(period: Duration, slots: usize) -> Self {
        let slots = (0..slots)
            .map(|_| SlotCounters {
                peers: 0,
                work: TimingRecorder::new(),
                lost: 0,
            })
            .collect();
        Self {
            state: State::Starting,
            period,
            compute: TimingRecorder::new(),
            overruns: 0,
            slots,
            last_error: None,
            sent: Vec::new(),
            delta: HeartbeatDelta::default(),
        }
    }

    /// How many values a slot has published, or how many calls it has made.
    pub(crate) fn sent(&self, slot: usize) -> u64 {
        let of = self.sent.iter().filter(|(at, _)| *at == slot);
        of.map(|(_, counter)| counter.get()).sum()
    }
}

impl SlotCounters {
    /// A message was handled, and `lost` of its sender right before it did not come.
    pub(crate) fn handled(&mut self, took: Duration, lost: u64, ok: bool) {
        self.work.count(took, ok);
        self.lost = self.lost.saturating_add(lost);
    }
}

impl TimingRecorder {
    fn new() -> Self {
        Self {
            done: 0,
            failed: 0,
            times: Histogram::new_with_bounds(1, 100_000_000, 2).ok(),
        }
    }

    pub(crate) fn count(&mut self, took: Duration, ok: bool) {
        self.done += 1;
        self.failed += u64::from(!ok);
        if let Some(times) = &mut self.times {
            times.saturating_record((took.as_micros() as u64).max(1));
        }
    }

    /// `{"count", "errors", "p50_us", "p99_us", "max_us"}`
    pub(crate) fn to_json(&self) -> Value {
        let at = |quantile: f64| {
            self.times
                .as_ref()
                .map_or(0, |t| t.value_at_quantile(quantile))
        };
        json!({
            "count": self.done,
            "errors": self.failed,
            "p50_us": at(0.5),
            "p99_us": at(0.99),
            "max_us": self.times.as_ref().map_or(0, Histogram::max),
        })
    }
}
