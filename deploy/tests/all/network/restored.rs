//! Unsaved changes of parameters survive restarts of their component.

use rc_test_site::site::Site;
use rustix::process::{Pid, Signal, kill_process};

const JOINTS: &str = include_str!("../../../../components/networks/joints.ddsl");
const MOTORS: &str = include_str!("../../../../components/motor_bus/etc/config.toml");

fn count(site: &Site, component: &str, code: &str) -> usize {
    let events = site.events(component);
    events.iter().filter(|(c, _)| c == code).count()
}

fn get(site: &Site, path: &str) -> String {
    let get = site.rcdeploy(&["params", "get", &site.network, "bus", path], false);
    assert_eq!(get.code, 0, "{get:?}");
    get.stdout.trim().to_owned()
}

#[test]
fn changed_parameters_are_restored_before_readiness() {
    let site = Site::new("restored");
    let file = site.write("motors.toml", MOTORS);
    let bus = "motor_bus.cdsl\"; config \"motors.toml\"; restart on_failure backoff 20ms;";
    let text = JOINTS
        .replace("Deployment joints", "Deployment patrol")
        .replace("motor_bus.cdsl\";", bus);
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let net = site.network.as_str();
    let set = |changes: &[&str]| {
        let args = [&["params", "set", net, "bus"], changes].concat();
        let set = site.rcdeploy(&args, false);
        assert_eq!(set.code, 0, "{set:?}");
    };
    let speed = get(&site, "motors[1].max_speed");
    set(&["motors[1].max_speed=0.25", "baud_rate=9600"]);
    let as_set = || {
        assert_eq!(
            get(&site, "motors[1].max_speed"),
            "motors[1].max_speed = 0.25"
        );
        let table = site.rcdeploy(&["params", net, "bus"], false).stdout;
        let pending = "baud_rate will be 9600 at the next start, if it is saved";
        assert!(table.contains(pending), "{table}");
    };
    as_set();

    // A crash.
    let status = site.ask("bus", "status");
    let pid = status["pid"]
        .as_i64()
        .and_then(|pid| Pid::from_raw(pid as i32));
    kill_process(pid.expect("a pid"), Signal::KILL).expect("to kill it");
    Site::until("it is ready again", || count(&site, "bus", "ready") == 2);
    as_set();
    let codes: Vec<String> = site
        .events("bus")
        .into_iter()
        .map(|(code, _)| code)
        .collect();
    let at = |code: &str| codes.iter().rposition(|c| c == code);
    assert!(
        at("restored").is_some() && at("restored") < at("ready"),
        "{codes:?}"
    );

    // A requested restart with a configuration that contradicts the changed values.
    set(&["motors[1].max=1.0"]);
    let restart = || {
        let restart = site.rcdeploy(&["restart", net, "bus"], false);
        assert_eq!(restart.code, 0, "{restart:?}");
    };
    restart();
    assert_eq!(get(&site, "motors[1].max"), "motors[1].max = 1.0");
    as_set();
    let wide = MOTORS.replace("zero = 0.5", "zero = 1.5");
    assert_ne!(wide, MOTORS);
    std::fs::write(&file, wide).expect("to write");
    restart();
    // The reply to the command and the printed events take different paths.
    Site::until("the refusal is printed", || {
        count(&site, "bus", "not-restored") == 1
    });
    let refused = site.events("bus");
    let refused = refused.iter().find(|(code, _)| code == "not-restored");
    let (_, message) = refused.expect("an event");
    assert!(
        message.contains("zero must lie between min and max"),
        "{message}"
    );
    assert_eq!(get(&site, "motors[1].zero"), "motors[1].zero = 1.5");
    assert_eq!(get(&site, "motors[1].max_speed"), speed);

    // After a stop, a component starts with its configuration.
    set(&["motors[1].max_speed=0.25"]);
    assert_eq!(site.rcdeploy(&["stop", net, "bus"], false).code, 0);
    assert_eq!(site.rcdeploy(&["start", net, "bus"], false).code, 0);
    assert_eq!(get(&site, "motors[1].max_speed"), speed);
    assert_eq!(count(&site, "bus", "restored"), 2);
    assert_eq!(count(&site, "bus", "not-restored"), 1);
    assert_eq!(site.rcdeploy(&["down", net], false).code, 0);
    site.assert_nothing_left();
}
