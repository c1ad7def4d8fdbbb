//! What the tables say, and the bounds of the interpreter.

use crate::loading::{Run, model};
use rc_machine::{Error, MAX_EVENTS, Refused};

fn run(name: &str, text: &str) -> Run {
    Run::new(&model(name, text), |_, _| true)
}

#[test]
fn a_machine_of_smdsl_runs_by_events_named_after_their_states() {
    let text = "rover { initial_state idle; states low_power; end_state off;
        transitions { idle => low_power, idle; low_power => off; }; };
        :low_power parallel { states wheels, arm; };";
    let mut run = run("rover.smdsl", text);
    let chart = run.host.session.chart();
    assert_eq!(
        chart.events.to_vec(),
        ["IdleToLowPower", "IdleToIdle", "LowPowerToOff"]
    );
    assert_eq!(chart.fireable, 3);
    let paths: Vec<&str> = chart.states.iter().map(|s| &*s.path).collect();
    assert_eq!(
        paths,
        [
            "",
            "idle",
            "low_power",
            "low_power.wheels",
            "low_power.arm",
            "off"
        ]
    );
    run.host.states = true;
    run.start().unwrap();
    for event in [1, 0, 1, 2] {
        run.host.session.fire(event).unwrap();
        run.step().unwrap();
    }
    let expected =
        "+idle -idle +idle -idle +low_power +wheels +arm -arm -wheels -low_power +off -off";
    assert_eq!(run.host.trace.join(" "), expected);
    assert!(run.host.session.has_ended() && run.active().is_empty());
    assert_eq!(run.host.session.fire(0), Err(Refused::Ended));
    assert_eq!(run.step().unwrap(), None);
}

#[test]
fn events_of_the_interpreter_are_numbered_only_where_they_matter() {
    let text = "<scxml><state id='a'><transition event='go error' target='b'/>
        <state id='a1'/></state><state id='b'><transition event='done.state.b' target='a'/>
        <state id='b1'><transition event='go.*'><raise event='went'/></transition></state></state></scxml>";
    let run = run("m.scxml", text);
    let chart = run.host.session.chart();
    let names = [
        "go",
        "went",
        "error",
        "done.state.b",
        "error.execution",
        "error.communication",
    ];
    assert_eq!(chart.events.to_vec(), names);
    assert_eq!((chart.fireable, chart.execution_error), (2, 4));
    let done: Vec<bool> = chart
        .states
        .iter()
        .map(|s| s.done != rc_machine::NONE)
        .collect();
    assert_eq!(done, [false, false, false, true, false]);
}

#[test]
fn a_loop_without_events_is_an_error() {
    let mut looping = run(
        "m.scxml",
        "<scxml><state id='a'><transition target='b'/></state>
        <state id='b'><transition target='a'/></state></scxml>",
    );
    assert_eq!(looping.start(), Err(Error::Endless));
    let mut looping = run(
        "m.scxml",
        "<scxml><state id='a'><onentry><raise event='e'/></onentry>
        <transition event='e' target='a'/></state></scxml>",
    );
    assert_eq!(looping.start(), Err(Error::Endless));
    let raises = "<raise event='e'/>".repeat(100);
    let text = format!(
        "<scxml><state id='a'><onentry><raise event='e'/></onentry>
        <transition event='e'>{raises}</transition></state></scxml>"
    );
    assert_eq!(run("m.scxml", &text).start(), Err(Error::TooManyRaised));
}

#[test]
fn the_queue_of_events_has_a_bound() {
    let mut run = run(
        "m.scxml",
        "<scxml><state id='a'><transition event='e'/></state></scxml>",
    );
    run.start().unwrap();
    for _ in 0..MAX_EVENTS {
        run.host.session.fire(0).unwrap();
    }
    assert_eq!(run.host.session.fire(0), Err(Refused::Full));
    run.step().unwrap();
    assert_eq!(run.host.session.fire(0), Ok(()));
}

#[test]
fn a_guard_that_holds_by_now_is_seen_at_rest() {
    let text = "<scxml><state id='a'><transition cond='ready' target='b'/></state>
        <final id='b'/></scxml>";
    let mut run = Run::new(&model("m.scxml", text), |_, step| step > 0);
    run.start().unwrap();
    assert_eq!(run.active(), ["a"]);
    run.host.step = 1;
    run.interpreter.rest(&mut run.host).unwrap();
    assert!(run.host.session.has_ended());
}

#[test]
fn stopping_leaves_all_states_the_innermost_first() {
    let text = "<scxml><parallel id='p'><state id='a'><state id='a1'/></state><state id='b'/></parallel></scxml>";
    let mut run = run("m.scxml", text);
    run.host.states = true;
    run.start().unwrap();
    run.interpreter.stop(&mut run.host);
    run.interpreter.stop(&mut run.host);
    assert_eq!(run.host.trace.join(" "), "+p +a +a1 +b -b -a1 -a -p");
}
