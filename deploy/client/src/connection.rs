//! Calls of the supervisor: `status`, `down`, `start`, `stop` and `restart`.

use crate::chains::ChainsReport;
use crate::digest;
use crate::error::{Error, ErrorContext};
use crate::names::check_name;
use crate::place;
use rc_management::chains::Chains;
use rc_management::supervisor::{
    self, CommandResult, NetworkStatus, ParametersChanged, Request, Stopping, Verb,
};
use rc_management::{CallError, Client};
use rc_middleware::RunDirectory;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::time::{Duration, Instant};

/// How long the supervisor waits for a process after SIGKILL. Only a process that hangs in the
/// kernel takes longer.
pub const KILL_LIMIT: Duration = Duration::from_secs(2);
/// How long the supervisor may take to reply.
const ANSWER_LIMIT: Duration = Duration::from_secs(3);
/// How long a change of parameters of several components may take, with others before it.
const CHANGE_LIMIT: Duration = Duration::from_mins(1);
/// The margin beyond the limits of the components of a command: the supervisor replies in any case.
const COMMAND_MARGIN: Duration = Duration::from_secs(10);
/// How many characters of an unexpected reply an error shows.
const SHOWN: usize = 200;

/// Asks the supervisor of a network for its status.
pub fn status(network: &str) -> Result<NetworkStatus, Error> {
    let mut status = Connection::open(network)?.call(&Request::Status)?;
    digest::mark_changed(&mut status);
    Ok(status)
}

/// Stops a network, and waits until it is down, at most for `limit`.
pub fn down(network: &str, limit: Duration) -> Result<(), Error> {
    let deadline = Instant::now() + limit;
    let mut connection = Connection::open(network)?;
    let Stopping { .. } = connection.call(&Request::Down)?;
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        match connection.client.next(left) {
            // The supervisor has ended. If it was killed, its guard does the rest.
            Err(CallError::Closed) => return Ok(()),
            Err(CallError::TimedOut(_)) => {
                return Err(Error::NotDown {
                    network: network.to_owned(),
                    limit,
                });
            }
            Err(error) => return Err(connection.error(error)),
            Ok(_) => {}
        }
    }
}

/// Starts, stops or restarts components or groups of a network, and waits until that has succeeded
/// or failed.
///
/// The limits of the components bound the wait. [`CommandResult`] lists the components that failed.
pub fn command(network: &str, verb: Verb, names: &[String]) -> Result<CommandResult, Error> {
    let mut connection = Connection::open(network)?;
    let status: NetworkStatus = connection.call(&Request::Status)?;
    // A command of the life cycle takes up to two transitions.
    let limits = status.components.iter();
    let limits = limits.map(|c| 2 * c.ready_ms + c.stop_ms);
    let limits = Duration::from_millis(limits.sum());
    let killing = KILL_LIMIT * u32::try_from(status.components.len()).unwrap_or(u32::MAX);
    connection.limit = limits + killing + COMMAND_MARGIN;
    connection.call(&verb.request(names.to_vec()))
}

/// Changes parameters of several components, or such that rules of the network read: those of all
/// components, or none.
///
/// # Errors
/// No supervisor runs, a rule would be broken, or a component refuses its part.
pub fn set_parameters(
    network: &str,
    changes: BTreeMap<String, Map<String, Value>>,
) -> Result<ParametersChanged, Error> {
    let mut connection = Connection::open(network)?;
    connection.limit = CHANGE_LIMIT;
    connection.call(&Request::ParametersSet { changes })
}

/// Lets the recorder of a network's ring write what it holds.
pub fn write_ring(network: &str) -> Result<(), Error> {
    let CommandResult { .. } = Connection::open(network)?.call(&Request::Ring)?;
    Ok(())
}

/// The chains of a network, as its supervisor measures them. With `known`, also the messages that
/// came to the end: for each chain, those after the first `known` ones.
pub fn chains(network: &str, known: Option<Vec<u64>>) -> Result<ChainsReport, Error> {
    let Chains { chains } = Connection::open(network)?.call(&Request::Chains { known })?;
    Ok(ChainsReport {
        network: network.to_owned(),
        chains,
    })
}

