//! Units whose process runs on this machine.

use super::component;
use crate::log::reporter::Reporter;
use crate::process::identity::{Identity, Mark, first_readable};
use crate::supervisor::unit::{Termination, Unit};
use rc_deploy_network::plan::Component;
use rc_management::lifecycle::LifecycleState;
use rc_management::link::SupervisorMessage;
use std::collections::BTreeSet;
use std::os::fd::{AsFd, OwnedFd};
use std::time::Duration;
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_mins(1);

/// A unit that runs a shell script. Its process is killed with it.
struct Local {
    unit: Unit,
    report: Reporter,
    folder: TempDir,
}

impl Drop for Local {
    fn drop(&mut self) {
        self.unit.kill();
        self.unit.end(&self.report);
    }
}

impl Local {
    /// `folder` is the working directory of the script.
    fn start(script: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let component = Component {
            executable: "/bin/sh".into(),
            args: ["-c", script].map(str::to_owned).into(),
            directory: folder.path().into(),
            managed: true,
            ..component("a")
        };
        let mut unit = Unit::new(component, folder.path().join("a.log"));
        Unit::start(
            &mut [(&mut unit, Vec::new())],
            &Mark::none(),
            &BTreeSet::new(),
        )
        .expect("it starts");
        Self {
            unit,
            report: Reporter::silent(),
            folder,
        }
    }

    /// Waits until there is something to read on its link, and reads it.
    fn read(&mut self) {
        let link = self.unit.link().expect("a link").as_fd();
        await_readable(&link.try_clone_to_owned().expect("a copy"));
        self.unit.read_link(&self.report);
    }

    fn end(&mut self) -> Termination {
        let process = self.unit.process().expect("a process");
        await_readable(&process.try_clone().expect("a copy"));
        self.unit.end(&self.report).expect("it runs")
    }

    fn states(&self) -> Vec<String> {
        let journal = self.report.journal();
        let count = journal.kept().0 as u64;
        let events = (0..count).filter_map(|at| journal.get(at)?.ok());
        let states = events.filter(|event| event.code == "state");
        states.map(|event| event.message.clone()).collect()
    }
}

fn await_readable(descriptor: &OwnedFd) {
    assert!(first_readable([descriptor], LIMIT).is_some());
}

const RUNS: &str = r#"echo '{"method":"state","params":{"state":"running"}}' >&0"#;

#[test]
fn a_local_unit_is_registered_with_its_process() {
    let mut local = Local::start("exec sleep 600");
    let entry = local.unit.registered().expect("a process");
    assert_eq!((&*entry.name, entry.stop_ms), ("a", 3000));
    assert_eq!(local.unit.status().pid, Some(entry.process.pid));
    assert_eq!(Identity::of(entry.process.pid), Some(entry.process));
    assert!(local.unit.remote_process().is_none());
    local.unit.ask_to_stop();
    let end = local.end();
    assert_eq!((end.done, &*end.text), (true, "signal 15 (SIGTERM)"));
    assert!(local.unit.registered().is_none() && local.unit.process().is_none());
    assert!(!entry.process.is_alive());
}

#[test]
fn a_local_unit_is_killed_with_its_group() {
    let mut local = Local::start("trap '' TERM; sleep 600 & echo '{}' >&0; wait");
    local.read();
    local.unit.kill();
    let end = local.end();
    assert_eq!((end.done, &*end.text), (false, "signal 9 (SIGKILL)"));
}

#[test]
fn a_local_unit_is_heard_over_its_link() {
    let mut local = Local::start(&format!("{RUNS}; exec sleep 600"));
    local.read();
    assert_eq!(local.states(), ["running"]);
    // Its last output is read after its end.
    let mut local = Local::start(RUNS);
    let end = local.end();
    assert_eq!((end.done, &*end.text), (true, "exit status 0"));
    assert_eq!(local.states(), ["running"]);
}

#[test]
fn a_local_unit_that_closes_its_link_is_not_heard_any_more() {
    let mut local = Local::start("exec 0</dev/null; exec sleep 600");
    local.read();
    assert!(local.unit.link().is_none());
    let limit = local.unit.deadline().expect("a time");
    local.unit.check(limit, &local.report);
    let journal = local.report.journal();
    let event = journal.get(0).and_then(Result::ok).expect("an event");
    assert_eq!(event.code, "link-closed");
}

#[test]
fn a_local_unit_gets_its_goals_over_its_link() {
    let mut local = Local::start("read -r line; printf %s \"$line\" > goal");
    local.unit.send_goal(LifecycleState::Inactive, LIMIT);
    local.end();
    let line = std::fs::read(local.folder.path().join("goal")).expect("a line");
    let goal = SupervisorMessage::Lifecycle {
        number: 1,
        goal: LifecycleState::Inactive,
    };
    assert_eq!(SupervisorMessage::decode(&line), Some(goal));
}
