//! The components of this repository on other middlewares than they were generated for: their networks unchanged over ROS 2 and
//! DDS, also on two hosts, and one that says so itself of one component.
//!
//! They are built here, as a user has them built: a program of its own for these tests, so that none that has to do with
//! time runs beside the compiler.

#[allow(dead_code, reason = "each test program uses its own part")]
#[path = "../all/network/site.rs"]
mod site;

#[allow(dead_code, reason = "each test program uses its own part")]
#[path = "../all/python.rs"]
mod python;

mod hosts;
mod mixed;
mod patrol;
mod remote;
mod time;

use serde_json::Value;
use site::{PATROL, Site};
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

/// A place with a network whose components were built for DDS. `network` is the text of `patrol.ddsl`, which is imported
/// by the file of this place, that has its own name and domain.
fn place(name: &str, domain: u32, network: &str) -> Site {
    built();
    unbuilt(name, domain, network)
}

/// Returns when all that tests start is built; while the compiler runs, none of them does.
fn built() {
    static BUILT: OnceLock<()> = OnceLock::new();
    BUILT.get_or_init(|| {
        build();
        mixed::build();
    });
}

fn unbuilt(name: &str, domain: u32, network: &str) -> Site {
    let site = Site::new(name);
    // What the network names lies beside it, as in the repository.
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

/// How often a component has computed, and how often that was an error.
fn computed(site: &Site, name: &str) -> (u64, u64) {
    let compute = &site.ask(name, "status")["compute"];
    let number = |key: &str| compute[key].as_u64().expect("a count");
    (number("count"), number("errors"))
}

/// Waits until a component has computed five times in a row without an error.
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

/// Waits until a component has failed to compute twice more, the second time at once; gives what it says.
fn await_errors(site: &Site, name: &str) -> Value {
    let (_, before) = computed(site, name);
    Site::until(&format!("{name} is told of errors"), || {
        computed(site, name).1 >= before + 2
    });
    site.ask(name, "status")
}
