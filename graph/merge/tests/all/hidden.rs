//! Hidden elements after a change, computed from the touched elements only, compared with the whole
//! view.

use graph_merge::{Hidden, Replica, Shown};
use property_graph::schema::{Attribute, Entity, Kind, Port, Relation, Tree};
use property_graph::{Edit, Element, Error, Graph, Id, Schema, Time, in_order};
use std::collections::BTreeSet;
use std::sync::Arc;

fn schema() -> Schema {
    let attribute = |name: &str, key: bool| Attribute {
        name: name.to_owned(),
        kind: Kind::Int,
        unit: None,
        range: Some((0.0, 9.0)),
        optional: true,
        key,
        history: None,
        doc: Vec::new(),
    };
    let entity = |name: &str, key: bool| Entity {
        name: name.to_owned(),
        attributes: vec![attribute("number", key), attribute("x", false)],
        ..Entity::default()
    };
    let relation = |name: &str, most: Option<u32>, tree: Option<usize>| Relation {
        name: name.to_owned(),
        ports: ["first", "second"]
            .map(|port| Port {
                name: port.to_owned(),
                entity: "thing".to_owned(),
                min: 0,
                max: most,
            })
            .into(),
        attributes: vec![attribute("x", false)],
        tree: tree.map(|child| Tree { child, pose: None }),
        promotes: Some("thing".to_owned()),
        ..Relation::default()
    };
    Schema {
        entities: vec![entity("thing", false), entity("named", true)],
        relations: vec![
            relation("in", None, Some(0)),
            relation("holds", Some(1), None),
            relation("near", None, None),
        ],
        ..Schema::default()
    }
}

/// Random changes, as one replica makes them.
fn change(replica: &mut Replica, random: &mut fastrand::Rng, known: &mut Vec<Id>) {
    let pick = |random: &mut fastrand::Rng, known: &[Id]| {
        known.get(random.usize(0..known.len().max(1))).copied()
    };
    for _ in 0..random.usize(1..4) {
        let made = match random.u8(0..10) {
            0..=2 => replica
                .add_node(["thing", "thing", "named"][random.usize(0..3)])
                .ok(),
            3..=5 => {
                let ends = (pick(random, known), pick(random, known));
                let (Some(from), Some(to)) = ends else {
                    continue;
                };
                let kind = ["in", "holds", "near"][random.usize(0..3)];
                replica.add_edge(kind, from, to).ok()
            }
            6..=8 => {
                let Some(of) = pick(random, known) else {
                    continue;
                };
                let name = ["number", "x"][random.usize(0..2)];
                // 10 is out of range, so that it is not shown.
                let value = random.i64(0..4) + if random.u8(0..20) == 0 { 10 } else { 0 };
                replica.set(of, name, Some(value.into())).expect("a number");
                None
            }
            _ => {
                let Some(of) = pick(random, known) else {
                    continue;
                };
                replica.remove(of).expect("a number");
                None
            }
        };
        known.extend(made);
    }
}

/// Shows elements alone, as a world does.
fn show(
    replica: &Replica,
    schema: &Schema,
    edit: &mut Edit,
    shown: &BTreeSet<Id>,
) -> Result<(), Error> {
    let (mut nodes, mut edges): (Vec<(Id, Shown<'_>)>, Vec<(Id, Shown<'_>)>) = Default::default();
    for id in shown {
        match (replica.element(schema, *id), edit.snapshot().find(*id)) {
            (Some(own), _) if own.ends.is_none() => nodes.push((*id, own)),
            (Some(own), _) => edges.push((*id, own)),
            (None, Some(Element::Node(node))) => edit.remove_node(node)?,
            (None, Some(Element::Edge(edge))) => edit.remove_edge(edge)?,
            (None, None) => {}
        }
    }
    let ends: Vec<_> = edges
        .iter()
        .filter_map(|(id, own)| own.ends.map(|(from, to)| (Some(*id), [from, to])))
        .collect();
    let (order, rest) = in_order(&ends, |id| {
        edit.snapshot().find(id).is_some() || nodes.iter().any(|(own, _)| *own == id)
    });
    if !rest.is_empty() {
        return Err(Error::Removed);
    }
    let edges = order.into_iter().map(|at| &edges[at]);
    for (id, own) in nodes.iter().chain(edges) {
        let element: Element = match (edit.snapshot().find(*id), own.ends) {
            (Some(known), _) => known,
            (None, None) => edit.add_node_as(*id, own.kind)?.into(),
            (None, Some((from, to))) => {
                let (from, to) = (edit.end(from)?, edit.end(to)?);
                edit.add_edge_as(*id, own.kind, from, to)?.into()
            }
        };
        for name in ["number", "x"] {
            match own.get(name) {
                Some(value) => edit.set(element, name, value.clone())?,
                None if edit.snapshot().get(element, name).is_some() => {
                    edit.unset(element, name)?;
                }
                None => {}
            }
        }
    }
    Ok(())
}

