//! The state, the counters and the times of a running component.

use crate::ages::FreshCounts;
use crate::clock::{Clock, Time};
use crate::converting::ConversionCounts;
use crate::event_loop::LogLimit;
use crate::forwarded::ForwardCounts;
use crate::lifecycle::Lifecycle;
use crate::machine_record::MachineRecord;
use crate::slots::OpenSlot;
use hdrhistogram::Histogram;
use rc_diagnostics::foreign;
use rc_management::component::{
    ClockKind, ConvertedStatus, ForwardedStatus, FreshnessStatus, GroupStatus, QueueStatus, State,
    Timing, TransportStatus, WorldStatus,
};
use rc_management::link::{Overruns, TimeJump};
use rc_middleware::{Counter, QueueGauge, WakeEvent};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// State that the worker thread and the management thread share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) wake_event: WakeEvent,
    pub(crate) status: Mutex<Status>,
    pub(crate) time: NetworkTime,
    /// `None` if the component is not managed.
    pub(crate) lifecycle: Option<Arc<Lifecycle>>,
    /// The other components of its process.
    pub(crate) beside: DoneBeside,
    born: Instant,
    last_turn: AtomicU64,
}

impl Shared {
    pub(crate) fn new(
        wake_event: WakeEvent,
        period: Duration,
        slots: usize,
        time: NetworkTime,
        is_managed: bool,
    ) -> Self {
        Self {
            time,
            lifecycle: is_managed.then(|| Arc::new(Lifecycle::new(wake_event.clone()))),
            wake_event,
            beside: DoneBeside::default(),
            status: Mutex::new(Status::new(period, slots)),
            born: Instant::now(),
            last_turn: AtomicU64::new(0),
        }
    }

    /// In a process with other components.
    pub(crate) fn beside(self, beside: DoneBeside) -> Self {
        Self { beside, ..self }
    }

    pub(crate) fn status(&self) -> MutexGuard<'_, Status> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a turn of the worker's loop.
    pub(crate) fn turned(&self, now: Instant) {
        let age = now.saturating_duration_since(self.born);
        self.last_turn
            .store(age.as_millis() as u64, Ordering::Relaxed);
    }

    /// Milliseconds since the last turn of the worker's loop.
    pub(crate) fn age_ms(&self) -> u64 {
        (self.born.elapsed().as_millis() as u64)
            .saturating_sub(self.last_turn.load(Ordering::Relaxed))
    }

    /// Notes that a change of a parameter is refused that the worker itself has requested. Logs one a
    /// second.
    pub(crate) fn refuse_own_change(&self, path: &str, reason: &str) {
        let message = format!("the worker cannot change its parameter `{path}`: {reason}");
        let is_logged = {
            let mut status = self.status();
            status.last_error = Some(message.clone());
            status.refused.allows(Instant::now())
        };
        if is_logged {
            tracing::warn!("{message}");
        }
    }

    pub(crate) fn uptime(&self) -> Duration {
        self.born.elapsed()
    }
}

/// The components of a process that have ended in order, by their names. All of them share it: one
/// that is asked answers for those that no longer do.
#[derive(Clone, Debug, Default)]
pub(crate) struct DoneBeside(Arc<Mutex<Vec<String>>>);

impl DoneBeside {
    fn names(&self) -> MutexGuard<'_, Vec<String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn add(&self, name: &str) {
        self.names().push(name.to_owned());
    }

    pub(crate) fn list(&self) -> Vec<String> {
        self.names().clone()
    }
}

/// The clock of the component, and its state.
#[derive(Debug)]
pub(crate) struct NetworkTime {
    pub(crate) kind: ClockKind,
    pub(crate) clock: Arc<dyn Clock>,
    /// The number of the present tick.
    pub(crate) tick: AtomicU64,
    /// For how many milliseconds the source has been silent; 0 if it is there.
    pub(crate) lost_ms: AtomicU64,
}

