//! Makes the trouble that a parameter names.

use neighbour_generated::tracing::info;
use neighbour_generated::{
    BatteryStatus, Context, GetBatteryStateError, HardwareFailedException, TBattery, Worker,
    WorkerError,
};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

pub struct SpecificWorker {
    witness: Option<File>,
}

impl SpecificWorker {
    /// Notes what began at `begun` and ends now.
    fn note(&mut self, begun: u128, is_failed: bool) -> std::io::Result<()> {
        let Some(witness) = &mut self.witness else {
            return Ok(());
        };
        let result = if is_failed { " failed" } else { "" };
        // One write: nobody reads half a line of a program that is killed.
        let line = format!("{begun} {}{result}\n", unix_time());
        witness.write_all(line.as_bytes())
    }
}

/// Nanoseconds since 1970. All processes of a computer share this clock, also those whose monotonic
/// clock is another one.
fn unix_time() -> u128 {
    let time = SystemTime::now().duration_since(UNIX_EPOCH);
    time.unwrap_or_default().as_nanos()
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        match ctx.params.does.as_str() {
            "fail at start" => Err(WorkerError::Failed("the cable is loose".to_owned())),
            "panic at start" => panic!("the cable burns"),
            _ => {
                info!("{} begins", ctx.name());
                let path = &ctx.params.witness;
                let open = || OpenOptions::new().create(true).append(true).open(path);
                let witness = if path.is_empty() {
                    Ok(None)
                } else {
                    open().map(Some)
                };
                let witness = witness.map_err(|error| WorkerError::Failed(error.to_string()))?;
                Ok(Self { witness })
            }
        }
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        match ctx.params.does.as_str() {
            "panic" => panic!("the cable burns"),
            "fail" => return Err(WorkerError::Fatal("the cable is cut".to_owned())),
            "hang" => hang(),
            "stop" => ctx.stop("its work is done"),
            "call" => {
                // The other one may call back meanwhile, and wait for its own limit.
                ctx.other.set_timeout(Duration::from_secs(5));
                let begun = unix_time();
                let answer = ctx.other.get_battery_state();
                if let Err(error) = self.note(begun, answer.is_err()) {
                    return Err(WorkerError::Failed(error.to_string()));
                }
                match answer {
                    Ok(battery) => info!("the other has {}", battery.percentage),
                    Err(error) => info!("the other fails: {error}"),
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn finalize(&mut self, ctx: &mut Context) {
        if ctx.params.does == "hang at the end" {
            hang();
        }
        info!("{} ends", ctx.name());
    }
}

impl BatteryStatus<Context> for SpecificWorker {
    fn get_battery_state(&mut self, ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        let begun = unix_time();
        std::thread::sleep(ctx.params.delay);
        let answer = match ctx.params.does.as_str() {
            "call back" => ctx.other.get_battery_state().map(drop),
            _ => Ok(()),
        };
        let noted = self.note(begun, answer.is_err());
        let answer = answer.map_err(|error| format!("no answer to its own call: {error}"));
        let answer = answer.and(noted.map_err(|error| error.to_string()));
        if let Err(what) = answer {
            return Err(HardwareFailedException { what }.into());
        }
        Ok(TBattery {
            percentage: ctx.params.level,
            ..TBattery::default()
        })
    }
}

/// For as long as no test lasts.
fn hang() {
    std::thread::sleep(Duration::from_secs(3600));
}
