//! Ranges.

use crate::{closed_form, room, world};
use innermodel::{Pose, Vector};
use innermodel_simulation::Error;
use std::f64::consts::PI;

#[test]
fn a_laser_measures_the_closed_form() {
    let inside = r#"<transform id="stand" tx="700" ty="900" tz="-400" ry="0.3" rx="0.2">
        <laser id="scanner" max="20000" angle="6" measures="361"/>
    </transform>"#;
    let mut world = world(&room(inside));
    let place = world.tree().between("root", "scanner").expect("a node");
    let scan = world.scan("scanner").expect("a scan");
    assert_eq!(scan.ranges.len(), 361);
    assert!(
        (scan.ranges[0].angle - 3.0).abs() < 1e-12 && (scan.ranges[360].angle + 3.0).abs() < 1e-12
    );
    for range in &scan.ranges {
        let way = place.vector(&Vector::new(range.angle.sin(), 0.0, range.angle.cos()));
        let expected = closed_form([700.0, 900.0, -400.0], way.into());
        assert!(
            (range.distance / expected - 1.0).abs() < 1e-6,
            "{range:?}: {expected}"
        );
    }
}

#[test]
fn a_robot_does_not_see_itself_but_others() {
    let inside = r#"<differentialrobot id="base" ty="100">
            <cylinder id="hull" radius="200" length="180" collide="1"/>
            <laser id="own" max="5000" angle="3" measures="3"/>
        </differentialrobot>
        <omnirobot id="other" ty="100" tz="1000"><cylinder id="other_hull" radius="200" length="180"/></omnirobot>"#;
    let mut world = world(&room(inside));
    let scan = world.scan("own").expect("a scan");
    assert!((scan.ranges[1].distance - 800.0).abs() < 1e-6, "{scan:?}");
}

#[test]
fn what_is_too_near_or_too_far_has_the_limit() {
    let inside = r#"<transform id="stand" ty="500" tz="1950">
        <laser id="scanner" min="100" max="1500" angle="1" measures="1"/>
        <transform id="back" ry="3.141592653589793"><laser id="far" min="100" max="1500" measures="1"/></transform>
    </transform>"#;
    let mut world = world(&room(inside));
    assert_eq!(
        world.scan("scanner").expect("a scan").ranges[0].distance,
        100.0
    );
    assert_eq!(
        world.scan("far").expect("a scan").ranges[0].distance,
        1500.0
    );
}

#[test]
fn an_ultrasound_sensor_measures_the_nearest_range_in_its_cone() {
    let inside = r#"<transform id="stand" ty="1000" ry="0.4">
        <ultrasound id="wide" max="9000" angle="0.9"/>
        <ultrasound id="edge" max="9000" angle="0.5"/>
        <ultrasound id="narrow" max="9000"/>
    </transform>
    <transform id="front" ty="1000" tx="-1000"><ultrasound id="straight" max="9000" angle="0.9"/></transform>"#;
    let mut world = world(&room(inside));
    let mut range = |id| world.scan(id).expect("a scan").ranges[0].distance;
    for (id, expected) in [
        ("narrow", 2000.0 / 0.4_f64.cos()),
        ("straight", 2000.0),
        // The foot of the wall is in the cone, between its rays.
        ("wide", 2000.0),
        // The nearest part of the wall is at the edge of the cone.
        ("edge", 2000.0 / 0.15_f64.cos()),
    ] {
        let found = range(id);
        assert!((found / expected - 1.0).abs() < 1e-6, "{id}: {found}");
    }
}

#[test]
fn a_lidar_has_rings() {
    let inside = r#"<transform id="stand" tx="200" ty="1200" tz="300" ry="1">
        <lidar id="lidar" max="30000" measures="90" rings="16" low="-0.5" high="0.25"/>
    </transform>"#;
    let mut world = world(&room(inside));
    let place = world.tree().between("root", "lidar").expect("a node");
    let cloud = world.cloud("lidar").expect("a cloud");
    assert_eq!(cloud.points.len(), 90 * 16);
    for point in &cloud.points {
        let there = place.point(&point.point);
        let way = (there.coords - place.translation) / point.distance;
        let expected = closed_form([200.0, 1200.0, 300.0], way.into());
        assert!((point.distance / expected - 1.0).abs() < 1e-6);
        let elevation = -0.5 + 0.05 * f64::from(point.ring);
        assert!((point.elevation - elevation).abs() < 1e-12);
        assert!((point.point.y / point.distance - elevation.sin()).abs() < 1e-12);
    }
    let second = cloud.points[1].azimuth - cloud.points[0].azimuth;
    assert!(
        (second + 2.0 * PI / 90.0).abs() < 1e-12,
        "a whole turn ends before its start"
    );
}

