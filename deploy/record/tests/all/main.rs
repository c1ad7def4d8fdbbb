//! Recordings: written and read, cut, split, and opened by the libraries of others.

#[path = "../../../tests/all/python.rs"]
#[allow(dead_code, reason = "tests of networks use more of it")]
mod python;

mod damaged;
mod files;
mod hostile;
mod latched;
mod strangers;
mod types;
