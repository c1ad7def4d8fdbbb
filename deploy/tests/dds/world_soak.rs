//! Twenty agents of one world, in Rust and in Python, over three middlewares at once and on two hosts, with a
//! stranger, while some of them are killed, paused and cut off. `cargo xtask soak world` runs it.

use crate::python_site::workspace;
use crate::remote::Robot;
use crate::world::{AGENT, Agents, Place, Size, filters};
use rc_test_support::cable::cable;
use rc_test_support::python::skipped;
use std::time::Duration;

const SIZE: Size = Size {
    agents: AGENTS.len(),
    rate: 10,
    lasts: Duration::from_mins(1),
    kills: 30,
    pauses: 10,
    cuts: 2,
    // A change passes five agents from one end to the other.
    settles: Duration::from_mins(4),
};

/// An agent: its middleware, the host, the language, and the agent at the centre of its star.
type Agent = (&'static str, Host, Language, usize);

#[derive(Clone, Copy, PartialEq)]
enum Host {
    Here,
    Robot,
}

#[derive(Clone, Copy, PartialEq)]
enum Language {
    Rust,
    Python,
}

use Host::{Here, Robot as There};
use Language::{Python, Rust};

/// An agent hears the centre of its star; the centre hears all of its star.
const AGENTS: [Agent; 20] = [
    ("iceoryx2", Here, Rust, 0),
    ("iceoryx2", Here, Rust, 0),
    ("iceoryx2", Here, Rust, 0),
    ("iceoryx2", Here, Rust, 0),
    ("iceoryx2", Here, Python, 0),
    ("iceoryx2", Here, Python, 0),
    ("dds", Here, Rust, 6),
    ("dds", There, Rust, 6),
    ("dds", Here, Rust, 6),
    ("dds", Here, Python, 6),
    ("ros2", There, Rust, 10),
    ("ros2", Here, Rust, 10),
    ("ros2", There, Rust, 10),
    ("ros2", Here, Python, 10),
    ("dds", There, Rust, 14),
    ("dds", Here, Rust, 14),
    ("dds", There, Rust, 14),
    ("iceoryx2", There, Rust, 17),
    ("iceoryx2", There, Rust, 17),
    ("iceoryx2", There, Rust, 17),
];

/// The centres that adaptors join.
const BRIDGES: [(usize, usize); 4] = [(0, 6), (6, 10), (10, 14), (14, 17)];

const DOMAIN: u32 = 219;

/// The slots of an agent: two that it publishes, two that it subscribes to.
const SLOTS: [&str; 4] = ["g", "g_stream", "g_peers", "g_streams"];

/// The clauses of the network before its components.
fn head() -> String {
    let mut head = format!(
        "middleware iceoryx2; middleware dds {{ domain {DOMAIN}; }}; middleware ros2 {{ domain {}; }};\n    \
         Host robot {{ address \"10.77.0.2\"; user \"root\"; }};\n    \
         World g {{ schema \"world_script/things.gdsl\"; }};",
        DOMAIN + 1
    );
    let leaves = AGENTS.iter().enumerate();
    let leaves = leaves.filter(|(at, (.., centre))| at != centre);
    let stars = leaves.map(|(at, (.., centre))| (at, *centre));
    for (first, second) in stars.chain(BRIDGES) {
        let is_bridge = AGENTS[first].0 != AGENTS[second].0;
        let convert = if is_bridge {
            " { convert via process; }"
        } else {
            ""
        };
        for (hears, tells) in [(first, second), (second, first)] {
            let [told, values, state, stream] = SLOTS;
            let (hears, tells) = (Agents::name(hears), Agents::name(tells));
            head += &format!("\n    bind {hears}.{state} -> {tells}.{told}{convert};");
            head += &format!("\n    bind {hears}.{stream} -> {tells}.{values}{convert};");
        }
    }
    head
}

#[test]
#[ignore = "it takes minutes"]
fn twenty_agents_over_three_middlewares_end_equal() {
    let test = "twenty_agents_over_three_middlewares_end_equal";
    let Some(cable) = cable(test) else { return };
    if let Err(reason) = filters() {
        return skipped(test, &reason);
    }
    let files = [
        ("world_script.cdsl", include_str!("world_script.cdsl")),
        (
            "world_script.pdsl",
            include_str!("../programs/world_agent/world_agent.pdsl"),
        ),
        (
            "things.gdsl",
            include_str!("../programs/world_agent/things.gdsl"),
        ),
        ("src/specific_worker.py", include_str!("world_script.py")),
    ];
    let files = files.map(|(name, text)| (name, text.replace("world_agent", "world_script")));
    let files = files.each_ref().map(|(name, text)| (*name, &**text));
    let Some(mut site) = workspace("world_soak", "world_script", &files, test) else {
        return;
    };
    let robot = match Robot::start(&site, &cable) {
        Ok(robot) => robot,
        Err(reason) => return skipped(test, &reason),
    };
    site.within = ["ip", "netns", "exec", cable.name(0)]
        .map(str::to_owned)
        .to_vec();
    let mut agents = Agents::new(site, SIZE, Some(&cable), &head(), |at| {
        let (middleware, host, language, _) = AGENTS[at];
        let cdsl = match language {
            Rust => AGENT,
            Python => "world_script/world_script.cdsl",
        };
        let host = if host == There { "host robot; " } else { "" };
        (cdsl, format!("{host}middleware {middleware};"))
    });
    agents.up = vec![format!("RC_SSH={}", robot.ssh())];
    agents.stranger = Some(Place {
        domain: DOMAIN,
        tells: 7,
        hears: 6,
    });
    agents.run();
}
