//! Conditions of a running component. They are reported when they start and when they end.
//!
//! The component detects them and sends them in its heartbeats. A condition ends when no heartbeat
//! of the last five seconds had it, so that a condition that comes and goes is one event.

mod values;
mod world;

use crate::supervisor::memory_growth::{Growing, Growth};
use rc_deploy_network::plan::Component;
use rc_management::component::{ClockStatus, MachineStatus, WorldStatus};
use rc_management::event::Severity;
use rc_management::link::Heartbeat;
use rc_management::supervisor::Trouble;
use std::collections::BTreeMap;
use std::time::{Duration, Instant, SystemTime};

/// How many heartbeats in a row without a condition end it.
const CALM: u32 = 10;
/// The loop of a component turns more often than this, unless a handler or `compute()` takes
/// longer. It notices overruns and silences at its turns.
const TURN_LIMIT_MS: u64 = 500;
/// How many mismatching peers are conditions; the runtime lists 16 and that there are more.
const MISMATCHES: usize = 32;

/// Severity, code and message of an event.
pub(crate) type HealthEvent = (Severity, &'static str, String);

/// The code of a condition, and its subject: a slot or a topic.
type Key = (&'static str, String);

/// The conditions of one run of a component.
#[derive(Debug, Default)]
pub(crate) struct HealthMonitor {
    /// The slots whose peers are not part of the network.
    external: Vec<String>,
    /// The slots that need no peer.
    optional: Vec<String>,
    /// How many more heartbeats without it an overrun, or the silence of a topic, needs to end.
    overrun: u32,
    silent: BTreeMap<String, u32>,
    /// Whether a slot has a peer. A slot that never had one is left out.
    peers: BTreeMap<String, bool>,
    /// How many more heartbeats without a first peer a slot may have.
    patience: BTreeMap<String, u32>,
    growth: Growth,
    /// The clock, from the last heartbeat.
    clock: Option<Box<ClockStatus>>,
    /// The state machine, from the last heartbeat.
    machine: Option<Box<MachineStatus>>,
    /// The replica of the shared world, from the last heartbeat.
    world: Option<Box<WorldStatus>>,
    /// The time of its first report about its replica.
    world_since: Option<Instant>,
    /// How many more heartbeats without a refused message end that condition.
    refused: u32,
    /// Of each slot that converts: how many values it has refused, and how many more heartbeats
    /// without one end that.
    bad_values: BTreeMap<String, (u64, u32)>,
    troubles: BTreeMap<Key, (SystemTime, String)>,
    /// The network stops: vanishing peers are expected.
    quiet: bool,
}

impl HealthMonitor {
    pub(crate) fn new(component: &Component) -> Self {
        Self {
            external: component.external.clone(),
            optional: component.optional.clone(),
            ..Self::default()
        }
    }

    /// Stops reporting: the network stops, so peers vanish.
    pub(crate) fn be_quiet(&mut self) {
        self.quiet = true;
    }

    /// Takes a heartbeat. Returns the events that follow from it.
    pub(crate) fn heartbeat(&mut self, heartbeat: Heartbeat) -> Vec<HealthEvent> {
        let mut happened = Vec::new();
        self.machine.clone_from(&heartbeat.machine);
        if self.quiet {
            return happened;
        }
        for jump in &heartbeat.jumps {
            let text = format!(
                "time jumped back from {:.3} s to {:.3} s",
                jump.from_s, jump.to_s
            );
            happened.push((Severity::Warning, "time-jumped", text));
        }
        // A loop that does not turn notices nothing, so no condition is over.
        if heartbeat.age_ms < TURN_LIMIT_MS || heartbeat.overruns.is_some() {
            self.overruns(&heartbeat, &mut happened);
            self.silences(heartbeat.silent, &mut happened);
        }
        self.time(heartbeat.clock, &mut happened);
        for (slot, peers) in heartbeat.peers {
            self.peers(slot, peers > 0, &mut happened);
        }
        self.mismatches(heartbeat.mismatches, &mut happened);
        self.world(heartbeat.world, &mut happened);
        happened
    }

    fn overruns(&mut self, heartbeat: &Heartbeat, happened: &mut Vec<HealthEvent>) {
        let Some(overruns) = &heartbeat.overruns else {
            if end_of(&mut self.overrun) {
                self.over("overrun", "");
                let text = "keeps to its period again".to_owned();
                happened.push((Severity::Info, "in-time", text));
            }
            return;
        };
        let text = format!(
            "{} took {:.1} ms, longer than the period of {} ms",
            overruns.what, overruns.ms, overruns.period_ms
        );
        if self.overrun == 0 {
            happened.push((Severity::Warning, "overrun", text.clone()));
        }
        self.overrun = CALM;
        self.begin("overrun", "", &text);
    }

    /// The peers that are there and do not fit.
    fn mismatches(&mut self, mut present: Vec<String>, happened: &mut Vec<HealthEvent>) {
        present.truncate(MISMATCHES);
        let known = self.troubles.keys().filter(|(code, _)| *code == "mismatch");
        let known: Vec<String> = known.map(|(_, text)| text.clone()).collect();
        for text in known.iter().filter(|text| !present.contains(text)) {
            self.over("mismatch", text);
            let text = format!("no longer so: {text}");
            happened.push((Severity::Info, "mismatch-over", text));
        }
        for text in present {
            self.begin("mismatch", &text, &text);
            if !known.contains(&text) {
                happened.push((Severity::Error, "mismatch", text));
            }
        }
    }

    /// The conditions of the network's time.
    fn time(&mut self, clock: Option<Box<ClockStatus>>, happened: &mut Vec<HealthEvent>) {
        let lost = clock
            .as_ref()
            .and_then(|clock| clock.lost_ms)
            .map(|ms| format!("its source of time has been silent for {ms} ms; its time stands"));
        let waits = clock.as_ref().filter(|clock| !clock.waiting_for.is_empty());
        let waits = waits.map(|clock| {
            let names = clock.waiting_for.join(", ");
            format!("tick {} of time waits for {names}", clock.tick)
        });
        for (code, over, begun, ended) in [
            ("time-lost", "time-back", lost, "its source of time is back"),
            ("time-waits", "time-goes-on", waits, "time no longer waits"),
        ] {
            self.change(code, over, begun, ended, happened);
        }
        self.clock = clock;
    }

    /// Begins a condition, or ends it.
    fn change(
        &mut self,
        code: &'static str,
        over: &'static str,
        text: Option<String>,
        ended: &str,
        happened: &mut Vec<HealthEvent>,
    ) {
        let was = self.has(code);
        match text {
            Some(text) => {
                self.begin(code, "", &text);
                if !was {
                    happened.push((Severity::Warning, code, text));
                }
            }
            None if was => {
                self.over(code, "");
                happened.push((Severity::Info, over, ended.to_owned()));
            }
            None => {}
        }
    }

    /// The clock, unless it is that of the system.
    pub(crate) fn clock(&self) -> Option<&ClockStatus> {
        self.clock.as_deref()
    }

    /// The state machine of the component.
    pub(crate) fn machine(&self) -> Option<&MachineStatus> {
        self.machine.as_deref()
    }

    fn silences(&mut self, silent: BTreeMap<String, u64>, happened: &mut Vec<HealthEvent>) {
        let mut over = Vec::new();
        for (topic, calm) in &mut self.silent {
            if !silent.contains_key(topic) && end_of(calm) {
                over.push(topic.clone());
            }
        }
        for topic in over {
            self.silent.remove(&topic);
            self.over("silent", &topic);
            let text = format!("samples of {topic} come in time again");
            happened.push((Severity::Info, "heard-again", text));
        }
        for (topic, ms) in silent {
            let text = format!("no sample of {topic} came for {ms} ms, longer than its deadline");
            self.begin("silent", &topic, &text);
            if self.silent.insert(topic, CALM).is_none() {
                happened.push((Severity::Warning, "silent", text));
            }
        }
    }

    fn peers(&mut self, slot: String, there: bool, happened: &mut Vec<HealthEvent>) {
        let external = self.external.contains(&slot);
        let optional = self.optional.contains(&slot);
        let word = match (external, optional) {
            (true, _) => "external slot",
            (false, true) => "optional slot",
            (false, false) => "slot",
        };
        match (self.peers.get(&slot), there) {
            (Some(true), false) if optional => {
                let text = format!("{word} {slot} has no peer any more");
                happened.push((Severity::Info, "peer-vanished", text));
            }
            (Some(true), false) => {
                let text = format!("{word} {slot} has no peer any more");
                self.begin("peer-vanished", &slot, &text);
                happened.push((Severity::Warning, "peer-vanished", text));
            }
            // After a restart, a peer that is missing was missing before, too.
            (None, false) if !optional => {
                if end_of(self.patience.entry(slot.clone()).or_insert(CALM)) {
                    let text = format!("{word} {slot} has no peer yet");
                    self.begin("peer-missing", &slot, &text);
                    happened.push((Severity::Warning, "peer-missing", text));
                }
                return;
            }
            (None, true) if self.patience.get(&slot) == Some(&0) => {
                self.over("peer-missing", &slot);
                let text = format!("{word} {slot} has a peer now");
                happened.push((Severity::Info, "peer-back", text));
            }
            (Some(false), true) => {
                self.over("peer-vanished", &slot);
                let text = format!("{word} {slot} has a peer again");
                happened.push((Severity::Info, "peer-back", text));
            }
            (None, false) => return,
            _ => {}
        }
        self.peers.insert(slot, there);
    }

    /// Notes a condition that ends with [`Self::ended`], or with the process.
    pub(crate) fn begun(&mut self, code: &'static str, text: &str) {
        self.begin(code, "", text);
    }

    /// Whether a condition has started and not ended.
    pub(crate) fn has(&self, code: &'static str) -> bool {
        self.troubles.contains_key(&(code, String::new()))
    }

    /// Ends a condition. Returns whether there was one.
    pub(crate) fn ended(&mut self, code: &'static str) -> bool {
        self.troubles.remove(&(code, String::new())).is_some()
    }

    /// Takes the resident memory of the process in bytes, `pause` after the last reading.
    pub(crate) fn memory(&mut self, bytes: u64, pause: Duration) -> Option<HealthEvent> {
        match self.growth.sample(bytes, pause)? {
            Growing::Grows(text) => {
                let is_new = !self
                    .troubles
                    .contains_key(&("memory-growth", String::new()));
                self.begin("memory-growth", "", &text);
                is_new.then_some((Severity::Warning, "memory-growth", text))
            }
            Growing::Steady => self.ended("memory-growth").then(|| {
                let text = "its memory no longer grows steadily".to_owned();
                (Severity::Info, "memory-steady", text)
            }),
        }
    }

    fn begin(&mut self, code: &'static str, about: &str, text: &str) {
        let now = SystemTime::now();
        let trouble = self.troubles.entry((code, about.to_owned()));
        text.clone_into(&mut trouble.or_insert((now, String::new())).1);
    }

    fn over(&mut self, code: &'static str, about: &str) {
        self.troubles.remove(&(code, about.to_owned()));
    }

    /// The present conditions.
    pub(crate) fn troubles(&self) -> Vec<Trouble> {
        let troubles = self.troubles.iter();
        troubles
            .map(|((code, _), (since, message))| Trouble {
                code: (*code).to_owned(),
                message: message.clone(),
                since: rc_management::event::time_text(*since),
            })
            .collect()
    }
}

/// Counts a heartbeat without the condition. Returns whether it ends the condition.
fn end_of(calm: &mut u32) -> bool {
    let before = *calm;
    *calm = before.saturating_sub(1);
    before == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_management::link::Overruns;

    fn codes(happened: &[HealthEvent]) -> Vec<&'static str> {
        happened.iter().map(|(_, code, _)| *code).collect()
    }

    fn slow() -> Heartbeat {
        Heartbeat {
            overruns: Some(Overruns {
                count: 1,
                what: "compute()".to_owned(),
                ms: 12.34,
                period_ms: 10.0,
            }),
            ..Heartbeat::default()
        }
    }

    fn silent(topics: &[&str]) -> Heartbeat {
        Heartbeat {
            silent: topics.iter().map(|&t| (t.to_owned(), 70)).collect(),
            ..Heartbeat::default()
        }
    }

    fn peers(count: usize) -> Heartbeat {
        Heartbeat {
            peers: BTreeMap::from([("Laser".to_owned(), count)]),
            ..Heartbeat::default()
        }
    }

    #[test]
    fn intermittent_overruns_are_one_event() {
        let mut watch = HealthMonitor::default();
        let text = &watch.heartbeat(slow())[0].2;
        assert_eq!(
            text,
            "compute() took 12.3 ms, longer than the period of 10 ms"
        );
        for _ in 0..100 {
            assert_eq!(codes(&watch.heartbeat(Heartbeat::default())), [""; 0]);
            assert_eq!(codes(&watch.heartbeat(slow())), [""; 0]);
        }
        assert_eq!(watch.troubles()[0].code, "overrun");
        let good: Vec<_> = (0..CALM + 5)
            .flat_map(|_| watch.heartbeat(Heartbeat::default()))
            .collect();
        assert_eq!(codes(&good), ["in-time"]);
        assert_eq!(watch.troubles(), []);
        assert_eq!(codes(&watch.heartbeat(slow())), ["overrun"]);
    }

    #[test]
    fn nothing_is_over_while_the_loop_does_not_turn() {
        let mut watch = HealthMonitor::default();
        assert_eq!(codes(&watch.heartbeat(slow())), ["overrun"]);
        assert_eq!(codes(&watch.heartbeat(silent(&["a"]))), ["silent"]);
        for beats in 1..3 * u64::from(CALM) {
            let hangs = Heartbeat {
                age_ms: 500 * beats,
                ..Heartbeat::default()
            };
            assert_eq!(codes(&watch.heartbeat(hangs)), [""; 0]);
        }
        let good: Vec<_> = (0..CALM)
            .flat_map(|_| watch.heartbeat(Heartbeat::default()))
            .collect();
        assert_eq!(codes(&good), ["in-time", "heard-again"]);
    }

    #[test]
    fn silence_is_detected_per_topic() {
        let mut watch = HealthMonitor::default();
        assert_eq!(
            codes(&watch.heartbeat(silent(&["a", "b"]))),
            ["silent", "silent"]
        );
        for _ in 1..CALM {
            assert_eq!(codes(&watch.heartbeat(silent(&["b"]))), [""; 0]);
        }
        let heard = watch.heartbeat(silent(&["b"]));
        assert_eq!(codes(&heard), ["heard-again"]);
        assert!(heard[0].2.starts_with("samples of a come"), "{heard:?}");
        assert_eq!(watch.troubles().len(), 1);
    }

    #[test]
    fn conditions_of_time_are_reported_when_they_start_and_end() {
        let mut watch = HealthMonitor::default();
        let clock = |lost_ms, waiting_for: &[&str]| Heartbeat {
            clock: Some(Box::new(ClockStatus {
                tick: 7,
                lost_ms,
                waiting_for: waiting_for.iter().map(|&name| name.to_owned()).collect(),
                ..ClockStatus::default()
            })),
            ..Heartbeat::default()
        };
        assert_eq!(codes(&watch.heartbeat(clock(None, &[]))), [""; 0]);
        let happened = watch.heartbeat(clock(Some(3200), &["a", "b"]));
        assert_eq!(codes(&happened), ["time-lost", "time-waits"]);
        assert_eq!(happened[1].2, "tick 7 of time waits for a, b");
        assert_eq!(codes(&watch.heartbeat(clock(Some(3700), &["b"]))), [""; 0]);
        assert_eq!(watch.troubles().len(), 2);
        let happened = watch.heartbeat(clock(None, &[]));
        assert_eq!(codes(&happened), ["time-back", "time-goes-on"]);
        assert_eq!(watch.troubles(), []);
        let jump = rc_management::link::TimeJump {
            from_s: 2.5,
            to_s: 0.0,
        };
        let happened = watch.heartbeat(Heartbeat {
            jumps: vec![jump],
            ..clock(None, &[])
        });
        assert_eq!(happened[0].2, "time jumped back from 2.500 s to 0.000 s");
    }

    #[test]
    fn only_a_known_peer_can_be_lost() {
        let mut watch = HealthMonitor::default();
        let mut after = |count| codes(&watch.heartbeat(peers(count)));
        assert_eq!(after(0), [""; 0]);
        assert_eq!(after(2), [""; 0]);
        assert_eq!(after(1), [""; 0]);
        assert_eq!(after(0), ["peer-vanished"]);
        assert_eq!(after(0), [""; 0]);
        assert_eq!(after(1), ["peer-back"]);
        watch.be_quiet();
        assert_eq!(codes(&watch.heartbeat(peers(0))), [""; 0]);
    }

    #[test]
    fn an_optional_peer_may_vanish_without_trouble() {
        let mut watch = HealthMonitor {
            optional: vec!["Laser".to_owned()],
            ..HealthMonitor::default()
        };
        watch.heartbeat(peers(1));
        let gone = watch.heartbeat(peers(0));
        let text = "optional slot Laser has no peer any more".to_owned();
        assert_eq!(gone, [(Severity::Info, "peer-vanished", text)]);
        assert_eq!(watch.troubles(), []);
        assert_eq!(codes(&watch.heartbeat(peers(1))), ["peer-back"]);
    }

    #[test]
    fn an_external_peer_is_missed_after_a_while_until_it_comes() {
        let mut watch = HealthMonitor {
            external: vec!["Laser".to_owned()],
            ..HealthMonitor::default()
        };
        for _ in 1..CALM {
            assert_eq!(codes(&watch.heartbeat(peers(0))), [""; 0]);
        }
        assert_eq!(codes(&watch.heartbeat(peers(0))), ["peer-missing"]);
        assert_eq!(codes(&watch.heartbeat(peers(0))), [""; 0]);
        assert_eq!(watch.troubles()[0].code, "peer-missing");
        assert_eq!(codes(&watch.heartbeat(peers(1))), ["peer-back"]);
        assert_eq!(watch.troubles(), []);
        assert_eq!(codes(&watch.heartbeat(peers(0))), ["peer-vanished"]);
    }

    /// After a restart, the process knows nothing of the peers of the one before.
    #[test]
    fn a_peer_that_is_missing_after_a_restart_is_missed() {
        let mut watch = HealthMonitor::default();
        let happened: Vec<_> = (0..3 * CALM)
            .flat_map(|_| watch.heartbeat(peers(0)))
            .collect();
        assert_eq!(codes(&happened), ["peer-missing"]);
        assert_eq!(happened[0].2, "slot Laser has no peer yet");
        assert_eq!(watch.troubles()[0].code, "peer-missing");
        assert_eq!(codes(&watch.heartbeat(peers(1))), ["peer-back"]);
        assert_eq!(watch.troubles(), []);
    }

    #[test]
    fn an_external_slot_that_needs_no_peer_is_not_missed() {
        let mut watch = HealthMonitor {
            external: vec!["Laser".to_owned()],
            optional: vec!["Laser".to_owned()],
            ..HealthMonitor::default()
        };
        for _ in 0..2 * CALM {
            assert_eq!(codes(&watch.heartbeat(peers(0))), [""; 0]);
        }
        assert_eq!(codes(&watch.heartbeat(peers(1))), [""; 0]);
        let gone = watch.heartbeat(peers(0));
        assert_eq!(gone[0].2, "external slot Laser has no peer any more");
        assert_eq!(watch.troubles(), []);
    }

    #[test]
    fn an_overrun_is_reported_while_the_loop_hangs() {
        let mut watch = HealthMonitor::default();
        let late = Heartbeat {
            age_ms: 9000,
            ..slow()
        };
        assert_eq!(codes(&watch.heartbeat(late)), ["overrun"]);
    }

    #[test]
    fn a_mismatch_holds_while_heartbeats_have_it() {
        let mut watch = HealthMonitor::default();
        let unlike = |texts: &[&str]| Heartbeat {
            mismatches: texts.iter().map(|&text| text.to_owned()).collect(),
            ..Heartbeat::default()
        };
        assert_eq!(codes(&watch.heartbeat(unlike(&["a"]))), ["mismatch"]);
        assert_eq!(codes(&watch.heartbeat(unlike(&["a"]))), [""; 0]);
        let happened = watch.heartbeat(unlike(&["b"]));
        assert_eq!(codes(&happened), ["mismatch-over", "mismatch"]);
        assert_eq!(happened[0].2, "no longer so: a");
        let troubles = watch.troubles();
        assert_eq!((troubles.len(), troubles[0].message.as_str()), (1, "b"));
        assert_eq!(codes(&watch.heartbeat(unlike(&[]))), ["mismatch-over"]);
        assert_eq!(watch.troubles(), []);
    }

    #[test]
    fn only_some_mismatches_are_kept() {
        let mut watch = HealthMonitor::default();
        let unlike = Heartbeat {
            mismatches: (0..MISMATCHES + 2).map(|at| format!("m{at}")).collect(),
            ..Heartbeat::default()
        };
        let happened = watch.heartbeat(unlike);
        assert_eq!(codes(&happened), ["mismatch"; MISMATCHES]);
        assert_eq!(watch.troubles().len(), MISMATCHES);
    }

    #[test]
    fn the_last_heartbeat_has_the_present_clock_and_machine() {
        let mut watch = HealthMonitor::default();
        assert!(watch.clock().is_none() && watch.machine().is_none());
        let clock = ClockStatus {
            tick: 7,
            ..ClockStatus::default()
        };
        watch.heartbeat(Heartbeat {
            clock: Some(Box::new(clock)),
            machine: Some(Box::default()),
            ..Heartbeat::default()
        });
        assert_eq!(watch.clock().map(|clock| clock.tick), Some(7));
        assert_eq!(watch.machine(), Some(&MachineStatus::default()));
        watch.heartbeat(Heartbeat::default());
        assert!(watch.clock().is_none() && watch.machine().is_none());
    }

    #[test]
    fn growing_memory_is_a_condition() {
        let mut watch = HealthMonitor::default();
        let pause = Duration::from_secs(30);
        let mut grow = |mib: u64| watch.memory(mib << 20, pause);
        let begun: Vec<_> = (100..400).filter_map(&mut grow).collect();
        assert_eq!(codes(&begun), ["memory-growth"], "once, however long");
        assert_eq!(begun[0].0, Severity::Warning);
        let troubles = watch.troubles();
        assert_eq!(troubles[0].code, "memory-growth");
        assert_ne!(troubles[0].message, begun[0].2, "the latest figures");
        let mut stay = |_| watch.memory(400 << 20, pause);
        let over: Vec<_> = (0..1000).filter_map(&mut stay).collect();
        assert_eq!(codes(&over), ["memory-steady"]);
        assert_eq!(watch.troubles(), []);
    }
}
