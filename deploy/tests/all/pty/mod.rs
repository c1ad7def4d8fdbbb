//! A pseudo terminal for a program under test: reads its screen and presses keys.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program has a copy, and uses its own part"
)]

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::process::Pid;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Termios, Winsize, tcgetattr, tcsetwinsize};
use std::os::fd::OwnedFd;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// `setsid` of util-linux, with the argument that makes a terminal the controlling one.
pub const SETSID: [&str; 2] = ["setsid", "--ctty"];

/// The longest wait of a test.
const LIMIT: Duration = Duration::from_secs(20);

/// A terminal in which one command runs. Dropping it kills the command.
pub struct Terminal {
    user: OwnedFd,
    program: OwnedFd,
    parser: vt100::Parser,
    before: Termios,
    child: Child,
}

impl Terminal {
    /// Starts a command in a terminal of this size. The command runs a program by [`SETSID`], which
    /// gets the terminal as its controlling one.
    #[expect(clippy::needless_pass_by_value, reason = "a command is started once")]
    pub fn start(command: Command, (columns, lines): (u16, u16)) -> Self {
        let mut command = hanging_up(&command);
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
        command
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

    /// Reads output until `condition` holds for the screen.
    pub fn until(&mut self, what: &str, condition: impl Fn(&vt100::Screen) -> bool) {
        let deadline = Instant::now() + LIMIT;
        while !condition(self.parser.screen()) {
            let left = deadline.saturating_duration_since(Instant::now());
            let read = self.read(left);
            let screen = self.parser.screen().contents();
            assert!(read, "waited for {what}, this was shown:\n{screen}");
        }
    }

    pub fn until_text(&mut self, text: &str) {
        self.until(text, |screen| screen.contents().contains(text));
    }

    /// Reads once. Returns false if nothing arrived in time.
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

    pub fn press(&self, keys: &str) {
        let count = rustix::io::write(&self.user, keys.as_bytes()).expect("to press keys");
        assert_eq!(count, keys.len());
    }

    pub fn is_raw(&self) -> bool {
        let mode = tcgetattr(&self.program).expect("its mode");
        !mode.local_modes.contains(LocalModes::ICANON)
    }

    pub fn screen(&self) -> &vt100::Screen {
        self.parser.screen()
    }

    /// Changes the size of the terminal.
    pub fn resize(&mut self, columns: u16, lines: u16) {
        tcsetwinsize(&self.user, size(columns, lines)).expect("another size");
        self.parser.screen_mut().set_size(lines, columns);
    }

    /// Closes the terminal and waits for the exit of the command.
    pub fn hang_up(mut self) {
        let other = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC);
        let other = other.expect("another terminal");
        drop(std::mem::replace(&mut self.user, other));
        let start = Instant::now();
        while self.child.try_wait().expect("a child").is_none() {
            assert!(start.elapsed() < LIMIT, "the command does not exit");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    pub fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Waits for the exit of the command. Returns its exit code and the final screen. Checks that
    /// the terminal mode is restored.
    pub fn end(mut self) -> (Option<i32>, String) {
        let start = Instant::now();
        let status = loop {
            self.read(Duration::from_millis(10));
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            let screen = self.parser.screen().contents();
            assert!(
                start.elapsed() < LIMIT,
                "the command does not exit:\n{screen}"
            );
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

/// A command that a hang-up ends, although a run of all tests under `nohup` ignores it.
fn hanging_up(command: &Command) -> Command {
    let mut within = Command::new("env");
    within.arg("--default-signal=HUP");
    within.arg(command.get_program()).args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => within.env(name, value),
            None => within.env_remove(name),
        };
    }
    if let Some(folder) = command.get_current_dir() {
        within.current_dir(folder);
    }
    within
}

fn size(columns: u16, lines: u16) -> Winsize {
    Winsize {
        ws_row: lines,
        ws_col: columns,
        ws_xpixel: 0,
        ws_ypixel: 0,
    }
}
