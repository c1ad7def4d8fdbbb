//! From a file to a tree, and back.

use crate::edit::{self, Edit, NewNode};
use crate::error::Error;
use crate::link::NodeId;
use crate::snapshot::{Key, NodeRef, Snapshot};
use innermodel_language::model::{Display, Document, Kind, Node, Pose};
use std::collections::HashMap;

impl Edit {
    /// Adds the nodes of a document below `parent`. Joints are at 0, or at the nearest end of their
    /// limits. Ids that are named in `allowed` need not exist.
    pub fn add_document(
        &mut self,
        parent: impl Key,
        document: &Document,
    ) -> Result<Vec<NodeId>, Error> {
        let top = self.snapshot().node(parent)?.node_id();
        let mut made: Vec<NodeId> = Vec::with_capacity(document.nodes.len());
        for node in &document.nodes {
            let parent = node.parent.map_or(Some(top), |at| made.get(at).copied());
            let id = self.insert(
                parent.ok_or(Error::Removed)?,
                NewNode {
                    id: node.id.clone(),
                    kind: node.kind.clone(),
                    pose: node.pose,
                    allowed: node.allowed.clone(),
                },
            )?;
            made.push(id);
        }
        Ok(made)
    }
}

impl NodeRef<'_> {
    /// The node as a document has it, below `parent`.
    fn described(&self, parent: Option<usize>) -> Node {
        let mut kind = self.kind().clone();
        if let Kind::Transform(transform) = &mut kind {
            transform.form = edit::form(transform.form, &self.pose());
        }
        Node {
            parent,
            pose: self.pose(),
            allowed: self.allowed().to_vec(),
            ..Node::new(self.id(), kind)
        }
    }

    /// The node as an element of a file, without its children and without the position of a joint.
    /// Meshes and textures have the whole paths of their files, so that another process finds them.
    pub fn element(&self) -> String {
        written(self.described(None))
    }

    /// As [`Self::element`], without its pose.
    pub fn element_at_rest(&self) -> String {
        written(Node {
            pose: Pose::default(),
            ..self.described(None)
        })
    }
}

/// A node as an element, with the whole paths of its files.
fn written(mut node: Node) -> String {
    let (written, path) = match &mut node.kind {
        Kind::Mesh(mesh) => (&mut mesh.file, &mesh.path),
        Kind::Plane(plane) | Kind::Display(Display { plane, .. }) => {
            (&mut plane.texture, &plane.picture)
        }
        _ => return innermodel_language::element(&node),
    };
    if let Some(path) = path.as_deref().and_then(|path| path.to_str()) {
        path.clone_into(written);
    }
    innermodel_language::element(&node)
}

impl Snapshot {
    /// The tree as a file: all but the positions of joints and the attributes that were added at
    /// run time, for which the language has no words. A prismatic joint keeps its position.
    pub fn document(&self) -> Document {
        let mut places: HashMap<NodeId, usize> = HashMap::new();
        let mut nodes = Vec::with_capacity(self.len());
        for node in self.nodes().skip(1) {
            let parent = node
                .parent()
                .and_then(|p| places.get(&p.node_id()).copied());
            places.insert(node.node_id(), nodes.len());
            let mut described = node.described(parent);
            if let Kind::Prismatic(joint) = &mut described.kind {
                joint.position = node.position().unwrap_or_default();
            }
            nodes.push(described);
        }
        Document { nodes }
    }

    /// The tree as the text of a file.
    pub fn print(&self) -> String {
        innermodel_language::print(&self.document())
    }
}
