//! All integration tests of the line protocol in one program.

mod components;
mod decoding;
mod golden;
mod listener;
mod messages;
mod server;
