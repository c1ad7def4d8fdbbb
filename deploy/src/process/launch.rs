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
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open};
use std::cell::{OnceCell, RefCell};
use std::fs::{File, OpenOptions};
use std::io::{self, IoSlice, Write};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::rc::Rc;
use std::time::Duration;

/// How many times the link is read after the process has ended.
const LAST_READS: usize = 16;

/// The exact recording of a component, next to its log. The recording of the run before keeps its
/// name with `.1`.
fn exact_recording(log: &Path) -> PathBuf {
    let path = log.with_extension("exact.mcap");
    // A recording that a full disk left empty replaces no older one.
    let holds_turn = rc_record::Reader::open(&path).is_ok_and(|mut file| file.next().is_some());
    if holds_turn {
        // Without it, the component overwrites the older recording.
        let _ = std::fs::rename(&path, log.with_extension("exact.1.mcap"));
    }
    path
}

/// A process of this machine, as one of its components has it.
#[derive(Debug)]
pub(crate) struct LocalProcess {
    process: Rc<Spawned>,
    link: Option<UnixStream>,
    lines: Lines,
}

/// A process that was started. Its components share it.
#[derive(Debug)]
struct Spawned {
    child: RefCell<Child>,
    pid: Pid,
    pidfd: OwnedFd,
    identity: Identity,
    /// How it ended, once it is reaped.
    exit: OnceCell<Exit>,
    /// The link of the process, if its components have one each. It ends when this is closed.
    _link: Option<UnixStream>,
}

/// A component that starts: alone in its process, or as a thread of one.
#[derive(Debug)]
pub(crate) struct NewComponent<'a> {
    pub(crate) component: &'a Component,
    /// The first line on its link.
    pub(crate) greeting: Option<String>,
    pub(crate) log: &'a Path,
    /// The threads that must be ready before it starts, by their names of processes.
    pub(crate) after: Vec<String>,
}

/// Most components of one process: a message hands over at most 253 descriptors (unix(7)).
pub(crate) const MOST_THREADS: usize = 100;

