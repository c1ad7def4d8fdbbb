//! The unchanged `inner_model.ddsl` over DDS and over ROS 2.

use rc_test_site::site::{CommandOutput, Site};
use std::path::Path;

fn up(middleware: &str, site: &Site) -> CommandOutput {
    site.write_trees(&format!("{middleware} {{ domain 36; }}"));
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(["up", "--build", "--detach", "--profile", "dev"]);
    command.arg(site.ddsl()).env("CARGO_NET_OFFLINE", "true");
    site.run(command)
}

fn down(site: &Site) {
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

/// Builds the components of the networks.
pub(crate) fn build() {
    for middleware in ["dds", "ros2"] {
        let site = Site::new(&format!("tree_{middleware}_build"));
        let up = up(middleware, &site);
        assert_eq!(up.code, 0, "{up:?}");
        down(&site);
    }
}

#[test]
fn two_processes_share_one_tree_over_dds_and_over_ros_2() {
    crate::built();
    for middleware in ["dds", "ros2"] {
        let site = Site::new(&format!("tree_{middleware}"));
        let up = up(middleware, &site);
        assert_eq!(up.code, 0, "{up:?}");
        assert_eq!(site.ask("copy", "status")["middleware"], middleware);
        site.share_a_tree();
        site.call_each_operation("world");
        down(&site);
    }
}
