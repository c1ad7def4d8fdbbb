//! The component `pose_monitor`.

mod chart;
mod screen;
mod specific_worker;
mod track;

pub use specific_worker::SpecificWorker;
