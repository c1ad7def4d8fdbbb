//! Contents of the tables, and the bounds of the interpreter.

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

/// Shapes of files that people have written, run with random events to their end.
#[test]
fn machines_like_real_files_run_to_their_end() {
    let machines = [
        "defaultMachine { states Compute, Emergency; initial_state Initialize; end_state Finalize;
         transitions { Initialize => Compute; Compute => Compute, Emergency, Finalize;
         Emergency => Compute; }; };",
        "m { initial_state a; end_state z; states b, c, d; transition { a => b, c, d; b => b, c;
         c => d, a; d => z, a; }; };",
        "robot { initial_state idle; states working; end_state off; transitions { idle => working, off;
         working => idle; working => working; }; };
         :working { initial_state go; states grasp; end_state placed;
         transitions { go => grasp; grasp => placed, go; }; };
         :grasp { initial_state open; states shut; transitions { open => shut; shut => open, shut; }; };",
        "p { initial_state both; end_state off; transitions { both => off; }; };
         :both parallel { states left, right; };
         :left { initial_state l1; states l2; end_state l3; transitions { l1 => l2; l2 => l3, l1; }; };
         :right { initial_state r1; states r2; transitions { r1 => r2, r1; r2 => r1; }; };",
    ];
    for (number, text) in machines.into_iter().enumerate() {
        let mut run = run("m.smdsl", text);
        run.start().unwrap();
        let fireable = usize::from(run.host.session.chart().fireable);
        let mut random = number as u64 + 1;
        let mut entered = std::collections::BTreeSet::new();
        for _ in 0..10_000 {
            if run.host.session.has_ended() {
                break;
            }
            entered.extend(run.active().into_iter().map(str::to_owned));
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            // The event that ends the machine at once comes seldom.
            let event = (random >> 33) as usize % (fireable + 20);
            run.host
                .session
                .fire(event.min(fireable - 1) as u16)
                .unwrap();
            run.step().unwrap();
        }
        assert!(run.host.session.has_ended(), "{text}: {entered:?}");
    }
}

#[test]
fn a_default_of_a_history_state_runs_only_in_the_step_that_enters_its_parent() {
    let text = r#"<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="m" initial="p">
      <state id="p" initial="a">
        <history id="h"><transition target="b"><log label="default"/></transition></history>
        <state id="a"><transition event="inside" target="h"/></state>
        <state id="b"/>
        <transition event="leave" target="out"/>
      </state>
      <state id="out"><transition event="back" target="p"/></state>
    </scxml>"#;
    let mut run = run("m.scxml", text);
    let chart = run.host.session.chart();
    run.start().unwrap();
    // `p` stays active in the first step, so that the default of `h` has no entry to run with.
    for (event, active) in [("inside", "b"), ("leave", "out"), ("back", "a")] {
        let number = chart.events.iter().position(|name| name == event).unwrap();
        run.host.session.fire(number as u16).unwrap();
        run.step().unwrap();
        assert!(run.active().iter().any(|path| path.ends_with(active)));
    }
    let trace = run.host.trace.join(" ");
    assert!(!trace.contains("default"), "{trace}");
}
