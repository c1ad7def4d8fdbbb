//! Errors of commands, each with what to do about it.

use std::fmt::Arguments;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

/// Prints an error or a note for people on standard error.
pub fn print_error(text: Arguments<'_>) {
    rc_diagnostics::print::error(text);
}

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The plan contradicts itself, or a name is not allowed.
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
    /// A supervisor in another pid namespace runs this network.
    #[error(
        "network {network} is up in another pid namespace, such as a container, which uses the same folder {}{}; \
         end it there with `rcdeploy down {network}`, or set another XDG_RUNTIME_DIR here",
        directory.display(), pid.map_or_else(String::new, |pid| format!(" (its supervisor is process {pid} there)"))
    )]
    OtherNamespace {
        /// The network.
        network: String,
        /// The shared run directory.
        directory: std::path::PathBuf,
        /// The supervisor, in its namespace.
        pid: Option<i32>,
    },
    /// The supervisor ended, but its guard still holds the network.
    #[error(
        "network {network} is still being cleaned up after its supervisor ended; {}",
        unfinished(*guard, *is_stopped)
    )]
    CleaningUp {
        /// The network.
        network: String,
        /// The pid of the guard that cleans up, if it is known.
        guard: Option<i32>,
        /// Whether the guard is stopped (SIGSTOP, a debugger).
        is_stopped: bool,
    },
    /// No supervisor replies for this network.
    #[error("network {network} is not up{}", named(.others))]
    NotUp {
        /// The network.
        network: String,
        /// The networks that are up.
        others: Vec<String>,
    },
    /// The network did not stop in time.
    #[error(
        "network {network} is still stopping after {limit:?}; `rcdeploy status {network}` shows which components are left"
    )]
    NotDown {
        /// The network.
        network: String,
        /// How long the command waited.
        limit: Duration,
    },
    /// The guard process does not start.
    #[error("the guard process does not start: {0}")]
    Guard(String),
    /// No component with this name runs in the network.
    #[error("no component {name} runs in network {network}{}", running(.others))]
    NoComponent {
        /// The network.
        network: String,
        /// The component.
        name: String,
        /// The components that run in it.
        others: Vec<String>,
    },
    /// A component refuses a request.
    #[error("{name} refuses:{}", behind(.reason))]
    Refused {
        /// The component.
        name: String,
        /// Why.
        reason: String,
    },
    /// The supervisor refuses a command, for example an unknown name.
    #[error("{0}")]
    Command(String),
    /// A component failed to carry out a request.
    #[error("{name}:{}", behind(.reason))]
    Failed {
        /// The component.
        name: String,
        /// Why.
        reason: String,
    },
    /// Standard input has no secret.
    #[error("there is no secret at standard input; give it as one line")]
    NoSecret,
    /// The other side did not reply in time.
    #[error("{peer} has not replied within {limit:?}; its process may be stopped or hang")]
    Silent {
        /// The supervisor or component.
        peer: String,
        /// How long the command waited.
        limit: Duration,
    },
    /// This version does not understand a reply.
    #[error("{peer} replied {reply}; it may be another version")]
    Protocol {
        /// The supervisor or component.
        peer: String,
        /// The reply, shortened.
        reply: String,
    },
    /// There is no log to show.
    #[error("there is no log {what}; {help}")]
    NoLog {
        /// The file or folder.
        what: String,
        /// The nearest name that has one, or all such names.
        help: String,
    },
    /// A component that was started by hand prints to a terminal or a pipe.
    #[error(
        "{name} was started by hand and prints to {place}; let it print into a file to see its log here: `{name} … 2> {name}.log`"
    )]
    PrintsElsewhere {
        /// The component.
        name: String,
        /// Where it prints.
        place: String,
    },
    /// The system refused something.
    #[error("cannot {action}: {source}{}", advice(.source))]
    System {
        /// Failed action, a verb phrase after "cannot".
        action: String,
        /// The reason.
        source: io::Error,
    },
}

impl Error {
    /// The exit code of the command: 1 for a wrong plan, a refused command or change, and a missing
    /// secret; otherwise 3.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Plan(_) | Self::Command(_) | Self::Refused { .. } | Self::NoSecret => 1,
            Self::AlreadyUp { .. }
            | Self::OtherNamespace { .. }
            | Self::CleaningUp { .. }
            | Self::NotUp { .. }
            | Self::NotDown { .. }
            | Self::Guard(_)
            | Self::NoComponent { .. }
            | Self::Failed { .. }
            | Self::Silent { .. }
            | Self::Protocol { .. }
            | Self::NoLog { .. }
            | Self::PrintsElsewhere { .. }
            | Self::System { .. } => 3,
        }
    }
}

/// An error about a path, with the owner and what to do if the path, or the folder that it is in,
/// belongs to another user: `sudo` leaves files of root.
pub fn with_owner(path: &Path, error: io::Error) -> io::Error {
    if error.kind() != io::ErrorKind::PermissionDenied {
        return error;
    }
    let own = rustix::process::getuid().as_raw();
    let found = path.ancestors().take(2).find_map(|path| {
        let owner = std::fs::symlink_metadata(path).ok()?.uid();
        (owner != own).then_some((path, owner))
    });
    let Some((path, owner)) = found else {
        return error;
    };
    let (owner, path) = (rc_middleware::user_name(owner), path.display());
    let advice = format!("{path} belongs to user {owner}: `sudo rm -r {path}` removes it");
    io::Error::new(error.kind(), format!("{error}; {advice}"))
}

/// Advice for a clean-up that does not end.
fn unfinished(guard: Option<i32>, is_stopped: bool) -> String {
    match guard {
        Some(pid) if is_stopped => format!(
            "the process that does it, its guard, is stopped: continue it (`kill -CONT {pid}`), or end it (`kill -KILL {pid}`) and the next `up` cleans up"
        ),
        Some(pid) => format!(
            "try again in a moment, or end its guard (`kill -KILL {pid}`) and the next `up` cleans up"
        ),
        None => "try again in a moment".to_owned(),
    }
}

fn named(names: &[String]) -> String {
    if names.is_empty() {
        format!("; {}", crate::place::none_is_up())
    } else {
        format!("; these networks are up: {}", names.join(", "))
    }
}

fn running(names: &[String]) -> String {
    if names.is_empty() {
        "; nothing runs there".to_owned()
    } else {
        format!("; there are: {}", names.join(", "))
    }
}

/// A reason after a colon. A reason of several lines begins on the next line.
fn behind(reason: &str) -> String {
    if reason.starts_with('\n') {
        reason.to_owned()
    } else {
        format!(" {reason}")
    }
}

/// Advice about an error of the system.
pub fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; remove something there, or have other folders: logs are below XDG_STATE_HOME, sockets and locks below XDG_RUNTIME_DIR"
        }
        _ => "",
    }
}

/// Adds context to an error of the system, as in `.context("open the log")`.
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