impl NetworkTime {
    pub(crate) fn new(kind: ClockKind, clock: Arc<dyn Clock>) -> Self {
        Self {
            kind,
            clock,
            tick: AtomicU64::new(0),
            lost_ms: AtomicU64::new(0),
        }
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
    /// Refused changes of the worker's own parameters in the log.
    pub(crate) refused: LogLimit,
    /// Last steps of the state machine.
    pub(crate) machine: Option<MachineRecord>,
    /// The last reported state of the replica of the shared world, and the files of its schema.
    pub(crate) world: Option<WorldStatus>,
    pub(crate) schema: Vec<(String, String)>,
    /// For a source of time: the components that follow it, and those that it waits for beyond its
    /// limit.
    pub(crate) followers: Vec<String>,
    pub(crate) waiting_for: Vec<String>,
    /// The counters of the sending ends, each with the index of its slot.
    pub(crate) sent: Vec<(usize, Counter)>,
    /// How many samples were not published because the component was not active, in the same form.
    pub(crate) withheld: Vec<(usize, Counter)>,
    /// The conversions of slots, each with the index of its slot.
    pub(crate) converted: Vec<(usize, ConversionCounts)>,
    /// How old the values of slots are, each with the index of its slot.
    pub(crate) fresh: Vec<(usize, FreshCounts)>,
    /// The forwarded messages of slots, each with the index of its slot.
    pub(crate) forwarded: Vec<(usize, ForwardCounts)>,
    /// The messages over each middleware of providers, each with the index of its slot.
    pub(crate) transports: Vec<(usize, &'static str, Counter)>,
    /// The receive queues, each with the index of its slot.
    pub(crate) queues: Vec<(usize, QueueGauge)>,
    /// Peers that are there and do not fit; the log has all.
    pub(crate) mismatches: Vec<String>,
    /// For a proxy: its group.
    pub(crate) group: Option<GroupStatus>,
    /// Content of the next heartbeat.
    pub(crate) delta: HeartbeatDelta,
}

/// Observations since the last heartbeat.
#[derive(Debug, Default)]
pub(crate) struct HeartbeatDelta {
    /// How often the worker took longer than its period.
    overruns: u64,
    /// Slowest activity.
    slowest: Option<(Activity, Duration)>,
    /// Topics that exceeded their deadline, by slot and operation, and how long they were silent.
    silent: BTreeMap<(usize, usize), Duration>,
    /// How time has jumped back.
    pub(crate) jumps: Vec<TimeJump>,
}

/// How many peers that do not fit a heartbeat reports.
const MISMATCHES: usize = 16;

/// The reports about peers that a heartbeat has. Names in them are of other programs.
fn listed(reports: &[String]) -> Vec<String> {
    let first = reports.iter().take(MISMATCHES);
    let first = first.map(|report| foreign::clean(report));
    let more = (reports.len() > MISMATCHES)
        .then(|| "more endpoints do not fit; the log of the component names them".to_owned());
    first.chain(more).collect()
}

/// How many jumps of time a heartbeat reports.
const JUMPS: usize = 8;

/// Activity of the worker.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Activity {
    Compute,
    /// A handler of this slot.
    Handler(usize),
}

impl HeartbeatDelta {
    /// Counts a run that took longer than the period.
    pub(crate) fn overrun(&mut self, activity: Activity, took: Duration) {
        self.overruns += 1;
        if self.slowest.is_none_or(|(_, longest)| longest < took) {
            self.slowest = Some((activity, took));
        }
    }

    /// Notes that a topic has been silent for `time`.
    pub(crate) fn silent(&mut self, slot: usize, operation: usize, time: Duration) {
        let longest = self.silent.entry((slot, operation)).or_default();
        *longest = time.max(*longest);
    }

    /// Notes that time has jumped back.
    pub(crate) fn jumped(&mut self, from: Time, to: Time) {
        self.jumps.truncate(JUMPS - 1);
        self.jumps.push(TimeJump {
            from_s: from.as_secs_f64(),
            to_s: to.as_secs_f64(),
        });
    }

