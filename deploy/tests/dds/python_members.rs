//! Slot arrays of a component in Python, in all four roles and over three middlewares, with a peer
//! in Rust.

use crate::python_worker::environment;
use crate::racks::{self, RACK, Racks};
use crate::site::{Ran, Site};
use std::path::Path;
use std::process::Command;

const PYTHON: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/programs/rack_python/rack_python.cdsl"
);

/// Runs `rcdeploy` with an interpreter that has the packages of the worker.
fn rcdeploy(site: &Site, environment: &Path, args: &[&str]) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(args);
    command.env("CARGO_NET_OFFLINE", "true");
    command.env("VIRTUAL_ENV", environment);
    site.run(command)
}

/// Starts the network of the file.
fn up(site: &Site, environment: &Path) -> Ran {
    let file = site.ddsl().display().to_string();
    let args = ["up", "--build", "--detach", "--profile", "dev", &file];
    rcdeploy(site, environment, &args)
}

#[test]
fn members_in_python_are_slots_to_every_tool_and_over_every_middleware() {
    let Some(environment) =
        environment("members_in_python_are_slots_to_every_tool_and_over_every_middleware")
    else {
        return;
    };
    crate::built();
    for (name, head, reader) in [
        ("python_reads", RACK, PYTHON),
        ("python_serves", PYTHON, RACK),
    ] {
        let both = Racks {
            head,
            reader,
            domains: (226, 227),
        };
        let site = Site::new(name);
        site.write("patrol.ddsl", &both.network(&site));
        let up = up(&site, environment);
        assert_eq!(up.code, 0, "{up:?}");
        racks::check(&site, &|args| rcdeploy(&site, environment, args));
    }
}

#[test]
fn other_members_than_the_network_lists_end_a_component_in_python() {
    let Some(environment) =
        environment("other_members_than_the_network_lists_end_a_component_in_python")
    else {
        return;
    };
    crate::built();
    let site = Site::new("python_lists");
    let text = format!(
        "Deployment {}\n{{\nComponent rack {{ cdsl \"{PYTHON}\"; parameters {{ members [\"front\", \"up\"]; }}; \
         slots {{ lasers \"front\", \"back\"; poses \"front\", \"up\"; }}; }};\n}};\n",
        site.network
    );
    site.write("patrol.ddsl", &text);
    let up = up(&site, environment);
    assert_ne!(up.code, 0, "{up:?}");
    let reason = "the members of `lasers` are not those of the network; it lists `back`, which the worker does not open; \
                  the worker opens `up`, which it does not list; the .ddsl needs `slots { lasers \"front\", \"up\"; }`";
    let log = site.log("rack");
    assert!(log.contains(reason), "{log}\n{up:?}");
    site.assert_nothing_left();
}
