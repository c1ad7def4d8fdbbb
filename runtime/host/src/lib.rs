//! The parts of the runtime that a worker in another language needs: a component that is described
//! by JSON, values whose types are known at run time, and the connections of a worker by numbers of
//! slots.
//!
//! This crate names no language. An extension module is a skin on it: it converts values of
//! [`rc_values`] from and to objects of its language, and calls the functions of the worker.
//!
//! - [`Program::read`] reads the description that a generated package hands over.
//! - A [`Session`] has everything that a context reaches, on the thread of the worker; [`session`]
//!   finds it.
//! - [`link`] has the calls and publications of a context, [`bodies`] those of a language with codecs of its own.
//! - [`Sample`] is the argument of a topic's handler, [`Aligned`] and [`Lent`] the memory of values
//!   in place.
//!
#![doc = include_str!("example.md")]

mod aligned;
mod backends;
pub mod bodies;
mod description;
mod error;
mod kept_count;
mod lent;
pub mod link;
mod replies;
mod sample;
pub mod session;
mod wire;

pub use aligned::Aligned;
pub use description::{Machine, Operation, Program, Slot};
pub use error::HostError;
pub use kept_count::{KeptCount, KeptCounts};
pub use lent::{Lent, drop_abandoned};
pub use replies::undecodable;
pub use sample::{Image, Sample};
pub use session::{Number, Session};
pub use wire::{read, write};
