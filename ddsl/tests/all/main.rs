//! All integration tests of DDSL in one program.

mod adaptors;
mod chains;
mod composites;
mod language;
mod meanings;
mod members;
mod network;
mod page;
mod peers;
mod processes;
mod settings;
mod size;
mod times;
mod transports;
mod units;
