//! All integration tests of the IDSL, in one program.

mod language;
mod page;
