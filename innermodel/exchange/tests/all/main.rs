//! Exports contain the same tree.

mod gltf;
mod hostile;
mod urdf;

use innermodel::language::Document;
use innermodel::{Folders, InnerModel};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::Path;

/// A scene of this repository.
fn scene(name: &str) -> Document {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let read = innermodel::read(&folder.join(name), &Folders::default());
    read.expect("a scene").0
}

/// Reads a URDF text, and returns what was found as well.
fn imported(text: &str) -> (Document, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("robot.urdf", text);
    let (document, found) = innermodel_exchange::urdf::read(&sources, source);
    (document, render(&sources, &found, Format::Short))
}

fn model(document: &Document) -> InnerModel {
    InnerModel::from_document(document).expect("a tree")
}
