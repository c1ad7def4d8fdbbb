//! The machines as charts of the interpreter.

use crate::Stepped;
use rc_diagnostics::SourceMap;
use rc_machine::{Chart, Failed, Host, Interpreter, Session};
use std::fmt::Write;
use std::time::Duration;

/// The interpreter with a component that does nothing but count.
pub(crate) struct Ours {
    interpreter: Interpreter,
    counts: Counts,
    event: u16,
}

struct Counts {
    session: Session,
    entries: u64,
    exits: u64,
}

impl Host for Counts {
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

    fn enter(&mut self, _: u16) -> Result<(), Failed> {
        self.entries += 1;
        Ok(())
    }

    fn exit(&mut self, _: u16) -> Result<(), Failed> {
        self.exits += 1;
        Ok(())
    }

    fn log(&mut self, _: &str, _: &str) {}
}

impl Ours {
    fn new(text: &str) -> Self {
        let mut sources = SourceMap::new();
        let source = sources.add("bench.scxml", text.to_owned());
        let (machine, found) = rc_smdsl::load(&sources, source);
        assert!(!found.has_errors(), "{found:?}");
        let machine = machine.expect("a machine");
        let chart = rc_smdsl::tables::of(&machine).expect("a chart that fits");
        let chart: &'static Chart = Box::leak(Box::new(chart));
        let event = chart.events.iter().position(|event| event == "next");
        let mut ours = Self {
            interpreter: Interpreter::new(chart),
            counts: Counts {
                session: Session::new(chart),
                entries: 0,
                exits: 0,
            },
            event: event.expect("the event") as u16,
        };
        ours.interpreter.start(&mut ours.counts).expect("a start");
        ours.counts.entries = 0;
        ours
    }
}

impl Stepped for Ours {
    fn step(&mut self) {
        let fired = self.counts.session.fire(self.event);
        let stepped = self.interpreter.step(&mut self.counts);
        assert!(fired.is_ok() && matches!(stepped, Ok(Some(step)) if step.taken));
    }

    fn entries(&self) -> u64 {
        assert!(self.counts.exits > 0);
        self.counts.entries
    }
}

const HEAD: &str = r#"<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="bench""#;

/// A ring of 20 states.
pub(crate) fn flat() -> Ours {
    let mut text = format!("{HEAD} initial=\"s0\">");
    for state in 0..20 {
        let next = (state + 1) % 20;
        let _ = write!(
            text,
            "<state id=\"s{state}\"><transition event=\"next\" target=\"s{next}\"/></state>"
        );
    }
    Ours::new(&(text + "</scxml>"))
}

/// Two regions, in each of which the innermost of five levels changes, or all of them.
pub(crate) fn nested(all: bool) -> Ours {
    let mut text = format!("{HEAD} initial=\"on\"><parallel id=\"on\">");
    for region in ["a", "b"] {
        let leaf = |branch: &str, to: &str| {
            format!(
                "<state id=\"{region}{branch}5\"><transition event=\"next\" target=\"{region}{to}5\"/></state>"
            )
        };
        let around = |branch: &str, inside: String| {
            (1..5).rev().fold(inside, |inside, level| {
                format!("<state id=\"{region}{branch}{level}\">{inside}</state>")
            })
        };
        let states = if all {
            around("x", leaf("x", "y")) + &around("y", leaf("y", "x"))
        } else {
            around("x", leaf("x", "y") + &leaf("y", "x"))
        };
        let _ = write!(text, "<state id=\"{region}\">{states}</state>");
    }
    Ours::new(&(text + "</parallel></scxml>"))
}
