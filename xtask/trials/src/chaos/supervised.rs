//! The network of `ground` under rcdeploy, which restarts killed components. Sometimes the supervisor or
//! its guard is killed.

use super::ground::{END, Ground, LOOK, NAMES, RECOVERY};
use super::{Dice, Kills, Tally};
use crate::programs::Failure;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::process::{Child, ChildStdout, Stdio};
use std::time::{Duration, Instant};

/// The most kills of one component in one network: the pauses before its restarts double.
const EACH: usize = 8;
/// The most kills between two checks that all components work.
const UNSEEN: usize = 4;

pub(super) fn run(
    ground: &Ground,
    dice: &mut Dice,
    orders: Kills,
    tally: &mut Tally,
) -> Result<(), Failure> {
    while tally.kills < orders.kills {
        if orders.kills - tally.kills > 1 && dice.falls(30) {
            // A kill during the start. The next rcdeploy waits for the guard of this one.
            let mut supervisor = Supervisor::start(ground)?;
            std::thread::sleep(dice.time(orders.spread * 4));
            supervisor.kill()?;
            tally.kill(true);
        }
        session(ground, dice, orders, tally)?;
        ground.nothing_is_left()?;
    }
    Ok(())
}

/// One `rcdeploy up`, from its start to its end.
fn session(
    ground: &Ground,
    dice: &mut Dice,
    orders: Kills,
    tally: &mut Tally,
) -> Result<(), Failure> {
    let mut supervisor = Supervisor::start(ground)?;
    let begun = Instant::now();
    ground.works()?;
    tally.recovered(begun.elapsed());
    let mut killed = [0; NAMES.len()];
    while tally.kills < orders.kills && killed.iter().all(|count| *count < EACH) {
        let mut since = Instant::now();
        for _ in 0..=dice.below(UNSEEN) {
            // Once while it works, then sometimes right after each restart.
            let at = dice.below(NAMES.len());
            let mut last = None;
            while tally.kills < orders.kills && killed[at] < EACH {
                let wait = dice.time(orders.spread);
                let (process, was_ready) = kill_one(ground, NAMES[at], last, wait)?;
                tally.kill(!was_ready);
                if ground.is_one() {
                    killed.iter_mut().for_each(|count| *count += 1);
                } else {
                    killed[at] += 1;
                }
                since = Instant::now();
                last = Some(process);
                if dice.falls(40) {
                    break;
                }
            }
        }
        if tally.kills < orders.kills && dice.falls(10) {
            let status = ground.status("rcdeploy")?;
            if let Some(guard) = pid(&status["guard"])
                && ground.kill(guard)
            {
                tally.kill(false);
            }
        }
        ground.works().map_err(|error| {
            let status = ground.status("rcdeploy");
            let status = status.map_or_else(|error| error.to_string(), |status| status.to_string());
            format!("{error}\nrcdeploy: {status}")
        })?;
        tally.recovered(since.elapsed());
    }
    // The last rcdeploy is stopped, not killed.
    if orders.kills - tally.kills > 1 && dice.falls(30) {
        tally.kill(false);
        return supervisor.kill();
    }
    supervisor.stop()
}

/// Kills a ready component; with `last`, kills the process that follows `last`, some time after its
/// start. Returns the process, and whether it was ready.
pub(super) fn kill_one(
    ground: &Ground,
    name: &str,
    last: Option<i32>,
    wait: Duration,
) -> Result<(i32, bool), Failure> {
    let end = Instant::now() + RECOVERY;
    loop {
        // On a busy machine an answer may be late; a missing answer is an error below.
        let status = ground.status("rcdeploy").unwrap_or_default();
        let component = component(&status, name);
        if let Some(pid) = pid(&component["pid"])
            && last.map_or(component["state"] == "running", |last| last != pid)
        {
            std::thread::sleep(wait);
            let was_ready = ground.is_ready(name);
            if ground.kill(pid) {
                return Ok((pid, was_ready));
            }
        }
        if Instant::now() > end {
            return Err(format!("rcdeploy does not start {name} again: {status}").into());
        }
        std::thread::sleep(LOOK / 2);
    }
}

fn component<'s>(status: &'s Value, name: &str) -> &'s Value {
    let components = status["components"].as_array();
    let mut components = components.into_iter().flatten();
    components
        .find(|component| component["name"] == name)
        .unwrap_or(&Value::Null)
}

pub(super) fn pid(value: &Value) -> Option<i32> {
    value.as_i64().and_then(|pid| pid.try_into().ok())
}

/// `rcdeploy up`. Dropping it kills it, and its guard cleans up.
pub(super) struct Supervisor {
    child: Child,
}

impl Supervisor {
    fn start(ground: &Ground) -> Result<Self, Failure> {
        Self::start_telling(ground, Stdio::null())
    }

    /// The file of its events.
    pub(super) fn start_telling(ground: &Ground, events: Stdio) -> Result<Self, Failure> {
        let mut command = ground.command("rcdeploy")?;
        command
            .args(["up", "--profile", "dev", "--format", "json"])
            .arg(ground.deployment())
            .stdout(events);
        Ok(Self {
            child: command.spawn()?,
        })
    }

    pub(super) fn events(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    pub(super) fn kill(&mut self) -> Result<(), Failure> {
        self.child.kill()?;
        self.child.wait()?;
        Ok(())
    }

    /// Stops it as Ctrl-C does.
    pub(super) fn stop(&mut self) -> Result<(), Failure> {
        kill_process(Pid::from_child(&self.child), Signal::INT)?;
        let end = Instant::now() + END;
        loop {
            if let Some(status) = self.child.try_wait()? {
                return if status.success() {
                    Ok(())
                } else {
                    Err(format!("rcdeploy up was stopped and ended with {status}").into())
                };
            }
            if Instant::now() > end {
                return Err("rcdeploy up does not end".into());
            }
            std::thread::sleep(LOOK);
        }
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        let _ = self.kill();
    }
}
