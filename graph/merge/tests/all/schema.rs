//! The schema of these tests: a tree, a key, and a port with one edge.

use property_graph::Schema;
use property_graph::schema::{Attribute, Entity, Kind, Port, Relation, Tree};

pub(crate) fn house() -> Schema {
    let name = Attribute {
        name: "name".to_owned(),
        kind: Kind::Int,
        unit: None,
        range: None,
        optional: true,
        key: true,
        history: None,
        doc: Vec::new(),
    };
    let port = |name: &str, max| Port {
        name: name.to_owned(),
        entity: "thing".to_owned(),
        min: 0,
        max,
    };
    Schema {
        open: true,
        entities: vec![Entity {
            name: "thing".to_owned(),
            attributes: vec![name],
            ..Entity::default()
        }],
        relations: vec![
            Relation {
                name: "in".to_owned(),
                ports: vec![port("what", None), port("where", None)],
                tree: Some(Tree::default()),
                ..Relation::default()
            },
            Relation {
                name: "holds".to_owned(),
                ports: vec![port("by", Some(1)), port("what", Some(1))],
                ..Relation::default()
            },
        ],
        ..Schema::default()
    }
}
