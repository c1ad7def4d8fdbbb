//! Troubles of a network under load that are no kill of a single process: many deaths at once, a
//! supervisor or a guard that is stopped for a while, a supervisor without a free descriptor.

use super::Dice;
use super::ground::Ground;
use super::supervised::pid;
use crate::programs::Failure;
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, kill_process, prlimit};
use serde_json::Value;
use std::time::Duration;

/// The longest time of a trouble that ends by itself.
const LONGEST: Duration = Duration::from_secs(1);
/// What the system says to a process that has no free descriptor.
pub(super) const NO_DESCRIPTOR: &str = "Too many open files";

/// How often each trouble was made.
#[derive(Default)]
pub(super) struct Troubles {
    mass_kills: u32,
    /// Components that were killed together with others.
    pub(super) killed: u32,
    stopped_supervisors: u32,
    stopped_guards: u32,
    without_descriptors: u32,
}

impl Troubles {
    /// Makes one trouble, and waits until it is over.
    pub(super) fn make(&mut self, ground: &Ground, dice: &mut Dice) -> Result<(), Failure> {
        let status = ground.status("rcdeploy").unwrap_or_default();
        let (supervisor, guard) = (process(&status["pid"]), process(&status["guard"]));
        let Some(supervisor) = supervisor else {
            return Ok(());
        };
        let time = dice.time(LONGEST);
        match (dice.below(4), guard) {
            (0, _) => {
                let components = status["components"].as_array();
                let pids = components.into_iter().flatten().map(|c| &c["pid"]);
                for pid in pids.filter_map(pid) {
                    if dice.falls(50) {
                        self.killed += u32::from(ground.kill(pid));
                    }
                }
                self.mass_kills += 1;
            }
            (1, _) => {
                stop(supervisor, time)?;
                self.stopped_supervisors += 1;
            }
            (2, Some(guard)) => {
                stop(guard, time)?;
                self.stopped_guards += 1;
            }
            _ => {
                without_descriptors(supervisor, time)?;
                self.without_descriptors += 1;
            }
        }
        Ok(())
    }
}

impl std::fmt::Display for Troubles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} times half of the components were killed at once ({} in all), rcdeploy was stopped {} times, its guard {} times, \
             rcdeploy had no free descriptor {} times",
            self.mass_kills,
            self.killed,
            self.stopped_supervisors,
            self.stopped_guards,
            self.without_descriptors
        )
    }
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
