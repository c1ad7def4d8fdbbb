//! Collisions, distances and rays in the tree of `innermodel`.
//!
//! [`Space`] holds the bodies of one version. [`Space::update`] moves it to another version in a
//! time that depends on what moved.
//!
//! ```
//! use innermodel::{InnerModel, Point, Time, Vector};
//! use innermodel_collision::Space;
//!
//! let model = InnerModel::parse(
//!     r#"<innerModel>
//!            <plane id="floor" ny="1" size="1000,1000,10" collide="1"/>
//!            <transform id="ball" ty="500"><sphere id="body" radius="50" collide="1"/></transform>
//!        </innerModel>"#,
//! )?;
//! let space = Space::new(&model.snapshot());
//! let near = space.distance("floor", "ball")?.expect("two bodies");
//! assert!((near.distance - 445.0).abs() < 1e-6);
//! let hit = space.ray("ball", Point::origin(), -Vector::y(), 1e4, &|_| true)?;
//! # let _ = hit;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod allowed;
mod bodies;
mod mesh_rays;
mod queries;
mod rays;
mod touching;

pub use bodies::{BodyError, Problem, Space};
pub use parry3d_f64 as parry;
pub use queries::{Caster, Contact, Hit, Near};
pub use touching::Touching;
