//! The process of a component on this machine: start, link, signals, end. It decides nothing.

use crate::guard::process_registry::RegisteredProcess;
use crate::process::descriptors;
use crate::process::identity::{self, COMPONENT, Identity, MARK, Mark, kill_group};
use crate::process::realtime;
use crate::process::tag::Tag;
use rc_deploy_client::error::with_owner;
use rc_deploy_client::logs;
use rc_deploy_network::plan::Component;
use rc_management::agent::Exit;
use rc_management::lines::{Line, Lines, Overlong};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open};
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

/// How many times the link is read after the process has ended.
const LAST_READS: usize = 16;

/// The exact recording of a component, beside its log. The recording of the run before keeps its
/// name with `.1`.
fn exact_recording(log: &Path) -> PathBuf {
    let path = log.with_extension("exact.mcap");
    // What a full disk left empty replaces no older recording.
    let holds_turn = rc_record::Reader::open(&path).is_ok_and(|mut file| file.next().is_some());
    if holds_turn {
        // Without it, the component overwrites the older recording.
        let _ = std::fs::rename(&path, log.with_extension("exact.1.mcap"));
    }
    path
}

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
    /// Starts the process. `greeting` is the first line on its link; its output is appended to
    /// `log`. `run` names this start, so that its child processes can be found.
    pub(crate) fn start(
        component: &Component,
        run: &str,
        greeting: Option<&str>,
        log: &Path,
        mark: &Mark,
    ) -> Result<Self, String> {
        let refused = |what: String, error: io::Error| format!("cannot {what}: {error}");
        // Somebody may have removed the folder while the network runs.
        let file = log.parent().map_or(Ok(()), logs::make_folder);
        let mut options = OpenOptions::new();
        let options = options.create(true).append(true);
        let file = file
            .and_then(|()| options.open(log))
            .map_err(|error| with_owner(log, error))
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
        // The system reports a wrong folder and a wrong program with the same error.
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
        if component.exact {
            command.arg("--record").arg(exact_recording(log));
        }
        let mut spawn = || realtime::spawn(&mut command, &component.cpu, component.priority);
        let mut child = match Tag::of(mark, run) {
            Some(tag) => tag.give(spawn),
            None => spawn(),
        }?;
        // The command holds the component's end of the link.
        drop(command);
        let pid = Pid::from_child(&child);
        descriptors::restore(pid);
        let pidfd = match pidfd_open(pid, PidfdFlags::empty()) {
            Ok(pidfd) => pidfd,
            Err(error) => {
                kill_group(pid);
                let _ = child.wait();
                return Err(refused("watch its process".to_owned(), error.into()));
            }
        };
        let raw = pid.as_raw_nonzero().get();
        // It may have ended already. Then its start time does not matter.
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
            lines: Lines::new(Overlong::Count),
        })
    }

    /// Becomes readable when the process ends.
    pub(crate) fn descriptor(&self) -> &OwnedFd {
        &self.pidfd
    }

    /// The socket of the link, until the component closes it.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        self.link.as_ref()
    }

    pub(crate) fn pid(&self) -> i32 {
        self.identity.pid
    }

    /// Describes the process for the registry of this machine.
    pub(crate) fn registered(&self, component: &Component) -> RegisteredProcess {
        RegisteredProcess {
            name: component.name.clone(),
            process: self.identity,
            stop_ms: component.stop.as_millis() as u64,
        }
    }

    /// Writes a line on the link, if there is room.
    pub(crate) fn send_line(&self, line: &str) {
        if let Some(mut link) = self.link.as_ref() {
            let _ = link.write_all(line.as_bytes());
        }
    }

    /// Reads once from the link.
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

    /// Reads the rest of the link after the process has ended.
    pub(crate) fn remaining_lines(&mut self) -> Vec<Line> {
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
        // The process is not reaped yet, so its pid cannot belong to another one.
        kill_group(self.pid);
        identity::signal(&self.pidfd, Signal::KILL);
    }

    /// Kills the rest of the group and reaps the process, which has ended.
    pub(crate) fn reap(&mut self) -> Exit {
        // Before it is reaped, because its pid cannot become the number of another group until
        // then.
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

/// Advice about SIGBUS, with which the system reports that the shared memory is full.
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

#[cfg(test)]
mod tests {
    use super::*;
    use rc_record::{Limits, Stamp, Writer};
    use std::collections::BTreeMap;

    #[test]
    fn a_recording_without_a_turn_replaces_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("a.log");
        let (path, older) = (
            folder.path().join("a.exact.mcap"),
            folder.path().join("a.exact.1.mcap"),
        );
        let mut writer = Writer::create(&path, Limits::default()).expect("to create");
        let channel = writer.channel("/a", "cdr", None, BTreeMap::new());
        let written = writer.write(channel, Stamp::default(), b"turn");
        written.and_then(|()| writer.finish()).expect("to write");
        let good = std::fs::read(&path).expect("to read");
        assert_eq!(exact_recording(&log), path);
        assert!(!path.exists());
        // The disk was full: nothing, or the beginning alone.
        for length in [0, 8, 40] {
            std::fs::write(&path, &good[..length]).expect("to write");
            assert_eq!(exact_recording(&log), path);
            assert_eq!(std::fs::read(&older).expect("to read"), good, "{length}");
        }
    }
}
