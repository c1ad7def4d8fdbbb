//! Golden screens, and reactions to keys.

mod keys;
mod screens;

use super::input::Key;
use super::model::{Command, Host, Model, Page, Sample};
use super::render;
use expect_test::{Expect, expect};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::style::Color;
use rc_management::component::{self, MachineStatus, Parameters, TransitionStatus};
use rc_management::supervisor::{
    ComponentState, ComponentStatus, Event, NetworkStatus, Trouble, Verb,
};
use serde_json::{Value, json};
use std::time::Duration;

const NAMES: [&str; 6] = [
    "simulator",
    "avoider",
    "left.arm.gripper",
    "left.eye",
    "right.eye",
    "monitor",
];

/// The machine of the avoider.
fn machine() -> MachineStatus {
    let text = str::to_owned;
    MachineStatus {
        states: vec![text("on.motion.cruising"), text("on.battery.charged")],
        external: vec![text("go"), text("stop")],
        transitions: vec![TransitionStatus {
            from: text("on.motion.turning"),
            to: vec![text("on.motion.cruising")],
            event: Some(text("clear")),
            took_us: 41,
            at_s: 60.0,
        }],
    }
}

fn status() -> NetworkStatus {
    let components = NAMES.iter().enumerate().map(|(at, name)| ComponentStatus {
        name: (*name).to_owned(),
        by_hand: false,
        process: None,
        behind: Vec::new(),
        host: None,
        state: match at {
            3 => ComponentState::Emergency,
            5 => ComponentState::Failed,
            _ => ComponentState::Running,
        },
        lifecycle: None,
        pid: (at != 5).then_some(100 + at as i32),
        uptime_s: (at != 5).then_some(62.0 * (at * at) as f64),
        ready: true,
        middleware: "iceoryx2".to_owned(),
        transports: std::collections::BTreeMap::new(),
        cpu: Vec::new(),
        priority: None,
        executable: "/robot/bin".into(),
        log: "/robot/log".into(),
        restarts: at as u32 / 4,
        ready_ms: 10_000,
        stop_ms: 5_000,
        lost: [("pose".to_owned(), 12)]
            .into_iter()
            .filter(|_| at == 4)
            .collect(),
        messages: std::collections::BTreeMap::new(),
        forwarded: std::collections::BTreeMap::new(),
        converted: std::collections::BTreeMap::new(),
        troubles: Vec::new(),
        clock: None,
        machine: (at == 1).then(machine),
        exit: (at == 5).then(|| "signal 11 (SIGSEGV)".to_owned()),
    });
    NetworkStatus {
        network: "patrol".to_owned(),
        pid: 99,
        guard: Some(98),
        directory: "/run/robocomp/patrol".into(),
        troubles: Vec::new(),
        ddsl: "patrol.ddsl".into(),
        digest: None,
        changed: false,
        components: components.collect(),
    }
}

/// A slot whose counters have run for `seconds`.
fn slot(name: &str, role: &str, address: &str, rate: u64, seconds: u64) -> Value {
    let count = rate * seconds;
    let received = ["implements", "subscribesTo"].contains(&role);
    json!({
        "name": name, "role": role, "interface": "Laser", "middleware": "iceoryx2", "address": address, "peers": 1,
        "handlers": {"count": if received { count } else { 0 }, "errors": 0, "p50_us": 12, "p99_us": 340, "max_us": 9000},
        "sent": if received { 0 } else { count }, "lost": 0,
    })
}

/// A slot that also has clients in its process.
fn in_several(mut slot: Value) -> Value {
    let over =
        |middleware: &str, messages: u64| json!({"middleware": middleware, "messages": messages});
    slot["transports"] = json!([over("iceoryx2", 15), over("local", 5)]);
    slot
}