    /// The overruns, if there were any.
    pub(crate) fn overruns(&self, slots: &[Arc<OpenSlot>], period: Duration) -> Option<Overruns> {
        let (activity, took) = self.slowest?;
        let ms = |duration: Duration| duration.as_secs_f64() * 1e3;
        Some(Overruns {
            count: self.overruns,
            what: match activity {
                Activity::Compute => "compute()".to_owned(),
                Activity::Handler(slot) => format!("a handler of {}", slots[slot].name),
            },
            ms: ms(took),
            period_ms: ms(period),
        })
    }

    /// How many milliseconds topics were silent, by name: `SLOT`, or `SLOT.OPERATION` if the slot
    /// has several.
    pub(crate) fn silences(&self, slots: &[Arc<OpenSlot>]) -> BTreeMap<String, u64> {
        let topic = |slot: &OpenSlot, operation: usize| match slot.operations {
            [_, _, ..] => format!("{}.{}", slot.name, slot.operations[operation].name),
            _ => slot.name.to_string(),
        };
        let silent = self.silent.iter();
        silent
            .map(|(&(slot, operation), time)| {
                let topic = topic(&slots[slot], operation);
                (topic, time.as_millis() as u64)
            })
            .collect()
    }
}

/// Counters and times of one slot.
#[derive(Debug)]
pub(crate) struct SlotCounters {
    pub(crate) peers: usize,
    pub(crate) handlers: TimingRecorder,
    /// Requests that the state of the component refused.
    pub(crate) refused: u64,
    /// Samples that never arrived because newer ones took their place.
    pub(crate) lost: u64,
}

/// Counts runs and failures, and records their times.
#[derive(Debug)]
pub(crate) struct TimingRecorder {
    count: u64,
    errors: u64,
    // Two digits from 1 µs to 100 s. The result is none only for bounds that the library refuses,
    // which these are not.
    times: Option<Histogram<u32>>,
}

impl Status {
    fn new(period: Duration, slots: usize) -> Self {
        Self {
            state: State::Starting,
            period,
            compute: TimingRecorder::new(),
            overruns: 0,
            slots: (0..slots).map(|_| SlotCounters::new()).collect(),
            last_error: None,
            refused: LogLimit::default(),
            machine: None,
            world: None,
            schema: Vec::new(),
            followers: Vec::new(),
            waiting_for: Vec::new(),
            sent: Vec::new(),
            withheld: Vec::new(),
            converted: Vec::new(),
            fresh: Vec::new(),
            forwarded: Vec::new(),
            transports: Vec::new(),
            queues: Vec::new(),
            mismatches: Vec::new(),
            group: None,
            delta: HeartbeatDelta::default(),
        }
    }

    /// Notes the reports about peers that are there and do not fit.
    pub(crate) fn note_mismatches(&mut self, reports: &[String]) {
        self.mismatches = listed(reports);
    }

    /// Counts for so many slots: the worker has opened members.
    pub(crate) fn extend_slots(&mut self, count: usize) {
        self.slots.resize_with(count, SlotCounters::new);
    }

    /// How many samples a slot has published, or how many calls it has made.
    pub(crate) fn sent(&self, slot: usize) -> u64 {
        total(&self.sent, slot)
    }

    /// How many samples a slot has not published because the component was not active.
    pub(crate) fn withheld(&self, slot: usize) -> u64 {
        total(&self.withheld, slot)
    }

    /// The conversions of a slot. `None` if it converts nothing.
    pub(crate) fn converted(&self, slot: usize) -> Option<ConvertedStatus> {
        // A member that failed to open has left its number to the next one.
        let counts = self.converted.iter().rfind(|(at, _)| *at == slot);
        counts.map(|(_, counts)| ConvertedStatus {
            messages: counts.converted(),
            bad_values: counts.refused(),
            unplaced: counts.unplaced(),
            locked: counts.locked(),
            bad_value: counts.last_refused(),
        })
    }

