//! The parameters of the running component: their values, changes and saving.
//!
//! A change is checked on the management thread. The worker then accepts or refuses it on its own
//! thread, between two runs of `compute()` or handlers. The requester gets the result, within a
//! limit. One change is with the worker at a time; others wait.
//!
//! A part of a change of several components is held when the worker has accepted it, until the
//! supervisor settles it: all components keep their parts, or each takes its part back.

use crate::commands::{Command, CommandQueue};
use crate::configuration::LoadedConfiguration;
use crate::error::refused;
use crate::parameter_values::shown;
use crate::proposal::{CHANGE_LIMIT, Proposal};
use crate::status::Shared;
use crate::waker::Waker;
use rc_configuration::{
    CheckedChanges, LiveParameter, LiveParameters, ParamChange, PathFolders, SaveError, Values,
};
use rc_diagnostics::{Format, render};
use rc_management::component::{self, Changed, Saved, State};
use rc_management::rpc::{self, Error};
use rc_middleware::parameters::{ParameterEvent, ParameterListener};
use serde_json::{Map, Value};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a part of a change of several components is held. The supervisor settles it earlier.
const HELD_LIMIT: Duration = Duration::from_secs(10);
/// The name under which rules of a network know the period of `compute()`.
const PERIOD: &str = "period";

/// Where the result of a change goes.
pub(crate) enum Requester {
    /// The supervisor, which restores the parameters of an earlier run.
    Supervisor,
    /// The worker itself, with the path of the parameter.
    Worker(String),
    /// A backend, by the number of its request.
    Backend(u64),
    /// The supervisor, with the number of a change of several components.
    Proposal(u64),
    /// The supervisor, which has settled that change.
    Settlement(u64),
    /// A client of the socket, by its number; a notification has no identifier and gets no answer.
    Client { number: u64, id: Option<Value> },
}

/// A result that is due now.
pub(crate) type Answer = (Requester, Result<Value, Error>);

struct Request {
    requester: Requester,
    operation: Operation,
    until: Instant,
}

enum Operation {
    Change(Map<String, Value>),
    Save,
}

/// A change that is with the worker.
struct InFlight {
    requester: Requester,
    /// When it is withdrawn. An undo is not withdrawn.
    until: Option<Instant>,
    proposal: Arc<Proposal>,
    /// The values if the worker accepts; none for an undo.
    accepted: Option<CheckedChanges>,
}

/// A part of a change of several components that the worker has accepted, or that changes nothing
/// for it.
struct Held {
    number: u64,
    /// When it is taken back although the supervisor has not settled it.
    until: Instant,
    proposal: Option<Arc<Proposal>>,
    accepted: CheckedChanges,
}

/// The parameters of one component, on the management thread.
pub(crate) struct ParameterServer {
    live: LiveParameters,
    /// The values that the worker has.
    values: Arc<Values>,
    /// The configuration file.
    file: Option<PathBuf>,
    /// Where relative paths start.
    folders: PathFolders,
    commands: Arc<CommandQueue>,
    management: Waker,
    queue: VecDeque<Request>,
    in_flight: Option<InFlight>,
    held: Option<Held>,
    /// Results that need no turn of the worker.
    due: Vec<Answer>,
    /// The parameters that rules of the network read.
    ruled: Vec<String>,
    listeners: Vec<ParameterListener>,
}

impl ParameterServer {
    pub(crate) fn new(
        loaded: &LoadedConfiguration,
        commands: Arc<CommandQueue>,
        management: Waker,
    ) -> Self {
        let model = loaded.parameters.clone().unwrap_or_default();
        Self {
            live: LiveParameters::new(model, &loaded.configuration.parameters),
            values: Arc::new(loaded.values()),
            file: loaded.file.clone(),
            folders: loaded.folders.clone(),
            commands,
            management,
            queue: VecDeque::new(),
            in_flight: None,
            held: None,
            due: Vec::new(),
            ruled: Vec::new(),
            listeners: Vec::new(),
        }
    }

    /// The parameters with these paths; all if there are none.
    pub(crate) fn list(&self, paths: &[String]) -> Result<component::Parameters, Error> {
        let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
        let parameters = self.live.list(&paths).map_err(|found| refused(&found))?;
        Ok(component::Parameters {
            file: self.file.clone(),
            parameters,
        })
    }

    /// All parameters.
    pub(crate) fn all(&self) -> Vec<LiveParameter> {
        self.live.all()
    }

