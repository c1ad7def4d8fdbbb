//! All integration tests of IDSL in one program.

mod language;
