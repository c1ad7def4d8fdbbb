//! The component `rcis`.

mod batteries;
mod control;
mod drawing;
mod elements;
mod follow;
mod imus;
mod manager;
mod motors;
mod pictures;
mod predictions;
mod ranges;
mod refusal;
mod requests;
mod robots;
mod scene;
mod specific_worker;
mod steps;
mod warnings;
mod window;
mod worlds;

pub use specific_worker::SpecificWorker;
