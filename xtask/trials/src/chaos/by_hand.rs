//! Components started by hand: no process holds their services or cleans up after them.

use super::ground::{END, Ground, LOOK, NAMES, NETWORK, PROGRAMS, RECOVERY};
use super::{Dice, Kills, Tally};
use crate::programs::Failure;
use rustix::process::{Pid, Signal, kill_process};
use std::process::Child;
use std::time::{Duration, Instant};

/// At least one round in so many checks that all components work.
const UNSEEN: usize = 5;

/// The time that the components need at least until all of them run.
pub(super) fn time_to_start(ground: &Ground) -> Result<Duration, Failure> {
    let mut best = RECOVERY;
    for _ in 0..3 {
        let mut hands = Hands::none(ground);
        let begin = Instant::now();
        hands.start_all()?;
        while !NAMES.iter().all(|name| ground.is_ready(name)) {
            if begin.elapsed() > RECOVERY {
                return Err(format!("not all of them run within {RECOVERY:?}").into());
            }
            std::thread::sleep(LOOK / 2);
        }
        best = best.min(begin.elapsed());
        hands.stop()?;
    }
    Ok(best)
}

pub(super) fn run(
    ground: &Ground,
    dice: &mut Dice,
    orders: Kills,
    tally: &mut Tally,
) -> Result<(), Failure> {
    let mut hands = Hands::none(ground);
    hands.start_all()?;
    while tally.kills + 1 < orders.kills {
        for _ in 0..=dice.below(UNSEEN) {
            hands.round(dice, orders, tally)?;
        }
        let since = Instant::now();
        hands.start_all()?;
        hands.all_work()?;
        tally.recovered(since.elapsed());
    }
    if orders.kills > 0 {
        // One component is killed and not started again: the others clean up after it.
        hands.kill(dice.below(NAMES.len()))?;
        tally.kill(false);
    }
    hands.stop()
}

/// The running processes. Dropping this kills them.
struct Hands<'g> {
    ground: &'g Ground,
    running: [Option<Child>; 3],
}

impl<'g> Hands<'g> {
    fn none(ground: &'g Ground) -> Self {
        Self {
            ground,
            running: [const { None }; 3],
        }
    }

    /// Starts all components that do not run.
    fn start_all(&mut self) -> Result<(), Failure> {
        for at in 0..NAMES.len() {
            if self.running[at].is_none() {
                self.start(at)?;
            }
        }
        Ok(())
    }

    fn start(&mut self, at: usize) -> Result<(), Failure> {
        let mut command = self.ground.command(PROGRAMS[at])?;
        command.args(["--network", NETWORK, "--name", NAMES[at], "--log", "warn"]);
        self.running[at] = Some(command.spawn()?);
        Ok(())
    }

    /// Kills some running components; starts some others at the same time and kills them during
    /// their start.
    fn round(&mut self, dice: &mut Dice, orders: Kills, tally: &mut Tally) -> Result<(), Failure> {
        let mut due: Vec<(Duration, usize)> = Vec::new();
        for at in 0..NAMES.len() {
            let runs = self.running[at].is_some();
            if runs && dice.falls(40) {
                due.push((dice.time(orders.spread), at));
            } else if !runs && dice.falls(80) {
                self.start(at)?;
                if dice.falls(75) {
                    due.push((dice.time(orders.spread), at));
                }
            }
        }
        due.sort_unstable();
        let begin = Instant::now();
        for (moment, at) in due {
            if tally.kills + 1 >= orders.kills {
                return Ok(());
            }
            std::thread::sleep(moment.saturating_sub(begin.elapsed()));
            let ready = self.ground.is_ready(NAMES[at]);
            self.kill(at)?;
            tally.kill(!ready);
        }
        Ok(())
    }

    fn kill(&mut self, at: usize) -> Result<(), Failure> {
        if let Some(mut child) = self.running[at].take() {
            if let Some(status) = child.try_wait()? {
                return Err(format!("{} ended by itself: {status}", NAMES[at]).into());
            }
            child.kill()?;
            child.wait()?;
        }
        Ok(())
    }

    fn all_work(&mut self) -> Result<(), Failure> {
        let worked = self.ground.works();
        for (name, child) in NAMES.iter().zip(&mut self.running) {
            if let Some(child) = child
                && let Some(status) = child.try_wait()?
            {
                return Err(
                    format!("{name} ended by itself: {status}; see its log in the folder").into(),
                );
            }
        }
        worked
    }

    /// Stops all components.
    fn stop(&mut self) -> Result<(), Failure> {
        for (name, child) in NAMES.iter().zip(&mut self.running).rev() {
            let Some(child) = child else { continue };
            kill_process(Pid::from_child(child), Signal::TERM)?;
            let end = Instant::now() + END.min(RECOVERY);
            let status = loop {
                if let Some(status) = child.try_wait()? {
                    break status;
                }
                if Instant::now() > end {
                    return Err(format!("{name} does not end").into());
                }
                std::thread::sleep(LOOK);
            };
            if !status.success() {
                return Err(format!("{name} was stopped and ended with {status}").into());
            }
        }
        Ok(())
    }
}

impl Drop for Hands<'_> {
    fn drop(&mut self) {
        for child in self.running.iter_mut().flatten() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
