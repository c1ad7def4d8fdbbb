//! No text causes a panic.

use crate::loaded;
use rc_prototypes::format;

const WORDS: [&str; 64] = [
    "import",
    "axes",
    "algebraic",
    "ddr",
    "units",
    "alias",
    "view",
    "conversion",
    "load",
    "fproto",
    "domain",
    "dproto",
    "::",
    "<->",
    "->",
    "=",
    "<=",
    "=>",
    "{",
    "}",
    ",",
    ".",
    ";",
    "\"",
    "\"a\"",
    "\"common.dproto\"",
    "\"Lidar.idsl\"",
    "geometry",
    "Position",
    "Pose",
    "cartesian",
    "quaternion",
    "semantic =",
    "coord =",
    "algebraic =",
    "ddr =",
    "dr =",
    "composes =",
    "frames =",
    "covariance =",
    "sequence =",
    "member",
    "x",
    "X",
    "0",
    "99999999999999999999",
    "{0,0}",
    "Scalar",
    "Vector{3}",
    "Matrix{3,3}",
    "qudt",
    "position3",
    "position_named",
    "ros_position",
    "ros_pose",
    "IDSL",
    "RoboCompLidar::Point",
    "right, ahead, up",
    "//",
    "/*",
    "*/",
    "\n",
    "é",
    "-",
];

/// Texts of random words, most of them inside a prototype. A tenth of them is checked. `RC_DPROTO_TEXTS`
/// sets another number of them, and `cargo xtask fuzz` tries more for a time.
#[test]
fn no_text_causes_a_panic() {
    let count = std::env::var("RC_DPROTO_TEXTS").ok();
    let count = count.map_or(3_000, |count| {
        count.parse().expect("RC_DPROTO_TEXTS is a number")
    });
    let mut random = fastrand::Rng::with_seed(38);
    for number in 0..count {
        let mut text = String::new();
        if random.u8(..) > 40 {
            text.push_str("dproto a :: geometry { semantic = Position ");
        }
        for _ in 0..random.usize(0..10) {
            text.push_str(WORDS[random.usize(0..WORDS.len())]);
            if random.u8(..) > 20 {
                text.push(' ');
            }
        }
        let printed = format(&text);
        if printed != text {
            assert_eq!(format(&printed), printed, "{text}");
        }
        if number % 10 == 0 {
            loaded(&text);
        }
    }
}
