//! The parameters of the running component, as management sees them: what they are, how they change, how they are saved.
//!
//! A change is checked on the management thread and put to the worker on its own thread, between two computes or handlers.
//! Who asked for it waits, within a limit, and learns what has become of it. One change is with the worker at a time, others
//! wait their turn.

use crate::component::{Component, WorkerError};
use crate::parameter_service;
use crate::status::{Command, Shared, State};
use rc_configuration::Parameters;
use rc_configuration::{Accepted, Live, ParamChange, ParameterStatus, Unsaved, Values};
use rc_diagnostics::{Diagnostic, Diagnostics, Format, render};
use rc_middleware::parameters::{ParameterEvent, ParameterListener};
use serde_json::{Map, Value, json};
use std::collections::VecDeque;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A worker that has not decided about a change by then hangs, or does something that takes too long.
const CHANGE_LIMIT: Duration = Duration::from_secs(3);

/// Why a request fails: the code of JSON-RPC, what is said, and what tools may want to know.
pub(crate) struct Refusal {
    pub(crate) code: i64,
    pub(crate) message: String,
    pub(crate) data: Option<Value>,
}

impl Refusal {
    /// The request is not made as it has to be, or the checker refuses what it asks for.
    pub(crate) const INPUT: i64 = -32602;
    /// The worker refuses a change.
    const WORKER: i64 = -32001;
    /// The worker does not decide.
    const SILENCE: i64 = -32002;
    /// The file is not one that can be written into.
    const FILE: i64 = -32003;
    /// The system refuses.
    const SYSTEM: i64 = -32004;

    pub(crate) fn new(code: i64, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
            data: None,
        }
    }

    /// What the checker has found.
    pub(crate) fn found(found: &Diagnostics) -> Self {
        let line = |finding: &Diagnostic| match &finding.help {
            Some(help) => format!("{} ({help})", finding.message),
            None => finding.message.clone(),
        };
        let lines: Vec<String> = found.iter().map(line).collect();
        let findings = found.iter().map(|finding| {
            json!({ "code": finding.code, "message": finding.message, "help": finding.help })
        });
        Self {
            data: Some(json!({ "findings": findings.collect::<Vec<_>>() })),
            ..Self::new(Self::INPUT, lines.join("; "))
        }
    }
}

/// A change on its way to the worker.
#[derive(Debug)]
pub(crate) struct Proposal {
    old: Arc<Values>,
    new: Arc<Values>,
    changes: Vec<ParamChange>,
    state: Mutex<ProposalState>,
    /// Wakes the management thread.
    end: Arc<UnixStream>,
}

#[derive(Debug)]
enum ProposalState {
    Waiting,
    WithWorker,
    Withdrawn,
    Decided(Result<(), String>),
}

impl Proposal {
    fn state(&self) -> MutexGuard<'_, ProposalState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// On the worker's thread: gives the worker the new values, and takes them back if it refuses. Returns what the
    /// worker has said last.
    pub(crate) fn put_to(&self, component: &mut dyn Component) -> Result<(), WorkerError> {
        {
            let mut state = self.state();
            if !matches!(*state, ProposalState::Waiting) {
                return Ok(());
            }
            *state = ProposalState::WithWorker;
        }
        component.set_parameters(&self.new);
        let said = component.parameters_changed(&self.changes);
        if said.is_err() {
            component.set_parameters(&self.old);
        }
        let decision = match &said {
            Ok(()) => Ok(()),
            Err(WorkerError::Failed(reason)) => Err(reason.clone()),
            Err(WorkerError::Emergency(reason)) => {
                Err(format!("{reason}; the component is in emergency now"))
            }
            Err(WorkerError::Fatal(reason)) => Err(format!("{reason}; the component ends")),
        };
        {
            let mut state = self.state();
            if matches!(*state, ProposalState::WithWorker) {
                *state = ProposalState::Decided(decision);
                drop(state);
                let _ = (&*self.end).write_all(b"c");
                return said;
            }
        }
        // It was withdrawn meanwhile, and who asked was told that nothing has changed.
        if said.is_ok() {
            component.set_parameters(&self.old);
            let back: Vec<_> = self.changes.iter().map(ParamChange::reversed).collect();
            tracing::warn!(
                "a change of parameters took longer than {CHANGE_LIMIT:?} and is taken back"
            );
            if let Err(error) = component.parameters_changed(&back) {
                tracing::warn!("params_changed() refuses the way back: {error}");
                return Err(error);
            }
        }
        said
    }
}

