//! The page "Coming from RoboComp", step by step: a component in C++ as RoboComp's generator writes it
//! becomes one of ours, which drives the robot of the simulator.

use crate::cpp_worker::{ctest, rcgen, tool, workspace};
use rc_test_site::site::Site;
use rc_test_support::cmake;
use std::fs;
use std::path::Path;

const CDSL: &str = include_str!("bumper/bumper.cdsl");
const HEADER: &str = include_str!("bumper/specificworker.h");
const WORKER: &str = include_str!("bumper/specificworker.cpp");
const CONFIG: &str = include_str!("bumper/config");
const TEST: &str = include_str!("bumper/driving.cpp");

/// The page, which shows the lines of `rcgen new`.
const PAGE: &str = include_str!("../../../docs/from-robocomp.md");

const PARAMETERS: &str = "ComponentParams bumper\n{\n    distance float 500.0 100:3000 unit \"mm\";\n    \
                          speed float 300.0 0:1500 unit \"mm/s\";\n};\n";

/// What takes the place of the texts without a counterpart.
const INSTEAD: [(&str, &str); 5] = [
    (
        "configLoader.get<double>(\"Bumper.Distance\")",
        "params.distance",
    ),
    ("configLoader.get<double>(\"Bumper.Speed\")", "params.speed"),
    ("setPeriod(\"Compute\", 50)", "setPeriod(50)"),
    ("QMutexLocker lock(&mutex);", ""),
    ("QMutex mutex;", ""),
];

const NETWORK: &str = "Deployment NAME\n{\n    middleware iceoryx2;\n    \
                       Component simulator { cdsl \"../simulator/simulator.cdsl\"; };\n    \
                       Component bumper { cdsl \"BUMPER\"; after simulator; };\n    \
                       bind bumper.Laser -> simulator.Laser;\n    \
                       bind bumper.DifferentialRobot -> simulator.DifferentialRobot;\n};\n";

/// The place of the function `name` of the worker, and that of its body with the braces.
fn function(text: &str, name: &str) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
    let found = text.find(&format!("SpecificWorker::{name}("));
    let found = found.unwrap_or_else(|| panic!("{name} is missing in\n{text}"));
    let line = text[..found].rfind('\n').map_or(0, |end| end + 1);
    let begin = found + text[found..].find('{').expect("a body");
    let mut depth = 0_usize;
    let end = text[begin..].char_indices().find_map(|(at, c)| {
        depth += usize::from(c == '{');
        depth -= usize::from(c == '}');
        (depth == 0).then_some(begin + at + 1)
    });
    let end = end.expect("its end");
    (line..end, begin..end)
}

/// Does by its rules what a person does in the steps of the page: copies bodies and members, and changes the
/// lines that `rcgen new` has printed.
fn migrate(component: &Path) {
    let change = |text: &str| {
        let replace = |text: String, (old, new): &(&str, &str)| text.replace(old, new);
        INSTEAD.iter().fold(text.to_owned(), replace)
    };
    let path = component.join("src/specificworker.cpp");
    let mut worker = fs::read_to_string(&path).expect("the new worker");
    for name in [
        "initialize",
        "compute",
        "Bumper_enable",
        "Bumper_disable",
        "Bumper_isEnabled",
        "Bumper_reset",
        "Bumper_getSensorData",
    ] {
        let body = &WORKER[function(WORKER, name).1];
        let place = function(&worker, name).1;
        worker.replace_range(place, body);
    }
    for name in ["nearest", "emergency", "restore"] {
        worker.push('\n');
        worker.push_str(&WORKER[function(WORKER, name).0]);
        worker.push('\n');
    }
    let includes = "\n\n#include <cmath>\n#include <iostream>\n#include <limits>\n";
    let own = "#include \"specificworker.h\"";
    let worker = worker.replace(own, &format!("{own}{includes}"));
    fs::write(&path, change(&worker)).expect("to write");

    let path = component.join("src/specificworker.h");
    let header = fs::read_to_string(&path).expect("the new header");
    let (_, members) = HEADER.split_once("private:\n").expect("members");
    let (members, _) = members.split_once("\n\tsignals:").expect("signals");
    let flag = "\t\tbool startup_check_flag;\n";
    assert!(members.contains(flag));
    let members = members.replace(flag, "");
    let functions = " public:\n  void emergency() override;\n  void restore() override;\n";
    let header = header.replacen(" public:\n", functions, 1);
    let header = header.replace("\n};", &format!("\n\n private:\n{members}\n}};"));
    fs::write(&path, change(&header)).expect("to write");
}

