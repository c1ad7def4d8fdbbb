//! Carries out the commands of the user and shows their results.

use super::connection::{Connection, Pending, Received};
use super::model::{Command, Host};
use super::session::{End, Session};
use rc_deploy_client::error::{Error, ErrorContext};
use rc_management::component::Request;
use rc_management::supervisor::{self, CommandResult, Verb};
use serde::Deserialize;
use serde_json::Map;

impl Session<'_> {
    pub(super) fn perform(&mut self, command: Command) -> Result<(), Error> {
        match command {
            Command::Quit { interrupt } => match self.model.host {
                Host::Top => self.end = Some(End::Left),
                Host::Up if interrupt || !self.model.stopping => {
                    self.model.stopping = true;
                    // As without a view: one interrupt stops, a second one kills.
                    let own = rustix::process::getpid();
                    let sent = rustix::process::kill_process(own, rustix::process::Signal::INT);
                    if let Err(error) = sent {
                        self.model.say(error.to_string(), true);
                    }
                }
                Host::Up => self
                    .model
                    .say("it is stopping; ctrl+c kills at once", false),
            },
            Command::Redraw => {
                self.screen.blank().context("draw on the terminal")?;
            }
            Command::Control { verb, name } => self.control(verb, &name),
            Command::Emergency { names, active } => {
                self.model.notice = None;
                for name in &names {
                    let text = format!("emergency {}: {name}", if active { "on" } else { "off" });
                    self.request(name, text, &Request::Emergency { active });
                }
            }
            Command::Set { name, path, value } => {
                let shown = rc_deploy_client::params::text(&value);
                let text = format!("{path} = {shown}");
                let text = match &self.model.parameters {
                    Some(Ok(known))
                        if known.parameters.iter().any(|p| p.path == path && p.secret) =>
                    {
                        path.clone()
                    }
                    _ => text,
                };
                let changes = Map::from_iter([(path, value)]);
                self.request(&name, text, &Request::ParametersSet { changes });
            }
            Command::Save { name } => {
                let text = format!("save the parameters of {name}");
                self.request(&name, text, &Request::ParametersSave);
            }
        }
        Ok(())
    }

    /// Sends a command to the supervisor, which answers when it has ended.
    fn control(&mut self, verb: Verb, name: &str) {
        let text = format!("{} {name}", verb.word());
        let mut components = self.model.components.iter();
        if components.any(|c| c.status.name == name && c.status.by_hand) {
            let text = format!("{text}: it was started by hand, where it has to be stopped, too");
            return self.model.say(text, true);
        }
        self.model.say(format!("{text} …"), false);
        match Connection::connect(&self.directory.socket(supervisor::SOCKET)) {
            Ok(mut connection) => {
                let request = verb.request(vec![name.to_owned()]);
                connection.send(Pending::Action(text), &request);
                self.actions.push(connection);
            }
            Err(error) => self.model.say(format!("{text}: {error}"), true),
        }
    }

    /// Sends a request to a component.
    fn request(&mut self, name: &str, text: String, request: &Request) {
        match self.components.get_mut(name) {
            Some(connection) => {
                if self.model.notice.is_none() {
                    self.model.say(format!("{text} …"), false);
                }
                connection.send(Pending::Action(text), request);
            }
            None => self.model.say(format!("{name} does not answer"), true),
        }
    }

    /// Shows the result of an action.
    pub(super) fn answered(&mut self, received: Received) {
        let Received::Answer(Pending::Action(text), answer) = received else {
            return;
        };
        let failed = answer.and_then(|done| {
            // A component answers in another form.
            let result = CommandResult::deserialize(done).unwrap_or_default();
            let failed = result.failed.into_iter().next();
            failed.map_or(Ok(()), |f| Err(format!("{} {}", f.name, f.reason)))
        });
        match failed {
            // Failures take precedence.
            Ok(()) if self.model.notice.as_ref().is_some_and(|n| n.failed) => {}
            Ok(()) => self.model.say(format!("{text}: done"), false),
            Err(reason) => {
                let reason: Vec<&str> = reason.lines().map(str::trim).collect();
                let reason = reason.join(" ");
                self.model.say(format!("{text}: {}", reason.trim()), true);
            }
        }
    }
}
