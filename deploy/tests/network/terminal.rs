//! `rcdeploy up` and `rcdeploy top` on a real terminal: what it shows, what keys do, and how it is given back.

use crate::site::Site;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Termios, Winsize, tcgetattr, tcsetwinsize};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(20);

/// A terminal in which one command runs. The command is killed at the latest when the test ends.
struct Terminal {
    user: OwnedFd,
    program: OwnedFd,
    parser: vt100::Parser,
    before: Termios,
    child: Child,
}

impl Terminal {
    /// Starts rcdeploy in a terminal that it controls.
    fn start(site: &Site, (columns, lines): (u16, u16), args: &[&str]) -> Self {
        let user = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC);
        let user = user.expect("a terminal");
        grantpt(&user)
            .and_then(|()| unlockpt(&user))
            .expect("to be let in");
        let name = ptsname(&user, Vec::new()).expect("its name");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let program = rustix::fs::open(name, flags, Mode::empty()).expect("its other end");
        tcsetwinsize(&user, size(columns, lines)).expect("a size");
        let before = tcgetattr(&program).expect("its mode");
        let end = || Stdio::from(program.try_clone().expect("a descriptor"));
        let mut command = site.command(Path::new("setsid"));
        command
            .args(["--ctty", env!("CARGO_BIN_EXE_rcdeploy")])
            .args(args)
            .env("TERM", "xterm-256color")
            .env_remove("NO_COLOR")
            .stdin(end())
            .stdout(end())
            .stderr(end());
        Self {
            child: command.spawn().expect("setsid, of util-linux"),
            parser: vt100::Parser::new(lines, columns, 0),
            user,
            program,
            before,
        }
    }

    /// Reads what is written until the screen is as it should be.
    fn until(&mut self, what: &str, so: impl Fn(&vt100::Screen) -> bool) {
        let deadline = Instant::now() + LIMIT;
        while !so(self.parser.screen()) {
            let left = deadline.saturating_duration_since(Instant::now());
            let read = self.read(left);
            let screen = self.parser.screen().contents();
            assert!(read, "waited for {what}, this was shown:\n{screen}");
        }
    }

    fn until_text(&mut self, text: &str) {
        self.until(text, |screen| screen.contents().contains(text));
    }

    /// Reads once; false where nothing came.
    fn read(&mut self, limit: Duration) -> bool {
        let limit = Timespec::try_from(limit).expect("a short time");
        let mut polled = [PollFd::new(&self.user, PollFlags::IN)];
        if poll(&mut polled, Some(&limit)).expect("to wait") == 0 {
            return false;
        }
        let mut buffer = [0; 4096];
        let count = rustix::io::read(&self.user, &mut buffer).expect("to read");
        self.parser.process(&buffer[..count]);
        true
    }

    fn press(&self, keys: &str) {
        let count = rustix::io::write(&self.user, keys.as_bytes()).expect("to press keys");
        assert_eq!(count, keys.len());
    }

    fn is_raw(&self) -> bool {
        let mode = tcgetattr(&self.program).expect("its mode");
        !mode.local_modes.contains(LocalModes::ICANON)
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Waits for the end of the command: its exit code, and what is on the screen then. The terminal is as it was.
    fn end(mut self) -> (Option<i32>, String) {
        let start = Instant::now();
        let status = loop {
            self.read(Duration::from_millis(10));
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            let screen = self.parser.screen().contents();
            assert!(start.elapsed() < LIMIT, "it does not end:\n{screen}");
        };
        while self.read(Duration::ZERO) {}
        let screen = self.parser.screen();
        assert!(!screen.alternate_screen() && !screen.hide_cursor());
        let after = tcgetattr(&self.program).expect("its mode");
        assert_eq!(after.local_modes, self.before.local_modes);
        assert_eq!(after.input_modes, self.before.input_modes);
        assert_eq!(after.output_modes, self.before.output_modes);
        (status.code(), screen.contents())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn size(columns: u16, lines: u16) -> Winsize {
    Winsize {
        ws_row: lines,
        ws_col: columns,
        ws_xpixel: 0,
        ws_ypixel: 0,
    }
}

fn up<'a>(ddsl: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["up", "--profile", "dev", ddsl], more].concat()
}

fn pid_of(site: &Site, component: &str) -> i64 {
    let status = site.status();
    let components = status["components"].as_array().expect("components");
    let found = components.iter().find(|c| c["name"] == component);
    found.expect("the component")["pid"].as_i64().unwrap_or(0)
}

#[test]
fn a_network_is_shown_and_restarted_and_stopped_by_keys() {
    let site = Site::new("screen");
    let ddsl = site.ddsl().display().to_string();
    let mut terminal = Terminal::start(&site, (120, 30), &up(&ddsl, &[]));
    terminal.until_text("3 running");
    terminal.until_text("network screen");
    assert!(terminal.parser.screen().alternate_screen() && terminal.is_raw());
    // The simulator answers twenty calls a second and more.
    terminal.until("rates", |screen| {
        let contents = screen.contents();
        let row = contents.lines().find(|l| l.starts_with("simulator"));
        row.is_some_and(|row| row.contains("running") && !row.contains(" - "))
    });

    let before = pid_of(&site, "simulator");
    terminal.press("r");
    terminal.until_text("y/n restart simulator?");
    assert_eq!(pid_of(&site, "simulator"), before);
    terminal.press("y");
    terminal.until_text("restart simulator: done");
    let after = pid_of(&site, "simulator");
    assert!(after != before && after != 0, "{before} {after}");

    terminal.press("c");
    terminal.until_text("avoider.Laser");
    terminal.press("p");
    terminal.until_text("robot.max_speed");
    terminal.press("\u{1b}");
    terminal.until_text("COMPONENT");
    // The monitor tells what it hears.
    terminal.press("j\r");
    terminal.until_text("poses=");
    terminal.press("\u{1b}");
    terminal.until_text("COMPONENT");

    // Another size.
    tcsetwinsize(&terminal.user, size(40, 10)).expect("another size");
    terminal.parser.screen_mut().set_size(10, 40);
    terminal.until("a narrow table", |screen| {
        let contents = screen.contents();
        contents.contains("COMPONENT") && !contents.contains("RESTARTS")
    });

    terminal.press("\u{3}");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen}");
    for told in ["stopping: interrupted", "is down"] {
        assert!(screen.contains(told), "{screen}");
    }
    site.assert_nothing_left();
}