#[test]
fn frames_follow_rate_and_latency_and_show_changes() {
    let inside = r#"<transform id="stand" ty="500">
        <laser id="fast" max="9000" measures="1"/>
        <laser id="slow" max="9000" measures="1" rate="20"/>
        <laser id="late" max="9000" measures="1" latency="0.03"/>
    </transform>"#;
    let mut world = world(&room(inside));
    let first = world.scan("slow").expect("a scan");
    assert_eq!((first.number, first.time.as_millis()), (0, 0));
    world.run(14).expect("steps");
    let times = ["fast", "slow", "late"].map(|id| world.scan(id).expect("a scan").time.as_millis());
    assert_eq!(times, [140, 100, 110]);
    let near = Pose::new(0.0, 500.0, 1000.0, 0.0, 0.0, 0.0);
    world.teleport("stand", "root", near).expect("a place");
    assert_eq!(
        world.scan("fast").expect("a scan").ranges[0]
            .distance
            .round(),
        2000.0
    );
    world.step().expect("a step");
    let mut range = |id| world.scan(id).expect("a scan").ranges[0].distance.round();
    assert_eq!(
        ["fast", "slow", "late"].map(&mut range),
        [1000.0, 1000.0, 2000.0]
    );
    world.run(3).expect("steps");
    assert_eq!(
        world.scan("late").expect("a scan").ranges[0]
            .distance
            .round(),
        1000.0
    );
}

#[test]
fn wrong_names_and_sizes_are_refused() {
    let inside = r#"<transform id="stand" rx="0.1"><laser id="scanner" max="1" measures="4000000000"/><camera id="eye"/></transform>"#;
    let mut world = world(&room(inside));
    let text = |error: Error| error.to_string();
    assert_eq!(
        text(world.scan("scaner").unwrap_err()),
        "no node has the id `scaner`, did you mean `scanner`?"
    );
    assert_eq!(
        text(world.scan("floor").unwrap_err()),
        "`floor` is a plane, not a sensor"
    );
    assert_eq!(
        text(world.scan("eye").unwrap_err()),
        "`eye` is a camera, not a laser or ultrasound sensor"
    );
    assert_eq!(
        text(world.cloud("scanner").unwrap_err()),
        "`scanner` is a laser, not a lidar"
    );
    assert_eq!(
        text(world.scan("scanner").unwrap_err()),
        "`scanner` would measure 4000000000 values; at most 4000000 are possible"
    );
}

#[test]
fn a_lidar_without_measures_has_no_points() {
    let mut world = world(&room(
        r#"<lidar id="empty" max="9000" rings="4294967295"/>"#,
    ));
    assert_eq!(world.cloud("empty").expect("a cloud").points, []);
}

#[test]
fn what_one_ray_meets_changes_no_other_one() {
    let text = |more: &str, cup: &str| {
        room(&format!(
            r#"<transform id="stand" ty="500">
                <laser id="scanner" max="2100" angle="1" measures="11" noise="10" {more}/>
            </transform>{cup}"#
        ))
    };
    let ranges = |text: &str| {
        let mut world = world(text);
        world.run(3).expect("steps");
        let scan = world.scan("scanner").expect("a scan");
        scan.ranges
            .iter()
            .map(|range| range.distance)
            .collect::<Vec<_>>()
    };
    // Outer rays have no echo; the cup gives the first one an echo.
    let plain = ranges(&text("", ""));
    let cup = r#"<transform id="cup" tx="500" ty="500" tz="900"><sphere id="c" radius="80"/></transform>"#;
    let with_cup = ranges(&text("", cup));
    assert!(plain[0] == 2100.0 && with_cup[0] < 1500.0, "{with_cup:?}");
    assert_eq!(plain[2..], with_cup[2..]);
    // A value is lost, or it is the same.
    let lossy = ranges(&text(r#"dropout="0.4""#, ""));
    let same = plain.iter().zip(&lossy).filter(|(a, b)| a == b).count();
    let lost = plain
        .iter()
        .zip(&lossy)
        .filter(|(a, b)| a != b && **b == 2100.0)
        .count();
    assert!(same + lost == 11 && lost > 0, "{plain:?} {lossy:?}");
}

#[test]
fn rates_and_latencies_that_cannot_be_are_told() {
    let mut world = world(&room(
        r#"<laser id="fast" max="9000" measures="1" rate="1e20"/>
        <laser id="late" max="9000" measures="1" latency="1e20"/>
        <laser id="odd" max="9000" measures="1" rate="30"/>"#,
    ));
    let problems = world.problems();
    assert_eq!(
        problems,
        [
            "`fast`: a rate of 100000000000000000000 is more than one frame in each step of 10ms: \
             it gets that",
            "`late`: a latency of 100000000000000000000 s is more than 4096 frames: they come \
             after 40.96 s"
        ]
    );
    let mut times = Vec::new();
    for _ in 0..100 {
        world.step().expect("a step");
        let time = world.scan("odd").expect("a scan").time.as_millis();
        if times.last() != Some(&time) {
            times.push(time);
        }
    }
    assert_eq!(times[..5], [0, 40, 70, 100, 140]);
    assert_eq!(world.scan("fast").expect("a scan").number, 100);
    assert_eq!(world.scan("late").expect("a scan").number, 0, "it waits");
    // A sensor that comes later keeps its rate.
    let kind = world.tree().node("odd").expect("a node").kind().clone();
    world
        .edit(|edit| {
            edit.add(
                "root",
                innermodel::NewNode::new("new", kind, Pose::default()),
            )
        })
        .expect("a change");
    world.step().expect("a step");
    assert_eq!(world.scan("new").expect("a scan").number, 0);
    assert_eq!(world.problems(), Vec::<String>::new(), "told once");
}
