//! Actions against a late chain.

use super::join::Change;
use super::{CONDITIONS, ChainWatch, News, NewsSender};
use crate::log::reporter::Reporter;
use crate::supervisor::network_troubles::NetworkTroubles;
use rc_deploy_network::plan::Plan;
use rc_deploy_network::planned_chain::LateAction;
use rc_deploy_network::process_name;
use rc_management::component;
use rc_management::event::{Event, Severity};
use rc_management::{CallError, Client};
use rc_middleware::RunDirectory;
use std::path::Path;
use std::time::Duration;

/// The longest time for a component to carry out a request.
const LIMIT: Duration = Duration::from_secs(5);

/// Parts of the supervisor that `take_changes` uses.
pub(in crate::supervisor) struct LateContext<'s, 'p> {
    pub(in crate::supervisor) plan: &'p Plan,
    pub(in crate::supervisor) report: &'p Reporter,
    pub(in crate::supervisor) troubles: &'s mut NetworkTroubles<'p>,
    pub(in crate::supervisor) directory: &'s RunDirectory,
    /// Whether the network ends: then messages stop for a good reason.
    pub(in crate::supervisor) is_ending: bool,
}

impl ChainWatch {
    /// Reports what has changed of the chains, up to the first component to stop because a chain is
    /// late. Returns that component; call again after its stop. `None`: nothing is left.
    pub(in crate::supervisor) fn take_changes(
        &self,
        mut at: LateContext<'_, '_>,
    ) -> Option<String> {
        self.reporter.wake.clear();
        let is_ending = at.is_ending;
        for news in self.news.try_iter().filter(|_| !is_ending) {
            match news {
                News::Changed(chain, Change::Begun { code, text }) => {
                    let late = self.begins(&mut at, chain, code, &text);
                    if late.is_some() {
                        return late;
                    }
                }
                News::Changed(chain, Change::Ended { code, text }) => {
                    at.troubles.remove(code, &at.plan.chains[chain].name);
                    if !text.is_empty() {
                        let event = Event::network(Severity::Info, "chain-in-time", text);
                        at.report.event(event);
                    }
                }
                News::Done(event) => at.report.event(event),
            }
        }
        None
    }

    /// Reports a condition of a chain, and acts if it is the first one. Returns the component to
    /// stop.
    fn begins(
        &self,
        at: &mut LateContext<'_, '_>,
        chain: usize,
        code: &'static str,
        text: &str,
    ) -> Option<String> {
        let chain = &at.plan.chains[chain];
        let mut codes = CONDITIONS.iter();
        let is_first = !codes.any(|code| at.troubles.holds(code, &chain.name));
        let severity = match chain.late {
            LateAction::Event => Severity::Info,
            LateAction::Warn
            | LateAction::Stop(_)
            | LateAction::Emergency(_)
            | LateAction::Fire { .. } => Severity::Warning,
        };
        at.troubles.begin_of(&chain.name, severity, code, text);
        if !is_first {
            return None;
        }
        match &chain.late {
            LateAction::Warn | LateAction::Event => {}
            LateAction::Stop(name) => return Some(name.clone()),
            LateAction::Emergency(name) => {
                let request = component::Request::Emergency { active: true };
                self.ask(at.directory, name, request, "its emergency");
            }
            LateAction::Fire { component, event } => {
                let what = format!("the event `{event}`");
                let event = event.clone();
                let request = component::Request::Fire { event };
                self.ask(at.directory, component, request, &what);
            }
        }
        None
    }

    /// Asks a component, without waiting for its answer.
    fn ask(&self, directory: &RunDirectory, name: &str, request: component::Request, what: &str) {
        let socket = directory.socket(&process_name(name));
        let reporter = self.reporter.clone();
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

/// Reports the event of a component.
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