    /// Reports all parameters to a listener, and from now on every change.
    pub(crate) fn subscribe(&mut self, listener: ParameterListener) {
        let new = shown(&self.all());
        if !new.is_empty() {
            listener(ParameterEvent {
                new,
                ..ParameterEvent::default()
            });
        }
        self.listeners.push(listener);
    }

    /// Requests a change. [`ParameterServer::turn`] returns the result.
    pub(crate) fn change(&mut self, requester: Requester, changes: Map<String, Value>) {
        self.enqueue(requester, Operation::Change(changes));
    }

    /// Sets which parameters rules of the network read: only proposals of the supervisor change
    /// them.
    pub(crate) fn set_ruled(&mut self, ruled: Vec<String>) {
        self.ruled = ruled;
    }

    /// Whether a rule of the network reads the period of `compute()`.
    pub(crate) fn rules_period(&self) -> bool {
        let is_parameter = || self.live.list(&[PERIOD]).is_ok();
        self.ruled.iter().any(|path| path == PERIOD) && !is_parameter()
    }

    /// The supervisor has decided about a change of several components.
    pub(crate) fn settle(&mut self, number: u64, keep: bool) {
        let is_its =
            |requester: &Requester| matches!(requester, Requester::Proposal(n) if *n == number);
        self.queue.retain(|request| !is_its(&request.requester));
        let takes_it_back =
            |one: &InFlight| matches!(one.requester, Requester::Settlement(n) if n == number);
        if self.in_flight.as_ref().is_some_and(takes_it_back) {
            // The answer comes when the worker has its old values again.
            return;
        }
        if let Some(in_flight) = self.in_flight.take_if(|one| is_its(&one.requester)) {
            // The supervisor has given it up.
            let ended = in_flight.proposal.conclude(|_| String::new());
            if ended.is_ok() {
                self.take_back(number, &in_flight.proposal);
                return;
            }
        }
        if let Some(held) = self.held.take_if(|held| held.number == number) {
            match held.proposal {
                Some(proposal) if !keep => return self.take_back(number, &proposal),
                Some(proposal) => self.values = proposal.new_values(),
                None => {}
            }
            if keep && let Err(error) = self.accept(held.accepted) {
                tracing::warn!("{}", error.message);
            }
        }
        self.due
            .push((Requester::Settlement(number), Ok(Value::Null)));
    }

    /// Gives the worker the values from before.
    fn take_back(&mut self, number: u64, proposal: &Proposal) {
        let back = Arc::new(proposal.undo());
        for change in back.changes() {
            tracing::info!("parameter {change}: the change is taken back");
        }
        self.commands.push(Command::Parameters(back.clone()));
        self.in_flight = Some(InFlight {
            requester: Requester::Settlement(number),
            until: None,
            proposal: back,
            accepted: None,
        });
    }

    /// Requests that changed values are saved, after the changes that were requested before.
    /// [`ParameterServer::turn`] returns the result.
    pub(crate) fn save(&mut self, requester: Requester) {
        self.enqueue(requester, Operation::Save);
    }

    fn enqueue(&mut self, requester: Requester, operation: Operation) {
        self.queue.push_back(Request {
            requester,
            operation,
            until: Instant::now() + CHANGE_LIMIT,
        });
    }

    /// Takes the decision of the worker, and gives it the next change. Returns the results that are
    /// due.
    pub(crate) fn turn(&mut self, shared: &Shared) -> Vec<Answer> {
        let mut answers = std::mem::take(&mut self.due);
        loop {
            if let Some(in_flight) = self.in_flight.take() {
                let Some(decision) = in_flight.decision(shared) else {
                    if in_flight.until.is_none() {
                        answers.extend(self.expired());
                    }
                    self.in_flight = Some(in_flight);
                    return answers;
                };
                answers.push(self.decided(in_flight, decision));
            }
            if let Some(held) = self.held.take_if(|held| Instant::now() >= held.until) {
                tracing::warn!("the supervisor has not settled a change of parameters");
                if let Some(proposal) = held.proposal {
                    self.take_back(held.number, &proposal);
                }
                continue;
            }
            if self.held.is_some() {
                answers.extend(self.expired());
                return answers;
            }
            let Some(request) = self.queue.pop_front() else {
                return answers;
            };
            answers.extend(match request.operation {
                Operation::Change(changes) => {
                    self.propose(request.requester, &changes, request.until)
                }
                Operation::Save => Some((request.requester, self.write())),
            });
        }
    }

