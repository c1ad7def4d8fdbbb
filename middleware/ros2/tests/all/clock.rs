//! Time over ROS 2: a source and a follower in lockstep, and a node with `use_sim_time` that
//! subscribes to `/clock`.

use rc_runtime::{
    Component, Core, Description, Embedded, Ports, StartError, Time, TimeSource, Values,
    WorkerError, embed,
};
use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(30);
const STEP: Duration = Duration::from_millis(20);

static SOURCE: Description = Description {
    name: "source",
    model_hash: 1,
    middleware: "ros2",
    period: Duration::from_millis(5),
    parameters: None,
    folder: "/nowhere",
    slots: &[],
    backends: &[rc_ros2::LINKED],
    types: &[],
    simulates_time: true,
    converter: None,
    managed: false,
    note: b"",
};

static NODE: Description = Description {
    name: "node",
    period: STEP,
    types: &[],
    simulates_time: false,
    managed: false,
    ..SOURCE
};

/// The last time of each component, and the number of its runs of `compute()`.
static SEEN: (Mutex<BTreeMap<String, (Time, u32)>>, Condvar) =
    (Mutex::new(BTreeMap::new()), Condvar::new());

fn until(so: impl Fn(&BTreeMap<String, (Time, u32)>) -> bool) {
    let seen = SEEN.0.lock().expect("the times");
    let waited = SEEN.1.wait_timeout_while(seen, LIMIT, |seen| !so(seen));
    let (seen, waited) = waited.expect("the times");
    assert!(!waited.timed_out(), "{seen:?}");
}

struct Worker {
    core: Core,
    time: TimeSource,
    computed: u32,
}

impl Worker {
    #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        let mut time = ports.time_source();
        time.wait_for_all(LIMIT);
        Ok(Self {
            core,
            time,
            computed: 0,
        })
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.core
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        if self.time.is_active() {
            self.time.advance(STEP)?;
        }
        self.computed += 1;
        let seen = (self.core.now(), self.computed);
        let mut all = SEEN.0.lock().expect("the times");
        all.insert(self.core.name().to_owned(), seen);
        SEEN.1.notify_all();
        Ok(())
    }
}

fn start(description: &'static Description, network: &str, name: &str, more: &[&str]) -> Embedded {
    let network = format!("{network}-{}", std::process::id());
    let lo = ["--set-middleware", "ros2.interfaces=lo"];
    let own = ["--network", &network, "--name", name];
    let domain = ["--set-middleware", "ros2.domain=94"];
    let args = [&own[..], &lo, &domain, more].concat();
    embed(description, Worker::start, &args).expect(name)
}

#[test]
fn ticks_travel_over_services_and_other_nodes_receive_the_clock() {
    let source = start(&SOURCE, "clock", "source", &["--followers", "follower"]);
    let follower = start(&NODE, "clock", "follower", &["--clock", "simulated"]);
    // A node of another network: only the names of ROS are the same.
    let node = start(
        &NODE,
        "other",
        "node",
        &["--set-middleware", "ros2.use_sim_time=true"],
    );
    until(|seen| {
        ["follower", "node"]
            .iter()
            .all(|name| seen.get(*name).is_some_and(|s| s.1 > 10))
    });
    let seen = SEEN.0.lock().expect("the times").clone();
    let (time, computed) = seen["follower"];
    assert_eq!(time, Time::ZERO + STEP * computed, "once in each tick");
    let (time, _) = seen["node"];
    assert_eq!(time.as_nanos() % 20_000_000, 0, "{time}");
    for component in [node, follower, source] {
        component.stop();
        component.join().expect("a good end");
    }
}