#[test]
fn what_is_decided_alone_is_what_the_whole_view_has() {
    let schema = Arc::new(schema());
    let (mut alone, mut whole) = (0, 0);
    // With 223, an edge that closed a cycle gets a second parent instead.
    for seed in (0..60).chain([223]) {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut replicas = [1, 2, 3].map(|writer| Replica::new(writer, [1, 2, 3]));
        let mut known = Vec::new();
        let graph = Graph::new(Arc::clone(&schema), 9);
        let mut hidden = Hidden::default();
        for round in 0..60 {
            let writer = random.usize(1..3);
            change(&mut replicas[writer], &mut random, &mut known);
            if random.bool() {
                continue;
            }
            let from = random.usize(1..3);
            let delta = replicas[from].delta_since(replicas[0].seen());
            let touched = replicas[0].merge(&delta).expect("a delta");
            if random.u8(0..4) == 0 {
                let to = 3 - from;
                let delta = replicas[from].delta_since(replicas[to].seen());
                replicas[to].merge(&delta).expect("a delta");
            }
            let view = replicas[0].view(&schema);
            let expected = view.graph(Arc::clone(&schema), 9).expect("a graph");
            let (replica, now) = (&replicas[0], graph.snapshot());
            let is_shown = hidden
                .update(replica, &schema, &now, &touched)
                .is_some_and(|shown| {
                    let shown =
                        graph.change(Time::ZERO, |edit| show(replica, &schema, edit, &shown));
                    shown.is_ok()
                });
            if is_shown {
                alone += usize::from(!view.conflicts.is_empty());
            } else {
                whole += 1;
                graph
                    .adopt(Time::ZERO, &expected.snapshot())
                    .expect("a view");
                hidden = Hidden::of(&view, replica);
            }
            let at = format!("seed {seed}, round {round}, alone {is_shown}");
            assert_eq!(hidden.conflicts(), view.conflicts, "{at}");
            let (graph, expected) = (graph.snapshot(), expected.snapshot());
            let dump = |graph: &property_graph::Snapshot| {
                let nodes = graph.nodes().map(|node| {
                    let attributes = node
                        .attributes()
                        .map(|(name, value)| format!("{name}={value:?}"));
                    let mut attributes: Vec<String> = attributes.collect();
                    attributes.sort();
                    format!("{:?} {} {attributes:?}", node.id(), node.type_name())
                });
                let edges = graph.edges().map(|edge| {
                    let attributes = edge
                        .attributes()
                        .map(|(name, value)| format!("{name}={value:?}"));
                    let mut attributes: Vec<String> = attributes.collect();
                    attributes.sort();
                    format!("{:?} {} {attributes:?}", edge.id(), edge.type_name())
                });
                nodes.chain(edges).collect::<BTreeSet<String>>()
            };
            assert_eq!(dump(&graph), dump(&expected), "{at}");
        }
    }
    // With conflicts, most changes are decided alone.
    assert!(alone > whole, "{alone} alone, {whole} whole");
}
