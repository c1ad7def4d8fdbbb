//! A lidar on a robot that moves, and a mapper that wants its points in the map: their connection
//! changes the frame, by the tree of a third component.

use crate::python_site::{names_of_others, second_component, up, workspace};
use rc_test_site::site::Site;
use serde_json::{Value, json};
use std::fs;

pub(crate) const SCAN: &str = r#"module Scanning
{
    struct Seen
    {
        float x;
        float y;
        float z;
    };

    struct Scan
    {
        @unit("ns") long stamp;
        sequence<Seen> points;
    };

    interface ScanPub
    {
        publish newScan(Scan scan);
    };
};
"#;

/// Three of these: axes, unit, frame.
const PROTOTYPE: &str = r#"import "Scan.idsl";

axes own :: AXES
algebraic xyz :: Scalar{x, y, z}
units own :: qudt, xyz { x = UNIT, y = UNIT, z = UNIT }

dproto scanned :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = xyz
    ddr       = :: IDSL{Scanning::Scan}
    dr        = { x = x, y = y, z = z }
    units     = own
    axes      = own
    sequence  = member points
    frames    = { with_respect_to = FRAME, stamp = member stamp }
}
"#;

const LIDAR: &str = "import \"Scan.idsl\";\nimport \"InnerModel.idsl\";\nimport \"scan.dproto\";\n\nComponent lidar\n{\n    \
    Communications\n    {\n        publishes ScanPub { reliability reliable; depth 10; };\n        \
    requires InnerModel as world;\n    };\n    language python;\n    period 20ms;\n};\n";
const MAPPER: &str = "import \"Scan.idsl\";\nimport \"InnerModel.idsl\";\nimport \"scan.dproto\";\n\nComponent mapper\n{\n    \
    Communications\n    {\n        subscribesTo ScanPub as lidar { reliability reliable; depth 10; };\n        \
    requires InnerModel as world;\n    };\n    language python;\n    period 1s;\n};\n";

/// Moves its robot, and publishes a point 1 m ahead of where it was a period ago.
const OF_LIDAR: &str = r#"from lidar import Context, Pose, Scan, Seen, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0
        self.before = 0

    def compute(self, ctx: Context) -> None:
        self.number += 1
        pose = Pose(50.0 * self.number, 0.0, 100.0 * self.number, 0.0, 0.1 * self.number, 0.0)
        ctx.world.set_pose("robot", pose)
        if self.before:
            ctx.scan_pub.new_scan(Scan(self.before, [Seen(0.0, 1000.0, 0.0)]))
        self.before = ctx.now_ns()
"#;
const OF_MAPPER: &str = r#"from mapper import Context, Scan, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def lidar_new_scan(self, ctx: Context, scan: Scan) -> None:
        [point] = scan.points
        print("seen", scan.stamp, point.x, point.y, point.z, flush=True)
"#;

const TREE: &str = r#"<innerModel>
    <transform id="map">
        <transform id="robot">
            <translation id="lidar" ty="300" tz="200"/>
        </transform>
    </transform>
</innerModel>
"#;

pub(crate) fn prototype(axes: &str, unit: &str, frame: &str) -> String {
    let text = PROTOTYPE.replace("AXES", axes).replace("UNIT", unit);
    text.replace("FRAME", frame)
}

fn network(site: &Site, block: &str) {
    let tree = site.write("world.xml", TREE).display().to_string();
    site.write_ddsl(&format!(
        "Deployment patrol\n{{\n    World g {{ schema \"innermodel.gdsl\"; }};\n    Component world {{ cdsl \"../inner_model/inner_model.cdsl\"; parameters {{ file \"{tree}\"; }}; }};\n    \
         Component lidar {{ cdsl \"lidar/lidar.cdsl\"; after mapper; }};\n    \
         Component mapper {{ cdsl \"mapper/mapper.cdsl\"; }};\n    \
         bind mapper.lidar -> lidar.ScanPub {block}\n}};\n"
    ));
}

