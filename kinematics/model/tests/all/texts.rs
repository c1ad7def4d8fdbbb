//! Errors in files.

use rc_diagnostics::{Format, SourceMap, render};

fn findings(inside: &str) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("robot.urdf", format!("<robot name=\"r\">{inside}</robot>"));
    let (_, found) = rc_robot::read(&sources, source);
    render(&sources, &found, Format::Short)
}

/// Two links, a joint between them, and what stands in it.
fn joint(inside: &str) -> String {
    format!(
        "<link name=\"a\"/><link name=\"b\"/>\
        <joint name=\"j\" {inside}<parent link=\"a\"/><child link=\"b\"/></joint>"
    )
}

fn inertial(inside: &str) -> String {
    format!("<link name=\"a\"><inertial>{inside}</inertial></link>")
}

#[test]
fn what_no_robot_has_is_refused_at_its_place() {
    let moments = |diagonal: [f64; 3]| {
        let [x, y, z] = diagonal;
        let inertia = format!(
            "<mass value=\"1\"/><inertia ixx=\"{x}\" iyy=\"{y}\" izz=\"{z}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>"
        );
        inertial(&inertia)
    };
    for (inside, expected) in [
        (
            "<link name=\"a\"/><link name=\"b\"/>".to_owned(),
            "1:34: error[unconnected-link]: no joint connects the links `a` and `b`",
        ),
        (
            joint("type=\"revolute\"><axis xyz=\"0 0 0\"/>"),
            "error[bad-value]: the axis of the joint is 0",
        ),
        (
            joint("type=\"revolute\"><axis xyz=\"0 0\"/>"),
            "error[bad-number]: expected 3 numbers for `xyz`, found `0 0`",
        ),
        (
            joint("type=\"turning\">"),
            "error[bad-value]: unknown type of a joint `turning`",
        ),
        (
            joint("type=\"revolute\"><limit lower=\"2\" upper=\"1\"/>"),
            "`lower` is greater than `upper`",
        ),
        (
            joint("type=\"revolute\"><limit effort=\"-1\"/>"),
            "`effort` cannot be negative, found `-1`",
        ),
        (
            joint("type=\"revolute\"><mimic joint=\"k\"/>"),
            "error[unknown-joint]: there is no joint `k`",
        ),
        (
            joint("type=\"revolute\"><mimic joint=\"j\"/>"),
            "error[mimic-circle]",
        ),
        (
            joint("type=\"fixed\"><parent link=\"b\"/>"),
            "error[unknown-link]: the joint `j` moves a link in itself (a URDF is a tree:",
        ),
        (
            inertial("<mass value=\"-1\"/>"),
            "error[bad-value]: the mass is negative: -1 kg",
        ),
        (
            inertial("<mass value=\"nan\"/>"),
            "error[bad-number]: expected a number for `value`, found `nan`",
        ),
        (
            inertial("<mass value=\"1e300\"/>"),
            "error[bad-value]: the inertia is too great",
        ),
        (
            moments([1.0, 1.0, 2.5]),
            "warning[impossible-inertia]: the moments of inertia [1.0, 1.0, 2.5] kg m²",
        ),
        (moments([-1.0, -1.0, -1.0]), "warning[impossible-inertia]"),
        // The edge of what is possible: a thin rod, and nothing.
        (moments([0.0, 1.0, 1.0]), ""),
        (moments([0.0, 0.0, 0.0]), ""),
    ] {
        let found = findings(&inside);
        assert!(found.contains(expected), "{inside}: {found}");
        assert_eq!(found.is_empty(), expected.is_empty(), "{inside}: {found}");
    }
}

/// Each has the joints of the cycle, and what to do. Links below a cycle are no part of it.
#[test]
fn what_is_no_tree_is_told_at_its_joints() {
    let links = |count: usize| {
        let links = (0..count).map(|at| format!("<link name=\"l{at}\"/>"));
        links.collect::<String>()
    };
    let of = |joints: &[(usize, usize)]| {
        let inside = joints.iter().enumerate().map(|(at, (parent, child))| {
            format!(
                "\n<joint name=\"j{at}\" type=\"fixed\"><parent link=\"l{parent}\"/><child link=\"l{child}\"/></joint>"
            )
        });
        findings(&(links(9) + &inside.collect::<String>()))
    };
    let help =
        "(a URDF is a tree: leave one of these joints out; a `.kdsl` file closes a loop by `loop`)";
    assert_eq!(
        of(&[(1, 2), (3, 4), (2, 3), (3, 1), (5, 6), (6, 5)]),
        format!(
            "robot.urdf:5:14: error[unknown-link]: the joints `j0`, `j2`, `j3` form a cycle {help}\n\
            robot.urdf:7:14: error[unknown-link]: the joints `j4`, `j5` form a cycle {help}\n"
        )
    );
    // All links are in the cycle.
    let around: Vec<(usize, usize)> = (0..9).map(|at| (at, (at + 1) % 9)).collect();
    let message = "the joints `j0`, `j1`, `j2`, `j3`, `j4` and 4 others form a cycle";
    let found = of(&around);
    assert!(found.contains(message), "{found}");
    let found = of(&[(0, 1), (1, 3), (0, 2), (2, 3)]);
    assert!(
        found.starts_with(
            "robot.urdf:5:63: error[duplicate-id]: the link `l3` has two joints above it;"
        ) && found.contains(help),
        "{found}"
    );
}

