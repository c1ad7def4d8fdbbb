//! The motor bus and the controller that moves a joint on it.

use crate::site::Site;

const JOINTS: &str = include_str!("../../../components/networks/joints.ddsl");
const MOTORS: &str = include_str!("../../../components/motor_bus/etc/config.toml");

/// The network, with the name that a site gives to its own.
fn joints() -> String {
    JOINTS.replace("Deployment joints", "Deployment patrol")
}

#[test]
fn the_controller_moves_the_joint_within_the_limits_that_the_bus_tells() {
    let site = Site::new("joints");
    site.write(
        "tour.toml",
        "[component]\nperiod = \"5ms\"\n[parameters]\nmotor = \"wrist\"\nmotion = \"way_points\"\n\
         way_points = [0.3, 99.0, -0.3]\nspeed = 1.0\n",
    );
    let motors = MOTORS
        .replace("max = 3.1", "max = 0.6")
        .replace("period = \"20ms\"", "period = \"5ms\"");
    site.write("motors.toml", &motors);
    let text = joints()
        .replace(
            "motor_bus.cdsl\";",
            "motor_bus.cdsl\"; config \"motors.toml\";",
        )
        .replace(
            "joint_controller.cdsl\";",
            "joint_controller.cdsl\"; config \"tour.toml\";",
        );
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("controller", "`wrist` turns from -3.1 to 0.6 rad");
    // There and back, and there again; what the motor cannot reach is its limit.
    for reached in ["reached 0.3 rad", "reached 0.6 rad", "reached -0.3 rad"] {
        site.await_in_log("controller", reached);
    }
    site.await_in_log("controller", "turns at ");

    // What the joint cannot do is refused with the reason, and with it all that was to change at once.
    let net = site.network.as_str();
    let set = |changes: &[&str]| {
        site.rcdeploy(
            &[&["params", "set", net, "controller"], changes].concat(),
            false,
        )
    };
    let before = site.ask("controller", "parameters");
    for (changes, reason) in [
        (
            ["speed=0.5", "way_points=[0.1, 0.7]"],
            "the way point 0.7 is out of reach: the motor turns from -3.1 to 0.6 rad",
        ),
        (
            ["tolerance=0.02", "sine.amplitude=2"],
            "`sine.amplitude` is at most 1.85 rad, because the motor turns from -3.1 to 0.6 rad",
        ),
    ] {
        let refused = set(&changes);
        assert_eq!(refused.code, 1, "{refused:?}");
        assert!(refused.stderr.contains(reason), "{refused:?}");
        assert_eq!(site.ask("controller", "parameters"), before);
    }
    // What it can do is no less welcome because it was told 99.0 at the start.
    let changed = set(&["way_points[0]=0.2", "sine.amplitude=1.8"]);
    assert_eq!(changed.code, 0, "{changed:?}");
    site.await_in_log("controller", "reached 0.2 rad");

    let bus = site.ask("bus", "parameters");
    let parameters = bus["parameters"].as_array().expect("a list");
    let wrist = parameters.iter().find(|p| p["path"] == "motors[2].name");
    assert_eq!(wrist.expect("the name")["value"], "wrist", "{bus}");
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

#[test]
fn motors_that_cannot_be_are_refused_before_anything_starts() {
    let site = Site::new("motors");
    let wrong = MOTORS
        .replace("id = 2", "id = 1")
        .replace("name = \"wrist\"", "name = \"elbow\"")
        .replace("min = -3.1", "min = 3.1")
        .replace("steps = 1024", "stesp = 1024");
    site.write("motors.toml", &wrong);
    site.write_ddsl(&joints().replace(
        "motor_bus.cdsl\";",
        "motor_bus.cdsl\"; config \"motors.toml\";",
    ));
    let check = site.rcdeploy(&["check", "--profile", "dev", "--format", "short"], true);
    assert_eq!(check.code, 1);
    for expected in [
        "motors.toml:24:6: error[rule-broken]: `motors[1].id` breaks a rule: two motors have the same id",
        "motors.toml:34:8: error[rule-broken]: `motors[2].name` breaks a rule: two motors have the same name",
        "motors.toml:36:7: error[rule-broken]: `motors[2].min` breaks a rule: min must lie below max",
        "motors.toml:42:1: error[unknown-parameter]: unknown parameter `motors[2].stesp`",
        "did you mean `steps`?",
    ] {
        assert!(
            check.stderr.contains(expected),
            "{expected} is missing in {}",
            check.stderr
        );
    }
    site.assert_nothing_left();
}
