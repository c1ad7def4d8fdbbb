//! From a file to a tree, and back.

use crate::edit::{self, Edit, NewNode};
use crate::error::Error;
use crate::link::NodeId;
use crate::snapshot::Snapshot;
use innermodel_language::model::{Document, Kind, Node};
use rc_diagnostics::{SourceMap, Span};
use std::collections::HashMap;

/// Adds the nodes of a document below the root.
pub(crate) fn add(edit: &mut Edit, document: &Document) -> Result<(), Error> {
    let mut made: Vec<NodeId> = Vec::with_capacity(document.nodes.len());
    for node in &document.nodes {
        let parent = node
            .parent
            .map_or(Some(NodeId::ROOT), |at| made.get(at).copied());
        let id = edit.add(
            parent.ok_or(Error::Removed)?,
            NewNode {
                id: node.id.clone(),
                kind: node.kind.clone(),
                pose: node.pose,
                allowed: node.allowed.clone(),
            },
        )?;
        made.push(id);
        if let Kind::Joint(joint) = &node.kind
            && (joint.min > 0.0 || joint.max < 0.0)
        {
            edit.set_joint(id, 0.0)?;
        }
    }
    Ok(())
}

impl Snapshot {
    /// The tree as a file: all but the positions of joints and the attributes that were added at
    /// run time, for which the language has no words. A prismatic joint keeps its position.
    pub fn document(&self) -> Document {
        let mut places: HashMap<NodeId, usize> = HashMap::new();
        let mut nodes = Vec::with_capacity(self.len());
        let source = SourceMap::new().add("", "");
        for node in self.nodes().skip(1) {
            let mut kind = node.kind().clone();
            match &mut kind {
                Kind::Transform(transform) => {
                    transform.form = edit::form(transform.form, &node.pose());
                }
                Kind::Prismatic(joint) => joint.position = node.position().unwrap_or_default(),
                _ => {}
            }
            let parent = node
                .parent()
                .and_then(|p| places.get(&p.node_id()).copied());
            places.insert(node.node_id(), nodes.len());
            nodes.push(Node {
                id: node.id().to_owned(),
                parent,
                kind,
                pose: node.pose(),
                allowed: node.allowed().to_vec(),
                span: Span::new(source, 0, 0),
            });
        }
        Document { nodes }
    }

    /// The tree as the text of a file.
    pub fn print(&self) -> String {
        innermodel_language::print(&self.document())
    }
}
