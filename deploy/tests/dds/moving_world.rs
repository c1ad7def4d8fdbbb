//! A lidar on a robot that moves, and a mapper that wants its points in the map: their connection
//! changes the frame, by the world that they share.

use crate::moving::{SCAN, prototype};
use crate::python_site::{names_of_others, second_component, up, workspace};
use rc_test_site::site::Site;
use serde_json::Value;

const HOME: &str = include_str!("../../../components/interfaces/home.gdsl");
const LIDAR: &str = "import \"Scan.idsl\";\nimport \"scan.dproto\";\n\nComponent lidar\n{\n    \
    Communications\n    {\n        publishes ScanPub { reliability reliable; depth 10; };\n    };\n    \
    language python;\n    period 20ms;\n    world \"home.gdsl\" as g { writes room, door, RT; };\n};\n";
const MAPPER: &str = "import \"Scan.idsl\";\nimport \"scan.dproto\";\n\nComponent mapper\n{\n    \
    Communications\n    {\n        subscribesTo ScanPub as lidar { reliability reliable; depth 10; };\n    };\n    \
    language python;\n    period 1s;\n    world \"home.gdsl\" as g { reads room; };\n};\n";

/// Moves the door `front`, where the lidar is, in the room. Half a second later, when the mapper knows of
/// it, it publishes a point 1 m ahead of where that was, with the number of the pose as its height and the
/// time of the change. The first points have a time before the world has frames.
const OF_LIDAR: &str = r#"from datetime import timedelta

from robocomp.world import TooLate

from lidar import Context, Scan, Seen, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0
        self.before = []

    def compute(self, ctx: Context) -> None:
        self.number += 1
        if self.number < 20:
            ctx.scan_pub.new_scan(Scan(ctx.now_ns(), [Seen(0.0, 1000.0, 0.0)]))
            return
        with ctx.g.change() as edit:
            if self.number == 20:
                room, door = edit.add_room("kitchen"), edit.add_door("front")
                door.width = 0.8
            else:
                now = ctx.g.snapshot()
                room, door = now.room("kitchen"), now.door("front")
            pose = [0.1 * self.number, 0.05 * self.number, 0.2, 0.0, 0.0, 0.1 * self.number]
            edit.rt(room, door).pose = pose
        try:
            ctx.g.matrix("kitchen", "front", 2**62)
        except TooLate as late:
            newest = late.newest // timedelta(microseconds=1) * 1000
            self.before.append((newest, self.number))
        if len(self.before) > 25:
            time, number = self.before.pop(0)
            ctx.scan_pub.new_scan(Scan(time, [Seen(0.0, 1000.0, float(number))]))
"#;
const OF_MAPPER: &str = r#"from mapper import Context, Scan, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def lidar_new_scan(self, ctx: Context, scan: Scan) -> None:
        [point] = scan.points
        print("seen", point.x, point.y, point.z, flush=True)
"#;

fn network(site: &Site, block: &str) {
    site.write_ddsl(&format!(
        "Deployment patrol\n{{\n    World g {{ schema \"lidar/home.gdsl\"; }};\n    \
         Component lidar {{ cdsl \"lidar/lidar.cdsl\"; after mapper; }};\n    \
         Component mapper {{ cdsl \"mapper/mapper.cdsl\"; }};\n    \
         bind mapper.lidar -> lidar.ScanPub {block}\n}};\n"
    ));
}

/// What `rcdeploy check` says of a network that it refuses.
fn refused(site: &Site, block: &str) -> String {
    network(site, block);
    let refused = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_ne!(refused.code, 0, "{refused:?}");
    format!("{}{}", refused.stdout, refused.stderr)
}

#[test]
fn a_mapper_sees_points_of_a_moving_lidar_by_the_shared_world() {
    let test = "a_mapper_sees_points_of_a_moving_lidar_by_the_shared_world";
    let (lidar, mapper) = (
        prototype("right, ahead, up", "mm", "front"),
        prototype("ahead, left, up", "m", "kitchen"),
    );
    let files = [
        ("mapper.cdsl", MAPPER),
        ("Scan.idsl", SCAN),
        ("home.gdsl", HOME),
        ("scan.dproto", &mapper),
        ("src/specific_worker.py", OF_MAPPER),
    ];
    let _names = names_of_others();
    let Some(site) = workspace("moving_world", "mapper", &files, test) else {
        return;
    };
    let files = [
        ("lidar.cdsl", LIDAR),
        ("Scan.idsl", SCAN),
        ("home.gdsl", HOME),
        ("scan.dproto", &lidar),
        ("src/specific_worker.py", OF_LIDAR),
    ];
    second_component(&site, "lidar", &files);

    let said = refused(&site, "{ convert; };");
    assert!(said.contains("error[frame-mismatch]"), "{said}");
    let said = refused(&site, "{ convert { frames h; }; };");
    assert!(said.contains("error[unknown-slot]"), "{said}");
    // Of the topics of a world, none but its own name is one.
    for slot in ["g_peers", "g_stream"] {
        let said = refused(&site, &format!("{{ convert {{ frames {slot}; }}; }};"));
        assert!(said.contains("error[wrong-frames]"), "{said}");
    }
    let said = refused(&site, "{ convert via process { frames g; }; };");
    let part = "error[wrong-frames]: `g` is a world, of which an adaptor has no replica";
    assert!(said.contains(part), "{said}");

    network(&site, "{ convert { frames g; }; };");
    let started = up(&site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("lidar"));
    let plan = site.rcdeploy(&["plan", "--format", "json", "--profile", "dev"], true);
    let plan: Value = serde_json::from_str(&plan.stdout).expect("JSON");
    let arguments = plan["components"].to_string();
    assert!(
        arguments.contains("\"--frames\",\"lidar=g\""),
        "{arguments}"
    );
    Site::until("20 points", || site.count_in_log("mapper", "seen ") >= 20);
    let log = site.log("mapper");
    let seen = log.lines().filter_map(|line| line.strip_prefix("seen "));
    let mut numbers = Vec::new();
    for line in seen.take(20) {
        let found: Vec<f64> = line
            .split_whitespace()
            .map(|number| number.parse().expect("a number"))
            .collect();
        let number = ((found[2] - 0.2) * 1000.0).round();
        // Turned by a tenth for each pose, about the axis up.
        let angle = 0.1 * number;
        let expected = [
            0.1 * number + angle.cos(),
            0.05 * number + angle.sin(),
            0.2 + number / 1000.0,
        ];
        for (one, other) in found.iter().zip(expected) {
            assert!((one - other).abs() < 1e-3, "{line}: {expected:?}");
        }
        numbers.push(number);
    }
    assert!(numbers.is_sorted_by(|one, next| one < next), "{numbers:?}");
    // Before the world had frames, points were refused, counted and told.
    let status = site.ask("mapper", "status");
    let mut slots = status["slots"].as_array().expect("a list").iter();
    let slot = slots.find(|slot| slot["name"] == "lidar").expect("it");
    assert!(slot["converted"]["unplaced"].as_u64() > Some(0), "{slot}");
    site.await_in_log(
        "mapper",
        "from `lidar.ScanPub`: no transform from `front` to `kitchen` at ",
    );
    site.await_in_log("mapper", "no node of the world has the name `kitchen`");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
