//! All integration tests of the DDSL, in one program.

mod language;
mod network;
mod page;
mod size;
