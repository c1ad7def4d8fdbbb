//! Whole networks of the components of this repository.

mod asker;
mod bytes;
mod camera;
mod changed;
mod dds;
mod dds_bytes;
mod dds_strangers;
#[path = "../../../codegen/tests/export/debian.rs"]
mod debian;
mod groups;
mod joints;
mod late;
mod params;
mod patrol;
mod pictures;
mod probe;
#[path = "../pty/mod.rs"]
mod pty;
mod python;
mod restored;
mod ros_bytes;
mod ros_fast;
mod ros_parameters;
mod ros_real;
mod ros_strangers;
mod ros_traps;
mod settings;
mod site;
mod strangers;
mod swap;
mod terminal;
mod variant;
mod watched;
