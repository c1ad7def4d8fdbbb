//! Programs outside of a network, which a `.cdsl` describes: a node of rclpy sends points in
//! centimetres, and others of rclpy and of the package `cyclonedds` hear those of a lidar in metres.

use crate::adapted::{INTERFACE, LIDAR, OF_LIDAR, check, output, prototype};
use crate::python_site::{second_component, workspace};
use rc_test_site::site::Site;
use rc_test_support::python;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};

const DOMAIN: &str = "64";
const CYCLONE: &str = "cyclonedds==11.0.1";
const COUNT: &str = "5";

const HEARER: &str = "import \"Points.idsl\";\nimport \"seen.dproto\";\n\nComponent outer_hearer\n{\n    Communications\n    {\n        \
    subscribesTo PointsPub(ros2) as scanner { reliability reliable; depth 10; },\n            \
    PointsPub as second { reliability reliable; depth 10; };\n    };\n    language python;\n    period 1s;\n};\n";

const OF_HEARER: &str = r#"from outer_hearer import Context, Points, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def scanner_new_points(self, ctx: Context, seen: Points) -> None:
        self.say("scanner", seen)

    def second_new_points(self, ctx: Context, seen: Points) -> None:
        self.say("second", seen)

    def say(self, slot: str, seen: Points) -> None:
        print(slot, *(number for point in seen.points for number in (point.x, point.y, point.z)), flush=True)
"#;

/// The description of a program outside.
fn outside(site: &Site, name: &str, role: &str, unit: &str) {
    let folder = site.path("networks").join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    let cdsl = format!(
        "import \"Points.idsl\";\nimport \"seen.dproto\";\n\nComponent {name}\n{{\n    Communications\n    {{\n        \
         {role} PointsPub(ros2) {{ reliability reliable; depth 10; }};\n    }};\n    language rust;\n}};\n"
    );
    let prototype = prototype("ahead, left, up", unit);
    for (file, text) in [
        (format!("{name}.cdsl"), cdsl.as_str()),
        ("Points.idsl".to_owned(), INTERFACE),
        ("seen.dproto".to_owned(), &prototype),
    ] {
        std::fs::write(folder.join(file), text).expect("to write");
    }
}

fn place(test: &str) -> Option<Site> {
    let meaning = prototype("ahead, left, up", "m");
    let files = [
        ("outer_hearer.cdsl", HEARER),
        ("Points.idsl", INTERFACE),
        ("seen.dproto", &meaning),
        ("src/specific_worker.py", OF_HEARER),
    ];
    let site = workspace("strangers", "outer_hearer", &files, test)?;
    let meaning = prototype("right, ahead, up", "mm");
    // Programs of one name would be one in the target folder.
    let [lidar, worker] = [LIDAR, OF_LIDAR].map(|text| text.replace("lidar", "outer_lidar"));
    let files = [
        ("outer_lidar.cdsl", lidar.as_str()),
        ("Points.idsl", INTERFACE),
        ("seen.dproto", &meaning),
        ("src/specific_worker.py", &worker),
    ];
    second_component(&site, "outer_lidar", &files);
    outside(&site, "scanner", "publishes", "cm");
    outside(&site, "viewer", "subscribesTo", "m");
    let network = &site.network;
    site.write_ddsl(&format!(
        "Deployment patrol\n{{\n    middleware iceoryx2;\n    Component outer_lidar {{ cdsl \"outer_lidar/outer_lidar.cdsl\"; }};\n    \
         Component outer_hearer {{ cdsl \"outer_hearer/outer_hearer.cdsl\"; }};\n    \
         external outer_lidar.PointsPub at \"{network}/seen\" {{ cdsl \"viewer/viewer.cdsl\"; convert; }};\n    \
         external outer_hearer.scanner at \"{network}/scan\" {{ cdsl \"scanner/scanner.cdsl\"; convert; }};\n    \
         external outer_hearer.second at \"{network}/scan\" {{ cdsl \"scanner/scanner.cdsl\"; convert via process; }};\n}};\n"
    ));
    Some(site)
}

/// A node of rclpy, until its input ends.
fn speaker(site: &Site, ros: &Path) -> Child {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../middleware/ros2/tests/rclpy");
    let mut command = crate::adapted::program(site, ros, DOMAIN, script.join("say_points.py"));
    command.args([&site.network, "scan/newPoints"]);
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("the interpreter");
    let mut said = String::new();
    let out = child.stdout.as_mut().expect("an output");
    BufReader::new(out).read_line(&mut said).expect("a line");
    assert_eq!(said, "ready\n");
    child
}

#[test]
fn programs_outside_hear_and_say_converted_points() {
    let test = "programs_outside_hear_and_say_converted_points";
    let Some(ros) = python::ros(test) else { return };
    let Some(site) = place(test) else { return };
    let up = crate::adapted::up(&site, DOMAIN);
    assert_eq!(up.code, 0, "{up:?}");
    let mut speaker = speaker(&site, ros);
    for slot in ["scanner ", "second "] {
        Site::until("5 samples", || site.count_in_log("outer_hearer", slot) >= 5);
        let log = site.log("outer_hearer");
        let seen: Vec<&str> = log
            .lines()
            .filter_map(|line| line.strip_prefix(slot))
            .collect();
        check(slot, &seen.join("\n"));
    }
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../middleware/ros2/tests");
    let node = [site.network.as_str(), "seen/newPoints", COUNT];
    let said = output(&site, ros, DOMAIN, tests.join("rclpy/points.py"), &node);
    assert_eq!(check("rclpy", &said), 5);
    if let Some(cyclone) = python::interpreter(CYCLONE, test) {
        let args = [node[0], DOMAIN, node[1], node[2]];
        let script = tests.join("stranger/points.py");
        let said = output(&site, cyclone, DOMAIN, script, &args);
        assert_eq!(check("cyclonedds", &said), 5);
    }
    for (component, slot) in [
        ("outer_lidar_PointsPub_adaptor", 0),
        ("outer_hearer_second_adaptor", 0),
        ("outer_hearer", 0),
    ] {
        let slot = site.ask(component, "status")["slots"][slot].clone();
        assert!(slot["converted"]["messages"].as_u64() >= Some(5), "{slot}");
        assert_eq!(slot["converted"]["bad_values"], 0, "{slot}");
    }
    // Ends without a peer are reported, and nothing else.
    drop(speaker.stdin.take());
    assert!(speaker.wait().expect("the end").success());
    let gone = |name: &str| {
        let events = site.events(name).into_iter();
        events.filter(|(code, _)| code == "peer-vanished").count()
    };
    Site::until("an event", || {
        gone("outer_hearer") == 1 && gone("outer_hearer_second_adaptor") == 1
    });
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
