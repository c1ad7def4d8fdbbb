//! Tests of collisions.

mod coal;
mod hostile;
mod rays;
mod scenes;
mod shapes;

use innermodel::{Folders, InnerModel};
use std::path::Path;

fn load(name: &str) -> InnerModel {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    InnerModel::load(&folder.join(name), &Folders::default()).expect("a scene")
}
