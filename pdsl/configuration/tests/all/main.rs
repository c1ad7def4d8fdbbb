//! All integration tests of configurations in one program.

mod check;
mod live;
mod paths;
mod random;
mod removal;
mod rules;
mod saving;
mod template;
mod update;
