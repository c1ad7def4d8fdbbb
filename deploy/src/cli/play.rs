//! `rcdeploy play`: sends what was recorded.

use super::arguments::rate;
use super::bag::Selected;
use super::completion::networks;
use super::look::look;
use super::messages::{interrupts, is_interrupted};
use super::networks::running;
use super::output::{Failure, print_line, print_note};
use rc_command_line::files;
use rc_observe::TimeSource;
use rc_record::player::{Player, Playing};
use rc_record::system_time;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};
use std::io::{IsTerminal, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The longest wait.
const WAIT: Duration = Duration::from_millis(200);
/// The longest wait if the player publishes the time.
const TICK: Duration = Duration::from_millis(10);
/// How far an arrow key goes.
const SEEK: Duration = Duration::from_secs(5);
/// How many messages are sent before keys and calls are looked at.
const TURN: usize = 64;

/// What is played, and how.
#[derive(clap::Args)]
pub(super) struct Play {
    /// The recording.
    #[arg(value_name = "FILE.mcap", add = files(&["mcap"]))]
    file: PathBuf,
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(long, add = networks())]
    network: Option<String>,
    /// How many times faster than it was recorded.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = rate)]
    rate: f64,
    /// Begins anew at the end.
    #[arg(long = "loop")]
    repeats: bool,
    #[command(flatten)]
    selected: Selected,
    /// Sends a topic of the recording to this topic of the network, as in
    /// `/pose=simulator.Poses.newPose`.
    #[arg(long, value_name = "TOPIC=TOPIC", value_parser = pair)]
    remap: Vec<(String, String)>,
    /// Converts values of other types by the names of their members.
    #[arg(long)]
    convert: bool,
    /// Answers no calls.
    #[arg(long)]
    no_answers: bool,
    /// Publishes the recorded time as that of the network, for components that follow one.
    #[arg(long)]
    clock: bool,
}

fn pair(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=');
    let pair = pair.map(|(from, to)| (from.to_owned(), to.to_owned()));
    pair.ok_or_else(|| "a remapping looks like `/pose=simulator.Poses.newPose`".to_owned())
}

pub(super) fn play(options: Play) -> Result<u8, Failure> {
    let interrupts = interrupts()?;
    let selection = options.selected.into_selection(&options.file)?;
    let network = look(&running(options.network)?)?;
    let clock = options
        .clock
        .then(|| TimeSource::open(&network, system_time()));
    let mut clock = clock.transpose()?;
    let playing = Playing {
        selection,
        rate: options.rate,
        remap: options.remap,
        convert: options.convert,
        answers: !options.no_answers,
    };
    let mut player = Player::open(&options.file, network, playing)?;
    let keys = Keys::open();
    let mut is_paused = false;
    let mut shown = Instant::now();
    loop {
        if is_interrupted(&interrupts) {
            break;
        }
        keys.say(player.notes());
        match keys.pressed() {
            Some(Key::Pause) => {
                is_paused = !is_paused;
                player.restart_clock();
            }
            Some(Key::Step) => {
                is_paused = true;
                player.step()?;
            }
            Some(Key::Forward) => player.seek(player.position() + SEEK)?,
            Some(Key::Back) => player.seek(player.position().saturating_sub(SEEK))?,
            Some(Key::Quit) => break,
            None => {}
        }
        if player.is_over() && !is_paused {
            if !options.repeats {
                break;
            }
            player.seek(Duration::ZERO)?;
            if player.is_over() {
                break;
            }
        }
        let mut left = WAIT;
        if !is_paused {
            for _ in 0..TURN {
                let Some(due) = player.due() else { break };
                left = due.saturating_duration_since(Instant::now()).min(WAIT);
                if !left.is_zero() {
                    break;
                }
                player.send()?;
            }
        }
        if let Some(clock) = &mut clock {
            left = left.min(TICK);
            if let Some(time) = player.network_time(is_paused) {
                clock.set(time)?;
            }
            clock.repeat()?;
        }
        player.answer()?;
        if shown.elapsed() >= WAIT {
            shown = Instant::now();
            keys.show(&player, is_paused);
        }
        wait(&player, &keys, interrupts.as_fd(), left);
    }
    keys.say(player.notes());
    drop(keys);
    let (sent, left_out) = (player.sent(), player.left_out());
    let (answered, guessed) = player.answered();
    player.finish();
    if left_out > 0 {
        print_note(&format_args!("{left_out} messages were left out"));
    }
    if guessed > 0 {
        print_note(&format_args!(
            "{guessed} calls had parameters that were not recorded; they got the reply of that time"
        ));
    }
    print_line(format_args!(
        "{sent} messages sent, {answered} calls answered"
    ));
    Ok(0)
}

/// Waits until something is to be done, at most `limit`.
fn wait(player: &Player, keys: &Keys, interrupts: BorrowedFd<'_>, limit: Duration) {
    let mut all = player.descriptors();
    all.push(interrupts);
    if keys.0.is_some() {
        all.push(rustix::stdio::stdin());
    }
    rc_middleware::wait(&all, limit);
}

enum Key {
    Pause,
    Step,
    Forward,
    Back,
    Quit,
}

/// The keys of a terminal, without waiting for Enter. None if there is no terminal.
struct Keys(Option<Termios>);

impl Keys {
    fn open() -> Self {
        let keys = rustix::stdio::stdin();
        if !std::io::stdin().is_terminal() || !std::io::stderr().is_terminal() {
            return Self(None);
        }
        let Ok(before) = tcgetattr(keys) else {
            return Self(None);
        };
        let mut raw = before.clone();
        raw.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        let set = tcsetattr(keys, OptionalActions::Now, &raw);
        Self(set.is_ok().then_some(before))
    }

    fn pressed(&self) -> Option<Key> {
        self.0.as_ref()?;
        let keys = rustix::stdio::stdin();
        let mut polled = [PollFd::from_borrowed_fd(keys, PollFlags::IN)];
        if poll(&mut polled, Some(&Timespec::default())).unwrap_or(0) == 0 {
            return None;
        }
        let mut buffer = [0; 16];
        match rustix::io::read(keys, &mut buffer) {
            // The terminal was closed.
            Ok(0) | Err(_) => Some(Key::Quit),
            Ok(length) => match &buffer[..length] {
                b" " => Some(Key::Pause),
                b"s" | b"." => Some(Key::Step),
                b"\x1b[C" => Some(Key::Forward),
                b"\x1b[D" => Some(Key::Back),
                b"q" => Some(Key::Quit),
                _ => None,
            },
        }
    }

    fn show(&self, player: &Player, is_paused: bool) {
        if self.0.is_some() {
            let paused = if is_paused { "paused  " } else { "" };
            let _ = write!(
                std::io::stderr(),
                "\r\x1b[K{:>8.1} s  {} sent  {paused}[space] pause  [s] step  [←→] seek  [q] quit",
                player.position().as_secs_f64(),
                player.sent()
            );
        }
    }

    /// Prints notes, in place of the line that is shown.
    fn say(&self, notes: Vec<String>) {
        for note in notes {
            self.clear();
            print_note(&note);
        }
    }

    fn clear(&self) {
        if self.0.is_some() {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = &self.0 {
            self.clear();
            let _ = tcsetattr(rustix::stdio::stdin(), OptionalActions::Now, before);
        }
    }
}
