//! All integration tests of the PDSL, in one program.

mod hostile;
mod imports;
mod language;
mod page;
mod rules;
