//! Golden screens, and what keys do.

#![allow(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::input::Key;
use super::model::{Command, Event, Host, Model, Page, Report, Sample};
use super::render;
use crate::commands::Verb;
use crate::params::Parameters;
use crate::status::{ComponentStatus, State, Status, Trouble};
use expect_test::{Expect, expect};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::style::Color;
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

fn status() -> Status {
    let components = NAMES.iter().enumerate().map(|(at, name)| ComponentStatus {
        name: (*name).to_owned(),
        state: match at {
            3 => State::Emergency,
            5 => State::Failed,
            _ => State::Running,
        },
        pid: (at != 5).then_some(100 + at as i32),
        uptime_s: (at != 5).then_some(62.0 * (at * at) as f64),
        ready: true,
        middleware: "iceoryx2".to_owned(),
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
        troubles: Vec::new(),
        exit: (at == 5).then(|| "signal 11 (SIGSEGV)".to_owned()),
    });
    Status {
        network: "patrol".to_owned(),
        pid: 99,
        guard: Some(98),
        ddsl: "patrol.ddsl".into(),
        components: components.collect(),
    }
}

/// A slot whose counters have run for so many seconds.
fn slot(name: &str, role: &str, address: &str, rate: u64, seconds: u64) -> Value {
    let count = rate * seconds;
    let received = ["implements", "subscribesTo"].contains(&role);
    json!({
        "name": name, "role": role, "interface": "Laser", "middleware": "iceoryx2", "address": address, "peers": 1,
        "handlers": {"count": if received { count } else { 0 }, "errors": 0, "p50_us": 12, "p99_us": 340, "max_us": 9000},
        "sent": if received { 0 } else { count }, "lost": 0,
    })
}

