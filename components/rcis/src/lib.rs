//! The component `rcis`.

mod control;
mod elements;
mod manager;
mod motors;
mod pictures;
mod ranges;
mod refusal;
mod robots;
mod scene;
mod specific_worker;
mod worlds;

pub use specific_worker::SpecificWorker;
