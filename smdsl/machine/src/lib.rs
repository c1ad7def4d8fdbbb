//! The interpreter of state machines: the semantics of W3C's State Chart XML 1.0
//! (<https://www.w3.org/TR/scxml/>, appendix D) over tables that are made at generation.
//!
//! A [`Chart`] is the machine as tables. A [`Session`] is the worker's view of a running machine:
//! the active states and the queue of events. An [`Interpreter`] takes the steps, and a [`Host`]
//! runs the functions of the worker. No step allocates.
//!
#![doc = include_str!("example.md")]

mod chart;
mod interpreter;
mod session;
mod set;

pub use chart::{Action, Chart, Condition, Kind, NONE, Range, State, Transition, Trigger};
pub use interpreter::{Error, Failed, Host, Interpreter, MAX_DELAYED, MAX_MICROSTEPS, Step};
pub use session::{MAX_EVENTS, Refused, Session};
pub use set::Set;
