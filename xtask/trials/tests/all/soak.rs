//! A short soak: the requirements of `cargo xtask soak` hold for twenty seconds, and it detects
//! when they do not.

use crate::quiet;
use rc_middleware::RunDirectory;
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::RwLockReadGuard;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// The limit for a line and for the end.
const LIMIT: Duration = Duration::from_mins(1);

/// A running soak. A failing test kills it; its components then end, because nobody reads their
/// output.
struct Soak {
    child: Child,
    lines: Receiver<String>,
    /// The words of its first line: `network NAME, soak_source PID, soak_sink PID`.
    begin: Vec<String>,
    _quiet: RwLockReadGuard<'static, ()>,
}

impl Soak {
    fn start(words: &[&str]) -> Self {
        let quiet = quiet();
        let mut child = Command::new(env!("CARGO_BIN_EXE_trials"))
            .args(words)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        let mut soak = Self {
            child,
            lines,
            begin: Vec::new(),
            _quiet: quiet,
        };
        let begin = soak.line(LIMIT);
        soak.begin = begin
            .split([' ', ','])
            .filter(|word| !word.is_empty())
            .map(str::to_owned)
            .collect();
        assert_eq!(soak.begin.len(), 6, "{begin}");
        soak
    }

    fn line(&mut self, limit: Duration) -> String {
        match self.lines.recv_timeout(limit) {
            Ok(line) => line,
            Err(error) => panic!("no line: {error}; {}", self.errors()),
        }
    }

    fn signal(&self, who: Option<usize>, signal: Signal) {
        let pid = match who {
            Some(word) => Pid::from_raw(self.begin[word].parse().expect("a number")),
            None => Some(Pid::from_child(&self.child)),
        };
        kill_process(pid.expect("a process"), signal).expect("it runs");
    }

    /// Waits for the end: the last line, the errors and the exit code. Nothing may be left.
    fn end(mut self) -> (String, String, Option<i32>) {
        let mut last = String::new();
        while let Ok(line) = self.lines.recv_timeout(LIMIT) {
            last = line;
        }
        let errors = self.errors();
        let code = self.child.wait().expect("it ends").code();
        let directory = RunDirectory::of(&self.begin[1]);
        assert!(!directory.path().exists(), "{directory:?}");
        let left = rc_iceoryx2::leftovers(&directory);
        assert!(left.is_empty(), "{left:?}");
        (last, errors, code)
    }

    /// The output on stderr until the end, which this forces if necessary.
    fn errors(&mut self) -> String {
        if self.lines.recv_timeout(LIMIT) != Err(RecvTimeoutError::Disconnected) {
            let _ = self.child.kill();
        }
        let mut text = String::new();
        if let Some(mut errors) = self.child.stderr.take() {
            let _ = errors.read_to_string(&mut text);
        }
        text
    }
}

impl Drop for Soak {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn nothing_grows_and_nothing_is_lost() {
    nothing_grows(&["soak", "--smoke"]);
}

#[test]
fn nothing_grows_and_nothing_is_lost_over_dds() {
    nothing_grows(&["soak", "dds", "--smoke"]);
}

#[test]
fn nothing_grows_and_nothing_is_lost_over_ros() {
    nothing_grows(&["soak", "ros2", "--smoke"]);
}

/// A minute of simulated time lives again exactly.
#[test]
fn a_minute_of_the_patrol_replays_equal() {
    let ran = Command::new(env!("CARGO_BIN_EXE_trials"))
        .args(["soak", "replay", "--smoke"])
        .output()
        .expect("it runs");
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(0), "{errors}");
    let lines = String::from_utf8_lossy(&ran.stdout);
    assert_eq!(
        lines.matches(" results compared, equal, ").count(),
        4,
        "{lines}"
    );
}

fn nothing_grows(words: &[&str]) {
    let soak = Soak::start(words);
    let (last, errors, code) = soak.end();
    assert_eq!(code, Some(0), "{errors}{last}");
    assert!(
        last.starts_with("| soak, ") && last.ends_with("| met |"),
        "{last}"
    );
}

#[test]
fn a_sink_that_stands_still_is_noticed_and_a_signal_ends_it_in_order() {
    const SINK: usize = 5;
    let mut soak = Soak::start(&["soak", "--smoke"]);
    soak.line(LIMIT);
    soak.signal(Some(SINK), Signal::STOP);
    // There is time enough for a query to fail between the second and the third line.
    soak.line(LIMIT);
    soak.line(LIMIT);
    soak.signal(Some(SINK), Signal::CONT);
    soak.signal(None, Signal::INT);
    let (last, errors, code) = soak.end();
    assert_eq!(code, Some(3), "{errors}{last}");
    assert!(errors.contains("failed questions: "), "{errors}");
    assert!(last.ends_with("| **missed** |"), "{last}");
}
