//! The socket between a component and the supervisor that started it.
//!
//! A supervisor may be stopped for minutes, and its component goes on. State, readiness and unsaved
//! parameters are therefore levels: each is kept until it can be written, and a newer value
//! replaces an older one. Heartbeats count what happens in between. So the supervisor learns
//! everything as soon as it reads again, and the backlog takes one line of memory for each kind of
//! message.

use crate::lifecycle::Goal;
use rc_configuration::ParamChange;
use rc_diagnostics::foreign;
use rc_management::Output;
use rc_management::component::{Changed, GroupStatus, State};
use rc_management::lines::{LIMIT, Lines, Overlong};
use rc_management::link::{
    ComponentMessage, Heartbeat, LifecycleReport, MOST_GARBAGE, SupervisorMessage,
    UnsavedParameters,
};
use rc_management::rpc::{self, Error};
use rustix::event::PollFlags;
use rustix::net::sockopt::socket_peercred;
use rustix::process::Pid;
use serde_json::{Map, Value};
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

/// How many paths of values, or names of components, are listed if all would be too long for a
/// line.
const LISTED: usize = 16;
/// How often the link is read at once.
const READS: usize = 8;
/// Room for the rest of a line with parameters, in bytes.
const MARGIN: usize = 1024;

/// The component's end.
#[derive(Debug)]
pub(crate) struct Link {
    stream: UnixStream,
    lines: Lines,
    /// How many bytes came in invalid lines.
    garbage: usize,
    /// The line that is being written.
    output: Output,
    waiting: Levels,
    /// The last state and the last unsaved parameters that were set.
    state: Option<State>,
    lifecycle: Option<LifecycleReport>,
    unsaved: UnsavedParameters,
}

/// Changes that the supervisor does not know yet.
#[derive(Debug, Default)]
struct Levels {
    state: Option<State>,
    lifecycle: Option<LifecycleReport>,
    /// The answer to the request to restore parameters.
    restored: Option<ComponentMessage>,
    is_ready: bool,
    unsaved: Option<UnsavedParameters>,
    /// The answers to the last proposal of the supervisor, which waits for each.
    proposed: Option<ComponentMessage>,
    settled: Option<u64>,
}

impl Levels {
    /// The next message, in an order that the supervisor understands: it takes parameters for those
    /// of this run once it knows whether the earlier ones were restored.
    fn take(&mut self) -> Option<ComponentMessage> {
        if let Some(state) = self.state.take() {
            return Some(ComponentMessage::State { state });
        }
        if let Some(restored) = self.restored.take() {
            return Some(restored);
        }
        if std::mem::take(&mut self.is_ready) {
            return Some(ComponentMessage::Ready);
        }
        if let Some(report) = self.lifecycle.take() {
            return Some(ComponentMessage::Lifecycle(report));
        }
        // Unsaved parameters come before the answers: the supervisor adds a change that it keeps.
        if let Some(unsaved) = self.unsaved.take() {
            return Some(ComponentMessage::Parameters(unsaved));
        }
        let settled = |number| ComponentMessage::Settled { number };
        self.proposed
            .take()
            .or_else(|| self.settled.take().map(settled))
    }
}

/// Messages of the supervisor since the last look.
#[derive(Debug, Default)]
pub(crate) struct LinkInput {
    /// The supervisor has ended.
    pub(crate) closed: bool,
    /// Parameters that an earlier run had not saved, to be set before the component is ready.
    pub(crate) restore: Option<Map<String, Value>>,
    /// The parameters that rules of the network read.
    pub(crate) ruled: Vec<String>,
    /// A part of a change of several components, with its number.
    pub(crate) proposed: Vec<(u64, Map<String, Value>)>,
    /// The decisions of the supervisor about such changes, by their numbers: whether they are kept.
    pub(crate) settled: Vec<(u64, bool)>,
    /// The state to which the life cycle is to be brought.
    pub(crate) goal: Option<Goal>,
    /// The state of a proxy's group.
    pub(crate) group: Option<GroupStatus>,
}

