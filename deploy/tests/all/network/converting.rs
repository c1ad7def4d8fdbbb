//! A network whose monitor wants metres and degrees, and whose simulator sends millimetres and
//! radians.

use super::iceoryx2_python::{PACKAGE, external};
use object::{Object as _, ObjectSymbol as _};
use rc_codegen::{FileLoader, Project};
use rc_diagnostics::SourceMap;
use rc_test_site::site::Site;
use rc_test_support::python;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The hash of the model of a component.
fn model(cdsl: &Path) -> String {
    let mut sources = SourceMap::new();
    let (project, found) =
        Project::load(cdsl, &mut sources, &FileLoader::new(&[])).expect("a file");
    let project = project.unwrap_or_else(|| panic!("{found:?}"));
    format!("{:016x}", project.hash)
}

/// Replaces a text in a file by one of the same length.
fn patch(file: &Path, from: &str, to: &str) {
    let mut bytes = fs::read(file).expect("a program");
    let places: Vec<usize> = memchr::memmem::find_iter(&bytes, from).collect();
    assert!(!places.is_empty(), "{from} is not in {}", file.display());
    for at in places {
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
    }
    fs::write(file, bytes).expect("a program");
}

/// The monitor with poses in m and deg. Its program is the one for mm and rad: units are not part
/// of the code, only of the hash in its note.
fn metric_monitor(site: &Site) {
    let own = site.path("networks/metric");
    fs::create_dir_all(&own).expect("a folder");
    let components = Site::components();
    let copy = |from: &str, change: &dyn Fn(String) -> String| {
        let text = fs::read_to_string(components.join(from)).expect("a file");
        let name = Path::new(from).file_name().expect("a name");
        fs::write(own.join(name), change(text)).expect("to write");
    };
    copy("interfaces/FullPoseEstimation.idsl", &|text| {
        text.replace("\"mm\"", "\"m\"")
            .replace("\"rad\"", "\"deg\"")
    });
    copy("interfaces/FullPoseEstimationPub.idsl", &|text| text);
    copy("pose_monitor/pose_monitor.cdsl", &|text| {
        without_prototype(&text)
    });
    copy("pose_monitor/pose_monitor.pdsl", &|text| text);
    let program = own.join("monitor");
    fs::copy(Site::executable("pose_monitor"), &program).expect("to copy");
    patch(
        &program,
        &model(&components.join("pose_monitor/pose_monitor.cdsl")),
        &model(&own.join("pose_monitor.cdsl")),
    );
}

fn network(site: &Site, block: &str) -> String {
    let components = Site::components().display().to_string();
    let simulator = Site::executable("simulator").display().to_string();
    format!(
        "Deployment {}\n{{\n\
         Component simulator {{ cdsl \"{components}/simulator/simulator.cdsl\"; executable \"{simulator}\"; }};\n\
         Component monitor {{ cdsl \"metric/pose_monitor.cdsl\"; executable \"metric/monitor\"; \
         parameters {{ svg \"\"; trace \"{}\"; map \"{components}/maps/house.map\"; }}; after simulator; }};\n\
         bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub{block};\n}};\n",
        site.network,
        site.path("trace.txt").display()
    )
}

