//! A component in Python on another host, which has copies of all that it reads.

use crate::python_site::{up, workspace};
use rc_test_site::other_host;
use rc_test_site::site::Site;
use std::fs;
use std::path::PathBuf;

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
    // What it prints there comes over the connection.
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
