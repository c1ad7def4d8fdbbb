//! A supervisor of components on other machines, whose agents are the test.

use super::MOST_TURNS;
use crate::guard::guard_process::GuardCommand;
use crate::guard::lock::Lock;
use crate::log::reporter::Reporter;
use crate::supervisor::control::ClientRequest;
use crate::supervisor::options::Options;
use crate::supervisor::supervise::{StopReason, Supervisor};
use crate::supervisor::unit::Unit;
use rc_deploy_client::logs;
use rc_deploy_network::plan::{Component, Host, Plan, Policy, Restart};
use rc_deploy_network::planned_chain::PlannedChain;
use rc_management::agent::{AgentMessage, Exit};
use rc_management::event::Severity;
use rc_management::lifecycle::LifecycleState::{self, Unconfigured};
use rc_management::link::{ComponentMessage, LifecycleReport};
use rc_management::rpc;
use rc_management::supervisor::{Request, Verb};
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

static NETWORKS: AtomicU32 = AtomicU32::new(0);

/// A guard that holds nothing, as a script.
const GUARD: &str = r#"echo '"guarding"' >&0
while read -r line; do
    case $line in '"release"') echo '"released"' >&0 ;; '"farewell"') exit ;; esac
done"#;

/// A supervisor, and how many of its events were read. Its files are removed with it.
pub(super) struct Net {
    supervisor: Option<Supervisor<'static>>,
    seen: u64,
}

impl Deref for Net {
    type Target = Supervisor<'static>;

    fn deref(&self) -> &Self::Target {
        self.supervisor.as_ref().expect("it is not dropped")
    }
}

impl DerefMut for Net {
    fn deref_mut(&mut self) -> &mut Self::Target {
        self.supervisor.as_mut().expect("it is not dropped")
    }
}

impl Drop for Net {
    fn drop(&mut self) {
        if let Some(supervisor) = self.supervisor.take() {
            let logs = logs::directory(&supervisor.plan.network);
            drop(supervisor.network_guard.finish(&|| ()));
            let _ = std::fs::remove_dir_all(logs);
        }
    }
}

/// A component on the machine `host`.
pub(super) fn on(host: &str, component: Component) -> Component {
    let host = Host {
        name: host.to_owned(),
        address: format!("{host}.local"),
        user: None,
        workspace: None,
        elsewhere: None,
    };
    Component {
        host: Some(host),
        ..component
    }
}

pub(super) fn after(needed: &str, component: Component) -> Component {
    Component {
        after: vec![needed.to_owned()],
        ..component
    }
}

pub(super) fn with_policy(policy: Policy, component: Component) -> Component {
    Component {
        restart: Restart {
            policy,
            limit: Some((1, Duration::from_mins(1))),
            ..Restart::default()
        },
        ..component
    }
}

impl Net {
    /// A network whose machines are not connected yet.
    pub(super) fn new(components: Vec<Component>) -> Self {
        Self::with_chains(components, Vec::new())
    }

    /// A network with chains.
    pub(super) fn with_chains(components: Vec<Component>, chains: Vec<PlannedChain>) -> Self {
        let number = NETWORKS.fetch_add(1, Ordering::Relaxed);
        let network = format!("supervising-{}-{number}", std::process::id());
        let plan: &Plan = Box::leak(Box::new(Plan {
            chains,
            ..Plan::new(network, "net.ddsl", components)
        }));
        let options = Options {
            guard: Some(GuardCommand {
                program: "/bin/sh".into(),
                args: ["-c", GUARD, "guard"].map(str::to_owned).into(),
            }),
            ..Options::default()
        };
        let lock = Lock::acquire(&plan.network).expect("a lock");
        let report = Box::leak(Box::new(Reporter::silent()));
        let supervisor = Supervisor::new(plan, &options, lock, report).expect("a supervisor");
        Self {
            supervisor: Some(supervisor),
            seen: 0,
        }
    }

    pub(super) fn look_at_recordings(&mut self) {
        let Supervisor { troubles, logs, .. } = &mut **self;
        troubles.look_at_recordings(logs);
    }

    pub(super) fn restore_logs(&mut self) {
        let Supervisor { troubles, logs, .. } = &mut **self;
        troubles.restore_logs(logs);
    }

