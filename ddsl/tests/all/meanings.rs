//! The meanings of the values at both ends of a connection, where prototypes declare them.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::network::{connect, made};
use expect_test::{Expect, expect};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

const CLOUD: &str = "module L { struct P { float x; float y; float z; int light; }; sequence<P> Ps;
    interface Laser { void push(Ps points); }; };";

/// A prototype of `L::P`, with these further fields.
fn point(units: &str, axes: &str, fields: &str) -> String {
    format!(
        "import \"Laser.idsl\";
         axes own :: {axes}
         algebraic named :: Scalar{{x, y, z}}
         units own :: qudt, named {{ x = {units}, y = {units}, z = {units} }}
         dproto point :: geometry {{ semantic = Position coord = cartesian algebraic = named
             ddr = :: IDSL{{L::P}} dr = {{ x = x, y = y, z = z }} units = own axes = own {fields} }}"
    )
}

/// Connects a subscriber and a publisher with one `.idsl` and these prototypes.
fn check(idsl: &str, ours: &str, theirs: &str, binds: &str, expected: &Expect) -> Vec<String> {
    let end = |meanings: &str, role: &str| format!("[{idsl}|||{meanings}]{role} Laser;");
    let (ours, theirs) = (end(ours, "subscribesTo"), end(theirs, "publishes"));
    connect(&[("a", &ours), ("b", &theirs)], binds, expected)
}

pub(crate) const ROS: &str = "ahead, left, up";
pub(crate) const LIDAR: &str = "right, ahead, up";

