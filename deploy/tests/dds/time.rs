//! The patrol in simulated time over DDS: ticks and acknowledgements travel there as over shared memory.

use crate::site::Site;
use crate::{place, rcdeploy};

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
fn the_patrol_in_lockstep_repeats() {
    let (site, first) = run("time_dds", 180);
    assert_eq!(first.lines().count(), POSES as usize);
    let clock = site.ask("clock", "status");
    assert_eq!(clock["middleware"], "dds");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    let (site, second) = run("time_dds_again", 181);
    assert_eq!(first, second);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}
