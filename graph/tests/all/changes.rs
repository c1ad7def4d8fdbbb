//! Changes are whole, checked and found again.

use property_graph::schema::{Attribute, Comparison, Entity, Kind, Port, Relation, Rule, Tree};
use property_graph::{Change, Element, Error, Graph, Id, Schema, Snapshot, Time, Value};
use std::collections::BTreeMap;
use std::time::Duration;

fn attribute(name: &str, kind: Kind) -> Attribute {
    Attribute {
        name: name.to_owned(),
        kind,
        unit: None,
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    }
}

/// A kitchen: objects with a key and a mass, rooms, `in` as a tree, `grasp` with a rule.
pub(crate) fn kitchen() -> Schema {
    let name = Attribute {
        key: true,
        optional: false,
        ..attribute("name", Kind::Text)
    };
    let mass = Attribute {
        range: Some((0.0, 100.0)),
        unit: Some("kg".to_owned()),
        history: Some(Duration::from_secs(2)),
        ..attribute("mass", Kind::Float)
    };
    let entity = |name: &str, parent: Option<&str>, attributes: Vec<Attribute>| Entity {
        name: name.to_owned(),
        parent: parent.map(str::to_owned),
        attributes,
        ..Entity::default()
    };
    let port = |name: &str, entity: &str, max: Option<u32>| Port {
        name: name.to_owned(),
        entity: entity.to_owned(),
        min: 0,
        max,
    };
    Schema {
        name: "kitchen".to_owned(),
        open: false,
        entities: vec![
            entity("Object", None, vec![name.clone(), mass.clone()]),
            entity("Hose", Some("Object"), vec![name.clone(), mass]),
            entity("Room", None, vec![name.clone()]),
            entity(
                "Gripper",
                None,
                vec![name, attribute("payload", Kind::Float)],
            ),
        ],
        relations: vec![
            Relation {
                name: "in".to_owned(),
                ports: vec![port("what", "Object", None), port("where", "Room", None)],
                tree: Some(Tree::default()),
                ..Relation::default()
            },
            Relation {
                name: "grasp".to_owned(),
                ports: vec![
                    port("by", "Gripper", Some(1)),
                    port("what", "Object", Some(1)),
                ],
                ..Relation::default()
            },
        ],
        rules: vec![Rule {
            relation: "grasp".to_owned(),
            left: (1, "mass".to_owned()),
            comparison: Comparison::LessOrEqual,
            right: (0, "payload".to_owned()),
            message: "heavier than the payload".to_owned(),
        }],
        queries: Vec::new(),
    }
}

fn graph() -> Graph {
    Graph::new(kitchen().into(), 1)
}

fn refused(make: impl FnOnce(&mut property_graph::Edit) -> Result<(), Error>) -> String {
    let graph = graph();
    let cup = |edit: &mut property_graph::Edit| {
        let cup = edit.add_node("Object")?;
        edit.set(cup, "name", "cup")
    };
    graph.change(Time::ZERO, cup).expect("a cup");
    let before = graph.snapshot();
    let error = graph.change(Time::ZERO, make).expect_err("an error");
    // Nothing has changed.
    assert_eq!(graph.snapshot().version(), before.version());
    assert_eq!(graph.snapshot().node_count(), 1);
    error.to_string()
}

