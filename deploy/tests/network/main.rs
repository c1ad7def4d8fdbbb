//! Whole networks of the components of this repository.

mod camera;
mod dds;
mod dds_bytes;
mod dds_strangers;
mod groups;
mod joints;
mod late;
mod params;
mod patrol;
mod pictures;
mod probe;
mod python;
mod restored;
mod settings;
mod site;
mod strangers;
mod swap;
mod variant;
mod watched;
