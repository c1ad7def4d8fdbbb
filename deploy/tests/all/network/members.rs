//! Members of slot arrays in a network: over three middlewares, and as tools see them.

use rc_test_site::racks::{self, RACK, Racks, json};
use rc_test_site::site::Site;

const RACKS: Racks = Racks {
    head: RACK,
    reader: RACK,
    domains: (228, 229),
};

#[test]
fn members_are_slots_to_every_tool_and_over_every_middleware() {
    let site = Site::new("members");
    site.write("patrol.ddsl", &RACKS.network(&site));
    let planned = json(&site.rcdeploy(
        &["plan", "--format", "json", "--profile", "dev", "--unbuilt"],
        true,
    ));
    let arguments = planned["components"][0]["arguments"].to_string();
    for expected in [
        "\"--members\",\"lasers=left,right\"",
        "\"--members\",\"sources=\"",
        &format!("\"lasers.left={}/body/head/lasers/left\"", site.network),
    ] {
        assert!(arguments.contains(expected), "{arguments}");
    }
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    racks::check(&site, &|args| site.rcdeploy(args, false));
}

#[test]
fn a_component_with_other_members_than_its_network_lists_does_not_start() {
    let site = Site::new("other_members");
    let text = format!(
        "Deployment {}\n{{\nComponent rack {{ cdsl \"{RACK}\"; parameters {{ members [\"front\", \"up\"]; }}; \
         slots {{ lasers \"front\", \"back\"; poses \"front\", \"up\"; }}; }};\n}};\n",
        site.network
    );
    site.write("patrol.ddsl", &text);
    let up = site.rcdeploy(&["up", "--profile", "dev"], true);
    assert_ne!(up.code, 0, "{up:?}");
    let reason = "the members of `lasers` are not those of the network; it lists `back`, which the worker does not open; \
                  the worker opens `up`, which it does not list; the .ddsl needs `slots { lasers \"front\", \"up\"; }`";
    let log = site.log("rack");
    assert!(log.contains(reason), "{log}\n{up:?}");
    site.assert_nothing_left();
}