/// The networks of this user whose supervisor replies: those in the run directory of this
/// environment; if there are none, those elsewhere.
pub fn networks() -> Vec<String> {
    let here = networks_here();
    if !here.is_empty() {
        return here;
    }
    // Any user may open sockets of these names, and let connections wait.
    let end = Instant::now() + ANSWER_LIMIT;
    let left = || end.saturating_duration_since(Instant::now());
    let names = place::networks().into_iter();
    names.filter(|name| runs_within(name, left())).collect()
}

/// The networks in the run directory of this environment whose supervisor replies.
pub fn networks_here() -> Vec<String> {
    RunDirectory::networks()
        .into_iter()
        .filter(|name| runs(name))
        .collect()
}

fn runs(name: &str) -> bool {
    runs_within(name, ANSWER_LIMIT)
}

fn runs_within(name: &str, limit: Duration) -> bool {
    check_name("network", name).is_ok() && place::connect(name, limit).is_ok()
}

/// Whether a process listens on a socket.
pub(crate) fn is_listening(path: &Path) -> bool {
    Client::connect(path, ANSWER_LIMIT).is_ok()
}

/// The networks of this user that were started from this file, which may have changed or been
/// deleted.
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

/// A connection to a supervisor or a component, for calls.
pub(crate) struct Connection {
    /// The other side, for errors.
    peer: String,
    /// The limit for a reply.
    limit: Duration,
    client: Client,
}

impl Connection {
    fn open(network: &str) -> Result<Self, Error> {
        check_name("network", network)?;
        let peer = format!("the supervisor of network {network}");
        let client = place::connect(network, ANSWER_LIMIT);
        let connection = Self::with(client, peer, ANSWER_LIMIT, || {
            let path = RunDirectory::of(network).socket(supervisor::SOCKET);
            path.display().to_string()
        })?;
        connection.ok_or_else(|| Error::NotUp {
            network: network.to_owned(),
            others: networks(),
        })
    }

    /// Connects to a socket. Each reply may take `limit`. The result is none if no process listens.
    pub(crate) fn to(path: &Path, peer: String, limit: Duration) -> Result<Option<Self>, Error> {
        Self::with(Client::connect(path, limit), peer, limit, || {
            path.display().to_string()
        })
    }

    fn with(
        client: io::Result<Client>,
        peer: String,
        limit: Duration,
        place: impl FnOnce() -> String,
    ) -> Result<Option<Self>, Error> {
        match client {
            Ok(client) => Ok(Some(Self {
                peer,
                limit,
                client,
            })),
            Err(error) if place::is_absent(&error) => Ok(None),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                Err(Error::Silent { peer, limit })
            }
            Err(error) => Err(error).context(format!("connect to {}", place())),
        }
    }

    fn call<T: DeserializeOwned>(&mut self, request: &impl Serialize) -> Result<T, Error> {
        self.request(request).map_err(|error| self.error(error))
    }

    /// Sends a request and waits for the reply.
    pub(crate) fn request<T: DeserializeOwned>(
        &mut self,
        request: &impl Serialize,
    ) -> Result<T, CallError> {
        self.client.call(request, self.limit)
    }

    /// A failed call as an error of a command.
    pub(crate) fn error(&self, error: CallError) -> Error {
        let peer = self.peer.clone();
        match error {
            CallError::Refused(error) => Error::Command(error.message),
            CallError::TimedOut(limit) => Error::Silent { peer, limit },
            CallError::Unexpected(reply) => Error::Protocol {
                peer,
                reply: reply.chars().take(SHOWN).collect(),
            },
            CallError::Closed => Error::Protocol {
                peer,
                reply: "nothing".to_owned(),
            },
            CallError::Io(source) => Error::System {
                action: format!("talk to {peer}"),
                source,
            },
        }
    }
}
