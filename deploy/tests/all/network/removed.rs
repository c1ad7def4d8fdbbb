//! Networks of real components whose shared memory is removed, or whose peers do not come back.

use rc_test_site::site::Site;
use serde_json::Value;

fn up(site: &Site) {
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
}

fn pids(status: &Value) -> Vec<i64> {
    let components = status["components"].as_array().expect("a list");
    let pids = components.iter().filter_map(|c| c["pid"].as_i64());
    pids.collect()
}

/// Whether all components run, and nothing is wrong with them or with the network.
fn is_well(status: &Value) -> bool {
    let is_empty = |one: &Value| one["troubles"].as_array().is_some_and(Vec::is_empty);
    let components = status["components"].as_array().expect("a list");
    let mut components = components.iter();
    is_empty(status) && components.all(|c| c["state"] == "running" && is_empty(c))
}

#[test]
fn a_network_without_its_shared_memory_restarts_in_order() {
    restarts_in_order(&Site::new("memory"), false);
}

/// A logout removes both, if the run directory is in `/dev/shm`.
#[test]
fn a_network_without_its_run_directory_and_its_memory_restarts_in_order() {
    restarts_in_order(&Site::new("memory_and_directory"), true);
}

fn restarts_in_order(site: &Site, also_directory: bool) {
    up(site);
    let before = pids(&site.status());
    if also_directory {
        std::fs::remove_dir_all(site.directory().path()).expect("it is ours");
    }
    let memory = rc_iceoryx2::leftovers(&site.directory()).into_iter();
    let memory: Vec<_> = memory.filter(|path| path.starts_with("/dev/shm")).collect();
    assert!(!memory.is_empty());
    for path in memory {
        // A component may have removed it in the meantime.
        let _ = std::fs::remove_file(path);
    }
    Site::until("all components have restarted", || {
        let status = site.status();
        let now = pids(&status);
        let is_new = now.len() == before.len() && now.iter().all(|pid| !before.contains(pid));
        is_new && is_well(&status)
    });
    let events = site.log("rcdeploy");
    let at = |code: &str| events.find(&format!("\"{code}\"")).expect(code);
    assert!(at("memory-lost") < at("memory-back"), "{events}");
    // The avoider reaches the servers of the simulator.
    let poses = site.count_in_log("monitor", "poses=");
    Site::until("poses come", || {
        site.count_in_log("monitor", "poses=") > poses
    });
    assert!(is_well(&site.status()));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn a_peer_that_is_missing_stays_a_trouble_after_a_restart() {
    let site = Site::new("missing");
    up(&site);
    let stopped = site.rcdeploy(&["stop", &site.network, "simulator"], false);
    assert_eq!(stopped.code, 0, "{stopped:?}");
    let status = site.status();
    let components = status["components"].as_array().expect("a list");
    let avoider = components.iter().find(|c| c["name"] == "avoider");
    let pid = avoider.expect("it runs")["pid"].as_i64().expect("a pid");
    let again = site.rcdeploy(&["restart", &site.network, "avoider"], false);
    assert_eq!(again.code, 0, "{again:?}");
    site.await_component("avoider", |c| {
        let troubles = c["troubles"].as_array().cloned().unwrap_or_default();
        let mut missing = troubles.iter().filter(|one| one["code"] == "peer-missing");
        let of_laser = |one: &Value| one["message"].as_str().is_some_and(|m| m.contains("Laser"));
        c["pid"].as_i64().is_some_and(|now| now != pid) && missing.any(of_laser)
    });
    let started = site.rcdeploy(&["start", &site.network, "simulator"], false);
    assert_eq!(started.code, 0, "{started:?}");
    Site::until("nothing is wrong", || is_well(&site.status()));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
