//! The steps of a machine in a component: its status and its log.

use super::*;
use crate::clock::SystemClock;
use crate::commands::CommandQueue;
use crate::firing::FireServer;
use crate::parameter_server::Requester;
use crate::status::{NetworkTime, Shared};
use crate::waker::waker;
use rc_management::component::ClockKind;
use rc_middleware::WakeEvent;
use std::borrow::Cow;
use std::sync::Arc;

const fn range(start: u16, end: u16) -> Range {
    Range { start, end }
}

const fn state(name: &'static str, kind: Kind, parent: u16, end: u16) -> State {
    State {
        name: Cow::Borrowed(name),
        path: Cow::Borrowed(name),
        kind,
        parent,
        end,
        initial: NONE,
        transitions: range(0, 0),
        histories: range(0, 0),
        history: NONE,
        entry: range(0, 0),
        exit: range(0, 0),
        done: NONE,
    }
}

const fn transition(source: u16, targets: Range, trigger: Trigger, domain: u16) -> Transition {
    Transition {
        source,
        targets,
        trigger,
        condition: Condition::Always,
        domain,
        through_history: false,
        internal: false,
        actions: range(0, 0),
    }
}

/// `a => b` by `go`.
fn chart() -> &'static Chart {
    let root = State {
        initial: 1,
        ..state("m", Kind::Compound, NONE, 3)
    };
    let a = State {
        transitions: range(0, 1),
        ..state("a", Kind::Atomic, 0, 2)
    };
    let b = state("b", Kind::Atomic, 0, 3);
    Box::leak(Box::new(Chart {
        name: Cow::Borrowed("m"),
        states: vec![root, a, b].into(),
        transitions: vec![
            transition(1, range(0, 1), Trigger::Events(range(1, 2)), 0),
            transition(0, range(2, 3), Trigger::Eventless, NONE),
        ]
        .into(),
        events: vec![Cow::Borrowed("go")].into(),
        fireable: 1,
        lists: vec![2, 0, 1].into(),
        blocks: Cow::Borrowed(&[]),
        actions: Cow::Borrowed(&[]),
        texts: Cow::Borrowed(&[]),
        guards: Cow::Borrowed(&[]),
        functions: Cow::Borrowed(&[]),
        execution_error: NONE,
        communication_error: NONE,
        histories: 0,
    }))
}

#[derive(Clone, Copy)]
struct Number(u16);

impl Numbered for Number {
    fn number(self) -> u16 {
        self.0
    }
}

struct Worker {
    core: Core,
    machine: Machine<Number, Number>,
    /// The event that the entry of `b` fires.
    on_entry: Option<Number>,
}

impl Hooks for Worker {
    fn parts(&mut self) -> &mut Parts {
        self.machine.parts()
    }

    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn guard(&mut self, _: u16) -> bool {
        panic!("not at all");
    }

    fn action(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }

    fn entry(&mut self, state: u16) -> Result<(), WorkerError> {
        if let Some(event) = self.on_entry.filter(|_| state == 2) {
            self.machine.fire(event);
        }
        Ok(())
    }

    fn exit(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }

    fn during(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }
}

fn worker(chart: &'static Chart) -> Worker {
    let time = NetworkTime::new(ClockKind::System, Arc::new(SystemClock));
    let wake = WakeEvent::new().expect("an event");
    let shared = Arc::new(Shared::new(wake, Duration::from_millis(1), 0, time, false));
    Worker {
        core: Core::new("m", "n", shared, 0),
        machine: Machine::new(chart, &[0]),
        on_entry: None,
    }
}

/// Log lines of `run`.
fn logged(run: impl FnOnce()) -> String {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let writer = Arc::new(file.reopen().expect("to open it"));
    let subscriber = tracing_subscriber::fmt()
        .with_ansi(false)
        .with_writer(writer)
        .finish();
    tracing::subscriber::with_default(subscriber, run);
    std::fs::read_to_string(file.path()).expect("to read")
}

#[test]
fn a_panic_is_logged_with_the_function_and_the_active_states() {
    let mut chart = chart().clone();
    chart.transitions.to_mut()[0].condition = Condition::Guard(0);
    chart.guards = vec![Cow::Borrowed("is_ready")].into();
    let mut worker = worker(Box::leak(Box::new(chart)));
    let log = logged(|| {
        start(&mut worker).expect("to rest");
        worker.machine.fire(Number(0));
        let result = catch_unwind(AssertUnwindSafe(|| react(&mut worker)));
        assert!(result.is_err());
    });
    let wanted = "panic in the guard `is_ready`; the active states are: a";
    assert!(log.contains(wanted), "{log}");
}