/// Who is to be answered.
pub(crate) struct Requester {
    pub(crate) client: u64,
    /// None for a notification, which gets no answer.
    pub(crate) id: Option<Value>,
}

/// An answer that is due now, and who waits for it.
pub(crate) type Answer = (Requester, Result<Value, Refusal>);

struct Request {
    requester: Requester,
    operation: Operation,
    until: Instant,
}

enum Operation {
    Changes(Map<String, Value>),
    Save,
}

struct InFlight {
    requester: Requester,
    until: Instant,
    proposal: Arc<Proposal>,
    accepted: Accepted,
}

/// The parameters of one component.
pub(crate) struct ParameterServer {
    live: Live,
    /// What the worker has.
    values: Arc<Values>,
    /// The configuration that was read.
    file: Option<PathBuf>,
    end: Arc<UnixStream>,
    queue: VecDeque<Request>,
    in_flight: Option<InFlight>,
    /// Who is told of every change.
    listeners: Vec<ParameterListener>,
}

impl ParameterServer {
    pub(crate) fn new(
        model: Parameters,
        values: &Values,
        file: Option<PathBuf>,
        end: Arc<UnixStream>,
    ) -> Self {
        Self {
            live: Live::new(model, values),
            values: Arc::new(values.clone()),
            file,
            end,
            queue: VecDeque::new(),
            in_flight: None,
            listeners: Vec::new(),
        }
    }

    /// `parameters {"paths"}`
    pub(crate) fn list(&self, params: &Value) -> Result<Value, Refusal> {
        let usage = || {
            let message = "`parameters` takes {} or {\"paths\": [\"motors[0].max\", …]}";
            Refusal::new(Refusal::INPUT, message)
        };
        let paths = match params.get("paths") {
            None | Some(Value::Null) => Vec::new(),
            Some(paths) => {
                let paths = paths.as_array().ok_or_else(usage)?.iter();
                let paths: Option<Vec<&str>> = paths.map(Value::as_str).collect();
                paths.ok_or_else(usage)?
            }
        };
        let parameters = self
            .live
            .list(&paths)
            .map_err(|found| Refusal::found(&found))?;
        Ok(json!({ "file": self.file, "parameters": parameters }))
    }

    /// `parameters_set {"changes"}`: the answer comes with [`ParameterServer::turn`].
    pub(crate) fn set(&mut self, requester: Requester, params: &Value) -> Option<Answer> {
        let changes = params.get("changes").and_then(Value::as_object);
        let Some(changes) = changes.filter(|changes| !changes.is_empty()) else {
            let message = "`parameters_set` takes {\"changes\": {\"motors[0].max\": 1.5, …}}";
            return Some((requester, Err(Refusal::new(Refusal::INPUT, message))));
        };
        self.change(requester, changes.clone());
        None
    }

    /// `parameters_save`, after the changes that were asked for before: the answer comes with [`ParameterServer::turn`].
    pub(crate) fn save(&mut self, requester: Requester) {
        self.enqueue(requester, Operation::Save);
    }

    /// All of them.
    pub(crate) fn all(&self) -> Vec<ParameterStatus> {
        self.live.list(&[]).unwrap_or_default()
    }

    /// Tells a listener of all, and from now on of every change.
    pub(crate) fn subscribe(&mut self, listener: ParameterListener) {
        let new = parameter_service::shown(&self.all());
        if !new.is_empty() {
            listener(ParameterEvent {
                new,
                ..ParameterEvent::default()
            });
        }
        self.listeners.push(listener);
    }

