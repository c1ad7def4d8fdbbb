//! What the numbers of a member mean: units of measurement, read from their texts, compared, and
//! converted exactly; axes of frames; representations of rotations and motions.
//!
//! A unit is a product of powers of named units: `mm`, `m/s^2`, `kg*m^2`, `rad/s`, `°C`, `%`.
//! Two units convert into each other if their dimensions are equal.
//!
//! ```
//! use rc_quantity::Unit;
//!
//! let sent = Unit::parse("mm/s").unwrap();
//! let wanted = Unit::parse("m/s").unwrap();
//! let conversion = sent.conversion_to(&wanted).unwrap();
//! assert_eq!(conversion.apply(1500.0), 1.5);
//! assert_eq!(conversion.to_string(), "×1/1000");
//! assert!(sent.conversion_to(&Unit::parse("rad").unwrap()).is_none());
//! ```
//!
//! The crate allocates nothing and depends on `libm` only, so that generated code and small
//! components can link it.
#![no_std]

#[cfg(test)]
extern crate std;

mod axes;
mod conversion;
mod dimension;
mod factor;
mod motion;
mod parse;
mod real;
pub mod rotation;
mod scale;
mod table;
#[cfg(test)]
mod tests;
mod unit;

pub use axes::{Axes, Direction, NoAxes};
pub use conversion::Conversion;
pub use dimension::{Base, Dimension};
pub use factor::Factor;
pub use motion::{Inertia, Layout, Spatial, Transform, covariance};
pub use parse::{MAX_LENGTH, UnitError, UnitProblem};
pub use real::Real;
pub use scale::Scale;
pub use table::{NamedUnit, UNITS, names};
pub use unit::Unit;