#[test]
fn ends_that_mean_the_same_convert() {
    let (ours, theirs) = (point("m", ROS, ""), point("mm", LIDAR, ""));
    check(
        CLOUD,
        &ours,
        &theirs,
        "",
        &expect![[r#"
        n.ddsl:3:11: error[unit-mismatch]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, mm, right-ahead-up); the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19 (they mean the same: `bind a.Laser -> b.Laser { convert; };` converts (units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up; 7 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value))
    "#]],
    );
    let made = check(
        CLOUD,
        &ours,
        &theirs,
        "bind a.Laser -> b.Laser { convert; };",
        &expect![[""]],
    );
    expect!["a.Laser -> b.Laser converts L::P units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up; 7 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value by 0i:[{3f!i|d@1&1e3;t$0;n@0;d$2&1e3;t$3;d@2&1e3;t$5;=$1&$4&$6}]"].assert_eq(&made.join("\n"));
    let made = check(CLOUD, &ours, &ours, "", &expect![[""]]);
    expect!["a.Laser -> b.Laser"].assert_eq(&made.join("\n"));
}

#[test]
fn ends_that_differ_in_a_sign_convert() {
    let ours = point("m", ROS, "");
    let theirs = ours.replace("y = y, z = z }", "y = -y, z = z }");
    check(
        CLOUD,
        &ours,
        &theirs,
        "",
        &expect![[r#"
        n.ddsl:3:11: error[axes-mismatch]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, m, y = -y, ahead-left-up); the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19 (they mean the same: `bind a.Laser -> b.Laser { convert; };` converts (signs; 1 operation a value))
    "#]],
    );
    let convert = "bind a.Laser -> b.Laser { convert; };";
    let made = check(CLOUD, &ours, &theirs, convert, &expect![[""]]);
    expect![
        "a.Laser -> b.Laser converts L::P signs; 1 operation a value by 0i:[{3f!i|n@1;=@0&$0&@2}]"
    ]
    .assert_eq(&made.join("\n"));
}

#[test]
fn other_meanings_are_refused() {
    let convert = "bind a.Laser -> b.Laser { convert; };";
    let ours = point("m", ROS, "");
    let velocity = point("\"m/s\"", ROS, "").replace("Position", "LinearVelocity");
    check(
        CLOUD,
        &ours,
        &velocity,
        convert,
        &expect![[r#"
        n.ddsl:2:6: error[semantic-mismatch]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as LinearVelocity (cartesian, m/s, ahead-left-up): the meanings differ: LinearVelocity and Position; the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
    let frame = |name: &str| {
        point(
            "m",
            ROS,
            &format!("frames = {{ with_respect_to = {name} }}"),
        )
    };
    check(
        CLOUD,
        &frame("map"),
        &frame("odom"),
        convert,
        &expect![[r#"
            n.ddsl:2:6: error[frame-mismatch]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, m, ahead-left-up): the frames differ: `with_respect_to` is `odom` and `map`, and no transform between them is known; the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19 (a tree knows it, if a slot of the subscriber requires `RcInnerModel::InnerModel`; so do tf and its shared world: `bind a.Laser -> b.Laser { convert { frames SLOT; }; };`)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
    );
    check(
        CLOUD,
        &ours,
        "",
        "",
        &expect![[r#"
        n.ddsl:3:11: warning[meaning-missing]: `a.Laser` has `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` does not say what it means; the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19 (let the other component import a `.dproto` with a prototype of this type, too)
    "#]],
    );
    let two = format!(
        "{ours} {}",
        ours[ours.find("dproto").unwrap_or(0)..].replace("point", "other")
    );
    check(
        CLOUD,
        &two,
        &ours,
        convert,
        &expect![[r#"
        n.ddsl:2:6: error[ambiguous-prototype]: `a.Laser` has several prototypes of `L::P`: `point`, `other` (choose one in the `.idsl`: `@dproto("NAME")` before the structure, the member or the parameter)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
}

#[test]
fn a_connection_that_loses_more_than_it_may_is_refused() {
    let convert = "bind a.Laser -> b.Laser { convert; };";
    let ours = point("m", ROS, "loss = 1e-9");
    check(
        CLOUD,
        &ours,
        &point("mm", LIDAR, ""),
        convert,
        &expect![[r"
        n.ddsl:2:6: error[conversion-loses]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, mm, right-ahead-up): the plan loses more than 1e-9: 6.0e-8 of the value; the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "]],
    );
    // Without a loss nothing is rounded.
    let made = check(
        CLOUD,
        &ours,
        &point("m", LIDAR, ""),
        convert,
        &expect![[""]],
    );
    expect!["a.Laser -> b.Laser converts L::P axes right-ahead-up → ahead-left-up; 1 operation a value by 0i:[{3f!i|n@0;=@1&$0&@2}]"].assert_eq(&made.join("\n"));
}

#[test]
fn sequences_of_other_bounds_are_other_types() {
    let end = |bound: u32, unit: &str, role: &str| {
        let cloud = CLOUD.replace("sequence<P>", &format!("sequence<P, {bound}>"));
        format!("[{cloud}|||{}]{role} Laser;", point(unit, ROS, ""))
    };
    let (ours, theirs) = (end(4, "m", "subscribesTo"), end(8, "mm", "publishes"));
    connect(
        &[("a", &ours), ("b", &theirs)],
        "bind a.Laser -> b.Laser { convert; };",
        &expect![[r"
        n.ddsl:2:6: error[type-mismatch]: `a.Laser` and `b.Laser` have different definitions of `L::Laser`: L::Laser/push differs; first definition at Laser.idsl:2:15; second definition at Laser.idsl:2:15
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "]],
    );
}

/// A connection changes numbers in their places, and a covariance has others.
#[test]
fn a_covariance_is_not_left_in_other_axes() {
    let convert = "bind a.Laser -> b.Laser { convert; };";
    let cloud = CLOUD.replace("int light;", "sequence<float> spread;");
    let with = |axes: &str| point("m", axes, "covariance = { member spread }");
    check(
        &cloud,
        &with(ROS),
        &with(LIDAR),
        convert,
        &expect![[r#"
        n.ddsl:2:6: error[no-conversion]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, m, right-ahead-up): the covariance would stay as it is; the consumer's declaration at Laser.idsl:1:19; the provider's declaration at Laser.idsl:1:19 (a connection converts a covariance that both ends have, as an array of numbers)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
    let made = check(&cloud, &with(ROS), &with(ROS), "", &expect![[""]]);
    assert_eq!(made, ["a.Laser -> b.Laser"]);
}

/// The parts of a composite may have covariances of their own.
#[test]
fn parts_convert_with_their_covariances() {
    let idsl = "module L { struct V { double x; double y; double z; double sure[9]; };
        struct Q { double x; double y; double z; double w; double sure[9]; };
        struct Pose { V p; Q q; };
        interface Laser { void push(Pose pose); }; };";
    let with = |units: &str, axes: &str| {
        let whole = pose(units, axes, "xyz_rpy");
        let whole = whole.replace("covariance = { member spread, order = xyz_rpy }", "");
        let sure = "covariance = { member sure } }";
        let whole = whole.replace("units = own }", &format!("units = own {sure}"));
        whole.replace("w = w } }", &format!("w = w }} {sure}"))
    };
    let (ours, theirs) = (with("m", ROS), with("mm", LIDAR));
    let made = converted(idsl, ["subscribesTo", "publishes"], &ours, &theirs);
    let text = made.rsplit_once(" by ").expect("a plan").1;
    let plan: rc_conversion::Plan = text.parse().expect("a plan");
    let program = plan
        .program(0, rc_conversion::Place::Input)
        .expect("a program");
    let position = [1000.0, 2000.0, 3000.0];
    let first = [1.0, 0.5, 0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 3.0];
    let turn = [0.6, 0.0, 0.0, 0.8];
    let second = [4.0, 0.0, 0.25, 0.0, 5.0, 0.0, 0.25, 0.0, 6.0];
    let numbers = [&position[..], &first, &turn, &second].concat();
    let mut bytes: Vec<u8> = numbers
        .iter()
        .flat_map(|number: &f64| number.to_le_bytes())
        .collect();
    assert_eq!(program.run(&mut bytes, 0), Ok(bytes.len()));
    let places: Vec<usize> = (0..25).map(|at| 8 * at).collect();
    let found = read(&bytes, &places);
    // right, ahead, up in mm becomes ahead, left, up in m: x is y, and y is -x.
    let expected = [
        &[2.0, -1.0, 3.0][..],
        &[2e-6, -0.5e-6, 0.0, -0.5e-6, 1e-6, 0.0, 0.0, 0.0, 3e-6],
        &[0.0, -0.6, 0.0, 0.8],
        &[5.0, 0.0, 0.0, 0.0, 4.0, -0.25, 0.0, -0.25, 6.0],
    ];
    for (one, other) in found.iter().zip(expected.concat()) {
        assert!((one - other).abs() < 1e-12, "{found:?}");
    }
    // One that is not positive is refused.
    let mut wrong: Vec<u8> = numbers
        .iter()
        .flat_map(|number: &f64| number.to_le_bytes())
        .collect();
    wrong[8 * 3..8 * 4].copy_from_slice(&(-1.0_f64).to_le_bytes());
    let fault = program.run(&mut wrong, 0).expect_err("no covariance");
    assert!(
        fault.to_string().contains("not symmetric or not positive"),
        "{fault}"
    );
    // At one end only, it would stay as it is.
    let bare = theirs.replacen("covariance = { member sure }", "", 1);
    let end = |meanings: &str, role: &str| format!("[{idsl}|||{meanings}]{role} Laser;");
    let (ours, theirs) = (end(&ours, "subscribesTo"), end(&bare, "publishes"));
    let binds = "bind a.Laser -> b.Laser { convert; };";
    let (_, found) = crate::network::connected_flat(&[("a", &ours), ("b", &theirs)], binds);
    let reason = "the covariance would stay as it is";
    assert!(
        found.contains("error[no-conversion]") && found.contains(reason),
        "{found}"
    );
}

#[test]
fn a_member_chooses_its_prototype() {
    let chosen = CLOUD.replace("(Ps points", "(@dproto(\"other\") Ps points");
    let ours = point("m", ROS, "");
    let other = ours[ours.find("dproto").unwrap_or(0)..]
        .replace("point", "other")
        .replace("Position", "Force")
        .replace("units = own", "");
    let two = format!("{ours} {other}");
    let made = check(&chosen, &two, &two, "", &expect![[""]]);
    expect!["a.Laser -> b.Laser"].assert_eq(&made.join("\n"));
}

/// Three or four numbers of `float64`, behind a text and a byte, in a sequence.
fn values(count: usize) -> String {
    let members: String = (0..count).map(|at| format!("double v{at}; ")).collect();
    format!(
        "module L {{ struct P {{ string name; byte flag; {members}}}; sequence<P> Ps;
         interface Laser {{ void push(Ps points); }}; }};"
    )
}

/// A prototype of `L::P` in these coordinates.
fn prototype(semantic: &str, coordinate: &str, count: usize, axes: &str) -> String {
    let places: Vec<String> = (0..count).map(|at| format!("v{at} = {at}")).collect();
    format!(
        "import \"Laser.idsl\";
         axes own :: {axes}
         algebraic places :: Vector{{{count}}}
         dproto point :: geometry {{ semantic = {semantic} coord = {coordinate} algebraic = places
             ddr = :: IDSL{{L::P}} dr = {{ {} }} axes = own }}",
        places.join(", ")
    )
}

/// The conversion of a subscriber with the prototype `ours` of a publisher with `theirs`: as bytes,
/// and as a plan of prototypes.
fn both_plans(
    count: usize,
    ours: &str,
    theirs: &str,
) -> (Option<rc_conversion::Program>, rc_plans::Plan) {
    let idsl = values(count);
    let end = |meanings: &str, role: &str| format!("[{idsl}|||{meanings}]{role} Laser;");
    let ends = [
        ("a", &*end(ours, "subscribesTo")),
        ("b", &*end(theirs, "publishes")),
    ];
    let made = made(&ends, "bind a.Laser -> b.Laser { convert; };");
    let text = made[0].rsplit_once(" by ").map(|(_, text)| text);
    let program = text.and_then(|text| {
        let plan: rc_conversion::Plan = text.parse().expect("a plan");
        plan.program(0, rc_conversion::Place::Input)
    });
    let library = |text: &str| {
        let mut sources = SourceMap::new();
        let source = sources.add("Laser.dproto", text.to_owned());
        let loader = MemoryLoader::new([("Laser.idsl", idsl.as_str())]);
        let (library, found) = rc_prototypes::load(&mut sources, &loader, &[source]);
        assert!(
            !found.has_errors(),
            "{}",
            render(&sources, &found, Format::Short)
        );
        library
    };
    let (from, to) = (library(theirs), library(ours));
    let plan = rc_plans::between((&from, "point"), (&to, "point")).expect("a plan");
    (program, plan)
}

/// A message of `L::Ps`, and the places of its numbers.
fn message(points: &[Vec<f64>]) -> (Vec<u8>, Vec<usize>) {
    let mut bytes = u32::try_from(points.len())
        .expect("few")
        .to_le_bytes()
        .to_vec();
    let mut places = Vec::new();
    for (at, point) in points.iter().enumerate() {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let name = "n".repeat(at % 5);
        bytes.extend(u32::try_from(name.len() + 1).expect("short").to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend([0, 7]);
        for value in point {
            bytes.resize(bytes.len().next_multiple_of(8), 0);
            places.push(bytes.len());
            bytes.extend(value.to_le_bytes());
        }
    }
    (bytes, places)
}

fn read(bytes: &[u8], places: &[usize]) -> Vec<f64> {
    let value = |at: &usize| f64::from_le_bytes(bytes[*at..at + 8].try_into().expect("8 bytes"));
    places.iter().map(value).collect()
}

/// Random numbers of these coordinates.
fn numbers(coordinate: &str, random: &mut fastrand::Rng) -> Vec<f64> {
    let mut wide = |most: f64| (random.f64() * 2.0 - 1.0) * most;
    let length = |all: &[f64]| all.iter().map(|one| one * one).sum::<f64>().sqrt();
    match coordinate {
        "quaternion" | "quaternion_wxyz" => {
            let all = [wide(1.0), wide(1.0), wide(1.0), wide(1.0)];
            let length = length(&all);
            all.iter().map(|one| one / length).collect()
        }
        "axis_angle" => {
            let axis = [wide(1.0), wide(1.0), wide(1.0)];
            let length = length(&axis);
            let axis = axis.iter().map(|one| one / length);
            axis.chain([wide(1.5) + 1.5]).collect()
        }
        "cylindrical" => vec![wide(2.0).abs() + 0.1, wide(3.0), wide(5.0)],
        "spherical" => vec![wide(2.0).abs() + 0.1, wide(3.0), wide(1.5)],
        "cartesian" => vec![wide(9.0), wide(9.0), wide(9.0)],
        _ => vec![wide(1.4), wide(1.4), wide(1.4)],
    }
}

/// The bits of the bytes are those of the formula, which `rcgen convert` prints as code; and back is
/// where the values came from. What belongs to no prototype stays.
#[test]
fn messages_have_the_bits_of_the_plan_and_come_back() {
    let kinds: [(&str, usize, &[&str]); 3] = [
        ("Position", 3, &["cartesian", "cylindrical", "spherical"]),
        (
            "Orientation",
            3,
            &[
                "rpy",
                "rotation_vector",
                "euler_zyx_moving",
                "euler_xyz_fixed",
            ],
        ),
        (
            "Orientation",
            4,
            &["quaternion", "quaternion_wxyz", "axis_angle"],
        ),
    ];
    let axes = [ROS, LIDAR, "back, up, left", "right, up, ahead"];
    let mut random = fastrand::Rng::with_seed(38);
    let mut exact = 0;
    for (semantic, count, coordinates) in kinds {
        for from in coordinates {
            for to in coordinates {
                let [own, other] = [0, 1].map(|_| axes[random.usize(..axes.len())]);
                let theirs = prototype(semantic, from, count, own);
                let ours = prototype(semantic, to, count, other);
                let (there, plan) = both_plans(count, &ours, &theirs);
                let (back, _) = both_plans(count, &theirs, &ours);
                let points: Vec<Vec<f64>> = (0..9).map(|_| numbers(from, &mut random)).collect();
                let (sent, places) = message(&points);
                let mut bytes = sent.clone();
                for program in there.iter().take(1) {
                    assert_eq!(program.run(&mut bytes, 0), Ok(sent.len()));
                }
                let wanted = points
                    .iter()
                    .flat_map(|point| plan.program.run(point).expect("numbers"));
                let wanted: Vec<u64> = wanted.map(f64::to_bits).collect();
                let got: Vec<u64> = read(&bytes, &places)
                    .iter()
                    .map(|one| one.to_bits())
                    .collect();
                assert_eq!(got, wanted, "{from} in {own} to {to} in {other}");
                for program in back.iter().take(1) {
                    assert_eq!(program.run(&mut bytes, 0), Ok(sent.len()));
                }
                if plan.program.is_exact() {
                    exact += 1;
                    assert_eq!(bytes, sent, "{from} in {own} to {to} in {other}");
                }
                let numbers = read(&bytes, &places);
                for (found, wanted) in numbers.iter().zip(points.iter().flatten()) {
                    // A quaternion and its opposite are one rotation.
                    let differs = (found - wanted).abs().min((found + wanted).abs());
                    assert!(
                        differs < 1e-9,
                        "{from} in {own} to {to} in {other}: {found}, {wanted}"
                    );
                }
                let mut rest = bytes.clone();
                let mut kept = sent.clone();
                for at in &places {
                    rest[*at..at + 8].fill(0);
                    kept[*at..at + 8].fill(0);
                }
                assert_eq!(rest, kept);
            }
        }
    }
    assert!(exact > 0);
}

#[test]
fn a_value_without_meaning_is_refused() {
    let theirs = prototype("Orientation", "quaternion", 4, ROS);
    let ours = prototype("Orientation", "axis_angle", 4, ROS);
    let (program, _) = both_plans(4, &ours, &theirs);
    let program = program.expect("a conversion");
    for wrong in [[0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.2]] {
        let (mut bytes, places) = message(&[wrong.to_vec()]);
        let fault = program.run(&mut bytes, 0);
        let fault = fault.expect_err("a value without meaning");
        assert_eq!(fault.at(), places[0], "{wrong:?}");
        let text = fault.to_string();
        assert!(
            text.contains(" cannot be converted: its length is "),
            "{text}"
        );
    }
    let (bytes, _) = message(&[vec![0.0, 0.0, 0.0, 1.0]]);
    for end in 0..bytes.len() {
        let fault = program.run(&mut bytes[..end].to_vec(), 0);
        assert!(
            matches!(fault, Err(rc_conversion::Fault::Truncated(_))),
            "{end}"
        );
    }
}

/// The connection of two ends with these roles and prototypes, which converts.
pub(crate) fn converted(idsl: &str, roles: [&str; 2], ours: &str, theirs: &str) -> String {
    let end = |meanings: &str, role: &str| format!("[{idsl}|||{meanings}]{role} Laser;");
    let ends = [("a", &*end(ours, roles[0])), ("b", &*end(theirs, roles[1]))];
    made(&ends, "bind a.Laser -> b.Laser { convert; };").join("\n")
}

#[test]
fn requests_convert_one_way_and_replies_the_other() {
    let idsl =
        "module L { struct P { float x; float y; float z; }; interface Laser { P turn(P p); }; };";
    let (ours, theirs) = (point("m", ROS, ""), point("m", LIDAR, ""));
    let made = converted(idsl, ["requires", "implements"], &ours, &theirs);
    expect!["a.Laser -> b.Laser converts L::P axes ahead-left-up → right-ahead-up; 1 operation a value; L::P axes right-ahead-up → ahead-left-up; 1 operation a value by 0i:{3f!|n@1;=$0&@0&@2},0o:{3f!|n@0;=@1&$0&@2}"].assert_eq(&made);
}

#[test]
fn images_have_the_same_formula() {
    let idsl = "module L { struct P { byte kind; float x; float y; float z; };
        struct Scan { long stamp; sequence<P, 3> points; }; interface Laser { void push(Scan scan); }; };";
    let (ours, theirs) = (point("m", ROS, ""), point("m", LIDAR, ""));
    let made = converted(idsl, ["subscribesTo", "publishes"], &ours, &theirs);
    expect!["a.Laser -> b.Laser converts L::P axes right-ahead-up → ahead-left-up; 1 operation a value by 0i:q[{B3f!|n@0;=@1&$0&@2}],0I:8x3<0,16:{4x3f!|n@0;=@1&$0&@2}>"].assert_eq(&made);
}

/// A prototype of a structure with a position, an orientation and their covariance.
fn pose(units: &str, axes: &str, order: &str) -> String {
    format!(
        "import \"Laser.idsl\";
         axes own :: {axes}
         algebraic named :: Scalar{{x, y, z}}
         algebraic turned :: Scalar{{x, y, z, w}}
         units own :: qudt, named {{ x = {units}, y = {units}, z = {units} }}
         dproto place :: geometry {{ semantic = Position coord = cartesian algebraic = named
             ddr = :: IDSL{{L::V}} dr = {{ x = x, y = y, z = z }} units = own }}
         dproto turn :: geometry {{ semantic = Orientation coord = quaternion algebraic = turned
             ddr = :: IDSL{{L::Q}} dr = {{ x = x, y = y, z = z, w = w }} }}
         dproto pose :: geometry {{ semantic = Pose composes = {{ Position = place, Orientation = turn }}
             ddr = :: IDSL{{L::Pose}} dr = {{ p = Position, q = Orientation }} axes = own
             covariance = {{ member spread, order = {order} }} }}"
    )
}

const POSE: &str = "module L { struct V { double x; double y; double z; }; struct Q { double x; double y; double z; double w; };
    struct Pose { string frame; V p; Q q; double spread[36]; };
    interface Laser { void push(Pose pose); }; };";

/// A composite converts as a whole, with its covariance.
#[test]
fn a_pose_converts_with_its_covariance() {
    let (ours, theirs) = (pose("m", ROS, "xyz_rpy"), pose("mm", LIDAR, "rpy_xyz"));
    check(
        POSE,
        &ours,
        &theirs,
        "",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` expects `L::Pose` as Pose (Position (cartesian, m), Orientation (quaternion), ahead-left-up), but `b.Laser` sends it as Pose (Position (cartesian, mm), Orientation (quaternion), right-ahead-up); the consumer's declaration at Laser.idsl:2:12; the provider's declaration at Laser.idsl:2:12 (they mean the same: `bind a.Laser -> b.Laser { convert; };` converts (units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up, composition; 57 operations a value))
        "#]],
    );
    let made = converted(POSE, ["subscribesTo", "publishes"], &ours, &theirs);
    let text = made.rsplit_once(" by ").expect("a plan").1;
    let plan: rc_conversion::Plan = text.parse().expect("a plan");
    let program = plan
        .program(0, rc_conversion::Place::Input)
        .expect("a program");
    // "x" and its zero, then numbers of 8 bytes.
    let mut bytes = [&2_u32.to_le_bytes()[..], b"x\0\0\0"].concat();
    bytes.resize(8, 0);
    let mut numbers = vec![1000.0, 2000.0, 3000.0, 0.6, 0.0, 0.0, 0.8];
    // The variance of each number is its place, turns first, and one covariance: of y and yaw.
    numbers.extend((0..36).map(|at| match (at / 6, at % 6) {
        (row, column) if row == column => f64::from(row + 1),
        (2, 4) | (4, 2) => 2.0,
        _ => 0.0,
    }));
    numbers
        .iter()
        .for_each(|number: &f64| bytes.extend(number.to_le_bytes()));
    assert_eq!(program.run(&mut bytes, 0), Ok(bytes.len()));
    let places: Vec<usize> = (0..43).map(|at| 8 + 8 * at).collect();
    let found = read(&bytes, &places);
    // right, ahead, up in mm becomes ahead, left, up in m.
    assert_eq!(found[..7], [2.0, -1.0, 3.0, 0.0, -0.6, 0.0, 0.8]);
    let at = |row: usize, column: usize| found[7 + 6 * row + column];
    let diagonal: Vec<f64> = (0..6).map(|row| at(row, row)).collect();
    assert_eq!(diagonal, [5e-6, 4e-6, 6e-6, 2.0, 1.0, 3.0]);
    // y, ahead, is x now, in m.
    assert_eq!((at(0, 5), at(5, 0)), (0.002, 0.002));
}

/// A hostile `.idsl` costs no memory in proportion to the lengths that it names.
#[test]
fn the_numbers_of_an_array_are_counted_before_they_are_listed() {
    let idsl =
        "module L { struct P { double v[4294967295]; }; interface Laser { void push(P p); }; };";
    let of = |axes: &str| {
        point("m", axes, "").replace("x = x, y = y, z = z }", "v.0 = x, v.1 = y, v.2 = z }")
    };
    check(
        idsl,
        &of(ROS),
        &of(LIDAR),
        "bind a.Laser -> b.Laser { convert; };",
        &expect![[r#"
            n.ddsl:2:27: error[not-convertible]: `a.Laser` has an interface of too many members to convert (a plan has at most 8192 values in 32 levels, and 64 KiB as a text: convert in a component, or divide the interface)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
    );
}

#[test]
fn numbers_may_be_in_parts_and_in_elements_of_a_sequence() {
    let idsl = "module L { struct V { double a[3]; bool valid; }; struct P { string name; V v; @unit(\"s\") float age; };
        sequence<P> Ps; struct Scan { Ps points; }; interface Laser { void push(Scan scan); }; };";
    let of = |axes: &str| {
        point("m", axes, "sequence = member points")
            .replace("L::P", "L::Scan")
            .replace("x = x, y = y, z = z }", "v.a.0 = x, v.a.1 = y, v.a.2 = z }")
    };
    let made = converted(idsl, ["subscribesTo", "publishes"], &of(ROS), &of(LIDAR));
    expect!["a.Laser -> b.Laser converts L::P axes right-ahead-up → ahead-left-up; 1 operation a value by 0i:[{s3d!Bf|n@0;=@1&$0&@2}]"].assert_eq(&made);
}

/// One end is about the elements of a sequence, the other one about their type.
#[test]
fn a_sequence_at_one_end_is_the_type_of_its_elements_at_the_other_one() {
    let idsl = "module L { struct P { float x; float y; float z; };
        sequence<P> Ps; struct Scan { Ps points; }; interface Laser { void push(Scan scan); }; };";
    let whole = point("m", ROS, "sequence = member points").replace("L::P", "L::Scan");
    let made = [
        converted(
            idsl,
            ["subscribesTo", "publishes"],
            &whole,
            &point("mm", LIDAR, ""),
        ),
        converted(
            idsl,
            ["subscribesTo", "publishes"],
            &point("m", ROS, ""),
            &point("mm", LIDAR, "sequence = member points").replace("L::P", "L::Scan"),
        ),
    ];
    assert_eq!(made[0], made[1]);
    expect!["a.Laser -> b.Laser converts L::P units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up; 7 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value by 0i:[{3f!|d@1&1e3;t$0;n@0;d$2&1e3;t$3;d@2&1e3;t$5;=$1&$4&$6}]"].assert_eq(&made[0]);
}

/// A structure has a meaning, and so have the elements of one of its members, which have one of their own.
#[test]
fn a_structure_and_its_elements_convert_each_by_its_own_prototype() {
    let idsl = "module L { struct P { float x; float y; float z; }; sequence<P> Ps;
        struct Scan { P origin; float x; float y; float z; Ps points; };
        interface Laser { void push(Scan scan); }; };";
    let of = |axes: &str, units: &str| {
        let named = |name: &str, ty: &str, units: &str, more: &str| {
            format!(
                "dproto {name} :: geometry {{ semantic = Position coord = cartesian algebraic = named
                 ddr = :: IDSL{{{ty}}} dr = {{ x = x, y = y, z = z }} units = {units} axes = own {more} }}\n"
            )
        };
        let head = point("m", axes, "");
        let (head, _) = head.split_once("dproto").expect("a prototype");
        format!("{head} units other :: qudt, named {{ x = {units}, y = {units}, z = {units} }}\n")
            + &named("whole", "L::Scan", "own", "")
            + &named("elements", "L::Scan", "other", "sequence = member points")
            + &named("part", "L::P", "own", "")
    };
    let made = converted(
        idsl,
        ["subscribesTo", "publishes"],
        &of(ROS, "m"),
        &of(LIDAR, "mm"),
    );
    expect!["a.Laser -> b.Laser converts L::P axes right-ahead-up → ahead-left-up; 1 operation a value; L::P units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up; 7 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value; L::Scan axes right-ahead-up → ahead-left-up; 1 operation a value by 0i:{{3f!|n@0;=@1&$0&@2}3f![{3f!|d@1&1e3;t$0;n@0;d$2&1e3;t$3;d@2&1e3;t$5;=$1&$4&$6}]|n@0;=@1&$0&@2}"].assert_eq(&made);
}

pub(crate) const SCAN: &str =
    "module L { struct T { int sec; uint32 nanosec; }; struct H { T stamp; string frame; };
    struct P { float x; float y; float z; }; sequence<P> Ps;
    struct S { H header; @unit(\"ms\") long taken; Ps points; @optional T maybe;
        @unit(\"s\") float short; };
    interface Laser { void push(S scan); }; };";

/// A prototype of the points of `L::S` in a frame.
pub(crate) fn scan(units: &str, axes: &str, frames: &str) -> String {
    point(
        units,
        axes,
        &format!("sequence = member points frames = {{ {frames} }}"),
    )
    .replace("L::P", "L::S")
}

/// Connects a subscriber with a tree to a publisher of scans with these frames.
fn moving(ours: &str, theirs: &str, block: &str, expected: &Expect) -> Vec<String> {
    let idsl = SCAN;
    let ours = format!(
        "[{idsl}|||{}]subscribesTo Laser; requires InnerModel as tree;",
        scan("m", ROS, ours)
    );
    let theirs = format!("[{idsl}|||{}]publishes Laser;", scan("mm", LIDAR, theirs));
    let binds = format!("bind a.Laser -> b.Laser {{ {block} }}; bind a.tree -> w.InnerModel;");
    connect(
        &[
            ("a", &ours),
            ("b", &theirs),
            ("w", "implements InnerModel;"),
        ],
        &binds,
        expected,
    )
}

#[test]
fn frames_change_by_the_tree_of_a_slot() {
    let of = "with_respect_to = lidar, stamp = member header.stamp";
    let made = moving(
        "with_respect_to = map",
        of,
        "convert { frames tree; };",
        &expect![[""]],
    );
    expect!["a.Laser -> b.Laser converts L::P units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up, frames lidar → map at member header.stamp; 25 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value by 0i^lidar>map@0*1000000000+1*1:i?I?sq[{3f!|d@0&1e3;d@1&1e3;d@2&1e3;n$0;m^0&$1;m^1&$3;a$4&$5;m^2&$2;a$6&$7;m^4&$1;m^5&$3;a$9&$10;m^6&$2;a$11&$12;m^8&$1;m^9&$3;a$14&$15;m^10&$2;a$16&$17;a$8&^3;a$13&^7;a$18&^11;t$19;t$20;t$21;=$22&$23&$24}]"].assert_eq(&made[0]);
    // The name of the frame is in each message, and the time is a number.
    let of = "with_respect_to = member header.frame, stamp = member taken";
    let made = moving(
        "with_respect_to = map",
        of,
        "convert { frames tree; };",
        &expect![[""]],
    );
    expect!["a.Laser -> b.Laser converts L::P units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up, frames of member header.frame → map at member taken; 25 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value by 0i^$0>map@0*1000000:iIs?q?[{3f!|d@0&1e3;d@1&1e3;d@2&1e3;n$0;m^0&$1;m^1&$3;a$4&$5;m^2&$2;a$6&$7;m^4&$1;m^5&$3;a$9&$10;m^6&$2;a$11&$12;m^8&$1;m^9&$3;a$14&$15;m^10&$2;a$16&$17;a$8&^3;a$13&^7;a$18&^11;t$19;t$20;t$21;=$22&$23&$24}]"].assert_eq(&made[0]);
    // Without a tree, such a frame is taken for the right one.
    let made = moving("with_respect_to = map", of, "convert;", &expect![[""]]);
    assert!(!made[0].contains('^'), "{made:?}");
}

/// A twist takes the transform behind its covariance; one end without a covariance is refused.
#[test]
fn a_twist_changes_its_frame_with_its_covariance() {
    let idsl = "module L { struct V { double x; double y; double z; }; struct W { double x; double y; double z; };
        struct S { @unit(\"ns\") long taken; V linear; W angular; double spread[36]; };
        interface Laser { void push(S speed); }; };";
    let of = |frames: &str, more: &str| {
        let part = |name: &str, meaning: &str, ty: &str| {
            format!(
                "dproto {name} :: geometry {{ semantic = {meaning} coord = cartesian algebraic = named
                     ddr = :: IDSL{{L::{ty}}} dr = {{ x = x, y = y, z = z }} axes = own }}\n"
            )
        };
        format!(
            "import \"Laser.idsl\";
             axes own :: {ROS}
             algebraic named :: Scalar{{x, y, z}}
             {}{}dproto speed :: geometry {{ semantic = Twist composes = {{ LinearVelocity = linear, AngularVelocity = angular }}
                 ddr = :: IDSL{{L::S}} dr = {{ linear = LinearVelocity, angular = AngularVelocity }}
                 frames = {{ {frames} }} {more} }}",
            part("linear", "LinearVelocity", "V"),
            part("angular", "AngularVelocity", "W")
        )
    };
    let sure = "covariance = { member spread }";
    let (imu, base) = (
        "with_respect_to = imu, stamp = member taken",
        "with_respect_to = base",
    );
    let made = |ours: &str| {
        let ours = format!("[{idsl}|||{ours}]subscribesTo Laser; requires InnerModel as tree;");
        let theirs = format!("[{idsl}|||{}]publishes Laser;", of(imu, sure));
        let all = [
            ("a", ours.as_str()),
            ("b", theirs.as_str()),
            ("w", "implements InnerModel;"),
        ];
        let binds =
            "bind a.Laser -> b.Laser { convert { frames tree; }; }; bind a.tree -> w.InnerModel;";
        crate::network::connected_flat(&all, binds)
    };
    let (connections, found) = made(&of(base, sure));
    assert_eq!(found, "");
    let made_one = &connections[0];
    assert!(
        made_one.contains("frames imu → base at member taken; "),
        "{made_one}"
    );
    // 6 numbers, 36 of the covariance, and the 12 of a transform.
    assert!(made_one.contains("0i^imu>base@0*1:{q?42d!|"), "{made_one}");
    assert!(made_one.contains("^11"), "{made_one}");
    let (_, found) = made(&of(base, ""));
    let reason = "error[no-conversion]: `a.Laser` expects `L::S` as Twist";
    assert!(
        found.contains(reason) && found.contains("the covariance would stay as it is"),
        "{found}"
    );
}

#[test]
fn frames_that_cannot_change_are_refused() {
    let map = "with_respect_to = map";
    let of = "with_respect_to = lidar, stamp = member header.stamp";
    moving(
        map,
        of,
        "convert;",
        &expect![[r#"
        n.ddsl:2:6: error[frame-mismatch]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, mm, right-ahead-up): the frames differ: `with_respect_to` is `lidar` and `map`, and no transform between them is known; the consumer's declaration at Laser.idsl:2:12; the provider's declaration at Laser.idsl:2:12 (a tree knows it, if a slot of the subscriber requires `RcInnerModel::InnerModel`; so do tf and its shared world: `bind a.Laser -> b.Laser { convert { frames SLOT; }; };`)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
    moving(
        map,
        of,
        "convert { frames trea; };",
        &expect![[r#"
        n.ddsl:2:44: error[unknown-slot]: `a` has no slot `trea`; its component at a.cdsl:2:11 (did you mean `tree`?)
    "#]],
    );
    // The tree of the worker is not a slot.
    let idsl = SCAN;
    let ours = format!(
        "[{idsl}|||{}]subscribesTo Laser; requires InnerModel as world;",
        scan("m", ROS, map)
    );
    let theirs = format!("[{idsl}|||{}]publishes Laser;", scan("mm", LIDAR, of));
    connect(
        &[
            ("a_viewer", &ours),
            ("b", &theirs),
            ("w", "implements InnerModel;"),
        ],
        "bind a_viewer.Laser -> b.Laser { convert { frames ctx; }; }; bind a_viewer.world -> w.InnerModel;",
        &expect![[r#"
            n.ddsl:2:51: error[unknown-slot]: `a_viewer` has no slot `ctx`; its component at a_viewer.cdsl:2:11 (a connection does not ask the tree that the component itself holds: let it require `RcInnerModel::InnerModel`, and bind this slot to a component that serves the tree, such as `inner_model`)
        "#]],
    );
    moving(
        map,
        of,
        "convert { frames Laser; };",
        &expect![[r#"
            n.ddsl:2:44: error[wrong-frames]: `a.Laser` does not know where frames are; declared here at a.cdsl:2:45 (name the component's world, or a slot that requires `RcInnerModel::InnerModel` or subscribes to `Transforms::TransformPub`, and is not an array)
        "#]],
    );
    moving(
        map,
        "with_respect_to = lidar",
        "convert { frames tree; };",
        &expect![[r#"
        n.ddsl:2:6: error[no-conversion]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, mm, right-ahead-up): `point` does not say when its values were measured; the consumer's declaration at Laser.idsl:2:12; the provider's declaration at Laser.idsl:2:12 (a change of frames is one at a time: `frames = { …, stamp = member NAME }`)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
    moving(
        map,
        "with_respect_to = lidar, stamp = member header.frame",
        "convert { frames tree; };",
        &expect![[r#"
        n.ddsl:2:27: error[not-convertible]: the `stamp` of `L::S` is not a time (name a number with `@unit` s, ms, us or ns, or a structure of seconds and nanoseconds)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
    moving(
        map,
        "with_respect_to = lidar, stamp = member maybe",
        "convert { frames tree; };",
        &expect![[r#"
        n.ddsl:2:27: error[not-convertible]: the frame or the `stamp` of `L::S` is not in every message once (name members that are neither optional nor in a sequence)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
    moving(
        "with_respect_to = \"a map\"",
        of,
        "convert { frames tree; };",
        &expect![[r#"
            n.ddsl:2:6: error[no-conversion]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, mm, right-ahead-up): a frame named `a map` cannot change; the consumer's declaration at Laser.idsl:2:12; the provider's declaration at Laser.idsl:2:12 (names of frames have letters, digits, `_`, `.`, `/` and `-`)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
    );
    moving(
        map,
        "with_respect_to = lidar, stamp = member short",
        "convert { frames tree; };",
        &expect![[r#"
            n.ddsl:2:27: error[not-convertible]: the `stamp` of `L::S` is not a time (name a number with `@unit` s, ms, us or ns, or a structure of seconds and nanoseconds)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
    );
    moving(
        "with_respect_to = lidar",
        of,
        "convert { frames tree; };",
        &expect![[r#"
        n.ddsl:2:44: warning[nothing-to-convert]: `frames` has no effect: no frame changes (remove it)
    "#]],
    );
    moving(
        map,
        of,
        "convert { tree; };",
        &expect![[r#"
        n.ddsl:2:6: error[frame-mismatch]: `a.Laser` expects `L::P` as Position (cartesian, m, ahead-left-up), but `b.Laser` sends it as Position (cartesian, mm, right-ahead-up): the frames differ: `with_respect_to` is `lidar` and `map`, and no transform between them is known; the consumer's declaration at Laser.idsl:2:12; the provider's declaration at Laser.idsl:2:12 (a tree knows it, if a slot of the subscriber requires `RcInnerModel::InnerModel`; so do tf and its shared world: `bind a.Laser -> b.Laser { convert { frames SLOT; }; };`)
        n.ddsl:2:37: error[unknown-field]: expected `frames`, found `tree` (expected `frames`)
        n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
    "#]],
    );
}

/// A connection between two components with a `Laser` each, of which the first one has a tree.
fn with_tree(ours: &str, theirs: &str, expected: &Expect) {
    let binds =
        "bind a.Laser -> b.Laser { convert { frames tree; }; }; bind a.tree -> w.InnerModel;";
    let all = [("a", ours), ("b", theirs), ("w", "implements InnerModel;")];
    connect(&all, binds, expected);
}

#[test]
fn calls_change_no_frames() {
    let idsl = SCAN.replace("void push(S scan)", "S get()");
    let map = scan("m", ROS, "with_respect_to = map");
    let lidar = "with_respect_to = lidar, stamp = member taken";
    let lidar = scan("mm", LIDAR, lidar);
    with_tree(
        &format!("[{idsl}|||{map}]requires Laser, InnerModel as tree;"),
        &format!("[{idsl}|||{lidar}]implements Laser;"),
        &expect![[r#"
            n.ddsl:2:44: error[wrong-frames]: `a.Laser` calls, and only samples change their frame; declared here at a.cdsl:2:41 (ask the tree in the component)
        "#]],
    );
}

#[test]
fn a_frame_in_a_message_that_travels_in_place_is_refused() {
    let idsl = "module L { struct P { float x; float y; float z; string<8> frame; sequence<float, 4> more; @unit(\"ns\") long taken; };
        interface Laser { void push(P point); }; };";
    let map = point("m", ROS, "frames = { with_respect_to = map }");
    let lidar = "frames = { with_respect_to = member frame, stamp = member taken }";
    let lidar = point("mm", LIDAR, lidar);
    with_tree(
        &format!("[{idsl}|||{map}]subscribesTo Laser; requires InnerModel as tree;"),
        &format!("[{idsl}|||{lidar}]publishes Laser;"),
        &expect![[r#"
            n.ddsl:2:27: error[not-convertible]: `L::P` travels in place, and its frame is a string in it (name the frame in the prototype, or let the string have no bound)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
    );
}

#[test]
fn a_tree_answers_what_a_change_of_frames_asks() {
    let map = scan("m", ROS, "with_respect_to = map");
    let lidar = "with_respect_to = lidar, stamp = member taken";
    let lidar = scan("mm", LIDAR, lidar);
    let ours = format!("[{SCAN}|||{map}]subscribesTo Laser; requires InnerModel as tree;");
    let theirs = format!("[{SCAN}|||{lidar}]publishes Laser;");
    connect(
        &[
            ("a_old", &ours),
            ("b", &theirs),
            ("w_old", "implements InnerModel;"),
        ],
        "bind a_old.Laser -> b.Laser { convert { frames tree; }; }; bind a_old.tree -> w_old.InnerModel;",
        &expect![[r#"
            n.ddsl:2:48: error[wrong-frames]: `a_old.tree` has no `getPoseAt` as this framework knows it; declared here at a_old.cdsl:2:65 (import the framework's `InnerModel.idsl`)
        "#]],
    );
}

#[test]
fn frames_change_by_the_transforms_of_slots() {
    let map = scan("m", ROS, "with_respect_to = map");
    let lidar = "with_respect_to = lidar, stamp = member taken";
    let lidar = scan("mm", LIDAR, lidar);
    let ours = format!(
        "[{SCAN}|||{map}]subscribesTo Laser, TransformPub as tf, TransformPub as fixed; requires InnerModel as tree;"
    );
    let theirs = format!("[{SCAN}|||{lidar}]publishes Laser;");
    let all = [
        ("a", &*ours),
        ("b", &*theirs),
        ("w", "publishes TransformPub; implements InnerModel;"),
    ];
    let binds = |frames: &str, process: &str| {
        format!("bind a.Laser -> b.Laser {{ convert {process} {{ frames {frames}; }}; }};")
    };
    let made = connect(&all, &binds("tf, fixed", ""), &expect![[""]]);
    assert!(
        made[0].contains("frames of") || made[0].contains("frames lidar → map"),
        "{made:?}"
    );
    let made = connect(&all, &binds("tf, fixed", "via process"), &expect![[""]]);
    expect![[r#"
        a.Laser -> a_Laser_adaptor.consumer
        a.tf -> w.TransformPub
        a.fixed -> w.TransformPub
        a.tree -> w.InnerModel
        a_Laser_adaptor.provider -> b.Laser
        a_Laser_adaptor.tf -> w.TransformPub
        a_Laser_adaptor.fixed -> w.TransformPub"#]]
    .assert_eq(
        &made
            .iter()
            .map(|one| one.split(" converts").next().unwrap_or_default())
            .collect::<Vec<_>>()
            .join("\n"),
    );
    connect(
        &all,
        &binds("tf, tree", ""),
        &expect![[r#"
        n.ddsl:2:49: error[wrong-frames]: `a.tree` is one of several slots; declared here at a.cdsl:2:104 (name one slot for a tree, or several ones that subscribe to `Transforms::TransformPub`)
    "#]],
    );
    let repeated = expect![[r#"
        n.ddsl:2:60: error[repeated-clause]: duplicate slot `tf`; first used here at n.ddsl:2:56
    "#]];
    connect(&all, &binds("tf, tf", "via process"), &repeated);
    connect(
        &all,
        &binds("tf, fixe", ""),
        &expect![[r#"
        n.ddsl:2:49: error[unknown-slot]: `a` has no slot `fixe`; its component at a.cdsl:2:11 (did you mean `fixed`?)
    "#]],
    );
}