    /// Changes, which there are: the answer comes with [`ParameterServer::turn`].
    pub(crate) fn change(&mut self, requester: Requester, changes: Map<String, Value>) {
        self.enqueue(requester, Operation::Changes(changes));
    }

    fn enqueue(&mut self, requester: Requester, operation: Operation) {
        self.queue.push_back(Request {
            requester,
            operation,
            until: Instant::now() + CHANGE_LIMIT,
        });
    }

    /// What the worker has decided meanwhile is told, and the next change goes its way.
    pub(crate) fn turn(&mut self, shared: &Shared) -> Vec<Answer> {
        let mut answers = Vec::new();
        loop {
            if let Some(in_flight) = self.in_flight.take() {
                let Some(decision) = in_flight.decided(shared) else {
                    self.in_flight = Some(in_flight);
                    return answers;
                };
                answers.push(self.decided(in_flight, decision));
            }
            let Some(request) = self.queue.pop_front() else {
                return answers;
            };
            answers.extend(match request.operation {
                Operation::Changes(changes) => {
                    self.propose(request.requester, &changes, request.until, shared)
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
        shared: &Shared,
    ) -> Option<Answer> {
        let changes = changes.iter();
        let accepted = match self
            .live
            .check(changes.map(|(path, value)| (path.as_str(), value)))
        {
            Ok(accepted) => accepted,
            Err(found) => return Some((requester, Err(Refusal::found(&found)))),
        };
        if accepted.changes.is_empty() {
            return Some((requester, Ok(self.accept(accepted))));
        }
        let proposal = Arc::new(Proposal {
            old: self.values.clone(),
            new: Arc::new(accepted.values()),
            changes: accepted.changes.clone(),
            state: Mutex::new(ProposalState::Waiting),
            end: self.end.clone(),
        });
        shared.command(Command::Parameters(proposal.clone()));
        self.in_flight = Some(InFlight {
            requester,
            until,
            proposal,
            accepted,
        });
        None
    }

    fn decided(&mut self, in_flight: InFlight, decision: Result<(), Refusal>) -> Answer {
        let InFlight {
            requester,
            proposal,
            accepted,
            ..
        } = in_flight;
        let answer = decision.map(|()| {
            self.values = proposal.new.clone();
            self.accept(accepted)
        });
        (requester, answer)
    }

    fn accept(&mut self, accepted: Accepted) -> Value {
        for change in &accepted.changes {
            tracing::info!("parameter {change}");
        }
        for change in &accepted.pending {
            tracing::info!("parameter {change}, at the next start");
        }
        let list = |changes: &[ParamChange]| -> Vec<Value> {
            changes.iter().map(ParamChange::to_json).collect()
        };
        let answer = json!({
            "changed": list(&accepted.changes),
            "pending": list(&accepted.pending),
        });
        if self.listeners.is_empty() {
            self.live.accept(accepted);
        } else {
            let before = self.all();
            self.live.accept(accepted);
            self.tell(&before);
        }
        answer
    }

    /// Tells the listeners what is not as it was: whole parameters, also where an element was changed.
    fn tell(&self, before: &[ParameterStatus]) {
        // None comes or goes.
        let pairs = self.all().into_iter().zip(before);
        let changed = pairs.filter(|(now, before)| now.value != before.value);
        let changed: Vec<ParameterStatus> = changed.map(|(now, _)| now).collect();
        let changed = parameter_service::shown(&changed);
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

    /// How long until a change has waited long enough.
    pub(crate) fn time_left(&self) -> Option<Duration> {
        let in_flight = self.in_flight.as_ref()?;
        Some(in_flight.until.saturating_duration_since(Instant::now()))
    }

    /// The component ends: what is under way does not happen.
    pub(crate) fn end(&mut self) -> Vec<Answer> {
        let mut answers = Vec::new();
        let ends = "the component ends; nothing has changed";
        if let Some(in_flight) = self.in_flight.take() {
            let decision = in_flight.withdraw(|_| ends.to_owned());
            answers.push(self.decided(in_flight, decision));
        }
        answers.extend(self.queue.drain(..).map(|request| {
            let ends = match request.operation {
                Operation::Changes(_) => ends,
                Operation::Save => "the component ends; nothing was saved",
            };
            (request.requester, Err(Refusal::new(Refusal::SILENCE, ends)))
        }));
        answers
    }

    /// The values of the next start that are in no file.
    pub(crate) fn unsaved(&self) -> Vec<ParamChange> {
        self.live.unsaved()
    }

    fn write(&mut self) -> Result<Value, Refusal> {
        let Some(file) = &self.file else {
            let message = "the component has read no configuration file; start it with --config FILE, a file that may be empty";
            return Err(Refusal::new(Refusal::FILE, message));
        };
        let unsaved = self.live.unsaved();
        let saved: Vec<Value> = unsaved.iter().map(ParamChange::to_json).collect();
        if !saved.is_empty() {
            write_into(&self.live, file)?;
            self.live.saved();
        }
        Ok(json!({ "file": file, "saved": saved }))
    }
}

impl InFlight {
    /// None while the worker may still decide.
    fn decided(&self, shared: &Shared) -> Option<Result<(), Refusal>> {
        let late = Instant::now() >= self.until;
        if !matches!(*self.proposal.state(), ProposalState::Decided(_)) && !late {
            return None;
        }
        let busy = if shared.status().state == State::Starting {
            "its initialize() has not ended yet"
        } else {
            "its compute() or a handler takes too long"
        };
        let limit = format!("the worker has not decided within {CHANGE_LIMIT:?}");
        Some(self.withdraw(|with_worker| {
            let activity = if with_worker {
                "it is in params_changed()"
            } else {
                busy
            };
            format!("{limit}: {activity}; nothing has changed")
        }))
    }

    /// What the worker has decided; where it has not, it cannot any more, and `silence` says why, told whether the
    /// change is with the worker.
    fn withdraw(&self, silence: impl FnOnce(bool) -> String) -> Result<(), Refusal> {
        let mut state = self.proposal.state();
        match &*state {
            ProposalState::Decided(Ok(())) => Ok(()),
            ProposalState::Decided(Err(reason)) => Err(Refusal::new(Refusal::WORKER, reason)),
            ProposalState::Waiting | ProposalState::WithWorker | ProposalState::Withdrawn => {
                let message = silence(matches!(*state, ProposalState::WithWorker));
                *state = ProposalState::Withdrawn;
                Err(Refusal::new(Refusal::SILENCE, message))
            }
        }
    }
}

/// Writes the values of the next start into the configuration: all of it, or nothing.
fn write_into(live: &Live, file: &Path) -> Result<(), Refusal> {
    let shown = file.display();
    let refuse = |what: &str, error: &std::io::Error| {
        Refusal::new(
            Refusal::SYSTEM,
            format!("{shown} cannot be {what}: {error}"),
        )
    };
    let text = rc_files::read(file).map_err(|e| refuse("read", &e))?;
    let new = live.save(file, &text).map_err(|unsaved| match unsaved {
        Unsaved::Conflicts(lines) => Refusal::new(
            Refusal::FILE,
            format!(
                "somebody else has changed {shown}, and nothing was written: {}; restart the component to take what the file says, or change it back and save again",
                lines.join("; ")
            ),
        ),
        Unsaved::Wrong(sources, found) => {
            let found = render(&sources, &found, Format::Short);
            let message = format!("{shown} has changed, and with it the configuration is wrong; nothing was written: {}", found.trim_end());
            Refusal::new(Refusal::FILE, message)
        }
    })?;
    rc_files::replace(file, &text, &new).map_err(|e| refuse("written", &e))
}
