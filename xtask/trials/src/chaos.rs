//! `cargo xtask chaos`: kills processes of a network at random moments, many times. It checks that
//! everything starts again and works, and that nothing is left at the end.
//!
//! A third of the kills is in networks without a supervisor, a third under rcdeploy, and a third
//! there where all components are threads of one process. The network is the one of the components
//! simulator, avoider and `pose_monitor`: a query, a command and a topic.
//! `--minutes` runs some twenty components under rcdeploy, kills one a second, and makes other
//! troubles, see `minutes` and `trouble`. `--smoke` builds nothing: the test run has built all
//! programs, and a build would replace them while other tests run them.

mod by_hand;
mod ground;
mod hostile;
mod minutes;
mod mounts;
mod shim;
mod supervised;
mod trouble;

use crate::programs::{Failure, cargo};
use crate::variant;
use ground::Ground;
use std::time::{Duration, Instant};

/// The arguments of the command line.
pub(crate) struct Orders {
    kills: u32,
    /// `None` kills as fast as possible.
    time: Option<Duration>,
    seed: u64,
    /// Whether the programs are built first.
    build: bool,
}

impl Orders {
    /// Parses `[--kills N | --minutes N | --seconds N] [--seed S] [--smoke]`; `None` if the
    /// arguments are invalid.
    pub(crate) fn parse(words: &[&str]) -> Option<Self> {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let mut orders = Self {
            kills: 500,
            time: None,
            seed: now.map_or(0, |since| since.as_secs()),
            build: true,
        };
        let words = match words {
            [before @ .., "--smoke"] => {
                orders.build = false;
                before
            }
            all => all,
        };
        for pair in words.chunks(2) {
            match *pair {
                ["--kills", number] => orders.kills = number.parse().ok()?,
                ["--minutes", number] => {
                    let minutes: u32 = number.parse().ok()?;
                    orders.time = Some(Duration::from_mins(1) * minutes);
                }
                ["--seconds", number] => {
                    orders.time = Some(Duration::from_secs(number.parse().ok()?));
                }
                ["--seed", number] => orders.seed = number.parse().ok()?,
                _ => return None,
            }
        }
        let both = words.contains(&"--kills") && orders.time.is_some();
        (!both).then_some(orders)
    }
}

/// Runs the kills and prints a summary.
pub(crate) fn run(orders: &Orders) -> Result<(), Failure> {
    if orders.build {
        build()?;
    }
    let Orders { kills, seed, .. } = *orders;
    if let Some(time) = orders.time {
        if let Err(why) = mounts::enter() {
            println!("skipped: a full shared memory and a full disk: no mounts of its own: {why}");
        }
        return minutes::run(time, seed);
    }
    println!("chaos: {kills} kills, seed {seed}");
    let start = Instant::now();
    let mut dice = Dice(seed);
    let spread = by_hand::time_to_start(&Ground::new()?)?;
    let third = kills / 3;
    let parts: [(&str, Part, u32, Place); 3] = [
        ("by hand", by_hand::run, third, Ground::new),
        ("under rcdeploy", supervised::run, third, Ground::new),
        (
            "as one process",
            supervised::run,
            kills - 2 * third,
            Ground::in_one,
        ),
    ];
    for (name, part, kills, ground) in parts {
        let ground = ground()?;
        let mut tally = Tally::default();
        let outcome = part(&ground, &mut dice, Kills { kills, spread }, &mut tally);
        let outcome = outcome.and_then(|()| ground.nothing_is_left());
        println!("{name}: {tally}");
        if let Err(error) = outcome {
            let log = ground.log_end("rcdeploy");
            let folder = ground.keep();
            let folder = folder.display();
            return Err(format!(
                "{name}, seed {seed}, after {} kills: {error}\nits folder is kept: {folder}\nthe end of the log of rcdeploy:\n{log}",
                tally.kills
            )
            .into());
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("chaos: everything started again and worked, nothing is left; {seconds:.0} s");
    Ok(())
}

/// Parameters of one part of the kills.
#[derive(Clone, Copy)]
struct Kills {
    kills: u32,
    /// The kills are spread over this time after a start.
    spread: Duration,
}

/// Makes the place of a part of the kills.
type Place = fn() -> Result<Ground, Failure>;

/// One part of the kills.
type Part = fn(&Ground, &mut Dice, Kills, &mut Tally) -> Result<(), Failure>;

/// Builds the programs. `--workspace` makes cargo choose the features of the whole workspace, so
/// that it compiles no library a second time.
fn build() -> Result<(), Failure> {
    let programs = "simulator avoider pose_monitor camera image_monitor clock interop rcdeploy";
    let mut words = vec!["build", "--quiet", "--workspace"];
    words.extend(programs.split(' ').flat_map(|program| ["--bin", program]));
    if cargo(&words)?.status()?.success() {
        variant::build_in_one()
    } else {
        Err("the components could not be built".into())
    }
}

/// Counters for the summary.
#[derive(Default)]
struct Tally {
    kills: u32,
    /// Kills between the start of a process and its readiness.
    during_start: u32,
    /// How often all components worked again.
    recoveries: u32,
    /// The longest time from the last kill until all components worked again.
    longest: Duration,
}

impl Tally {
    fn kill(&mut self, during_start: bool) {
        self.kills += 1;
        self.during_start += u32::from(during_start);
    }

    fn recovered(&mut self, took: Duration) {
        self.recoveries += 1;
        self.longest = self.longest.max(took);
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} kills, {} of them during start; at work again {} times, at the latest after {:.2} s",
            self.kills,
            self.during_start,
            self.recoveries,
            self.longest.as_secs_f64()
        )
    }
}

/// Random numbers that a seed determines: `SplitMix64` (Steele, Lea, Flood, 2014).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// One of `0..count`.
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    /// True in `percent` of all cases.
    fn falls(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    /// A time below `limit`, in whole microseconds.
    fn time(&mut self, limit: Duration) -> Duration {
        Duration::from_micros(self.next() % (limit.as_micros() as u64).max(1))
    }
}
