//! Plans and programs.

mod kernels;
mod plans;
mod programs;
