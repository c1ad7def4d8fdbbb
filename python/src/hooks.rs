//! The functions of a worker that its state machine calls.

use crate::component::PythonComponent;
use crate::errors;
use pyo3::prelude::*;
use rc_runtime::machine::{Hooks, Parts};
use rc_runtime::{Core, WorkerError};

impl Hooks for PythonComponent {
    fn parts(&mut self) -> &mut Parts {
        self.machine
            .as_mut()
            .expect(
                "a step runs only where there is a machine, which is here between two functions",
            )
            .parts()
    }

    fn core(&mut self) -> &mut Core {
        self.core
            .as_mut()
            .expect("the core is away only while a function of the worker runs")
    }

    fn guard(&mut self, guard: u16) -> bool {
        let Some(name) = self.machine_name(|machine| &machine.guards, guard) else {
            return false;
        };
        let result = self.run(|py, component| {
            let called = component
                .worker
                .call(py, name, (component.context.bind(py),));
            let called = called.and_then(|result| result.bind(py).is_truthy());
            called.map_err(|error| errors::of_worker(py, &error))
        });
        result.unwrap_or_else(|error| {
            rc_runtime::tracing::error!("the guard {name}() counts as false: {error}");
            if let WorkerError::Fatal(reason) = error {
                Hooks::core(self).fail(&reason);
            }
            false
        })
    }

    fn action(&mut self, action: u16) -> Result<(), WorkerError> {
        match self.machine_name(|machine| &machine.actions, action) {
            Some(name) => self.call(name),
            None => Ok(()),
        }
    }

    fn entry(&mut self, state: u16) -> Result<(), WorkerError> {
        self.state_hook("entry", state)
    }

    fn exit(&mut self, state: u16) -> Result<(), WorkerError> {
        self.state_hook("exit", state)
    }

    fn during(&mut self, state: u16) -> Result<(), WorkerError> {
        let name = self.state_name("during", state);
        let Some(name) = name.filter(|name| self.worker.has(name)) else {
            if let Some(machine) = &mut self.machine {
                machine.no_during();
            }
            return Ok(());
        };
        self.call(&name)
    }
}

impl PythonComponent {
    fn machine_name(
        &self,
        names: impl FnOnce(&'static rc_host::Machine) -> &'static Vec<String>,
        number: u16,
    ) -> Option<&'static str> {
        let names = names(self.program.machine?);
        names.get(usize::from(number)).map(String::as_str)
    }

    fn state_name(&self, prefix: &str, state: u16) -> Option<String> {
        let suffix = self.machine_name(|machine| &machine.states, state)?;
        (!suffix.is_empty()).then(|| format!("{prefix}_{suffix}"))
    }

    fn state_hook(&mut self, prefix: &str, state: u16) -> Result<(), WorkerError> {
        match self.state_name(prefix, state) {
            Some(name) => self.call(&name),
            None => Ok(()),
        }
    }
}
