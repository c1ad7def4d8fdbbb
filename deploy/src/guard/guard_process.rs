//! The guard: a second process that ends the components and removes all traces if its supervisor is
//! killed.
//!
//! The supervisor reports each process over a socket, the guard's standard input. If the socket
//! closes without a farewell, the supervisor has ended unexpectedly. Components notice this through
//! their own links.

use crate::guard::lock::Lock;
use crate::guard::process_registry::{ProcessRegistry, RegisteredProcess};
use crate::process::identity::{Identity, Mark, first_readable};
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_client::error::{Error, ErrorContext, print_error};
use rc_management::lines::{self, Lines, Overlong};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open};
use serde::{Deserialize, Serialize};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// How long a guard may take to become ready.
const START_LIMIT: Duration = Duration::from_secs(5);
/// How long a write to the guard may take. A guard that does not read is replaced.
const WRITE_LIMIT: Duration = Duration::from_millis(200);
/// What the guard writes when it is ready: signals of the terminal do not reach it any more.
const GUARDING: &[u8] = b"guarding\n";

/// How the guard process is started: `PROGRAM ARGUMENTS… --network NETWORK`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuardCommand {
    /// The program. It must call [`guard()`](fn@guard).
    pub program: PathBuf,
    /// Its first arguments.
    pub args: Vec<String>,
}

impl GuardCommand {
    /// This program, with the argument `guard`.
    pub fn own() -> io::Result<Self> {
        Ok(Self {
            program: std::env::current_exe()?,
            args: vec!["guard".to_owned()],
        })
    }
}

/// The reports of a supervisor to its guard, one JSON line each.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Report {
    /// The first line.
    Network { mark: Mark },
    /// A component was started.
    Started(RegisteredProcess),
    /// One has ended, with its process group.
    Ended { pid: i32 },
    /// Everything is cleaned up. The guard has nothing to do.
    Farewell,
}

/// A running guard, as its supervisor sees it.
#[derive(Debug)]
pub(crate) struct Guard {
    started: Instant,
    child: Child,
    link: UnixStream,
    pidfd: OwnedFd,
}

impl Guard {
    /// Starts a guard, which shares the lock.
    pub(crate) fn start(
        command: &GuardCommand,
        network: &str,
        lock: &Lock,
        log: &Path,
        registry: &ProcessRegistry,
    ) -> Result<Self, Error> {
        let (link, theirs) = UnixStream::pair().context("make a socket for the guard")?;
        link.set_write_timeout(Some(WRITE_LIMIT))
            .context("limit the time of a write")?;
        let log = File::options()
            .create(true)
            .append(true)
            .open(log)
            .context(format!("open {}", log.display()))?;
        let child = Command::new(&command.program)
            .args(&command.args)
            .args(["--network", network])
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::from(lock.share().context("share the lock")?))
            .stderr(Stdio::from(log))
            .spawn()
            .map_err(|error| Error::Guard(format!("{}: {error}", command.program.display())))?;
        let pidfd = pidfd_open(Pid::from_child(&child), PidfdFlags::empty())
            .context("watch the guard process")?;
        let mut guard = Self {
            started: Instant::now(),
            child,
            link,
            pidfd,
        };
        let mark = registry.mark.clone();
        guard.tell(&Report::Network { mark });
        for component in &registry.components {
            guard.started(component);
        }
        Ok(guard)
    }

    /// Waits until the guard is ready.
    pub(crate) fn await_ready(&mut self) -> Result<(), Error> {
        let mut said = [0; GUARDING.len()];
        let read = self
            .link
            .set_read_timeout(Some(START_LIMIT))
            .and_then(|()| self.link.read_exact(&mut said));
        match read {
            Ok(()) if said == GUARDING => Ok(()),
            Ok(()) => Err(Error::Guard(
                "it is another program; does it know the argument `guard`?".to_owned(),
            )),
            Err(error) => Err(Error::Guard(error.to_string())),
        }
    }

    pub(crate) fn pid(&self) -> i32 {
        Pid::from_child(&self.child).as_raw_nonzero().get()
    }

    /// Becomes readable when the guard ends.
    pub(crate) fn descriptor(&self) -> &OwnedFd {
        &self.pidfd
    }

    /// How long it has lived.
    pub(crate) fn age(&self) -> Duration {
        self.started.elapsed()
    }

    /// How it ended. Call it after the descriptor is readable.
    pub(crate) fn reap(mut self) -> String {
        match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        }
    }

    pub(crate) fn started(&mut self, component: &RegisteredProcess) {
        self.tell(&Report::Started(component.clone()));
    }

    pub(crate) fn ended(&mut self, pid: i32) {
        self.tell(&Report::Ended { pid });
    }

    /// Dismisses the guard, and waits for its end.
    pub(crate) fn dismiss(mut self) {
        self.tell(&Report::Farewell);
        if first_readable([&self.pidfd], KILL_LIMIT).is_none() {
            self.kill();
        }
        if first_readable([&self.pidfd], KILL_LIMIT).is_some() {
            let _ = self.child.wait();
        }
    }

    fn tell(&mut self, report: &Report) {
        if self.link.write_all(&lines::encode(report)).is_err() {
            // It has ended, or it hangs. The supervisor notices the end and starts another one.
            self.kill();
        }
    }

    fn kill(&self) {
        crate::process::identity::signal(&self.pidfd, Signal::KILL);
    }
}

