//! A lidar in shared memory, in millimetres (right, ahead, up), and a hearer in ROS 2 in metres
//! (ahead, left, up): a process of its own converts between them. rclpy, the package `cyclonedds` and
//! `rosbags` read what it writes.

use crate::python_site::{names_of_others, second_component, workspace};
use rc_record::bag::Info;
use rc_test_site::recordings::count;
use rc_test_site::site::{CommandOutput, Site};
use rc_test_support::python;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const DOMAIN: &str = "62";
const CYCLONE: &str = "cyclonedds==11.0.1";
const READERS: &str = include_str!("../../record/tests/all/packages.txt");
const TOPIC: &str = "hearer_lidar_adaptor/consumer/newPoints";
const COUNT: &str = "5";

pub(crate) const INTERFACE: &str = r#"module Seen
{
    @ros("geometry_msgs/msg/Point32") struct Point
    {
        float x;
        float y;
        float z;
    };

    @ros("geometry_msgs/msg/Polygon") struct Points
    {
        sequence<Point> points;
    };

    interface PointsPub
    {
        publish newPoints(Points seen);
    };
};
"#;

const PROTOTYPE: &str = r#"import "Points.idsl";

axes own :: AXES
algebraic xyz :: Scalar{x, y, z}
units own :: qudt, xyz { x = UNIT, y = UNIT, z = UNIT }

dproto seen :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = xyz
    ddr       = :: IDSL{Seen::Point}
    dr        = { x = x, y = y, z = z }
    units     = own
    axes      = own
}
"#;

pub(crate) const LIDAR: &str = "import \"Points.idsl\";\nimport \"seen.dproto\";\n\nComponent lidar\n{\n    Communications\n    {\n        \
    publishes PointsPub { reliability reliable; depth 10; };\n    };\n    language python;\n    period 50ms;\n};\n";
const HEARER: &str = "import \"Points.idsl\";\nimport \"seen.dproto\";\n\nComponent hearer\n{\n    Communications\n    {\n        \
    subscribesTo PointsPub(ros2) as lidar { reliability reliable; depth 10; };\n    };\n    language python;\n    period 1s;\n};\n";

/// The first point of the nth sample is n times 1, 2 and 3 m to the right, ahead and up.
pub(crate) const OF_LIDAR: &str = r"from lidar import Context, Point, Points, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0

    def compute(self, ctx: Context) -> None:
        self.number += 1
        n = 1000.0 * self.number
        ctx.points_pub.new_points(Points([Point(n, 2.0 * n, 3.0 * n), Point(0.0, -1000.0, 0.0)]))
";
const OF_HEARER: &str = r#"from hearer import Context, Points, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def lidar_new_points(self, ctx: Context, seen: Points) -> None:
        print("seen", *(number for point in seen.points for number in (point.x, point.y, point.z)), flush=True)
"#;

pub(crate) fn prototype(axes: &str, unit: &str) -> String {
    PROTOTYPE.replace("AXES", axes).replace("UNIT", unit)
}

fn place(test: &str) -> Option<Site> {
    let (lidar, hearer) = (
        prototype("right, ahead, up", "mm"),
        prototype("ahead, left, up", "m"),
    );
    let files = [
        ("hearer.cdsl", HEARER),
        ("Points.idsl", INTERFACE),
        ("seen.dproto", &hearer),
        ("src/specific_worker.py", OF_HEARER),
    ];
    let site = workspace("adapted", "hearer", &files, test)?;
    let files = [
        ("lidar.cdsl", LIDAR),
        ("Points.idsl", INTERFACE),
        ("seen.dproto", &lidar),
        ("src/specific_worker.py", OF_LIDAR),
    ];
    second_component(&site, "lidar", &files);
    site.write_ddsl(
        "Deployment patrol\n{\n    middleware iceoryx2;\n    Component lidar { cdsl \"lidar/lidar.cdsl\"; after hearer; };\n    \
         Component hearer { cdsl \"hearer/hearer.cdsl\"; };\n    \
         bind hearer.lidar -> lidar.PointsPub { convert via process; };\n};\n",
    );
    Some(site)
}

