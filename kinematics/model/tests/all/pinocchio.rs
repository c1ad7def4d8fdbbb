//! Motions and efforts beside Pinocchio.

use rc_diagnostics::{Format, SourceMap, render};
use rc_quantity::{Layout, Transform};
use rc_robot::dynamics::Motions;
use rc_robot::{Column, Motion, Robot, State, dynamics};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// A robot of a text, which has no errors.
pub(crate) fn robot(text: &str) -> Robot {
    let mut sources = SourceMap::new();
    let source = sources.add("robot.urdf", text);
    let (robot, found) = rc_robot::read(&sources, source);
    let wrong = found.has_errors();
    assert!(!wrong, "{}", render(&sources, &found, Format::Short));
    robot
}

pub(crate) fn numbers<const N: usize>(random: &mut fastrand::Rng, most: f64) -> [f64; N] {
    [(); N].map(|()| (random.f64() * 2.0 - 1.0) * most)
}

fn text(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    words.join(" ")
}

/// A tree of links with joints of all kinds. Some follow others.
pub(crate) fn random_urdf(random: &mut fastrand::Rng, links: usize) -> String {
    let mut out = String::from("<robot name=\"random\">\n");
    let mut leaders: Vec<(usize, &str)> = Vec::new();
    for link in 0..links {
        let mass = 0.1 + random.f64();
        // The moments of three masses on the axes, so that a body may have them.
        let [x, y, z] = [(); 3].map(|()| 0.01 + random.f64());
        let place = text(&numbers::<3>(random, 0.3));
        let turn = text(&numbers::<3>(random, 3.0));
        let inertia = format!(
            "<inertial><origin xyz=\"{place}\" rpy=\"{turn}\"/><mass value=\"{mass}\"/>\
            <inertia ixx=\"{}\" iyy=\"{}\" izz=\"{}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>",
            y + z,
            x + z,
            x + y
        );
        writeln!(out, "<link name=\"l{link}\">{inertia}</link>").expect("a text");
        if link == 0 {
            continue;
        }
        let kind = ["revolute", "continuous", "prismatic", "fixed", "revolute"][random.usize(0..5)];
        let kind = match random.usize(0..10) {
            0 => "planar",
            1 => "floating",
            2 => "spherical",
            _ => kind,
        };
        let place = text(&numbers::<3>(random, 0.5));
        let turn = text(&numbers::<3>(random, 3.0));
        let axis = match random.usize(0..4) {
            // Pinocchio's planes have no other normal.
            _ if kind == "planar" => "0 0 1".to_owned(),
            0 => "0 0 1".to_owned(),
            1 => "0 -1 0".to_owned(),
            _ => text(&numbers::<3>(random, 2.0)),
        };
        let parent = random.usize(link.saturating_sub(3)..link);
        let of_its_kind = leaders.iter().find(|(_, other)| *other == kind);
        let mimic = match of_its_kind {
            Some((leader, _)) if random.bool() => {
                format!("<mimic joint=\"j{leader}\" multiplier=\"-0.7\" offset=\"0.2\"/>")
            }
            _ => String::new(),
        };
        if mimic.is_empty() && matches!(kind, "revolute" | "prismatic") {
            leaders.push((link, kind));
        }
        writeln!(
            out,
            "<joint name=\"j{link}\" type=\"{kind}\"><parent link=\"l{parent}\"/><child link=\"l{link}\"/>\
            <origin xyz=\"{place}\" rpy=\"{turn}\"/><axis xyz=\"{axis}\"/>\
            <limit lower=\"-2\" upper=\"1.5\" effort=\"9\" velocity=\"3\"/>{mimic}</joint>"
        )
        .expect("a text");
    }
    out + "</robot>\n"
}

pub(crate) fn states(random: &mut fastrand::Rng, size: usize, count: usize) -> Vec<State> {
    let mut some =
        |most| -> Vec<f64> { (0..size).map(|_| numbers::<1>(random, most)[0]).collect() };
    (0..count)
        .map(|_| State {
            positions: some(3.0),
            velocities: some(2.0),
            accelerations: some(2.0),
        })
        .collect()
}