#[test]
fn a_monitor_in_metres_follows_a_simulator_in_millimetres() {
    let site = Site::new("metric");
    metric_monitor(&site);
    site.write("patrol.ddsl", &network(&site, ""));
    let refused = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_ne!(refused.code, 0, "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    let help = "help: they mean the same quantity (length; mm ×1/1000 = m): `bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub { convert; };` converts (1 operation a number)";
    assert!(said.contains(help), "{said}");

    site.write("patrol.ddsl", &network(&site, " { convert; }"));
    let plan = site.rcdeploy(&["plan", "--format", "json", "--profile", "dev"], true);
    let plan: Value = serde_json::from_str(&plan.stdout).expect("JSON");
    let arguments = plan["components"][1]["arguments"].to_string();
    let passed = "\"--convert\",\"FullPoseEstimationPub=0i:s3f{1/1000}3f{180p-1}\"";
    assert!(arguments.contains(passed), "{arguments}");
    let converts = plan["connections"][0]["converts"].to_string();
    let member =
        "RoboCompFullPoseEstimation::FullPoseEuler.rz rad ×180/π = deg, 2 operations a number";
    assert!(converts.contains(member), "{converts}");
    let graph = site.rcdeploy(&["graph", "--format", "dot", "--profile", "dev"], true);
    assert!(graph.stdout.contains("converts RoboComp"), "{graph:?}");

    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let slot = || site.ask("monitor", "status")["slots"][0].clone();
    Site::until("a converted pose", || {
        slot()["converted"]["messages"].as_u64() > Some(0)
    });
    assert_eq!(slot()["converted"]["bad_values"], 0);
    let counted = "FullPoseEstimationPub converted ";
    Site::until("the count of conversions", || {
        let status = site.rcdeploy(&["status", &site.network], false);
        status.stdout.contains(counted)
    });
    // A tool looks at the publisher, and sees its units. The robot stands: nobody drives it.
    let network = site.network.clone();
    let sent = site.rcdeploy(
        &[
            "echo",
            &network,
            "newFullPose",
            "--once",
            "--format",
            "json",
        ],
        false,
    );
    let sent: Value = serde_json::from_str(&sent.stdout).expect("JSON");
    let sent = |name: &str| {
        let pose = sent.pointer(&format!("/value/pose/{name}"));
        pose.and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{name} in {sent}"))
    };
    // The monitor writes its trace when it ends.
    let down = site.rcdeploy(&["down", &network], false);
    assert_eq!(down.code, 0, "{down:?}");
    let trace = fs::read_to_string(site.path("trace.txt")).expect("a trace");
    let last = trace.lines().last().expect("a pose");
    let received: Vec<f64> = last
        .split(',')
        .filter_map(|number| number.parse().ok())
        .collect();
    for (number, expected) in [
        (1, sent("x") / 1e3),
        (2, sent("y") / 1e3),
        (3, sent("rz").to_degrees()),
    ] {
        let found = received[number];
        assert!(
            (found - expected).abs() < 1e-4,
            "{found} and {expected}: {last}"
        );
    }
}

/// The meaning of a full pose with these axes.
fn pose_prototype(axes: &str) -> String {
    format!(
        "import \"FullPoseEstimation.idsl\";\n\
         axes own :: {axes}\n\
         algebraic named :: Scalar{{x, y, z}}\n\
         dproto place :: geometry {{ semantic = Position coord = cartesian algebraic = named\n\
             ddr = :: IDSL{{RoboCompFullPoseEstimation::FullPoseEuler}} dr = {{ x = x, y = y, z = z }}\n\
             axes = own frames = {{ of = robot, with_respect_to = house }} }}\n"
    )
}

/// A component without what its poses mean.
fn without_prototype(cdsl: &str) -> String {
    cdsl.replace("import \"full_pose.dproto\";\n", "")
}

/// The folder of a component that imports a prototype. Its program is the one without: what values
/// mean is not a part of the code.
pub(super) fn with_prototype(site: &Site, component: &str, axes: &str) {
    let own = site.path(&format!("networks/{component}"));
    fs::create_dir_all(&own).expect("a folder");
    let components = Site::components();
    for folder in [components.join("interfaces"), components.join(component)] {
        for entry in fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path();
            let ending = path.extension().and_then(|ending| ending.to_str());
            if matches!(ending, Some("idsl" | "pdsl" | "cdsl" | "smdsl")) {
                fs::copy(&path, own.join(entry.file_name())).expect("to copy");
            }
        }
    }
    let cdsl = own.join(format!("{component}.cdsl"));
    let text = fs::read_to_string(&cdsl).expect("a component");
    let text = without_prototype(&text);
    fs::write(&cdsl, format!("import \"place.dproto\";\n{text}")).expect("to write");
    fs::write(own.join("place.dproto"), pose_prototype(axes)).expect("to write");
}

