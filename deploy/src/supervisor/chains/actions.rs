//! What is done about a chain that is late.

use super::{News, NewsSender};
use crate::supervisor::control::ClientRequest;
use crate::supervisor::supervise::Supervisor;
use rc_deploy_network::planned_chain::LateAction;
use rc_deploy_network::process_name;
use rc_management::component;
use rc_management::event::{Event, Severity};
use rc_management::supervisor::{Request, Verb};
use rc_management::{CallError, Client};
use std::path::Path;
use std::time::Duration;

/// How long a component may take to do what it is asked.
const LIMIT: Duration = Duration::from_secs(5);

impl Supervisor<'_> {
    /// Reports a condition of a chain, and acts if it is the first one.
    pub(super) fn chain_begins(&mut self, chain: usize, code: &'static str, text: &str) {
        let plan = self.plan;
        let chain = &plan.chains[chain];
        let codes = super::CONDITIONS;
        let is_first = !codes
            .iter()
            .any(|code| self.troubles.holds(code, &chain.name));
        let severity = match chain.late {
            LateAction::Event => Severity::Info,
            _ => Severity::Warning,
        };
        self.trouble_of(&chain.name, severity, code, text);
        if !is_first {
            return;
        }
        match &chain.late {
            LateAction::Warn | LateAction::Event => {}
            LateAction::Stop(name) => self.stop_late(name),
            LateAction::Emergency(name) => {
                let request = component::Request::Emergency { active: true };
                self.ask_late(name, request, "its emergency");
            }
            LateAction::Fire { component, event } => {
                let what = format!("the event `{event}`");
                let event = event.clone();
                self.ask_late(component, component::Request::Fire { event }, &what);
            }
        }
    }

    /// Stops a component, with all of its process.
    fn stop_late(&mut self, name: &str) {
        let Some(i) = self.units.iter().position(|unit| unit.name() == name) else {
            return;
        };
        let mates = self.order.mates(i).iter();
        let names: Vec<String> = mates.map(|&i| self.units[i].name().to_owned()).collect();
        let request = ClientRequest::own(Request::Stop {
            names: names.clone(),
        });
        self.take_command(request, Verb::Stop, &names);
    }

    /// Asks a component, without waiting for its answer.
    fn ask_late(&mut self, name: &str, request: component::Request, what: &str) {
        let Some(watch) = &self.chains else { return };
        let socket = self.network_guard.directory().socket(&process_name(name));
        let reporter = watch.reporter.clone();
        let (name, what) = (name.to_owned(), what.to_owned());
        let thread = std::thread::Builder::new().name("late".to_owned());
        let started = {
            let (reporter, name, what) = (reporter.clone(), name.clone(), what.clone());
            thread.spawn(move || tell(&reporter, &name, &what, ask(&socket, &request)))
        };
        if let Err(error) = started {
            tell(&reporter, &name, &what, Err(error.into()));
        }
    }
}

fn ask(socket: &Path, request: &component::Request) -> Result<(), CallError> {
    let mut client = Client::connect(socket, LIMIT)?;
    let _: serde_json::Value = client.call(request, LIMIT)?;
    Ok(())
}

/// Reports what a component has done.
fn tell(reporter: &NewsSender, name: &str, what: &str, result: Result<(), CallError>) {
    let event = match result {
        Ok(()) => {
            let text = format!("has taken {what}, because a chain is late");
            Event::component(name, Severity::Info, "late-action", text)
        }
        Err(error) => {
            let text = format!("cannot take {what}, though a chain is late: {error}");
            Event::component(name, Severity::Error, "late-action", text)
        }
    };
    reporter.send(News::Done(event));
}
