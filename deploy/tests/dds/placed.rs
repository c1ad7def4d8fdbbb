//! The patrol in lockstep, of which one component is a thread, a process, and on another host:
//! behind a real ssh server, over DDS.

use crate::remote::{Robot, component};
use crate::tools::tool;
use rc_test_site::site::Site;
use rc_test_support::cable::{Cable, cable};
use rc_test_support::python::skipped;
use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;

/// How many poses a run has.
const POSES: u32 = 60;

/// The patrol. `avoider` and `monitor` stand in the components of these names.
fn network(site: &Site, avoider: &str, monitor: &str) {
    site.write_ddsl(&format!(
        "Deployment patrol\n{{\n    middleware auto;\n    middleware dds {{ domain 183; }};\n    \
         time simulated by clock;\n    Host away {{ address \"10.77.0.2\"; user \"root\"; }};\n    \
         Component simulator {{ cdsl \"../simulator/simulator.cdsl\"; process base; }};\n    \
         Component monitor {{ cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; {monitor} }};\n    \
         Component avoider {{ cdsl \"../avoider/avoider.cdsl\"; {avoider} }};\n    \
         Component clock {{ cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; process base; }};\n    \
         bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n}};\n"
    ));
    let clock = "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"10s\"\n";
    site.write("clock.toml", clock);
}

/// The middleware of the calls of the avoider, as its status has it.
fn middleware_of_laser(site: &Site) -> String {
    let status = site.ask("avoider", "status");
    let slots = status["slots"].as_array().expect("slots");
    let laser = slots.iter().find(|slot| slot["name"] == "Laser");
    let laser = laser.expect("a slot");
    laser["middleware"].as_str().unwrap_or_default().to_owned()
}

fn up(site: &Site, robot: &Robot) {
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).env("CARGO_NET_OFFLINE", "true");
    up.env("RC_SSH", robot.ssh());
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
}

fn down(site: &Site, robot: &Robot) {
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.await_nothing_left();
    robot.await_nothing_left(site);
}

/// A site with another host. `None` where this machine has none: `test` is listed as skipped.
fn place(test: &str) -> Option<(Site, Cable, Robot)> {
    let cable = cable(test)?;
    let mut site = Site::new("patrol_placed");
    // The program of a process has the name of its network.
    site.network = "patrol_placed".into();
    let robot = match Robot::start(&site, &cable) {
        Ok(robot) => robot,
        Err(reason) => {
            skipped(test, &reason);
            return None;
        }
    };
    let within = ["ip", "netns", "exec", cable.name(0)];
    site.within = within.map(str::to_owned).to_vec();
    Some((site, cable, robot))
}

#[test]
fn a_component_moves_from_thread_to_process_to_another_host_and_the_trace_stays() {
    let test = "a_component_moves_from_thread_to_process_to_another_host_and_the_trace_stays";
    let Some((site, _cable, robot)) = place(test) else {
        return;
    };
    let mut traces: Vec<(&str, String)> = Vec::new();
    let there = "host away; process eyes; restart on_failure backoff 100ms;";
    for (avoider, monitor, middleware) in [
        ("process base;", "", "local"),
        ("", "", "iceoryx2"),
        ("host away;", "", "dds"),
        // Two components of one process there.
        (there, there, "dds"),
    ] {
        site.monitor("trace", POSES);
        network(&site, avoider, monitor);
        up(&site, &robot);
        assert_eq!(middleware_of_laser(&site), middleware, "{avoider}");
        site.await_end_of("monitor");
        let trace = std::fs::read_to_string(site.path("trace"));
        traces.push((avoider, trace.expect("a trace")));
        if !monitor.is_empty() {
            restarts_there(&site, &robot);
        }
        down(&site, &robot);
    }
    assert_eq!(traces[0].1.lines().count(), POSES as usize);
    for (avoider, trace) in &traces[1..] {
        assert_eq!(*trace, traces[0].1, "{avoider}");
    }
}

/// The process of two components runs on the other host, from copies there, and is restarted there.
fn restarts_there(site: &Site, robot: &Robot) {
    let pid = |name: &str| component(site, name)["pid"].clone();
    let before = pid("avoider");
    let process = before.as_i64().and_then(|pid| Pid::from_raw(pid as i32));
    let process = process.expect("a process");
    let program = std::fs::read_link(format!("/proc/{}/exe", process.as_raw_nonzero()));
    let copies = robot.path("cache/robocomp/networks").join(&site.network);
    let program = program.expect("a program");
    assert!(program.starts_with(&copies), "{}", program.display());
    assert_eq!(component(site, "avoider")["host"], "away");
    kill_process(process, Signal::KILL).expect("to kill it");
    for name in ["avoider", "monitor"] {
        site.await_component(name, |one| {
            (one["state"] == "running" || one["state"] == "done") && one["pid"] != before
        });
    }
    assert_eq!(site.ask("avoider", "status")["state"], "running");
}

