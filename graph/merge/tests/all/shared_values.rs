//! Attributes that are one value are one register, and a running graph takes a view over.

use crate::schema::house;
use graph_merge::{Replica, Vector};
use property_graph::schema::{Attribute, Block, Kind, Number, Primitive, Program};
use property_graph::{Graph, Schema, Time, Value};
use std::sync::Arc;

/// Things with `place`, and `raw` with the same value.
fn schema() -> Schema {
    let attribute = |name: &str, of: Option<&str>| Attribute {
        name: name.to_owned(),
        kind: Kind::Block(Arc::new(Block {
            prototype: name.to_owned(),
            meaning: "Range (distance, m)".to_owned(),
            numbers: vec![Number {
                name: "distance".to_owned(),
                unit: Some("m".to_owned()),
                number: Primitive::F64,
            }],
            // Without a number, the check has nothing to refuse.
            is_sequence: true,
            check: Program::default(),
            pose: None,
            consistent_with: of.map(str::to_owned),
            conversions: Vec::new(),
        })),
        unit: None,
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    let mut schema = house();
    let of = &mut schema.entities[0].attributes;
    of.extend([attribute("place", None), attribute("raw", Some("place"))]);
    schema
}

/// A sequence without values.
fn nothing() -> Value {
    Value::Floats([].into())
}

#[test]
fn the_last_change_of_one_value_wins() {
    let schema = schema();
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let node = a.add_node("thing").expect("a stamp");
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    assert_eq!(a.set(node, "place", Some(nothing())), Ok(true));
    assert_eq!(b.set(node, "raw", Some(nothing())), Ok(true));
    a.merge(&b.delta_since(&a.seen().clone()))
        .expect("a sound delta");
    b.merge(&a.delta_since(&b.seen().clone()))
        .expect("a sound delta");
    // Equal counts: the greater writer wins.
    let shown = |replica: &Replica| replica.view(&schema).nodes[&node].1.clone();
    let expected = [("raw".to_owned(), nothing())];
    assert_eq!(shown(&a), expected.clone().into());
    assert_eq!(shown(&b), expected.into());
    assert_eq!(a.set(node, "place", Some(nothing())), Ok(true));
    assert_eq!(shown(&a), [("place".to_owned(), nothing())].into());
    // A removal by any of its names removes it.
    assert_eq!(a.set(node, "raw", None), Ok(true));
    assert!(shown(&a).is_empty());
}

#[test]
fn a_running_graph_takes_views_over() {
    let schema = Arc::new(house());
    let mut replica = Replica::new(1, []);
    let (cup, table) = (
        replica.add_node("thing").expect("a stamp"),
        replica.add_node("thing").expect("a stamp"),
    );
    let graph = Graph::new(Arc::clone(&schema), 9);
    let adopt = |replica: &Replica, time: u64| {
        let view = replica.view(&schema).graph(Arc::clone(&schema), 9);
        let view = view.expect("a graph").snapshot();
        graph
            .adopt(Time::from_nanos(time), &view)
            .expect("a change");
        graph.snapshot()
    };
    let first = adopt(&replica, 1);
    let own = first.find_node(cup).expect("a cup");
    let on = replica.add_edge("in", cup, table).expect("a stamp");
    assert_eq!(replica.set(table, "name", Some(Value::Int(4))), Ok(true));
    let second = adopt(&replica, 2);
    // It is the same node, in one version more.
    assert_eq!(second.find_node(cup), Some(own));
    assert_eq!(second.version(), first.version() + 1);
    assert!(second.find_edge(on).is_some());
    assert_eq!(replica.remove(table), Ok(true));
    let third = adopt(&replica, 3);
    assert_eq!((third.node_count(), third.edge_count()), (1, 0));
}
