//! One process of a component: how it is started, heard, signalled and reaped. It decides nothing.

use crate::guard::process_registry::RegisteredProcess;
use crate::process::identity::{self, COMPONENT, Identity, MARK, Mark, kill_group};
use crate::process::realtime;
use rc_deploy_network::plan::Component;
use rc_management::agent::Exit;
use rc_management::lines::{Line, Lines, Overlong};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open};
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};

/// How many reads of the link are made after the process has ended.
const LAST_READS: usize = 16;

/// A process of this machine.
#[derive(Debug)]
pub(crate) struct LocalProcess {
    child: Child,
    pid: Pid,
    pidfd: OwnedFd,
    identity: Identity,
    link: Option<UnixStream>,
    lines: Lines,
}

impl LocalProcess {
    /// Starts the process, whose link begins with `greeting`; what it prints is appended to `log`. Its children are
    /// found by `run`, which is another one for each start.
    pub(crate) fn start(
        component: &Component,
        run: &str,
        greeting: Option<&str>,
        log: &Path,
        mark: &Mark,
    ) -> Result<Self, String> {
        let refused = |what: String, error: io::Error| format!("cannot {what}: {error}");
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(log)
            .map_err(|e| refused(format!("open {}", log.display()), e))?;
        let also_file = file
            .try_clone()
            .map_err(|e| refused("share its log".to_owned(), e))?;
        let (link, theirs) =
            UnixStream::pair().map_err(|e| refused("make its link".to_owned(), e))?;
        link.set_nonblocking(true)
            .map_err(|e| refused("set up its link".to_owned(), e))?;
        if let Some(line) = greeting {
            (&link)
                .write_all(line.as_bytes())
                .map_err(|e| refused("hand over its changed parameters".to_owned(), e))?;
        }
        // A wrong folder and a wrong program are the same error to the system.
        if !component.directory.is_dir() {
            return Err(format!(
                "its working directory {} does not exist",
                component.directory.display()
            ));
        }
        let mut command = Command::new(&component.executable);
        command
            .args(&component.args)
            .envs(&component.env)
            .env("RC_SUPERVISED", "1")
            .env(MARK, mark.value())
            .env(COMPONENT, run)
            .current_dir(&component.directory)
            .process_group(0)
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::from(file))
            .stderr(Stdio::from(also_file));
        let mut child = realtime::spawn(&mut command, &component.cpu, component.priority)?;
        // It still holds the component's end of the link.
        drop(command);
        let pid = Pid::from_child(&child);
        let pidfd = match pidfd_open(pid, PidfdFlags::empty()) {
            Ok(pidfd) => pidfd,
            Err(error) => {
                kill_group(pid);
                let _ = child.wait();
                return Err(refused("watch its process".to_owned(), error.into()));
            }
        };
        let raw = pid.as_raw_nonzero().get();
        // It may have ended already: then its time of start does not matter any more.
        let identity = Identity::of(raw).unwrap_or(Identity {
            pid: raw,
            starttime: 0,
        });
        Ok(Self {
            child,
            pid,
            pidfd,
            identity,
            link: Some(link),
            lines: Lines::new(Overlong::Skip),
        })
    }

    /// Becomes readable when the process ends.
    pub(crate) fn descriptor(&self) -> &OwnedFd {
        &self.pidfd
    }

    /// What the component speaks over, until it closes it.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        self.link.as_ref()
    }

    pub(crate) fn pid(&self) -> i32 {
        self.identity.pid
    }

    /// The process, for those that keep account of it.
    pub(crate) fn registered(&self, component: &Component) -> RegisteredProcess {
        RegisteredProcess {
            name: component.name.clone(),
            process: self.identity,
            stop_ms: component.stop.as_millis() as u64,
        }
    }

    /// Takes one read from the link.
    pub(crate) fn read_link(&mut self) -> Vec<Line> {
        let Some(link) = &self.link else {
            return Vec::new();
        };
        let (lines, closed) = self.lines.read(link);
        if closed {
            self.link = None;
        }
        lines
    }

    /// What is still on the link of a process that has ended.
    pub(crate) fn last_words(&mut self) -> Vec<Line> {
        let mut words = Vec::new();
        for _ in 0..LAST_READS {
            words.extend(self.read_link());
        }
        words
    }

    /// Asks the process to end.
    pub(crate) fn terminate(&self) {
        identity::signal(&self.pidfd, Signal::TERM);
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&self) {
        // The process is not reaped yet, so the number is still its own.
        kill_group(self.pid);
        identity::signal(&self.pidfd, Signal::KILL);
    }

    /// The process has ended: kills what is left of its group, and reaps it.
    pub(crate) fn reap(&mut self) -> Exit {
        // Before it is reaped: until then nobody else can get its pid as the number of a group.
        kill_group(self.pid);
        match self.child.wait() {
            Ok(status) => Exit {
                success: status.success(),
                signal: status.signal(),
                text: describe(status),
            },
            Err(error) => Exit::without_status(error.to_string()),
        }
    }
}

/// `exit status 1`, `signal 11 (SIGSEGV)`.
fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit status {code}"),
        (None, Some(signal)) if signal == Signal::BUS.as_raw() => {
            format!("signal {signal} (SIGBUS){}", shared_memory())
        }
        (None, Some(signal)) => match signal_hook::low_level::signal_name(signal) {
            Some(name) => format!("signal {signal} ({name})"),
            None => format!("signal {signal}"),
        },
        (None, None) => status.to_string(),
    }
}

/// What to do about a process that has met the end of the shared memory: the system has no other way to say so.
fn shared_memory() -> String {
    const PLACE: &str = "/dev/shm";
    let Ok(disk) = rustix::fs::statvfs(PLACE) else {
        return String::new();
    };
    let [all, free] = [disk.f_blocks, disk.f_bavail].map(|n| n * disk.f_frsize / 1000);
    format!(
        ", which is what happens where the shared memory is full: {PLACE} has {all} kB, of which {free} kB are free now; \
         `mount -o remount,size=1G {PLACE}` makes it larger, `--shm-size=1g` that of a container"
    )
}
