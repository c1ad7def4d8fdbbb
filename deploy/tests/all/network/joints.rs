//! The motor bus and the controller that moves a joint.

use rc_test_site::site::Site;

const JOINTS: &str = include_str!("../../../../components/networks/joints.ddsl");
const MOTORS: &str = include_str!("../../../../components/motor_bus/etc/config.toml");

/// The network with the name that `Site` replaces.
fn joints() -> String {
    JOINTS.replace("Deployment joints", "Deployment patrol")
}

#[test]
fn the_controller_respects_the_limits_of_the_bus() {
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
    // The joint moves back and forth; way points beyond the limits of the motor are clipped.
    for reached in ["reached 0.3 rad", "reached 0.6 rad", "reached -0.3 rad"] {
        site.await_in_log("controller", reached);
    }
    site.await_in_log("controller", "turns at ");

    // An impossible change is refused with its reason, together with all changes of the same
    // request.
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
    // A valid change is accepted, although the configuration contains 99.0.
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
fn limits_that_a_motor_would_have_to_move_for_are_refused_and_others_reach_the_controller() {
    let site = Site::new("limits");
    site.write_ddsl(&joints());
    // No controller moves the elbow: it is at its zero position.
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let net = site.network.as_str();
    let set = |changes: &[&str]| {
        site.rcdeploy(&[&["params", "set", net, "bus"], changes].concat(), false)
    };
    let wide = ["motors[1].zero=0.1", "motors[1].max=0.4"];
    let refused = set(&[&wide[..], &["motors[1].max_speed=0.7"]].concat());
    assert_eq!(refused.code, 1, "{refused:?}");
    assert_eq!(refused.stdout, "");
    let reason =
        "bus refuses: `elbow` is at 0.5 rad, which is not from 0 to 0.4 rad; move it first";
    assert!(refused.stderr.contains(reason), "{refused:?}");
    let get = ["params", "get", net, "bus", "motors[1]"];
    let values = site.rcdeploy(&get, false).stdout;
    for unchanged in ["zero = 0.5", "max = 2.6", "max_speed = 1.5"] {
        assert!(
            values.contains(&format!("motors[1].{unchanged}\n")),
            "{values}"
        );
    }
    let endless = set(&["motors[1].max=inf"]);
    assert_eq!(endless.code, 1, "{endless:?}");
    assert!(
        endless.stderr.contains("error[out-of-range]"),
        "{endless:?}"
    );
    // A limit that moves no motor is accepted, and the controller of another motor receives it.
    let near = set(&["motors[1].max=0.5", "motors[0].max_speed=0.9"]);
    assert_eq!(near.code, 0, "{near:?}");
    site.await_in_log("controller", "at most at 0.9 rad/s");
    assert_eq!(site.rcdeploy(&["down", net], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn strings_need_no_quotes_and_saved_values_are_printed() {
    let site = Site::new("texts");
    let config = site.write("motors.toml", MOTORS);
    let _bus = site.start("motor_bus", &["--config", &config.display().to_string()]);
    let net = site.network.as_str();
    let params = |args: &[&str]| {
        let ran = site.rcdeploy(&[&["params"], args].concat(), false);
        assert_eq!(ran.code, 0, "{ran:?}");
        ran.stdout
    };
    // A shell removes the quotes of `device="1"`.
    for (word, text) in [
        ("1", "1"),
        ("true", "true"),
        ("\"0x1\"", "0x1"),
        ("[1", "[1"),
        ("-", "-"),
    ] {
        let set = params(&["set", net, "motor_bus", &format!("device={word}")]);
        let output = format!("-> {text:?}, at the next start if it is saved\n");
        assert!(set.ends_with(&output), "{set}");
    }
    params(&[
        "set",
        net,
        "motor_bus",
        "baud_rate=9600",
        "motors[0].max=1.25",
    ]);
    let table = params(&[net, "motor_bus"]);
    for output in [
        "device will be \"-\" at the next start, if it is saved\n",
        "baud_rate will be 9600 at the next start, if it is saved\n",
        "motors[0].max is not saved\n",
    ] {
        assert!(table.contains(output), "{table}");
    }
    params(&["save", net, "motor_bus"]);
    let table = params(&[net, "motor_bus"]);
    assert!(
        table.contains("baud_rate will be 9600 at the next start\n"),
        "{table}"
    );
    assert!(!table.contains("saved"), "{table}");
    // Diagnostics begin on a new line after the colon.
    let wrong = ["params", "set", net, "motor_bus", "baud_rate=1"];
    let wrong = site.rcdeploy(&wrong, false);
    assert_eq!(wrong.code, 1);
    assert!(
        wrong.stderr.contains("motor_bus refuses:\n  error["),
        "{wrong:?}"
    );
}

#[test]
fn invalid_motors_are_rejected_before_the_start() {
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
