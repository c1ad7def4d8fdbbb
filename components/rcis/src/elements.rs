//! Elements of a file that clients send.

use inner_model_manager::{Refusal, readable_mesh};
use innermodel::Folders;
use innermodel::Kind;
use innermodel::kinds::Mesh;
use innermodel::language::Document;
use rc_diagnostics::foreign;
use std::path::{Component, Path};

/// The most nodes of a world: clients add nodes.
pub(crate) const MOST_NODES: usize = 100_000;

/// Reads elements in the form of the contents of a scene's outermost one. Their meshes are readable
/// files in the folder of the scene.
pub(crate) fn read(scene: &Path, elements: &str) -> Result<Document, Refusal> {
    let text = format!("<innerModel>{elements}</innerModel>");
    let read = innermodel::read_text(&text, scene, &Folders::default());
    let (document, _) = read.map_err(|error| Refusal::Text(error.to_string()))?;
    for node in &document.nodes {
        if let Kind::Mesh(mesh) = &node.kind {
            check_mesh(scene, mesh)?;
        }
    }
    Ok(document)
}

/// A client gets no files of the computer but those of the scene.
fn check_mesh(scene: &Path, mesh: &Mesh) -> Result<(), Refusal> {
    let folder = scene.parent().unwrap_or(scene);
    let is_inside = |path: &Path| {
        path.strip_prefix(folder).is_ok_and(|inside| {
            let mut parts = inside.components();
            parts.all(|part| matches!(part, Component::Normal(_)))
        })
    };
    if mesh.path.as_deref().is_some_and(|path| !is_inside(path)) {
        let file = foreign::clean(&mesh.file);
        let text = format!("the mesh `{file}` is not in the folder of the scene");
        return Err(Refusal::Path(text));
    }
    readable_mesh(mesh.path.as_deref(), &mesh.file)
}
