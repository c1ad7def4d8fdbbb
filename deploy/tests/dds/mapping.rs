//! Three programs, three representations: a lidar in millimetres (right, ahead, up) over shared
//! memory, a mapper in metres (ahead, left, up), which sends them to ROS 2, and a node of rclpy. All
//! of them see the points that `SciPy` computes from the recording.

use rc_test_site::site::{CommandOutput, Site};
use rc_test_support::python;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

const MAPPING: &str = include_str!("../../../components/networks/mapping.ddsl");
const NUMPY: &str = "numpy==2.3.4";
const SCIPY: &str = "scipy==1.15.3";
const DOMAIN: &str = "36";
/// How many clouds the node of rclpy prints.
const CLOUDS: usize = 5;

/// `rcdeploy` with components in this environment of Python.
fn rcdeploy(site: &Site, environment: &Path, args: &[&str]) -> CommandOutput {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(args).args(["--profile", "dev"]);
    command.arg(site.ddsl());
    command.envs([("ROS_DOMAIN_ID", DOMAIN), ("ROS_LOCALHOST_ONLY", "1")]);
    command.env("CARGO_NET_OFFLINE", "true");
    command.env("VIRTUAL_ENV", environment);
    site.run(command)
}

#[test]
fn a_lidar_a_mapper_and_a_node_of_rclpy_see_the_same_points() {
    let test = "a_lidar_a_mapper_and_a_node_of_rclpy_see_the_same_points";
    let (Some(workers), Some(ros), Some(scipy)) = (
        python::packages("python-numpy", NUMPY, test),
        python::ros(test),
        python::interpreter(SCIPY, test),
    ) else {
        return;
    };
    crate::built();
    let environment = workers.ancestors().nth(2).expect("an environment");
    let site = Site::new("mapping");
    let network = |block: &str| {
        let text = MAPPING.replace("Deployment mapping", "Deployment patrol");
        let word = "\n    {\n        convert;\n    }";
        assert!(text.contains(word), "{text}");
        text.replace(word, block)
    };

    // Without the word, the network is refused, and the help says what the word does.
    site.write_ddsl(&network(""));
    let refused = rcdeploy(&site, environment, &["check"]);
    assert_ne!(refused.code, 0, "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    for part in [
        "error[unit-mismatch]",
        "expects `RoboCompLidarPub::Point` as Position (cartesian, m, ahead-left-up)",
        "sends it as Position (cartesian, mm, right-ahead-up)",
        "{ convert; };` converts (units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up",
        "float32, in the range of float32, bounded: 6.0e-8 of the value",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }

    site.write_ddsl(&network(" { convert; }"));
    let up = rcdeploy(&site, environment, &["up", "--build", "--detach"]);
    assert_eq!(up.code, 0, "{up:?}");
    let mut node = Command::new(ros);
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../middleware/ros2/tests/rclpy");
    node.arg("-B")
        .arg(programs.join("clouds.py"))
        .args([&site.network, "mapper/cloud/newCloud", &CLOUDS.to_string()])
        .env("ROS_DOMAIN_ID", DOMAIN)
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
        .env("ROS_LOG_DIR", site.path("ros"))
        .stdout(Stdio::piped());
    site.place(&mut node);
    // The recording begins before the node is there and ends after it.
    let file = site.path("mapping.mcap").display().to_string();
    let mut record = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    record
        .args(["record", &site.network, "newScan", "newCloud", "-o", &file])
        .envs([("ROS_DOMAIN_ID", DOMAIN), ("ROS_LOCALHOST_ONLY", "1")])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let record = record.spawn().expect("the recorder");
    Site::until("the recording has begun", || Path::new(&file).exists());
    let mut node = node.spawn().expect("the node");
    let lines = BufReader::new(node.stdout.take().expect("a pipe")).lines();
    let lines: Vec<String> = lines.map_while(Result::ok).collect();
    assert!(node.wait().expect("its end").success(), "{lines:?}");
    let heard: Vec<&String> = lines.iter().filter(|line| line.len() > 3).collect();
    assert_eq!(heard.len(), CLOUDS);

    let slot = site.ask("mapper", "status")["slots"][0].clone();
    assert!(slot["converted"]["messages"].as_u64() >= Some(5), "{slot}");
    assert_eq!(slot["converted"]["bad_values"], 0, "{slot}");
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    let ended = record.wait_with_output().expect("the end of the recorder");
    assert!(ended.status.success(), "{ended:?}");
    site.assert_nothing_left();

    let list = |topic: &str, name: &str| {
        let ran = site.rcdeploy(
            &["bag", "list", &file, "--topics", topic, "--format", "json"],
            false,
        );
        assert_eq!(ran.code, 0, "{ran:?}");
        site.write(name, &ran.stdout).display().to_string()
    };
    let files = [
        list("newScan", "scans.json"),
        list("newCloud", "clouds.json"),
        {
            let text: Vec<&str> = heard.iter().map(|line| line.as_str()).collect();
            site.write("heard.txt", &text.join("\n"))
                .display()
                .to_string()
        },
    ];
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/dds/mapping.py");
    let output = Command::new(scipy)
        .args(["-B", script])
        .args(&files)
        .output()
        .expect("the interpreter runs");
    assert!(output.status.success(), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        found["heard"],
        serde_json::json!([CLOUDS, CLOUDS]),
        "{found}"
    );
    let recorded = |at: usize| found["recorded"][at].as_u64();
    assert!(recorded(1) >= Some(5), "{found}");
    assert_eq!(recorded(0), recorded(1), "{found}");
}