#[test]
fn a_wrong_change_is_refused_whole() {
    let message = refused(|edit| edit.add_node("Objekt").map(|_| ()));
    assert_eq!(
        message,
        "the schema has no entity `Objekt`, did you mean `Object`?"
    );
    let message = refused(|edit| edit.add_node("Object").map(|_| ()));
    assert_eq!(message, "a `Object` has no `name`, which is not optional");
    let message = refused(|edit| {
        let node = edit.add_node("Hose")?;
        edit.set(node, "name", "cup")
    });
    assert_eq!(
        message,
        "two nodes of `Object` have the name `cup`, which is a key"
    );
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        edit.set(cup, "mass", 200.0)
    });
    assert_eq!(message, "`mass` of `Object` is in 0:100 kg, found 200");
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        edit.set(cup, "mas", 2.0)
    });
    assert_eq!(
        message,
        "`Object` has no attribute `mas`, did you mean `mass`?"
    );
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        edit.set(cup, "mass", f64::NAN)
    });
    assert_eq!(message, "a value for `mass` is not finite");
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        edit.add_edge("in", cup, cup).map(|_| ())
    });
    assert_eq!(message, "port `where` of `in` is for Room, found Object");
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        for name in ["kitchen", "bath"] {
            let room = edit.add_node("Room")?;
            edit.set(room, "name", name)?;
            edit.add_edge("in", cup, room)?;
        }
        Ok(())
    });
    assert_eq!(
        message,
        "`cup` has two parents in `in`, whose edges form a tree"
    );
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        edit.set(cup, "mass", 3.0)?;
        let gripper = edit.add_node("Gripper")?;
        edit.set(gripper, "name", "left")?;
        edit.set(gripper, "payload", 2.0)?;
        edit.add_edge("grasp", gripper, cup).map(|_| ())
    });
    assert_eq!(
        message,
        "heavier than the payload: 3 <= 2 does not hold for an edge of `grasp`"
    );
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        for name in ["left", "right"] {
            let gripper = edit.add_node("Gripper")?;
            edit.set(gripper, "name", name)?;
            edit.add_edge("grasp", gripper, cup)?;
        }
        Ok(())
    });
    assert_eq!(
        message,
        "a node of `Object` is 2 times `what` of `grasp`; expected 0:1"
    );
    let message = refused(|edit| {
        let cup = edit.snapshot().named("cup").next().expect("the cup");
        edit.remove_node(cup)?;
        edit.set(cup, "mass", 1.0)
    });
    assert_eq!(message, "the element was removed");
    let message = refused(|edit| edit.add_node_as(Id::new(1, 1), "Room").map(|_| ()));
    assert_eq!(message, "an element has the id 0x10000000000000001 already");
}

#[test]
fn a_rule_holds_also_when_an_attribute_changes_later() {
    let graph = Graph::new(kitchen().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let cup = edit.add_node("Object")?;
        edit.set(cup, "name", "cup")?;
        edit.set(cup, "mass", 1.0)?;
        let gripper = edit.add_node("Gripper")?;
        edit.set(gripper, "name", "left")?;
        edit.set(gripper, "payload", 2.0)?;
        edit.add_edge("grasp", gripper, cup)?;
        Ok::<_, Error>((cup, gripper))
    });
    let (cup, gripper) = made.expect("the rule holds");
    let later = Time::from_secs(1);
    let heavy = graph.change(later, |edit| edit.set(cup, "mass", 3.0));
    let weak = graph.change(later, |edit| edit.set(gripper, "payload", 0.5));
    for refused in [heavy, weak] {
        let message = refused.expect_err("the rule is broken").to_string();
        assert!(message.starts_with("heavier than the payload"), "{message}");
    }
}

/// The steps of a change are bounded; nothing of one that has more is kept.
#[test]
fn a_change_with_too_many_steps_is_refused_whole() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let before = graph.snapshot();
    let result = graph.change(Time::ZERO, |edit| {
        let node = edit.add_node("thing")?;
        for _ in 0..property_graph::MOST_STEPS {
            edit.unset(node, "nothing")?;
        }
        Ok::<(), Error>(())
    });
    assert_eq!(result, Err(Error::TooLarge(property_graph::MOST_STEPS)));
    assert_eq!(graph.snapshot().version(), before.version());
    assert_eq!(graph.snapshot().node_count(), 0);
}

#[test]
fn a_fork_makes_no_id_twice() {
    let graph = Graph::new(kitchen().into(), 1);
    let room = |graph: &Graph, name: &str| {
        let made = graph.change(Time::ZERO, |edit| {
            let room = edit.add_node("Room")?;
            edit.set(room, "name", name)
        });
        made.expect("a room");
    };
    let fork = graph.fork(2);
    room(&fork, "hall");
    // Back with writer 1, and again with writer 2.
    let again = fork.fork(1).fork(2);
    room(&again, "bath");
    assert_eq!(again.snapshot().node_count(), 2);
}

#[test]
fn a_cycle_in_a_tree_is_refused() {
    let mut schema = kitchen();
    schema.relations[0].ports[1].entity = "Object".to_owned();
    let graph = Graph::new(schema.into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = Vec::new();
        for name in ["a", "b", "c"] {
            let node = edit.add_node("Object")?;
            edit.set(node, "name", name)?;
            nodes.push(node);
        }
        edit.add_edge("in", nodes[0], nodes[1])?;
        edit.add_edge("in", nodes[1], nodes[2])?;
        Ok::<_, Error>(nodes)
    });
    let nodes = made.expect("a tree");
    let error = graph.change(Time::ZERO, |edit| {
        edit.add_edge("in", nodes[2], nodes[0]).map(|_| ())
    });
    let message = error.expect_err("a cycle").to_string();
    assert_eq!(
        message,
        "`c` is above itself in `in`, whose edges form a tree"
    );
}

