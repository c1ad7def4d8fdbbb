//! A component that behaves as its arguments say: `NAME BEHAVIOUR [NUMBER…]`.
//!
//! It writes its actions to the file `RC_TEST_JOURNAL`, one line each: `NAME WHAT PID`.

use rc_management::lifecycle::{LifecycleState, Transition};
use rc_management::lines::{Line, Lines, Overlong};
use rc_management::link::SupervisorMessage;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

struct Program {
    name: String,
    link: UnixStream,
    signals: UnixStream,
}

impl Program {
    fn journal(&self, what: &str, pid: u32) {
        let Some(path) = std::env::var_os("RC_TEST_JOURNAL") else {
            return;
        };
        let line = format!("{} {what} {pid}\n", self.name);
        let file = File::options().append(true).create(true).open(path);
        let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
    }

    /// How often a program with this name has noted something.
    fn noted(&self, what: &str) -> usize {
        let path = std::env::var_os("RC_TEST_JOURNAL").unwrap_or_default();
        let journal = std::fs::read_to_string(path).unwrap_or_default();
        let own = format!("{} {what} ", self.name);
        journal.lines().filter(|l| l.starts_with(&own)).count()
    }

    fn note(&self, what: &str) {
        self.journal(what, std::process::id());
    }

    fn say(&self, line: &str) {
        let _ = (&self.link).write_all(format!("{line}\n").as_bytes());
    }

    fn notify(&self, method: &str, params: &str) {
        self.say(&format!(
            r#"{{"jsonrpc":"2.0","method":"{method}","params":{params}}}"#
        ));
    }