impl LocalProcess {
    /// Starts a process with these components. If they are threads, they have the same executable
    /// and directory, and other output of the process is appended to `log`. `run` names this start,
    /// so that its child processes can be found.
    pub(crate) fn start(
        components: &[NewComponent<'_>],
        run: &str,
        log: &Path,
        mark: &Mark,
    ) -> Result<Vec<Self>, String> {
        match components {
            [] => Ok(Vec::new()),
            [only] if only.component.thread.is_none() => {
                Self::start_alone(only, run, mark).map(|process| vec![process])
            }
            [first, ..] => Self::start_threads(first, components, run, log, mark),
        }
    }

    fn start_alone(new: &NewComponent<'_>, run: &str, mark: &Mark) -> Result<Self, String> {
        let (component, log) = (new.component, new.log);
        let file = open_log(log)?;
        let (link, theirs) = new_link(new.greeting.as_deref())?;
        let mut command = command(component, file, theirs)?;
        command.args(&component.args).envs(&component.env);
        if component.exact {
            command.arg("--record").arg(exact_recording(log));
        }
        let (cpu, priority) = (&component.cpu, component.priority);
        let process = spawn(command, cpu, priority, mark, run, None)?;
        Ok(Self::new(Rc::new(process), link))
    }

    fn start_threads(
        first: &NewComponent<'_>,
        threads: &[NewComponent<'_>],
        run: &str,
        log: &Path,
        mark: &Mark,
    ) -> Result<Vec<Self>, String> {
        let (link, theirs) = new_link(None)?;
        let mut command = command(first.component, open_log(log)?, theirs)?;
        let mut links = Vec::new();
        let mut handed: Vec<OwnedFd> = Vec::new();
        for thread in threads {
            let component = thread.component;
            let word = component.thread.as_ref().map_or("", |own| &own.component);
            command.envs(&component.env);
            command.args(component.thread_arguments(word, &thread.after));
            if component.exact {
                command.arg("--record").arg(exact_recording(thread.log));
            }
            let (link, theirs) = new_link(thread.greeting.as_deref())?;
            links.push(link);
            handed.push(theirs.into());
            handed.push(open_log(thread.log)?.into());
        }
        hand_over(&link, &handed).map_err(|e| format!("cannot hand over its links: {e}"))?;
        drop(handed);
        let process = Rc::new(spawn(command, &[], None, mark, run, Some(link))?);
        let links = links.into_iter();
        Ok(links
            .map(|link| Self::new(Rc::clone(&process), link))
            .collect())
    }

    fn new(process: Rc<Spawned>, link: UnixStream) -> Self {
        Self {
            process,
            link: Some(link),
            lines: Lines::new(Overlong::Count),
        }
    }

    /// Becomes readable when the process ends.
    pub(crate) fn descriptor(&self) -> &OwnedFd {
        &self.process.pidfd
    }

    /// The socket of the link, until the component closes it.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        self.link.as_ref()
    }

    pub(crate) fn pid(&self) -> i32 {
        self.process.identity.pid
    }

    /// Describes the process for the registry of this machine.
    pub(crate) fn registered(&self, component: &Component, stop: Duration) -> RegisteredProcess {
        RegisteredProcess {
            name: component.process().to_owned(),
            process: self.process.identity,
            stop_ms: stop.as_millis() as u64,
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
        identity::signal(&self.process.pidfd, Signal::TERM);
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&self) {
        // The process is not reaped yet, so its pid cannot belong to another one.
        if self.process.exit.get().is_none() {
            kill_group(self.process.pid);
            identity::signal(&self.process.pidfd, Signal::KILL);
        }
    }

    /// Kills the rest of the group and reaps the process, which has ended.
    pub(crate) fn reap(&mut self) -> Exit {
        self.process.reap().clone()
    }
}

impl Spawned {
    fn reap(&self) -> &Exit {
        self.exit.get_or_init(|| {
            // Before it is reaped, because its pid cannot become the number of another group until
            // then.
            kill_group(self.pid);
            match self.child.borrow_mut().wait() {
                Ok(status) => Exit {
                    success: status.success(),
                    signal: status.signal(),
                    text: describe(status),
                },
                Err(error) => Exit::without_status(error.to_string()),
            }
        })
    }
}

/// Opens a log to append to it.
fn open_log(log: &Path) -> Result<File, String> {
    // Somebody may have removed the folder while the network runs.
    let folder = log.parent().map_or(Ok(()), logs::make_folder);
    let mut options = OpenOptions::new();
    let options = options.create(true).append(true);
    folder
        .and_then(|()| options.open(log))
        .map_err(|error| with_owner(log, error))
        .map_err(|error| format!("cannot open {}: {error}", log.display()))
}

/// A link, on which `greeting` is the first line: the end of the supervisor, and the other one.
fn new_link(greeting: Option<&str>) -> Result<(UnixStream, UnixStream), String> {
    let refused = |what: &str, error: io::Error| format!("cannot {what}: {error}");
    let (link, theirs) = UnixStream::pair().map_err(|e| refused("make its link", e))?;
    let made = link.set_nonblocking(true);
    made.map_err(|e| refused("set up its link", e))?;
    if let Some(line) = greeting {
        (&link)
            .write_all(line.as_bytes())
            .map_err(|e| refused("hand over its changed parameters", e))?;
    }
    Ok((link, theirs))
}

/// The command of a process, without its arguments and the environment of its components.
fn command(component: &Component, log: File, link: UnixStream) -> Result<Command, String> {
    let also = log.try_clone();
    let also = also.map_err(|e| format!("cannot share its log: {e}"))?;
    // The system reports a wrong folder and a wrong program with the same error.
    if !component.directory.is_dir() {
        return Err(format!(
            "its working directory {} does not exist",
            component.directory.display()
        ));
    }
    let mut command = Command::new(&component.executable);
    command
        .current_dir(&component.directory)
        .process_group(0)
        .stdin(Stdio::from(OwnedFd::from(link)))
        .stdout(Stdio::from(log))
        .stderr(Stdio::from(also));
    Ok(command)
}

/// Starts a process. It keeps `link` open as long as its components are known.
fn spawn(
    mut command: Command,
    cpu: &[u16],
    priority: Option<u8>,
    mark: &Mark,
    run: &str,
    link: Option<UnixStream>,
) -> Result<Spawned, String> {
    // Last: no variable of a component can replace one of these.
    command
        .env("RC_SUPERVISED", "1")
        .env(MARK, mark.value())
        .env(COMPONENT, run);
    let mut spawn = || realtime::spawn(&mut command, cpu, priority);
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
            return Err(format!("cannot watch its process: {error}"));
        }
    };
    let raw = pid.as_raw_nonzero().get();
    // It may have ended already. Then its start time does not matter.
    let identity = Identity::of(raw).unwrap_or(Identity {
        pid: raw,
        starttime: 0,
    });
    Ok(Spawned {
        child: RefCell::new(child),
        pid,
        pidfd,
        identity,
        exit: OnceCell::new(),
        _link: link,
    })
}

/// Hands the links and logs of threads over, in one message on the link of their process.
fn hand_over(link: &UnixStream, descriptors: &[OwnedFd]) -> io::Result<()> {
    let descriptors: Vec<BorrowedFd<'_>> = descriptors.iter().map(AsFd::as_fd).collect();
    let mut space = vec![MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(2 * MOST_THREADS))];
    let mut ancillary = SendAncillaryBuffer::new(&mut space);
    if !ancillary.push(SendAncillaryMessage::ScmRights(&descriptors)) {
        return Err(io::Error::other(format!(
            "a process has at most {MOST_THREADS} components"
        )));
    }
    let text = [IoSlice::new(b"\n")];
    sendmsg(link, &text, &mut ancillary, SendFlags::empty())?;
    Ok(())
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