impl Link {
    /// Whether a supervisor has started this process.
    pub(crate) fn is_expected() -> bool {
        std::env::var_os("RC_SUPERVISED").is_some()
    }

    /// The link at standard input, if a supervisor has started this process.
    pub(crate) fn inherited() -> io::Result<Option<Self>> {
        if !Self::is_expected() {
            return Ok(None);
        }
        let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        Self::new(stream).map(Some)
    }

    /// The link at this socket.
    pub(crate) fn new(stream: UnixStream) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        Ok(Self {
            stream,
            lines: Lines::new(Overlong::Count),
            garbage: 0,
            // One line is written at a time, and no supervisor reads a longer one.
            output: Output::up_to(LIMIT + 1),
            waiting: Levels::default(),
            state: None,
            lifecycle: None,
            unsaved: UnsavedParameters::default(),
        })
    }

    /// The process of the supervisor.
    pub(crate) fn supervisor(&self) -> Option<Pid> {
        socket_peercred(&self.stream).ok().map(|peer| peer.pid)
    }

    /// The events to wait for.
    pub(crate) fn flags(&self) -> PollFlags {
        let mut flags = PollFlags::IN;
        flags.set(PollFlags::OUT, !self.is_free());
        flags
    }

    /// Whether all messages so far are written.
    pub(crate) fn is_free(&self) -> bool {
        self.output.is_empty()
    }

    /// Sets the state.
    pub(crate) fn set_state(&mut self, state: State) {
        if self.state != Some(state) {
            self.state = Some(state);
            self.waiting.state = Some(state);
            self.write();
        }
    }

    /// Sets the state of the life cycle, and what became of the last goal.
    pub(crate) fn set_lifecycle(&mut self, report: LifecycleReport) {
        if self.lifecycle.as_ref() != Some(&report) {
            self.lifecycle = Some(report.clone());
            self.waiting.lifecycle = Some(report);
            self.write();
        }
    }

    /// Sets whether parameters were restored, and why not.
    pub(crate) fn set_restored(&mut self, refused: Option<&str>) {
        // The reason is the worker's text, of any length.
        let refused = refused.map(foreign::clean);
        self.waiting.restored = Some(ComponentMessage::Restored { refused });
        self.write();
    }

    /// Sets the answer to a proposal: the accepted changes, or the reason for refusing them.
    pub(crate) fn set_proposed(&mut self, number: u64, result: Result<Value, Error>) {
        let (changes, refused) = match result {
            Ok(changes) => (serde_json::from_value(changes).unwrap_or_default(), None),
            Err(error) => (Changed::default(), Some(foreign::clean(&error.reason()))),
        };
        self.waiting.proposed = Some(ComponentMessage::Proposed {
            number,
            changes,
            refused,
        });
        self.write();
    }

    /// Sets that a proposal is kept, or taken back.
    pub(crate) fn set_settled(&mut self, number: u64) {
        self.waiting.settled = Some(number);
        self.write();
    }

    /// Sets that the component is ready.
    pub(crate) fn set_ready(&mut self) {
        self.waiting.is_ready = true;
        self.write();
    }

    /// Sets the unsaved parameters.
    pub(crate) fn set_unsaved(&mut self, changes: &[ParamChange]) {
        let unsaved = unsaved(changes);
        if unsaved != self.unsaved {
            self.unsaved.clone_from(&unsaved);
            self.waiting.unsaved = Some(unsaved);
            self.write();
        }
    }

    /// Sends a heartbeat. The link must be free.
    pub(crate) fn send_heartbeat(&mut self, heartbeat: Heartbeat) {
        self.output.push(&heartbeat_line(heartbeat));
        self.write();
    }

    /// Writes as much as the supervisor accepts. It never blocks its component.
    pub(crate) fn write(&mut self) {
        loop {
            if self.output.write(&self.stream).is_err() {
                // The supervisor has ended, which reading shows.
                self.output.clear();
                self.waiting = Levels::default();
            }
            if !self.output.is_empty() {
                return;
            }
            let Some(message) = self.waiting.take() else {
                return;
            };
            self.output.push(&rpc::notification(&message));
        }
    }

    /// Reads what has come: a line of [`LIMIT`] bytes takes several reads.
    pub(crate) fn receive(&mut self) -> LinkInput {
        let mut input = LinkInput::default();
        for _ in 0..READS {
            let (lines, closed) = self.lines.read(&self.stream);
            for line in &lines {
                match line.bytes().and_then(SupervisorMessage::decode) {
                    Some(SupervisorMessage::Restore { changes, ruled }) => {
                        input.restore = Some(changes);
                        input.ruled = ruled;
                    }
                    Some(SupervisorMessage::Propose { number, changes }) => {
                        input.proposed.push((number, changes));
                    }
                    Some(SupervisorMessage::Settle { number, keep }) => {
                        input.settled.push((number, keep));
                    }
                    Some(SupervisorMessage::Lifecycle { number, goal }) => {
                        let number = Some(number);
                        input.goal = Some(Goal {
                            state: goal,
                            number,
                        });
                    }
                    Some(SupervisorMessage::Group(group)) => input.group = Some(group),
                    None => self.garbage += line.size(),
                }
            }
            // A peer that sends only garbage is not a supervisor.
            if closed || self.garbage > MOST_GARBAGE {
                input.closed = true;
                break;
            }
        }
        input
    }
}

