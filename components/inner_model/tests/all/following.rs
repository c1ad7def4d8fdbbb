//! Two instances with one world, and components that know nothing of InnerModel.

use crate::{params, place, pose, start, start_at};
use inner_model::SpecificWorker;
use inner_model_generated::testing::TestContext;
use inner_model_generated::{Attribute, Context, InnerModel, Node, Worker};
use property_graph::{Snapshot, Value};
use std::collections::BTreeMap;
use std::time::Duration;

type One = (SpecificWorker, TestContext);

fn turn((worker, test): &mut One) {
    test.advance(Duration::from_millis(20));
    worker.compute(test).expect("a period");
    test.follow_world(worker);
}

fn tree(one: &mut One) -> BTreeMap<String, Node> {
    let nodes = one.0.get_subtree(&mut one.1, "root".into());
    let nodes = nodes.expect("the root").into_iter();
    nodes.map(|node| (node.id.clone(), node)).collect()
}

/// Lets both hear each other. Returns the tree, which both have.
fn settle(a: &mut One, b: &mut One) -> BTreeMap<String, Node> {
    turn(a);
    turn(b);
    a.1.g.meet(&b.1.g).expect("one schema");
    turn(a);
    turn(b);
    let version = |one: &One| one.1.g.snapshot().version();
    let versions = (version(a), version(b));
    // What an instance has taken is no change of its own.
    turn(a);
    turn(b);
    assert_eq!((version(a), version(b)), versions);
    let (first, second) = (tree(a), tree(b));
    let ids = |tree: &BTreeMap<String, Node>| tree.keys().cloned().collect::<Vec<_>>();
    assert_eq!(ids(&first), ids(&second));
    for (id, one) in &first {
        let other = &second[id];
        assert_eq!(
            (&one.parent, &one.attributes),
            (&other.parent, &other.attributes)
        );
        assert!((one.position - other.position).abs() < 1e-9, "{id}");
        let [here, there] = [&mut *a, &mut *b].map(|one| place(&mut one.0, &mut one.1, id));
        let same = here.iter().zip(there).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(same, "{id}: {here:?} {there:?}");
    }
    first
}

fn context(one: &mut One) -> (&mut SpecificWorker, &mut Context) {
    (&mut one.0, &mut one.1)
}

fn move_cup(one: &mut One, x: f64) {
    let (worker, ctx) = context(one);
    let moved = worker.set_pose(ctx, "cup".into(), pose(x, 0.0, 0.0));
    moved.expect("a pose");
}

fn cup(one: &mut One) -> f64 {
    let (worker, ctx) = context(one);
    let cup = worker.get_pose(ctx, "table".into(), "cup".into());
    cup.expect("a pose").x
}

fn move_below(one: &mut One, id: &str, parent: &str) {
    let (worker, ctx) = context(one);
    let moved = worker.move_(ctx, id.into(), parent.into(), false);
    moved.expect("a move");
}

fn named(world: &Snapshot, name: &str) -> property_graph::NodeId {
    let mut found = world.named(name);
    found.next().expect("a node")
}

#[test]
fn an_empty_instance_gets_the_whole_tree_and_then_changes() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    assert!(settle(&mut a, &mut b).contains_key("tip"));
    let (worker, ctx) = context(&mut a);
    let joint = worker.set_joint(ctx, "joint_2".into(), 1.0);
    joint.expect("a joint");
    let attribute = |value: &str| Attribute {
        name: "owner".into(),
        type_: "string".into(),
        value: value.into(),
    };
    for id in ["cup", "world"] {
        let set = worker.set_attribute(ctx, id.into(), attribute("Ana"));
        set.expect("an attribute");
    }
    let now = settle(&mut a, &mut b);
    assert_eq!(now["joint_2"].position, 1.0);
    assert_eq!(now["world"].attributes, [attribute("Ana")]);
    let (worker, ctx) = context(&mut b);
    worker.remove(ctx, "cup".into()).expect("a node");
    let ball = r#"<transform id="ball" tx="1"><sphere id="skin" radius="2"/></transform>"#;
    worker.add(ctx, "world".into(), ball.into()).expect("nodes");
    let now = settle(&mut a, &mut b);
    assert!(now.contains_key("skin") && !now.contains_key("cup"));
    // A frame becomes a box while nothing is below it, and loses its attributes.
    let (worker, ctx) = context(&mut a);
    worker.remove(ctx, "skin".into()).expect("a node");
    let crate_ = r#"<plane id="ball" size="10,10,10"/>"#;
    worker.set(ctx, crate_.into()).expect("a box");
    let gone = worker.remove_attribute(ctx, "world".into(), "owner".into());
    gone.expect("an attribute");
    let now = settle(&mut a, &mut b);
    assert!(now["ball"].element.starts_with("<plane"));
    assert_eq!(now["world"].attributes, []);
}

