//! A connection that changes frames by the transforms of a real ROS 2: a node of rclpy publishes `/tf`
//! and `/tf_static`.

use crate::moving::{SCAN, prototype};
use crate::python_site::{names_of_others, second_component, up, workspace};
use rc_test_site::site::Site;
use rc_test_support::ros_packages::RosPackages;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

const DOMAIN: &str = "40";

/// The messages of tf have no wheel: the package with these files is built.
const PACKAGE: [(&str, &str); 3] = [
    (
        "msg/TFMessage.msg",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
    (
        "package.xml",
        "<package format=\"3\"><name>tf2_msgs</name><version>0.0.0</version><description>tf</description>\
         <maintainer email=\"a@example.org\">a</maintainer><license>BSD</license>\
         <buildtool_depend>ament_cmake</buildtool_depend><buildtool_depend>rosidl_default_generators</buildtool_depend>\
         <depend>geometry_msgs</depend><exec_depend>rosidl_default_runtime</exec_depend>\
         <member_of_group>rosidl_interface_packages</member_of_group>\
         <export><build_type>ament_cmake</build_type></export></package>\n",
    ),
    (
        "CMakeLists.txt",
        "cmake_minimum_required(VERSION 3.8)\nproject(tf2_msgs)\nfind_package(ament_cmake REQUIRED)\n\
         find_package(geometry_msgs REQUIRED)\nfind_package(rosidl_default_generators REQUIRED)\n\
         rosidl_generate_interfaces(${PROJECT_NAME} \"msg/TFMessage.msg\" DEPENDENCIES geometry_msgs)\n\
         ament_package()\n",
    ),
];

const LIDAR: &str = "import \"Scan.idsl\";\nimport \"scan.dproto\";\n\nComponent lidar\n{\n    \
    Communications\n    {\n        publishes ScanPub { reliability reliable; depth 10; };\n    };\n    \
    language python;\n    period 20ms;\n};\n";
const MAPPER: &str = "import \"Scan.idsl\";\nimport \"TransformPub.idsl\";\nimport \"scan.dproto\";\n\nComponent mapper\n{\n    \
    Communications\n    {\n        subscribesTo ScanPub as lidar { reliability reliable; depth 10; },\n        \
    TransformPub(ros2) as tf { depth 100; },\n        \
    TransformPub(ros2) as tf_static { reliability reliable; durability transient_local; depth 100; };\n    };\n    \
    language python;\n    period 1s;\n};\n";

/// A point 1 m ahead, now.
const OF_LIDAR: &str = r"from lidar import Context, Scan, Seen, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None:
        ctx.scan_pub.new_scan(Scan(ctx.now_ns(), [Seen(0.0, 1000.0, 0.0)]))
";
const OF_MAPPER: &str = r#"from mapper import Context, Scan, TransformStamped, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def lidar_new_scan(self, ctx: Context, scan: Scan) -> None:
        [point] = scan.points
        print("seen", scan.stamp, point.x, point.y, point.z, flush=True)

    def tf_transforms(self, ctx: Context, transforms: list[TransformStamped]) -> None: ...

    def tf_static_transforms(self, ctx: Context, transforms: list[TransformStamped]) -> None: ...
"#;

#[test]
fn a_mapper_follows_tf_of_a_real_ros() {
    let test = "a_mapper_follows_tf_of_a_real_ros";
    let Some(ros) = RosPackages::new(test) else {
        return;
    };
    let interface = fs::read_to_string(Site::components().join("interfaces/TransformPub.idsl"));
    let interface = interface.expect("the interface");
    let (lidar, mapper) = (
        prototype("right, ahead, up", "mm", "lidar"),
        prototype("ahead, left, up", "m", "map"),
    );
    let files = [
        ("mapper.cdsl", MAPPER),
        ("Scan.idsl", SCAN),
        ("TransformPub.idsl", &interface),
        ("scan.dproto", &mapper),
        ("src/specific_worker.py", OF_MAPPER),
    ];
    let _names = names_of_others();
    let Some(site) = workspace("tf", "mapper", &files, test) else {
        return;
    };
    let files = [
        ("lidar.cdsl", LIDAR),
        ("Scan.idsl", SCAN),
        ("scan.dproto", &lidar),
        ("src/specific_worker.py", OF_LIDAR),
    ];
    second_component(&site, "lidar", &files);
    let (package, built) = (site.path("tf2_msgs"), site.path("built"));
    for (name, text) in PACKAGE {
        let path = package.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("to write");
    }
    ros.build(&package, &built);

    site.write_ddsl(
        "Deployment patrol\n{\n    Component lidar { cdsl \"lidar/lidar.cdsl\"; after mapper; };\n    \
         Component mapper { cdsl \"mapper/mapper.cdsl\"; };\n    \
         bind mapper.lidar -> lidar.ScanPub { convert { frames tf, tf_static; }; };\n    \
         external mapper.tf, mapper.tf_static;\n    \
         middleware ros2 { remap \"tf/transforms:=/tf\", \"tf_static/transforms:=/tf_static\"; };\n};\n",
    );
    let started = up(
        &site,
        &[
            ("ROS_DOMAIN_ID", Path::new(DOMAIN)),
            ("ROS_LOCALHOST_ONLY", Path::new("1")),
        ],
    );
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("lidar"));
    // Without transforms, scans are refused.
    let slot = || {
        let status = site.ask("mapper", "status");
        let slots = status["slots"].as_array().expect("a list").clone();
        let own = slots.into_iter().find(|slot| slot["name"] == "lidar");
        own.expect("the slot")["converted"].clone()
    };
    Site::until("refused scans", || slot()["unplaced"].as_u64() >= Some(2));
    assert_eq!(slot()["messages"], 0, "{}", slot());

    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../middleware/ros2/tests/rclpy/transforms.py"
    );
    let mut node = ros.python(&built);
    node.args(["-B", script, &site.network])
        .env("ROS_DOMAIN_ID", DOMAIN)
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
        .env("ROS_LOG_DIR", site.path("ros"));
    site.place(&mut node);
    let mut node = node
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the node");
    let mut line = String::new();
    let said = BufReader::new(node.stdout.take().expect("a pipe")).read_line(&mut line);
    said.expect("a line");
    let begin = line
        .trim()
        .strip_prefix("begin ")
        .and_then(|begin| begin.parse::<i64>().ok());
    let begin = begin.unwrap_or_else(|| panic!("{line}"));
    Site::until("50 points", || site.count_in_log("mapper", "seen ") >= 50);
    let converted = slot();
    drop(node.stdin.take());
    assert!(node.wait().expect("its end").success());
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    assert!(converted["messages"].as_u64() >= Some(50), "{converted}");

    let log = site.log("mapper");
    let lines = log.lines().filter_map(|line| line.strip_prefix("seen "));
    for line in lines.take(50) {
        let (stamp, numbers) = line.split_once(' ').expect("a time");
        let stamp: i64 = stamp.parse().expect("a time");
        let found: Vec<f64> = numbers
            .split_whitespace()
            .map(|number| number.parse().expect("a number"))
            .collect();
        // Where the node was at that time: the point is 1 m to the left of the lidar's mount.
        let seconds = (stamp - begin) as f64 / 1e9;
        assert!(seconds > -0.1, "{line}");
        let (sine, cosine) = (0.3 * seconds).sin_cos();
        let expected = [
            0.5 * seconds + 0.2 * cosine - sine,
            0.2 * sine + cosine,
            0.3,
        ];
        for (one, other) in found.iter().zip(expected) {
            assert!((one - other).abs() < 1e-4, "{line}: {expected:?}");
        }
    }
}
