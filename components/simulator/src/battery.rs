//! The battery of the robot.

use simulator_generated::{BatteryStates, TBattery};

/// The voltage of an empty battery, and the difference to a full one, in V.
const EMPTY: f64 = 22.0;
const RISE: f64 = 4.0;
/// The charge of a full battery, in A s.
const CAPACITY: f64 = 36_000.0;

/// A battery that is discharged while the robot moves, and charged while it stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Battery {
    /// How long a full one lasts, in s.
    endurance: f64,
    /// How long an empty one takes to charge, in s.
    charging: f64,
    /// From 0 to 1.
    level: f64,
    is_connected: bool,
}

impl Battery {
    /// A full battery. Times are in s.
    pub(crate) fn new(endurance: f64, charging: f64) -> Self {
        Self {
            endurance,
            charging,
            level: 1.0,
            is_connected: true,
        }
    }

    /// Advances time, in s. A robot that stands is connected to the charger.
    pub(crate) fn step(&mut self, seconds: f64, stands: bool) {
        self.is_connected = stands;
        let change = if stands {
            seconds / self.charging
        } else {
            -seconds / self.endurance
        };
        self.level = (self.level + change).clamp(0.0, 1.0);
    }

    /// Whether the robot cannot move any more.
    pub(crate) fn is_empty(&self) -> bool {
        self.level <= 0.0
    }

    /// Measurement of the battery.
    pub(crate) fn state(&self) -> TBattery {
        let (state, current) = match (self.is_connected, self.level < 1.0) {
            (true, true) => (BatteryStates::Charging, CAPACITY / self.charging),
            (true, false) => (BatteryStates::Charged, 0.0),
            (false, _) => (BatteryStates::Disconnected, -CAPACITY / self.endurance),
        };
        TBattery {
            percentage: (100.0 * self.level) as f32,
            state,
            voltage: (EMPTY + RISE * self.level) as f32,
            current: current as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_discharges_and_standing_charges() {
        let mut battery = Battery::new(100.0, 10.0);
        assert_eq!(battery.state().state, BatteryStates::Charged);
        battery.step(50.0, false);
        let state = battery.state();
        assert_eq!(state.state, BatteryStates::Disconnected);
        assert!((state.percentage - 50.0).abs() < 1e-3 && state.current < 0.0);
        battery.step(60.0, false);
        assert!(battery.is_empty());
        battery.step(2.0, true);
        let state = battery.state();
        assert_eq!(state.state, BatteryStates::Charging);
        assert!((state.percentage - 20.0).abs() < 1e-3 && state.current > 0.0);
        battery.step(9.0, true);
        assert_eq!(battery.state().state, BatteryStates::Charged);
    }
}
