//! What `cargo xtask bench` and the programs that it measures say to each other, over pipes.
//! Generated and hand-written programs use the same, so that only what lies between them differs.
//!
//! | who | says | when |
//! |---|---|---|
//! | pong, ping | `ready` | its connections are open |
//! | xtask to ping | `publish SIZE COUNT`, also `place`, `query`, `rested`, `awake`, `flood` | one block is to be measured |
//! | ping | `times …` (queries), `times` (values), `times ALL` (a flood) | the block is done |
//! | pong | `times …`, one for each value that came | the block of values, or of changes of its parameter `sent`, has ended |
//!
//! Times are in nanoseconds. The end of its standard input ends a ping.

pub mod slots;
pub mod soak;

use std::fmt::Write as _;
use std::io::{self, BufRead as _, Write as _};
use std::str::FromStr;
use std::sync::OnceLock;
use std::time::Duration;

/// Between two values: longer than a receiver needs to go to sleep again.
const PAUSE: Duration = Duration::from_micros(200);
/// The same where values are so large that copying them takes longer than that.
const LONG_PAUSE: Duration = Duration::from_millis(2);
/// From this size on they are.
const LARGE: usize = 64 * 1024;
/// Largest data of a block.
pub const LARGEST: usize = 1024 * 1024;

/// One block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Order {
    /// One way, or there and back.
    pub kind: Kind,
    /// Bytes of data.
    pub size: usize,
    /// How often.
    pub count: usize,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From before the sending until the receiver's handler has the data in its own memory.
    Publish,
    /// From before the data are written where the receiver will read them until its handler can
    /// look at them there.
    InPlace,
    /// From before the call until the answer is there.
    Query,
    /// The same after a pause, in which both ends go to sleep.
    Rested,
    /// The same as `Query` where both ends stay awake (`wake spin`), as far as the program can.
    Awake,
    /// As many values as the sender can send, one after the other without a pause; what the
    /// receiver has no time for is lost.
    Flood,
}

impl Kind {
    /// Whether it goes there and back.
    pub fn is_query(self) -> bool {
        matches!(self, Self::Query | Self::Rested | Self::Awake)
    }
}

impl FromStr for Order {
    type Err = io::Error;

    fn from_str(line: &str) -> Result<Self, Self::Err> {
        let bad = || io::Error::other(format!("`{}` is no order", line.trim()));
        let mut words = line.split_whitespace();
        let kind = match words.next() {
            Some("publish") => Kind::Publish,
            Some("place") => Kind::InPlace,
            Some("query") => Kind::Query,
            Some("rested") => Kind::Rested,
            Some("awake") => Kind::Awake,
            Some("flood") => Kind::Flood,
            _ => return Err(bad()),
        };
        let mut number = || words.next().and_then(|word| word.parse().ok());
        let (Some(size), Some(count)) = (number(), number()) else {
            return Err(bad());
        };
        if size == 0 || size > LARGEST {
            return Err(bad());
        }
        Ok(Self { kind, size, count })
    }
}

impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            Kind::Publish => "publish",
            Kind::InPlace => "place",
            Kind::Query => "query",
            Kind::Rested => "rested",
            Kind::Awake => "awake",
            Kind::Flood => "flood",
        };
        write!(f, "{kind} {} {}", self.size, self.count)
    }
}

/// The next order; none when there will be no more.
pub fn next_order() -> io::Result<Option<Order>> {
    let mut line = String::new();
    if io::stdin().lock().read_line(&mut line)? == 0 {
        return Ok(None);
    }
    line.parse().map(Some)
}

/// Says `ready`.
pub fn ready() -> io::Result<()> {
    say("ready\n")
}

/// Says `times` and what was measured.
pub fn report(times: &[i64]) -> io::Result<()> {
    let mut line = String::from("times");
    for time in times {
        // Writing to a String cannot fail.
        let _ = write!(line, " {time}");
    }
    line.push('\n');
    say(&line)
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

/// Nanoseconds of the clock that all processes share.
pub fn now() -> i64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

fn say(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_comes_back() {
        let order = Order {
            kind: Kind::Query,
            size: 64,
            count: 9,
        };
        assert_eq!(order.to_string().parse::<Order>().ok(), Some(order));
        assert!("publish 0 1".parse::<Order>().is_err());
        assert!("publish 64".parse::<Order>().is_err());
    }
}
