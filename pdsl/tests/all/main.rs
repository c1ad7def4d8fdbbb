//! All integration tests of the PDSL and of configurations, in one program.

mod config;
mod hostile;
mod imports;
mod language;
mod live;
mod page;
mod random;
mod rules;
mod update;
