//! InnerModel files as graphs of the domain `geometry`.

use crate::document::{Document, Edge, Node};
use innermodel_language::model;
use property_graph::{Id, Value};

/// The graph of a tree: a `Frame` for each node, an `RT` for each but those at the top, in metres.
pub fn document(tree: &model::Document) -> Document {
    let id = |at: usize| Id::new(1, at as u64 + 2);
    let root = Id::new(1, 1);
    let mut made = Document {
        schema: Some("geometry.gdsl".to_owned()),
        ..Document::default()
    };
    let frame = |id: Id, name: &str| Node {
        id,
        kind: "Frame".to_owned(),
        attributes: vec![("name".to_owned(), name.into(), None)],
        path: String::new(),
    };
    made.nodes.push(frame(root, model::ROOT));
    for (at, node) in tree.nodes.iter().enumerate() {
        made.nodes.push(frame(id(at), &node.id));
        let [x, y, z] = node.pose.translation.map(|length| length / 1000.0);
        let [rx, ry, rz] = node.pose.rotation;
        let pose: Value = [x, y, z, rx, ry, rz].into();
        made.edges.push(Edge {
            id: Some(Id::new(1, (tree.nodes.len() + at) as u64 + 2)),
            kind: "RT".to_owned(),
            from: node.parent.map_or(root, id),
            to: id(at),
            attributes: vec![("pose".to_owned(), pose, None)],
            path: String::new(),
        });
    }
    made
}
