//! `rcdeploy up --build --middleware dds` with the unchanged network of the README.

use crate::{await_errors, await_well, place, rcdeploy, tools};
use rc_test_site::foxglove;
use rc_test_site::site::{PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

/// The error of the avoider when its last command was not sent.
pub(crate) const END: &str = "could not be stopped";

/// An rcdeploy in the foreground. Dropping it ends it.
struct Up(Child);

impl Up {
    fn start(site: &Site) -> Self {
        let output = std::fs::File::create(site.path("up.log")).expect("a log");
        let mut command = rcdeploy(site, &["up", "--build"]);
        command.stdout(Stdio::null()).stderr(output);
        let up = Self(command.spawn().expect("rcdeploy"));
        let directory = site.directory();
        Site::until("the network is up", || {
            directory.path().join("rcdeploy.sock").exists()
                && status_if_up(site).is_some_and(|status| running(&status).len() == 3)
        });
        up
    }

    /// Sends SIGINT, as Ctrl-C does; gives the exit code.
    fn interrupt(mut self) -> Option<i32> {
        kill_process(Pid::from_child(&self.0), Signal::INT).expect("to stop it");
        self.0.wait().expect("a child").code()
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The status of a network that may still start: its socket exists a moment before it listens.
fn status_if_up(site: &Site) -> Option<Value> {
    let ran = site.rcdeploy(&["status", "--format", "json", &site.network], false);
    (ran.code == 0).then(|| serde_json::from_str(&ran.stdout).expect("one JSON document"))
}

/// The running components with their process ids.
fn running(status: &Value) -> BTreeMap<String, i64> {
    let components = status["components"].as_array().expect("a list");
    let running = components.iter().filter(|c| c["state"] == "running");
    let pair = |c: &Value| Some((c["name"].as_str()?.to_owned(), c["pid"].as_i64()?));
    running.filter_map(pair).collect()
}

fn kill(site: &Site, name: &str) -> i64 {
    let pid = running(&site.status())[name];
    let process = Pid::from_raw(pid as i32).expect("a process");
    kill_process(process, Signal::KILL).expect("to kill it");
    pid
}

/// Every file of a component with its content.
fn files(folder: &Path, all: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, all);
        } else {
            let bytes = std::fs::read(&path).expect("a file");
            all.insert(path, bytes);
        }
    }
}

/// The files of several components.
pub(crate) fn of_user(components: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for name in components {
        files(&Site::components().join(name), &mut all);
    }
    all
}

/// Asserts that the files of components are as before.
pub(crate) fn assert_unchanged(before: &BTreeMap<PathBuf, Vec<u8>>, components: &[&str]) {
    let after = of_user(components);
    let all = before.keys().chain(after.keys());
    let changed: BTreeSet<_> = all
        .filter(|path| before.get(*path) != after.get(*path))
        .collect();
    assert!(
        changed.is_empty(),
        "files of the user have changed: {changed:?}"
    );
}

#[test]
fn the_patrol_runs_over_dds_and_its_files_do_not_change() {
    let components = ["simulator", "avoider", "pose_monitor"];
    let before = of_user(&components);
    let site = place("patrol_dds", 171, PATROL);
    let up = Up::start(&site);
    let status = site.status();
    for component in status["components"].as_array().expect("a list") {
        assert_eq!(component["middleware"], "dds", "{status}");
    }
    assert!(site.ask("avoider", "status")["middleware"] == "dds");
    await_well(&site, "avoider");
    site.await_in_log("monitor", " m poses=");
    let params = |args: &[&str]| site.rcdeploy(&[&["params"], args].concat(), false);
    let set = params(&["set", &site.network, "avoider", "safe_distance=650"]);
    assert_eq!(set.code, 0, "{set:?}");
    let got = params(&["get", &site.network, "avoider", "safe_distance"]);
    assert!(got.stdout.contains("650"), "{got:?}");
    tools::look(&site, "dds");
    foxglove::look(&site, "the_patrol_runs_over_dds");
    // The variant has a folder of its own below the target folder.
    let variant = Site::target().join("rc/dds/avoider");
    assert!(variant.join("generated/src/backend.rs").exists());
    assert_eq!(up.interrupt(), Some(0));
    site.assert_nothing_left();
    assert_eq!(site.count_in_log("avoider", END), 0);
    assert_unchanged(&before, &components);
    assert!(
        site.path("networks/patrol.svg").exists(),
        "the path is drawn"
    );
}

/// A killed component without a restart policy: its peers go on and report errors.
#[test]
fn a_component_whose_peer_was_killed_goes_on_with_errors() {
    let site = place("lost_dds", 172, PATROL);
    let up = Up::start(&site);
    await_well(&site, "avoider");
    kill(&site, "simulator");
    let status = await_errors(&site, "avoider");
    assert_eq!(status["state"], "running", "{status}");
    let error = status["last_error"].as_str().unwrap_or_default();
    assert!(error.contains("/simulator/Laser`"), "{status}");
    let peers = || site.ask("monitor", "status")["slots"][0]["peers"].as_u64();
    Site::until("the monitor has no publisher", || peers() == Some(0));
    assert!(up.interrupt().is_some());
    site.assert_nothing_left();
}

#[test]
fn a_killed_simulator_is_restarted_by_its_policy() {
    let policy = "cdsl \"../simulator/simulator.cdsl\"; restart on_failure backoff 100ms;";
    let network = PATROL.replace("cdsl \"../simulator/simulator.cdsl\";", policy);
    let site = place("back_dds", 173, &network);
    let up = Up::start(&site);
    await_well(&site, "avoider");
    for _ in 0..2 {
        let pid = kill(&site, "simulator");
        // One call may have been under way when the process was killed.
        site.await_component("simulator", |c| c["state"] == "running" && c["pid"] != pid);
        await_well(&site, "avoider");
        let heard = || site.ask("monitor", "status")["slots"][0]["handlers"]["count"].as_u64();
        let before = heard();
        Site::until("poses come again", || heard() > before);
    }
    tools::record_and_play(&site);
    assert_eq!(up.interrupt(), Some(0));
    site.assert_nothing_left();
}
