//! Robots of YAML sets move as URDFs with the same numbers.

use crate::load_beside;
use rc_kinematics::Cell;
use rc_robot::State;

/// A crane: it turns on a base, a slide goes along x of its mast, and a hook turns below.
const SET: &str = "robot: crane\n\nconnectivity: \"./connect.yaml\"\nnumbering: './numbers.yaml'\ngeometry: geometry.yaml\n\
    inertia: inertia.yaml\njoint_limits: limits.yaml\n";

const CONNECT: &str = "name: crane

links:
- hook      # the last one
- mast
- base
- slide

joints:
  - name: turn
    kind: revolute
  - name: reach
    kind: prismatic
  -
    name: swing
    kind: revolute

pairs:
  - joint: turn
    link1: mast
    link2: base
  - joint: reach
    link1: mast
    link2: slide
  - joint: swing
    link1: hook
    link2: slide
";

const NUMBERS: &str = "nums:\n  base: 0\n  mast: 1\n  slide: 2\n  hook: 3\n";

const GEOMETRY: &str = "model: crane
mode: currentFrame
poses:
  - target: turn
    reference: base
    steps:
      - kind: trz
        amount: 2.0
  - target: reach
    reference: mast
    steps:
      - kind: trx
        amount: 0.5
      - kind: roty
        amount: PI/2
  - target: swing
    reference: slide
    steps:
      - {KIND}
        amount: -pi/4
      - kind: try
        amount: 0.3
  - target: tip
    reference: hook
    steps:
      - kind: trz
        amount: -0.1
";

const INERTIA: &str = "robot: crane
inertia:
  mast :
    mass: 3.5
    com:
      frame: mast
      z : 0.4
      y: 0.1
    moments:
      frame: mast
      ixx: 0.8
      iyy: 0.7
      izz: 0.2
      iyz: 0.13
  hook:
    mass: 0.5
    com:
      x: 0.02
    moments:
      ixx: 0.01
      iyy: 0.0102
      izz: 0.0101
";

const LIMITS: &str = "limits:
    turn:
        lower_pos: -pi/2
        upper_pos: 1.5
        velocity: 2
    reach:
        lower_pos: 0
        upper_pos: 0.8
        force: 40
";

/// The same robot. The tensors are about the centres of mass: of the mast, 0.8 - 3.5 (0.1² + 0.4²) and so on, and its
/// product yz is 3.5 · 0.1 · 0.4 - 0.13: a moment has the other sign.
const URDF: &str = r#"<robot name="crane">
    <link name="base"/>
    <link name="mast"><inertial><origin xyz="0 0.1 0.4"/><mass value="3.5"/><inertia ixx="0.205" iyy="0.14" izz="0.165" ixy="0" ixz="0" iyz="0.01"/></inertial></link>
    <link name="slide"/>
    <link name="hook"><inertial><origin xyz="0.02 0 0"/><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.0099" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <link name="tip"/>
    <joint name="turn" type="revolute"><parent link="base"/><child link="mast"/><origin xyz="0 0 2"/><axis xyz="0 0 1"/><limit lower="-1.5707963267948966" upper="1.5" velocity="2" effort="0"/></joint>
    <joint name="reach" type="prismatic"><parent link="mast"/><child link="slide"/><origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="0 0 1"/><limit lower="0" upper="0.8" velocity="0" effort="40"/></joint>
    <joint name="swing" type="continuous"><parent link="slide"/><child link="hook"/><origin xyz="0 0.2121320343559643 -0.2121320343559643" rpy="-0.7853981633974483 0 0"/><axis xyz="0 0 1"/></joint>
    <joint name="end" type="fixed"><parent link="hook"/><child link="tip"/><origin xyz="0 0 -0.1"/></joint>
</robot>"#;

fn read(of: &str, files: &[(&str, &str)]) -> (Option<Cell>, String) {
    let text = format!(
        "import \"{of}\"; Kinematics cell {{ solver s {{ pose tip in base; jacobian tip in base; efforts; }}; }};"
    );
    load_beside(&text, files)
}

/// A set with one text changed.
fn set(from: &str, to: &str) -> (Option<Cell>, String) {
    let kind = GEOMETRY.replace("{KIND}", "kind: rotx");
    let all = [SET, CONNECT, NUMBERS, &kind, INERTIA, LIMITS];
    let all = all.map(|text| text.replacen(from, to, 1));
    let names = [
        "crane.yaml",
        "connect.yaml",
        "numbers.yaml",
        "geometry.yaml",
        "inertia.yaml",
        "limits.yaml",
    ];
    let files: Vec<(&str, &str)> = names
        .into_iter()
        .zip(all.iter().map(String::as_str))
        .collect();
    read("crane.yaml", &files)
}

