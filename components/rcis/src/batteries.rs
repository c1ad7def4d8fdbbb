//! Batteries of robots.

use crate::SpecificWorker;
use innermodel::Kind;
use innermodel_simulation::{Error, World};
use rcis_generated::interfaces::battery_status as battery_calls;
use rcis_generated::types::robo_comp_battery_status as battery;
use rcis_generated::{Batteries, BatteryStates, Context, Member, TBattery};

/// The voltage of an empty battery, and the difference to a full one, in V.
const EMPTY: f64 = 22.0;
const RISE: f64 = 4.0;
/// The charge of a full battery, in A s.
const CAPACITY: f64 = 36_000.0;

fn battery_of(world: &World, id: &str) -> Result<TBattery, Error> {
    let state = world.battery(id)?;
    let tree = world.tree();
    let (endurance, charging) = match tree.node(id)?.kind() {
        Kind::Battery(battery) => (battery.endurance, battery.charging),
        _ => (1.0, 1.0),
    };
    let (states, current) = match (state.is_connected, state.level < 1.0) {
        (true, true) => (BatteryStates::Charging, CAPACITY / charging),
        (true, false) => (BatteryStates::Charged, 0.0),
        (false, _) => (BatteryStates::Disconnected, -CAPACITY / endurance),
    };
    Ok(TBattery {
        percentage: (100.0 * state.level) as f32,
        state: states,
        voltage: (EMPTY + RISE * state.level) as f32,
        current: current as f32,
    })
}

impl Batteries<Context> for SpecificWorker {
    fn get_battery_state(
        &mut self,
        _ctx: &mut Context,
        member: &Member,
    ) -> Result<TBattery, battery_calls::GetBatteryStateError> {
        let state = battery_of(&self.worlds.main, member.name());
        Ok(state.map_err(|error| battery::HardwareFailedException {
            what: error.to_string(),
        })?)
    }
}
