//! Machines as users write them, in all shapes: random events lead them to their ends. With
//! `RC_REAL_FILES`, a folder, also the files of users in it.

use crate::loading::{chart, model};
use rc_diagnostics::SourceMap;
use rc_machine::{Chart, Failed, Host, Interpreter, Kind, Session};
use rc_smdsl::StateMachine;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A comment in each says what is in it. They are also generated and compiled, in `codegen`.
const SHAPES: [&str; 7] = [
    include_str!("../shapes/line.smdsl"),
    include_str!("../shapes/explorer.smdsl"),
    include_str!("../shapes/fetch.smdsl"),
    include_str!("../shapes/robot.smdsl"),
    include_str!("../shapes/meeting.smdsl"),
    include_str!("../shapes/wait.smdsl"),
    include_str!("../shapes/letters.smdsl"),
];

struct Counting {
    session: Session,
    depth: Vec<bool>,
    entries: u64,
}

impl Host for Counting {
    fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    fn now(&mut self) -> Duration {
        Duration::ZERO
    }

    fn guard(&mut self, _: u16) -> bool {
        true
    }

    fn call(&mut self, _: u16) -> Result<(), Failed> {
        Ok(())
    }

    fn enter(&mut self, state: u16) -> Result<(), Failed> {
        let entered = &mut self.depth[usize::from(state)];
        assert!(!*entered, "state {state} is entered twice");
        *entered = true;
        self.entries += 1;
        Ok(())
    }

    fn exit(&mut self, state: u16) -> Result<(), Failed> {
        let entered = &mut self.depth[usize::from(state)];
        assert!(*entered, "state {state} is left twice");
        *entered = false;
        Ok(())
    }

    fn log(&mut self, _: &str, _: &str) {}
}

/// Fires random events. Returns whether the machine has ended, and what it has entered.
fn run(chart: &'static Chart, seed: u64) -> (bool, u64) {
    let mut interpreter = Interpreter::new(chart);
    let mut host = Counting {
        session: Session::new(chart),
        depth: vec![false; chart.states.len()],
        entries: 0,
    };
    interpreter.start(&mut host).expect("a start");
    let mut random = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    for _ in 0..200_000 {
        if host.session.has_ended() {
            break;
        }
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let event = (random >> 33) as u16 % chart.fireable.max(1);
        if chart.fireable == 0 {
            break;
        }
        host.session.fire(event).expect("room");
        interpreter.step(&mut host).expect("a step");
    }
    let ended = host.session.has_ended();
    interpreter.stop(&mut host);
    assert!(!host.depth.contains(&true), "all states are left");
    (ended, host.entries)
}

#[test]
fn random_events_lead_every_shape_to_its_end() {
    for text in SHAPES {
        let chart = chart(&model("shape.smdsl", text));
        for seed in 1..=10 {
            let (ended, entries) = run(chart, seed);
            assert!(ended && entries > 1, "seed {seed}: {text}");
        }
    }
}

fn files(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, into);
        } else if path
            .extension()
            .is_some_and(|extension| extension == "smdsl")
        {
            into.push(path);
        }
    }
}

/// A machine whose top region has an end state that transitions reach.
fn has_end(machine: &StateMachine, chart: &Chart) -> bool {
    let is_unreachable = |name: &str| machine.unreachable().any(|s| s.name.text == name);
    let tops = chart.children(0).map(|state| chart.state(state));
    let mut ends = tops.filter(|state| state.kind == Kind::Final);
    ends.any(|state| !is_unreachable(&state.name))
}

#[test]
fn files_of_users_run_to_their_ends() {
    let Some(folder) = std::env::var_os("RC_REAL_FILES") else {
        return;
    };
    let mut found = Vec::new();
    files(Path::new(&folder), &mut found);
    assert!(!found.is_empty(), "no .smdsl in {}", folder.display());
    for path in found {
        let text = std::fs::read_to_string(&path).expect("a text");
        let mut sources = SourceMap::new();
        let source = sources.add(&path, text);
        let (machine, findings) = rc_smdsl::load(&sources, source);
        let name = path.display();
        let human = rc_diagnostics::render(&sources, &findings, rc_diagnostics::Format::Short);
        assert!(!findings.has_errors(), "{human}");
        let machine = machine.expect("a machine");
        let chart = chart(&machine);
        for seed in 1..=10 {
            let (ended, entries) = run(chart, seed);
            assert!(entries > 0, "{name}");
            assert!(ended || !has_end(&machine, chart), "{name}, seed {seed}");
        }
    }
}
