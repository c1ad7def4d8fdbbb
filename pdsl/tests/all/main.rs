//! All integration tests of PDSL in one program.

mod hostile;
mod imports;
mod language;
mod page;
mod rules;
