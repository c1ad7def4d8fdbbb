//! Tests of units without processes: each runs on another machine, and the test takes the part of
//! its agent.

mod activation;
mod chains;
mod commands;
mod life_cycle;
mod local_process;
mod machines;
mod net;
mod proposals;
mod starts_and_ends;
mod unit;
mod unit_messages;

use crate::log::reporter::Reporter;
use crate::process::identity::Mark;
use crate::remote::{Outbox, SupervisorMessage};
use crate::supervisor::unit::{Termination, Unit};
use rc_deploy_network::plan::Component;
use rc_management::agent::Exit;
use rc_management::event::Severity;
use rc_management::lifecycle::LifecycleState;
use rc_management::lines::Line;
use rc_management::link::{self, ComponentMessage, Heartbeat, LifecycleReport};
use rc_management::rpc;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// A unit, its reporter, and the outbox of its machine.
struct Bench {
    unit: Unit,
    report: Reporter,
    outbox: Outbox,
    seen: u64,
}

fn component(name: &str) -> Component {
    Component::new(name, "/bin/true", "/")
}

/// The turns after which a goal of a test is given up.
const MOST_TURNS: u32 = 100;

fn managed(name: &str) -> Component {
    Component {
        managed: true,
        ..component(name)
    }
}

fn exit(code: i32) -> Exit {
    Exit {
        success: code == 0,
        signal: None,
        text: format!("exit status {code}"),
    }
}

/// Whether a time is `limit` after a moment between `begun` and now.
fn is_after(time: Option<Instant>, begun: Instant, limit: Duration) -> bool {
    time.is_some_and(|at| begun + limit <= at && at <= Instant::now() + limit)
}

impl Bench {
    fn new(component: Component) -> Self {
        let outbox = Outbox::new();
        let mut unit = Unit::new(component, "/nowhere/a.log".into());
        unit.outbox = Some(outbox.clone());
        Self {
            unit,
            report: Reporter::silent(),
            outbox,
            seen: 0,
        }
    }

    fn started(component: Component) -> Self {
        let mut bench = Self::new(component);
        bench.start();
        bench
    }

    fn ready(component: Component) -> Self {
        let mut bench = Self::started(component);
        bench.say(&ComponentMessage::Ready);
        assert!(bench.unit.is_ready());
        bench.events();
        bench
    }

    /// A managed unit that has come so far, as it was asked to.
    fn managed(state: LifecycleState) -> Self {
        let mut bench = Self::started(managed("a"));
        bench.say(&ComponentMessage::Ready);
        bench.unit.set_lifecycle_goal(state);
        bench.report(LifecycleState::Unconfigured, 0, None);
        let limit = Duration::from_secs(5);
        for turn in 0.. {
            let Some(goal) = bench.unit.next_goal() else {
                break;
            };
            assert!(turn < MOST_TURNS, "{goal:?} is never reached");
            bench.unit.send_goal(goal, limit);
            let control = bench.unit.lifecycle.as_ref();
            let (number, _) = control.expect("it is managed").sent();
            bench.report(goal, number, None);
        }
        assert!(bench.unit.is_settled());
        bench.events();
        bench.outbox.take();
        bench
    }

    fn start(&mut self) {
        let started = Unit::start(
            &mut [(&mut self.unit, Vec::new())],
            &Mark::none(),
            &BTreeSet::new(),
        );
        started.expect("its agent starts it");
    }

    fn say(&mut self, message: &ComponentMessage) {
        let line = rpc::notification(message);
        self.unit.handle_line(Line::Complete(line), &self.report);
    }

    fn beat(&mut self, age_ms: u64) {
        self.say(&ComponentMessage::Heartbeat(Heartbeat {
            age_ms,
            ..Heartbeat::default()
        }));
    }

    fn report(&mut self, state: LifecycleState, done: u64, error: Option<&str>) {
        let error = error.map(str::to_owned);
        let report = LifecycleReport { state, done, error };
        self.say(&ComponentMessage::Lifecycle(report));
    }

    /// Messages of its supervisor on its link.
    fn told(&self) -> Vec<link::SupervisorMessage> {
        let sent = self.outbox.take().into_iter();
        sent.filter_map(|message| match message {
            SupervisorMessage::LinkLine { line, .. } => {
                link::SupervisorMessage::decode(line.trim().as_bytes())
            }
            _ => None,
        })
        .collect()
    }

    /// The new events. Warnings and errors have a mark.
    fn events(&mut self) -> Vec<String> {
        let journal = self.report.journal();
        let mut events = Vec::new();
        while let Some(Ok(event)) = journal.get(self.seen) {
            let mark = match event.severity {
                Severity::Info => "",
                Severity::Warning => "! ",
                Severity::Error => "!! ",
            };
            events.push(format!("{mark}{}: {}", event.code, event.message));
            self.seen += 1;
        }
        events
    }

    fn end(&mut self, exit: Exit) -> Termination {
        let process = self.unit.remote_process().expect("it runs");
        process.ended(exit);
        self.unit.end(&self.report).expect("it runs")
    }
}