/// The greatest difference of two lists of numbers, relative to the greatest number.
pub(crate) fn difference(own: &Value, other: &Value) -> f64 {
    fn flat(value: &Value, out: &mut Vec<f64>) {
        match value {
            Value::Array(all) => all.iter().for_each(|one| flat(one, out)),
            other => out.push(other.as_f64().expect("a number")),
        }
    }
    let (mut one, mut two) = (Vec::new(), Vec::new());
    flat(own, &mut one);
    flat(other, &mut two);
    assert_eq!(one.len(), two.len(), "{own} {other}");
    let size = two
        .iter()
        .fold(1.0, |most: f64, value| most.max(value.abs()));
    let differences = one.iter().zip(&two).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / size
}

fn homogeneous(frame: &Transform) -> Value {
    let numbers = frame.homogeneous(Layout::RowMajor);
    json!(numbers.chunks(4).collect::<Vec<_>>())
}

fn columns(jacobian: &[Column<f64>]) -> Value {
    let columns = jacobian.iter().map(|column| {
        let all = column.linear.iter().chain(&column.angular);
        all.copied().collect::<Vec<f64>>()
    });
    json!(columns.collect::<Vec<_>>())
}

/// What this crate finds, in the form of the script, for these frames of each state.
fn facts(robot: &Robot, states: &[(State, Vec<usize>)], gravity: [f64; 3]) -> Value {
    // An effort gives a joint that moves no mass no acceleration.
    let is_weightless = dynamics::weightless(robot).is_some();
    let of = |(state, bodies): &(State, Vec<usize>)| {
        // The numbers of accelerations stand for efforts here.
        let accelerations = || {
            let efforts = &state.accelerations;
            let motions = Motions {
                state,
                efforts,
                gravity,
            };
            dynamics::accelerations(robot, &motions, &[])
        };
        let frames = bodies.iter().map(|body| {
            let chain = robot.chain(0, *body).expect("one tree");
            let moved = chain.moved(state);
            let join = |a: [f64; 3], b: [f64; 3]| [a, b].concat();
            json!({
                "pose": homogeneous(&moved.pose),
                "velocity": join(moved.linear_velocity, moved.angular_velocity),
                "acceleration": join(moved.linear_acceleration, moved.angular_acceleration),
                "jacobian": columns(&moved.jacobian),
            })
        });
        json!({
            "frames": frames.collect::<Vec<_>>(),
            "efforts": dynamics::efforts(robot, state, gravity, &[]),
            "mass": dynamics::mass_matrix(robot, state, &[]),
            "accelerations": if is_weightless { Vec::new() } else { accelerations() },
        })
    };
    let mass = robot.bodies.iter().filter_map(|body| body.inertia);
    let limits = robot.limits().into_iter().map(|limits| {
        // A continuous joint has none.
        let limits = limits.filter(|limits| limits.lower.is_finite());
        limits.map(|limits| [limits.lower, limits.upper])
    });
    json!({
        "limits": limits.collect::<Vec<_>>(),
        "mass": mass.map(|inertia| inertia.mass).sum::<f64>(),
        "states": states.iter().map(of).collect::<Vec<_>>(),
    })
}