    fn ready(&self) {
        self.notify("state", r#"{"state":"running"}"#);
        self.note("ready");
        self.notify("ready", "{}");
    }

    /// Lives until SIGTERM, until the link closes, or for `time`; sends heartbeats with this age.
    /// If `deaf`, ignores SIGTERM and the link.
    fn live(&self, age: Option<u64>, deaf: bool, time: Option<u64>) {
        let end = time.map(|ms| Instant::now() + Duration::from_millis(ms));
        let mut beat = Instant::now();
        let mut linked = true;
        loop {
            let now = Instant::now();
            if end.is_some_and(|end| now >= end) {
                return;
            }
            if now >= beat {
                if let Some(age) = age {
                    self.notify("heartbeat", &format!(r#"{{"age_ms":{age}}}"#));
                }
                beat = now + Duration::from_millis(500);
            }
            let wake = end.map_or(beat, |end| end.min(beat));
            let timeout =
                Timespec::try_from(wake.saturating_duration_since(now)).expect("a short time");
            let mut polled = vec![PollFd::from_borrowed_fd(
                self.signals.as_fd(),
                PollFlags::IN,
            )];
            if linked {
                polled.push(PollFd::from_borrowed_fd(self.link.as_fd(), PollFlags::IN));
            }
            let _ = poll(&mut polled, Some(&timeout));
            let ready: Vec<bool> = polled.iter().map(|fd| !fd.revents().is_empty()).collect();
            if ready[0] {
                self.note("stop");
                let _ = (&self.signals).read(&mut [0; 8]);
                if !deaf {
                    return;
                }
            }
            if ready.get(1) == Some(&true) {
                self.note("orphan");
                linked = false;
                if !deaf {
                    return;
                }
            }
        }
    }
}

impl Program {
    /// Lives as a managed component. The hook of this number fails: 1 configure, 2 activate; 3
    /// kills the process in `activate`, 4 hangs there. The second `configure` of 5 lasts until the
    /// file `go` exists beside the journal; the second `activate` of 6 kills the process; once 7 is
    /// active, a tool begins a hook that does not end.
    fn manage(&self, fails: u64) {
        let mut lines = Lines::new(Overlong::Count);
        self.link.set_nonblocking(true).expect("a mode");
        self.signals.set_nonblocking(true).expect("a mode");
        let mut state = LifecycleState::Unconfigured;
        let mut beat = Instant::now();
        loop {
            if Instant::now() >= beat {
                let hangs = fails == 7 && state == LifecycleState::Active;
                if hangs {
                    self.notify("lifecycle", r#"{"state":"deactivating"}"#);
                }
                let age = if hangs { 60_000 } else { 0 };
                self.notify("heartbeat", &format!(r#"{{"age_ms":{age}}}"#));
                beat = Instant::now() + Duration::from_millis(500);
            }
            let pause = Timespec::try_from(Duration::from_millis(100)).expect("a short time");
            let mut polled = [&self.signals, &self.link]
                .map(|socket| PollFd::from_borrowed_fd(socket.as_fd(), PollFlags::IN));
            let _ = poll(&mut polled, Some(&pause));
            if (&self.signals).read(&mut [0; 8]).is_ok() {
                self.note("stop");
                let _ = self.go(&mut state, LifecycleState::Finalized, 0);
                return;
            }
            let (read, closed) = lines.read(&self.link);
            for line in read.iter().filter_map(Line::bytes) {
                if let Some(SupervisorMessage::Lifecycle { number, goal }) =
                    SupervisorMessage::decode(line)
                {
                    let error = self.go(&mut state, goal, fails);
                    let error =
                        error.map_or(String::new(), |error| format!(r#","error":"{error}""#));
                    let report = format!(r#"{{"state":"{state}","done":{number}{error}}}"#);
                    self.notify("lifecycle", &report);
                }
            }
            if closed {
                self.note("orphan");
                return;
            }
        }
    }

    fn go(&self, state: &mut LifecycleState, goal: LifecycleState, fails: u64) -> Option<String> {
        while let Some(transition) = state.towards(goal) {
            self.note(transition.word());
            match (transition, fails) {
                (Transition::Configure, 1) | (Transition::Activate, 2) => {
                    return Some(format!("{transition}: no motor"));
                }
                (Transition::Activate, 3) => std::process::abort(),
                (Transition::Activate, 4) => std::thread::sleep(Duration::from_mins(1)),
                (Transition::Configure, 5) if self.noted("configure") > 1 => {
                    self.notify("lifecycle", r#"{"state":"configuring"}"#);
                    let journal = std::env::var_os("RC_TEST_JOURNAL").unwrap_or_default();
                    let go = PathBuf::from(journal).with_file_name("go");
                    while !go.exists() {
                        std::thread::sleep(Duration::from_millis(5));
                    }
                }
                (Transition::Activate, 6) if self.noted("activate") > 1 => std::process::abort(),
                _ => {}
            }
            *state = transition.goal();
            self.notify("lifecycle", &format!(r#"{{"state":"{state}"}}"#));
        }
        None
    }
}

#[expect(
    clippy::zombie_processes,
    reason = "leaving children behind is what it is for"
)]
fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_default();
    let behaviour = arguments.next().unwrap_or_default();
    let numbers: Vec<u64> = arguments.map(|a| a.parse().expect("a number")).collect();
    let number = |i: usize| numbers.get(i).copied().unwrap_or(0);
    let stdin = std::io::stdin()
        .as_fd()
        .try_clone_to_owned()
        .expect("a link");
    let (signals, write) = UnixStream::pair().expect("a pair");
    signal_hook::low_level::pipe::register(signal_hook::consts::SIGTERM, write).expect("a handler");
    let program = Program {
        name,
        link: UnixStream::from(stdin),
        signals,
    };
    program.note("start");
    // `println!` would panic if the disk of the log is full.
    let _ = writeln!(std::io::stdout(), "{} says hello", program.name);
    let mut status = 0;
    match behaviour.as_str() {
        // NUMBER: milliseconds until it is ready.
        "well" => {
            std::thread::sleep(Duration::from_millis(number(0)));
            program.ready();
            program.live(Some(0), false, None);
        }
        // STATUS
        "exit" => {
            println!("{} is about to fail", program.name);
            status = number(0);
        }
        // HOOK…: the hook that fails, for each start; the last one for all others.
        "managed" => {
            program.notify("lifecycle", r#"{"state":"unconfigured"}"#);
            program.ready();
            let start = program.noted("start").min(numbers.len());
            program.manage(number(start.saturating_sub(1)));
        }
        "abort" => std::process::abort(),
        // Dies of SIGBUS, as at an access to full shared memory.
        "bus" => {
            let signal = rustix::process::Signal::BUS;
            // The first one ends the handler that the Rust runtime installs.
            for _ in 0..2 {
                let _ = rustix::process::kill_process(rustix::process::getpid(), signal);
            }
        }
        // MILLISECONDS STATUS
        "last" => {
            program.ready();
            program.live(Some(0), false, Some(number(0)));
            status = number(1);
        }
        // Sends `ready` right before its exit.
        "brief" => program.ready(),
        "never-ready" => program.live(Some(0), false, None),
        "deaf" => {
            program.ready();
            program.live(Some(0), true, None);
        }
        "children" => {
            let mut sleep = Command::new("sleep");
            sleep.arg("600").stdin(Stdio::null());
            let near = sleep.spawn().expect("a child");
            let far = sleep.process_group(0).spawn().expect("a child");
            program.journal("child", near.id());
            program.journal("child", far.id());
            program.ready();
            program.live(Some(0), false, None);
        }
        // Leaves a process in a session of its own, without an environment.
        "forsaken" => {
            let mut shell = Command::new("sh");
            shell.args(["-c", "setsid env -i sleep 600 >&- 2>&- & echo $!"]);
            let told = shell.stdin(Stdio::null()).output().expect("it runs");
            let pid = String::from_utf8_lossy(&told.stdout);
            program.journal("child", pid.trim().parse().expect("a pid"));
            program.ready();
            program.live(Some(0), false, None);
        }
        // MILLISECONDS: of silence before the heartbeats.
        "silent" => {
            program.ready();
            program.live(None, false, Some(number(0)));
            program.live(Some(0), false, None);
        }
        "stuck" => {
            program.ready();
            program.live(Some(5000), false, None);
        }
        "garbage" => {
            program.say("hello?");
            program.say(&"x".repeat(100_000));
            // A message of maximum length, which becomes much longer when it is quoted.
            program.say(&"\u{1}\"".repeat(32_000));
            program.say(r#"{"method":"dance"}"#);
            program.ready();
            program.live(Some(0), false, None);
        }
        // Sends garbage only, until it is asked to stop.
        "babble" => {
            program.ready();
            program.signals.set_nonblocking(true).expect("a mode");
            while (&program.signals).read(&mut [0; 8]).is_err() {
                program.say(&"x".repeat(5000));
            }
        }
        // Closes its link and keeps running.
        "shut" => {
            program.ready();
            let _ = program.link.shutdown(std::net::Shutdown::Both);
            std::thread::sleep(Duration::from_mins(1));
        }
        // MILLISECONDS: the pause after which it allocates another MiB.
        "leak" => {
            program.ready();
            let pause = Duration::from_millis(number(0));
            std::thread::spawn(move || {
                let mut kept = Vec::new();
                loop {
                    kept.push(vec![1_u8; 1 << 20]);
                    std::thread::sleep(pause);
                }
            });
            program.live(Some(0), false, None);
        }
        // Alternates between errors and success, then stays well.
        "ill" => {
            program.ready();
            for at in 0..40 {
                let ill = r#","overruns":{"count":1,"what":"compute()","ms":12.5,"period_ms":10},"silent":{"Laser":80}"#;
                let news = if at % 2 == 0 { ill } else { "" };
                let peers = u32::from(at < 30);
                program.notify(
                    "heartbeat",
                    &format!(r#"{{"age_ms":0,"peers":{{"Laser":{peers}}}{news}}}"#),
                );
            }
            for _ in 0..12 {
                program.notify(
                    "heartbeat",
                    r#"{"age_ms":0,"peers":{"Laser":1},"mismatches":[]}"#,
                );
            }
            program.notify(
                "heartbeat",
                r#"{"age_ms":0,"mismatches":["it does not fit"]}"#,
            );
            program.live(Some(0), false, None);
        }
        // LINES: the number of numbered lines that it prints, at a readable pace.
        "count" => {
            program.ready();
            for line in 0..number(0) {
                println!("line {line} {}", "x".repeat(90));
                if line % 5 == 0 {
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            program.live(Some(0), false, None);
        }
        // Fills the disk of the logs until it is stopped.
        "ballast" => {
            program.ready();
            let state = std::env::var_os("XDG_STATE_HOME").unwrap_or_default();
            let ballast = std::path::Path::new(&state).join("ballast");
            let mut file = File::create(&ballast).expect("a file");
            while file.write_all(&[0; 4096]).is_ok() {}
            program.live(Some(0), false, None);
            let _ = std::fs::remove_file(ballast);
        }
        // Prints a numbered line ten times a second.
        "murmur" => {
            program.ready();
            for line in 0_u64.. {
                println!("line {line} of many");
                program.live(Some(0), false, Some(100));
                if program.noted("stop") + program.noted("orphan") > 0 {
                    break;
                }
            }
        }
        // MILLISECONDS: how long it prints, as fast as it can.
        "chatter" => {
            program.ready();
            let end = Instant::now() + Duration::from_millis(number(0));
            while Instant::now() < end {
                println!("{}", "blah ".repeat(20));
            }
            program.live(Some(0), false, None);
        }
        // MEGABYTES: how much it prints, as fast as it can, ignoring errors.
        "flood" => {
            program.ready();
            let line = format!("{}\n", "blah ".repeat(20));
            let piece = line.repeat((1 << 16) / line.len());
            let mut left = number(0) << 20;
            while left > 0 {
                let _ = std::io::stdout().write_all(piece.as_bytes());
                left = left.saturating_sub(piece.len() as u64);
            }
            program.note("flooded");
            program.live(Some(0), false, None);
        }
        // Fills the disk of the file `RC_TEST_FILL`, then becomes ready.
        "fill" => {
            let path = std::env::var_os("RC_TEST_FILL").expect("a file");
            let mut file = File::create(path).expect("it can be made");
            while file.write_all(&[b'x'; 512]).is_ok() {}
            program.ready();
            program.live(Some(0), false, None);
        }
        // CODES: the behaviour at its first start, its second …; the last one holds for all further
        // starts.
        "turns" => match number(program.noted("start").min(numbers.len()) - 1) {
            0 => {
                program.ready();
                program.live(Some(0), false, None);
            }
            // Fails after becoming ready.
            1 => {
                program.ready();
                println!("{} is about to fail", program.name);
                status = 7;
            }
            // Exits with success.
            2 => program.ready(),
            // Exits with success without becoming ready.
            6 => {}
            3 => program.live(Some(0), false, None),
            // Fails and leaves a child in a process group of its own.
            8 => {
                let mut sleep = Command::new("sleep");
                let far = sleep.arg("600").stdin(Stdio::null()).process_group(0);
                program.journal("child", far.spawn().expect("a child").id());
                program.ready();
                status = 7;
            }
            // Becomes ready, then its loop hangs.
            9 => {
                program.ready();
                program.live(Some(5000), false, None);
            }
            // Fails before becoming ready.
            code => status = code,
        },
        other => panic!("unknown behaviour {other}"),
    }
    program.note("end");
    ExitCode::from(u8::try_from(status).expect("a status"))
}
