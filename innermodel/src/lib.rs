//! The robot and its world as one tree of frames, exact and alive.
//!
//! [`InnerModel`] holds the tree. A reader takes a [`Snapshot`], which never changes, and asks it
//! for transforms, without waiting. A writer changes several things at once with
//! [`InnerModel::change`] and publishes them as one new version.
//!
//! Lengths are millimetres, angles radians. The frame is left-handed: x points right, y up, z to
//! the front. [`frames`] converts to the frame of ROS.
//!
//! ```
//! use innermodel::{InnerModel, Point, Time};
//!
//! let model = InnerModel::parse(
//!     r#"<innerModel>
//!            <transform id="base" tx="1000">
//!                <joint id="shoulder" axis="z" ty="300" min="-2" max="2">
//!                    <translation id="hand" tx="500"/>
//!                </joint>
//!            </transform>
//!        </innerModel>"#,
//! )?;
//! model.change(Time::ZERO, |edit| edit.set_joint("shoulder", std::f64::consts::FRAC_PI_2))?;
//! let now = model.snapshot();
//! let hand = now.transform("root", Point::origin(), "hand")?;
//! assert!((hand - Point::new(1000.0, 800.0, 0.0)).norm() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cache;
mod clouds;
mod difference;
mod document;
mod edit;
mod edit_attributes;
mod error;
mod files;
pub mod frames;
mod history;
mod link;
mod model;
mod points;
pub mod sensors;
pub mod shapes;
pub mod slots;
mod snapshot;
mod transform;

pub use clouds::{Clouds, ColouredPoint};
pub use difference::{Change, Difference};
pub use edit::{Clamped, Edit, NewNode};
pub use error::Error;
pub use files::{Folders, LoadError, read, read_text};
pub use history::{Keep, Moment};
pub use innermodel_language as language;
pub use innermodel_language::model::{self as kinds, Kind, Pose, ROOT};
pub use link::NodeId;
pub use model::InnerModel;
pub use snapshot::{Key, NodeRef, Snapshot};
pub use transform::Transform;

/// A point in millimetres.
pub type Point = nalgebra::Point3<f64>;
/// A direction or a difference of points.
pub type Vector = nalgebra::Vector3<f64>;
/// A rotation.
pub type Matrix = nalgebra::Matrix3<f64>;
/// A time since the start of the clock that its writer uses.
pub type Time = std::time::Duration;
