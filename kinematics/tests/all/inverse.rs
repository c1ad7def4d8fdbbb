//! Which joints move a frame so.

use crate::load_with;
use crate::printed::{compiled, printed};
use rc_kinematics::{Cell, Question};
use serde_json::json;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// An arm of six joints whose axes are those of a UR5.
pub(crate) const SIX: &str = include_str!("../../examples/six.urdf");

/// An arm of seven joints whose axes and limits are those of a Panda.
pub(crate) const SEVEN: &str = include_str!("../robots/seven.urdf");

/// The solvers of a robot. `inside` are more of them.
fn cell(name: &str, robot: &str, inside: &str) -> Cell {
    let text = format!(
        "import \"arm.urdf\";
Kinematics {name}
{{
    posture home {{ }};
    solver fk {{ pose tool in base; jacobian tool in base; }};
    solver reach {{ inverse pose tool in base; within limits; seed last; tolerance 1e-6 m 1e-6 rad; iterations 60; }};
    solver from_home {{ inverse pose tool in base; within limits; seed home; }};
    solver push {{ inverse velocity tool in base; within limits; period 1 ms; damped 0.02; null posture home; }};
    {inside}
}};"
    );
    let (cell, found) = load_with(&text, robot);
    // Files of makers have warnings.
    assert!(!found.contains("error["), "{found}");
    cell.expect("a cell")
}

/// Numbers from 0 to 1, in Rust that is printed into programs.
pub(crate) const RANDOM: &str = "
struct Random(u64);
impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}
";

