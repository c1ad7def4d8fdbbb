//! Tests of the tree.

mod changes;
mod hostile;
mod numbers;
mod oracle;
mod past;
mod threads;

use innermodel::{Folders, InnerModel};
use std::path::{Path, PathBuf};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(name)
}

fn load(name: &str) -> InnerModel {
    InnerModel::load(&scene(name), &Folders::default()).expect("a scene")
}