/// Runs the guard process: `rcdeploy guard --network NETWORK`, which people never type.
///
/// `cleanup` removes what the middleware keeps in memory for this network. It is also called if
/// there is nothing to remove.
pub fn guard(network: &str, cleanup: &dyn Fn()) -> ExitCode {
    match watch(network, cleanup) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_error(format_args!("guard of {network}: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

fn watch(network: &str, cleanup: &dyn Fn()) -> Result<(), Error> {
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::new(AtomicBool::new(false)))
            .context("ignore signals")?;
    }
    // Leaves the terminal. This fails only for a process group leader, which has left it already.
    let _ = rustix::process::setsid();
    let lock = Lock::inherited(network).context("take over the lock")?;
    let stdin = io::stdin()
        .as_fd()
        .try_clone_to_owned()
        .context("take over the supervisor's socket")?;
    let mut supervisor = UnixStream::from(stdin);
    match supervisor.write_all(GUARDING) {
        // A supervisor that was killed in the meantime: its reports can still be read.
        Err(error)
            if !matches!(
                error.kind(),
                ErrorKind::BrokenPipe | ErrorKind::ConnectionReset
            ) =>
        {
            return Err(error).context("answer the supervisor; only `rcdeploy up` starts `guard`");
        }
        _ => {}
    }
    let registry = match listen(&supervisor) {
        LinkEnd::Farewell => return Ok(()),
        // The supervisor was killed before its first report: nothing runs yet.
        LinkEnd::Gone(None) => return wipe(&lock, cleanup),
        LinkEnd::Gone(Some(registry)) => registry,
    };
    let names: Vec<&str> = registry
        .components
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    print_error(format_args!(
        "guard of {network} ({}): the supervisor is gone; components left: {}",
        Identity::own().map_or(0, |own| own.pid),
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    ));
    let killed = registry.end_all();
    print_error(format_args!(
        "guard of {network}: {killed} processes had to be killed"
    ));
    wipe(&lock, cleanup)
}

/// Removes the traces of the network, unless a new network has taken its place.
fn wipe(lock: &Lock, cleanup: &dyn Fn()) -> Result<(), Error> {
    if lock.is_current() {
        cleanup();
        lock.remove_directory()
            .context("remove the run directory")?;
    }
    Ok(())
}

/// How the reports of the supervisor ended.
enum LinkEnd {
    /// The supervisor has cleaned up itself.
    Farewell,
    /// The supervisor was killed. Its processes are in the registry.
    Gone(Option<ProcessRegistry>),
}

/// Reads the reports of the supervisor until they end.
fn listen(supervisor: &UnixStream) -> LinkEnd {
    let mut lines = Lines::new(Overlong::Skip);
    let mut registry: Option<ProcessRegistry> = None;
    loop {
        let (complete, ended) = lines.read(supervisor);
        for line in complete {
            let Some(text) = line.into_text() else {
                continue;
            };
            match (serde_json::from_str(&text), &mut registry) {
                (Ok(Report::Network { mark }), _) => registry = Some(ProcessRegistry::new(mark)),
                (Ok(Report::Started(component)), Some(registry)) => {
                    registry.components.push(component);
                }
                (Ok(Report::Ended { pid }), Some(registry)) => {
                    registry.components.retain(|c| c.process.pid != pid);
                }
                (Ok(Report::Farewell), _) => return LinkEnd::Farewell,
                (Ok(_), None) => {
                    print_error(format_args!("guard: a report before the network: {text}"));
                }
                // The supervisor was killed while it wrote this line.
                (Err(error), _) => print_error(format_args!("guard: {error} in {text}")),
            }
        }
        if ended {
            return LinkEnd::Gone(registry);
        }
    }
}
