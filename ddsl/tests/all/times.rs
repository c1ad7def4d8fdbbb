//! Times in connections: values of their own, and those of changes of frames.

use crate::meanings::{LIDAR, ROS, SCAN, converted, scan};
use crate::network::made;
use expect_test::expect;
use rc_conversion::{Needed, Place, Plan, Program};

/// The program of a connection as [`converted`] writes it.
fn program(connection: &str) -> Program {
    let text = connection.rsplit_once(" by ").expect("a plan").1;
    let plan: Plan = text.parse().expect("a plan");
    plan.program(0, Place::Input).expect("a program")
}

/// A change of frames reads the time as it was sent; the consumer gets it in its own unit.
#[test]
fn the_time_of_a_change_may_have_another_unit() {
    let idsl = |unit: &str| SCAN.replace("@unit(\"ms\")", &format!("@unit(\"{unit}\")"));
    let map = scan("m", ROS, "with_respect_to = map");
    let lidar = scan("mm", LIDAR, "with_respect_to = lidar, stamp = member taken");
    let ours = format!(
        "[{}|||{map}]subscribesTo Laser; requires InnerModel as tree;",
        idsl("us")
    );
    let theirs = format!("[{}|||{lidar}]publishes Laser;", idsl("ms"));
    let all = [
        ("a", ours.as_str()),
        ("b", theirs.as_str()),
        ("w", "implements InnerModel;"),
    ];
    let binds =
        "bind a.Laser -> b.Laser { convert { frames tree; }; }; bind a.tree -> w.InnerModel;";
    let made = made(&all, binds).join("\n");
    assert!(made.contains("^lidar>map@0*1000000:iIsq?{1000}["), "{made}");
    assert!(made.contains("L::S.taken ms ×1000 = us"), "{made}");
    let program = program(made.lines().next().expect("a connection"));
    // The stamp, an empty frame, 7 ms, no points, no second stamp, and a short time.
    let mut bytes = vec![0_u8; 52];
    bytes[8] = 1;
    bytes[16..24].copy_from_slice(&7_i64.to_le_bytes());
    let needed = program.needed(&mut bytes, 0).expect("a transform");
    let time = 7_000_000;
    let (from, to) = ("lidar".to_owned(), "map");
    assert_eq!(needed, [Needed { from, to, time }]);
    let transform = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    program
        .run_with(&mut bytes, 0, &[transform])
        .expect("converted");
    assert_eq!(bytes[16..24], 7000_i64.to_le_bytes());
}

/// A prototype of `L::T`, whose numbers are these.
fn time(coordinate: &str, symbols: &str, places: &str, units: &str) -> String {
    format!(
        "import \"Laser.idsl\";
         algebraic named :: Scalar{{{symbols}}}
         units own :: qudt, named {{ {units} }}
         dproto time :: geometry {{ semantic = TimeStamp coord = {coordinate} algebraic = named
             ddr = :: IDSL{{L::T}} dr = {{ {places} }} units = own }}"
    )
}

/// Times mean something by their prototypes, in the places that both ends have.
#[test]
fn times_convert_between_units() {
    let idsl =
        "module L { struct T { long time; int more; }; interface Laser { void push(T t); }; };";
    let of = |unit: &str| {
        let units = format!("seconds = {unit}");
        time("seconds", "seconds", "time = seconds", &units)
    };
    let made = converted(idsl, ["subscribesTo", "publishes"], &of("us"), &of("s"));
    expect!["a.Laser -> b.Laser converts L::T units s ×1000000 = us; 2 operations a value; float64 of the input above 2^53, bounded: 1.1e-16 of the value; float64 of the output above 2^53, bounded: 1.1e-16 of the value; int64, bounded: 0.5 of its unit by 0i:{q!i|m@0&1e6;i$0;q$1&-9.223372036854776e18&9.223372036854775e18;=$2}"].assert_eq(&made);
    let mut bytes = [3_i64.to_le_bytes().as_slice(), &[0; 4]].concat();
    let program = program(&made);
    assert_eq!(program.run(&mut bytes, 0), Ok(12));
    assert_eq!(bytes[..8], 3_000_000_i64.to_le_bytes());
}

/// Seconds with a fraction at one end, and whole seconds with nanoseconds at the other one.
#[test]
fn times_convert_between_coordinates() {
    let idsl =
        "module L { struct T { double a; double b; }; interface Laser { void push(T t); }; };";
    let one = time("seconds", "seconds", "a = seconds", "seconds = s");
    let two = time(
        "seconds_nanoseconds",
        "seconds, nanoseconds",
        "a = seconds, b = nanoseconds",
        "seconds = s, nanoseconds = ns",
    );
    let made = converted(idsl, ["subscribesTo", "publishes"], &two, &one);
    expect!["a.Laser -> b.Laser converts L::T alias, coordinates seconds → seconds_nanoseconds; 7 operations a value; less than a nanosecond, bounded: 0.0000000005 of its unit by 0i:{2d!|f@0;s@0&$0;m$1&1e9;i$2;a$0&1e0;b$3&1e9&$0&$4;b$3&1e9&$3&0e0;=$5&$6}"].assert_eq(&made);
    let program = program(&made);
    let mut bytes: Vec<u8> = [12.25_f64, 0.0]
        .iter()
        .flat_map(|of| of.to_le_bytes())
        .collect();
    assert_eq!(program.run(&mut bytes, 0), Ok(16));
    let expected: Vec<u8> = [12.0_f64, 250_000_000.0]
        .iter()
        .flat_map(|of| of.to_le_bytes())
        .collect();
    assert_eq!(bytes, expected);
}

/// A time in a value with a meaning of its own is converted by its prototype.
#[test]
fn a_time_beside_other_values_converts() {
    let idsl =
        "module L { struct T { double time; }; struct P { float x; float y; float z; T taken; };
        interface Laser { void push(P p); }; };";
    let of = |unit: &str| {
        let units = format!("seconds = {unit}");
        time("seconds", "seconds", "time = seconds", &units)
    };
    let made = converted(idsl, ["subscribesTo", "publishes"], &of("ms"), &of("s"));
    expect!["a.Laser -> b.Laser converts L::T units s ×1000 = ms; 1 operation a value by 0i:3f{d!|m@0&1e3;=$0}"].assert_eq(&made);
    let mut bytes = [[0; 16].as_slice(), &2.5_f64.to_le_bytes()].concat();
    assert_eq!(program(&made).run(&mut bytes, 0), Ok(24));
    assert_eq!(bytes[16..], 2500_f64.to_le_bytes());
}
