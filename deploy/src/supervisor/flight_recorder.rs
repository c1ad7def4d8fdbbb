//! The process that keeps the last messages of a network in memory, and writes them when a
//! component fails: `record { ring 60s; }`.

use crate::process::identity::{MARK, Mark};
use crate::process::own_program::own_program;
use rc_deploy_client::logs;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The pause before it is started again.
const PAUSE: Duration = Duration::from_secs(5);
/// After this time it has begun well: its end is a new one, and is said.
const SETTLED: Duration = Duration::from_secs(30);
/// How long its file may stay the same while it writes what it has at the end.
const STILL: Duration = Duration::from_secs(5);
/// How long it may take to write it in all. `rcdeploy down` waits for a minute.
const END: Duration = Duration::from_secs(45);
/// The pause between two looks whether it has ended.
const LOOK: Duration = Duration::from_millis(10);

/// The flight recorder of a network.
#[derive(Debug)]
pub(super) struct FlightRecorder {
    network: String,
    ring: Duration,
    folder: PathBuf,
    child: Option<Child>,
    /// When it is started.
    due: Option<Instant>,
    /// When it was started last.
    started: Option<Instant>,
    /// Whether its end was said, and it has not begun well since.
    has_ended: bool,
}

impl FlightRecorder {
    pub(super) fn new(network: &str, ring: Duration, folder: &Path) -> Self {
        Self {
            network: network.to_owned(),
            ring,
            folder: folder.to_owned(),
            child: None,
            due: None,
            started: None,
            has_ended: false,
        }
    }

    /// Lets it start at the next check.
    pub(super) fn begin(&mut self) {
        self.due = Some(Instant::now());
    }

    /// When to check it.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.due
    }

    /// Starts it if that is due, and finds out whether it has ended. Returns what went wrong.
    pub(super) fn check(&mut self, now: Instant, mark: &Mark) -> Option<String> {
        if let Some(child) = &mut self.child {
            let status = child.try_wait().ok()??;
            self.child = None;
            let log = self.log();
            return self.ended(now, || {
                format!(
                    "the recorder of the ring ended ({status}); see {}",
                    log.display()
                )
            });
        }
        if self.due.is_none_or(|due| now < due) {
            return None;
        }
        self.due = None;
        match self.start(mark) {
            Ok(child) => {
                self.child = Some(child);
                self.started = Some(now);
                None
            }
            Err(error) => self.ended(now, || {
                format!("the recorder of the ring cannot be started: {error}")
            }),
        }
    }

    /// Lets it start again after a pause. What is wrong is said once, until it has begun well.
    fn ended(&mut self, now: Instant, text: impl FnOnce() -> String) -> Option<String> {
        self.due = Some(now + PAUSE);
        let started = self.started.take();
        if started.is_some_and(|started| now.duration_since(started) >= SETTLED) {
            self.has_ended = false;
        }
        (!std::mem::replace(&mut self.has_ended, true)).then(text)
    }

    fn log(&self) -> PathBuf {
        logs::file(&self.folder, logs::RING)
    }

    fn start(&self, mark: &Mark) -> io::Result<Child> {
        let log = OpenOptions::new()
            .create(true)
            .append(true)
            .open(self.log())?;
        let mut command = Command::new(own_program()?);
        command
            .args(["record", "--supervised", "--ring"])
            .arg(format!("{}ms", self.ring.as_millis()))
            .arg("--output")
            .arg(self.folder.join(format!("{}.mcap", logs::RING)))
            .arg(&self.network)
            .env(MARK, mark.value())
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(log.try_clone()?)
            .stderr(log);
        let child = command.spawn()?;
        // A recorder that was stopped does not stop its supervisor.
        if let Some(input) = &child.stdin {
            rustix::io::ioctl_fionbio(input, true)?;
        }
        Ok(child)
    }

    /// Lets it write what it holds. Says whether it runs.
    pub(super) fn write(&mut self) -> bool {
        let input = self.child.as_mut().and_then(|child| child.stdin.as_mut());
        // A full pipe holds earlier requests, which mean the same.
        input.is_some_and(|input| match input.write_all(b"write\n") {
            Ok(()) => true,
            Err(error) => error.kind() == io::ErrorKind::WouldBlock,
        })
    }

    /// The bytes of the files that it has written.
    fn written(&self) -> u64 {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten();
        let own = entries.flatten().filter(|entry| {
            let name = entry.file_name();
            name.as_encoded_bytes().starts_with(logs::RING.as_bytes())
        });
        own.filter_map(|entry| Some(entry.metadata().ok()?.len()))
            .sum()
    }

    /// Ends it: it writes what was asked for, as long as it makes progress.
    pub(super) fn end(&mut self) {
        self.due = None;
        let Some(mut child) = self.child.take() else {
            return;
        };
        drop(child.stdin.take());
        let begun = Instant::now();
        let (mut size, mut grown) = (self.written(), begun);
        while begun.elapsed() < END && grown.elapsed() < STILL {
            if !matches!(child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(LOOK);
            let now = self.written();
            if now != size {
                (size, grown) = (now, Instant::now());
            }
        }
        let _ = child.kill();
        let _ = child.wait();
    }
}
