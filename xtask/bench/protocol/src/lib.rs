//! The protocol between `cargo xtask bench` and the programs that it measures, over pipes.
//! Generated and hand-written programs use the same, so that only their communication differs.
//!
//! | sender | line | when |
//! |---|---|---|
//! | pong, ping | `ready` | all connections are open |
//! | xtask to ping | `publish SIZE COUNT`, also `cloud`, `place`, `lent`, `query`, `rested`, `awake`, `flood`, `steady` | a block starts |
//! | ping | `times …` (queries), `times` (values), `times ALL` (a flood) | the block has ended |
//! | pong | `times …`, one for each received value | a block of values, or of changes of its parameter `sent`, has ended |
//!
//! Times are in nanoseconds. The end of its standard input ends a ping.

pub mod slots;
pub mod soak;

use std::fmt::Write as _;
use std::io::{self, BufRead as _, Write as _};
use std::str::FromStr;
use std::sync::OnceLock;
use std::time::Duration;

/// The pause between two values, after which the receiver sleeps.
const PAUSE: Duration = Duration::from_micros(200);
/// The pause between two large values: copying them takes longer than [`GAP`].
const LONG_PAUSE: Duration = Duration::from_millis(2);
/// The time between two values of [`Kind::Steady`].
const STEP: Duration = Duration::from_micros(100);
/// The size of a large value, in bytes.
const LARGE: usize = 64 * 1024;
/// The largest size of data that are copied, in bytes.
pub const LARGEST: usize = 1024 * 1024;
/// The largest size of data in place, in bytes.
pub const LARGEST_IN_PLACE: usize = 4 * LARGEST;

/// The command for one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Command {
    /// Kind of the measurement.
    pub kind: Kind,
    /// The size of the data, in bytes.
    pub size: usize,
    /// The number of messages.
    pub count: usize,
}

/// The kind of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Copied: from before the call of `publish` until the receiver's handler has a copy of the
    /// data.
    Publish,
    /// [`Kind::Publish`] of points.
    Cloud,
    /// In place: from before the data are written into the loan until the receiver's handler reads
    /// them there.
    InPlace,
    /// [`Kind::InPlace`] from after the data are written, and a pause.
    Lent,
    /// From the call to the reply.
    Query,
    /// [`Kind::Query`] after a pause in which both ends go to sleep.
    Rested,
    /// [`Kind::Query`] between ends that stay awake (`wake spin`), if the program can.
    Awake,
    /// Values at full speed, without a pause. Values that overflow the receiver's queue are lost.
    Flood,
    /// Values at 10 kHz, on a schedule.
    Steady,
}

impl Kind {
    /// Whether the time is that of a round trip.
    pub fn is_query(self) -> bool {
        matches!(self, Self::Query | Self::Rested | Self::Awake)
    }
}

impl FromStr for Command {
    type Err = io::Error;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        let bad = || io::Error::other(format!("`{}` is not a command", line.trim()));
        let mut words = line.split_whitespace();
        let kind = match words.next() {
            Some("publish") => Kind::Publish,
            Some("cloud") => Kind::Cloud,
            Some("place") => Kind::InPlace,
            Some("lent") => Kind::Lent,
            Some("query") => Kind::Query,
            Some("rested") => Kind::Rested,
            Some("awake") => Kind::Awake,
            Some("flood") => Kind::Flood,
            Some("steady") => Kind::Steady,
            _ => return Err(bad()),
        };
        let mut number = || words.next().and_then(|word| word.parse().ok());
        let (Some(size), Some(count)) = (number(), number()) else {
            return Err(bad());
        };
        let largest = match kind {
            Kind::InPlace | Kind::Lent => LARGEST_IN_PLACE,
            Kind::Publish
            | Kind::Cloud
            | Kind::Query
            | Kind::Rested
            | Kind::Awake
            | Kind::Flood
            | Kind::Steady => LARGEST,
        };
        if size == 0 || size > largest {
            return Err(bad());
        }
        Ok(Self { kind, size, count })
    }
}

impl std::fmt::Display for Command {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            Kind::Publish => "publish",
            Kind::Cloud => "cloud",
            Kind::InPlace => "place",
            Kind::Lent => "lent",
            Kind::Query => "query",
            Kind::Rested => "rested",
            Kind::Awake => "awake",
            Kind::Flood => "flood",
            Kind::Steady => "steady",
        };
        write!(f, "{kind} {} {}", self.size, self.count)
    }
}

/// The next command; `None` at the end of the standard input.
pub fn next_command() -> io::Result<Option<Command>> {
    let mut line = String::new();
    if io::stdin().lock().read_line(&mut line)? == 0 {
        return Ok(None);
    }
    line.parse().map(Some)
}

/// Prints `ready`.
pub fn ready() -> io::Result<()> {
    print_line("ready\n")
}

/// Prints `times` and the measured times, in nanoseconds.
pub fn report(times: &[i64]) -> io::Result<()> {
    let mut line = String::from("times");
    for time in times {
        // Writing to a String cannot fail.
        let _ = write!(line, " {time}");
    }
    line.push('\n');
    print_line(&line)
}

/// Pauses before a sample of `size` bytes. `BENCH_PAUSE_MS` sets the pause for programs that a tool
/// slows down, so that the receiver still sleeps before each sample.
pub fn pause(size: usize) {
    static SLOW: OnceLock<Option<Duration>> = OnceLock::new();
    let slow = SLOW.get_or_init(|| {
        let pause = std::env::var("BENCH_PAUSE_MS").ok()?.parse().ok()?;
        Some(Duration::from_millis(pause))
    });
    let usual = if size < LARGE { PAUSE } else { LONG_PAUSE };
    std::thread::sleep(slow.unwrap_or(usual));
}

/// Waits for the time of a value of [`Kind::Steady`], whose block began at `begin`.
pub fn keep_pace(begin: i64, number: usize) {
    let due = begin + number as i64 * STEP.as_nanos() as i64;
    let left = u64::try_from(due - now()).unwrap_or(0);
    std::thread::sleep(Duration::from_nanos(left));
}

/// The monotonic clock, which all processes share, in nanoseconds.
pub fn now() -> i64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

fn print_line(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_parsed_as_printed() {
        let command = Command {
            kind: Kind::Query,
            size: 64,
            count: 9,
        };
        assert_eq!(command.to_string().parse::<Command>().ok(), Some(command));
        assert!("publish 0 1".parse::<Command>().is_err());
        assert!("publish 64".parse::<Command>().is_err());
    }
}
