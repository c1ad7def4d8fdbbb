//! `--probe`: asks a component that runs how it does, for what watches programs by a command (systemd, Compose,
//! Kubernetes, scripts).

use rc_middleware::RunDirectory;
use serde_json::Value;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// How long a component may take to answer, connecting included.
const LIMIT: Duration = Duration::from_secs(2);
/// A worker whose loop has not turned for so long hangs, as it does for rcdeploy.
const HUNG_MS: u64 = 2000;
/// How long is waited between two questions.
const RETRY_PAUSE: Duration = Duration::from_millis(50);
/// A longer answer is none of a component.
const LONGEST_ANSWER: u64 = 1 << 20;

/// What was found, with the exit code that says it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ProbeResult {
    /// It is ready: 0.
    Ready(String),
    /// It is there, and not ready: 1.
    NotReady(String),
    /// It is not there: 3.
    NotFound,
}

impl ProbeResult {
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Ready(_) => 0,
            Self::NotReady(_) => 1,
            Self::NotFound => 3,
        }
    }

    /// For people.
    pub(crate) fn text(&self) -> &str {
        match self {
            Self::Ready(text) | Self::NotReady(text) => text,
            Self::NotFound => "not there",
        }
    }
}

/// Asks the component `name` of `network`, again and again until it is ready, for at most `wait` and one answer.
pub(crate) fn probe(network: &str, name: &str, wait: Duration) -> ProbeResult {
    let socket = RunDirectory::of(network).socket(name);
    let end = Instant::now() + wait;
    loop {
        let result = probe_once(&socket);
        if matches!(result, ProbeResult::Ready(_)) || Instant::now() >= end {
            return result;
        }
        std::thread::sleep(RETRY_PAUSE);
    }
}

/// Asks once. To connect has no limit of its own, where a stopped process has a full queue, so a thread does it; it is
/// left behind with the process, which ends.
fn probe_once(socket: &Path) -> ProbeResult {
    let socket = socket.to_path_buf();
    let (answer, answered) = mpsc::sync_channel(1);
    let thread = std::thread::Builder::new().spawn(move || {
        let _ = answer.send(status(&socket));
    });
    if let Err(error) = thread {
        return ProbeResult::NotReady(format!("cannot be asked: {error}"));
    }
    match answered.recv_timeout(LIMIT) {
        Ok(Ok(status)) => judge(&status),
        Ok(Err(error)) => match error.kind() {
            ErrorKind::NotFound | ErrorKind::ConnectionRefused => ProbeResult::NotFound,
            _ => ProbeResult::NotReady(format!("does not answer: {error}")),
        },
        Err(_) => ProbeResult::NotReady(format!("has not answered within {LIMIT:?}")),
    }
}

fn status(socket: &Path) -> io::Result<Value> {
    let mut stream = UnixStream::connect(socket)?;
    stream.set_read_timeout(Some(LIMIT))?;
    stream.set_write_timeout(Some(LIMIT))?;
    stream.write_all(b"{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status\"}\n")?;
    let mut line = String::new();
    BufReader::new(stream)
        .take(LONGEST_ANSWER)
        .read_line(&mut line)?;
    let mut answer: Value = serde_json::from_str(&line)?;
    Ok(answer["result"].take())
}

/// What a status says. One in an emergency has been ready, and says so itself: it is there for others.
fn judge(status: &Value) -> ProbeResult {
    let state = status["state"].as_str().unwrap_or_default();
    let age = status["age_ms"].as_u64().unwrap_or_default();
    match state {
        "running" | "emergency" if age > HUNG_MS => {
            ProbeResult::NotReady(format!("hung: its loop has not turned for {age} ms"))
        }
        "running" | "emergency" => ProbeResult::Ready(state.to_owned()),
        "starting" | "stopping" => ProbeResult::NotReady(state.to_owned()),
        _ => ProbeResult::NotReady("answers, but not as a component".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::os::unix::net::UnixListener;

    #[test]
    fn the_state_and_the_age_of_the_loop_decide() {
        let code = |state: &str, age: u64| judge(&json!({ "state": state, "age_ms": age })).code();
        assert_eq!([code("running", 9), code("emergency", 9)], [0, 0]);
        assert_eq!(
            [
                code("starting", 9),
                code("stopping", 9),
                code("running", 2001)
            ],
            [1, 1, 1]
        );
        assert_eq!(judge(&Value::Null).code(), 1);
    }

    #[test]
    fn who_is_not_there_and_who_does_not_answer_are_told_apart() {
        let folder = tempfile::tempdir().expect("a folder");
        let socket = folder.path().join("a.sock");
        assert_eq!(probe_once(&socket), ProbeResult::NotFound);
        let listener = UnixListener::bind(&socket).expect("a socket");
        let start = Instant::now();
        assert_eq!(probe_once(&socket).code(), 1);
        assert!(start.elapsed() >= LIMIT);
        drop(listener);
        assert_eq!(probe_once(&socket), ProbeResult::NotFound);
    }
}