fn report(name: &str, seconds: u64) -> component::Status {
    let slots = match name {
        "simulator" => json!([
            in_several(slot(
                "laser",
                "implements",
                "patrol/simulator/laser",
                20,
                seconds
            )),
            slot("pose", "publishes", "patrol/simulator/pose", 1500, seconds),
        ]),
        "avoider" => json!([slot(
            "laser",
            "requires",
            "patrol/simulator/laser",
            20,
            seconds
        )]),
        _ => json!([slot(
            "pose",
            "subscribesTo",
            "patrol/simulator/pose",
            1500,
            seconds
        )]),
    };
    let report = json!({
        "component": name, "name": name, "network": "patrol", "pid": 7, "state": "running", "uptime_s": seconds,
        "age_ms": 1, "model": "00000000000000ff", "middleware": "iceoryx2",
        "period_ms": 50.0, "overruns": 2, "last_error": null, "slots": slots,
        "compute": {"count": 20 * seconds, "errors": 1, "p50_us": 55, "p99_us": 1200, "max_us": 9000},
    });
    serde_json::from_value(report).expect("a report")
}

fn event(second: u32, component: Option<&str>, severity: &str, message: &str) -> Event {
    let event = json!({
        "time": format!("2026-11-21T13:56:{second:02}.123Z"), "component": component, "code": "state",
        "message": message, "severity": severity,
    });
    serde_json::from_value(event).expect("an event")
}

/// A network that has run for some seconds.
fn model(host: Host) -> Model {
    let mut model = Model::new(host, "patrol", false);
    model.status(status());
    for seconds in [4, 6] {
        let now = Duration::from_secs(seconds);
        for (at, name) in NAMES.iter().enumerate().take(5) {
            model.report(name, report(name, seconds), now);
            let sample = Sample {
                busy: Duration::from_millis(seconds * (at as u64 * 7 + 3)),
                memory: (at as u64 + 3) << 20,
            };
            model.sample(name, Some(sample), now);
        }
        model.tick(now);
    }
    model.event(event(1, None, "info", "network patrol is up"));
    let text = "ended: signal 11 (SIGSEGV); the last lines of /robot/log:\n    reading map\n    \u{1b}[31mno map";
    model.event(event(2, Some("monitor"), "error", text));
    model.event(event(
        3,
        Some("left.eye"),
        "warning",
        "says that it cannot do its work",
    ));
    model
}

fn screen(model: &mut Model, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
    model.size = (width, height);
    let drawn = terminal.draw(|frame| render::draw(model, frame.area(), frame.buffer_mut()));
    drawn.expect("drawn");
    let buffer = terminal.backend().buffer();
    let lines = buffer
        .content
        .chunks(usize::from(width).max(1))
        .map(|cells| {
            let line: String = cells.iter().map(ratatui::buffer::Cell::symbol).collect();
            line.trim_end().to_owned() + "\n"
        });
    lines.collect()
}

fn shows(model: &mut Model, width: u16, height: u16, expected: &Expect) {
    expected.assert_eq(&screen(model, width, height));
}

fn press(model: &mut Model, key: Key) -> Option<Command> {
    model.key(key)
}

fn control(verb: Verb, name: &str) -> Command {
    let name = name.to_owned();
    Command::Control { verb, name }
}

fn keys(model: &mut Model, keys: &str) -> Option<Command> {
    let pressed = keys.chars().map(|key| press(model, Key::Char(key)));
    pressed.collect::<Vec<_>>().pop().flatten()
}

fn parameters() -> Parameters {
    let parameter = |path: &str, value: Value, allowed: &str, mark: &str| {
        json!({
            "path": path, "value": value, "allowed": allowed, "doc": ["How fast it may be."],
            "editable": mark != "fixed", "restart": mark == "restart", "secret": mark == "secret",
            "unsaved": mark == "unsaved",
        })
    };
    let parameters = json!({"file": "config.toml", "parameters": [
        parameter("speed", json!(400.0), "float, from 0 to 1500, in mm/s", "unsaved"),
        parameter("map", json!("house.map"), "path", "fixed"),
        parameter("name", json!("left"), "string", "restart"),
        parameter("token", json!("***"), "string", "secret"),
    ]});
    serde_json::from_value(parameters).expect("parameters")
}
