//! Reads charts, and runs them with a host that writes down what happens.

use rc_diagnostics::{Format, SourceMap, render};
use rc_machine::{Chart, Failed, Host, Interpreter, Session, Step};
use rc_smdsl::StateMachine;
use std::time::Duration;

/// The model of a chart without errors.
pub(crate) fn model(name: &str, text: &str) -> StateMachine {
    let mut sources = SourceMap::new();
    let source = sources.add(name, text);
    let (machine, found) = rc_smdsl::load(&sources, source);
    let shown = render(&sources, &found, Format::Short);
    assert!(!found.has_errors(), "{shown}{text}");
    machine.expect("there is a machine")
}

/// The chart of a machine.
pub(crate) fn chart(machine: &StateMachine) -> &'static Chart {
    let chart = rc_smdsl::tables::of(machine).expect("a chart that fits");
    Box::leak(Box::new(chart))
}

/// A machine with its interpreter.
pub(crate) struct Run {
    pub(crate) host: Recorder,
    pub(crate) interpreter: Interpreter,
}

/// Writes down what a machine does.
pub(crate) struct Recorder {
    pub(crate) session: Session,
    pub(crate) trace: Vec<String>,
    pub(crate) now: Duration,
    /// Answers a guard.
    pub(crate) guard: fn(&str, usize) -> bool,
    /// The number of the present step.
    pub(crate) step: usize,
    /// Whether entry and exit are written down.
    pub(crate) states: bool,
}

impl Run {
    pub(crate) fn new(machine: &StateMachine, guard: fn(&str, usize) -> bool) -> Self {
        let chart = chart(machine);
        Self {
            host: Recorder {
                session: Session::new(chart),
                trace: Vec::new(),
                now: Duration::ZERO,
                guard,
                step: 0,
                states: false,
            },
            interpreter: Interpreter::new(chart),
        }
    }

    pub(crate) fn start(&mut self) -> Result<(), rc_machine::Error> {
        self.interpreter.start(&mut self.host)
    }

    /// Handles an event. Advances the time to the next delayed one if no other waits.
    pub(crate) fn step(&mut self) -> Result<Option<Step>, rc_machine::Error> {
        self.host.step += 1;
        if !self.host.session.has_events()
            && let Some(due) = self.interpreter.next_due()
        {
            self.host.now = self.host.now.max(due);
        }
        self.interpreter.step(&mut self.host)
    }

    pub(crate) fn active(&self) -> Vec<&str> {
        self.host.active()
    }
}

impl Recorder {
    fn chart(&self) -> &'static Chart {
        self.session.chart()
    }

    fn active(&self) -> Vec<&str> {
        let states = self.session.active();
        states.map(|s| &*self.chart().state(s).name).collect()
    }
}

impl Host for Recorder {
    fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    fn now(&mut self) -> Duration {
        self.now
    }

    fn guard(&mut self, guard: u16) -> bool {
        let name = &self.chart().guards[usize::from(guard)];
        (self.guard)(name, self.step)
    }

    fn call(&mut self, function: u16) -> Result<(), Failed> {
        match &*self.chart().functions[usize::from(function)] {
            "fail" => return Err(Failed),
            "active" => {
                let line = format!("active: {}", self.active().join(" "));
                self.trace.push(line);
            }
            name => self.trace.push(name.to_owned()),
        }
        Ok(())
    }

    fn enter(&mut self, state: u16) -> Result<(), Failed> {
        if self.states {
            let line = format!("+{}", self.chart().state(state).name);
            self.trace.push(line);
        }
        Ok(())
    }

    fn exit(&mut self, state: u16) -> Result<(), Failed> {
        if self.states {
            let line = format!("-{}", self.chart().state(state).name);
            self.trace.push(line);
        }
        Ok(())
    }

    fn log(&mut self, label: &str, text: &str) {
        self.trace.push(format!("log {label}: {text}"));
    }
}
