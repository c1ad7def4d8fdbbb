//! Plans and programs.

mod plans;
mod programs;
