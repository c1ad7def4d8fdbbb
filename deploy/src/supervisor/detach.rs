//! `up --detach`: a supervisor in the background, and its report to the process that started it.

use crate::process::identity::first_readable;
use crate::remote;
use crate::supervisor::check;
use crate::supervisor::options::Outcome;
use rc_deploy_client::error::{Error, ErrorContext, with_owner};
use rc_deploy_client::logs;
use rc_deploy_network::plan::Plan;
use rc_management::lines::{Line, Lines, Overlong};
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The report of a supervisor in the background: one JSON line on its standard output.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StartReport {
    /// All components are ready.
    Up,
    /// The start failed with this message. Everything was stopped again.
    Failed(String),
}

/// The process that started this supervisor, as the supervisor sees it.
#[derive(Debug)]
pub(crate) struct Launcher(UnixStream);

impl Launcher {
    /// Takes standard output, which [`detach`] made a socket, and leaves the session of the
    /// terminal.
    pub(crate) fn inherited() -> io::Result<Self> {
        // A process that leads a group already is out of the terminal's reach, too.
        let _ = rustix::process::setsid();
        let descriptor = io::stdout().as_fd().try_clone_to_owned()?;
        let stream = UnixStream::from(descriptor);
        stream.set_write_timeout(Some(Duration::from_millis(200)))?;
        Ok(Self(stream))
    }

    /// Becomes readable when the launcher ends. The launcher never sends anything.
    pub(crate) fn descriptor(&self) -> &UnixStream {
        &self.0
    }

    pub(crate) fn up(self) {
        self.say(&StartReport::Up);
    }

    pub(crate) fn failed(self, message: &str) {
        self.say(&StartReport::Failed(message.to_owned()));
    }

    fn say(mut self, word: &StartReport) {
        if let Ok(line) = serde_json::to_string(word) {
            // The launcher may have ended.
            let _ = self.0.write_all((line + "\n").as_bytes());
        }
    }
}

/// Starts `command`, which has to call [`up`](fn@crate::supervisor::up::up) for the same plan with
/// [`Options::supervisor`](crate::Options), and waits until the network is up or has failed.
///
/// The outcome has the message of a failure; nothing is printed. A signal that ends this process
/// while it waits, such as Ctrl-C, stops the start.
pub fn detach(plan: &Plan, mut command: Command) -> Outcome {
    match start(plan, &mut command) {
        Ok(outcome) => outcome,
        Err(error) => Outcome::Refused(error),
    }
}

fn start(plan: &Plan, command: &mut Command) -> Result<Outcome, Error> {
    check::check(plan)?;
    let log_path = logs::file(&logs::open_directory(&plan.network)?, logs::SUPERVISOR);
    // The supervisor empties it when it has the network; until then, it may belong to another one.
    let log = File::options()
        .create(true)
        .append(true)
        .open(&log_path)
        .map_err(|error| with_owner(&log_path, error))
        .context(format!("open {}", log_path.display()))?;
    let (ours, theirs) = UnixStream::pair().context("make a socket for the supervisor")?;
    ours.set_nonblocking(true)
        .context("set up the socket for the supervisor")?;
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::from(OwnedFd::from(theirs)))
        .stderr(Stdio::from(log))
        .spawn()
        .context("start the supervisor")?;
    // The command holds its end of the socket open; without it, the end of the supervisor is seen.
    command.stdout(Stdio::null());
    let limit = start_limit(plan);
    let word = listen(OwnedFd::from(ours), limit);
    let message = match word {
        Some(StartReport::Up) => return Ok(Outcome::Done),
        Some(StartReport::Failed(message)) => {
            wait(&mut child, stop_limit(plan));
            message
        }
        None => {
            let ended = wait(&mut child, Duration::from_millis(500));
            let what = ended.unwrap_or_else(|| format!("said nothing for {limit:?}"));
            format!("the supervisor {what}; {}", logs::quote(&log_path))
        }
    };
    Ok(Outcome::Failed(message))
}

fn listen(socket: OwnedFd, limit: Duration) -> Option<StartReport> {
    let deadline = Instant::now() + limit;
    let mut lines = Lines::new(Overlong::Skip);
    let mut socket = socket;
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        first_readable([&socket], left)?;
        let stream = UnixStream::from(socket);
        let (complete, ended) = lines.read(&stream);
        for line in complete {
            if let Line::Complete(line) = line
                && let Ok(word) = serde_json::from_slice(&line)
            {
                return Some(word);
            }
        }
        if ended {
            return None;
        }
        socket = OwnedFd::from(stream);
    }
}

