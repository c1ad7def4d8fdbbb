//! What can go wrong outside the components, each with what to do about it.

use std::fmt::Arguments;
use std::io::{self, Write};
use std::time::Duration;

/// Why a command of rcdeploy could not do its work.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The plan contradicts itself. Whoever made it should have seen that.
    #[error("{0}")]
    Plan(String),
    /// Another supervisor runs this network.
    #[error(
        "network {network} is already up, supervised by process {pid}; end it with `rcdeploy down {network}`"
    )]
    AlreadyUp {
        /// The network.
        network: String,
        /// The supervisor.
        pid: i32,
    },
    /// The supervisor ended, but its guard still holds the network.
    #[error(
        "network {network} is still being cleaned up after its supervisor ended; try again in a moment"
    )]
    CleaningUp {
        /// The network.
        network: String,
    },
    /// No supervisor answers for this network.
    #[error("network {network} is not up{}", named(.others))]
    NotUp {
        /// The network.
        network: String,
        /// The networks that are up.
        others: Vec<String>,
    },
    /// The supervisor was asked to stop, and is not done in time.
    #[error(
        "network {network} is still stopping after {limit:?}; `rcdeploy status {network}` shows which components are left"
    )]
    NotDown {
        /// The network.
        network: String,
        /// How long it was waited for.
        limit: Duration,
    },
    /// The second process, which cleans up after the supervisor, does not start.
    #[error("the guard process does not start: {0}")]
    Guard(String),
    /// No component of that name answers in this network.
    #[error("no component {name} runs in network {network}{}", running(.others))]
    NoComponent {
        /// The network.
        network: String,
        /// The component.
        name: String,
        /// Those that run in it.
        others: Vec<String>,
    },
    /// A component refuses what it is asked for.
    #[error("{name} refuses:{}", behind(.reason))]
    Refused {
        /// The component.
        name: String,
        /// Why.
        reason: String,
    },
    /// The supervisor refuses a command, as for a name that is none.
    #[error("{0}")]
    Command(String),
    /// A component cannot do what it is asked for.
    #[error("{name}:{}", behind(.reason))]
    Failed {
        /// The component.
        name: String,
        /// Why.
        reason: String,
    },
    /// A secret was to come from standard input.
    #[error("there is no secret at standard input; give it as one line")]
    NoSecret,
    /// No answer comes.
    #[error("{who} has not answered within {limit:?}; its process may be stopped or hang")]
    Silent {
        /// Who was asked.
        who: String,
        /// How long it was waited for.
        limit: Duration,
    },
    /// An answer is not what this version expects.
    #[error("{who} answers with {answer}; is it of another version?")]
    Protocol {
        /// Who gave it.
        who: String,
        /// What it said.
        answer: String,
    },
    /// There is no log to show.
    #[error("there is no log {what}; `rcdeploy status` names the components of a network")]
    NoLog {
        /// The file or folder.
        what: String,
    },
    /// The system refused something.
    #[error("cannot {action}: {source}{}", advice(.source))]
    System {
        /// What was tried, as in "cannot …".
        action: String,
        /// The reason.
        source: io::Error,
    },
}

impl Error {
    /// The exit code of the command: 1 for a wrong plan, a command or a change that is refused and a secret that is not there, else 3.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Plan(_) | Self::Command(_) | Self::Refused { .. } | Self::NoSecret => 1,
            _ => 3,
        }
    }
}

fn named(names: &[String]) -> String {
    if names.is_empty() {
        "; no network is".to_owned()
    } else {
        format!("; these are: {}", names.join(", "))
    }
}

fn running(names: &[String]) -> String {
    if names.is_empty() {
        "; nothing runs there".to_owned()
    } else {
        format!("; there are: {}", names.join(", "))
    }
}

/// A reason behind a colon; one of several lines begins on the next.
fn behind(reason: &str) -> String {
    if reason.starts_with('\n') {
        reason.to_owned()
    } else {
        format!(" {reason}")
    }
}

/// What to do about an error of the system that people can do something about.
pub fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; remove something there, or have other folders: logs are below XDG_STATE_HOME, sockets and locks below XDG_RUNTIME_DIR"
        }
        _ => "",
    }
}

/// Writes a line on standard error, which may be a log on a disk that is full, or a pipe that nobody reads:
/// `eprintln!` would panic.
pub fn print_error(line: Arguments<'_>) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Gives an error of the system its context, as in `.context("open the log")`.
pub trait ErrorContext<T> {
    /// Adds what was tried, as in "cannot …".
    ///
    /// # Errors
    ///
    /// [`Error::System`] in place of the error of the system.
    fn context(self, action: impl Into<String>) -> Result<T, Error>;
}

impl<T, E: Into<io::Error>> ErrorContext<T> for Result<T, E> {
    fn context(self, action: impl Into<String>) -> Result<T, Error> {
        self.map_err(|source| Error::System {
            action: action.into(),
            source: source.into(),
        })
    }
}
