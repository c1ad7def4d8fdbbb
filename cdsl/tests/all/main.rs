//! All integration tests of the CDSL, in one program.

mod language;
mod page;
