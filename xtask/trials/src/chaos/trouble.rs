//! Troubles of a network under load other than killing a single process: many deaths at once, a
//! supervisor or a guard that is stopped for a while, a supervisor without a free descriptor, a
//! full shared memory, a full and a slow disk, clocks that jump: that of the system, and the source
//! of time of some components, which runs an hour ahead in each tick and begins again.

use super::Dice;
use super::ground::{CLOCK, Ground};
use super::mounts::{self, MEMORY};
use super::supervised::pid;
use crate::programs::Failure;
use rc_management::component::Request;
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, kill_process, prlimit};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use std::time::Duration;

/// The longest time of a trouble that ends by itself.
const LONGEST: Duration = Duration::from_secs(1);
/// Error of the system for a process that has no free descriptor.
pub(super) const NO_DESCRIPTOR: &str = "Too many open files";
/// The file of a trouble that writes.
const FILLER: &str = "rc-chaos-filler";
/// How much is written at once.
const BLOCK: usize = 1 << 20;
/// How much longer a slow disk takes for each write.
const SLOW: Duration = Duration::from_millis(30);
/// How far the clock of the system is set ahead or back, in seconds.
const FAR: usize = 3 * 60 * 60;

/// The kinds of troubles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    MassKill,
    StoppedSupervisor,
    StoppedGuard,
    NoDescriptor,
    FullMemory,
    FullDisk,
    SlowDisk,
    SystemClock,
    Clock,
}

/// The events of a trouble until all components are ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Consequence {
    Nothing,
    /// Times of events do not measure: the clock was set, or the disk was slow.
    WrongTimes,
    /// Components may have failed.
    Failures,
}

const KINDS: [(Kind, &str); 9] = [
    (Kind::MassKill, "half of the components were killed at once"),
    (Kind::StoppedSupervisor, "rcdeploy was stopped"),
    (Kind::StoppedGuard, "its guard was stopped"),
    (Kind::NoDescriptor, "rcdeploy had no free descriptor"),
    (Kind::FullMemory, "the shared memory was full"),
    (Kind::FullDisk, "the disk of the logs was full"),
    (Kind::SlowDisk, "the disk was slow"),
    (Kind::SystemClock, "the clock of the system was set"),
    (Kind::Clock, "the source of time jumped"),
];

/// How often each trouble was made.
#[derive(Default)]
pub(super) struct Troubles {
    made: [u32; KINDS.len()],
    /// Components that were killed together with others.
    killed: u32,
    /// Components that were killed while the disk was slow or the clock was wrong.
    killed_meanwhile: u32,
    /// Components that failed because the shared memory was full.
    fallen: u32,
}

impl Troubles {
    /// Makes one trouble, and waits until it is over. Only the clock of the system stays as it was
    /// set, until it is set again.
    pub(super) fn make(
        &mut self,
        ground: &Ground,
        dice: &mut Dice,
    ) -> Result<Consequence, Failure> {
        let status = ground.status("rcdeploy").unwrap_or_default();
        let (supervisor, guard) = (process(&status["pid"]), process(&status["guard"]));
        let at = dice.below(KINDS.len());
        let (kind, time) = (KINDS[at].0, dice.time(LONGEST));
        let (Some(supervisor), Some(guard)) = (supervisor, guard) else {
            return Ok(Consequence::Nothing);
        };
        let mut consequence = Consequence::Nothing;
        match (kind, mounts::logs()) {
            (Kind::MassKill, _) => self.killed += kill(ground, &status, 50, dice),
            (Kind::StoppedSupervisor, _) => stop(supervisor, time)?,
            (Kind::StoppedGuard, _) => stop(guard, time)?,
            (Kind::NoDescriptor, _) => without_descriptors(supervisor, time)?,
            (Kind::FullMemory, Some(_)) => {
                full(Path::new(MEMORY), time)?;
                consequence = Consequence::Failures;
            }
            (Kind::FullDisk, Some(logs)) => full(logs, time)?,
            // The memory and the disk of others.
            (Kind::FullMemory | Kind::FullDisk, None) => return Ok(Consequence::Nothing),
            (Kind::SlowDisk | Kind::SystemClock, _) => {
                let Some(shim) = ground.shim() else {
                    return Ok(Consequence::Nothing);
                };
                if kind == Kind::SystemClock {
                    shim.set_clock(dice.below(2 * FAR) as i64 - FAR as i64)?;
                } else {
                    shim.slow_disk(SLOW)?;
                }
                // A process that starts meanwhile writes most.
                self.killed_meanwhile += kill(ground, &status, 20, dice);
                std::thread::sleep(time);
                shim.slow_disk(Duration::ZERO)?;
                consequence = Consequence::WrongTimes;
            }
            (Kind::Clock, _) => jump(ground, &status, time),
        }
        self.made[at] += 1;
        Ok(consequence)
    }

