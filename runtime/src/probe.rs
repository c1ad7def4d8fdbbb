//! `--probe`: asks a running component whether it is ready, for systemd, Compose, Kubernetes and
//! scripts.

use crate::lifecycle::LifecycleState;
use rc_management::component::{Request, State, Status};
use rc_management::{CallError, Client};
use rc_middleware::RunDirectory;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The limit for an answer, connecting included.
const LIMIT: Duration = Duration::from_secs(2);
/// The age of the last turn of a loop that hangs, as for rcdeploy.
const HUNG_MS: u64 = 2000;
/// The pause between two questions.
const RETRY_PAUSE: Duration = Duration::from_millis(50);

/// The result of a probe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ProbeResult {
    /// The component is ready, or has ended without an error while others of its process run.
    Ready(String),
    /// The component is there and not ready.
    NotReady(String),
    /// The component is not there.
    NotFound,
}

impl ProbeResult {
    /// The exit code.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Ready(_) => 0,
            Self::NotReady(_) => 1,
            Self::NotFound => 3,
        }
    }

    /// The result for people.
    pub(crate) fn text(&self) -> &str {
        match self {
            Self::Ready(text) | Self::NotReady(text) => text,
            Self::NotFound => "not there",
        }
    }
}

/// Asks components of one process, each with its network and its name, until all are ready, for at
/// most `wait` and one answer of each. A missing one counts as ready if another one says that it
/// has ended without an error.
pub(crate) fn probe(asked: &[(&str, &str)], wait: Duration) -> Vec<ProbeResult> {
    let sockets = asked.iter();
    let sockets = sockets.map(|(network, name)| RunDirectory::of(network).socket(name));
    let sockets: Vec<PathBuf> = sockets.collect();
    let end = Instant::now() + wait;
    loop {
        let mut done = Vec::new();
        let results = sockets.iter().map(|socket| match ask(socket) {
            Ok(status) => {
                let result = judge(status.state, status.lifecycle, status.age_ms);
                done.extend(status.done_beside);
                result
            }
            Err(result) => result,
        });
        let mut results: Vec<ProbeResult> = results.collect();
        for (result, (_, name)) in results.iter_mut().zip(asked) {
            if *result == ProbeResult::NotFound && done.iter().any(|one| one == name) {
                *result = ProbeResult::Ready("has ended in order".to_owned());
            }
        }
        let all_ready = results.iter().all(|result| result.code() == 0);
        if all_ready || Instant::now() >= end {
            return results;
        }
        std::thread::sleep(RETRY_PAUSE);
    }
}

/// The status of a component, or the result in its place.
fn ask(socket: &Path) -> Result<Status, ProbeResult> {
    let end = Instant::now() + LIMIT;
    let late = || ProbeResult::NotReady(format!("has not answered within {LIMIT:?}"));
    let client = Client::connect(socket, LIMIT);
    let mut client = client.map_err(|error| match error.kind() {
        ErrorKind::NotFound | ErrorKind::ConnectionRefused => ProbeResult::NotFound,
        ErrorKind::WouldBlock => late(),
        _ => ProbeResult::NotReady(format!("does not answer: {error}")),
    })?;
    let left = end.saturating_duration_since(Instant::now());
    let status = client.call(&Request::Status, left);
    status.map_err(|error| match error {
        CallError::TimedOut(_) => late(),
        CallError::Refused(_) | CallError::Unexpected(_) => {
            ProbeResult::NotReady("answers, but not as a component".to_owned())
        }
        error @ (CallError::Io(_) | CallError::Closed) => {
            ProbeResult::NotReady(format!("does not answer: {error}"))
        }
    })
}

/// A component in an emergency has been ready, and reports the emergency itself: it is there for
/// others. A managed component is there for others while it is active.
fn judge(state: State, lifecycle: Option<LifecycleState>, age_ms: u64) -> ProbeResult {
    let idle = lifecycle.filter(|state| *state != LifecycleState::Active);
    match state {
        State::Running | State::Emergency if age_ms > HUNG_MS => {
            ProbeResult::NotReady(format!("hung: its loop has not turned for {age_ms} ms"))
        }
        State::Running | State::Emergency => match idle {
            Some(idle) => ProbeResult::NotReady(idle.to_string()),
            None => ProbeResult::Ready(state.to_string()),
        },
        State::Starting | State::Stopping => ProbeResult::NotReady(state.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::os::unix::net::UnixListener;

    #[test]
    fn liveness_depends_on_state_and_age_of_the_loop() {
        let code = |state: State, age: u64| judge(state, None, age).code();
        assert_eq!([code(State::Running, 9), code(State::Emergency, 9)], [0, 0]);
        assert_eq!(
            [
                code(State::Starting, 9),
                code(State::Stopping, 9),
                code(State::Running, 2001)
            ],
            [1, 1, 1]
        );
        let managed = |lifecycle| judge(State::Running, Some(lifecycle), 9);
        assert_eq!(managed(LifecycleState::Active).code(), 0);
        let inactive = ProbeResult::NotReady("inactive".to_owned());
        assert_eq!(managed(LifecycleState::Inactive), inactive);
    }

    #[test]
    fn an_absent_component_differs_from_an_unresponsive_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let socket = folder.path().join("a.sock");
        let code = |socket: &Path| ask(socket).expect_err("no status").code();
        assert_eq!(code(&socket), 3);
        let listener = UnixListener::bind(&socket).expect("a socket");
        let start = Instant::now();
        assert_eq!(code(&socket), 1);
        assert!(start.elapsed() >= LIMIT);
        drop(listener);
        assert_eq!(code(&socket), 3);
    }

    #[test]
    fn a_reply_that_is_not_a_status_is_rejected() {
        let folder = tempfile::tempdir().expect("a folder");
        let socket = folder.path().join("a.sock");
        let listener = UnixListener::bind(&socket).expect("a socket");
        let server = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a client");
            stream
                .write_all(b"{\"id\":1,\"result\":null}\n")
                .expect("answered");
        });
        assert_eq!(ask(&socket).expect_err("no status").code(), 1);
        server.join().expect("the server");
    }
}