impl AsFd for Link {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

/// The line of a heartbeat. If it would be too long for a supervisor, it lacks the fields that grow
/// with the number of slots, and says so.
fn heartbeat_line(mut heartbeat: Heartbeat) -> Vec<u8> {
    let line = rpc::notification(&ComponentMessage::Heartbeat(heartbeat.clone()));
    if line.len() <= LIMIT {
        return line;
    }
    heartbeat.lost.clear();
    heartbeat.converted.clear();
    heartbeat.peers.clear();
    heartbeat.silent.clear();
    if let Some(clock) = &mut heartbeat.clock {
        clock.followers.truncate(LISTED);
        clock.waiting_for.truncate(LISTED);
    }
    heartbeat.machine = None;
    heartbeat.mismatches = vec![format!(
        "the health of its slots takes {} bytes, a heartbeat has {LIMIT}; ask for `status`",
        line.len()
    )];
    rpc::notification(&ComponentMessage::Heartbeat(heartbeat))
}

/// Secrets stay in this process. If the values are too long for a line, only paths are sent.
fn unsaved(changes: &[ParamChange]) -> UnsavedParameters {
    let paths = |changes: &mut dyn Iterator<Item = &ParamChange>| -> Vec<String> {
        changes
            .take(LISTED)
            .map(|change| change.path.clone())
            .collect()
    };
    let open = changes.iter().filter(|change| !change.secret);
    let unsaved = UnsavedParameters {
        changed: open
            .map(|change| (change.path.clone(), change.new.to_json()))
            .collect(),
        unkept: paths(&mut changes.iter().filter(|change| change.secret)),
    };
    let line = rpc::notification(&ComponentMessage::Parameters(unsaved.clone()));
    if line.len() + MARGIN > LIMIT {
        return UnsavedParameters {
            changed: Map::new(),
            unkept: paths(&mut changes.iter()),
        };
    }
    unsaved
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_configuration::model::Value as Parameter;
    use rc_management::component::{ClockKind, ClockStatus};

    fn change(path: &str, new: Parameter, secret: bool) -> ParamChange {
        ParamChange {
            path: path.to_owned(),
            old: Parameter::Text(String::new()),
            new,
            secret,
        }
    }

    #[test]
    fn a_secret_does_not_leave_the_process() {
        let text = |text: &str| Parameter::Text(text.to_owned());
        let sent = unsaved(&[
            change("token", text("hush"), true),
            change("name", text("left"), false),
        ]);
        let changed = Map::from_iter([("name".to_owned(), "left".into())]);
        let unkept = vec!["token".to_owned()];
        assert_eq!(sent, UnsavedParameters { changed, unkept });
    }

    /// A heartbeat that its reader drops would be missed, and the component taken for hung.
    #[test]
    fn a_heartbeat_of_any_number_of_slots_reaches_the_supervisor() {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        let mut link = Link::new(ours).expect("a link");
        let slot = |at: usize| (format!("slot_with_a_rather_long_name_{at}"), at);
        let heartbeat = Heartbeat {
            age_ms: 7,
            peers: (0..4000).map(slot).collect(),
            clock: Some(Box::new(ClockStatus {
                kind: ClockKind::Simulated,
                time_s: 1.0,
                tick: 1,
                lost_ms: Some(900),
                followers: Vec::new(),
                waiting_for: (0..4000).map(|at| format!("follower_{at}")).collect(),
            })),
            ..Heartbeat::default()
        };
        link.send_heartbeat(heartbeat);
        let (mut lines, mut read) = (Lines::new(Overlong::Count), Vec::new());
        while read.is_empty() {
            read = lines.read(&theirs).0;
            link.write();
        }
        let message = read[0].bytes().map(ComponentMessage::decode);
        let Some(Ok(ComponentMessage::Heartbeat(heartbeat))) = message else {
            panic!("{message:?}");
        };
        assert_eq!((heartbeat.age_ms, heartbeat.peers.len()), (7, 0));
        assert!(heartbeat.mismatches[0].contains("ask for `status`"));
        // Problems of the time are still reported: leaving them out would mean that they are over.
        let clock = heartbeat.clock.expect("a clock");
        assert_eq!(
            (clock.lost_ms, clock.waiting_for.len()),
            (Some(900), LISTED)
        );
    }

    /// A supervisor that is stopped for minutes reads nothing until the socket is full.
    #[test]
    fn a_supervisor_that_was_stopped_learns_the_newest_state() {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        let mut link = Link::new(ours).expect("a link");
        while link.is_free() {
            link.send_heartbeat(Heartbeat::default());
        }
        link.set_state(State::Starting);
        link.set_state(State::Running);
        link.set_ready();
        let speed = |value: i64| change("speed", Parameter::Int(value), false);
        link.set_unsaved(&[speed(1)]);
        link.set_unsaved(&[speed(2)]);
        let mut lines = Lines::new(Overlong::Count);
        let mut levels = Vec::new();
        while !matches!(levels.last(), Some(ComponentMessage::Parameters(_))) {
            let read = lines.read(&theirs).0;
            let messages = read
                .iter()
                .map(|line| line.bytes().map(ComponentMessage::decode));
            for message in messages {
                match message {
                    Some(Ok(ComponentMessage::Heartbeat(_))) => {}
                    Some(Ok(level)) => levels.push(level),
                    wrong => panic!("{wrong:?}"),
                }
            }
            link.write();
        }
        let unsaved = unsaved(&[speed(2)]);
        let newest = [
            ComponentMessage::State {
                state: State::Running,
            },
            ComponentMessage::Ready,
            ComponentMessage::Parameters(unsaved),
        ];
        assert_eq!(levels, newest);
    }

    #[test]
    fn a_reason_of_any_length_reaches_the_supervisor() {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        let mut link = Link::new(ours).expect("a link");
        link.set_restored(Some(&"no ".repeat(LIMIT)));
        let read = Lines::new(Overlong::Count).read(&theirs).0;
        let message = read[0].bytes().map(ComponentMessage::decode);
        let Some(Ok(ComponentMessage::Restored { refused })) = message else {
            panic!("{message:?}");
        };
        assert!(refused.is_some_and(|reason| reason.starts_with("no no")));
    }

    #[test]
    fn values_that_are_too_long_for_a_line_are_listed_by_path() {
        let text = Parameter::Text("x".repeat(LIMIT));
        let sent = unsaved(&[change("long", text, false)]);
        let unkept = vec!["long".to_owned()];
        let changed = Map::new();
        assert_eq!(sent, UnsavedParameters { changed, unkept });
    }
}
