//! Numbers that a file can say and no robot has.

use innermodel::{InnerModel, NodeId, Point, Pose, Time, Vector};
use innermodel_collision::{BodyError, Space};

/// Each pose is finite; their sums are not.
#[test]
fn places_beyond_all_numbers_are_no_contact() {
    let far = |x: &str| {
        format!(
            r#"<transform id="a{x}" tx="{x}"><transform id="b{x}" tx="{x}" ry="1"><transform id="c{x}" tx="{x}">
            <sphere id="ball{x}" radius="100" collide="1"/><plane id="box{x}" size="10,10,10" collide="1"/>
            <cylinder id="can{x}" radius="5" length="10" collide="1"/><cone id="hat{x}" radius="5" length="10" collide="1"/>
            </transform></transform></transform>"#
        )
    };
    let sizes = r#"<sphere id="great" radius="1e308" collide="1"/><plane id="wide" size="1e308,1e308,1e308" collide="1"/>
        <plane id="thin" size="1e-308,0,1e-308" collide="1"/><cylinder id="long" radius="1e-308" length="1e308" collide="1"/>
        <cone id="sharp" radius="1e308" length="1e-308" collide="1"/><sphere id="near" radius="1" collide="1"/>"#;
    let text = format!(
        "<innerModel>{}{}{}{sizes}</innerModel>",
        far("1e308"),
        far("-1e308"),
        far("1e200")
    );
    let model = InnerModel::parse(&text).expect("a model");
    let mut space = Space::new(&model.snapshot());
    let far = space.problems();
    assert!(far.iter().any(|problem| problem.id == "great"), "{far:?}");
    assert!(matches!(far[0].error, BodyError::TooFar));
    let ids: Vec<NodeId> = model.snapshot().nodes().map(|n| n.node_id()).collect();
    let ask = |space: &Space| {
        space.collisions();
        for a in &ids {
            for b in &ids {
                space.collide(*a, *b).expect("two nodes");
                space.distance(*a, *b).expect("two nodes");
                space.contacts(*a, *b).expect("two nodes");
            }
            for way in [
                Vector::x(),
                Vector::new(1e308, -1e308, 1e-308),
                Vector::new(f64::NAN, 0.0, 0.0),
            ] {
                for range in [1.0, 1e308, f64::INFINITY, f64::NAN, -1.0] {
                    let _ = space.ray(*a, Point::new(1e308, 0.0, 0.0), way, range, &|_| true);
                    let _ = space.ray(*a, Point::origin(), way, range, &|_| true);
                    let _ = space
                        .caster(*a)
                        .expect("a node")
                        .cast(&way, range, &|_| true);
                }
            }
        }
    };
    ask(&space);
    for x in [0.0, 1e308, -1e308, 1.0] {
        model
            .change(Time::ZERO, |edit| {
                edit.set_pose("b1e308", Pose::new(x, x, x, 1.0, x, 0.0))?;
                edit.set_pose("near", Pose::new(x, x, x, 1.0, x, 0.0))
            })
            .expect("a change");
        space.update(&model.snapshot());
        ask(&space);
    }
    // A body that comes back meets others again.
    let hit = space.ray(
        "root",
        Point::origin(),
        Vector::new(1.0, 1.0, 1.0),
        100.0,
        &|node| {
            model
                .snapshot()
                .node(node)
                .is_ok_and(|node| node.id() == "near")
        },
    );
    assert!(hit.expect("the root").is_some());
}

/// Bodies of all sizes, in each other and at all distances.
#[test]
fn no_size_and_no_place_stops_the_program() {
    arbtest::arbtest(|u| {
        let mut number = || {
            let exponent = f64::from(u.int_in_range(-15_000..=13_000)?) / 1000.0;
            Ok(10_f64.powf(exponent))
        };
        let mast = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/mast.obj");
        let mut text = String::new();
        for n in 0..10 {
            let [first, second, third] = [number()?, number()?, number()?];
            let body = match n / 2 {
                0 => format!(r#"<sphere id="s{n}" radius="{first}""#),
                1 => format!(r#"<plane id="s{n}" size="{first},{second},{third}""#),
                2 => format!(r#"<cylinder id="s{n}" radius="{first}" length="{second}""#),
                3 => format!(r#"<cone id="s{n}" radius="{first}" length="{second}""#),
                _ => format!(r#"<mesh id="s{n}" file="{mast}" scale="{first},{second},{third}""#),
            };
            let (x, y, z) = if n % 2 == 0 {
                (0.0, 0.0, 0.0)
            } else {
                (number()?, number()?, number()?)
            };
            text += &format!(
                r#"<transform id="t{n}" tx="{x}" ty="-{y}" tz="{z}" rx="1">{body} collide="1"/></transform>"#
            );
        }
        let model = InnerModel::parse(&format!("<innerModel>{text}</innerModel>"));
        let tree = model.expect("a model").snapshot();
        let space = Space::new(&tree);
        space.collisions();
        for a in 0..10 {
            let (a, b) = (format!("s{a}"), format!("s{}", (a + 3) % 10));
            space.distance(&a, &b).expect("two nodes");
            space.contacts(&a, &b).expect("two nodes");
            let way = tree.transform(&a, Point::origin(), &b).expect("a point");
            space
                .ray(&a, Point::origin(), way.coords, 1e300, &|_| true)
                .expect("a node");
        }
        Ok(())
    })
    .size_min(4096)
    .budget_ms(500);
}

/// A change of other data makes no new body, and reports the old one no second time.
#[test]
fn a_far_body_is_reported_once() {
    let text = r#"<innerModel><sphere id="far" radius="1" tx="1e20" collide="1"/></innerModel>"#;
    let model = InnerModel::parse(text).expect("a model");
    let mut space = Space::new(&model.snapshot());
    assert_eq!(space.problems().len(), 1);
    model
        .change(Time::ZERO, |edit| {
            edit.add_attribute("far", "owner", "string", "me")
        })
        .expect("a change");
    assert_eq!(space.update(&model.snapshot()), 0);
    assert!(space.problems().is_empty());
}
