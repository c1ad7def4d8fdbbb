//! The patrol in simulated time over DDS.

use crate::{place, rcdeploy};
use rc_test_site::site::Site;
use rustix::process::{Pid, Signal, kill_process};

const POSES: u32 = 60;

const PATROL: &str = "Deployment patrol\n{\n    time simulated by clock;\n\n    \
    Component simulator { cdsl \"../simulator/simulator.cdsl\"; };\n    \
    Component monitor { cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; };\n    \
    Component avoider { cdsl \"../avoider/avoider.cdsl\"; };\n    \
    Component clock { cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; restart on_failure; };\n};\n";

fn run(name: &str, domain: u32) -> (Site, String) {
    let site = place(name, domain, PATROL);
    site.monitor("trace", POSES);
    site.write("clock.toml", "[parameters]\nstep = \"50ms\"\nrate = 0.0\n");
    let up = site.run(rcdeploy(&site, &["up", "--build", "--detach"]));
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    let trace = std::fs::read_to_string(site.path("trace")).expect("the trace");
    (site, trace)
}

#[test]
fn the_patrol_in_lockstep_repeats_and_its_killed_source_is_restarted() {
    let (site, first) = run("time_dds", 180);
    assert_eq!(first.lines().count(), POSES as usize);
    let clock = site.ask("clock", "status");
    assert_eq!(clock["middleware"], "dds");
    let pid = clock["pid"]
        .as_i64()
        .and_then(|pid| Pid::from_raw(pid as i32));
    kill_process(pid.expect("a pid"), Signal::KILL).expect("to kill it");
    Site::until("a new source", || {
        let events = site.events("avoider");
        events.iter().any(|(code, _)| code == "time-jumped")
    });
    let tick = || site.ask("avoider", "status")["clock"]["tick"].as_u64();
    let before = tick();
    Site::until("ticks", || tick() > before);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    let (site, second) = run("time_dds_again", 181);
    assert_eq!(first, second);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}