fn report(name: &str, seconds: u64) -> Report {
    let slots = match name {
        "simulator" => json!([
            slot("laser", "implements", "patrol/simulator/laser", 20, seconds),
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
        "period_ms": 50.0, "overruns": 2, "last_error": null, "slots": slots,
        "compute": {"count": 20 * seconds, "errors": 1, "p50_us": 55, "p99_us": 1200, "max_us": 9000},
    });
    serde_json::from_value(report).expect("a report")
}

fn event(second: u32, component: Option<&str>, severity: &str, message: &str) -> Event {
    Event {
        time: format!("2026-11-21T13:56:{second:02}.123Z"),
        component: component.map(str::to_owned),
        message: message.to_owned(),
        severity: severity.to_owned(),
    }
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

fn order(verb: Verb, name: &str) -> Command {
    let name = name.to_owned();
    Command::Order { verb, name }
}

fn keys(model: &mut Model, keys: &str) -> Option<Command> {
    let pressed = keys.chars().map(|key| press(model, Key::Char(key)));
    pressed.collect::<Vec<_>>().pop().flatten()
}

#[test]
fn a_wide_terminal_shows_all_columns() {
    shows(
        &mut model(Host::Up),
        120,
        30,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed                                                                        8.5% 25M
        COMPONENT                STATE         UP   CPU   MEM  IN/s OUT/s CALLS/s COMPUTE p50/p99 HANDLER p50/p99 RESTARTS  LOST
        simulator                running       0s  0.3%  3.0M     0  1.5k      20      55us/1.2ms      12us/340us        0     0
        avoider                  running    1m02s  1.0%  4.0M     0     0      20      55us/1.2ms               -        0     0
        ▾ left                   emergency      -  4.1%   11M  3.0k     0       0      55us/1.2ms      12us/340us        0     0
          ▾ arm                  1/1        4m08s  1.7%  5.0M  1.5k     0       0      55us/1.2ms      12us/340us        0     0
            gripper              running    4m08s  1.7%  5.0M  1.5k     0       0      55us/1.2ms      12us/340us        0     0
          eye                    emergency  9m18s  2.4%  6.0M  1.5k     0       0      55us/1.2ms      12us/340us        0     0
        ▾ right                  1/1       16m32s  3.1%  7.0M  1.5k     0       0      55us/1.2ms      12us/340us        1    12
          eye                    running   16m32s  3.1%  7.0M  1.5k     0       0      55us/1.2ms      12us/340us        1    12
        monitor                  failed         -     -     -     -     -       -               -               -        1     0
        ── events ──────────────────────────────────────────────────────────────────────────────────────────────────────────────
        13:56:01 network patrol is up
        13:56:02 monitor: ended: signal 11 (SIGSEGV); the last lines of /robot/log:
                     reading map
                     no map
        13:56:03 left.eye: says that it cannot do its work












        r restart  x stop  s start  e emergency  enter log  p parameters  c connections  ? help  q stop the network
    "#]],
    );
}

#[test]
fn a_usual_terminal_shows_the_most_important_ones() {
    shows(
        &mut model(Host::Top),
        80,
        24,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed                                8.5% 25M
        COMPONENT        STATE         UP   CPU   MEM  IN/s OUT/s CALLS/s RESTARTS  LOST
        simulator        running       0s  0.3%  3.0M     0  1.5k      20        0     0
        avoider          running    1m02s  1.0%  4.0M     0     0      20        0     0
        ▾ left           emergency      -  4.1%   11M  3.0k     0       0        0     0
          ▾ arm          1/1        4m08s  1.7%  5.0M  1.5k     0       0        0     0
            gripper      running    4m08s  1.7%  5.0M  1.5k     0       0        0     0
          eye            emergency  9m18s  2.4%  6.0M  1.5k     0       0        0     0
        ▾ right          1/1       16m32s  3.1%  7.0M  1.5k     0       0        1    12
          eye            running   16m32s  3.1%  7.0M  1.5k     0       0        1    12
        monitor          failed         -     -     -     -     -       -        1     0
        ── events ──────────────────────────────────────────────────────────────────────
        13:56:01 network patrol is up
        13:56:02 monitor: ended: signal 11 (SIGSEGV); the last lines of /robot/log:
                     reading map
                     no map
        13:56:03 left.eye: says that it cannot do its work






        r restart  x stop  s start  e emergency  enter log  ? help  q leave
    "#]],
    );
}

#[test]
fn a_small_terminal_shows_names_and_states() {
    shows(
        &mut model(Host::Up),
        40,
        10,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed
        COMPONENT          STATE       CPU   MEM
        simulator          running    0.3%  3.0M
        avoider            running    1.0%  4.0M
        ▾ left             emergency  4.1%   11M
          ▾ arm            1/1        1.7%  5.0M
            gripper        running    1.7%  5.0M
        ── events ──────────────────────────────
        13:56:03 left.eye: says that it cannot d
        r restart  ? help  q stop the network
    "#]],
    );
}

#[test]
fn no_size_is_too_small() {
    for page in [
        Page::Table,
        Page::Log,
        Page::Parameters,
        Page::Connections,
        Page::Help,
    ] {
        for (width, height) in [(1, 1), (2, 2), (5, 3), (300, 1), (1, 60), (13, 7)] {
            let mut model = model(Host::Up);
            model.page = page;
            keys(&mut model, "r");
            let shown = screen(&mut model, width, height);
            assert_eq!(shown.lines().count(), usize::from(height));
        }
    }
}

#[test]
fn without_colours_there_are_none() {
    let colours = |wanted| {
        let mut model = model(Host::Up);
        model.colours = wanted;
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("a terminal");
        let drawn = terminal.draw(|frame| render::draw(&model, frame.area(), frame.buffer_mut()));
        drawn.expect("drawn");
        let cells = &terminal.backend().buffer().content;
        cells
            .iter()
            .filter(|cell| cell.fg != Color::Reset || cell.bg != Color::Reset)
            .count()
    };
    assert_eq!(colours(false), 0);
    assert!(colours(true) > 0);
}

#[test]
fn groups_are_folded_and_hold_what_is_in_them() {
    let mut model = model(Host::Top);
    for _ in 0..2 {
        press(&mut model, Key::Down);
    }
    assert_eq!(model.selected, "left");
    press(&mut model, Key::Enter);
    shows(
        &mut model,
        60,
        12,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed            8.5% 25M
        COMPONENT         STATE       CPU   MEM  IN/s RESTARTS  LOST
        simulator         running    0.3%  3.0M     0        0     0
        avoider           running    1.0%  4.0M     0        0     0
        ▸ left            emergency  4.1%   11M  3.0k        0     0
        ▾ right           1/1        3.1%  7.0M  1.5k        1    12
          eye             running    3.1%  7.0M  1.5k        1    12
        monitor           failed        -     -     -        1     0
        ── events ──────────────────────────────────────────────────
                     no map
        13:56:03 left.eye: says that it cannot do its work
        r restart  x stop  s start  e emergency  ? help  q leave
    "#]],
    );
    // A group is ordered about as a whole.
    assert_eq!(keys(&mut model, "r"), None);
    assert_eq!(keys(&mut model, "y"), Some(order(Verb::Restart, "left")));
    press(&mut model, Key::Right);
    press(&mut model, Key::Down);
    assert_eq!(model.selected, "left.arm");
    press(&mut model, Key::Left);
    press(&mut model, Key::Left);
    assert_eq!(model.selected, "left");
    // A group has no log.
    keys(&mut model, "l");
    assert_eq!(model.page, Page::Table);
}

#[test]
fn what_hurts_is_asked_and_what_is_urgent_is_not() {
    let mut model = model(Host::Up);
    assert_eq!(keys(&mut model, "x"), None);
    let asked = screen(&mut model, 40, 10);
    assert!(asked.ends_with("y/n stop simulator?\n"), "{asked}");
    assert_eq!(keys(&mut model, "n"), None);
    assert_eq!(model.prompt, None);
    let names = |names: &[&str]| names.iter().map(|&n| n.to_owned()).collect::<Vec<String>>();
    assert_eq!(keys(&mut model, "xy"), Some(order(Verb::Stop, "simulator")));
    assert_eq!(keys(&mut model, "s"), Some(order(Verb::Start, "simulator")));
    let enter = Command::Emergency {
        names: names(&["simulator"]),
        active: true,
    };
    assert_eq!(keys(&mut model, "e"), Some(enter));
    let all = Command::Emergency {
        names: names(&NAMES[..5]),
        active: true,
    };
    assert_eq!(keys(&mut model, "E"), Some(all));
    model.selected = "left.eye".to_owned();
    let leave = Command::Emergency {
        names: names(&["left.eye"]),
        active: false,
    };
    assert_eq!(keys(&mut model, "e"), None);
    assert_eq!(keys(&mut model, "y"), Some(leave));
    model.selected = "monitor".to_owned();
    assert_eq!(keys(&mut model, "e"), None);
    assert_eq!(model.notice.as_ref().map(|n| n.failed), Some(true));
    // The way out is always open.
    keys(&mut model, "r");
    let control_c = Key::Control('c');
    assert_eq!(
        model.key(control_c),
        Some(Command::Quit { interrupt: true })
    );
    assert_eq!(
        keys(&mut model, "q"),
        Some(Command::Quit { interrupt: false })
    );
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

#[test]
fn parameters_are_shown_and_edited() {
    let mut model = model(Host::Up);
    keys(&mut model, "p");
    model.parameters("avoider", Err("of another component".to_owned()));
    assert_eq!(model.parameters, None);
    model.parameters("simulator", Ok(parameters()));
    shows(
        &mut model,
        80,
        12,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed                                8.5% 25M
        simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
        iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2ms  overruns 2  error
         log   parameters   connections
        speed  400.0*       float, from 0 to 1500, in mm/s
        map    "house.map"  path
        name   "left"       string
        token  ***          string


        changes at once, is not saved. How fast it may be.
        enter change  w save  tab connections  r restart  esc back  q stop the network
    "#]],
    );
    press(&mut model, Key::Enter);
    press(&mut model, Key::Backspace);
    press(&mut model, Key::Backspace);
    keys(&mut model, "5");
    let shown = screen(&mut model, 80, 12);
    assert!(shown.ends_with("speed = 4005\n"), "{shown}");
    let set = |path: &str, value: Value| {
        let (name, path) = ("simulator".to_owned(), path.to_owned());
        Some(Command::Set { name, path, value })
    };
    assert_eq!(press(&mut model, Key::Enter), set("speed", json!(4005)));
    keys(&mut model, "j");
    assert_eq!(press(&mut model, Key::Enter), None);
    assert_eq!(model.prompt, None, "it is fixed");
    keys(&mut model, "j");
    press(&mut model, Key::Enter);
    keys(&mut model, "12");
    // A text stays one.
    assert_eq!(press(&mut model, Key::Enter), set("name", json!("left12")));
    keys(&mut model, "j");
    press(&mut model, Key::Enter);
    keys(&mut model, "qx");
    let shown = screen(&mut model, 80, 12);
    assert!(shown.ends_with("token = **\n"), "{shown}");
    assert_eq!(press(&mut model, Key::Esc), None);
    assert_eq!(
        keys(&mut model, "w"),
        Some(Command::Save {
            name: "simulator".to_owned()
        })
    );
}

#[test]
fn connections_say_who_is_at_the_other_end() {
    let mut model = model(Host::Up);
    keys(&mut model, "c");
    shows(
        &mut model,
        80,
        12,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed                                8.5% 25M
            simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
            iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2ms  overruns 2  error
             log   parameters   connections
            laser  implements  1 peer  20/s  12us/340us  0 errors
              ← avoider.laser  over iceoryx2, Laser
            pose  publishes  1 peer  1.5k/s
              → left.arm.gripper.pose, left.eye.pose, right.eye.pose  over iceoryx2, Laser



            tab log  r restart  x stop  s start  e emergency  esc back  q stop the network
        "#]],
    );
}

#[test]
fn a_log_follows_until_it_is_scrolled() {
    let mut model = model(Host::Top);
    press(&mut model, Key::Enter);
    model.log_lines((1..=50).map(|i| format!("line {i}")).collect());
    shows(
        &mut model,
        60,
        9,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed            8.5% 25M
        simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
        iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2m
         log   parameters   connections
        line 47
        line 48
        line 49
        line 50
        tab parameters  r restart  x stop  esc back  q leave
    "#]],
    );
    press(&mut model, Key::PageUp);
    model.log_lines(vec!["line 51".to_owned()]);
    shows(
        &mut model,
        60,
        9,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed            8.5% 25M
        simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
        iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2m
         log   parameters   connections  5 lines up
        line 43
        line 44
        line 45
        line 46
        tab parameters  r restart  x stop  esc back  q leave
    "#]],
    );
    press(&mut model, Key::Home);
    assert!(screen(&mut model, 60, 9).contains("\nline 1\nline 2\n"));
    press(&mut model, Key::End);
    assert!(screen(&mut model, 60, 9).contains("\nline 51\n"));
}

#[test]
fn what_is_wrong_with_a_component_is_marked_and_told() {
    let mut model = model(Host::Top);
    let mut status = status();
    status.components[1].troubles.push(Trouble {
        code: "overrun".to_owned(),
        message: "needs longer than its period".to_owned(),
        since: "2026-11-21T13:56:02.000Z".to_owned(),
    });
    model.status(status);
    assert!(screen(&mut model, 40, 10).contains("avoider            running !"));
    keys(&mut model, "jc");
    let page = screen(&mut model, 60, 10);
    assert!(
        page.contains("\noverrun: needs longer than its period\n"),
        "{page}"
    );
}

#[test]
fn the_help_fits_a_usual_terminal() {
    let mut model = model(Host::Top);
    keys(&mut model, "?");
    shows(
        &mut model,
        80,
        24,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed                                8.5% 25M
        up down       another component
        enter         its log; folds and unfolds a group
        l p c         its log, parameters, connections
        tab           the next of these pages
        esc           back to all components
        left right    folds, unfolds
        page up/down  scrolls events, log, lists
        home end      the first, the last
        r             restarts the component or the group
        x             stops it
        s             starts it
        e             emergency, at once; again to leave it
        E             emergency of all components, at once
        enter, w      parameters: changes one, saves all
        ctrl-l        draws the screen anew
        q, ctrl-c     leaves; the network goes on






        esc back  q leave
    "#]],
    );
    press(&mut model, Key::Esc);
    assert_eq!(model.page, Page::Table);
}

#[test]
fn a_restarted_component_begins_anew() {
    let mut model = model(Host::Up);
    assert!(model.components[0].report.is_some());
    let mut status = status();
    status.components[0].pid = Some(4711);
    model.status(status.clone());
    assert!(model.components[0].report.is_none() && model.components[0].rates.is_empty());
    assert!(model.components[1].report.is_some());
    // Long without an answer.
    model.tick(Duration::from_secs(60));
    assert!(screen(&mut model, 80, 24).contains("avoider          silent"));
    // What is gone is not selected any more.
    model.selected = "monitor".to_owned();
    status.components.pop();
    model.status(status);
    assert_eq!(model.selected, "simulator");
}