/// The joints of a robot, as the script has them: those of one coordinate, then those of several.
pub(crate) fn driven(robot: &Robot) -> (Vec<Value>, Vec<Value>) {
    let (mut driven, mut several) = (Vec::new(), Vec::new());
    for joint in robot.bodies.iter().filter_map(|body| body.joint.as_ref()) {
        let (Motion::Turns {
            coordinate,
            ratio,
            offset,
        }
        | Motion::Slides {
            coordinate,
            ratio,
            offset,
        }) = joint.motion
        else {
            continue;
        };
        let has = |name: &str, part: &str| {
            let name = format!("{name}.{part}");
            robot.coordinates.contains(&name)
        };
        // Names of other joints have dots, too.
        let parts = joint.name.rsplit_once('.');
        match parts.filter(|(name, _)| has(name, "yaw")) {
            Some((name, "roll")) if has(name, "x") => {
                several.push(json!([name, coordinate - 3, "floating"]));
            }
            Some((name, "roll")) => several.push(json!([name, coordinate, "spherical"])),
            Some((name, "yaw")) if has(name, "y") && !has(name, "roll") => {
                several.push(json!([name, coordinate - 2, "planar"]));
            }
            Some(_) => {}
            None => driven.push(json!([joint.name, coordinate, ratio, offset])),
        }
    }
    (driven, several)
}

/// What a script of this folder answers.
pub(crate) fn answers(python: &Path, script: &str, cases: &Value) -> Value {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all"));
    let mut child = Command::new(python)
        .arg(folder.join(script))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut input = child.stdin.take().expect("its input");
    let written = input.write_all(cases.to_string().as_bytes());
    written.expect("written");
    drop(input);
    let output = child.wait_with_output().expect("python");
    assert!(output.status.success(), "the script failed");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// An interpreter with Pinocchio, if it can be installed.
fn python(test: &str) -> Option<&'static Path> {
    rc_test_support::python::packages("pinocchio", "pin==4.1.0\n", test)
}

