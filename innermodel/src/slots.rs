//! The slot arrays in which a simulator serves the devices of a scene, and the names of their
//! members.

use crate::{Kind, NodeRef, Snapshot};

pub use innermodel_language::slots::Members;

/// The arrays of a scene that have members.
///
/// ```
/// use innermodel::{Folders, InnerModel, slots};
/// use std::path::Path;
///
/// let text = r#"<innerModel><laser id="front" min="100" max="9000" angle="3" measures="90"/></innerModel>"#;
/// let (scene, _) = innermodel::read_text(text, Path::new("scene.xml"), &Folders::default()).expect("a scene");
/// let scene = InnerModel::from_document(&scene).expect("a tree");
/// let lasers = &slots::of(&scene.snapshot())[0];
/// assert_eq!((lasers.array, lasers.interface), ("lasers", "Laser"));
/// assert_eq!(lasers.members, ["front"]);
/// ```
pub fn of(tree: &Snapshot) -> Vec<Members> {
    innermodel_language::slots::of(&tree.document())
}

/// The owner of a node: the robot above it, else the outermost node above it.
pub fn owner<'s>(tree: &'s Snapshot, node: NodeRef<'s>) -> &'s str {
    let above = || std::iter::successors(Some(node), NodeRef::parent);
    let robot = above().find(|node| matches!(node.kind(), Kind::Robot(_)));
    let outermost = above().filter(|node| node.parent().is_some()).last();
    robot.or(outermost).unwrap_or_else(|| tree.root()).id()
}