#[test]
fn keys_names_and_types_find_nodes_again() {
    let graph = graph();
    let node = graph.change(Time::ZERO, |edit| {
        let node = edit.add_node("Hose")?;
        edit.set(node, "name", "blue")?;
        Ok::<_, Error>(node)
    });
    let node = node.expect("a hose");
    let now = graph.snapshot();
    assert_eq!(now.by_key("Object", "name", "blue"), Some(node));
    assert_eq!(now.by_key("Hose", "name", "blue"), Some(node));
    assert_eq!(now.by_key("Room", "name", "blue"), None);
    assert_eq!(now.instances("Object").collect::<Vec<_>>(), [node]);
    assert_eq!(now.of_type("Object").count(), 0);
    let renamed = graph.change(Time::ZERO, |edit| edit.set(node, "name", "red"));
    renamed.expect("another name");
    let then = graph.snapshot();
    assert_eq!(then.by_key("Object", "name", "blue"), None);
    assert_eq!(then.by_key("Object", "name", "red"), Some(node));
    assert_eq!(then.named("red").next(), Some(node));
    assert_eq!(then.named("blue").next(), None);
    // The earlier version is as it was.
    assert_eq!(now.named("blue").next(), Some(node));
}

/// The elements of a version with their ids and attributes.
fn content(of: &Snapshot) -> BTreeMap<Element, (Id, BTreeMap<String, Value>)> {
    let own = |(name, value): (&str, &Value)| (name.to_owned(), value.clone());
    let nodes = of.nodes().map(|node| {
        let attributes = node.attributes().map(own).collect();
        (node.node_id().into(), (node.id(), attributes))
    });
    let edges = of.edges().map(|edge| {
        let attributes = edge.attributes().map(own).collect();
        (edge.edge_id().into(), (edge.id(), attributes))
    });
    nodes.chain(edges).collect()
}

/// The differences of two versions of which every element is compared.
fn compared(now: &Snapshot, before: &Snapshot) -> Vec<Change> {
    let (new, old) = (content(now), content(before));
    let removed = old.iter().filter(|(element, _)| !new.contains_key(element));
    let removed = removed.map(|(element, (id, _))| match *element {
        Element::Node(node) => Change::NodeRemoved(node, *id),
        Element::Edge(edge) => Change::EdgeRemoved(edge, *id),
    });
    let mut changes: Vec<Change> = removed.collect();
    for (element, (_, attributes)) in &new {
        let Some((_, earlier)) = old.get(element) else {
            changes.push(match *element {
                Element::Node(node) => Change::NodeAdded(node),
                Element::Edge(edge) => Change::EdgeAdded(edge),
            });
            continue;
        };
        let mut names: Vec<&String> = attributes.keys().chain(earlier.keys()).collect();
        names.sort_unstable();
        names.dedup();
        names.retain(|name| attributes.get(*name) != earlier.get(*name));
        let symbols = names.into_iter().filter_map(|name| now.symbol(name));
        changes.extend(symbols.map(|symbol| Change::Attribute(*element, symbol)));
    }
    changes
}

#[test]
fn differences_of_random_versions_are_those_of_all_elements() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let mut random = fastrand::Rng::with_seed(7);
    let mut versions = vec![graph.snapshot()];
    for step in 0..1500_i64 {
        let changed = graph.change(Time::ZERO, |edit| {
            let now = edit.snapshot();
            let nodes: Vec<_> = now.nodes().map(|node| node.node_id()).collect();
            let edges: Vec<_> = now.edges().map(|edge| edge.edge_id()).collect();
            let node = random.choice(&nodes).copied();
            match (random.u8(0..8), node, random.choice(&edges).copied()) {
                (0, Some(node), _) => edit.remove_node(node),
                (1, _, Some(edge)) => edit.remove_edge(edge),
                (2, Some(node), _) => edit.set(node, "mass", step % 3),
                (3, Some(node), _) => edit.unset(node, "mass"),
                (4, _, Some(edge)) => edit.set(edge, "mass", step % 3),
                // An edge starts at another edge, which a node represents then.
                (5, Some(node), Some(edge)) => {
                    let from = edit.node_of(edge)?;
                    edit.add_edge("about", from, node).map(|_| ())
                }
                (6, Some(node), _) => {
                    let to = random.choice(&nodes).copied().unwrap_or(node);
                    edit.add_edge("near", node, to).map(|_| ())
                }
                _ => edit.add_node("object").map(|_| ()),
            }
        });
        changed.expect("a sound change");
        let now = graph.snapshot();
        let before = &versions[random.usize(versions.len().saturating_sub(20)..versions.len())];
        for (new, old) in [(&now, before), (before, &now)] {
            let sorted = |mut changes: Vec<Change>| {
                changes.sort_by_key(|change| format!("{change:?}"));
                changes
            };
            assert_eq!(
                sorted(new.since(old)),
                sorted(compared(new, old)),
                "step {step}"
            );
        }
        versions.push(now);
    }
    assert!(
        versions
            .iter()
            .any(|version| version.promoted().next().is_some())
    );
}