/// A robot with the text or the file that Pinocchio reads.
pub(crate) struct Case {
    pub(crate) robot: Robot,
    pub(crate) source: (&'static str, String),
}

/// Compares robots with Pinocchio in `count` states, and in each of them the motion of `frames` links.
/// Returns for each robot whether Pinocchio refuses it.
pub(crate) fn compare(
    python: &Path,
    robots: &[Case],
    counts: (usize, usize),
    random: &mut fastrand::Rng,
) -> Vec<Option<String>> {
    let (refused, wrong) = differences(python, robots, counts, random);
    assert!(wrong.is_empty(), "{wrong:#?}");
    refused
}

/// As [`compare`], with what differs.
fn differences(
    python: &Path,
    robots: &[Case],
    (count, frames): (usize, usize),
    random: &mut fastrand::Rng,
) -> (Vec<Option<String>>, Vec<String>) {
    let (mut cases, mut own) = (Vec::new(), Vec::new());
    for Case { robot, source } in robots {
        let links: Vec<usize> = robot.links().map(|(at, _)| at).collect();
        // A robot that is refused has no states.
        let count = if links.is_empty() { 0 } else { count };
        let states: Vec<(State, Vec<usize>)> = states(random, robot.coordinates.len(), count)
            .into_iter()
            .map(|state| {
                let some = (0..frames).map(|_| links[random.usize(0..links.len())]);
                (state, some.collect())
            })
            .collect();
        let gravity = numbers::<3>(random, 9.81);
        let plain = |(state, bodies): &(State, Vec<usize>)| {
            json!({
                "positions": state.positions,
                "velocities": state.velocities,
                "accelerations": state.accelerations,
                "bodies": bodies.iter().map(|at| &robot.bodies[*at].name).collect::<Vec<_>>(),
            })
        };
        let (driven, several) = driven(robot);
        cases.push(json!({
            source.0: source.1,
            "root": robot.links().next().map(|(_, name)| name),
            "gravity": gravity,
            "coordinates": robot.coordinates,
            "is_plain": several.is_empty() && driven.len() == robot.coordinates.len(),
            "is_weightless": dynamics::weightless(robot).is_some(),
            "driven": driven,
            "several": several,
            "states": states.iter().map(plain).collect::<Vec<_>>(),
        }));
        own.push(facts(robot, &states, gravity));
    }
    let other = answers(python, "motion.py", &json!(cases));
    let all = |value: &Value| value.as_array().cloned().expect("a list");
    let (mut refused, mut wrong) = (Vec::new(), Vec::new());
    for (at, own) in own.iter().enumerate() {
        let other = &other[at];
        let reason = other.get("refused");
        refused.push(reason.map(Value::to_string));
        if reason.is_some() || robots[at].robot.bodies.is_empty() {
            continue;
        }
        let name = &robots[at].robot.name;
        let mut differ = |what: String, one: &Value, two: &Value, most: f64| {
            let far = difference(one, two);
            if far.is_nan() || far >= most {
                wrong.push(format!("{name}: {what}: {far}"));
            }
        };
        assert_eq!(own["limits"], other["limits"], "{name}");
        differ("mass".to_owned(), &own["mass"], &other["mass"], 1e-12);
        for (state, own) in all(&own["states"]).iter().enumerate() {
            let other = &other["states"][state];
            for (frame, own) in all(&own["frames"]).iter().enumerate() {
                for what in ["pose", "velocity", "acceleration", "jacobian"] {
                    let text = format!("{what} of frame {frame} in state {state}");
                    differ(text, &own[what], &other["frames"][frame][what], 1e-10);
                }
            }
            // Rounding of a mass matrix may be as great in its inverse.
            let condition = other["condition"].as_f64().expect("a number");
            let most = f64::max(1e-9, 1e-14 * condition);
            for (what, most) in [("efforts", 1e-9), ("mass", 1e-9), ("accelerations", most)] {
                let text = format!("{what} in state {state}");
                differ(text, &own[what], &other[what], most);
            }
        }
    }
    (refused, wrong)
}

/// Pinocchio knows no robot of this test, and this crate nothing of Pinocchio.
#[test]
fn motions_and_efforts_are_those_of_pinocchio() {
    let Some(python) = python("motions_and_efforts_are_those_of_pinocchio") else {
        return;
    };
    let mut random = fastrand::Rng::with_seed(44);
    let texts: Vec<String> = (0..12).map(|at| random_urdf(&mut random, 3 + at)).collect();
    for kind in ["<mimic", "\"planar\"", "\"floating\"", "\"spherical\""] {
        let count = texts.iter().map(|text| text.matches(kind).count());
        assert!(count.sum::<usize>() > 2, "{kind}");
    }
    let cases: Vec<Case> = texts
        .into_iter()
        .map(|text| Case {
            robot: robot(&text),
            source: ("urdf", text),
        })
        .collect();
    let refused = compare(python, &cases, (20, 8), &mut random);
    assert!(refused.iter().all(Option::is_none));
}

/// A mistake in a file changes the motion: the comparison with Pinocchio finds each of them.
#[test]
fn mistakes_in_a_file_are_found() {
    let Some(python) = python("mistakes_in_a_file_are_found") else {
        return;
    };
    let joint = |axis: &str, turn: &str, body: &str| {
        format!(
            "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"><inertial><origin xyz=\"0.1 0 0.2\" rpy=\"{body}\"/>\
            <mass value=\"2\"/><inertia ixx=\"0.1\" iyy=\"0.2\" izz=\"0.25\" ixy=\"0.01\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
            <link name=\"c\"><inertial><mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
            <joint name=\"one\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 0.1 0\" rpy=\"{turn}\"/>\
            <axis xyz=\"{axis}\"/><limit lower=\"-1\" upper=\"1\" effort=\"9\" velocity=\"3\"/></joint>\
            <joint name=\"two\" type=\"prismatic\"><parent link=\"b\"/><child link=\"c\"/><origin xyz=\"0 0 0.3\"/>\
            <axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"9\" velocity=\"3\"/></joint></robot>"
        )
    };
    let right = joint("0 0.6 0.8", "0.1 0.2 0.3", "0.3 0 0.4");
    let mut random = fastrand::Rng::with_seed(8);
    for (what, text) in [
        ("nothing", right.clone()),
        (
            "sign of an axis",
            joint("0 -0.6 -0.8", "0.1 0.2 0.3", "0.3 0 0.4"),
        ),
        (
            "order of angles",
            joint("0 0.6 0.8", "0.3 0.2 0.1", "0.3 0 0.4"),
        ),
        (
            "frame of inertia",
            joint("0 0.6 0.8", "0.1 0.2 0.3", "0 0 0"),
        ),
        (
            "product of inertia",
            right.replace("ixy=\"0.01\"", "ixy=\"-0.01\""),
        ),
        (
            "mass",
            right.replace("<mass value=\"1\"", "<mass value=\"1.001\""),
        ),
    ] {
        let case = Case {
            robot: robot(&text),
            source: ("urdf", right.clone()),
        };
        let (_, wrong) = differences(python, &[case], (2, 3), &mut random);
        assert_eq!(wrong.is_empty(), what == "nothing", "{what}: {wrong:?}");
    }
}

/// A column of the mass matrix is the efforts for an acceleration of one joint alone.
#[test]
fn a_mass_matrix_is_what_efforts_say() {
    let mut random = fastrand::Rng::with_seed(11);
    for links in [4, 8, 12, 16] {
        let robot = robot(&random_urdf(&mut random, links));
        for state in states(&mut random, robot.coordinates.len(), 10) {
            let mut still = State::still(state.positions);
            let mass = dynamics::mass_matrix(&robot, &still, &[]);
            for (column, row) in mass.iter().enumerate() {
                still.accelerations[column] = 1.0;
                let efforts = dynamics::efforts(&robot, &still, [0.0; 3], &[]);
                still.accelerations[column] = 0.0;
                assert!(difference(&json!(row), &json!(efforts)) < 1e-12);
            }
        }
    }
}

/// A frame in another one is there what the chain over the root says.
#[test]
fn frames_move_in_each_other_as_over_the_root() {
    let mut random = fastrand::Rng::with_seed(7);
    for links in [5, 9, 14] {
        let robot = robot(&random_urdf(&mut random, links));
        for state in states(&mut random, robot.coordinates.len(), 5) {
            let links: Vec<usize> = robot.links().map(|(at, _)| at).collect();
            for &base in &links {
                for &tip in &links {
                    let chain = robot.chain(base, tip).expect("one tree");
                    let moved = chain.moved(&state);
                    let in_root = |body| {
                        let chain = robot.chain(0, body).expect("one tree");
                        chain.moved(&state).pose
                    };
                    let over = in_root(base).inverse().then(&in_root(tip));
                    assert!(difference(&homogeneous(&moved.pose), &homogeneous(&over)) < 1e-12);
                    // The Jacobian gives the velocity, and both the change of the pose.
                    let mut linear = [0.0; 3];
                    for (column, speed) in moved.jacobian.iter().zip(&state.velocities) {
                        for (part, by) in linear.iter_mut().zip(column.linear) {
                            *part += by * speed;
                        }
                    }
                    let velocity = json!(moved.linear_velocity);
                    assert!(difference(&json!(linear), &velocity) < 1e-11);
                    let step = 1e-6;
                    let at = |time: f64| {
                        let mut other = state.clone();
                        let all = other.positions.iter_mut().zip(&mut other.velocities);
                        for ((position, speed), rate) in all.zip(&state.accelerations) {
                            *position += *speed * time + 0.5 * rate * time * time;
                            *speed += rate * time;
                        }
                        chain.moved(&other)
                    };
                    let (before, after) = (at(-step), at(step));
                    let rate = |a: [f64; 3], b: [f64; 3]| {
                        json!([0, 1, 2].map(|at: usize| (b[at] - a[at]) / (2.0 * step)))
                    };
                    let measured = rate(before.pose.translation, after.pose.translation);
                    assert!(difference(&measured, &velocity) < 1e-6);
                    let measured = rate(before.linear_velocity, after.linear_velocity);
                    let acceleration = json!(moved.linear_acceleration);
                    assert!(difference(&measured, &acceleration) < 1e-5);
                    let measured = rate(before.angular_velocity, after.angular_velocity);
                    let acceleration = json!(moved.angular_acceleration);
                    assert!(difference(&measured, &acceleration) < 1e-5);
                }
            }
        }
    }
}
