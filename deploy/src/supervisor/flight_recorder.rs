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
/// How long its file may stay unchanged while it writes its memory at the end.
const STILL: Duration = Duration::from_secs(5);
/// How long it may take to write it in all. `rcdeploy down` waits for a minute.
const END: Duration = Duration::from_secs(45);
/// The pause between two looks whether it has ended.
const LOOK: Duration = Duration::from_millis(10);

/// A change of the recorder that is reported.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum RecorderChange {
    /// It has ended, or cannot be started. The text says why.
    Ended(String),
    /// It has begun well again.
    Back,
}

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
    /// Whether it was asked to end, so that it starts again.
    renewing: bool,
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
            renewing: false,
        }
    }

    /// Lets it start at the next check.
    pub(super) fn begin(&mut self) {
        self.due = Some(Instant::now());
    }

    /// When to check it.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.due.or_else(|| self.settles())
    }

    /// When its earlier end is over.
    fn settles(&self) -> Option<Instant> {
        let started = self.started.filter(|_| self.has_ended);
        started.map(|started| started + SETTLED)
    }

    /// Starts it if that is due, and finds out whether it has ended, or has begun well.
    pub(super) fn check(&mut self, now: Instant, mark: &Mark) -> Option<RecorderChange> {
        if let Some(child) = &mut self.child {
            let Some(status) = child.try_wait().ok()? else {
                let is_back = self.settles().is_some_and(|at| now >= at);
                self.has_ended &= !is_back;
                return is_back.then_some(RecorderChange::Back);
            };
            self.child = None;
            if std::mem::take(&mut self.renewing) {
                self.due = Some(now + PAUSE);
                return None;
            }
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

    /// Lets it start again after a pause. A problem is reported once, until it has run well.
    fn ended(&mut self, now: Instant, text: impl FnOnce() -> String) -> Option<RecorderChange> {
        self.due = Some(now + PAUSE);
        let started = self.started.take();
        if started.is_some_and(|started| now.duration_since(started) >= SETTLED) {
            self.has_ended = false;
        }
        let is_new = !std::mem::replace(&mut self.has_ended, true);
        is_new.then(|| RecorderChange::Ended(text()))
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

    /// Lets it write its memory. Returns whether it runs.
    pub(super) fn write(&mut self) -> bool {
        let input = self.child.as_mut().and_then(|child| child.stdin.as_mut());
        // A full pipe holds earlier equal requests.
        input.is_some_and(|input| match input.write_all(b"write\n") {
            Ok(()) => true,
            Err(error) => error.kind() == io::ErrorKind::WouldBlock,
        })
    }

    /// Lets it end, so that it starts again and finds the new shared memory.
    pub(super) fn renew(&mut self) {
        if let Some(child) = &mut self.child {
            drop(child.stdin.take());
            self.renewing = true;
        }
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

    /// Ends it: it writes what was requested, as long as it makes progress.
    pub(super) fn end(&mut self) {
        self.end_within(END, STILL);
    }

    fn end_within(&mut self, limit: Duration, still: Duration) {
        self.due = None;
        let Some(mut child) = self.child.take() else {
            return;
        };
        drop(child.stdin.take());
        let begun = Instant::now();
        let (mut size, mut grown) = (self.written(), begun);
        while begun.elapsed() < limit && grown.elapsed() < still {
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

#[cfg(test)]
mod tests {
    use super::*;

    const RING: Duration = Duration::from_mins(1);

    /// A recorder whose process is this program.
    fn running(folder: &Path, program: &str, args: &[&str]) -> FlightRecorder {
        let mut recorder = FlightRecorder::new("net", RING, folder);
        let child = Command::new(program)
            .args(args)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn();
        let child = child.expect("it starts");
        let input = child.stdin.as_ref().expect("a pipe");
        rustix::io::ioctl_fionbio(input, true).expect("a mode");
        recorder.child = Some(child);
        recorder.started = Some(Instant::now());
        recorder
    }

    /// Checks it until it has ended.
    fn ended(recorder: &mut FlightRecorder, now: Instant) -> Option<RecorderChange> {
        let limit = Instant::now() + Duration::from_mins(1);
        while recorder.child.is_some() {
            assert!(Instant::now() < limit, "it does not end");
            let text = recorder.check(now, &Mark::none());
            if recorder.child.is_none() {
                return text;
            }
            std::thread::sleep(LOOK);
        }
        None
    }

    #[test]
    fn the_end_of_a_recorder_is_said_once_until_it_has_begun_well() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut recorder = running(folder.path(), "false", &[]);
        let now = Instant::now();
        let told = ended(&mut recorder, now).expect("a message");
        let log = folder.path().join("rcdeploy-ring.log");
        let text = format!(
            "the recorder of the ring ended (exit status: 1); see {}",
            log.display()
        );
        assert_eq!(told, RecorderChange::Ended(text));
        assert_eq!(recorder.deadline(), Some(now + PAUSE));
        for (ran, is_said) in [(SETTLED / 2, false), (SETTLED, true), (LOOK, false)] {
            let started = Instant::now();
            recorder.started = Some(started);
            let text = recorder.ended(started + ran, || "ended".to_owned());
            assert_eq!(text.is_some(), is_said, "{ran:?}");
        }
    }

    #[test]
    fn the_end_of_a_recorder_is_over_when_it_has_begun_well() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut recorder = running(folder.path(), "sleep", &["600"]);
        let started = recorder.started.expect("it runs");
        let mark = Mark::none();
        assert_eq!(recorder.check(started + SETTLED, &mark), None);
        recorder.has_ended = true;
        assert_eq!(recorder.deadline(), Some(started + SETTLED));
        assert_eq!(recorder.check(started + SETTLED / 2, &mark), None);
        let back = recorder.check(started + SETTLED, &mark);
        assert_eq!(back, Some(RecorderChange::Back));
        assert_eq!(recorder.check(started + SETTLED, &mark), None);
        assert_eq!(recorder.deadline(), None);
        recorder.end_within(LOOK, LOOK);
    }

    #[test]
    fn a_recorder_starts_when_it_is_due() {
        // Its log cannot be opened.
        let nowhere = Path::new("/nowhere/at all");
        let mut recorder = FlightRecorder::new("net", RING, nowhere);
        let now = Instant::now();
        assert_eq!(recorder.deadline(), None);
        assert_eq!(recorder.check(now, &Mark::none()), None);
        recorder.begin();
        let due = recorder.deadline().expect("a time");
        assert!(due >= now && due <= Instant::now());
        let early = due.checked_sub(LOOK).expect("a time");
        assert_eq!(recorder.check(early, &Mark::none()), None);
        assert_eq!(recorder.deadline(), Some(due));
        let told = recorder.check(due, &Mark::none());
        let Some(RecorderChange::Ended(text)) = told else {
            panic!("{told:?}")
        };
        let start = "the recorder of the ring cannot be started: ";
        assert!(text.starts_with(start), "{text}");
        assert_eq!(recorder.deadline(), Some(due + PAUSE));
    }

    #[test]
    fn a_recorder_is_asked_to_write_while_it_runs() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut none = FlightRecorder::new("net", RING, folder.path());
        assert!(!none.write());
        let mut ended = running(folder.path(), "true", &[]);
        ended
            .child
            .as_mut()
            .expect("a child")
            .wait()
            .expect("it ends");
        assert!(!ended.write());
        // One that does not read has the request already.
        let mut deaf = running(folder.path(), "sleep", &["600"]);
        for _ in 0..20_000 {
            assert!(deaf.write());
        }
        let child = deaf.child.as_mut().expect("a child");
        child.kill().expect("it runs");
        child.wait().expect("it ends");
    }

    #[test]
    fn a_recorder_ends_by_itself_or_is_killed() {
        let folder = tempfile::tempdir().expect("a folder");
        let marker = folder.path().join("marker");
        let script = "cat; touch \"$0\"";
        let marker_text = marker.to_str().expect("text");
        let mut recorder = running(folder.path(), "sh", &["-c", script, marker_text]);
        recorder.begin();
        let limit = Duration::from_mins(1);
        recorder.end_within(limit, limit);
        assert!(marker.exists() && recorder.deadline().is_none());
        assert!(recorder.child.is_none());
        for (whole, still) in [(LOOK, limit), (limit, LOOK)] {
            let mut deaf = running(folder.path(), "sleep", &["600"]);
            let pid = deaf.child.as_ref().expect("a child").id();
            let begun = Instant::now();
            deaf.end_within(whole, still);
            assert!(begun.elapsed() < limit);
            assert!(!Path::new(&format!("/proc/{pid}")).exists());
        }
    }

    #[test]
    fn what_a_recorder_has_written_is_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        let recorder = FlightRecorder::new("net", RING, folder.path());
        assert_eq!(recorder.written(), 0);
        for (name, bytes) in [
            ("rcdeploy-ring.mcap", 5),
            ("rcdeploy-ring_1.mcap", 7),
            ("a.log", 9),
        ] {
            std::fs::write(folder.path().join(name), vec![0; bytes]).expect("written");
        }
        assert_eq!(recorder.written(), 12);
    }
}