/// Each follower would look at all before it.
#[test]
fn a_long_chain_of_followers_is_refused() {
    let mut inside = String::from("<link name=\"l0\"/>");
    for at in 1..=200 {
        let mimic = match at {
            1 => String::new(),
            _ => format!("<mimic joint=\"j{}\"/>", at - 1),
        };
        inside += &format!(
            "<link name=\"l{at}\"/><joint name=\"j{at}\" type=\"revolute\">\
            <parent link=\"l{}\"/><child link=\"l{at}\"/>{mimic}</joint>",
            at - 1
        );
    }
    let found = findings(&inside);
    assert!(
        found.contains("more than 100 joints follow each other"),
        "{found}"
    );
}

/// No text ends the reader with a panic.
#[test]
fn random_texts_are_read_or_refused() {
    let whole = joint(
        "type=\"revolute\"><origin xyz=\"1 2 3\" rpy=\"0 0 1\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\"/>",
    );
    let whole: Vec<char> = format!("{whole}<!-- 1e400 -->").chars().collect();
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..3_000 {
        let mut text = whole.clone();
        for _ in 0..random.usize(1..4) {
            let at = random.usize(0..text.len());
            match random.usize(0..3) {
                0 => drop(text.remove(at)),
                1 => text.insert(at, whole[random.usize(0..whole.len())]),
                _ => text[at] = whole[random.usize(0..whole.len())],
            }
        }
        findings(&text.into_iter().collect::<String>());
    }
}

#[test]
fn a_text_of_xacro_is_to_be_expanded_first() {
    let mut sources = SourceMap::new();
    let text = "<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\"><xacro:property name=\"w\" value=\"1\"/><link name=\"a\"/></robot>";
    let source = sources.add("robot.urdf", text);
    let (_, found) = rc_robot::read(&sources, source);
    let found = render(&sources, &found, Format::Short);
    assert!(
        found.contains("xacro") && found.contains("error"),
        "{found}"
    );
}

/// A shape is no matter here, whether its file exists or not.
#[test]
fn a_missing_mesh_changes_nothing() {
    let mesh = "<link name=\"a\"><visual><geometry><mesh filename=\"package://gone/a.stl\"/></geometry></visual></link>";
    assert_eq!(findings(mesh), "");
}

/// A joint between equal limits is one that stays.
#[test]
fn limits_of_zero_width_are_limits() {
    let inside =
        joint("type=\"revolute\"><axis xyz=\"0 0 1\"/><limit lower=\"0.5\" upper=\"0.5\"/>");
    assert_eq!(findings(&inside), "");
}

#[test]
fn ten_thousand_links_are_read_and_no_more() {
    let chain = |count: usize| {
        let mut inside = String::from("<link name=\"l0\"/>");
        for at in 1..count {
            inside += &format!(
                "<link name=\"l{at}\"/><joint name=\"j{at}\" type=\"continuous\"><parent link=\"l{}\"/><child link=\"l{at}\"/></joint>",
                at - 1
            );
        }
        inside
    };
    assert_eq!(findings(&chain(10_000)), "");
    let found = findings(&chain(10_001));
    assert!(found.contains("error[too-many-links]"), "{found}");
}

/// A joint of several coordinates has names that another joint may have.
#[test]
fn names_of_coordinates_differ() {
    let inside = "<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\
        <joint name=\"j\" type=\"planar\"><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"0 0 1\"/></joint>\
        <joint name=\"j.x\" type=\"continuous\"><parent link=\"b\"/><child link=\"c\"/></joint>";
    let found = findings(inside);
    assert!(
        found.contains("error[duplicate-id]: a joint of several coordinates has `j.x`, too"),
        "{found}"
    );
}