/// For a robot: how many of so many reachable poses are found, and whether all of it is true. Then how
/// many poses out of reach are called so, and the positions of some that were found.
const SEARCHES: &str = "
fn NAME(reachable: usize, far: usize) {
    let random = &mut Random(0x44_1234_5678);
    let some = |random: &mut Random| {
        let mut q = [0.0; NAME::JOINTS.len()];
        for at in 0..q.len() {
            let (lower, upper) = (NAME::LOWER[at].max(-3.0), NAME::UPPER[at].min(3.0));
            q[at] = lower + random.next() * (upper - lower);
        }
        q
    };
    let (mut found, mut shown) = (0, Vec::new());
    for _ in 0..reachable {
        let target = NAME::fk(&some(random)).pose_tool_in_base;
        let last = some(random);
        let answer = NAME::reach(&target, &last);
        assert_eq!(answer, NAME::reach(&target, &last), \"the same question, another answer\");
        let pose = NAME::fk(&answer.positions).pose_tool_in_base;
        let mut difference: f64 = 0.0;
        for row in 0..4 {
            for column in 0..4 {
                difference = difference.max((pose[row][column] - target[row][column]).abs());
            }
        }
        for at in 0..last.len() {
            let q = answer.positions[at];
            assert!(q >= NAME::LOWER[at] && q <= NAME::UPPER[at], \"beyond a limit\");
        }
        assert!(!answer.reached || difference <= 2e-6, \"{difference}\");
        assert!(answer.iterations <= 64 * 60);
        if answer.reached {
            found += 1;
        }
        if shown.len() < 50 {
            shown.push((target, answer.positions));
        }
    }
    println!(\"NAME {found}\");
    for (target, positions) in shown {
        println!(\"shown {:?};{positions:?}\", *target);
    }
    let (mut said, mut worst) = (0, 1.0f64);
    for _ in 0..far {
        let mut target = NAME::fk(&some(random)).pose_tool_in_base;
        let height = target[2][3] - 0.3;
        let length = (target[0][3].powi(2) + target[1][3].powi(2) + height.powi(2)).sqrt();
        let stretch = (1.25 + random.next()) / length;
        target[0][3] *= stretch;
        target[1][3] *= stretch;
        target[2][3] = 0.3 + height * stretch;
        let answer = NAME::reach(&target, &some(random));
        if !answer.reached && answer.distance + answer.angle > 1e-3 {
            said += 1;
        }
        // Other searches find nothing that is nearer.
        let far = answer.distance.hypot(answer.angle);
        for _ in 0..4 {
            let other = NAME::reach(&target, &some(random));
            worst = worst.max(far / other.distance.hypot(other.angle));
        }
        let moved = NAME::fk(&answer.positions).pose_tool_in_base;
        let way = [0, 1, 2].map(|row: usize| moved[row][3] - target[row][3]);
        let distance = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
        assert!((distance - answer.distance).abs() < 1e-9);
    }
    println!(\"far {said} {worst}\");
}
";

/// The target and the positions of some answers.
pub(crate) type Shown = Vec<(String, String)>;

/// Runs searches in optimised code. Returns its lines, and some answers.
pub(crate) fn searches(
    name: &str,
    robot: &str,
    reachable: usize,
    far: usize,
) -> (Vec<String>, Shown) {
    let cell = cell(name, robot, "");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at(&format!("{name}.rs")), rc_kinematics::rust(&cell)).expect("a file");
    let main = format!(
        "mod {name};\n{RANDOM}{}\nfn main() {{ {name}({reachable}, {far}); }}\n",
        SEARCHES.replace("NAME", name)
    );
    std::fs::write(at("main.rs"), main).expect("a file");
    let options = ["--edition=2021", "-Dwarnings", "-O"];
    compiled("rustc", &options, &at("main.rs"), &at("program"));
    let output = Command::new(at("program")).output().expect("it starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8(output.stdout).expect("a text");
    let (shown, rest): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| line.starts_with("shown "));
    let shown = shown
        .iter()
        .filter_map(|line| line["shown ".len()..].split_once(';'));
    let shown = shown.map(|(target, positions)| (target.to_owned(), positions.to_owned()));
    (
        rest.iter().map(|line| (*line).to_owned()).collect(),
        shown.collect(),
    )
}

/// Robots like those that arms of the market are, in all their limits.
#[test]
fn poses_in_reach_are_found_and_others_are_said() {
    let mut shown = Vec::new();
    for (name, robot) in [("six", SIX), ("seven", SEVEN)] {
        let (lines, some) = searches(name, robot, 2000, 30);
        let words: Vec<&str> = lines.iter().flat_map(|line| line.split(' ')).collect();
        let found: usize = words[1].parse().expect("a number");
        assert!(found >= 1998, "{name}: {lines:?}");
        assert_eq!(words[3], "30", "{name}: {lines:?}");
        let worst: f64 = words[4].parse().expect("a number");
        assert!(worst < 1.01, "{name}: {lines:?}");
        shown.push((robot, some));
    }
    let test = "poses_in_reach_are_found_and_others_are_said (by Pinocchio)";
    closed_by_pinocchio(test, &shown);
}

/// Pinocchio finds the frame where it shall be.
pub(crate) fn closed_by_pinocchio(test: &str, answers: &[(&str, Shown)]) {
    let packages = rc_test_support::python::packages;
    let Some(python) = packages("pinocchio", "pin==4.1.0\n", test) else {
        return;
    };
    let cases = answers.iter().map(|(robot, shown)| {
        let read = |text: &str| serde_json::from_str::<serde_json::Value>(text).expect("numbers");
        let all = shown
            .iter()
            .map(|(target, at)| json!([read(target), read(at)]));
        let names = crate::load_with("import \"arm.urdf\"; Kinematics names { };", robot).0;
        let names = names.expect("a robot").robot.coordinates;
        json!({ "urdf": robot, "coordinates": names, "answers": all.collect::<Vec<_>>() })
    });
    let cases = json!(cases.collect::<Vec<_>>()).to_string();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/closure.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut input = child.stdin.take().expect("its input");
    input.write_all(cases.as_bytes()).expect("written");
    drop(input);
    let output = child.wait_with_output().expect("python");
    assert!(output.status.success(), "the script failed");
    let worst: f64 = String::from_utf8_lossy(&output.stdout)
        .trim()
        .parse()
        .expect("a number");
    assert!(worst < 2e-6, "{worst}");
}

/// Some positions within the limits of a robot.
fn places(cell: &Cell, random: &mut fastrand::Rng) -> Vec<f64> {
    let limits = cell.robot.limits().into_iter().flatten();
    limits
        .map(|limits| limits.lower + random.f64() * (limits.upper - limits.lower))
        .collect()
}

fn target(cell: &Cell, positions: &[f64]) -> [[f64; 4]; 4] {
    let state = rc_robot::State::still(positions.to_vec());
    let efforts = vec![0.0; positions.len()];
    let numbers = cell.solvers[0]
        .run(&state, &efforts, &[])
        .expect("its joints");
    std::array::from_fn(|row| std::array::from_fn(|column| numbers[4 * row + column]))
}

/// The frame is turned by half a turn about an axis: the sine of the angle says nothing of it.
#[test]
fn half_turns_are_found() {
    let cell = cell("six", SIX, "");
    let reach = &cell.inverses[0];
    let last = [0.3, -1.2, 1.1, 0.2, 0.7, 0.4];
    let pose = target(&cell, &last);
    for axis in 0..3 {
        let mut turned = pose;
        for row in turned.iter_mut().take(3) {
            for (column, part) in row.iter_mut().enumerate().take(3) {
                if column != axis {
                    *part = -*part;
                }
            }
        }
        let (positions, found) = reach.positions(&turned, &last).expect("a pose");
        assert!(found.reached, "{found:?}");
        let again = target(&cell, &positions);
        for (one, other) in again.iter().flatten().zip(turned.iter().flatten()) {
            assert!((one - other).abs() < 3e-6);
        }
    }
}

/// What is not a pose, and no positions, ends as all others do.
#[test]
fn questions_without_sense_end() {
    let cell = cell("six", SIX, "");
    let reach = &cell.inverses[0];
    for wrong in [f64::NAN, f64::INFINITY, 1e300] {
        let (positions, found) = reach
            .positions(&[[wrong; 4]; 4], &[0.0; 6])
            .expect("a pose");
        assert!(!found.reached);
        assert!(positions.iter().all(|position| position.is_finite()));
        let pose = target(&cell, &[0.1; 6]);
        let (positions, _) = reach.positions(&pose, &[wrong; 6]).expect("a pose");
        assert!(positions.iter().all(|position| position.is_finite()));
        let (velocities, _) = cell.inverses[2]
            .velocities(&[0.1; 6], &[wrong; 6])
            .expect("six joints")
            .expect("velocities");
        let is_kept = velocities.iter().all(|velocity| velocity.abs() <= 3.2);
        assert!(is_kept, "{velocities:?}");
    }
    assert!(reach.positions(&[[0.0; 4]; 4], &[0.0; 5]).is_none());
    assert!(cell.inverses[2].velocities(&[0.0; 5], &[0.0; 6]).is_err());
}

/// `seed home` asks nobody where the joints are; a joint without an end stays near them.
#[test]
fn a_search_begins_where_it_is_told() {
    let cell = cell("six", SIX, "");
    let mut random = fastrand::Rng::with_seed(3);
    let pose = target(&cell, &places(&cell, &mut random));
    let from_home = &cell.inverses[1];
    let one = from_home.positions(&pose, &[0.0; 6]).expect("a pose");
    assert_eq!(Some(&one), from_home.positions(&pose, &[1.0; 6]).as_ref());
    let endless = SIX.replace("type=\"revolute\"", "type=\"continuous\"");
    let free = self::cell("six", &endless, "");
    let last = [20.0, -30.0, 14.0, 5.0, 6.0, -9.0];
    let (positions, found) = free.inverses[0].positions(&pose, &last).expect("a pose");
    assert!(found.reached);
    for (position, last) in positions.iter().zip(last) {
        assert!((position - last).abs() < 3.15, "{position} {last}");
    }
}

/// The cost of a velocity: the error of the frame, and the distance from the preferences.
fn cost(jacobian: &[f64], wish: &[f64; 6], rates: &[f64], preferred: &[f64], damping: f64) -> f64 {
    let count = rates.len();
    let error = (0..6).map(|row| {
        let columns = jacobian[row * count..(row + 1) * count].iter().zip(rates);
        wish[row] - columns.map(|(part, rate)| part * rate).sum::<f64>()
    });
    let own = rates
        .iter()
        .zip(preferred)
        .map(|(rate, wanted)| damping * (rate - wanted));
    error.chain(own).map(|part| part * part).sum()
}

/// Beside a method that knows nothing of active sets: one joint after the other, many times.
#[test]
fn velocities_are_the_least_squares_within_limits() {
    let cell = cell("seven", SEVEN, "");
    let push = &cell.inverses[2];
    let Question::Velocity(rates) = &push.asked else {
        panic!("an inverse of a velocity");
    };
    let limits = rates.limits.as_ref().expect("limits");
    let mut random = fastrand::Rng::with_seed(8);
    let mut held = 0;
    for round in 0..30 {
        let mut at = places(&cell, &mut random);
        if round % 3 == 0 {
            // Some joints stand at their limits.
            at[1] = limits.lower[1];
            at[3] = limits.upper[3];
        }
        let size = [0.1, 1.0, 6.0][round % 3];
        let wish: [f64; 6] = std::array::from_fn(|_| (random.f64() - 0.5) * size);
        let answer = push.velocities(&at, &wish).expect("seven joints");
        let (found, achieved) = answer.expect("velocities");
        let jacobian = push.motion.run(&at).expect("seven joints");
        // The null space by Gram and Schmidt: what is left of the way home beside the rows.
        let mut preferred: Vec<f64> = at.iter().map(|position| -position).collect();
        let zero_in_range = |at: usize| 0.0_f64.clamp(limits.lower[at], limits.upper[at]);
        for (at, wanted) in preferred.iter_mut().enumerate() {
            *wanted += zero_in_range(at);
        }
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for row in jacobian.chunks(7) {
            let mut row = row.to_vec();
            for other in rows.iter().chain(&rows) {
                let along: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                row.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
            }
            let length = row.iter().map(|part| part * part).sum::<f64>().sqrt();
            rows.push(row.iter().map(|part| part / length).collect());
        }
        for row in &rows {
            let along: f64 = preferred.iter().zip(row).map(|(a, b)| a * b).sum();
            preferred
                .iter_mut()
                .zip(row)
                .for_each(|(a, b)| *a -= along * b);
        }
        let bounds: Vec<(f64, f64)> = (0..7)
            .map(|joint| {
                let fastest = limits.fastest[joint];
                let bound = |limit: f64| ((limit - at[joint]) / 1e-3).clamp(-fastest, fastest);
                (bound(limits.lower[joint]), bound(limits.upper[joint]))
            })
            .collect();
        let mut other: Vec<f64> = vec![0.0; 7];
        let square: Vec<f64> = (0..7)
            .map(|joint| {
                (0..6)
                    .map(|row| jacobian[row * 7 + joint].powi(2))
                    .sum::<f64>()
                    + 4e-4
            })
            .collect();
        let mut error: Vec<f64> = wish.to_vec();
        for (joint, (lower, upper)) in bounds.iter().enumerate() {
            other[joint] = 0.0_f64.clamp(*lower, *upper);
            (0..6).for_each(|row| error[row] -= jacobian[row * 7 + joint] * other[joint]);
        }
        for _ in 0..20_000 {
            let mut most = 0.0_f64;
            for (joint, (lower, upper)) in bounds.iter().enumerate() {
                let slope: f64 = (0..6)
                    .map(|row| jacobian[row * 7 + joint] * error[row])
                    .sum();
                let slope = slope + 4e-4 * (preferred[joint] - other[joint]);
                let next = (other[joint] + slope / square[joint]).clamp(*lower, *upper);
                let change = next - other[joint];
                most = most.max(change.abs());
                other[joint] = next;
                (0..6).for_each(|row| error[row] -= jacobian[row * 7 + joint] * change);
            }
            if most < 1e-12 {
                break;
            }
        }
        for (rate, (lower, upper)) in found.iter().zip(&bounds) {
            assert!(rate >= lower && rate <= upper, "{rate} {lower} {upper}");
            held += usize::from(rate == lower || rate == upper);
        }
        let (one, best) = (
            cost(&jacobian, &wish, &found, &preferred, 0.02),
            cost(&jacobian, &wish, &other, &preferred, 0.02),
        );
        assert!(one <= best + 1e-7 * (1.0 + best), "{round}: {one} {best}");
        for (row, part) in achieved.iter().enumerate() {
            let columns = jacobian[row * 7..(row + 1) * 7].iter().zip(&found);
            let sum: f64 = columns.map(|(part, rate)| part * rate).sum();
            assert!((sum - part).abs() < 1e-12);
        }
    }
    assert!(held > 10, "{held}");
}

/// While the frame stands still, an arm with a joint too many goes home as far as it can.
#[test]
fn a_posture_is_kept_in_the_null_space() {
    let cell = cell("seven", SEVEN, "");
    let push = &cell.inverses[2];
    let mut at = vec![0.9, 0.5, -0.8, -1.5, 0.6, 1.6, -0.4];
    let begin = target(&cell, &at);
    let mut ways = Vec::new();
    for _ in 0..3000 {
        let answer = push.velocities(&at, &[0.0; 6]).expect("seven joints");
        let (rates, _) = answer.expect("velocities");
        for (position, rate) in at.iter_mut().zip(&rates) {
            *position += 1e-3 * rate;
        }
        ways.push(rates.iter().map(|rate| rate * rate).sum::<f64>());
    }
    let end = target(&cell, &at);
    for (one, other) in begin.iter().flatten().zip(end.iter().flatten()) {
        assert!((one - other).abs() < 1e-3, "{one} {other}");
    }
    assert!(ways[0] > 0.05, "{}", ways[0]);
    assert!(ways[2999] < 0.1 * ways[0], "{} {}", ways[0], ways[2999]);
}

/// Some of all questions, in each language.
#[test]
fn inverses_in_three_languages_are_the_same() {
    let inside = "solver back { inverse velocity base in tool expressed in base; };
    solver loose { inverse pose forearm in base; restarts 2; tolerance 1 mm 0.1 deg; };
    solver slide { inverse pose tool in upper_arm; seed last; iterations 9; restarts 0; };";
    let cell = cell("six", SIX, inside);
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("six.rs"), rc_kinematics::rust(&cell)).expect("a file");
    std::fs::write(at("six.h"), rc_kinematics::c(&cell)).expect("a file");
    std::fs::write(at("six.py"), rc_kinematics::python(&cell)).expect("a file");
    let mut rust = String::from("mod six;\nfn main() {\n");
    let mut c = String::from(
        "#include <stdio.h>\n#include \"six.h\"\n\
        static void print(const double *all, int count) { for (int i = 0; i < count; i++) printf(\"%.17g\\n\", all[i]); }\n\
        int main(void) {\n    (void)six_joints; (void)six_lower; (void)six_upper;\n",
    );
    let mut python = String::from("import six\n");
    let mut expected = Vec::new();
    let mut random = fastrand::Rng::with_seed(12);
    for _ in 0..6 {
        let last = places(&cell, &mut random);
        let pose = target(&cell, &places(&cell, &mut random));
        let velocity: [f64; 6] = std::array::from_fn(|_| random.f64() * 4.0 - 2.0);
        for inverse in &cell.inverses {
            let name = &inverse.name;
            match &inverse.asked {
                Question::Pose(search) => {
                    let (positions, found) = inverse.positions(&pose, &last).expect("a pose");
                    // Where nothing is found, the last bits lead elsewhere.
                    let is_shown = found.reached || search.starts.is_empty();
                    let count = if is_shown { 6 } else { 0 };
                    expected.extend(&positions[..count]);
                    expected.push(f64::from(u8::from(found.reached)));
                    let has_last = search.seed.is_none();
                    let rows: Vec<String> = pose.iter().map(|row| format!("{row:?}")).collect();
                    let of_c = rows.join(", ").replace('[', "{").replace(']', "}");
                    let list = format!("{last:?}");
                    let last_of_c = list.replace('[', "{").replace(']', "}");
                    writeln!(
                        rust,
                        "    let r = six::{name}(&six::Pose::new([{}]){});\n    r.positions[..{count}].iter().for_each(|n| println!(\"{{n:?}}\")); println!(\"{{}}\", r.reached as u8);",
                        rows.join(", "),
                        if has_last { format!(", &{list}") } else { String::new() }
                    )
                    .expect("a text");
                    writeln!(
                        c,
                        "    {{ double target[4][4] = {{{of_c}}}; const double last[6] = {last_of_c}; six_{name}_result r; (void)last;\n      \
                        six_{name}(target, {}&r); print(r.positions, {count}); printf(\"%d\\n\", r.reached); }}",
                        if has_last { "last, " } else { "" }
                    )
                    .expect("a text");
                    writeln!(
                        python,
                        "r = six.{name}([{}]{})\n[print(n) for n in r.positions[:{count}]]\nprint(int(r.reached))",
                        rows.join(", "),
                        if has_last { format!(", {list}") } else { String::new() }
                    )
                    .expect("a text");
                }
                Question::Velocity(_) => {
                    let answer = inverse.velocities(&last, &velocity).expect("six joints");
                    let (velocities, achieved) = answer.expect("velocities");
                    expected.extend(velocities);
                    expected.extend(achieved);
                    let (q, v) = (format!("{last:?}"), format!("{velocity:?}"));
                    let in_c = |list: &str| list.replace('[', "{").replace(']', "}");
                    writeln!(
                        rust,
                        "    let r = six::{name}(&{q}, &{v});\n    r.velocities.iter().chain(&r.achieved).for_each(|n| println!(\"{{n:?}}\"));"
                    )
                    .expect("a text");
                    writeln!(
                        c,
                        "    {{ const double q[6] = {}, v[6] = {}; six_{name}_result r; six_{name}(q, v, &r); print(r.velocities, 6); print(r.achieved, 6); }}",
                        in_c(&q),
                        in_c(&v)
                    )
                    .expect("a text");
                    writeln!(
                        python,
                        "r = six.{name}({q}, {v})\n[print(n) for n in r.velocities + r.achieved]"
                    )
                    .expect("a text");
                }
            }
        }
    }
    rust.push_str("}\n");
    c.push_str("    return 0;\n}\n");
    std::fs::write(at("main.rs"), rust).expect("a file");
    std::fs::write(at("main.c"), c).expect("a file");
    std::fs::write(at("main.py"), python).expect("a file");
    compiled(
        "rustc",
        &["--edition=2021", "-Dwarnings"],
        &at("main.rs"),
        &at("in_rust"),
    );
    let warnings = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-pedantic",
        "-Werror",
        "-ffp-contract=off",
    ];
    compiled("cc", &warnings, &at("main.c"), &at("in_c"));
    let near = |program: &mut Command, of: &Path| {
        let numbers = printed(program);
        assert_eq!(numbers.len(), expected.len(), "{}", of.display());
        for (one, other) in numbers.iter().zip(&expected) {
            assert!(
                (one - other).abs() < 1e-7,
                "{}: {one} {other}",
                of.display()
            );
        }
    };
    near(&mut Command::new(at("in_rust")), Path::new("rust"));
    near(&mut Command::new(at("in_c")), Path::new("c"));
    near(
        Command::new("python3").arg(at("main.py")),
        Path::new("python"),
    );
}
