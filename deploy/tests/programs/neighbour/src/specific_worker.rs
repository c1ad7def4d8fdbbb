//! Makes the trouble that a parameter names.

use neighbour_generated::tracing::info;
use neighbour_generated::{
    BatteryStatus, Context, GetBatteryStateError, HardwareFailedException, TBattery, Worker,
    WorkerError,
};
use std::time::Duration;

pub struct SpecificWorker;

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        match ctx.params.does.as_str() {
            "fail at start" => Err(WorkerError::Failed("the cable is loose".to_owned())),
            "panic at start" => panic!("the cable burns"),
            _ => {
                info!("{} begins", ctx.name());
                Ok(Self)
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
                match ctx.other.get_battery_state() {
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
        std::thread::sleep(ctx.params.delay);
        if ctx.params.does == "call back"
            && let Err(error) = ctx.other.get_battery_state()
        {
            let what = format!("no answer to its own call: {error}");
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