    /// Checks a change, and gives it to the worker.
    fn propose(
        &mut self,
        requester: Requester,
        changes: &Map<String, Value>,
        until: Instant,
    ) -> Option<Answer> {
        let changes = changes.iter();
        let accepted = match self
            .live
            .check(changes.map(|(path, value)| (path.as_str(), value)))
        {
            Ok(accepted) => accepted,
            Err(found) => return Some((requester, Err(refused(&found)))),
        };
        if !matches!(requester, Requester::Proposal(_) | Requester::Supervisor)
            && let Some(path) = self.ruled_one(&accepted)
        {
            let message = format!(
                "`{path}` is in a rule of the network: change it with `rcdeploy params set`, which checks the rule"
            );
            return Some((requester, Err(Error::new(Error::RULED, message))));
        }
        if accepted.changes.is_empty() {
            return Some(self.hold_or_accept(requester, None, accepted));
        }
        let proposal = Arc::new(Proposal::new(
            self.values.clone(),
            self.live.worker_values(&accepted, &self.folders),
            accepted.changes.clone(),
            self.management.clone(),
        ));
        self.commands.push(Command::Parameters(proposal.clone()));
        self.in_flight = Some(InFlight {
            requester,
            until: Some(until),
            proposal,
            accepted: Some(accepted),
        });
        None
    }

    /// The first changed parameter that a rule of the network reads.
    fn ruled_one(&self, accepted: &CheckedChanges) -> Option<String> {
        let changes = accepted.changes.iter().chain(&accepted.pending);
        let mut paths = changes.map(|change| &change.path);
        let is_ruled = |path: &&String| {
            self.ruled
                .iter()
                .any(|ruled| component::overlap(path, ruled))
        };
        paths.find(is_ruled).cloned()
    }

    /// The requests that have waited too long for a change of several components.
    fn expired(&mut self) -> Vec<Answer> {
        let now = Instant::now();
        let is_late = |request: &Request| request.until <= now;
        let (late, waiting): (VecDeque<_>, _) = self.queue.drain(..).partition(is_late);
        self.queue = waiting;
        let answer = |request: Request| {
            let message = "a change of several components has not ended; nothing has changed";
            let error = Error::new(Error::WORKER_TIMEOUT, message);
            (request.requester, Err(error))
        };
        late.into_iter().map(answer).collect()
    }

    fn decided(&mut self, in_flight: InFlight, decision: Result<(), Error>) -> Answer {
        let InFlight {
            requester,
            proposal,
            accepted,
            ..
        } = in_flight;
        match (decision, accepted) {
            (Ok(()), Some(accepted)) => self.hold_or_accept(requester, Some(proposal), accepted),
            (Ok(()), None) => (requester, Ok(Value::Null)),
            (Err(error), _) => (requester, Err(error)),
        }
    }

    /// Takes a change that the worker has accepted, or holds it until the supervisor settles it.
    fn hold_or_accept(
        &mut self,
        requester: Requester,
        proposal: Option<Arc<Proposal>>,
        accepted: CheckedChanges,
    ) -> Answer {
        if let Requester::Proposal(number) = requester {
            let shown = changed(&accepted);
            self.held = Some(Held {
                number,
                until: Instant::now() + HELD_LIMIT,
                proposal,
                accepted,
            });
            return (requester, rpc::result(&shown));
        }
        if let Some(proposal) = proposal {
            self.values = proposal.new_values();
        }
        let answer = self.accept(accepted);
        (requester, answer)
    }

    fn accept(&mut self, accepted: CheckedChanges) -> Result<Value, Error> {
        for change in &accepted.changes {
            tracing::info!("parameter {change}");
        }
        for change in &accepted.pending {
            tracing::info!("parameter {change}, at the next start");
        }
        let changed = changed(&accepted);
        if self.listeners.is_empty() {
            self.live.apply(accepted);
        } else {
            let before = self.all();
            self.live.apply(accepted);
            self.notify(&before);
        }
        rpc::result(&changed)
    }

    /// Reports to the listeners which parameters have changed since `before`: whole parameters,
    /// even if only an element has changed.
    fn notify(&self, before: &[LiveParameter]) {
        // The set of parameters is constant.
        let pairs = self.all().into_iter().zip(before);
        let changed = pairs.filter(|(now, before)| now.status.value != before.status.value);
        let changed: Vec<LiveParameter> = changed.map(|(now, _)| now).collect();
        let changed = shown(&changed);
        if changed.is_empty() {
            return;
        }
        let event = ParameterEvent {
            changed,
            ..ParameterEvent::default()
        };
        for listener in &self.listeners {
            listener(event.clone());
        }
    }

