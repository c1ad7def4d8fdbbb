//! Plans and refusals.

use crate::{library, samples};
use expect_test::{Expect, expect};
use rc_plans::{Bound, Network, Rejected};

#[track_caller]
fn check(text: &str, from: &str, to: &str, expected: &Expect) {
    let library = library(text);
    let plan = Network::new(&library).plan(from, to);
    expected.assert_eq(&match plan {
        Ok(plan) => plan.to_string(),
        Err(refusal) => format!("{}: {refusal}\n", refusal.code()),
    });
}

#[test]
fn a_plan_tells_type_distance_cost_and_loss() {
    let text = samples::text();
    check(
        &text,
        "scan",
        "point",
        &expect![[r#"
        scan -> point
        type      axes
        distance  1
        steps     point (alias, unit, axes)
        cost      5: 4 operations, 0 transcendental functions
        lost      rounding of float64 only
    "#]],
    );
    check(
        &text,
        "point",
        "scan",
        &expect![[r#"
            point -> scan
            type      axes
            distance  1
            steps     scan (alias, unit, axes)
            cost      1008: 7 operations, 0 transcendental functions
            lost      float32, in the range of float32, bounded: 6.0e-8 of the value
        "#]],
    );
    check(
        &text,
        "point",
        "cell",
        &expect![[r#"
        point -> cell
        type      axes
        distance  1
        steps     cell (alias, unit, axes)
        cost      1008: 7 operations, 0 transcendental functions
        lost      int16, bounded: 0.5 of its unit
    "#]],
    );
    check(
        &text,
        "turn",
        "real_first",
        &expect![[r#"
        turn -> real_first
        type      coordinate
        distance  1
        steps     real_first (axes, coordinate)
        cost      2: 1 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "#]],
    );
    check(
        &text,
        "turn",
        "rpy_degrees",
        &expect![[r#"
        turn -> rpy_degrees
        type      coordinate
        distance  1
        steps     rpy_degrees (alias, unit, coordinate)
        cost      180: 59 operations, 6 transcendental functions
        lost      rounding of float64 only
    "#]],
    );
    check(
        &text,
        "pose",
        "small_pose",
        &expect![[r#"
        pose -> small_pose
        type      composition
        distance  1
        steps     small_pose (alias, unit, axes, coordinate, composition)
        cost      184: 63 operations, 6 transcendental functions
        lost      rounding of float64 only
    "#]],
    );
    check(
        &text,
        "columns",
        "rows",
        &expect![[r#"
            columns -> rows
            type      coordinate
            distance  1
            steps     rows (axes, coordinate)
            cost      61: 60 operations, 0 transcendental functions
            lost      nothing: the plan is exact
        "#]],
    );
    check(
        &text,
        "turn",
        "turn",
        &expect![[r#"
        turn -> turn
        type      plain
        distance  0
        cost      0: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "#]],
    );
}

/// What has no plan is refused with the reason.
#[test]
fn refusals_name_their_reason() {
    let head = "algebraic named :: Scalar{x, y, z}
algebraic flat :: Scalar{x, y}
axes ros :: ahead, left, up
algebraic one :: Vector{1}
algebraic other :: Scalar{a}
domain soil :: { semantic = { Moisture } coord = { percent, grams } }
";
    let leaf = |name: &str, semantic: &str, more: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = {semantic} coord = cartesian algebraic = named \
             ddr = :: c99{{double[3]}} dr = {{ 0 = x, 1 = y, 2 = z }} {more} }}\n"
        )
    };
    let soil = |name: &str, coordinate: &str, algebraic: &str, value: &str| {
        format!(
            "dproto {name} :: soil {{ semantic = Moisture coord = {coordinate} algebraic = {algebraic} \
             ddr = :: c99{{double}} dr = {{ 0 = {value} }} }}\n"
        )
    };
    let flat = "dproto flat :: geometry { semantic = Position coord = cartesian algebraic = flat \
                ddr = :: c99{float[2]} dr = { 0 = x, 1 = y } }\n";
    let narrow = "dproto narrow :: geometry { semantic = Position coord = cartesian algebraic = named \
                  ddr = :: c99{float[3]} dr = { 0 = x, 1 = y, 2 = z } loss = 1e-9 }\n";
    let text = [
        head,
        &leaf(
            "here",
            "Position",
            "frames = { of = hand, with_respect_to = map }",
        ),
        &leaf(
            "there",
            "Position",
            "frames = { of = hand, with_respect_to = odom }",
        ),
        &leaf(
            "sent",
            "Position",
            "frames = { of = hand, with_respect_to = member frame }",
        ),
        &leaf("many", "Position", "sequence = member points"),
        narrow,
        &leaf("speed", "LinearVelocity", ""),
        flat,
        &soil("wet", "percent", "one", "0"),
        &soil("damp", "percent", "other", "a"),
        &soil("heavy", "grams", "one", "0"),
    ]
    .concat();
    let reason = |from: &str, to: &str, expected: Expect| check(&text, from, to, &expected);
    reason(
        "here",
        "there",
        expect![[r#"
        frame-mismatch: the frames differ: `with_respect_to` is `map` and `odom`, and no transform between them is known
    "#]],
    );
    reason(
        "here",
        "sent",
        expect![[r#"
        here -> sent
        type      plain
        distance  1
        steps     sent (plain)
        cost      1: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "#]],
    );
    reason(
        "here",
        "many",
        expect![[r#"
        no-conversion: one holds a sequence of values, the other one a value
    "#]],
    );
    reason(
        "here",
        "narrow",
        expect![[r"
            conversion-loses: the plan loses more than 1e-9: 6.0e-8 of the value
        "]],
    );
    reason(
        "here",
        "speed",
        expect![[r#"
        semantic-mismatch: the meanings differ: Position and LinearVelocity
    "#]],
    );
    reason(
        "flat",
        "here",
        expect![[r#"
        no-conversion: the first one has no value `z`
    "#]],
    );
    reason(
        "here",
        "flat",
        expect![[r#"
            here -> flat
            type      alias
            distance  1
            steps     flat (alias)
            cost      1001003: 2 operations, 0 transcendental functions
            lost      float32, in the range of float32, bounded: 6.0e-8 of the value
                      z is not kept, not bounded
        "#]],
    );
    reason(
        "wet",
        "damp",
        expect![[r#"
        no-conversion: no alias and no conversion leads from one to the other
    "#]],
    );
    reason(
        "wet",
        "heavy",
        expect![[r#"
        no-conversion: no alias and no conversion leads from one to the other
    "#]],
    );
    reason(
        "here",
        "nowhere",
        expect![[r#"
        unknown-prototype: unknown prototype `nowhere`
    "#]],
    );
}

/// A plan over others, with a function of the user; and the same whatever the order of the file.
#[test]
fn a_plan_may_lead_over_other_prototypes() {
    let lines = [
        "domain soil :: { semantic = { Moisture } coord = { percent, grams } }",
        "algebraic a :: Scalar{a}",
        "algebraic b :: Scalar{b}",
        "algebraic c :: Scalar{c}",
        "alias a <-> b { a = b }",
        "alias b <-> c { b = c }",
        "dproto first :: soil { semantic = Moisture coord = percent algebraic = a ddr = :: c99{double} dr = { 0 = a } }",
        "dproto second :: soil { semantic = Moisture coord = percent algebraic = b ddr = :: c99{float} dr = { 0 = b } }",
        "dproto alike :: soil { semantic = Moisture coord = percent algebraic = b ddr = :: c99{float} dr = { 0 = b } }",
        "dproto third :: soil { semantic = Moisture coord = percent algebraic = c ddr = :: c99{float} dr = { 0 = c } }",
        "dproto weighed :: soil { semantic = Moisture coord = grams algebraic = c ddr = :: c99{double} dr = { 0 = c } }",
        "conversion third -> weighed = weigh",
        "fproto weigh :: c99 { library = \"scales\" }",
    ];
    let expected = expect![[r#"
        first -> weighed
        type      conversion
        distance  3
        steps     alike (alias)
                  third (alias)
                  weighed (conversion)
        cost      1001104: 1 operations, 0 transcendental functions, 1 functions of the user
        lost      float32, in the range of float32, not bounded
                  what `weigh` loses, not bounded
    "#]];
    check(&lines.join("\n"), "first", "weighed", &expected);
    let reversed: Vec<&str> = lines.into_iter().rev().collect();
    let reversed = library(&reversed.join("\n"));
    let library = library(&lines.join("\n"));
    let network = Network::new(&library);
    let plan = network.plan("first", "weighed").expect("a plan");
    let other = Network::new(&reversed).plan("first", "weighed");
    assert_eq!(other.as_ref(), Ok(&plan));
    let rejected = Err(Rejected::Function("weigh".to_owned()));
    assert_eq!(plan.program.run(&[1.0]), rejected);
    let plan = network.plan("first", "third").expect("a plan");
    assert_eq!(plan.program.run(&[0.1]), Ok(vec![f64::from(0.1_f32)]));
}

/// Composites whose parts convert over other prototypes only.
#[test]
fn parts_have_plans_of_their_own() {
    let text = "domain soil :: { semantic = { Moisture, Sample } coord = { percent } }
algebraic a :: Scalar{a}
algebraic b :: Scalar{b}
algebraic c :: Scalar{c}
alias a <-> b { a = b }
alias b <-> c { b = c }
dproto first :: soil { semantic = Moisture coord = percent algebraic = a ddr = :: c99{double} dr = { 0 = a } }
dproto second :: soil { semantic = Moisture coord = percent algebraic = b ddr = :: c99{double} dr = { 0 = b } }
dproto third :: soil { semantic = Moisture coord = percent algebraic = c ddr = :: c99{double} dr = { 0 = c } }
dproto one :: soil { semantic = Sample composes = { Moisture = first } }
dproto other :: soil { semantic = Sample composes = { Moisture = third } }
";
    check(
        text,
        "one",
        "other",
        &expect![[r#"
        one -> other
        type      composition
        distance  1
        steps     other (alias, composition)
        cost      1: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "#]],
    );
}

/// A plan that says that it is exact keeps all bits, there and back.
#[test]
fn exact_plans_keep_all_bits() {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let mut exact = 0;
    for one in &library.prototypes {
        for other in &library.prototypes {
            let Ok(there) = network.plan(&one.name, &other.name) else {
                continue;
            };
            let back = network.plan(&other.name, &one.name);
            let Some(back) = back.ok().filter(|back| back.program.is_exact()) else {
                continue;
            };
            if !there.program.is_exact() {
                continue;
            }
            exact += 1;
            for sample in samples::samples(&network, &library, &one.name) {
                let converted = there.program.run(&sample).expect("in range");
                let again = back.program.run(&converted).expect("in range");
                let bits =
                    |numbers: &[f64]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&sample), bits(&again), "{there}");
            }
        }
    }
    assert!(exact > 20, "{exact}");
}

/// Numbers that are not a rotation, and integers that do not fit, are refused.
#[test]
fn bad_values_are_refused() {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let refused = |from: &str, to: &str, input: &[f64]| {
        let plan = network.plan(from, to).expect("a plan");
        let outcome = plan.program.run(input);
        assert!(
            matches!(outcome, Err(Rejected::Value { .. })),
            "{input:?}: {outcome:?}"
        );
    };
    for quaternion in [[0.0; 4], [0.0, 0.0, 0.0, 1.2], [f64::NAN, 0.0, 0.0, 1.0]] {
        refused("turn", "matrix", &quaternion);
    }
    refused("axis", "turn", &[0.0, 0.0, 2.0, 1.0]);
    // A matrix that mirrors.
    refused(
        "matrix",
        "turn",
        &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0],
    );
    refused("point", "cell", &[33.0, 0.0, 0.0]);
    refused("point", "cell", &[f64::NAN, 0.0, 0.0]);
    let plan = network.plan("point", "cell").expect("a plan");
    assert_eq!(
        plan.program.run(&[0.0015, -0.0025, 0.003]),
        Ok(vec![3.0, 3.0, 2.0])
    );
    assert_eq!(plan.program.run(&[0.0]), Err(Rejected::Count));
}

/// `tolerance` is how far a length may be from 1; without one, 0.001.
#[test]
fn a_length_may_differ_by_the_tolerance() {
    let turn = |name: &str, coordinate: &str, more: &str| {
        format!(
            "dproto {name} :: geometry {{ semantic = Orientation coord = {coordinate} algebraic = v4 \
             ddr = :: c99{{double[4]}} dr = {{ 0 = 0, 1 = 1, 2 = 2, 3 = 3 }} {more} }}\n"
        )
    };
    let text = [
        "algebraic v4 :: Vector{4}\n".to_owned(),
        turn("strict", "quaternion", ""),
        turn("lenient", "quaternion", "tolerance = 0.25"),
        turn("to", "axis_angle", ""),
    ];
    let library = library(&text.concat());
    let network = Network::new(&library);
    for (name, length, is_allowed) in [
        ("strict", 1.0005, true),
        ("strict", 1.0015, false),
        ("strict", 0.9985, false),
        ("lenient", 1.2, true),
        ("lenient", 0.8, true),
        ("lenient", 1.3, false),
        ("lenient", 0.0, false),
    ] {
        let plan = network.plan(name, "to").expect("a plan");
        let outcome = plan.program.run(&[0.0, 0.6 * length, 0.0, 0.8 * length]);
        assert_eq!(outcome.is_ok(), is_allowed, "{name} {length}: {outcome:?}");
        if let Ok(found) = outcome {
            // The length means nothing.
            let angle = 2.0 * 0.6_f64.asin();
            assert!((found[3] - angle).abs() < 1e-12, "{found:?}");
        }
    }
}

/// Prototypes with the same numbers, and functions between them in circles: each step costs something, so
/// no circle is a way.
#[test]
fn circles_of_conversions_end() {
    let mut text = String::from(
        "algebraic v1 :: Vector{1}\ndomain own :: { semantic = { S } coord = { c, d } }\n",
    );
    for at in 0..30 {
        let coordinate = if at < 15 { "c" } else { "d" };
        text += &format!(
            "dproto p{at} :: own {{ semantic = S coord = {coordinate} algebraic = v1 ddr = :: c99{{double[1]}} dr = {{ 0 = 0 }} }}\n"
        );
        text += &format!("conversion p{at} -> p{} = around\n", (at + 1) % 30);
    }
    let library = library(&text);
    let network = Network::new(&library);
    let (mut plain, mut called) = (0, 0);
    for (from, to, cost) in network.edges() {
        assert!(cost > 0, "{from} {to}");
    }
    for one in &library.prototypes {
        for other in &library.prototypes {
            let plan = network.plan(&one.name, &other.name).expect("a plan");
            let steps = plan.distance();
            assert!(steps <= 3, "{plan}");
            plain += usize::from(steps == 1);
            called += usize::from(plan.cost.total() >= 100);
        }
    }
    assert!(plain > 400 && called == 450, "{plain} {called}");
}

#[track_caller]
fn converts(network: &Network<'_>, from: &str, to: &str, input: &[f64], expected: &[f64]) {
    let plan = network.plan(from, to).expect("a plan");
    let found = plan.program.run(input).expect("in range");
    assert_eq!(found.len(), expected.len());
    for (own, other) in found.iter().zip(expected) {
        assert!(
            (own - other).abs() < 1e-12,
            "{found:?} {expected:?}\n{plan}"
        );
    }
}

/// Values by hand: 1 m ahead, 2 m to the left and 3 m up, and a quarter turn to the left.
#[test]
fn a_place_stays_where_it_is_and_a_turn_what_it_is() {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let quarter = std::f64::consts::FRAC_PI_2;
    let check = |from: &str, to: &str, input: &[f64], expected: &[f64]| {
        converts(&network, from, to, input, expected);
    };
    let point = [1.0, 2.0, 3.0];
    check("point", "scan", &point, &[-2000.0, 1000.0, 3000.0]);
    check("point", "small", &point, &[-2000.0, 3000.0, 1000.0]);
    check("small", "point", &[-2000.0, 3000.0, 1000.0], &point);
    let (distance, in_plane) = (14_f64.sqrt(), 5_f64.sqrt());
    let (azimuth, elevation) = (2_f64.atan2(1.0), 3_f64.atan2(in_plane));
    check("point", "round", &point, &[distance, azimuth, elevation]);
    // The axes x and y of the tube are right and ahead.
    check(
        "round",
        "tube",
        &[distance, azimuth, elevation],
        &[in_plane, 1_f64.atan2(-2.0), 3.0],
    );

    let left = [0.0, 0.0, half, half];
    check("turn", "rpy_degrees", &left, &[0.0, 0.0, 90.0]);
    check("turn", "vector", &left, &[0.0, 0.0, quarter]);
    check("turn", "real_first", &left, &[half, 0.0, 0.0, half]);
    // To the left is from right (x) to back (-z) to left, seen by axes right, up, ahead.
    let seen = [0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0];
    check("turn", "mirrored", &left, &seen);
    check("mirrored", "turn", &seen, &left);
    // A velocity about the axis up; its sense differs in left-handed axes.
    check("spin", "spin_degrees", &[0.0, 0.0, 1.0], &[0.0, -1.0, 0.0]);

    let pose = [&point[..], &left].concat();
    check(
        "pose",
        "small_pose",
        &pose,
        &[0.0, 0.0, 90.0, -2000.0, 3000.0, 1000.0],
    );
    let columns = [
        0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0,
    ];
    check("pose", "columns", &pose, &columns);
    check("columns", "pose", &columns, &pose);
    // Row vectors, and the axes right, ahead, up.
    let rows = [
        0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -2.0, 1.0, 3.0, 1.0,
    ];
    check("pose", "rows", &pose, &rows);
    check("rows", "columns", &rows, &columns);

    check("stamp", "parts_of_stamp", &[1.75], &[1.0, 750_000_000.0]);
    check("stamp", "parts_of_stamp", &[-0.25], &[-1.0, 750_000_000.0]);
    check("stamp", "parts_of_stamp", &[1.999_999_999_9], &[2.0, 0.0]);
    check("parts_of_stamp", "stamp", &[1.0, 750_000_000.0], &[1.75]);
}

/// There and back is the same, but for what the plans say that they lose.
#[test]
fn there_and_back_is_the_same_within_the_loss() {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let mut count = 0;
    for one in &library.prototypes {
        let canonical = match one.semantic.as_str() {
            "Orientation" => "matrix",
            "Pose" => "columns",
            other => samples::source(other),
        };
        let to_canonical = network.plan(&one.name, canonical).expect("a plan").program;
        for other in &library.prototypes {
            let (Ok(there), Ok(back)) = (
                network.plan(&one.name, &other.name),
                network.plan(&other.name, &one.name),
            ) else {
                continue;
            };
            let bounds = there
                .lost
                .iter()
                .chain(&back.lost)
                .map(|loss| match loss.bound {
                    Bound::Relative(part) => part * 10.0,
                    // Half a millimetre, seen in metres; or a part of a second.
                    Bound::Absolute(_) => 2e-3,
                    Bound::None => f64::INFINITY,
                });
            let limit = 1e-11 + bounds.sum::<f64>();
            for sample in samples::samples(&network, &library, &one.name) {
                let converted = there.program.run(&sample).expect("in range");
                let again = back.program.run(&converted).expect("in range");
                let own = to_canonical.run(&sample).expect("in range");
                let other = to_canonical.run(&again).expect("in range");
                for (own, other) in own.iter().zip(&other) {
                    let error = (own - other).abs() / own.abs().max(1.0);
                    assert!(error <= limit, "{sample:?} {again:?}\n{there}{back}");
                }
                count += 1;
            }
        }
    }
    assert!(count > 30_000, "{count}");
}

/// Prototypes with and without axes: leaves, and poses in both forms.
fn with_axes() -> (String, [Vec<&'static str>; 3]) {
    let head = "axes body :: ahead, left, up
axes camera :: right, down, ahead
algebraic v3 :: Vector{3}
algebraic v4 :: Vector{4}
algebraic v16 :: Vector{16}
";
    let leaf = |name: &str, meaning: &str, coordinate: &str, count: usize, axes: &str| {
        let places: Vec<String> = (0..count).map(|at| format!("{at} = {at}")).collect();
        format!(
            "dproto {name} :: geometry {{ semantic = {meaning} coord = {coordinate} \
             algebraic = v{count} ddr = :: c99{{double[{count}]}} dr = {{ {} }} {axes} }}\n",
            places.join(", ")
        )
    };
    let mut text = head.to_owned();
    for (of, axes) in [
        ("body", "axes = body"),
        ("camera", "axes = camera"),
        ("plain", ""),
        ("bare", ""),
    ] {
        text += &leaf(&format!("{of}_at"), "Position", "cartesian", 3, axes);
        text += &leaf(&format!("{of}_turn"), "Orientation", "quaternion", 4, axes);
        text += &format!(
            "dproto {of}_pose :: geometry {{ semantic = Pose \
             composes = {{ Position = {of}_at, Orientation = {of}_turn }} }}\n"
        );
    }
    text += &leaf(
        "body_matrix",
        "Pose",
        "homogeneous_transformation",
        16,
        "axes = body",
    );
    text += &leaf("plain_matrix", "Pose", "homogeneous_transformation", 16, "");
    text += "dproto mixed_pose :: geometry { semantic = Pose \
             composes = { Position = camera_at, Orientation = plain_turn } }\n";
    let families = [
        vec!["body_at", "camera_at", "plain_at", "bare_at"],
        vec!["body_turn", "camera_turn", "plain_turn", "bare_turn"],
        vec![
            "body_pose",
            "camera_pose",
            "plain_pose",
            "bare_pose",
            "mixed_pose",
            "body_matrix",
            "plain_matrix",
        ],
    ];
    (text, families)
}

/// A plan over a third prototype gives the numbers of the direct step: no axes are lost on the way.
#[test]
fn plans_keep_axes_as_the_direct_step_does() {
    let (text, families) = with_axes();
    let all = library(&text);
    let only = |names: &[&str]| {
        let mut some = all.clone();
        some.prototypes.retain(|one| {
            let is_part = one.semantic != "Pose" && !names[0].ends_with("_at");
            names.contains(&one.name.as_str()) || is_part && !names[0].ends_with("_turn")
        });
        some
    };
    let turn = [0.5, -0.1, 0.7, 0.5];
    let matrix = [
        0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0,
    ];
    let mut compared = 0;
    for family in &families {
        for from in family {
            let input: Vec<f64> = match *from {
                name if name.ends_with("_at") => vec![1.0, 2.0, 3.0],
                name if name.ends_with("_turn") => turn.to_vec(),
                name if name.ends_with("_matrix") => matrix.to_vec(),
                _ => [&[1.0, 2.0, 3.0][..], &turn].concat(),
            };
            for to in family.iter().filter(|to| *to != from) {
                let two = only(&[from, to]);
                let direct = Network::new(&two).plan(from, to).expect("a plan");
                assert_eq!(direct.distance(), 1, "{direct}");
                let expected = direct.program.run(&input).expect("in range");
                for third in family {
                    let three = only(&[from, to, third]);
                    let plan = Network::new(&three).plan(from, to).expect("a plan");
                    let numbers = plan.program.run(&input).expect("in range");
                    for (one, other) in numbers.iter().zip(&expected) {
                        assert!(
                            (one - other).abs() < 1e-12,
                            "{numbers:?} {expected:?}\n{plan}"
                        );
                    }
                    compared += 1;
                }
            }
        }
    }
    assert_eq!(compared, 2 * 4 * 3 * 4 + 7 * 6 * 7);
    let network = Network::new(&all);
    let plan = network.plan("body_at", "camera_at").expect("a plan");
    assert_eq!(
        plan.program.run(&[1.0, 2.0, 3.0]),
        Ok(vec![-2.0, -3.0, 1.0])
    );
    check(
        &text,
        "body_at",
        "plain_at",
        &expect![[r#"
        body_at -> plain_at
        type      plain
        distance  1
        steps     plain_at (plain)
        cost      1: 0 operations, 0 transcendental functions
        note      `plain_at` has no axes: they are taken as those of `body_at`
        lost      nothing: the plan is exact
    "#]],
    );
}

/// Frames, sequences, covariances and losses of parts count as those of the whole; parts that are
/// not kept are lost.
#[test]
fn parts_are_compared_as_the_whole_is() {
    let mut text = String::from(
        "algebraic v3 :: Vector{3}
algebraic v4 :: Vector{4}
algebraic v16 :: Vector{16}
algebraic one :: Vector{1}
domain soil :: { semantic = { Moisture, Salt, Sample } coord = { percent } }
dproto wet :: soil { semantic = Moisture coord = percent algebraic = one ddr = :: c99{double} dr = { 0 = 0 } }
dproto salt :: soil { semantic = Salt coord = percent algebraic = one ddr = :: c99{double} dr = { 0 = 0 } }
dproto both :: soil { semantic = Sample composes = { Moisture = wet, Salt = salt } }
dproto less :: soil { semantic = Sample composes = { Moisture = wet } }
dproto turn :: geometry { semantic = Orientation coord = quaternion algebraic = v4 ddr = :: c99{double[4]} dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3 } }
",
    );
    let mut put = |name: &str, number: &str, more: &str, whole: &str| {
        text += &format!(
            "dproto {name} :: geometry {{ semantic = Position coord = cartesian algebraic = v3 \
             ddr = :: c99{{{number}[3]}} dr = {{ 0 = 0, 1 = 1, 2 = 2 }} {more} }}
dproto {name}_pose :: geometry {{ semantic = Pose \
             composes = {{ Position = {name}, Orientation = turn }} {whole} }}\n"
        );
    };
    put(
        "here",
        "double",
        "frames = { of = hand, with_respect_to = map }",
        "",
    );
    put(
        "there",
        "double",
        "frames = { of = hand, with_respect_to = odom }",
        "",
    );
    put(
        "whole",
        "double",
        "",
        "frames = { of = hand, with_respect_to = odom }",
    );
    put("many", "double", "sequence = member points", "");
    put("sure", "double", "covariance = { member covariance }", "");
    put("narrow", "float", "loss = 1e-9", "");
    text += "dproto rows :: geometry { semantic = Pose coord = homogeneous_transformation \
             algebraic = v16 ddr = :: c99{double[16]} dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3, 4 = 4, \
             5 = 5, 6 = 6, 7 = 7, 8 = 8, 9 = 9, 10 = 10, 11 = 11, 12 = 12, 13 = 13, 14 = 14, \
             15 = 15 } frames = { of = hand, with_respect_to = odom } }\n";
    let reason = |from: &str, to: &str, expected: Expect| check(&text, from, to, &expected);
    reason(
        "here_pose",
        "there_pose",
        expect![[r#"
        frame-mismatch: the frames differ: `with_respect_to` is `map` and `odom`, and no transform between them is known
    "#]],
    );
    reason(
        "here_pose",
        "whole_pose",
        expect![[r#"
        frame-mismatch: the frames differ: `with_respect_to` is `map` and `odom`, and no transform between them is known
    "#]],
    );
    reason(
        "here_pose",
        "rows",
        expect![[r#"
        frame-mismatch: the frames differ: `with_respect_to` is `map` and `odom`, and no transform between them is known
    "#]],
    );
    reason(
        "there_pose",
        "whole_pose",
        expect![[r#"
        there_pose -> whole_pose
        type      composition
        distance  1
        steps     whole_pose (composition)
        cost      1: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "#]],
    );
    reason(
        "here_pose",
        "many_pose",
        expect![[r#"
        no-conversion: one holds a sequence of values, the other one a value
    "#]],
    );
    reason(
        "here_pose",
        "sure_pose",
        expect![[r#"
        here_pose -> sure_pose
        type      composition
        distance  1
        steps     sure_pose (composition)
        cost      1000001: 0 operations, 0 transcendental functions
        lost      the covariance of `Position` is not converted, not bounded
    "#]],
    );
    reason(
        "here_pose",
        "narrow_pose",
        expect![[r#"
        conversion-loses: the plan loses more than 1e-9: 6.0e-8 of the value
    "#]],
    );
    reason(
        "both",
        "less",
        expect![[r#"
        both -> less
        type      composition
        distance  1
        steps     less (composition)
        cost      1000001: 0 operations, 0 transcendental functions
        lost      `Salt` is not kept, not bounded
    "#]],
    );
    reason(
        "less",
        "both",
        expect![[r#"
        no-conversion: the first one has no value `Salt`
    "#]],
    );
}

/// An offset makes a small part of a great number a great part of a small one.
#[test]
fn a_relative_bound_ends_where_a_step_does_more_than_scale() {
    let mut text = String::from(
        "domain heat :: { semantic = { Temperature } coord = { level } }
algebraic a :: Scalar{a}
algebraic b :: Scalar{b}
algebraic c :: Scalar{c}
alias a <-> b { a = b }
alias b <-> c { b = c }
",
    );
    let units = [("K", "kelvin"), ("degC", "celsius"), ("mK", "milli")];
    for of in ["a", "b", "c"] {
        for (unit, name) in units {
            text += &format!("units {name}_{of} :: qudt, {of} {{ {of} = {unit} }}\n");
        }
    }
    let mut put = |name: &str, of: &str, number: &str, units: &str| {
        text += &format!(
            "dproto {name} :: heat {{ semantic = Temperature coord = level algebraic = {of} \
             ddr = :: c99{{{number}}} dr = {{ 0 = {of} }} units = {units}_{of} }}\n"
        );
    };
    put("kelvin", "a", "double", "kelvin");
    put("narrow", "b", "float", "kelvin");
    put("celsius", "c", "double", "celsius");
    put("milli", "c", "double", "milli");
    put("milli_narrow", "c", "float", "milli");
    check(
        &text,
        "kelvin",
        "celsius",
        &expect![[r#"
        kelvin -> celsius
        type      unit
        distance  2
        steps     narrow (alias)
                  celsius (alias, unit)
        cost      1004: 2 operations, 0 transcendental functions
        lost      float32, in the range of float32, not bounded
    "#]],
    );
    check(
        &text,
        "kelvin",
        "milli",
        &expect![[r#"
        kelvin -> milli
        type      unit
        distance  2
        steps     narrow (alias)
                  milli (alias, unit)
        cost      1004: 2 operations, 0 transcendental functions
        lost      float32, in the range of float32, bounded: 6.0e-8 of the value
    "#]],
    );
    check(
        &text,
        "kelvin",
        "milli_narrow",
        &expect![[r#"
        kelvin -> milli_narrow
        type      unit
        distance  2
        steps     narrow (alias)
                  milli_narrow (alias, unit)
        cost      2005: 3 operations, 0 transcendental functions
        lost      float32, in the range of float32, bounded: 6.0e-8 of the value
                  float32, in the range of float32, bounded: 6.0e-8 of the value
    "#]],
    );
}

/// Matrices that shear or stretch, and those whose last row is not 0, 0, 0, 1, are not rotations.
#[test]
fn matrices_that_shear_are_refused() {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let turn = network.plan("matrix", "turn").expect("a plan");
    let pose = network.plan("columns", "pose").expect("a plan");
    let of = |m: [f64; 9], last: [f64; 4]| {
        let rows = m.chunks(3).flat_map(|row| [row[0], row[1], row[2], 5.0]);
        rows.chain(last).collect::<Vec<f64>>()
    };
    let last = [0.0, 0.0, 0.0, 1.0];
    let still = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    assert!(turn.program.run(&still).is_ok());
    assert!(pose.program.run(&of(still, last)).is_ok());
    for bad in [
        [1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.3, 1.0],
        [2.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0],
    ] {
        let outcomes = [turn.program.run(&bad), pose.program.run(&of(bad, last))];
        for outcome in outcomes {
            assert!(
                matches!(outcome, Err(Rejected::Value { .. })),
                "{outcome:?}"
            );
        }
    }
    for bad in [[0.1, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 2.0]] {
        let outcome = pose.program.run(&of(still, bad));
        assert!(
            matches!(outcome, Err(Rejected::Value { .. })),
            "{outcome:?}"
        );
    }
}

/// The functions take and give float64, which has no integers above 2^53; and a time has no less
/// than a nanosecond.
#[test]
fn numbers_that_float64_does_not_have_are_lost() {
    let mut text = String::from(
        "algebraic v1 :: Vector{1}
algebraic v2 :: Vector{2}
dproto seconds :: geometry { semantic = TimeStamp coord = seconds algebraic = v1 ddr = :: c99{double} dr = { 0 = 0 } }
dproto stamp :: geometry { semantic = TimeStamp coord = seconds_nanoseconds algebraic = v2 ddr = :: c99{double[2]} dr = { 0 = 0, 1 = 1 } }
",
    );
    for (name, ty) in [
        ("wide", "int64_t"),
        ("other", "int64_t"),
        ("short", "int32_t"),
        ("brief", "int32_t"),
    ] {
        text += &format!(
            "dproto {name} :: geometry {{ semantic = Range coord = distance algebraic = v1 \
             ddr = :: c99{{{ty}}} dr = {{ 0 = 0 }} }}\n"
        );
    }
    check(
        &text,
        "wide",
        "other",
        &expect![[r#"
        wide -> other
        type      plain
        distance  1
        steps     other (plain)
        cost      2001: 0 operations, 0 transcendental functions
        lost      float64 of the input above 2^53, bounded: 1.1e-16 of the value
                  float64 of the output above 2^53, bounded: 1.1e-16 of the value
    "#]],
    );
    check(
        &text,
        "short",
        "brief",
        &expect![[r#"
        short -> brief
        type      plain
        distance  1
        steps     brief (plain)
        cost      1: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "#]],
    );
    check(
        &text,
        "seconds",
        "stamp",
        &expect![[r#"
        seconds -> stamp
        type      coordinate
        distance  1
        steps     stamp (alias, coordinate)
        cost      1008: 7 operations, 0 transcendental functions
        lost      less than a nanosecond, bounded: 0.0000000005 of its unit
    "#]],
    );
}

/// Names that printed code has for something else are not functions of a user.
#[test]
fn functions_with_names_of_the_printed_code_are_refused() {
    for (function, is_allowed) in [
        ("weigh", true),
        ("verify", true),
        ("v1", false),
        ("sqrt", false),
        ("sqrtf", false),
        ("lambda", false),
        ("_divide", false),
        ("one_to_other", false),
    ] {
        let text = format!(
            "domain soil :: {{ semantic = {{ Moisture }} coord = {{ percent, grams }} }}
algebraic a :: Scalar{{a}}
dproto one :: soil {{ semantic = Moisture coord = percent algebraic = a ddr = :: c99{{double}} dr = {{ 0 = a }} }}
dproto other :: soil {{ semantic = Moisture coord = grams algebraic = a ddr = :: c99{{double}} dr = {{ 0 = a }} }}
conversion one -> other = {function}
fproto {function} :: c99 {{ library = \"scales\" }}
"
        );
        let library = library(&text);
        let plan = Network::new(&library).plan("one", "other");
        assert_eq!(plan.is_ok(), is_allowed, "{function}: {plan:?}");
    }
}

/// A norm of 0 within the tolerance would give no number.
#[test]
fn a_tolerance_is_below_one() {
    for (tolerance, is_allowed) in [("0.5", true), ("1", false), ("2.5", false)] {
        let text = format!(
            "algebraic v4 :: Vector{{4}}
dproto turn :: geometry {{ semantic = Orientation coord = quaternion algebraic = v4 ddr = :: c99{{double[4]}} dr = {{ 0 = 0, 1 = 1, 2 = 2, 3 = 3 }} tolerance = {tolerance} }}
"
        );
        let mut sources = rc_diagnostics::SourceMap::new();
        let source = sources.add("a.dproto", text);
        let loader = rc_syntax::MemoryLoader::new([("Lidar.idsl", crate::LIDAR)]);
        let (_, found) = rc_prototypes::load(&mut sources, &loader, &[source]);
        let found = rc_diagnostics::render(&sources, &found, rc_diagnostics::Format::Short);
        assert_eq!(!found.contains("error["), is_allowed, "{found}");
        assert!(
            is_allowed || found.contains("error[wrong-value]"),
            "{found}"
        );
    }
}

/// Composites of composites have twice as many numbers at each level.
#[test]
fn composites_with_too_many_numbers_are_refused() {
    let mut text = String::from(
        "domain soil :: { semantic = { A, B } coord = { percent } }
algebraic a :: Scalar{a}
dproto a0 :: soil { semantic = A coord = percent algebraic = a ddr = :: c99{double} dr = { 0 = a } }
dproto b0 :: soil { semantic = B coord = percent algebraic = a ddr = :: c99{double} dr = { 0 = a } }
",
    );
    for level in 1..15 {
        let under = level - 1;
        for (name, meaning) in [("a", "A"), ("b", "B")] {
            text += &format!(
                "dproto {name}{level} :: soil {{ semantic = {meaning} \
                 composes = {{ A = a{under}, B = b{under} }} }}\n"
            );
        }
    }
    check(
        &text,
        "a14",
        "a13",
        &expect!["no-conversion: `a14` has more than 4096 numbers\n"],
    );
}

/// Prototypes of one meaning, whose conversions into each other have no operation.
#[test]
fn a_circle_of_free_conversions_has_an_end() {
    let names = ["one", "two", "three", "other"];
    let mut text = String::from("algebraic xyz :: Scalar{x, y, z}\n");
    for name in names {
        let semantic = if name == "other" { "Force" } else { "Position" };
        text += &format!(
            "dproto {name} :: geometry {{ semantic = {semantic} coord = cartesian algebraic = xyz
                ddr = :: ROS{{geometry_msgs/{name}}} dr = {{ x = x, y = y, z = z }} }}\n"
        );
    }
    check(
        &text,
        "one",
        "three",
        &expect![[r"
        one -> three
        type      plain
        distance  1
        steps     three (plain)
        cost      1: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "]],
    );
    check(
        &text,
        "three",
        "two",
        &expect![[r"
        three -> two
        type      plain
        distance  1
        steps     two (plain)
        cost      1: 0 operations, 0 transcendental functions
        lost      nothing: the plan is exact
    "]],
    );
    // A prototype that no path leads to is refused, after a bounded search.
    check(
        &text,
        "one",
        "other",
        &expect![[r"
        semantic-mismatch: the meanings differ: Position and Force
    "]],
    );
}
