//! A component that an earlier `rcgen` generated runs beside components of today: its generated code
//! (`deploy/tests/frozen`) is compiled with the runtime as it is now.

use rc_test_site::site::Site;
use std::fs;

/// Its description, of which the program has the hash.
const DESCRIPTION: &str = r#"// Generated once and kept: a later framework has to run it.
import "BatteryStatus.idsl";
import "DifferentialRobot.idsl";
import "FullPoseEstimationPub.idsl";

Component steady
{
    Communications
    {
        implements BatteryStatus;
        requires DifferentialRobot;
        subscribesTo FullPoseEstimationPub;
        publishes FullPoseEstimationPub as seen;
    };
    language rust;
    parameters "steady.pdsl";
    period 100ms;
};
"#;

const PARAMETERS: &str = r#"ComponentParams steady
{
    /// How fast it drives.
    speed float 100.0 0:500 T unit "mm/s";
};
"#;

const NETWORK: &str = r#"Deployment frozen
{
    middleware iceoryx2;
    Component simulator { cdsl "COMPONENTS/simulator/simulator.cdsl"; };
    Component steady { cdsl "../steady/steady.cdsl"; executable "PROGRAM"; after simulator; };
    bind steady.DifferentialRobot -> simulator.DifferentialRobot;
    bind steady.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;
};
"#;

#[test]
fn a_component_of_an_earlier_version_runs_with_this_runtime() {
    let site = Site::new("frozen");
    let program = Site::executable("steady");
    assert!(
        program.exists(),
        "{} is missing: run the tests by `cargo xtask test`",
        program.display()
    );
    let text = NETWORK
        .replace("Deployment frozen", &format!("Deployment {}", site.network))
        .replace("COMPONENTS", &Site::components().to_string_lossy())
        .replace("PROGRAM", &program.to_string_lossy());
    for (name, text) in [
        ("steady/steady.cdsl", DESCRIPTION),
        ("steady/steady.pdsl", PARAMETERS),
        ("networks/patrol.ddsl", &text),
    ] {
        let path = site.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }
    let file = site.ddsl().display().to_string();
    let rcdeploy = |args: &[&str]| {
        let run = site.rcdeploy(args, false);
        assert_eq!(run.code, 0, "{args:?} {run:?}");
        run.stdout
    };
    // Its description has the hash that its program has.
    rcdeploy(&["check", "--profile", "dev", &file]);
    rcdeploy(&["up", "--detach", "--profile", "dev", &file]);
    // Commands and queries that it sends, and samples that it hears.
    site.await_in_log("steady", "speed=100 x=");
    site.await_in_log("steady", "poses=3");
    // A query that it serves, its parameter, and a topic of its own.
    let battery = rcdeploy(&[
        "call",
        &site.network,
        "steady.BatteryStatus.getBatteryState",
    ]);
    assert!(battery.contains("77"), "{battery}");
    rcdeploy(&["params", "set", &site.network, "steady", "speed=50"]);
    site.await_in_log("steady", "parameter=50");
    let pose = rcdeploy(&["echo", &site.network, "steady.seen.newFullPose", "--once"]);
    assert!(pose.contains("rz"), "{pose}");
    rcdeploy(&["down", &site.network]);
    site.assert_nothing_left();
}
