//! Two racks, whose members exchange messages over three middlewares.

use crate::site::{CommandOutput, Site};
use serde_json::Value;

/// The rack in Rust.
pub const RACK: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../deploy/tests/programs/rack/rack.cdsl"
);

/// The descriptions of two racks.
pub struct Racks {
    /// The one that publishes.
    pub head: &'static str,
    /// The one that relays what it receives.
    pub reader: &'static str,
    /// A domain of DDS and one of ROS 2 that no other test has.
    pub domains: (u16, u16),
}

/// The line that a tool prints.
pub fn json(ran: &CommandOutput) -> Value {
    assert_eq!(ran.code, 0, "{ran:?}");
    let line = ran.stdout.lines().next().unwrap_or_default();
    serde_json::from_str(line).expect("JSON")
}

impl Racks {
    /// A network of both. Everything that `reader` replies and publishes comes from `head`, with
    /// the names of members exchanged.
    pub fn network(&self, site: &Site) -> String {
        let (dds, ros) = self.domains;
        let (head, reader) = (self.head, self.reader);
        let mut text = format!(
            "Deployment {}\n{{\n\
             middleware iceoryx2; middleware dds {{ domain {dds}; interfaces \"lo\"; }}; \
             middleware ros2 {{ domain {ros}; interfaces \"lo\"; }};\n\
             Group body {{ Component head {{ cdsl \"{head}\"; record {{ exact; }}; slots {{ lasers \"left\", \"right\"; dds_batteries \"left\", \"right\"; \
             ros_batteries \"left\", \"right\"; poses \"left\", \"right\"; dds_poses \"left\", \"right\"; ros_poses \"left\", \"right\"; }}; }};\n\
             export lasers, dds_batteries, ros_batteries, poses, dds_poses, ros_poses; }};\n\
             Component reader {{ cdsl \"{reader}\"; record {{ exact; }}; slots {{ lasers \"a\", \"b\"; dds_batteries \"a\", \"b\"; ros_batteries \"a\", \"b\"; \
             poses \"a\", \"b\"; dds_poses \"a\", \"b\"; ros_poses \"a\", \"b\"; \
             sources \"a\", \"b\"; dds_sources \"a\", \"b\"; ros_sources \"a\", \"b\"; \
             tracks \"a\", \"b\"; dds_tracks \"a\", \"b\"; ros_tracks \"a\", \"b\"; }}; }};\n",
            site.network
        );
        for (ours, theirs) in [
            ("sources", "lasers"),
            ("dds_sources", "dds_batteries"),
            ("ros_sources", "ros_batteries"),
            ("tracks", "poses"),
            ("dds_tracks", "dds_poses"),
            ("ros_tracks", "ros_poses"),
        ] {
            for (member, of) in [("a", "right"), ("b", "left")] {
                text += &format!("bind reader.{ours}.{member} -> body.{theirs}.{of};\n");
            }
        }
        text + "};\n"
    }
}

/// Checks the running network with its tools, ends it, and repeats the recordings of both.
/// `rcdeploy` runs a command.
pub fn check(site: &Site, rcdeploy: &dyn Fn(&[&str]) -> CommandOutput) {
    let tool = |command: &str, args: &[&str]| {
        let all: Vec<&str> = [command, &site.network]
            .into_iter()
            .chain(args.iter().copied())
            .collect();
        rcdeploy(&all)
    };
    // `a` of the reader is `right` of the head, its second member.
    for (member, value) in [("a", 2.0), ("b", 1.0)] {
        let call = |path: &str| {
            let path = format!("reader.{path}");
            json(&tool("call", &[&path, "--format", "json"]))["result"]["return"].clone()
        };
        let scan = call(&format!("lasers.{member}.getLaserData"));
        assert_eq!(scan[0]["dist"], 1000.0 * value, "{scan}");
        for of in ["dds_batteries", "ros_batteries"] {
            let battery = call(&format!("{of}.{member}.getBatteryState"));
            assert_eq!(battery["percentage"], value, "{of} {battery}");
        }
        for of in ["poses", "dds_poses", "ros_poses"] {
            let topic = format!("reader.{of}.{member}.newFullPose");
            Site::until(&format!("{topic} relays its track"), || {
                let echoed = tool("echo", &[&topic, "--once", "--format", "json"]);
                json(&echoed)["value"]["pose"]["x"] == value
            });
        }
    }
    let status = site.status();
    let reader = site.ask("reader", "status");
    let slots = reader["slots"].as_array().expect("slots");
    let names: Vec<&str> = slots
        .iter()
        .filter_map(|slot| slot["name"].as_str())
        .collect();
    assert!(
        names.contains(&"sources.a") && !names.contains(&"sources"),
        "{names:?}"
    );
    let source = slots
        .iter()
        .find(|slot| slot["name"] == "sources.a")
        .expect("a slot");
    assert_eq!(source["peers"], 1, "{source}");
    assert_eq!(
        source["address"],
        format!("{}/body/head/lasers/right", site.network),
        "{status}"
    );
    assert_eq!(tool("down", &[]).code, 0);
    site.assert_nothing_left();
    // What a member received and sent is in the recording, and a repeated run opens the same
    // members.
    for component in ["body.head", "reader"] {
        let name = format!("{component}.exact.mcap");
        let file = site.path("state/robocomp").join(&site.network).join(name);
        let file = file.display().to_string();
        let ran = rcdeploy(&["replay", "--check", &file, "--format", "json"]);
        let report = json(&ran);
        assert_eq!(report["equal"], true, "{component}: {report}");
        assert!(
            report["compared"].as_u64() > Some(10),
            "{component}: {report}"
        );
    }
}
