//! All integration tests of CDSL in one program.

mod language;
mod meanings;
mod world;