    /// Notes that a component has failed because of a trouble.
    pub(super) fn fell(&mut self) {
        self.fallen += 1;
    }
}

impl std::fmt::Display for Troubles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for ((kind, what), count) in KINDS.iter().zip(self.made) {
            write!(f, "{what} {count} times")?;
            match kind {
                Kind::MassKill => write!(f, " ({} in all)", self.killed)?,
                // The count is that of slow disks, too.
                Kind::SystemClock => write!(f, " ({} killed in both)", self.killed_meanwhile)?,
                Kind::FullMemory => write!(f, " ({} failed)", self.fallen)?,
                _ => {}
            }
            if *kind != Kind::Clock {
                f.write_str(", ")?;
            }
        }
        Ok(())
    }
}

/// Kills so many of a hundred components at once; returns how many were killed.
fn kill(ground: &Ground, status: &Value, part: usize, dice: &mut Dice) -> u32 {
    let components = status["components"].as_array();
    let pids = components.into_iter().flatten().map(|c| &c["pid"]);
    let mut killed = 0;
    for pid in pids.filter_map(pid) {
        if dice.falls(part) {
            killed += u32::from(ground.kill(pid));
        }
    }
    killed
}

fn process(value: &Value) -> Option<Pid> {
    pid(value).and_then(Pid::from_raw)
}

/// Stops a process for a time.
fn stop(process: Pid, time: Duration) -> Result<(), Failure> {
    kill_process(process, Signal::STOP)?;
    std::thread::sleep(time);
    Ok(kill_process(process, Signal::CONT)?)
}

/// Leaves a process no free descriptor for a time.
fn without_descriptors(process: Pid, time: Duration) -> Result<(), Failure> {
    let folder = format!("/proc/{}/fd", process.as_raw_nonzero());
    let open = std::fs::read_dir(folder)?.count() as u64;
    let low = Rlimit {
        current: Some(open),
        // As it is for this process, whose child it is.
        maximum: getrlimit(Resource::Nofile).maximum,
    };
    let before = prlimit(Some(process), Resource::Nofile, low)?;
    std::thread::sleep(time);
    prlimit(Some(process), Resource::Nofile, before)?;
    Ok(())
}

/// Fills the disk of a folder for a time.
fn full(folder: &Path, time: Duration) -> Result<(), Failure> {
    let path = folder.join(FILLER);
    let mut file = File::create(&path)?;
    let block = vec![1; BLOCK];
    let written = loop {
        match file.write(&block) {
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::StorageFull => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    if written.is_ok() {
        std::thread::sleep(time);
    }
    std::fs::remove_file(path)?;
    Ok(written?)
}

/// Lets the simulated time run ahead, then begin again.
fn jump(ground: &Ground, status: &Value, time: Duration) {
    let set = |step: &str, rate: f64| {
        let changes = json!({ "step": step, "rate": rate });
        let changes = changes.as_object().cloned().unwrap_or_default();
        // The source may be dead at the moment.
        let _ = ground.call(CLOCK, &Request::ParametersSet { changes });
    };
    set("1h", 0.0);
    std::thread::sleep(time);
    set("10ms", 1.0);
    let components = status["components"].as_array();
    let mut components = components.into_iter().flatten();
    if let Some(pid) = components
        .find(|component| component["name"] == CLOCK)
        .and_then(|clock| pid(&clock["pid"]))
    {
        ground.kill(pid);
    }
}