/// The longest time until an `up` of this plan has succeeded, or has failed and stopped everything.
fn start_limit(plan: &Plan) -> Duration {
    let components: Duration = plan.components.iter().map(|c| c.ready + c.stop).sum();
    let remote = plan.components.iter().any(|c| c.host.is_some());
    let hosts = if remote {
        remote::SET_UP_LIMIT
    } else {
        Duration::ZERO
    };
    components + hosts + Duration::from_secs(15)
}

/// The longest time until this plan has stopped.
pub(crate) fn stop_limit(plan: &Plan) -> Duration {
    let components: Duration = plan.components.iter().map(|c| c.stop).sum();
    components + Duration::from_secs(10)
}

/// How the supervisor ended, if it does within `limit`.
fn wait(child: &mut Child, limit: Duration) -> Option<String> {
    let process = pidfd_open(Pid::from_child(child), PidfdFlags::empty()).ok()?;
    first_readable([&process], limit)?;
    let status = child.wait().ok()?;
    Some(format!("ended with {status}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_deploy_network::plan::{Component, Host};
    use std::io::Read;

    fn plan(hosts: &[Option<&str>]) -> Plan {
        let components = hosts.iter().enumerate().map(|(at, host)| Component {
            ready: Duration::from_secs(100),
            stop: Duration::from_secs(7),
            host: host.map(|name| Host {
                name: name.to_owned(),
                address: name.to_owned(),
                user: None,
                workspace: None,
                elsewhere: None,
            }),
            ..Component::new(format!("c{at}"), "/bin/true", "/")
        });
        Plan::new("net", "net.ddsl", components)
    }

    #[test]
    fn limits_add_those_of_the_components() {
        let here = plan(&[None, None]);
        assert_eq!(start_limit(&here), Duration::from_secs(2 * 107 + 15));
        assert_eq!(stop_limit(&here), Duration::from_secs(2 * 7 + 10));
        let there = plan(&[None, Some("robot")]);
        let with_host = start_limit(&here) + remote::SET_UP_LIMIT;
        assert_eq!(start_limit(&there), with_host);
    }

    /// The answer that a launcher gets from a supervisor that reports this, and then ends.
    fn heard(say: impl FnOnce(UnixStream)) -> Option<StartReport> {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        ours.set_nonblocking(true).expect("a mode");
        say(theirs);
        listen(OwnedFd::from(ours), Duration::from_mins(1))
    }

    #[test]
    fn a_launcher_hears_how_the_start_went() {
        let up = heard(|theirs| Launcher(theirs).up());
        assert_eq!(up, Some(StartReport::Up));
        let failed = heard(|theirs| Launcher(theirs).failed("no motor"));
        assert_eq!(failed, Some(StartReport::Failed("no motor".to_owned())));
        let noise = heard(|mut theirs| {
            theirs.write_all(b"a library prints\n").expect("room");
            Launcher(theirs).up();
        });
        assert_eq!(noise, Some(StartReport::Up));
        assert_eq!(heard(drop), None);
        // One that says nothing for too long.
        let (ours, _theirs) = UnixStream::pair().expect("a pair");
        ours.set_nonblocking(true).expect("a mode");
        assert_eq!(listen(OwnedFd::from(ours), Duration::from_millis(1)), None);
    }

    #[test]
    fn the_end_of_a_launcher_is_noticed() {
        let (mut ours, theirs) = UnixStream::pair().expect("a pair");
        let launcher = Launcher(theirs);
        let descriptor = OwnedFd::from(launcher.descriptor().try_clone().expect("a copy"));
        assert!(first_readable([&descriptor], Duration::from_millis(1)).is_none());
        launcher.up();
        let mut text = [0; 5];
        ours.read_exact(&mut text).expect("a line");
        assert_eq!(&text, b"\"up\"\n");
        drop(ours);
        assert!(first_readable([&descriptor], Duration::from_mins(1)).is_some());
    }

    #[test]
    fn a_supervisor_that_ended_is_described() {
        let mut child = Command::new("false").spawn().expect("it starts");
        let how = wait(&mut child, Duration::from_mins(1));
        assert_eq!(how.as_deref(), Some("ended with exit status: 1"));
        let mut runs = Command::new("cat").stdin(Stdio::piped()).spawn();
        let runs = runs.as_mut().expect("it starts");
        assert_eq!(wait(runs, Duration::from_millis(1)), None);
        drop(runs.stdin.take());
        assert!(wait(runs, Duration::from_mins(1)).is_some());
    }
}
