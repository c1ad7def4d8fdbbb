//! All integration tests of CDSL in one program.

mod freshness;
mod language;
mod meanings;
mod world;
