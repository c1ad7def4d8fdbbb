//! Composites whose parts are members of one structure.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::meanings::converted;
use expect_test::expect;

const IDSL: &str = "module L { struct State { @unit(\"mm\") float x; @unit(\"mm\") float y; @unit(\"mm\") float z;
        @unit(\"rad\") float rx; @unit(\"rad\") float ry; @unit(\"rad\") float rz; float vx; float vy; float vz;
        @unit(\"rad/s\") float wx; @unit(\"rad/s\") float wy; @unit(\"rad/s\") float wz; int more; };
    interface Laser { void push(State state); }; };";

/// Four prototypes of parts of the state, and one of the whole without `dr`.
fn state(axes: &str) -> String {
    let part = |name: &str, meaning: &str, coord: &str, members: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = {meaning} coord = {coord} algebraic = v3
                 ddr = :: IDSL{{L::State}} dr = {{ {members} }} }}\n"
        )
    };
    [
        "import \"Laser.idsl\";
         axes ros :: ahead, left, up
         axes robocomp :: right, ahead, up
         algebraic v3 :: Vector{3}\n"
            .to_owned(),
        part("place", "Position", "cartesian", "x = 0, y = 1, z = 2"),
        part("turn", "Orientation", "rpy", "rx = 0, ry = 1, rz = 2"),
        part(
            "speed",
            "LinearVelocity",
            "cartesian",
            "vx = 0, vy = 1, vz = 2",
        ),
        part(
            "spin",
            "AngularVelocity",
            "cartesian",
            "wx = 0, wy = 1, wz = 2",
        ),
        format!(
            "dproto state :: geometry {{ semantic = KinematicState
                 composes = {{ Position = place, Orientation = turn, LinearVelocity = speed, AngularVelocity = spin }}
                 ddr = :: IDSL{{L::State}} {axes} }}"
        ),
    ]
    .concat()
}

#[test]
fn parts_may_be_members_of_the_whole() {
    let made = converted(
        IDSL,
        ["subscribesTo", "publishes"],
        &state("axes = ros"),
        &state("axes = robocomp body = ros"),
    );
    let text = made.rsplit_once(" by ").expect("a plan").1;
    let plan: rc_conversion::Plan = text.parse().expect("a plan");
    let program = plan
        .program(0, rc_conversion::Place::Input)
        .expect("a program");
    let numbers = |of: [f32; 12]| -> Vec<u8> {
        let numbers = of.iter().flat_map(|number| number.to_le_bytes());
        numbers.chain(7_i32.to_le_bytes()).collect()
    };
    // A quarter to the left of the right is ahead.
    let quarter = std::f32::consts::FRAC_PI_2;
    let mut bytes = numbers([
        1000.0, 2000.0, 0.0, 0.0, 0.0, quarter, 0.5, 0.25, 0.0, 0.0, 0.0, 0.125,
    ]);
    assert_eq!(program.run(&mut bytes, 0), Ok(bytes.len()));
    let found: Vec<f32> = bytes[..48]
        .chunks_exact(4)
        .map(|own| f32::from_le_bytes(own.try_into().expect("four")))
        .collect();
    let expected = [
        2000.0, -1000.0, 0.0, 0.0, 0.0, 0.0, 0.25, -0.5, 0.0, 0.0, 0.0, 0.125,
    ];
    for (one, other) in found.iter().zip(expected) {
        assert!((one - other).abs() < 1e-6, "{found:?}");
    }
    assert_eq!(bytes[48..], 7_i32.to_le_bytes());
    let what = made.split_once("; ").expect("operations").0;
    expect![[r#"a.Laser -> b.Laser converts L::State axes right-ahead-up with a body ahead-left-up → ahead-left-up, composition"#]].assert_eq(what);
}