    /// How old the values of a slot are. `None` if it does not keep track.
    pub(crate) fn freshness(&self, slot: usize, now: u64) -> Option<FreshnessStatus> {
        let counts = self.fresh.iter().rfind(|(at, _)| *at == slot);
        counts.map(|(_, counts)| counts.status(now))
    }

    /// The forwarded messages of a slot. `None` if it forwards nothing.
    pub(crate) fn forwarded(&self, slot: usize) -> Option<ForwardedStatus> {
        let counts = self.forwarded.iter().rfind(|(at, _)| *at == slot);
        counts.map(|(_, counts)| counts.status())
    }

    /// The messages over each middleware of a slot. Empty for a slot with one.
    pub(crate) fn transports(&self, slot: usize, names: &[&'static str]) -> Vec<TransportStatus> {
        let several = names.iter().filter(|_| names.len() > 1);
        let transports = several.map(|name| {
            let all = self.transports.iter();
            let of = all.filter(|(at, of, _)| *at == slot && of == name);
            TransportStatus {
                middleware: (*name).to_owned(),
                messages: of.map(|(_, _, counter)| counter.get()).sum(),
            }
        });
        transports.collect()
    }

    /// The use of the receive queues of a slot; `None` if its middleware has none.
    pub(crate) fn queue(&self, slot: usize) -> Option<QueueStatus> {
        let all = self.queues.iter().filter(|(at, _)| *at == slot);
        all.map(|(_, gauge)| QueueStatus {
            bytes: gauge.bytes(),
            limit: gauge.limit(),
            dropped: gauge.dropped(),
        })
        .reduce(|one, other| QueueStatus {
            bytes: one.bytes + other.bytes,
            limit: one.limit + other.limit,
            dropped: one.dropped + other.dropped,
        })
    }
}

/// The sum of the counters of a slot.
fn total(counters: &[(usize, Counter)], slot: usize) -> u64 {
    let of = counters.iter().filter(|(at, _)| *at == slot);
    of.map(|(_, counter)| counter.get()).sum()
}

impl SlotCounters {
    fn new() -> Self {
        Self {
            peers: 0,
            handlers: TimingRecorder::new(),
            refused: 0,
            lost: 0,
        }
    }

    /// Counts a handled message. `lost` samples of its sender right before it did not arrive.
    pub(crate) fn handled(&mut self, took: Duration, lost: u64, ok: bool) {
        self.handlers.count(took, ok);
        self.lost = self.lost.saturating_add(lost);
    }
}

impl TimingRecorder {
    fn new() -> Self {
        Self {
            count: 0,
            errors: 0,
            times: Histogram::new_with_bounds(1, 100_000_000, 2).ok(),
        }
    }

    pub(crate) fn count(&mut self, took: Duration, ok: bool) {
        self.count += 1;
        self.errors += u64::from(!ok);
        if let Some(times) = &mut self.times {
            times.saturating_record((took.as_micros() as u64).max(1));
        }
    }

    pub(crate) fn timing(&self) -> Timing {
        let times = self.times.as_ref();
        let at = |quantile: f64| times.map_or(0, |times| times.value_at_quantile(quantile));
        Timing {
            count: self.count,
            errors: self.errors,
            p50_us: at(0.5),
            p99_us: at(0.99),
            max_us: times.map_or(0, Histogram::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_lists_some_endpoints_that_do_not_fit() {
        let report = |at: usize| format!("{at}\n{}", "x".repeat(9000));
        let reports: Vec<String> = (0..1000).map(report).collect();
        let listed = listed(&reports);
        assert_eq!(listed.len(), MISMATCHES + 1);
        assert!(listed.iter().all(|report| report.len() < 300));
        assert!(listed[1].starts_with("1\\nxxx"), "{}", listed[1]);
        assert!(listed[MISMATCHES].starts_with("more endpoints do not fit"));
        // A number would be another condition at each change.
        assert_eq!(super::listed(&reports[..500]), listed);
        assert_eq!(super::listed(&reports[..MISMATCHES]).len(), MISMATCHES);
        assert_eq!(super::listed(&[]), [""; 0]);
    }
}