#[test]
fn a_monitor_with_other_axes_follows_a_simulator() {
    let site = Site::new("axes");
    with_prototype(&site, "simulator", "right, ahead, up");
    with_prototype(&site, "pose_monitor", "ahead, left, up");
    let components = Site::components().display().to_string();
    let network = |block: &str| {
        format!(
            "Deployment {}\n{{\n\
             Component simulator {{ cdsl \"simulator/simulator.cdsl\"; executable \"{}\"; parameters {{ map \"{components}/maps/house.map\"; }}; }};\n\
             Component monitor {{ cdsl \"pose_monitor/pose_monitor.cdsl\"; executable \"{}\"; \
             parameters {{ svg \"\"; trace \"{}\"; map \"{components}/maps/house.map\"; }}; after simulator; }};\n\
             bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub{block};\n}};\n",
            site.network,
            Site::executable("simulator").display(),
            Site::executable("pose_monitor").display(),
            site.path("trace.txt").display()
        )
    };
    site.write("patrol.ddsl", &network(""));
    let refused = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_ne!(refused.code, 0, "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    assert!(said.contains("axes-mismatch"), "{said}");
    let help = "`bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub { convert; };` converts (axes right-ahead-up → ahead-left-up; 1 operation a value)";
    assert!(said.contains(help), "{said}");

    site.write("patrol.ddsl", &network(" { convert; }"));
    let plan = site.rcdeploy(&["plan", "--format", "json", "--profile", "dev"], true);
    let plan: Value = serde_json::from_str(&plan.stdout).expect("JSON");
    let arguments = plan["components"][1]["arguments"].to_string();
    let passed = "\"--convert\",\"FullPoseEstimationPub=0i:{s3f!9fi|n@0;=@1&$0&@2}\"";
    assert!(arguments.contains(passed), "{arguments}");
    let graph = site.rcdeploy(&["graph", "--format", "dot", "--profile", "dev"], true);
    assert!(graph.stdout.contains("right-ahead-up"), "{graph:?}");

    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let slot = || site.ask("monitor", "status")["slots"][0].clone();
    Site::until("a converted pose", || {
        slot()["converted"]["messages"].as_u64() > Some(0)
    });
    assert_eq!(slot()["converted"]["bad_values"], 0);
    // Others see what the simulator sends. The robot stands: nobody drives it.
    let name = site.network.clone();
    let asked = ["echo", &name, "newFullPose", "--once", "--format", "json"];
    let sent = site.rcdeploy(&asked, false);
    let sent: Value = serde_json::from_str(&sent.stdout).expect("JSON");
    let sent = |name: &str| {
        let value = sent.pointer(&format!("/value/pose/{name}"));
        value
            .and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{name} in {sent}"))
    };
    // A tool converts by the same plan.
    let both = pose_prototype("right, ahead, up")
        + "axes ros :: ahead, left, up\n"
        + pose_prototype("ahead, left, up")
            .split_once("dproto")
            .map_or("", |(_, rest)| rest)
            .replacen(" place ", "dproto seen ", 1)
            .replace("axes = own", "axes = ros")
            .as_str();
    site.write("both.dproto", &both);
    let file = site.path("networks/both.dproto").display().to_string();
    let mut asked = asked.to_vec();
    asked.extend(["--as", "seen", "--prototypes", &file]);
    let seen = site.rcdeploy(&asked, false);
    let seen: Value = serde_json::from_str(&seen.stdout).unwrap_or_else(|_| panic!("{seen:?}"));
    let seen = ["x", "y", "rz"].map(|name| seen["value"]["pose"][name].as_f64());
    assert_eq!(seen, [Some(sent("y")), Some(-sent("x")), Some(sent("rz"))]);
    let test = "a_monitor_with_other_axes_follows_a_simulator";
    if let Some(python) = python::interpreter(PACKAGE, test) {
        let address = slot()["address"].as_str().expect("an address").to_owned();
        let heard = external(&site, python, "hear.py", &["1", &address]);
        let pose = heard.stdout.lines().nth(1).expect("a pose");
        let pose: Value = serde_json::from_str(pose).expect("JSON");
        let heard = [0, 1].map(|at| pose[3][at].as_f64());
        assert_eq!(heard, [Some(sent("x")), Some(sent("y"))], "{pose}");
    }
    let down = site.rcdeploy(&["down", &name], false);
    assert_eq!(down.code, 0, "{down:?}");
    let trace = fs::read_to_string(site.path("trace.txt")).expect("a trace");
    let last = trace.lines().last().expect("a pose");
    let received: Vec<f64> = last
        .split(',')
        .filter_map(|number| number.parse().ok())
        .collect();
    assert!(sent("x").abs() > 1.0 && sent("y").abs() > 1.0);
    for (number, expected) in [(1, sent("y")), (2, -sent("x")), (3, sent("rz"))] {
        let found = received[number];
        assert!(
            (found - expected).abs() < 1e-2,
            "{found} and {expected}: {last}"
        );
    }
}

/// A simulator in shared memory, and a listener in ROS 2 with other axes.
fn bridged(site: &Site) -> String {
    with_prototype(site, "simulator", "right, ahead, up");
    with_prototype(site, "pose_listener", "ahead, left, up");
    format!(
        "Deployment {}\n{{\n\
         Component simulator {{ cdsl \"simulator/simulator.cdsl\"; executable \"{}\"; middleware iceoryx2; parameters {{ map \"{}/maps/house.map\"; }}; }};\n\
         Component listener {{ cdsl \"pose_listener/pose_listener.cdsl\"; executable \"{}\"; restart on_failure; }};\n\
         bind listener.ros -> simulator.FullPoseEstimationPub {{ convert via process; }};\n}};\n",
        site.network,
        Site::executable("simulator").display(),
        Site::components().display(),
        Site::executable("pose_listener").display(),
    )
}

#[test]
fn an_adaptor_brings_converted_poses_to_ros() {
    let site = Site::new("adapted");
    Site::executable("rcforward");
    let text = bridged(&site);
    site.write("patrol.ddsl", &text.replace("via process", ""));
    let refused = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_ne!(refused.code, 0, "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    let help = "give both ends one middleware, or let a process stand between them: `bind listener.ros -> simulator.FullPoseEstimationPub { convert via process; };`";
    assert!(said.contains(help), "{said}");

    site.write("patrol.ddsl", &text);
    let plan = site.rcdeploy(&["plan", "--format", "json", "--profile", "dev"], true);
    let plan: Value = serde_json::from_str(&plan.stdout).unwrap_or_else(|_| panic!("{plan:?}"));
    let adaptor = &plan["components"][2];
    assert_eq!(adaptor["name"], "listener_ros_adaptor");
    let passed = "\"--convert\",\"provider=0i:{s3f!9fi|n@0;=@1&$0&@2}\"";
    let arguments = adaptor["arguments"].to_string();
    assert!(arguments.contains(passed), "{arguments}");
    let graph = site.rcdeploy(&["graph", "--format", "dot", "--profile", "dev"], true);
    assert!(graph.stdout.contains("listener_ros_adaptor"), "{graph:?}");

    let up = |site: &Site| {
        let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
        command.args(["up", "--detach", "--profile", "dev"]);
        command.arg(site.ddsl());
        command.envs([("ROS_DOMAIN_ID", "61"), ("ROS_LOCALHOST_ONLY", "1")]);
        site.run(command)
    };
    let up = up(&site);
    assert_eq!(up.code, 0, "{up:?}");
    let slot = || site.ask("listener_ros_adaptor", "status")["slots"][0].clone();
    Site::until("a converted pose", || {
        slot()["converted"]["messages"].as_u64() > Some(0)
    });
    let counted = "provider converted ";
    Site::until("the count of conversions", || {
        let status = site.rcdeploy(&["status", &site.network], false);
        status.stdout.contains(counted)
    });
    let echo = |topic: &str| {
        let topic = format!("{topic}.newFullPose");
        let asked = ["echo", &site.network, &topic, "--once", "--format", "json"];
        let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
        command.args(asked);
        command.envs([("ROS_DOMAIN_ID", "61"), ("ROS_LOCALHOST_ONLY", "1")]);
        let sent = site.run(command);
        let sent: Value = serde_json::from_str(&sent.stdout).unwrap_or_else(|_| panic!("{sent:?}"));
        ["x", "y", "rz"].map(|name| {
            let number = sent.pointer(&format!("/value/pose/{name}"));
            let number = number.and_then(Value::as_f64);
            number.unwrap_or_else(|| panic!("{name} in {sent}"))
        })
    };
    // The robot stands: nobody drives it.
    let [x, y, rz] = echo("simulator.FullPoseEstimationPub");
    assert!(x.abs() > 1.0 && y.abs() > 1.0, "{x} {y}");
    assert_eq!(echo("listener_ros_adaptor.consumer"), [y, -x, rz]);
    site.await_in_log(
        "listener",
        &format!("heard in ROS 2: x={y:.0} y={:.0} ", -x),
    );

    // An adaptor that is killed starts again, as its consumer would.
    let pid = site.ask("listener_ros_adaptor", "status")["pid"].as_i64();
    let pid = pid.and_then(|pid| Pid::from_raw(i32::try_from(pid).ok()?));
    kill_process(pid.expect("a process"), Signal::KILL).expect("to kill");
    Site::until("the adaptor converts again", || {
        let status = site.rcdeploy(&["status", &site.network, "--format", "json"], false);
        let status: Value = serde_json::from_str(&status.stdout).expect("JSON");
        let components = status["components"].as_array().expect("a list");
        let mut components = components.iter();
        components.any(|own| {
            own["restarts"] == 1 && own["converted"]["provider"]["messages"].as_u64() > Some(0)
        })
    });
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

#[test]
fn a_missing_program_of_adaptors_is_reported() {
    let site = Site::new("unadapted");
    let text = bridged(&site);
    site.write("patrol.ddsl", &text);
    let own = site.path("rcdeploy");
    fs::hard_link(env!("CARGO_BIN_EXE_rcdeploy"), &own)
        .or_else(|_| fs::copy(env!("CARGO_BIN_EXE_rcdeploy"), &own).map(drop))
        .expect("a copy of rcdeploy");
    let mut command = site.command(&own);
    command.args(["up", "--profile", "dev"]).arg(site.ddsl());
    let refused = site.run(command);
    assert_ne!(refused.code, 0, "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    for part in [
        "error[missing-executable]: the program of adaptors and proxies, ",
        "patrol.ddsl:5:64",
        "`cargo xtask install --with rcforward`",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

/// The bytes of the functions of a program that convert.
fn conversions_in(program: &Path) -> u64 {
    let bytes = fs::read(program).expect("a program");
    let file = object::File::parse(&*bytes).expect("an executable");
    let own = file.symbols().filter(|symbol| {
        symbol
            .name()
            .is_ok_and(|name| name.contains("rc_conversion"))
    });
    own.map(|symbol| symbol.size()).sum()
}

/// The conversions of a component are known when it runs, but not whether it gets values.
#[test]
fn a_component_that_gets_no_values_links_no_conversion() {
    assert_eq!(conversions_in(&Site::executable("simulator")), 0);
    assert!(conversions_in(&Site::executable("pose_monitor")) > 10_000);
}
