//! What the user has chosen to do, and what became of it.

use super::model::{Command, Host};
use super::peer::{Peer, Said};
use super::session::{End, Pending, Session};
use crate::error::{Error, ErrorContext};
use crate::supervisor::commands::{CommandResult, Verb};
use crate::supervisor::control;
use serde::Deserialize;
use serde_json::{Value, json};

impl Session<'_> {
    pub(super) fn perform(&mut self, command: Command) -> Result<(), Error> {
        match command {
            Command::Quit { interrupt } => match self.model.host {
                Host::Top => self.end = Some(End::Left),
                Host::Up if interrupt || !self.model.stopping => {
                    self.model.stopping = true;
                    // The supervisor does what it does without a view: once stops, twice kills.
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
                    self.tell(name, text, "emergency", &json!({ "active": active }));
                }
            }
            Command::Set { name, path, value } => {
                let shown = crate::client::params::text(&value);
                let text = format!("{path} = {shown}");
                let text = match &self.model.parameters {
                    Some(Ok(known))
                        if known.parameters.iter().any(|p| p.path == path && p.secret) =>
                    {
                        path.clone()
                    }
                    _ => text,
                };
                let changes = json!({ "changes": { path: value } });
                self.tell(&name, text, "parameters_set", &changes);
            }
            Command::Save { name } => {
                let text = format!("save the parameters of {name}");
                self.tell(&name, text, "parameters_save", &json!({}));
            }
        }
        Ok(())
    }

    /// Asks the supervisor, which answers when it is done, or knows that it cannot be.
    fn control(&mut self, verb: Verb, name: &str) {
        let text = format!("{} {name}", verb.word());
        self.model.say(format!("{text} …"), false);
        match Peer::connect(&self.directory.socket(control::NAME)) {
            Ok(mut peer) => {
                peer.ask(
                    Pending::Action(text),
                    verb.word(),
                    &json!({ "names": [name] }),
                );
                self.actions.push(peer);
            }
            Err(error) => self.model.say(format!("{text}: {error}"), true),
        }
    }

    /// Tells a component something.
    fn tell(&mut self, name: &str, text: String, method: &str, params: &Value) {
        match self.components.get_mut(name) {
            Some(peer) => {
                if self.model.notice.is_none() {
                    self.model.say(format!("{text} …"), false);
                }
                peer.ask(Pending::Action(text), method, params);
            }
            None => self.model.say(format!("{name} does not answer"), true),
        }
    }

    /// An order was obeyed, or not.
    pub(super) fn answered(&mut self, said: Said<Pending>) {
        let Said::Answer(Pending::Action(text), answer) = said else {
            return;
        };
        let failed = answer.and_then(|done| {
            // Of a component, the answer is another one.
            let result = CommandResult::deserialize(done).unwrap_or_default();
            let failed = result.failed.into_iter().next();
            failed.map_or(Ok(()), |f| Err(format!("{} {}", f.name, f.reason)))
        });
        match failed {
            // Of several components, those that failed are more interesting.
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
