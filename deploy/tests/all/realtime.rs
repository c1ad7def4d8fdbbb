//! Processor affinity and real-time priorities, as the system reports them. Tests that the machine
//! does not permit are skipped.

use crate::bench::{Bench, well};
use rc_deploy::Component;
use rc_deploy_client::status::table;
use rc_test_support::python;
use std::process::{Command, Output};

/// The processors that a process may use, as the system lists them.
fn allowed(pid: &str) -> String {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).expect("it runs");
    let mut lines = status.lines();
    let list = lines.find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    list.expect("Linux tells it").trim().to_owned()
}

/// The policy (1 is `SCHED_FIFO`) and the real-time priority of a process: fields 41 and 40 of
/// proc(5).
fn scheduling(pid: i32) -> (u32, u32) {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
    let (_, rest) = stat.rsplit_once(')').expect("a name");
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let number = |field: usize| fields[field - 3].parse().expect("a number");
    (number(41), number(40))
}

/// The last processor that the tests may use.
fn last() -> u16 {
    let list = allowed("self");
    let number = list.rsplit([',', '-']).next().expect("one");
    number.parse().expect("a number")
}

fn may_have_priorities() -> bool {
    let tried = Command::new("chrt").args(["-f", "7", "true"]).output();
    tried.is_ok_and(|tried| tried.status.success())
}

fn with_priority(name: &str, priority: u8) -> Component {
    Component {
        priority: Some(priority),
        ..well(name)
    }
}

#[test]
fn a_component_runs_on_its_processors_only() {
    let bench = Bench::new();
    let cpu = vec![last()];
    let mut up = bench.start(vec![
        Component {
            cpu: cpu.clone(),
            ..well("bound")
        },
        well("free"),
    ]);
    up.await_event("up", None);
    let status = bench.status();
    let pids: Vec<String> = status
        .components
        .iter()
        .map(|c| c.pid.expect("it runs").to_string())
        .collect();
    assert_eq!(allowed(&pids[0]), cpu[0].to_string());
    // Neither the other components nor rcdeploy itself are restricted to them.
    assert_eq!(allowed(&pids[1]), allowed("self"));
    assert_eq!(allowed(&status.pid.to_string()), allowed("self"));
    assert_eq!(status.components[0].cpu, cpu);
    assert!(
        table(&status).contains(&format!("  cpu {}", cpu[0])),
        "{status:?}"
    );
    assert!(!status.components[1].cpu.contains(&cpu[0]));
    bench.command("down", &[]);
    bench.assert_nothing_left();
}

#[test]
fn a_missing_processor_stops_the_start() {
    let bench = Bench::new();
    let mut up = bench.start(vec![Component {
        cpu: vec![1023],
        ..well("far")
    }]);
    let report = up.await_event("start-failed", Some("far"));
    assert!(
        report.contains("this machine has no processor 1023; there are 0"),
        "{report}"
    );
    assert_eq!(bench.journal(), Vec::<String>::new(), "it has run");
}

#[test]
fn a_priority_applies_to_its_process_only() {
    if !may_have_priorities() {
        return python::skipped(
            "a_priority_applies_to_its_process_only",
            "this user may not have real-time priorities",
        );
    }
    let bench = Bench::new();
    let mut up = bench.start(vec![with_priority("urgent", 7), well("patient")]);
    up.await_event("up", None);
    let status = bench.status();
    let pid = |at: usize| status.components[at].pid.expect("it runs");
    assert_eq!(scheduling(pid(0)), (1, 7));
    assert_eq!(scheduling(pid(1)), (0, 0));
    assert_eq!(scheduling(status.pid), (0, 0));
    assert_eq!(status.components[0].priority, Some(7));
    assert!(table(&status).contains("  priority 7"), "{status:?}");
    bench.command("down", &[]);
    bench.assert_nothing_left();
}

/// Drops the capability; root keeps what its bounding set contains.
#[test]
fn a_forbidden_priority_is_reported_with_a_remedy() {
    let bench = Bench::new();
    let plan = bench.write(vec![with_priority("urgent", 7)]);
    let driver = bench.driver(&["up", &plan, "--json"]);
    let mut command = if may_have_priorities() {
        let mut command = Command::new("setpriv");
        command.args([
            "--bounding-set=-sys_nice",
            "--inh-caps=-sys_nice",
            "prlimit",
            "--rtprio=0:0",
        ]);
        command.arg(driver.get_program()).args(driver.get_args());
        for (name, value) in driver.get_envs() {
            command.env(name, value.expect("a value"));
        }
        command
    } else {
        driver
    };
    let Ok(Output { status, stdout, .. }) = command.output() else {
        return python::skipped(
            "a_forbidden_priority_is_reported_with_a_remedy",
            "there is no setpriv",
        );
    };
    let report = String::from_utf8_lossy(&stdout);
    assert_eq!(status.code(), Some(3), "{report}");
    for word in [
        "start-failed",
        "forbids the real-time priority 7",
        "rtprio 7",
        "CAP_SYS_NICE",
    ] {
        assert!(report.contains(word), "{report}");
    }
    assert_eq!(bench.journal(), Vec::<String>::new(), "it has run");
}