#[test]
fn a_network_in_the_background_is_looked_at_and_left_alone() {
    let site = Site::new("top");
    let started = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(started.code, 0, "{started:?}");
    let mut terminal = Terminal::start(&site, (80, 24), &["top", &site.network]);
    terminal.until_text("3 running");
    // What happened before is told, too.
    terminal.until_text("network top");
    terminal.press("q");
    assert_eq!(terminal.end().0, Some(0));
    assert_ne!(pid_of(&site, "avoider"), 0);

    // One that is ended by a signal gives the terminal back as well.
    let mut terminal = Terminal::start(&site, (80, 24), &["top", &site.network]);
    terminal.until_text("3 running");
    kill_process(terminal.pid(), Signal::TERM).expect("to end it");
    assert_eq!(terminal.end().0, Some(0));

    // And one whose network goes.
    let mut terminal = Terminal::start(&site, (80, 24), &["top", &site.network]);
    terminal.until_text("3 running");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0));
    assert!(screen.contains("is down"), "{screen}");
    site.assert_nothing_left();
    let nobody = Terminal::start(&site, (80, 24), &["top", &site.network]);
    let (code, screen) = nobody.end();
    assert_eq!(code, Some(3));
    assert!(screen.contains("is not up"), "{screen}");
    let nowhere = site.rcdeploy(&["top", &site.network], false);
    assert_eq!(nowhere.code, 2, "{nowhere:?}");
}

#[test]
fn a_terminal_that_goes_away_takes_its_network_with_it() {
    let site = Site::new("gone");
    let ddsl = site.ddsl().display().to_string();
    let mut terminal = Terminal::start(&site, (80, 24), &up(&ddsl, &[]));
    terminal.until_text("3 running");
    let other = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("another terminal");
    drop(std::mem::replace(&mut terminal.user, other));
    let start = Instant::now();
    while terminal.child.try_wait().expect("a child").is_none() {
        assert!(start.elapsed() < LIMIT, "it does not end");
        std::thread::sleep(Duration::from_millis(10));
    }
    site.assert_nothing_left();
}

#[test]
fn who_wants_lines_gets_lines() {
    let site = Site::new("plain");
    let ddsl = site.ddsl().display().to_string();
    let mut terminal = Terminal::start(&site, (120, 60), &up(&ddsl, &["--plain"]));
    terminal.until_text("is up");
    assert!(!terminal.parser.screen().alternate_screen() && !terminal.is_raw());
    terminal.press("\u{3}");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("is down"), "{screen}");
    site.assert_nothing_left();
}
