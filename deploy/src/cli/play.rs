//! `rcdeploy play`: sends a recording.

use super::arguments::rate;
use super::bag::{Selected, duration};
use super::completion::networks;
use super::look::look;
use super::meaning::ConversionOptions;
use super::messages::{ENDS, interrupts, is_interrupted};
use super::networks::running;
use super::output::{Failure, print_line, print_note, system};
use rc_command_line::files;
use rc_observe::TimeSource;
use rc_record::player::{Player, Playing};
use rc_record::system_time;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};
use std::io::{IsTerminal, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// The longest wait.
const WAIT: Duration = Duration::from_millis(200);
/// The longest wait if the player publishes the time.
const TICK: Duration = Duration::from_millis(10);
/// How far an arrow key goes.
const SEEK: Duration = Duration::from_secs(5);
/// How many messages are sent between two looks at keys and calls.
const TURN: usize = 64;

/// Arguments of `play`.
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
    /// Skips a longer time without messages, as a clock that was set leaves it. The time is that of
    /// the recording.
    #[arg(long, value_name = "TIME", default_value = "1min", value_parser = duration)]
    max_gap: Duration,
    /// Repeats from the beginning at the end.
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
    #[command(flatten)]
    meaning: ConversionOptions,
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
    let selection = options.selected.into_selection(&options.file)?;
    let interrupts = interrupts()?;
    // The reader of the file watches this.
    let stop = Arc::new(AtomicBool::new(false));
    for signal in ENDS {
        signal_hook::flag::register(signal, Arc::clone(&stop)).map_err(|e| system(&e))?;
    }
    let network = look(&running(options.network)?)?;
    let clock = options
        .clock
        .then(|| TimeSource::open(&network, system_time()));
    let mut clock = clock.transpose()?;
    let playing = Playing {
        selection,
        rate: options.rate,
        max_gap: options.max_gap,
        remap: options.remap,
        convert: options.convert,
        meaning: options.meaning.converter()?.map(Arc::new),
        answers: !options.no_answers,
        stop,
    };
    let mut player = Player::open(&options.file, network, playing)?;
    let mut keys = Keys::open();
    let mut is_paused = false;
    let mut shown = Instant::now();
    'playing: loop {
        if is_interrupted(&interrupts) {
            break;
        }
        keys.say(player.notes());
        for key in keys.pressed() {
            match key {
                Key::Pause => {
                    is_paused = !is_paused;
                    player.hold_clock();
                }
                Key::Step => {
                    is_paused = true;
                    player.step()?;
                }
                Key::Forward => player.seek(player.position() + SEEK)?,
                Key::Back => player.seek(player.position().saturating_sub(SEEK))?,
                Key::Quit => break 'playing,
            }
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
            if let Some(time) = player.network_time() {
                clock.set(time)?;
            }
            clock.repeat()?;
        }
        player.answer();
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
    if keys.before.is_some() {
        all.push(rustix::stdio::stdin());
    }
    rc_middleware::wait(&all, limit);
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Key {
    Pause,
    Step,
    Forward,
    Back,
    Quit,
}

/// The keys of a terminal, without waiting for Enter. None if there is no terminal.
struct Keys {
    /// The settings of the terminal before.
    before: Option<Termios>,
    /// Bytes of an incomplete key sequence.
    typed: Vec<u8>,
}

/// Takes the complete keys from the typed bytes.
fn take_keys(typed: &mut Vec<u8>) -> Vec<Key> {
    let mut found = Vec::new();
    loop {
        let (key, length) = match typed.as_slice() {
            [] | [0x1b] | [0x1b, b'['] => return found,
            [0x1b, b'[', b'C', ..] => (Some(Key::Forward), 3),
            [0x1b, b'[', b'D', ..] => (Some(Key::Back), 3),
            [0x1b, b'[', ..] => (None, 3),
            [b' ', ..] => (Some(Key::Pause), 1),
            [b's' | b'.', ..] => (Some(Key::Step), 1),
            [b'q', ..] => (Some(Key::Quit), 1),
            _ => (None, 1),
        };
        found.extend(key);
        typed.drain(..length);
    }
}

impl Keys {
    fn open() -> Self {
        let new = |before| Self {
            before,
            typed: Vec::new(),
        };
        let keys = rustix::stdio::stdin();
        if !std::io::stdin().is_terminal() || !std::io::stderr().is_terminal() {
            return new(None);
        }
        let Ok(before) = tcgetattr(keys) else {
            return new(None);
        };
        let mut raw = before.clone();
        raw.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        let set = tcsetattr(keys, OptionalActions::Now, &raw);
        new(set.is_ok().then_some(before))
    }

    /// The keys since the last call.
    fn pressed(&mut self) -> Vec<Key> {
        if self.before.is_none() {
            return Vec::new();
        }
        let keys = rustix::stdio::stdin();
        let mut polled = [PollFd::from_borrowed_fd(keys, PollFlags::IN)];
        if poll(&mut polled, Some(&Timespec::default())).unwrap_or(0) == 0 {
            return Vec::new();
        }
        let mut buffer = [0; 16];
        match rustix::io::read(keys, &mut buffer) {
            // The terminal was closed.
            Ok(0) | Err(_) => vec![Key::Quit],
            Ok(length) => {
                self.typed.extend(&buffer[..length]);
                take_keys(&mut self.typed)
            }
        }
    }

    fn show(&self, player: &Player, is_paused: bool) {
        if self.before.is_some() {
            let space = if is_paused {
                "paused  [space] continue"
            } else {
                "[space] pause"
            };
            let _ = write!(
                std::io::stderr(),
                "\r\x1b[K{:>8.1} s  {} sent  {space}  [s] step  [←→] seek  [q] quit",
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
        if self.before.is_some() {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            self.clear();
            let _ = tcsetattr(rustix::stdio::stdin(), OptionalActions::Now, before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_that_are_read_together_or_in_parts_count_each() {
        let mut typed = b"ss \x1b[C\x1b[1;5Cx\x1b".to_vec();
        let (step, pause, forward) = (Key::Step, Key::Pause, Key::Forward);
        assert_eq!(take_keys(&mut typed), [step, step, pause, forward]);
        typed.extend(b"[Dq");
        assert_eq!(take_keys(&mut typed), [Key::Back, Key::Quit]);
        assert!(typed.is_empty());
    }
}