#[test]
fn instances_with_one_file_have_each_node_once() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    let before = tree(&mut a).len();
    assert_eq!(settle(&mut a, &mut b).len(), before);
    // One that starts again takes what the others have now.
    move_cup(&mut a, 7.0);
    let (worker, ctx) = context(&mut b);
    let removed = worker.remove(ctx, "table_leg_1".into());
    removed.expect("a node");
    settle(&mut a, &mut b);
    let mut again = start_at("arm.xml", 9);
    let now = settle(&mut a, &mut again);
    assert_eq!(
        (cup(&mut again), now.contains_key("table_leg_1")),
        (7.0, false)
    );
    // So does one that has them before its file.
    let mut test = TestContext::new(params("arm.xml"));
    test.advance(Duration::from_secs(20));
    test.g.meet(&a.1.g).expect("one schema");
    let worker = SpecificWorker::initialize(&mut test).expect("a worker");
    let mut late = (worker, test);
    assert_eq!(cup(&mut late), 7.0);
    assert!(!tree(&mut late).contains_key("table_leg_1"));
}

/// A change of a node that another component has removed makes no second one.
#[test]
fn what_another_component_removes_stays_removed() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    settle(&mut a, &mut b);
    let others = a.1.g.others();
    a.1.g.meet(&others).expect("one schema");
    let removed = others.change(|edit| {
        let cup = named(edit.snapshot(), "cup");
        edit.remove_node(cup)?;
        Ok(())
    });
    removed.expect("a change");
    move_cup(&mut a, 5.0);
    a.1.g.meet(&others).expect("one schema");
    assert!(!settle(&mut a, &mut b).contains_key("cup"));
    move_below(&mut a, "table", "world");
    settle(&mut a, &mut b);
}

/// The world has no node for it.
#[test]
fn attributes_of_the_root_undo_nothing() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    for one in [&mut a, &mut b] {
        let (worker, ctx) = context(one);
        let owner = Attribute {
            name: "owner".into(),
            ..Attribute::default()
        };
        let set = worker.set_attribute(ctx, "root".into(), owner);
        set.expect("an attribute");
    }
    move_cup(&mut a, 4.0);
    settle(&mut a, &mut b);
    assert_eq!(cup(&mut b), 4.0);
}

/// A part that becomes none goes with all below it, and comes back with that.
#[test]
fn a_part_that_is_none_for_a_while_comes_back() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    let before = settle(&mut a, &mut b);
    let others = a.1.g.others();
    a.1.g.meet(&others).expect("one schema");
    for element in [Some("<"), None] {
        let written = others.change(|edit| {
            let joint = named(edit.snapshot(), "joint_1");
            match element {
                Some(element) => edit.set(joint, "element", element)?,
                None => edit.set(joint, "element", before["joint_1"].element.as_str())?,
            }
            Ok(())
        });
        written.expect("a change");
        a.1.g.meet(&others).expect("one schema");
        let now = settle(&mut a, &mut b);
        let there = ["joint_1", "joint_2"].map(|id| now.contains_key(id));
        assert_eq!(there, [element.is_none(); 2], "{element:?}");
    }
    assert_eq!(tree(&mut a).len(), before.len());
}

