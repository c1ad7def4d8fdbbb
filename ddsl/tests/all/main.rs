//! All integration tests of DDSL in one program.

mod language;
mod members;
mod network;
mod page;
mod settings;
mod size;
mod units;
