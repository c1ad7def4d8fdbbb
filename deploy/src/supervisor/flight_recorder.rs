//! The process that keeps the last messages of a network in memory, and writes them when a component
//! fails: `record { ring 60s; }`.

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
/// How long it may take to write what it has at the end.
const END: Duration = Duration::from_secs(5);
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
}

impl FlightRecorder {
    pub(super) fn new(network: &str, ring: Duration, folder: &Path) -> Self {
        Self {
            network: network.to_owned(),
            ring,
            folder: folder.to_owned(),
            child: None,
            due: None,
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
            self.due = Some(now + PAUSE);
            return Some(format!(
                "the recorder of the ring ended ({status}); see {}",
                self.log().display()
            ));
        }
        if self.due.is_none_or(|due| now < due) {
            return None;
        }
        self.due = None;
        match self.start(mark) {
            Ok(child) => {
                self.child = Some(child);
                None
            }
            Err(error) => {
                self.due = Some(now + PAUSE);
                Some(format!(
                    "the recorder of the ring cannot be started: {error}"
                ))
            }
        }
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
        command.spawn()
    }

    /// Lets it write what it holds. Says whether it runs.
    pub(super) fn write(&mut self) -> bool {
        let input = self.child.as_mut().and_then(|child| child.stdin.as_mut());
        input.is_some_and(|input| input.write_all(b"write\n").is_ok())
    }

    /// Ends it: it writes what was asked for, and has a limit.
    pub(super) fn end(&mut self) {
        self.due = None;
        let Some(mut child) = self.child.take() else {
            return;
        };
        drop(child.stdin.take());
        let limit = Instant::now() + END;
        while Instant::now() < limit {
            if !matches!(child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(LOOK);
        }
        let _ = child.kill();
        let _ = child.wait();
    }
}