/// A copy of what a change had done before it failed is no version from which the next change goes on.
#[test]
fn differences_from_a_change_that_failed() {
    let graph = graph();
    let nodes = graph.change(Time::ZERO, |edit| {
        let mut node = |name: &str| {
            let node = edit.add_node("Object")?;
            edit.set(node, "name", name)?;
            edit.set(node, "mass", 1.0)?;
            Ok::<_, Error>(node)
        };
        Ok::<_, Error>([node("cup")?, node("pot")?])
    });
    let [cup, pot] = nodes.expect("two objects");
    let mut copy = None;
    let failed = graph.change(Time::ZERO, |edit| {
        edit.set(cup, "mass", 2.0)?;
        copy = Some(edit.snapshot().clone());
        Err::<(), _>(Error::Removed)
    });
    assert_eq!(failed, Err(Error::Removed));
    let changed = graph.change(Time::ZERO, |edit| edit.set(pot, "mass", 3.0));
    changed.expect("another mass");
    let (copy, now) = (copy.expect("a copy"), graph.snapshot());
    let mass = now.symbol("mass").expect("an attribute");
    let both = [cup, pot].map(|node| Change::Attribute(node.into(), mass));
    assert_eq!(now.since(&copy), both);
}

#[test]
fn differences_the_past_and_forks() {
    let graph = graph();
    let at = Duration::from_millis;
    let node = graph.change(at(100), |edit| {
        let node = edit.add_node("Object")?;
        edit.set(node, "name", "cup")?;
        edit.set(node, "mass", 1.0)?;
        Ok::<_, Error>(node)
    });
    let node = node.expect("a cup");
    let first = graph.snapshot();
    for step in 1..=5_u32 {
        let mass = f64::from(step) + 1.0;
        let changed = graph.change(at(100 + 100 * u64::from(step)), |edit| {
            edit.set(node, "mass", mass)
        });
        changed.expect("another mass");
    }
    let mass = first.symbol("mass").expect("an attribute");
    let now = graph.snapshot();
    assert_eq!(now.since(&first), [Change::Attribute(node.into(), mass)]);
    assert_eq!(now.since(&now), []);
    let then = graph.at(at(350)).expect("a version");
    assert_eq!(then.version().get(node, "mass"), Some(&Value::Float(3.0)));
    let ring = graph.history_of(node, "mass");
    let times: Vec<u128> = ring.iter().map(|(time, _)| time.as_millis()).collect();
    assert_eq!(times, [100, 200, 300, 400, 500, 600]);
    let late = graph.change(at(2450), |edit| edit.set(node, "mass", 9.0));
    late.expect("another mass");
    let ring = graph.history_of(node, "mass");
    // What held two seconds ago was set before.
    assert_eq!(ring.first().map(|(time, _)| *time), Some(at(400)));
    let fork = graph.fork(2);
    let other = fork.change(at(3000), |edit| {
        edit.remove_node(node)?;
        let node = edit.add_node("Room")?;
        edit.set(node, "name", "kitchen")?;
        Ok::<_, Error>(node)
    });
    let other = other.expect("a room");
    assert_eq!(
        fork.snapshot().node(other).expect("there").id(),
        Id::new(2, 1)
    );
    assert_eq!(fork.snapshot().node_count(), 1);
    assert_eq!(graph.snapshot().get(node, "mass"), Some(&Value::Float(9.0)));
    assert!(fork.snapshot().get(node, "mass").is_none());
}