#[test]
fn warnings_of_dropped_events_are_limited() {
    let mut worker = worker(chart());
    let log = logged(|| {
        start(&mut worker).expect("to rest");
        for _ in 0..rc_machine::MAX_EVENTS + 9 {
            worker.machine.fire(Number(0));
        }
    });
    let warnings = log.matches("the event go is dropped: too many events wait");
    // A slow machine may have a second between two of the nine.
    assert!((1..9).contains(&warnings.count()), "{log}");
}

#[test]
fn the_status_lists_states_and_transitions() {
    let mut worker = worker(chart());
    let shared = Arc::clone(&worker.core.shared);
    let status = || {
        let status = shared.status();
        status.machine.as_ref().map(MachineRecord::status)
    };
    assert_eq!(status(), None);
    start(&mut worker).expect("to rest");
    let first = status().expect("a machine");
    assert_eq!(
        (first.states, first.transitions),
        (vec!["a".to_owned()], vec![])
    );
    worker.machine.fire(Number(0));
    react(&mut worker).expect("to rest");
    assert!(worker.machine.is_in(Number(2)));
    let second = status().expect("a machine");
    assert_eq!(second.states, ["b"]);
    let [taken] = second.transitions.as_slice() else {
        panic!("{:?}", second.transitions);
    };
    assert_eq!((&*taken.from, &*taken.to[0]), ("a", "b"));
    assert_eq!(taken.event.as_deref(), Some("go"));
}

/// `a => b` and back by `go`; nothing takes `x`.
fn back_and_forth() -> &'static Chart {
    let mut chart = chart().clone();
    chart.states.to_mut()[0].initial = 2;
    chart.states.to_mut()[2].transitions = range(1, 2);
    chart.transitions = vec![
        transition(1, range(0, 1), Trigger::Events(range(2, 3)), 0),
        transition(2, range(1, 2), Trigger::Events(range(2, 3)), 0),
        transition(0, range(1, 2), Trigger::Eventless, NONE),
    ]
    .into();
    chart.events = vec![Cow::Borrowed("go"), Cow::Borrowed("x")].into();
    chart.fireable = 2;
    chart.lists = vec![2, 1, 0].into();
    Box::leak(Box::new(chart))
}

#[test]
fn each_event_of_a_tool_gets_its_own_result() {
    let mut worker = worker(back_and_forth());
    start(&mut worker).expect("to rest");
    worker.on_entry = Some(Number(1));
    let (management, _wakeups) = waker().expect("a pair");
    let fired = [0, 0].map(|event| Arc::new(FiredEvent::new(event, management.clone())));
    for one in &fired {
        worker.machine.parts().fire_from_outside(Arc::clone(one));
    }
    while worker.machine.parts().has_events() {
        react(&mut worker).expect("to rest");
    }
    let results = fired.map(|one| one.conclude(|_| "nothing".to_owned()));
    let states = |name: &str| Ok(vec![name.to_owned()]);
    assert_eq!(results, [states("b"), states("a")]);
}

#[test]
fn a_component_that_is_not_active_refuses_events_of_tools() {
    let mut worker = worker(chart());
    let (management, _wakeups) = waker().expect("a pair");
    let fired = Arc::new(FiredEvent::new(0, management));
    worker.machine.parts().fire_from_outside(Arc::clone(&fired));
    worker.machine.parts().refuse_outside("it is inactive");
    let refused = fired.conclude(|_| "nothing".to_owned());
    assert_eq!(refused.expect_err("refused").message, "it is inactive");
    assert!(!worker.machine.parts().has_events());
}

#[test]
fn events_of_tools_that_wait_have_a_bound() {
    let mut worker = worker(chart());
    start(&mut worker).expect("to rest");
    let (management, _wakeups) = waker().expect("a pair");
    let wake = WakeEvent::new().expect("an event");
    let mut server = FireServer::new(Arc::new(CommandQueue::new(wake)), management);
    let shared = Arc::clone(&worker.core.shared);
    let mut fire = |number| {
        let requester = Requester::Client { number, id: None };
        server.fire(requester, "go", &shared)
    };
    for client in 0..64 {
        assert_eq!(fire(client), Ok(()));
    }
    let refused = fire(64).expect_err("refused");
    assert_eq!(refused.message, "64 other events wait; fire it again later");
    let ended = server.end();
    assert_eq!(ended.len(), 64);
    let (_, last) = ended.last().expect("a result");
    let message = last.as_ref().map_err(|error| error.message.as_str());
    assert_eq!(message, Err("the component ends; the event is withdrawn"));
}

#[test]
fn a_machine_without_an_active_state_says_why() {
    let mut worker = worker(chart());
    let unavailable = |worker: &mut Worker| worker.machine.parts().unavailable(&[2]);
    assert_eq!(unavailable(&mut worker).as_deref(), Some("not started"));
    start(&mut worker).expect("to rest");
    assert_eq!(unavailable(&mut worker).as_deref(), Some("a"));
    stop(&mut worker);
    assert_eq!(unavailable(&mut worker).as_deref(), Some("ended"));
}