/// The lines that a program prints, which must be points of the lidar in metres. Returns how many.
pub(crate) fn check(who: &str, text: &str) -> usize {
    let mut count = 0;
    let mut last = 0.0;
    for line in text.lines() {
        let numbers: Vec<f64> = line
            .split_whitespace()
            .map(|number| number.parse().unwrap_or_else(|_| panic!("{who}: {line}")))
            .collect();
        let n = numbers[2] / 3.0;
        assert!(n >= 1.0 && n.fract() == 0.0 && n > last, "{who}: {line}");
        assert_eq!(numbers, [2.0 * n, -n, 3.0 * n, -1.0, 0.0, 0.0], "{who}");
        last = n;
        count += 1;
    }
    count
}

/// The variables of an environment of ROS 2.
fn ros(domain: &str) -> [(&str, &str); 2] {
    [("ROS_DOMAIN_ID", domain), ("ROS_LOCALHOST_ONLY", "1")]
}

/// `rcdeploy up --build` in an environment of ROS 2.
pub(crate) fn up(site: &Site, domain: &str) -> CommandOutput {
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).envs(ros(domain));
    up.env("CARGO_NET_OFFLINE", "true");
    for name in ["VIRTUAL_ENV", "PYTHONPATH", "DISPLAY"] {
        up.env_remove(name);
    }
    site.run(up)
}

/// A program in Python, in an environment of ROS 2.
pub(crate) fn program(site: &Site, python: &Path, domain: &str, script: PathBuf) -> Command {
    let mut command = Command::new(python);
    command.arg("-B").arg(script).envs(ros(domain));
    command.env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
    let loopback = "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>";
    command.env("CYCLONEDDS_URI", loopback);
    command.env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");
    command.env("ROS_LOG_DIR", site.path("ros"));
    site.place(&mut command);
    command
}

/// The output of a program in Python.
pub(crate) fn output(
    site: &Site,
    python: &Path,
    domain: &str,
    script: PathBuf,
    args: &[&str],
) -> String {
    let mut command = program(site, python, domain, script);
    let ran = command.args(args).output().expect("the interpreter");
    assert!(ran.status.success(), "{ran:?}");
    String::from_utf8(ran.stdout).expect("a text")
}

#[test]
fn others_read_what_an_adaptor_writes() {
    let test = "others_read_what_an_adaptor_writes";
    let _names = names_of_others();
    let Some(site) = place(test) else { return };
    let up = up(&site, DOMAIN);
    assert_eq!(up.code, 0, "{up:?}");
    Site::until("5 samples", || site.count_in_log("hearer", "seen ") >= 5);

    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../middleware/ros2/tests");
    let node = [site.network.as_str(), TOPIC, COUNT];
    if let Some(ros) = python::ros(test) {
        let said = output(&site, ros, DOMAIN, tests.join("rclpy/points.py"), &node);
        assert_eq!(check("rclpy", &said), 5);
    }
    if let Some(cyclone) = python::interpreter(CYCLONE, test) {
        let args = [node[0], DOMAIN, node[1], node[2]];
        let script = tests.join("stranger/points.py");
        let said = output(&site, cyclone, DOMAIN, script, &args);
        assert_eq!(check("cyclonedds", &said), 5);
    }
    let file = site.path("points.mcap").display().to_string();
    let mut record = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    let topic = "hearer_lidar_adaptor.consumer.newPoints";
    record
        .args(["record", &site.network, topic, "-o", &file])
        .envs(ros(DOMAIN))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let record = record.spawn().expect("the recorder");
    Site::until("the recording has begun", || Path::new(&file).exists());
    Site::until("5 samples are recorded", || {
        let info = Info::read(Path::new(&file)).unwrap_or_default();
        count(&info, "newPoints") >= 5
    });
    let slot = site.ask("hearer_lidar_adaptor", "status")["slots"][0].clone();
    assert!(slot["converted"]["messages"].as_u64() >= Some(15), "{slot}");
    assert_eq!(slot["converted"]["bad_values"], Value::from(0), "{slot}");
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    let ended = record.wait_with_output().expect("the end of the recorder");
    assert!(ended.status.success(), "{ended:?}");
    site.assert_nothing_left();
    let log = site.log("hearer");
    let seen: Vec<&str> = log
        .lines()
        .filter_map(|line| line.strip_prefix("seen "))
        .collect();
    check("hearer", &seen.join("\n"));
    if let Some(readers) = python::packages("recordings", READERS, test) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds/points.py");
        let topic = format!("/{}/{TOPIC}", site.network);
        let said = output(&site, readers, DOMAIN, script, &[&file, &topic]);
        assert!(check("rosbags", &said) >= 5, "{said}");
    }
}