    /// A network with a connected machine for each component without one.
    pub(super) fn connected(components: Vec<Component>) -> Self {
        let placed = |component: Component| match component.host {
            None => on("h", component),
            Some(_) => component,
        };
        let mut net = Self::new(components.into_iter().map(placed).collect());
        for host in net.hosts.indices() {
            net.hosts.pretend(host);
        }
        net
    }

    /// A network whose units are ready. The managed ones are where they should be.
    pub(super) fn up(components: Vec<Component>) -> Self {
        let mut net = Self::connected(components);
        for turn in 0.. {
            if net.units.iter().all(Unit::is_settled) {
                break;
            }
            assert!(turn < MOST_TURNS, "not settled: {:?}", net.alive());
            net.turn();
            for i in 0..net.units.len() {
                if net.units[i].is_alive() {
                    net.say(i, &ComponentMessage::Ready);
                    net.obey(i);
                }
            }
        }
        net.note_up();
        net.events();
        net
    }

    /// One turn of the loop without events.
    pub(super) fn turn(&mut self) {
        self.advance_commands();
        self.start_ready_units();
        self.advance_lifecycles();
        self.stop_ready_units();
    }

    pub(super) fn say(&mut self, i: usize, message: &ComponentMessage) {
        let line = rpc::notification(message);
        let name = self.units[i].name().to_owned();
        let line = Some(String::from_utf8(line).expect("JSON"));
        let host = self.hosts.of(i).expect("a machine");
        self.take_agent_message(host, AgentMessage::LinkLine { name, line });
    }

    pub(super) fn report_state(&mut self, i: usize, state: LifecycleState, done: u64) {
        let error = None;
        let report = LifecycleReport { state, done, error };
        self.say(i, &ComponentMessage::Lifecycle(report));
    }

    /// A managed unit comes to the goal that it was told, if any.
    pub(super) fn obey(&mut self, i: usize) {
        let Some(control) = &self.units[i].lifecycle else {
            return;
        };
        let (number, sent) = control.sent();
        let state = sent.or(control.state()).unwrap_or(Unconfigured);
        self.report_state(i, state, number);
    }

    pub(super) fn end(&mut self, i: usize, exit: Exit) {
        let name = self.units[i].process_name().to_owned();
        let host = self.hosts.of(i).expect("a machine");
        let left = 0;
        self.take_agent_message(host, AgentMessage::Ended { name, exit, left });
    }

    pub(super) fn alive(&self) -> Vec<&str> {
        let alive = self.units.iter().filter(|unit| unit.is_alive());
        alive.map(Unit::name).collect()
    }

    pub(super) fn asked(&self) -> Vec<&str> {
        let asked = self.units.iter().filter(|unit| unit.is_asked_to_stop());
        asked.map(Unit::name).collect()
    }

    /// The units that were told a goal which they have not reached.
    pub(super) fn told(&self) -> Vec<(&str, LifecycleState)> {
        let told = self.units.iter().filter_map(|unit| {
            let (_, goal) = unit.lifecycle.as_ref()?.sent();
            Some((unit.name(), goal?))
        });
        told.collect()
    }

    pub(super) fn command(&mut self, verb: Verb, names: &[&str]) {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let request = ClientRequest::of(1, Request::Status);
        self.take_command(request, verb, &names);
    }

    pub(super) fn failure(&self) -> Option<&str> {
        match &self.ending {
            Some(StopReason::Failed(message)) => Some(message),
            _ => None,
        }
    }

    /// The new events, without those of the life cycle. Warnings and errors have a mark.
    pub(super) fn events(&mut self) -> Vec<String> {
        let mut events = Vec::new();
        let report = self.report;
        while let Some(Ok(event)) = report.journal().get(self.seen) {
            self.seen += 1;
            if event.code == "lifecycle" {
                continue;
            }
            let mark = match event.severity {
                Severity::Info => "",
                Severity::Warning => "! ",
                Severity::Error => "!! ",
            };
            let who = event.component.as_deref().unwrap_or("-");
            let text = event.message.lines().next().unwrap_or_default();
            let text = text.split("; ").next().unwrap_or_default();
            events.push(format!("{mark}{who} {}: {text}", event.code));
        }
        events
    }
}
