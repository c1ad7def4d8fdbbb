//! Forces in a simulated world, by the library rapier: gravity, contacts, friction, joints with
//! motors.
//!
//! A `transform` with `engine="bullet"` is a body that forces move; its mass is `mass` (default 1
//! kg), its shape that of all bodies with `collide` below it, up to the next such transform. A
//! `joint` or `prismaticJoint` right above it, below another such transform or not, connects both,
//! and its motor turns it. Everything else with `collide` is an obstacle that moves with the tree.
//!
//! ```
//! use innermodel::InnerModel;
//! use innermodel_physics::Physics;
//! use innermodel_simulation::World;
//! use std::time::Duration;
//!
//! let text = r#"<innerModel><transform id="stone" ty="10000" engine="bullet" mass="2">
//!     <sphere id="ball" radius="50" collide="1"/>
//! </transform></innerModel>"#;
//! let mut world = World::new(InnerModel::parse(text)?, Duration::from_millis(10), 1)?;
//! world.set_dynamics(Some(Box::new(Physics::new())));
//! world.run(100)?;
//! let [_, y, _] = world.tree().pose("root", "stone")?.translation;
//! assert!((10_000.0 - y - 4905.0).abs() < 5.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bodies;
mod joints;
mod motors;
mod physics;

pub use physics::Physics;
