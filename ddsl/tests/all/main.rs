//! All integration tests of DDSL in one program.

mod adaptors;
mod chains;
mod language;
mod meanings;
mod members;
mod network;
mod page;
mod peers;
mod processes;
mod settings;
mod size;
mod transports;
mod units;