#[test]
fn of_two_changes_at_once_the_same_one_holds_in_both() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    settle(&mut a, &mut b);
    move_cup(&mut a, 1.0);
    move_cup(&mut b, 2.0);
    settle(&mut a, &mut b);
    // A later change of either one holds in both.
    for (x, at) in [(5.0, true), (6.0, false)] {
        move_cup(if at { &mut a } else { &mut b }, x);
        settle(&mut a, &mut b);
        assert_eq!(cup(&mut a), x);
    }
}

/// One moves a node below another one, which a second instance moves below the first one.
#[test]
fn of_two_moves_that_exclude_each_other_one_holds_in_both() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    let (worker, ctx) = context(&mut a);
    let trays = r#"<transform id="north"/><transform id="south"/>"#;
    worker.add(ctx, "world".into(), trays.into()).expect("two");
    settle(&mut a, &mut b);
    move_below(&mut a, "north", "south");
    move_below(&mut b, "south", "north");
    let now = settle(&mut a, &mut b);
    let above = |id: &str| now[id].parent.as_str();
    let held = [above("north") == "south", above("south") == "north"];
    assert_eq!(held.iter().filter(|held| **held).count(), 1, "{now:?}");
    // Both go on.
    move_cup(&mut b, 3.0);
    settle(&mut a, &mut b);
}

/// In one period a node goes and comes, and two of them change their places.
#[test]
fn many_changes_of_one_period_are_one() {
    let (mut a, mut b) = (start("arm.xml"), start_at("arm.xml", 1));
    let (worker, ctx) = context(&mut a);
    let outer = r#"<transform id="outer"><transform id="inner" tx="5"/></transform>"#;
    worker.add(ctx, "world".into(), outer.into()).expect("two");
    settle(&mut a, &mut b);
    for (id, parent) in [("inner", "world"), ("outer", "inner"), ("cup", "outer")] {
        move_below(&mut a, id, parent);
    }
    let (worker, ctx) = context(&mut a);
    for _ in 0..50 {
        let element = r#"<transform id="ball"/>"#;
        let added = worker.add(ctx, "inner".into(), element.into());
        added.expect("a node");
        worker.remove(ctx, "ball".into()).expect("a node");
    }
    let now = settle(&mut a, &mut b);
    let above = |id: &str| now[id].parent.as_str();
    assert_eq!(
        [above("cup"), above("outer"), above("inner")],
        ["outer", "inner", "world"]
    );
    assert!(!now.contains_key("ball"));
    let (worker, ctx) = context(&mut b);
    worker.remove(ctx, "inner".into()).expect("a node");
    assert!(!settle(&mut a, &mut b).contains_key("cup"));
}

/// Another component writes frames without knowing what a file can say.
#[test]
fn components_of_the_world_move_add_and_name_frames() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    settle(&mut a, &mut b);
    let others = a.1.g.others();
    a.1.g.meet(&others).expect("one schema");
    let moved = others.change(|edit| {
        let world = edit.snapshot();
        let (cup, table) = (named(world, "cup"), named(world, "table"));
        let held = world.in_edges(cup, None).next().map(|edge| edge.edge_id());
        edit.set(
            held.expect("an edge"),
            "pose",
            [0.25, 0.0, 0.0, 0.0, 0.0, 0.0],
        )?;
        for name in ["twin", "twin", "", "root", "plain"] {
            let frame = edit.add_node("Frame")?;
            edit.set(frame, "name", name)?;
            let held = edit.add_edge("RT", table, frame)?;
            edit.set(held, "pose", [0.0, 1.0, 0.0, 0.0, 0.0, 0.0])?;
        }
        let plain = named(edit.snapshot(), "plain");
        let seen = edit.add_edge("loop_closure", table, plain)?;
        edit.set(seen, "pose", [0.5, 1.0, 0.0, 0.0, 0.0, 0.0])?;
        Ok(())
    });
    moved.expect("a change");
    a.1.g.meet(&others).expect("one schema");
    let now = settle(&mut a, &mut b);
    assert_eq!(cup(&mut b), 250.0);
    let new = now.keys().filter(|id| id.contains('#'));
    assert_eq!(new.clone().count(), 4, "{now:?}");
    // A frame becomes a box.
    let (worker, ctx) = context(&mut b);
    let text = r#"<plane id="plain" size="10,10,10"/>"#;
    worker.set(ctx, text.into()).expect("a box");
    let changed = settle(&mut a, &mut b);
    assert!(changed["plain"].element.starts_with("<plane"));
    let world = a.1.g.snapshot();
    let seen = world
        .edges()
        .find(|edge| edge.type_name() == "loop_closure");
    let seen = seen.expect("the other edges of the frame");
    assert_eq!(seen.to(), named(&world, "plain"));
    assert!(seen.get("pose").is_some());
    // They are changed as any others are.
    let twin = new.clone().find(|id| id.starts_with("twin")).expect("one");
    let (worker, ctx) = context(&mut b);
    let placed = worker.set_pose(ctx, twin.clone(), pose(1.0, 2.0, 3.0));
    placed.expect("a pose");
    let now = settle(&mut a, &mut b);
    let there = place(&mut a.0, &mut a.1, twin);
    assert_eq!(
        (there, now[twin].parent.as_str()),
        ([1.0, 702.0, 3.0], "table")
    );
}