#[test]
fn a_set_moves_as_its_urdf() {
    let (own, found) = set("robot", "robot");
    assert_eq!(found, "");
    let (other, found) = read("crane.urdf", &[("crane.urdf", URDF)]);
    assert_eq!(found, "");
    let (own, other) = (own.expect("a cell"), other.expect("a cell"));
    assert_eq!(own.robot.coordinates, ["turn", "reach", "swing"]);
    assert_eq!(own.robot.limits(), other.robot.limits());
    for at in [[0.0, 0.0, 0.0], [0.3, 0.2, -0.7], [-1.2, 0.7, 2.0]] {
        let state = State {
            positions: at.to_vec(),
            velocities: vec![0.4, -0.3, 1.2],
            accelerations: vec![1.0, 0.2, -0.5],
        };
        let run = |cell: &Cell| {
            cell.solvers[0]
                .run(&state, &[0.0; 3], &[])
                .expect("numbers")
        };
        for (one, two) in run(&own).iter().zip(run(&other)) {
            assert!((one - two).abs() < 1e-12 * (1.0 + two.abs()), "{one} {two}");
        }
    }
    // Steps along the axes of the frame before come in the other order.
    let (fixed, found) = set("currentFrame", "fixedFrame");
    assert_eq!(found, "");
    let still = State::still(vec![0.0; 3]);
    let place = fixed.expect("a cell").solvers[0].run(&still, &[0.0; 3], &[]);
    let own = own.solvers[0].run(&still, &[0.0; 3], &[]).expect("numbers");
    assert!((place.expect("numbers")[3] - own[3]).abs() > 0.1);
}

#[test]
fn wrong_sets_are_told_at_their_places() {
    for (from, to, what) in [
        (
            "kind: prismatic",
            "kind: screw",
            "connect.yaml:13:11: error[bad-value]: expected `revolute`",
        ),
        ("link1: hook", "link1: hok", "did you mean `hook`?"),
        ("joint: swing", "joint: swng", "did you mean `swing`?"),
        (
            "link1: hook\n    link2: slide",
            "link1: mast\n    link2: slide",
            "note[loop-joint]: the joint `swing` closes a loop",
        ),
        (
            "link1: hook\n    link2: slide",
            "link1: slide\n    link2: slide",
            "connect.yaml:27:12: error[bad-value]: the joint `swing` connects `slide` with itself",
        ),
        (
            "amount: PI/2",
            "amount: tau/4",
            "geometry.yaml:15:17: error[bad-value]: expected a number up to 1e9",
        ),
        (
            "amount: 0.3",
            "amount: 1e300",
            "expected a number up to 1e9",
        ),
        ("kind: trx", "kind: trq", "expected `trx`"),
        (
            "reference: slide",
            "reference: hook",
            "has no pose of the joint `swing` in `slide`",
        ),
        (
            "reference: hook",
            "reference: hok",
            "is no frame of a link `hok`",
        ),
        (
            "currentFrame",
            "myFrame",
            "expected `currentFrame` or `fixedFrame`",
        ),
        (
            "frame: mast",
            "frame: hook",
            "masses are read in the frame `mast`",
        ),
        ("mass: 0.5", "maas: 0.5", "`mass` is missing"),
        ("    reach:\n", "    rech:\n", "did you mean `reach`?"),
        ("upper_pos: 0.8", "upper_pos: -0.8", "error["),
        (
            "geometry: geometry.yaml",
            "geometry: no.yaml",
            "cannot find `no.yaml`",
        ),
        ("geometry: geometry.yaml", "", "`geometry` is missing"),
        ("  base: 0", "  base: 7", "no link has the number 0"),
        (
            "robot: crane\n\n",
            "robot: {a: b}\n",
            "nothing else of YAML",
        ),
        ("robot: crane\n\n", "robot: 'crane\n", "ends on its line"),
        ("    kind: revolute", "   kind: revolute", "indented unlike"),
        (
            "    kind: revolute",
            "\tkind: revolute",
            "indented by spaces",
        ),
        ("numbering:", "geometry: x\nnumbering:", "occurs twice"),
    ] {
        let (_, found) = set(from, to);
        assert!(found.contains(what), "{from} -> {to}: {found}");
    }
    let deep: String = (0..200)
        .map(|at| format!("{}a:\n", " ".repeat(at)))
        .collect();
    let (_, found) = read("deep.yaml", &[("deep.yaml", &deep)]);
    assert!(found.contains("too deep"), "{found}");
    let (_, found) = read("empty.yaml", &[("empty.yaml", "# nothing\n")]);
    assert!(found.contains("an empty file"), "{found}");
}
