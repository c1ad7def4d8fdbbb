//! Values that mean nothing, and those of which a conversion knows a part only: quaternions that
//! are not rotations, and a gimbal lock.

use crate::python_site::{second_component, up, workspace};
use rc_test_site::site::Site;

const TURN: &str = r"module Turning
{
    struct Turn
    {
        double x;
        double y;
        double z;
        double w;
        double roll;
        double pitch;
        double yaw;
    };

    interface TurnPub
    {
        publish turned(Turn turn);
    };
};
";

/// Quaternions of one end, whose length may differ by a tenth, and roll, pitch, yaw of the other one.
const QUATERNION: &str = r#"import "Turn.idsl";

algebraic quat :: Scalar{x, y, z, w}

dproto turned :: geometry
{
    semantic  = Orientation
    coord     = quaternion
    algebraic = quat
    ddr       = :: IDSL{Turning::Turn}
    dr        = { x = x, y = y, z = z, w = w }
    tolerance = 0.1
}
"#;
const ANGLES: &str = r#"import "Turn.idsl";

algebraic angles :: Scalar{roll, pitch, yaw}

dproto turned :: geometry
{
    semantic  = Orientation
    coord     = rpy
    algebraic = angles
    ddr       = :: IDSL{Turning::Turn}
    dr        = { roll = roll, pitch = pitch, yaw = yaw }
}
"#;

fn component(name: &str, slot: &str) -> String {
    format!(
        "import \"Turn.idsl\";\nimport \"turn.dproto\";\n\nComponent {name}\n{{\n    Communications\n    {{\n        {slot} {{ reliability reliable; depth 100; }};\n    }};\n    \
         language python;\n    period 10ms;\n}};\n"
    )
}

/// Sends one after the other: a quarter to the left, one with the nose up, one of length 1.05, and
/// three that are not rotations.
const OF_HEAD: &str = r"from math import nan, sqrt

from head import Context, Turn, Worker

HALF = sqrt(0.5)
ALL = [
    (0.0, 0.0, HALF, HALF),
    (0.0, -HALF, 0.0, HALF),
    (0.0, 0.0, 0.0, 1.05),
    (0.0, 0.0, 0.0, 0.0),
    (nan, 0.0, 0.0, 1.0),
    (0.0, 1.2, 0.0, 0.0),
]


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0

    def compute(self, ctx: Context) -> None:
        ctx.turn_pub.turned(Turn(*ALL[self.number % len(ALL)], 0.0, 0.0, 0.0))
        self.number += 1
";
const OF_NECK: &str = r#"from neck import Context, Turn, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def turn_pub_turned(self, ctx: Context, turn: Turn) -> None:
        print(f"seen {turn.roll:.3f} {turn.pitch:.3f} {turn.yaw:.3f}", flush=True)
"#;

#[test]
fn quaternions_that_are_no_rotations_are_refused_and_counted() {
    let test = "quaternions_that_are_no_rotations_are_refused_and_counted";
    let neck = component("neck", "subscribesTo TurnPub");
    let head = component("head", "publishes TurnPub");
    let files = [
        ("neck.cdsl", neck.as_str()),
        ("Turn.idsl", TURN),
        ("turn.dproto", ANGLES),
        ("src/specific_worker.py", OF_NECK),
    ];
    let Some(site) = workspace("turning", "neck", &files, test) else {
        return;
    };
    let files = [
        ("head.cdsl", head.as_str()),
        ("Turn.idsl", TURN),
        ("turn.dproto", QUATERNION),
        ("src/specific_worker.py", OF_HEAD),
    ];
    second_component(&site, "head", &files);
    site.write_ddsl(
        "Deployment patrol\n{\n    Component head { cdsl \"head/head.cdsl\"; after neck; };\n    \
         Component neck { cdsl \"neck/neck.cdsl\"; };\n    \
         bind neck.TurnPub -> head.TurnPub { convert; };\n};\n",
    );
    let started = up(&site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("head"));
    let slot = || site.ask("neck", "status")["slots"][0].clone();
    Site::until("150 refused values", || {
        slot()["converted"]["bad_values"].as_u64() >= Some(150)
    });
    let slot = slot();
    let count = |name: &str| slot["converted"][name].as_u64().unwrap_or_default();
    // Half of them mean nothing, and a sixth is locked.
    assert!(
        count("messages").abs_diff(count("bad_values")) <= 3,
        "{slot}"
    );
    assert!(
        count("locked").abs_diff(count("messages") / 3) <= 1,
        "{slot}"
    );
    assert_eq!(slot["lost"].as_u64(), Some(0), "{slot}");
    let status = site.rcdeploy(&["status", &site.network], false);
    assert!(status.stdout.contains(" at a gimbal lock "), "{status:?}");
    // The trouble names the slot, who sent the value and what is wrong, and so does the log.
    let trouble = status
        .stdout
        .lines()
        .find_map(|line| line.split_once("bad-value: "));
    let trouble = trouble.unwrap_or_else(|| panic!("{status:?}")).1;
    assert!(trouble.starts_with("slot TurnPub refused "), "{trouble}");
    assert!(
        trouble.contains(" from `head.TurnPub`: the value at byte "),
        "{trouble}"
    );
    assert!(
        trouble.contains("cannot be converted: its length is "),
        "{trouble}"
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();

    let log = site.log("neck");
    let seen: Vec<&str> = log
        .lines()
        .filter(|line| line.starts_with("seen "))
        .collect();
    let known = [
        "seen 0.000 0.000 1.571",
        // The nose is up: of roll and yaw, only the difference is known.
        "seen 0.000 -1.571 0.000",
        "seen 0.000 0.000 0.000",
    ];
    assert!(seen.len() > 100, "{log}");
    for line in seen {
        let line = line.replace("-0.000", "0.000");
        assert!(known.contains(&line.as_str()), "{line}");
    }
    // At most once a second, and 150 came in a few of them.
    let told = log
        .lines()
        .filter(|line| line.contains("slot TurnPub: ") && line.contains(" from `head.TurnPub`: "))
        .filter(|line| line.contains(" cannot be converted: its length is "))
        .count();
    assert!((1..20).contains(&told), "{told}: {log}");
}