#[test]
fn a_mapper_sees_points_of_a_moving_lidar_in_the_map() {
    let test = "a_mapper_sees_points_of_a_moving_lidar_in_the_map";
    let interface = fs::read_to_string(Site::components().join("interfaces/InnerModel.idsl"));
    let interface = interface.expect("the interface");
    let (lidar, mapper) = (
        prototype("right, ahead, up", "mm", "lidar"),
        prototype("ahead, left, up", "m", "map"),
    );
    let files = [
        ("mapper.cdsl", MAPPER),
        ("Scan.idsl", SCAN),
        ("InnerModel.idsl", &interface),
        ("scan.dproto", &mapper),
        ("src/specific_worker.py", OF_MAPPER),
    ];
    let _names = names_of_others();
    let Some(site) = workspace("moving", "mapper", &files, test) else {
        return;
    };
    let files = [
        ("lidar.cdsl", LIDAR),
        ("Scan.idsl", SCAN),
        ("InnerModel.idsl", &interface),
        ("scan.dproto", &lidar),
        ("src/specific_worker.py", OF_LIDAR),
    ];
    second_component(&site, "lidar", &files);

    // Two frames that move need something that knows where they are.
    network(&site, "{ convert; };");
    let refused = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_ne!(refused.code, 0, "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    for part in [
        "error[frame-mismatch]",
        "`with_respect_to` is `lidar` and `map`",
        "`bind mapper.lidar -> lidar.ScanPub { convert { frames SLOT; }; };`",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }

    network(&site, "{ convert { frames world; }; };");
    let started = up(&site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("lidar"));
    let plan = site.rcdeploy(&["plan", "--format", "json", "--profile", "dev"], true);
    assert!(
        plan.stdout.contains("frames lidar → map at member stamp"),
        "{plan:?}"
    );
    let plan: Value = serde_json::from_str(&plan.stdout).expect("JSON");
    let arguments = plan["components"].to_string();
    assert!(
        arguments.contains("\"--frames\",\"lidar=world\""),
        "{arguments}"
    );
    Site::until("20 points", || site.count_in_log("mapper", "seen ") >= 20);
    let log = site.log("mapper");
    let mut last = 0.0;
    for line in log
        .lines()
        .filter(|line| line.starts_with("seen "))
        .take(20)
    {
        let numbers: Vec<&str> = line.split_whitespace().skip(1).collect();
        let stamp: i64 = numbers[0].parse().expect("a time");
        let found: Vec<f64> = numbers[1..]
            .iter()
            .map(|n| n.parse().expect("a number"))
            .collect();
        // The answer of the tree for that time, worked out by hand: right, up and ahead, in mm.
        let pose = site.call_tree(
            "world.InnerModel.getPoseAt",
            &json!({"to": "map", "id": "lidar", "time": stamp}),
        );
        let of = |name: &str| {
            let number = pose.pointer(&format!("/result/return/{name}"));
            number
                .and_then(Value::as_f64)
                .unwrap_or_else(|| panic!("{name}: {pose}"))
        };
        // The third column of Rx·Ry·Rz is where the axis ahead points to.
        let ((sx, cx), (sy, cy)) = (of("rx").sin_cos(), of("ry").sin_cos());
        let there = [
            of("x") + 1000.0 * sy,
            of("y") - 1000.0 * sx * cy,
            of("z") + 1000.0 * cx * cy,
        ];
        let expected = [there[2] / 1e3, -there[0] / 1e3, there[1] / 1e3];
        for (one, other) in found.iter().zip(expected) {
            assert!((one - other).abs() < 1e-4, "{line}: {expected:?} of {pose}");
        }
        assert_ne!(found[0].to_bits(), f64::to_bits(last), "it moves: {log}");
        last = found[0];
    }
    let slot = || {
        let status = site.ask("mapper", "status");
        let slots = status["slots"].as_array().expect("a list").clone();
        let own = slots.into_iter().find(|slot| slot["name"] == "lidar");
        own.expect("the slot")["converted"].clone()
    };
    assert!(slot()["messages"].as_u64() >= Some(20), "{}", slot());

    // Without the frame, scans are refused and counted.
    site.call_tree("world.InnerModel.remove", &json!({"id": "lidar"}));
    Site::until("refused scans", || slot()["unplaced"].as_u64() >= Some(2));
    site.await_in_log("mapper", "no transform from `lidar` to `map` at ");
    Site::until("the count in the status", || {
        let status = site.rcdeploy(&["status", &site.network], false);
        status.stdout.contains(", without a transform ")
    });
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

const TF_LIDAR: &str = "import \"Scan.idsl\";\nimport \"TransformPub.idsl\";\nimport \"scan.dproto\";\n\nComponent lidar\n{\n    \
    Communications\n    {\n        publishes ScanPub { reliability reliable; depth 10; }, TransformPub as tf { depth 100; };\n    };\n    \
    language python;\n    period 20ms;\n};\n";
const TF_MAPPER: &str = "import \"Scan.idsl\";\nimport \"TransformPub.idsl\";\nimport \"scan.dproto\";\n\nComponent mapper\n{\n    \
    Communications\n    {\n        subscribesTo ScanPub as lidar { reliability reliable; depth 10; }, TransformPub as tf { depth 100; };\n    };\n    \
    language python;\n    period 1s;\n};\n";

/// Publishes a scan, and then where the lidar was at its time: n decimetres ahead, turned by n tenths
/// to the left.
const OF_TF_LIDAR: &str = r#"from math import cos, sin

from lidar import Context, Header, Quaternion, Scan, Seen, Time, Transform, TransformStamped, Vector3, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0

    def where(self, stamp: int) -> TransformStamped:
        half = 0.05 * self.number
        pose = Transform(Vector3(0.1 * self.number, 0.0, 0.2), Quaternion(0.0, 0.0, sin(half), cos(half)))
        return TransformStamped(Header(Time(stamp // 10**9, stamp % 10**9), "map"), "lidar", pose)

    def compute(self, ctx: Context) -> None:
        self.number += 1
        stamp = ctx.now_ns()
        ctx.scan_pub.new_scan(Scan(stamp, [Seen(0.0, 1000.0, 0.0), Seen(0.0, 0.0, 0.0)]))
        ctx.tf.transforms([self.where(stamp)])
"#;
const OF_TF_MAPPER: &str = r#"from mapper import Context, Scan, TransformStamped, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def lidar_new_scan(self, ctx: Context, scan: Scan) -> None:
        [point, own] = scan.points
        print("seen", point.x, point.y, point.z, own.x, own.y, own.z, flush=True)

    def tf_transforms(self, ctx: Context, transforms: list[TransformStamped]) -> None: ...
"#;

/// Scans that come before the transforms of their times wait for these.
#[test]
fn a_mapper_follows_the_transforms_of_tf() {
    let test = "a_mapper_follows_the_transforms_of_tf";
    let interface = fs::read_to_string(Site::components().join("interfaces/TransformPub.idsl"));
    let interface = interface.expect("the interface");
    let (lidar, mapper) = (
        prototype("right, ahead, up", "mm", "lidar"),
        prototype("ahead, left, up", "m", "map"),
    );
    let files = [
        ("mapper.cdsl", TF_MAPPER),
        ("Scan.idsl", SCAN),
        ("TransformPub.idsl", &interface),
        ("scan.dproto", &mapper),
        ("src/specific_worker.py", OF_TF_MAPPER),
    ];
    let _names = names_of_others();
    let Some(site) = workspace("following", "mapper", &files, test) else {
        return;
    };
    let files = [
        ("lidar.cdsl", TF_LIDAR),
        ("Scan.idsl", SCAN),
        ("TransformPub.idsl", &interface),
        ("scan.dproto", &lidar),
        ("src/specific_worker.py", OF_TF_LIDAR),
    ];
    second_component(&site, "lidar", &files);
    site.write_ddsl(
        "Deployment patrol\n{\n    Component lidar { cdsl \"lidar/lidar.cdsl\"; after mapper; };\n    \
         Component mapper { cdsl \"mapper/mapper.cdsl\"; };\n    \
         bind mapper.lidar -> lidar.ScanPub { convert { frames tf; }; };\n};\n",
    );
    let started = up(&site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("lidar"));
    Site::until("20 points", || site.count_in_log("mapper", "seen ") >= 20);
    let status = site.ask("mapper", "status");
    let slots = status["slots"].as_array().expect("a list");
    let slot = slots.iter().find(|slot| slot["name"] == "lidar");
    let converted = &slot.expect("the slot")["converted"];
    // Of the first ones, no transform had come.
    assert!(converted["unplaced"].as_u64() <= Some(2), "{converted}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    let log = site.log("mapper");
    let lines = log.lines().filter_map(|line| line.strip_prefix("seen "));
    for line in lines.take(20) {
        let found: Vec<f64> = line
            .split_whitespace()
            .map(|number| number.parse().expect("a number"))
            .collect();
        let n = (found[3] * 10.0).round();
        assert!(n >= 1.0, "{line}");
        let (sine, cosine) = (0.1 * n).sin_cos();
        let expected = [0.1 * n + cosine, sine, 0.2, 0.1 * n, 0.0, 0.2];
        for (one, other) in found.iter().zip(expected) {
            assert!((one - other).abs() < 1e-4, "{line}: {expected:?}");
        }
    }
}