/// A group behind its proxy on the other host: outside, everything is as if it were one component
/// there.
#[test]
fn a_group_with_a_proxy_runs_on_another_host() {
    let Some((mut site, _cable, robot)) = place("a_group_with_a_proxy_runs_on_another_host") else {
        return;
    };
    site.network = "patrol_proxied".into();
    site.monitor("trace", 0);
    site.write_ddsl(
        "Deployment patrol\n{\n    middleware auto;\n    middleware dds { domain 184; };\n    \
         Host away { address \"10.77.0.2\"; user \"root\"; };\n    \
         Group robot\n    {\n        \
             Component simulator { cdsl \"../simulator/simulator.cdsl\"; host away; };\n        \
             export Laser, DifferentialRobot, BatteryStatus, FullPoseEstimationPub;\n        proxy;\n    };\n    \
         Component monitor { cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; };\n    \
         Component avoider { cdsl \"../avoider/avoider.cdsl\"; };\n    \
         bind avoider.Laser -> robot.Laser;\n    \
         Chain drive { from avoider.DifferentialRobot.setSpeedBase; \
             to robot.simulator.DifferentialRobot.setSpeedBase; within 10s; };\n};\n",
    );
    up(&site, &robot);
    assert_eq!(middleware_of_laser(&site), "dds");
    for name in ["robot", "robot.simulator"] {
        assert_eq!(component(&site, name)["host"], "away", "{name}");
    }
    // Both sides of the proxy: DDS between the hosts, and the shared memory of the other one.
    let mut number = 0;
    Site::until("a recording of both sides", || {
        number += 1;
        let file = site.path(&format!("{number}.mcap"));
        let name = file.display().to_string();
        let recorded = ["record", &site.network, "-o", &name, "--length", "3s"];
        let recorded = tool(&site, &recorded);
        assert_eq!(recorded.code, 0, "{recorded:?}");
        let info = rc_record::bag::Info::read(&file).expect("a recording");
        let mut ends = [
            "robot/FullPoseEstimationPub/newFullPose",
            "robot/simulator/FullPoseEstimationPub/newFullPose",
            "robot/Laser/getLaserData/_reply",
            "robot/simulator/Laser/getLaserData/_reply",
        ]
        .into_iter();
        ends.all(|end| {
            let topic = info.topics.get(&format!("/{}/{end}", site.network));
            topic.is_some_and(|topic| topic.count > 5)
        })
    });
    for topic in [
        "robot.FullPoseEstimationPub.newFullPose",
        "robot-simulator.FullPoseEstimationPub.newFullPose",
    ] {
        let echoed = tool(&site, &["echo", &site.network, topic, "--once"]);
        assert!(echoed.stdout.contains("\npose:\n"), "{echoed:?}");
    }
    Site::until("the chain to be measured", || {
        let shown = site.rcdeploy(&["chains", &site.network, "--format", "json"], false);
        let shown: serde_json::Value = serde_json::from_str(&shown.stdout).expect("JSON");
        let chain = &shown["chains"][0];
        chain["complete"].as_u64() >= Some(20) && chain["hops"].as_array().map(Vec::len) == Some(2)
    });
    let forwarded = &component(&site, "robot")["forwarded"]["Laser"];
    assert!(forwarded["messages"].as_u64() > Some(20), "{forwarded}");

    // Its death there is known here, and the group comes back as a whole.
    let pid = component(&site, "robot.simulator")["pid"].as_i64();
    let process = pid.and_then(|pid| Pid::from_raw(pid as i32));
    kill_process(process.expect("a process"), Signal::KILL).expect("to kill it");
    site.await_component("robot", |robot| robot["state"] == "failed");
    let call = ["call", &site.network, "robot.DifferentialRobot.getBasePose"];
    let refused = tool(&site, &call);
    assert!(
        refused.code != 0 && refused.stderr.contains("/robot/simulator/"),
        "{refused:?}"
    );
    let start = site.rcdeploy(&["start", &site.network, "robot"], false);
    assert_eq!(start.code, 0, "{start:?}");
    site.await_component("robot", |robot| robot["state"] == "running");
    let poses = site.count_in_log("monitor", "poses=");
    Site::until("poses again", || {
        site.count_in_log("monitor", "poses=") > poses
    });
    Site::until("calls again", || tool(&site, &call).code == 0);
    down(&site, &robot);
}
