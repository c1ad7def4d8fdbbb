//! Exact recordings: everything that decides the life of a component, and the run that repeats it.
//!
//! The worker is a function of its inputs: which of its functions runs next, with which message,
//! the readings of the clock and of random numbers, and the results of calls. With `--record FILE`,
//! [`recorder::Recorder`] writes them in their order, and with them everything that the worker
//! sends. With `--replay`, [`run::replay`] gives them to the worker again, without a middleware and
//! without waiting, and compares what it sends byte for byte. `docs/recording.md` describes the
//! file.

pub(crate) mod component;
pub(crate) mod entry;
mod error_codes;
pub(crate) mod mode;
mod output;
mod ports;
pub(crate) mod recorder;
mod replay;
pub(crate) mod replayed_ports;
mod replayed_reply;
mod report;
pub(crate) mod run;
pub(crate) mod start;
