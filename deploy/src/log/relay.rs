//! Shows log lines while `up` runs in the foreground.
//!
//! A write to a log wakes the supervisor, at most twenty times a second. Without writes, it does
//! nothing.

use crate::log::reporter::Reporter;
use rc_deploy_client::DirectoryWatch;
use rc_deploy_client::Follower;
use rc_management::event::{Event, Severity};
use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The shortest time between two reads.
const PAUSE: Duration = Duration::from_millis(50);
/// How many reads a log gets at the end, for its last lines.
const LAST_TURNS: usize = 8;

/// The logs of a network.
#[derive(Debug)]
pub(crate) struct Relay {
    watch: DirectoryWatch,
    logs: Vec<(String, Follower)>,
    /// When to read after a write.
    due: Option<Instant>,
}

impl Relay {
    /// Follows these logs, which exist and are empty.
    pub(crate) fn new(
        directory: &Path,
        logs: impl IntoIterator<Item = (String, PathBuf)>,
    ) -> io::Result<Self> {
        let watch = DirectoryWatch::new(directory)?;
        let logs = logs
            .into_iter()
            .map(|(name, path)| Ok((name, Follower::open(&path)?)))
            .collect::<io::Result<_>>()?;
        Ok(Self {
            watch,
            logs,
            due: None,
        })
    }

    /// Follows the logs in a folder that was made again. After an error, it tries again.
    pub(crate) fn restore(&mut self, directory: &Path) -> io::Result<()> {
        if self.watch.is_current(directory) {
            return Ok(());
        }
        let watch = DirectoryWatch::new(directory)?;
        for (name, log) in &mut self.logs {
            *log = Follower::open(&directory.join(format!("{name}.log")))?;
        }
        self.watch = watch;
        self.due = Some(Instant::now());
        Ok(())
    }

    /// Becomes readable after a write. There is none while a read is due.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        self.due.is_none().then(|| self.watch.descriptor())
    }

    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.due
    }

    /// Notes a write.
    pub(crate) fn wake(&mut self) {
        self.watch.drain();
        self.due.get_or_insert_with(|| Instant::now() + PAUSE);
    }

    /// Shows new lines if a read is due.
    pub(crate) fn show(&mut self, now: Instant, report: &Reporter) {
        if self.due.is_none_or(|due| now < due) {
            return;
        }
        self.due = None;
        self.watch.drain();
        for (name, log) in &mut self.logs {
            // Bytes without room wait in the log.
            let mut more = true;
            if report.has_room() {
                let lines;
                (lines, more) = log.read();
                for line in lines {
                    report.log_line(name, &line);
                }
            }
            if more {
                self.due = Some(now + PAUSE);
            }
        }
        // The next time, those go first that had to wait.
        if self.due.is_some() {
            self.logs.rotate_left(1);
        }
    }

    /// Shows the last lines.
    pub(crate) fn finish(&mut self, report: &Reporter) {
        for (name, log) in &mut self.logs {
            let mut more = true;
            for _ in 0..LAST_TURNS {
                if !more {
                    break;
                }
                let lines;
                (lines, more) = log.read();
                for line in lines {
                    report.log_line(name, &line);
                }
            }
            if let Some(line) = log.finish() {
                report.log_line(name, &line);
            }
            if more {
                let text = "printed more than could be shown; its log has it all";
                report.event(Event::component(name, Severity::Info, "log", text));
            }
        }
    }
}
