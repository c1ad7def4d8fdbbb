//! Components of this repository as variants for other middlewares: their unchanged networks over
//! ROS 2 and DDS, also on two hosts, and a network that chooses another middleware for one
//! component.
//!
//! The tests build them as a user does. They are a program of their own, so that no test with
//! limits of time runs beside the compiler.

mod adapted;
mod builds_there;
mod called;
mod chains;
mod cpp_worker;
mod debugging;
mod frozen;
mod hosts;
mod inner_model;
mod mapping;
mod migration;
mod mixed;
mod moving;
mod moving_world;
mod outside;
mod patrol;
mod placed;
mod python_elsewhere;
mod python_programs;
mod python_site;
mod python_tree;
mod python_worker;
mod python_world;
mod remote;
mod strangers;
mod tf;
mod time;
mod tools;
mod turning;
mod window;
mod world;
mod world_soak;

use rc_test_site::site::{PATROL, Site};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

/// A place with a network whose components were built for DDS. `network` is the text of
/// `patrol.ddsl`, which is imported by the file of this place, that has its own name and domain.
fn place(name: &str, domain: u32, network: &str) -> Site {
    built();
    unbuilt(name, domain, network)
}

/// Builds everything that the tests start, once. Meanwhile no test runs.
fn built() {
    static BUILT: OnceLock<()> = OnceLock::new();
    BUILT.get_or_init(|| {
        build();
        mixed::build();
        world::build();
        inner_model::build();
    });
}

fn unbuilt(name: &str, domain: u32, network: &str) -> Site {
    let site = Site::new(name);
    // The files that the network names lie beside it, as in the repository.
    for part in ["simulator", "avoider", "pose_monitor", "clock"] {
        let there = Site::components().join(part);
        std::os::unix::fs::symlink(there, site.path(part)).expect("a link");
    }
    std::fs::write(site.ddsl(), network).expect("to write");
    let own = format!(
        "import \"patrol.ddsl\";\n\nDeployment {}\n{{\n    middleware dds {{ domain {domain}; }};\n}};\n",
        site.network
    );
    site.write("own.ddsl", &own);
    site
}

/// `rcdeploy ARGS… FILE` for DDS, with the programs of this test run.
fn rcdeploy(site: &Site, args: &[&str]) -> Command {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(args).args(["--middleware", "dds"]);
    command.args(["--profile", "dev"]);
    command.arg(site.path("networks/own.ddsl"));
    command.env("CARGO_NET_OFFLINE", "true");
    command
}

fn build() {
    let site = unbuilt("dds_build", 170, PATROL);
    let up = site.run(rcdeploy(&site, &["up", "--build", "--detach"]));
    assert_eq!(up.code, 0, "{up:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The number of runs of `compute()`, and how many of them failed.
fn computed(site: &Site, name: &str) -> (u64, u64) {
    let compute = &site.ask(name, "status")["compute"];
    let number = |key: &str| compute[key].as_u64().expect("a count");
    (number("count"), number("errors"))
}

/// Waits until five runs of `compute()` in a row succeed.
fn await_well(site: &Site, name: &str) {
    let since = std::cell::Cell::new(computed(site, name));
    Site::until(&format!("{name} computes"), || {
        let (count, errors) = computed(site, name);
        if errors != since.get().1 {
            since.set((count, errors));
        }
        count >= since.get().0 + 5
    });
}

/// Waits until `compute()` fails twice more, the second time without delay; gives the status.
fn await_errors(site: &Site, name: &str) -> Value {
    let (_, before) = computed(site, name);
    Site::until(&format!("{name} receives errors"), || {
        computed(site, name).1 >= before + 2
    });
    site.ask(name, "status")
}
