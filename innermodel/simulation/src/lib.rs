//! A world that steps: sensors, bases and motors of an `InnerModel` tree in simulated time.
//!
//! [`World`] moves what is commanded by fixed steps of simulated time, and measures with the
//! sensors of the tree. A run depends on the file, the commands and the seed only, never on the
//! speed of the computer.
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

mod base;
mod battery;
mod devices;
mod dynamics;
mod error;
mod human;
mod imu;
mod measure;
mod motor;
mod picture;
mod planar;
mod predict;
mod random;
mod ranges;
mod schedule;
mod signal;
mod step;
mod touch;
mod world;

pub use base::{BaseState, Speed};
pub use battery::BatteryState;
pub use devices::Device;
pub use dynamics::{Dynamics, Moved, NotPushed};
pub use error::Error;
pub use imu::Inertia;
pub use motor::{MotorGoal, MotorState};
pub use picture::Picture;
pub use planar::Planar;
pub use predict::{Collision, Prediction};
pub use random::Random;
pub use ranges::{Cloud, CloudPoint, Range, Scan};
pub use signal::Errors;
pub use touch::Touch;
pub use world::{Kept, World};

/// The acceleration of free fall in m/s², along −y of the root.
pub const GRAVITY: f64 = 9.81;
