//! InnerModel files: the robot and its world as one tree, in XML.
//!
//! [`load`] reads a file with all that it includes into a [`Document`] and reports errors.
//! [`print()`] writes a document that loads as an equal one. [`format()`] changes the layout of a text
//! and not its content. [`rewrite`] changes single elements of a text. Lengths of a document are
//! millimetres, angles radians, whatever the unit of the file.
//!
//! This crate does no input or output: a [`Loader`] hands it the texts. The crate `innermodel` has
//! the tree that changes at run time.
//!
#![doc = include_str!("example.md")]

mod attributes;
mod check;
mod elements;
mod format;
mod include;
pub mod model;
mod print;
mod read;
pub mod rewrite;
pub mod slots;
mod units;

pub use elements::{ROOT, elements};
pub use format::{format, is_innermodel};
pub use include::Loader;
pub use model::{Document, Kind, Node, Pose};
pub use print::{element, print};
pub use read::{load, parse};
