//! A second simulator that is kept as the first one is, as processes.

use crate::network::caller::Caller;
use crate::network::recorded::down;
use rc_test_site::site::Site;
use serde_json::{Value, json};

const MIRROR: &str = include_str!("../../../../components/networks/mirror.ddsl");
/// Steps of 10 ms in a second.
const SECOND: u32 = 100;
/// The deviation of the scanner's errors in mm, as in the scene.
const NOISE: f64 = 10.0;

/// A simulator: its world, and its scanner.
struct Instance {
    world: Caller,
    laser: Caller,
}

impl Instance {
    fn new(site: &Site, name: &str) -> Self {
        Self {
            world: Caller::new(site, name, "Simulation"),
            laser: Caller::new(site, name, "lasers.front"),
        }
    }

    fn call(&mut self, operation: &str, parameters: &Value) -> Value {
        self.world.call(operation, parameters)["return"].clone()
    }

    fn ranges(&mut self) -> Vec<f64> {
        let scan = self.laser.call("getLaserData", &json!({}));
        let ranges = scan["return"].as_array().expect("a scan").iter();
        ranges
            .map(|range| range["dist"].as_f64().expect("a number"))
            .collect()
    }

    fn teleport(&mut self, id: &str, x: f64, z: f64, ry: f64) {
        let pose = json!({ "x": x, "y": 0.0, "z": z, "rx": 0.0, "ry": ry, "rz": 0.0 });
        let request = json!({ "world": "", "id": id, "base": "root", "pose": pose });
        self.call("teleport", &request);
    }

    fn drive(&mut self, advance: f64, turn: f64) {
        let speed =
            json!({ "world": "", "base": "base", "side": 0.0, "advance": advance, "turn": turn });
        self.call("drive", &speed);
    }

    /// Lets a second pass in both worlds: that of the network's time waits for the other one.
    fn pass_a_second(&mut self) {
        let world = json!({ "world": "" });
        self.call("step", &json!({ "world": "", "count": SECOND }));
        Site::until("a second", || self.call("getClock", &world)["pending"] == 0);
    }
}

/// The root mean square of the differences of two scans, in mm.
fn deviation(first: &mut Instance, second: &mut Instance) -> f64 {
    let (a, b) = (first.ranges(), second.ranges());
    assert!(
        a.len() == b.len() && a.len() > 100,
        "{} {}",
        a.len(),
        b.len()
    );
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len() as f64).sqrt()
}

#[test]
fn the_second_simulator_measures_what_the_first_one_does() {
    let site = Site::new("mirror");
    site.write_ddsl(&MIRROR.replace("Deployment mirror", "Deployment patrol"));
    let up = [
        "up",
        "--detach",
        "--profile",
        "dev",
        "--set",
        "first.rate=0",
        "--set",
        "first.paused=true",
    ];
    let up = site.rcdeploy(&up, true);
    assert_eq!(up.code, 0, "{up:?}");
    let mut first = Instance::new(&site, "first");
    let mut second = Instance::new(&site, "second");
    let assert_same = |first: &mut Instance, second: &mut Instance, when: &str| {
        // Each scan has errors of its own.
        let deviation = deviation(first, second) / NOISE / 2.0_f64.sqrt();
        assert!((0.75..1.25).contains(&deviation), "{when}: {deviation}");
    };

    // Robot and crate are elsewhere in the first world.
    first.teleport("base", 400.0, -1000.0, -0.4);
    first.teleport("crate", 900.0, 700.0, 0.6);
    first.pass_a_second();
    assert_same(&mut first, &mut second, "after a second");

    first.drive(400.0, 0.5);
    first.pass_a_second();
    first.drive(0.0, 0.0);
    first.pass_a_second();
    assert_same(&mut first, &mut second, "after a drive");

    // Without detections, the worlds differ.
    let command = |verb: &str| {
        let ran = site.rcdeploy(&[verb, &site.network, "mirror"], false);
        assert_eq!(ran.code, 0, "{ran:?}");
    };
    command("stop");
    first.teleport("crate", -300.0, 300.0, 0.0);
    first.pass_a_second();
    let apart = deviation(&mut first, &mut second);
    assert!(apart > 10.0 * NOISE, "{apart}");
    command("start");
    // Time waits for a follower from the moment on at which the source knows it.
    site.await_component("first", |c| {
        let followers = c["clock"]["followers"].as_array();
        followers.is_some_and(|all| all.iter().any(|name| name == "mirror"))
    });
    first.pass_a_second();
    assert_same(&mut first, &mut second, "after a thing was moved");
    down(&site);
}