#[test]
fn a_component_of_robocomp_in_cpp_migrates_by_the_steps_of_the_page() {
    let test = "a_component_of_robocomp_in_cpp_migrates_by_the_steps_of_the_page";
    let Some(cmake) = cmake::folder(test) else {
        return;
    };
    crate::built();
    let site = Site::new("migration");
    let old = site.path("OLD");
    fs::create_dir_all(old.join("src")).expect("a folder");
    fs::create_dir_all(old.join("etc")).expect("a folder");
    for (name, text) in [
        ("bumper.cdsl", CDSL),
        ("src/specificworker.h", HEADER),
        ("src/specificworker.cpp", WORKER),
        ("etc/config", CONFIG),
    ] {
        fs::write(old.join(name), text).expect("to write");
    }
    // 1
    let robot = workspace(&site);
    let rcgen = |words: &[&str]| rcgen(&site, &robot, words);
    for name in ["Laser", "DifferentialRobot", "GenericBase", "Bumper"] {
        let file = format!("interfaces/{name}.idsl");
        fs::copy(Site::components().join(&file), robot.join(&file)).expect("a copy");
    }
    // 2
    let said = rcgen(&["new", "bumper", "--from", "../OLD/bumper.cdsl"]);
    let said: String = said.lines().map(|l| format!("   {l}\n")).collect();
    let said = said.replace("../OLD/", "OLD/");
    assert!(PAGE.contains(&said), "the page does not show\n{said}");
    // 3
    let component = robot.join("components/bumper");
    migrate(&component);
    // 4
    fs::write(component.join("bumper.pdsl"), PARAMETERS).expect("to write");
    let cdsl = component.join("bumper.cdsl");
    let text = fs::read_to_string(&cdsl).expect("the description");
    let with = text.replace(
        "language cpp;",
        "language cpp;\n    parameters \"bumper.pdsl\";",
    );
    assert_ne!(text, with);
    fs::write(&cdsl, with).expect("to write");
    rcgen(&["generate", "components/bumper/bumper.cdsl"]);
    // 6
    let network = NETWORK.replace("BUMPER", &cdsl.to_string_lossy());
    site.write_ddsl(&network.replace("NAME", &site.network));
    let mut up = tool(&site, &cmake);
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    let up = site.run({
        up.arg(site.ddsl());
        up
    });
    assert_eq!(up.code, 0, "{up:?}");
    let called = |operation: &str| {
        let call = ["call", &site.network, operation];
        let called = site.rcdeploy(&call, false);
        assert_eq!(called.code, 0, "{called:?}");
        called.stdout
    };
    let pose = || called("simulator.DifferentialRobot.getBasePose");
    let before = pose();
    Site::until("the robot drives", || pose() != before);
    assert!(called("bumper.Bumper.getSensorData").contains("front"));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    // 7, with a test of what the old worker did beside the first test
    fs::write(component.join("tests/driving.cpp"), TEST).expect("to write");
    let lists = component.join("CMakeLists.txt");
    let text = fs::read_to_string(&lists).expect("the build");
    let first = "tests/worker_test.cpp";
    assert!(text.contains(first), "{text}");
    let both = text.replace(first, &format!("{first} tests/driving.cpp"));
    fs::write(&lists, both).expect("to write");
    ctest(&site, &cmake, &component);
}
