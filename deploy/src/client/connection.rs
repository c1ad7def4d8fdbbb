//! The other end of the supervisor's socket: what `rcdeploy status`, `down`, `start`, `stop` and `restart` do.

use crate::client::lines::LIMIT;
use crate::client::names::check_name;
use crate::client::status::Status;
use crate::error::{Error, ErrorContext};
use crate::process::identity::KILL_LIMIT;
use crate::supervisor::commands::{CommandResult, Verb};
use crate::supervisor::control;
use rc_middleware::RunDirectory;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long the supervisor may take to answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(3);
/// How much longer a command is waited for than its components may take: the supervisor answers in any case.
const COMMAND_MARGIN: Duration = Duration::from_secs(10);
/// The longest answer: a status may be longer than a line of a component.
pub(crate) const ANSWER_LENGTH: usize = 64 * LIMIT;

/// What the supervisor of a network says of it.
pub fn status(network: &str) -> Result<Status, Error> {
    let mut connection = Connection::open(network)?;
    let answer = connection.ask("status")?;
    let status: Result<Status, _> = serde_json::from_value(answer.clone());
    let mut status = status.map_err(|_| connection.strange(&answer))?;
    status.look_at_the_file();
    Ok(status)
}

/// Stops a network, and waits until it is down, at most for `limit`.
pub fn down(network: &str, limit: Duration) -> Result<(), Error> {
    let deadline = Instant::now() + limit;
    let mut connection = Connection::open(network)?;
    connection.ask("down")?;
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(Error::NotDown {
                network: network.to_owned(),
                limit,
            });
        }
        let mut rest = [0; 64];
        let stream = connection.stream.get_mut();
        stream
            .set_read_timeout(Some(left))
            .context("limit the time of a read")?;
        match stream.read(&mut rest) {
            Ok(0) => return Ok(()),
            // The supervisor was killed; its guard does the rest.
            Err(error) if error.kind() == ErrorKind::ConnectionReset => return Ok(()),
            _ => {}
        }
    }
}

/// Tells components or groups of a network to start, stop or restart, and waits until that is done, or cannot be.
///
/// The wait ends with the limits that the components have, and [`CommandResult`] says what did not come about.
pub fn command(network: &str, verb: Verb, names: &[String]) -> Result<CommandResult, Error> {
    let mut connection = Connection::open(network)?;
    let answer = connection.ask("status")?;
    let status = Status::deserialize(&answer).map_err(|_| connection.strange(&answer))?;
    let limits = status.components.iter().map(|c| c.ready_ms + c.stop_ms);
    let limits = Duration::from_millis(limits.sum());
    let killing = KILL_LIMIT * u32::try_from(status.components.len()).unwrap_or(u32::MAX);
    connection.limit(limits + killing + COMMAND_MARGIN)?;
    let answer = connection.request(verb.word(), &json!({ "names": names }))?;
    if let Some(result) = answer.get("result") {
        return CommandResult::deserialize(result).map_err(|_| connection.strange(&answer));
    }
    match answer["error"]["message"].as_str() {
        Some(reason) => Err(Error::Command(reason.to_owned())),
        None => Err(connection.strange(&answer)),
    }
}

/// The networks of this user whose supervisor answers.
pub fn networks() -> Vec<String> {
    let mut names = RunDirectory::networks();
    names.retain(|name| {
        check_name("network", name).is_ok()
            && UnixStream::connect(RunDirectory::of(name).socket(control::NAME)).is_ok()
    });
    names
}

/// The networks of this user that were started from this file, whatever stands in it by now, and whether it is there.
pub fn started_from(file: &Path) -> Vec<String> {
    let folder = file.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new(".")).canonicalize();
    let place = folder.map(|folder| folder.join(file.file_name().unwrap_or_default()));
    let places = [file.canonicalize(), place];
    let mut names = networks();
    names.retain(|name| {
        let from = status(name).map(|status| status.ddsl);
        from.is_ok_and(|from| places.iter().flatten().any(|place| *place == from))
    });
    names
}

/// A caller of the supervisor, or of the management of a component.
pub(crate) struct Connection {
    who: String,
    limit: Duration,
    stream: BufReader<UnixStream>,
}

impl Connection {
    fn open(network: &str) -> Result<Self, Error> {
        check_name("network", network)?;
        let who = format!("the supervisor of network {network}");
        let path = RunDirectory::of(network).socket(control::NAME);
        let there = Self::to(&path, who, ANSWER_LIMIT)?;
        there.ok_or_else(|| Error::NotUp {
            network: network.to_owned(),
            others: networks(),
        })
    }

    /// Connects to a socket, whose answers may each take `limit`; none where nobody listens.
    pub(crate) fn to(path: &Path, who: String, limit: Duration) -> Result<Option<Self>, Error> {
        let stream = match UnixStream::connect(path) {
            Ok(stream) => stream,
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::NotFound | ErrorKind::ConnectionRefused
                ) =>
            {
                return Ok(None);
            }
            Err(error) => {
                return Err(error).context(format!("connect to {}", path.display()));
            }
        };
        stream
            .set_read_timeout(Some(limit))
            .and_then(|()| stream.set_write_timeout(Some(limit)))
            .context("limit the time of a call")?;
        Ok(Some(Self {
            who,
            limit,
            stream: BufReader::new(stream),
        }))
    }

    /// Answers may each take so long from now on.
    fn limit(&mut self, limit: Duration) -> Result<(), Error> {
        self.limit = limit;
        let stream = self.stream.get_ref();
        stream
            .set_read_timeout(Some(limit))
            .context("limit the time of a read")
    }

    fn ask(&mut self, method: &str) -> Result<Value, Error> {
        let answer = self.request(method, &json!({}))?;
        match answer.get("result") {
            Some(result) => Ok(result.clone()),
            None => Err(self.strange(&answer)),
        }
    }

    /// The whole answer to a request, with its `result` or its `error`.
    pub(crate) fn request(&mut self, method: &str, params: &Value) -> Result<Value, Error> {
        let request = json!({"jsonrpc": "2.0", "id": 1, "method": method, "params": params});
        let line = format!("{request}\n");
        let what = format!("talk to {}", self.who);
        self.stream
            .get_mut()
            .write_all(line.as_bytes())
            .context(&what)?;
        let mut line = String::new();
        (&mut self.stream)
            .take(ANSWER_LENGTH as u64)
            .read_line(&mut line)
            .map_err(|error| self.unheard(error, &what))?;
        Ok(serde_json::from_str(&line).unwrap_or(Value::String(line)))
    }

    fn unheard(&self, source: io::Error, what: &str) -> Error {
        match source.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => Error::Silent {
                who: self.who.clone(),
                limit: self.limit,
            },
            _ => Error::System {
                action: what.to_owned(),
                source,
            },
        }
    }

    /// The error of an answer that cannot be understood.
    pub(crate) fn strange(&self, answer: &Value) -> Error {
        let mut answer = answer.to_string();
        if let Some((end, _)) = answer.char_indices().nth(200) {
            answer.truncate(end);
        }
        Error::Protocol {
            who: self.who.clone(),
            answer,
        }
    }
}
