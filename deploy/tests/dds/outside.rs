//! A chain that passes a node of rclpy: its messages are followed by their stamps, until the node
//! stamps them anew.

use crate::python_site::{second_component, up, workspace};
use rc_test_site::site::Site;
use rc_test_support::python;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

const DOMAIN: &str = "51";

const POINTS: &str = r#"module Points
{
    @ros("builtin_interfaces/msg/Time") struct Time { int sec; uint32 nanosec; };
    @ros("std_msgs/msg/Header") struct Header { @stamp Time stamp; string frame_id; };
    @ros("geometry_msgs/msg/Point") struct Point { double x; double y; double z; };
    @ros("geometry_msgs/msg/PointStamped") struct PointStamped { Header header; Point point; };
    interface PointPub { publish newPoint(PointStamped point); };
};
"#;

const FINDER: &str = "import \"Points.idsl\";\nComponent finder\n{\n    \
    Communications { publishes PointPub(ros2) as found; };\n    language python;\n    \
    period 20ms;\n    reactions { compute -> newPoint budget 5ms; };\n};\n";

const FINDER_WORKER: &str = r"from finder import Context, Header, Point, PointStamped, Time, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0

    def compute(self, ctx: Context) -> None:
        self.number += 1
        header = Header(Time(self.number, 7), 'map')
        ctx.found.new_point(PointStamped(header, Point(0.0, 0.0, 0.0)))
";

const GRASPER: &str = "import \"Points.idsl\";\nComponent grasper\n{\n    \
    Communications { subscribesTo PointPub(ros2) as moved; };\n    language python;\n    \
    period 20ms;\n    reactions { newPoint budget 5ms; };\n};\n";

const GRASPER_WORKER: &str = r"from grasper import Context, PointStamped, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None:
        pass

    def moved_new_point(self, ctx: Context, point: PointStamped) -> None:
        assert point.point.x == 1.0, point
";

const NETWORK: &str = "Deployment patrol
{
    Component finder { cdsl \"finder/finder.cdsl\"; };
    Component grasper { cdsl \"grasper/grasper.cdsl\"; };
    external grasper.moved at \"NETWORK/moved\";
    Chain grasp
    {
        from finder.found.newPoint;
        to grasper.moved.newPoint;
        external finder.found.newPoint -> grasper.moved.newPoint within 100ms;
        within 300ms;
    };
};
";

fn chain(site: &Site) -> Value {
    let shown = site.rcdeploy(&["chains", &site.network, "--format", "json"], false);
    assert_eq!(shown.code, 0, "{shown:?}");
    let document: Value = serde_json::from_str(&shown.stdout).expect("JSON");
    document["chains"][0].clone()
}

#[test]
fn a_chain_passes_a_node_of_rclpy_that_copies_stamps() {
    let test = "a_chain_passes_a_node_of_rclpy_that_copies_stamps";
    let Some(ros) = python::ros(test) else {
        return;
    };
    let finder = [
        ("Points.idsl", POINTS),
        ("finder.cdsl", FINDER),
        ("src/specific_worker.py", FINDER_WORKER),
    ];
    let Some(site) = workspace("outside", "finder", &finder, test) else {
        return;
    };
    let grasper = [
        ("Points.idsl", POINTS),
        ("grasper.cdsl", GRASPER),
        ("src/specific_worker.py", GRASPER_WORKER),
    ];
    second_component(&site, "grasper", &grasper);
    site.write_ddsl(&NETWORK.replace("NETWORK", &site.network));
    let domain = [
        ("ROS_DOMAIN_ID", Path::new(DOMAIN)),
        ("ROS_LOCALHOST_ONLY", Path::new("1")),
    ];
    let up = up(&site, &domain);
    assert_eq!(up.code, 0, "{up:?}\n{}", site.log("finder"));

    let mut node = Command::new(ros);
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../middleware/ros2/tests/rclpy");
    node.arg("-B")
        .arg(programs.join("stamps.py"))
        .args([
            &site.network,
            DOMAIN,
            "finder/found/newPoint",
            "moved/newPoint",
        ])
        .env("ROS_DOMAIN_ID", DOMAIN)
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
        .env("ROS_LOG_DIR", site.path("ros"));
    site.place(&mut node);
    node.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut node = node.spawn().expect("the node");
    let mut input = node.stdin.take().expect("a pipe");
    let mut lines = BufReader::new(node.stdout.take().expect("a pipe")).lines();
    let mut line = || lines.next().and_then(Result::ok);
    assert_eq!(line().as_deref(), Some("ready"));
    Site::until("messages pass the node", || {
        chain(&site)["complete"].as_u64() >= Some(20)
    });
    let passed = chain(&site);
    assert_eq!(passed["missing"], serde_json::json!([]), "{passed}");
    assert_eq!(passed["hops"][0]["restamped"], 0, "{passed}");
    assert!(passed["times"]["p50_ms"].as_f64() > Some(0.0), "{passed}");

    writeln!(input).expect("to ask");
    assert_eq!(line().as_deref(), Some("anew"));
    Site::until("the node to be found", || {
        let log = site.log("rcdeploy");
        let mut broken = log.lines().filter(|line| line.contains("chain-broken"));
        broken.any(|line| {
            line.contains("grasper receives moved.newPoint with stamps that are younger")
        })
    });
    drop(input);
    assert!(node.wait().expect("its end").success());
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