/// Collisions and rays are those of the world, whoever moves its frames.
#[test]
fn bodies_of_the_world_collide() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    settle(&mut a, &mut b);
    let touches = |one: &mut One| {
        let (worker, ctx) = context(one);
        worker.collide(ctx, "cup".into(), "pedestal".into())
    };
    assert_eq!([touches(&mut a), touches(&mut b)], [Ok(false), Ok(false)]);
    let others = b.1.g.others();
    b.1.g.meet(&others).expect("one schema");
    let moved = others.change(|edit| {
        let world = edit.snapshot();
        let cup = named(world, "cup");
        let held = world.in_edges(cup, None).next().map(|edge| edge.edge_id());
        let held = held.expect("an edge");
        // Where the arm stands.
        edit.set(held, "pose", [0.0, 0.0, -0.2, 0.0, 0.0, 0.0])?;
        Ok(())
    });
    moved.expect("a change");
    b.1.g.meet(&others).expect("one schema");
    settle(&mut a, &mut b);
    assert_eq!([touches(&mut a), touches(&mut b)], [Ok(true), Ok(true)]);
}

/// What no file can say is not in the tree, and the rest is.
#[test]
fn elements_that_are_none_stay_out_of_the_tree() {
    let (mut a, mut b) = (start("arm.xml"), start_at("", 1));
    let scene = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../innermodel/scenes/house.xml"
    );
    let others = a.1.g.others();
    a.1.g.meet(&others).expect("one schema");
    let include = format!(r#"<include path="{scene}"/>"#);
    let elements = [
        "<",
        "text",
        "<transform id=\"x\"/><transform id=\"y\"/>",
        include.as_str(),
    ];
    let written = others.change(|edit| {
        let table = named(edit.snapshot(), "table");
        for (at, element) in elements.iter().enumerate() {
            let part = edit.add_node("Part")?;
            edit.set(part, "name", format!("wrong_{at}"))?;
            edit.set(part, "element", *element)?;
            let held = edit.add_edge("RT", table, part)?;
            edit.set(held, "pose", [0.0; 6])?;
        }
        let fine = edit.add_node("Part")?;
        edit.set(fine, "name", "fine")?;
        edit.set(fine, "attributes", Value::Texts(["odd".into()].into()))?;
        let held = edit.add_edge("RT", table, fine)?;
        edit.set(held, "pose", [0.0; 6])?;
        Ok(())
    });
    written.expect("a change");
    a.1.g.meet(&others).expect("one schema");
    let now = settle(&mut a, &mut b);
    assert!(now.contains_key("fine") && !now.keys().any(|id| id.starts_with("wrong")));
    assert!(!now.contains_key("bowl"), "no file of this machine is read");
    move_cup(&mut b, 3.0);
    settle(&mut a, &mut b);
}
