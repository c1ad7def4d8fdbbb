//! A component in Python on another host, which has copies of all that it reads.

use crate::python_site::{up, workspace};
use crate::remote::{Robot, component};
use rc_test_site::other_host;
use rc_test_site::site::Site;
use rc_test_support::cable::cable;
use rc_test_support::python::skipped;
use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Both tests have a component `roamer`, whose launcher in the common target folder names the files of
/// the test that has built it last.
static LAUNCHER: Mutex<()> = Mutex::new(());

/// Prints where it and what it imports is.
const WORKER: &str = r#"import os
import sys

import lens
import numpy
import robocomp

import roamer
from roamer import Context, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        read = [lens.__file__, numpy.__file__, robocomp.__file__, roamer.__file__]
        for place in [*read, os.environ["ROBOCOMP_NATIVE"], sys.prefix]:
            print("place", place)

    def compute(self, ctx: Context) -> None:
        pass
"#;

const CDSL: &str = "Component roamer { Communications {}; language python; period 5ms; };\n";

/// The places that the worker has printed.
fn places(site: &Site) -> Vec<PathBuf> {
    let log = site.log("roamer");
    let places = log.lines().filter_map(|line| line.strip_prefix("place "));
    places.map(PathBuf::from).collect()
}

#[test]
fn a_component_in_python_runs_on_another_host() {
    let _launcher = LAUNCHER.lock().unwrap_or_else(PoisonError::into_inner);
    let test = "a_component_in_python_runs_on_another_host";
    let files = [
        ("roamer.cdsl", CDSL),
        ("src/specific_worker.py", WORKER),
        ("src/lens.py", ""),
    ];
    let Some(site) = workspace("python_elsewhere", "roamer", &files, test) else {
        return;
    };
    site.write_ddsl(
        "Deployment patrol\n{\n    Host robot { address \"robot\"; };\n    \
         Component roamer { cdsl \"roamer/roamer.cdsl\"; host robot; };\n};\n",
    );
    let ssh = other_host::ssh(&site.path(""));
    let copies = site.path("away/home/.cache/robocomp/networks");
    let copies = copies.join(&site.network);
    let lens = copies.join(
        site.path("networks/roamer/src/lens.py")
            .strip_prefix("/")
            .expect("an absolute path"),
    );
    let down = || {
        assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
        site.assert_nothing_left();
    };

    let first = up(&site, &[("RC_SSH", &ssh)]);
    assert_eq!(first.code, 0, "{first:?}\n{}", site.log("roamer"));
    // Its output there comes over the connection.
    Site::until("its places", || places(&site).len() == 6);
    let read = places(&site);
    for place in &read {
        assert!(place.starts_with(&copies), "{}", place.display());
        assert!(place.exists(), "{}", place.display());
    }
    down();

    // A module that was removed here is not imported there.
    fs::remove_file(site.path("networks/roamer/src/lens.py")).expect("removed");
    assert!(lens.exists());
    let second = up(&site, &[("RC_SSH", &ssh)]);
    assert_ne!(second.code, 0, "{second:?}");
    assert!(!lens.exists());
    site.await_in_log("roamer", "No module named 'lens'");
    site.await_nothing_left();

    // Packages are built for one version of Python.
    site.write("roamer/src/lens.py", "");
    let bin = site.path("bin");
    fs::create_dir(&bin).expect("a folder");
    let made = copies.join(
        site.path("networks/roamer/.venv")
            .strip_prefix("/")
            .expect("an absolute path"),
    );
    fs::remove_dir_all(made.join("bin")).expect("removed");
    let script = fs::read_to_string(&ssh).expect("a script");
    let programs = "for program in sh cat head wc uname mkdir chmod mv rm touch setsid env; do\n    \
                    ln -sf \"$(command -v $program)\" BIN/$program\ndone\nexport PATH=BIN\n";
    let programs = programs.replace("BIN", &bin.display().to_string());
    let without = script.replace("echo \"Welcome", &format!("{programs}echo \"Welcome"));
    assert_ne!(without, script);
    fs::write(&ssh, without).expect("written");
    let third = up(&site, &[("RC_SSH", &ssh)]);
    assert_ne!(third.code, 0, "{third:?}");
    let missing = "there is no Python 3.";
    assert!(third.stderr.contains(missing), "{third:?}");
    site.await_nothing_left();
}

/// A component in Python behind a real ssh server, on a host of its own.
#[test]
fn a_component_in_python_runs_behind_an_ssh_server() {
    let _launcher = LAUNCHER.lock().unwrap_or_else(PoisonError::into_inner);
    let test = "a_component_in_python_runs_behind_an_ssh_server";
    let Some(cable) = cable(test) else { return };
    let files = [
        ("roamer.cdsl", CDSL),
        ("src/specific_worker.py", WORKER),
        ("src/lens.py", ""),
    ];
    let Some(mut site) = workspace("python_sshd", "roamer", &files, test) else {
        return;
    };
    site.write_ddsl(
        "Deployment patrol\n{\n    Host robot { address \"10.77.0.2\"; user \"root\"; };\n    \
         Component roamer { cdsl \"roamer/roamer.cdsl\"; host robot; restart on_failure backoff 100ms; };\n};\n",
    );
    let robot = match Robot::start(&site, &cable) {
        Ok(robot) => robot,
        Err(reason) => return skipped(test, &reason),
    };
    let within = ["ip", "netns", "exec", cable.name(0)];
    site.within = within.map(str::to_owned).to_vec();
    let ssh = PathBuf::from(robot.ssh());
    for copied in ["files were copied", "nothing had to be copied"] {
        let up = up(&site, &[("RC_SSH", &ssh)]);
        assert_eq!(up.code, 0, "{up:?}\n{}", site.log("roamer"));
        site.await_in_log("rcdeploy", copied);
        Site::until("its places", || places(&site).len() >= 6);
        let copies = robot.path("cache/robocomp/networks").join(&site.network);
        for place in places(&site) {
            assert!(place.starts_with(&copies), "{}", place.display());
        }
        // Its socket is here, and it is restarted there.
        assert_eq!(site.ask("roamer", "status")["state"], "running");
        let pid = || component(&site, "roamer")["pid"].clone();
        let before = pid();
        let process = before.as_i64().and_then(|pid| Pid::from_raw(pid as i32));
        kill_process(process.expect("a process"), Signal::KILL).expect("to kill it");
        site.await_component("roamer", |one| {
            one["state"] == "running" && one["pid"] != before
        });
        assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
        site.await_nothing_left();
        robot.await_nothing_left(&site);
    }
}