    /// The time until a limit passes: that of the change at the worker, that of a held one, or that
    /// of a request that waits for these.
    pub(crate) fn time_left(&self) -> Option<Duration> {
        let in_flight = self.in_flight.as_ref().and_then(|one| one.until);
        let held = self.held.as_ref().map(|held| held.until);
        let waiting = self.queue.iter().map(|request| request.until).min();
        let next = [in_flight, held, waiting].into_iter().flatten().min()?;
        Some(next.saturating_duration_since(Instant::now()))
    }

    /// Withdraws all changes: the component ends.
    pub(crate) fn end(&mut self) -> Vec<Answer> {
        let mut answers = Vec::new();
        let ends = "the component ends; nothing has changed";
        if let Some(in_flight) = self.in_flight.take() {
            let decision = in_flight.proposal.conclude(|_| ends.to_owned());
            answers.push(self.decided(in_flight, decision));
        }
        answers.extend(self.queue.drain(..).map(|request| {
            let ends = match request.operation {
                Operation::Change(_) => ends,
                Operation::Save => "the component ends; nothing was saved",
            };
            let error = Error::new(Error::WORKER_TIMEOUT, ends);
            (request.requester, Err(error))
        }));
        answers
    }

    /// The values of the next start that no file has.
    pub(crate) fn unsaved(&self) -> Vec<ParamChange> {
        self.live.unsaved()
    }

    fn write(&mut self) -> Result<Value, Error> {
        let Some(file) = &self.file else {
            let message = "the component has read no configuration file; start it with --config FILE, a file that may be empty";
            return Err(Error::new(Error::FILE, message));
        };
        let unsaved = self.live.unsaved();
        if !unsaved.is_empty() {
            let has_secret = unsaved.iter().any(|change| change.secret);
            write_into(&self.live, file, has_secret)?;
            self.live.saved();
        }
        rpc::result(&Saved {
            file: file.clone(),
            saved: unsaved.iter().map(ParamChange::shown).collect(),
        })
    }
}

impl InFlight {
    /// The decision of the worker; none while it has time left.
    fn decision(&self, shared: &Shared) -> Option<Result<(), Error>> {
        if !self.proposal.is_decided() && self.until.is_none_or(|until| Instant::now() < until) {
            return None;
        }
        let busy = if shared.status().state == State::Starting {
            "its initialize() has not ended yet"
        } else {
            "its compute() or a handler takes too long"
        };
        let limit = format!("the worker has not decided within {CHANGE_LIMIT:?}");
        Some(self.proposal.conclude(|in_worker| {
            let activity = if in_worker {
                "it is in params_changed()"
            } else {
                busy
            };
            format!("{limit}: {activity}; nothing has changed")
        }))
    }
}

/// Changes as tools get them: secrets are hidden.
fn changed(accepted: &CheckedChanges) -> Changed {
    Changed {
        changed: accepted.changes.iter().map(ParamChange::shown).collect(),
        pending: accepted.pending.iter().map(ParamChange::shown).collect(),
    }
}

/// Writes the values of the next start into the configuration: all of it, or nothing. A file that
/// gets a secret is its owner's alone.
fn write_into(live: &LiveParameters, file: &Path, has_secret: bool) -> Result<(), Error> {
    let shown = file.display();
    let refuse = |what: &str, error: &std::io::Error| {
        Error::new(Error::SYSTEM, format!("{shown} cannot be {what}: {error}"))
    };
    let text = rc_files::read(file).map_err(|e| refuse("read", &e))?;
    let new = live.save(file, &text).map_err(|unsaved| match unsaved {
        SaveError::Conflicts(lines) => Error::new(
            Error::FILE,
            format!(
                "{shown} has changed since it was read; nothing was written: {}; restart the component to use the file as it is, or revert the file and save again",
                lines.join("; ")
            ),
        ),
        SaveError::Invalid(sources, found) => {
            let found = render(&sources, &found, Format::Short);
            let message = format!("{shown} has changed, and with it the configuration is wrong; nothing was written: {}", found.trim_end());
            Error::new(Error::FILE, message)
        }
    })?;
    let written = if has_secret {
        rc_files::replace_hidden(file, &text, &new)
    } else {
        rc_files::replace(file, &text, &new)
    };
    written.map_err(|e| refuse("written", &e))
}
