//! A component with a state machine whose guard panics.

use crate::charts::{Number, chart};
use rc_runtime::machine::{self, Condition, Hooks, Machine, Parts};
use rc_runtime::{Component, Core, Ports, StartError, Values, WorkerError};

pub(crate) struct Guarded {
    core: Core,
    machine: Machine<Number, Number>,
}

pub(crate) fn start(core: Core, _: &Ports, _: &Values) -> Result<Guarded, StartError> {
    let mut guarded = Guarded {
        core,
        machine: Machine::new(chart(Condition::Guard(0), Vec::new()), &[]),
    };
    machine::start(&mut guarded)?;
    Ok(guarded)
}

impl Hooks for Guarded {
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

    fn entry(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }

    fn exit(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }

    fn during(&mut self, _: u16) -> Result<(), WorkerError> {
        Ok(())
    }
}

impl Component for Guarded {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.machine.fire(Number(0));
        machine::rest(self)
    }
}
