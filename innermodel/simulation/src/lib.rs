//! A world that steps: sensors, bases and motors of an `InnerModel` tree in simulated time.
//!
//! [`World`] executes commands by fixed steps of simulated time, and measures with the sensors of
//! the tree. A run depends on the file, the commands and the seed only, never on the speed of the
//! computer.
//!
//! Lengths are millimetres, angles radians, times seconds, where no unit is given.
//!
//! ```
//! use innermodel::InnerModel;
//! use innermodel_simulation::{Speed, World};
//! use std::time::Duration;
//!
//! let text = r#"<innerModel>
//!     <plane id="wall" pz="2050" size="4000,4000,100" collide="1"/>
//!     <differentialrobot id="base" collide="1">
//!         <cylinder id="body" radius="200" length="300" collide="1"/>
//!         <laser id="front" max="5000" angle="1" measures="3"/>
//!     </differentialrobot>
//! </innerModel>"#;
//! let mut world = World::new(InnerModel::parse(text)?, Duration::from_millis(10), 1)?;
//! world.drive("base", Speed { advance: 500.0, ..Speed::default() })?;
//! world.run(100)?;
//! let scan = world.scan("front")?;
//! assert!((scan.ranges[1].distance - 1500.0).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bases;
mod batteries;
mod bodies;
mod commands;
mod devices;
mod dynamics;
mod edit;
mod error;
mod frames;
mod free_path;
mod human;
mod imu;
mod imu_integrator;
mod measure;
mod motors;
mod people;
mod pictures;
mod pose2d;
mod predict;
mod problems;
mod random;
mod ranges;
mod schedule;
mod sensor_noise;
mod sensors;
mod state;
mod step;
mod touch;
mod world;

pub use bases::BaseState;
pub use batteries::BatteryState;
pub use devices::Device;
pub use dynamics::{Dynamics, PushError, StepResult};
pub use edit::WorldSnapshot;
pub use error::Error;
pub use frames::{Cloud, CloudPoint, ImuSample, Picture, Range, Scan, Touch};
pub use motors::{MotorGoal, MotorState};
pub use pose2d::{Pose2D, Speed};
pub use predict::{Collision, Predicting, Prediction};
pub use random::Random;
pub use sensor_noise::SensorNoise;
pub use world::World;

/// The acceleration of free fall in m/s², along −y of the root.
pub const GRAVITY: f64 = 9.81;
