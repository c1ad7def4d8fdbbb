//! Prints inverse solvers: the motion as straight lines, and the loops over it.

use super::frames::Frames;
use super::{choices, closed};
use crate::cell::Cell;
use crate::inverse::{Inverse, Question, RateLimits, Rates};
use crate::names::type_name;
use crate::search::Search;
use rc_formula::{c as c_text, python as python_text, results, rust as rust_text};
use std::fmt::Write;

/// The loops in C. `PREFIX` is replaced by the name of the cell.
const C: &str = include_str!("inverse.c");

/// The loops in Python.
const PYTHON: &str = include_str!("inverse.py");

/// Infinite numbers of a language.
pub(super) struct Numbers {
    infinity: &'static str,
    negative_infinity: &'static str,
}

impl Numbers {
    pub(super) fn list(&self, numbers: &[f64]) -> String {
        let words = numbers.iter().map(|number| match *number {
            f64::INFINITY => self.infinity.to_owned(),
            f64::NEG_INFINITY => self.negative_infinity.to_owned(),
            number => format!("{number:?}"),
        });
        words.collect::<Vec<_>>().join(", ")
    }
}

pub(super) const IN_RUST: Numbers = Numbers {
    infinity: "f64::INFINITY",
    negative_infinity: "f64::NEG_INFINITY",
};
pub(super) const IN_C: Numbers = Numbers {
    infinity: "INFINITY",
    negative_infinity: "-INFINITY",
};
pub(super) const IN_PYTHON: Numbers = Numbers {
    infinity: "math.inf",
    negative_infinity: "-math.inf",
};

/// The comment of an inverse solver.
pub(super) fn about(inverse: &Inverse) -> Vec<String> {
    let work = inverse.work();
    let mut lines = inverse.doc.clone();
    if let Question::Pose(search) = &inverse.asked {
        lines.extend(search.closed.as_ref().map(closed::about));
    }
    lines.push(match &inverse.asked {
        Question::Pose(search) => format!(
            "Each call computes the motion at most {} times: {work}, and the equations of a step.",
            search.beginnings() * search.iterations + usize::from(search.endless.contains(&true))
        ),
        Question::Velocity(_) => format!(
            "Each call computes the motion once: {work}; then the equations of at most {} steps.",
            8 * inverse.joints.len()
        ),
    });
    lines
}

const POSITIONS: &str = "Positions of all joints. Those that do not move the frame are as before.";
const REACHED: &str = "Whether the frame is within the tolerance. Else the positions are the nearest that were found.";
const DISTANCE: &str = "How far the frame is from there, in the unit of the pose.";
const ANGLE: &str = "By which angle it is turned, in rad.";
const ITERATIONS: &str = "How often the motion was computed.";
const VELOCITIES: &str = "Velocities of all joints, in rad/s or m/s.";
const ACHIEVED: &str =
    "The velocity that the frame gets by them: another one near singularities and limits.";

/// `last[0], last[2]`, or the numbers of a posture.
fn beginning(inverse: &Inverse, search: &Search) -> String {
    let numbers = inverse.joints.iter().map(|joint| match &search.seed {
        Some(seed) => format!("{:?}", seed[*joint]),
        None => format!("last[{joint}]"),
    });
    numbers.collect::<Vec<_>>().join(", ")
}

/// The preferred velocity of a joint.
fn preferred(rates: &Rates, joint: usize, place: usize) -> String {
    match &rates.posture {
        Some((posture, gain)) => {
            format!("{gain:?} * ({:?} - positions[{joint}])", posture[place])
        }
        None => "0.0".to_owned(),
    }
}

/// The least or the greatest velocity of a joint, by a function `within` of the language.
fn bound(
    rates: &Rates,
    joint: usize,
    place: usize,
    is_most: bool,
    within: &str,
    numbers: &Numbers,
) -> String {
    let Some(RateLimits {
        lower,
        upper,
        fastest,
        period,
    }) = &rates.limits
    else {
        let all = if is_most {
            numbers.infinity
        } else {
            numbers.negative_infinity
        };
        return all.to_owned();
    };
    let limit = if is_most { upper[place] } else { lower[place] };
    let fastest = fastest[place];
    format!(
        "{within}(({} - positions[{joint}]) / {period:?}, {}, {})",
        numbers.list(&[limit]),
        numbers.list(&[-fastest]),
        numbers.list(&[fastest]),
    )
}

fn each(inverse: &Inverse, of: impl Fn(usize, usize) -> String) -> String {
    let joints = inverse.joints.iter().enumerate();
    let all = joints.map(|(place, joint)| of(*joint, place));
    all.collect::<Vec<_>>().join(", ")
}

/// The loops, as a module.
pub(super) fn rust_loops() -> String {
    format!("\nmod _inverse {{\n{}}}\n", rc_robot::inverse::TEXT)
}

/// A type and a function.
pub(super) fn rust(cell: &Cell, frames: &Frames, inverse: &Inverse) -> String {
    let count = cell.robot.coordinates.len();
    let (name, of) = (&inverse.name, type_name(&inverse.name));
    let joints = inverse.joints.len();
    let mut out = format!(
        "\n/// The result of [`{name}`].\n#[derive(Clone, Copy, Debug, PartialEq)]\npub struct {of} {{\n"
    );
    let fields: &[(&str, &str, &str)] = match &inverse.asked {
        Question::Pose(_) => &[
            (POSITIONS, "positions", "COUNT"),
            (REACHED, "reached", "bool"),
            (DISTANCE, "distance", "f64"),
            (ANGLE, "angle", "f64"),
            (ITERATIONS, "iterations", "usize"),
        ],
        Question::Velocity(_) => &[
            (VELOCITIES, "velocities", "COUNT"),
            (ACHIEVED, "achieved", "[f64; 6]"),
        ],
    };
    for (doc, field, kind) in fields {
        let kind = kind.replace("COUNT", &format!("[f64; {count}]"));
        let _ = writeln!(out, "    /// {doc}\n    pub {field}: {kind},");
    }
    out.push_str("}\n\n");
    for line in about(inverse) {
        let _ = writeln!(out, "/// {line}");
    }
    let motion = rust_motion(inverse);
    match &inverse.asked {
        Question::Pose(search) => {
            let last = match search.seed {
                Some(_) => String::new(),
                None => format!(", last: &[f64; {count}]"),
            };
            let all = match &search.seed {
                Some(seed) => format!("[{}]", IN_RUST.list(seed)),
                None => "*last".to_owned(),
            };
            let endless: Vec<String> = search.endless.iter().map(bool::to_string).collect();
            let first = beginning(inverse, search);
            let rows = choices::rows_in_rust(cell);
            let _ = write!(
                out,
                "///\n/// `target`: {}{}\n\
                pub fn {name}(target: &{}{last}) -> {of} {{\n{motion}    let target = &target.numbers;\n{rows}\
                \x20   let (lower, upper): (&[f64], &[f64]) = (&[{}], &[{}]);\n{}\
                \x20   let aim = _inverse::Aim {{\n        target,\n        near: {:?},\n        turned: {:?},\n\
                \x20       lower,\n        upper,\n        endless: &[{}],\n        closed: &closed[..kept],\n\
                \x20       starts: &[{}],\n        iterations: {},\n    }};\n\
                \x20   let mut found = [{first}];\n\
                \x20   let search = _inverse::pose(motion, &aim, &mut found, &mut [0.0; _inverse::room({joints})]);\n\
                \x20   let mut positions = {all};\n",
                inverse.question,
                if search.seed.is_none() {
                    "\n/// `last`: the positions before, where the search begins."
                } else {
                    ""
                },
                frames.of_inverse(inverse),
                IN_RUST.list(&search.lower),
                IN_RUST.list(&search.upper),
                closed::rust(search, &first),
                search.near,
                search.turned,
                endless.join(", "),
                IN_RUST.list(&search.starts),
                search.iterations,
            );
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    positions[{joint}] = found[{place}];");
            }
            let _ = writeln!(
                out,
                "    {of} {{\n        positions,\n        reached: search.reached,\n        distance: search.distance,\n\
                \x20       angle: search.angle,\n        iterations: search.iterations,\n    }}\n}}"
            );
        }
        Question::Velocity(rates) => {
            let bounds = |is_most| {
                each(inverse, |joint, place| {
                    bound(rates, joint, place, is_most, "_inverse::within", &IN_RUST)
                })
            };
            let _ = write!(
                out,
                "///\n/// `velocity`: {}\n\
                pub fn {name}(positions: &[f64; {count}], velocity: &[f64; 6]) -> {of} {{\n{motion}\
                \x20   let mut jacobian = [0.0; {}];\n    motion(&[{}], &mut jacobian);\n\
                \x20   let wish = _inverse::Wish {{\n        velocity,\n        damping: {:?},\n        preferred: &[{}],\n\
                \x20       least: &[{}],\n        most: &[{}],\n    }};\n    let mut found = [0.0; {joints}];\n\
                \x20   let achieved = _inverse::velocity(&jacobian, &wish, &mut found, &mut [0.0; _inverse::room({joints})]);\n\
                \x20   let mut velocities = [0.0; {count}];\n",
                inverse.question,
                6 * joints,
                each(inverse, |joint, _| format!("positions[{joint}]")),
                rates.damping,
                each(inverse, |joint, place| preferred(rates, joint, place)),
                bounds(false),
                bounds(true),
            );
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    velocities[{joint}] = found[{place}];");
            }
            let _ = writeln!(out, "    {of} {{ velocities, achieved }}\n}}");
        }
    }
    out
}

/// The motion as a function inside another one.
fn rust_motion(inverse: &Inverse) -> String {
    let numbers = results(&inverse.motion);
    let mut out = format!(
        "    fn motion(positions: &[f64], out: &mut [f64]) {{\n        let (positions, out) = (&positions[..{}], &mut out[..{}]);\n",
        inverse.joints.len(),
        numbers.len()
    );
    let lines = rust_text::statements(&inverse.motion, |at| format!("positions[{at}]"));
    for line in lines.lines() {
        let _ = writeln!(out, "    {line}");
    }
    for (at, number) in numbers.iter().enumerate() {
        let _ = writeln!(out, "        out[{at}] = {number};");
    }
    out + "    }\n"
}

/// The loops.
pub(super) fn c_loops(cell: &Cell) -> String {
    format!("\n{}", C.replace("PREFIX", &cell.name))
}

/// A type and a function.
pub(super) fn c(cell: &Cell, inverse: &Inverse) -> String {
    let count = cell.robot.coordinates.len();
    let prefix = &cell.name;
    let name = format!("{prefix}_{}", inverse.name);
    let motion = format!("{prefix}__{}_motion", inverse.name);
    let joints = inverse.joints.len();
    let numbers = results(&inverse.motion);
    let mut out = format!(
        "\nstatic inline void {motion}(const double *positions, double *out)\n{{\n    (void)positions;\n{}",
        c_text::statements(&inverse.motion, |at| format!("positions[{at}]"))
    );
    for (at, number) in numbers.iter().enumerate() {
        let _ = writeln!(out, "    out[{at}] = {number};");
    }
    out.push_str("}\n");
    if let Question::Pose(search) = &inverse.asked {
        out += &closed::c(prefix, inverse, search);
    }
    let _ = writeln!(out, "\n/* The result of {name}. */\ntypedef struct {{");
    let fields: &[(&str, &str)] = match &inverse.asked {
        Question::Pose(_) => &[
            (POSITIONS, "double positions[COUNT]"),
            (REACHED, "int reached"),
            (DISTANCE, "double distance"),
            (ANGLE, "double angle"),
            (ITERATIONS, "int iterations"),
        ],
        Question::Velocity(_) => &[
            (VELOCITIES, "double velocities[COUNT]"),
            (ACHIEVED, "double achieved[6]"),
        ],
    };
    for (doc, field) in fields {
        let field = field.replace("COUNT", &count.to_string());
        let _ = writeln!(out, "    /* {doc} */\n    {field};");
    }
    let _ = writeln!(out, "}} {name}_result;\n\n/*");
    let question = match &inverse.asked {
        Question::Pose(search) => {
            let last = match search.seed {
                Some(_) => "",
                None => " `last`: the positions before, where the search begins.",
            };
            format!("`target`: {}{last}", inverse.question)
        }
        Question::Velocity(_) => format!("`velocity`: {}", inverse.question),
    };
    for line in about(inverse).iter().chain([&question]) {
        let _ = writeln!(out, " * {}", line.replace("*/", "* /"));
    }
    out.push_str(" */\n");
    match &inverse.asked {
        Question::Pose(search) => {
            let last = match search.seed {
                Some(_) => String::new(),
                None => format!("const double last[{count}], "),
            };
            let endless = search.endless.iter().map(|is| if *is { "1" } else { "0" });
            let endless = endless.collect::<Vec<_>>().join(", ");
            let rows = choices::rows_in_c(cell);
            // A list of C is not empty.
            let (declared, called) = closed::c_call(prefix, inverse, search);
            let starts = match search.starts.as_slice() {
                [] => "0.0".to_owned(),
                starts => IN_C.list(starts),
            };
            let _ = write!(
                out,
                "static inline void {name}(double target[4][4], {last}{name}_result *result)\n{{\n{rows}\
                \x20   static const double lower[{joints}] = {{{}}}, upper[{joints}] = {{{}}};\n\
                \x20   static const double starts[] = {{{starts}}};\n\
                \x20   static const unsigned char endless[{joints}] = {{{endless}}};\n\
                {declared}\
                \x20   {prefix}__aim aim = {{&target[0][0], lower, upper, starts, closed, endless, {:?}, {:?}, {}, {}, 0}};\n\
                \x20   double work[{}], found[{joints}];\n    {prefix}__found search;\n",
                IN_C.list(&search.lower),
                IN_C.list(&search.upper),
                search.near,
                search.turned,
                1 + search.starts.len() / joints,
                search.iterations,
                rc_robot::inverse::room(joints),
            );
            match &search.seed {
                Some(seed) => {
                    for (joint, position) in seed.iter().enumerate() {
                        let _ = writeln!(out, "    result->positions[{joint}] = {position:?};");
                    }
                }
                None => {
                    let _ = writeln!(
                        out,
                        "    for (int joint = 0; joint < {count}; joint++)\n        result->positions[joint] = last[joint];"
                    );
                }
            }
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    found[{place}] = result->positions[{joint}];");
            }
            out += &called;
            let _ = writeln!(
                out,
                "    search = {prefix}__search({motion}, &aim, {joints}, found, work);"
            );
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    result->positions[{joint}] = found[{place}];");
            }
            for field in ["reached", "distance", "angle", "iterations"] {
                let _ = writeln!(out, "    result->{field} = search.{field};");
            }
        }
        Question::Velocity(rates) => {
            let within = format!("{prefix}__within");
            let bounds = |is_most| {
                each(inverse, |joint, place| {
                    bound(rates, joint, place, is_most, &within, &IN_C)
                })
            };
            let _ = write!(
                out,
                "static inline void {name}(const double positions[{count}], const double velocity[6], {name}_result *result)\n{{\n\
                \x20   const double at[{joints}] = {{{}}};\n\
                \x20   const double least[{joints}] = {{{}}}, most[{joints}] = {{{}}};\n\
                \x20   double preferred[{joints}] = {{{}}};\n\
                \x20   double jacobian[{}], wanted[{joints}], held[{joints}], found[{joints}];\n    {motion}(at, jacobian);\n\
                \x20   {prefix}__rates(jacobian, velocity, {:?}, preferred, least, most, {joints}, found, result->achieved, wanted, held);\n\
                \x20   for (int joint = 0; joint < {count}; joint++)\n        result->velocities[joint] = 0.0;\n",
                each(inverse, |joint, _| format!("positions[{joint}]")),
                bounds(false),
                bounds(true),
                each(inverse, |joint, place| preferred(rates, joint, place)),
                6 * joints,
                rates.damping,
            );
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    result->velocities[{joint}] = found[{place}];");
            }
        }
    }
    out + "}\n"
}

/// The loops.
pub(super) fn python_loops() -> String {
    format!("\n\n{PYTHON}")
}

/// A type and a function.
pub(super) fn python(cell: &Cell, inverse: &Inverse) -> String {
    let count = cell.robot.coordinates.len();
    let (name, of) = (&inverse.name, type_name(&inverse.name));
    let numbers = results(&inverse.motion);
    let motion = format!("_{name}_motion");
    let mut out = format!(
        "\n\ndef {motion}(positions: list[float]) -> {}:\n{}",
        match inverse.asked {
            Question::Pose(_) => "tuple[list[float], list[list[float]]]",
            Question::Velocity(_) => "list[list[float]]",
        },
        python_text::statements(&inverse.motion, |at| format!("positions[{at}]"))
    );
    let joints = inverse.joints.len();
    let rows = |numbers: &[String]| {
        let rows = numbers
            .chunks(joints)
            .map(|row| format!("[{}]", row.join(", ")));
        format!("[{}]", rows.collect::<Vec<_>>().join(", "))
    };
    let _ = match inverse.asked {
        Question::Pose(_) => writeln!(
            out,
            "    return [{}], {}",
            numbers[..12].join(", "),
            rows(&numbers[12..])
        ),
        Question::Velocity(_) => writeln!(out, "    return {}", rows(&numbers)),
    };
    if let Question::Pose(search) = &inverse.asked {
        out += &closed::python(inverse, search);
    }
    let _ = writeln!(
        out,
        "\n\nclass {of}(NamedTuple):\n    \"\"\"The result of {name}.\"\"\"\n"
    );
    let fields: &[(&str, &str)] = match &inverse.asked {
        Question::Pose(_) => &[
            (POSITIONS, "positions: list[float]"),
            (REACHED, "reached: bool"),
            (DISTANCE, "distance: float"),
            (ANGLE, "angle: float"),
            (ITERATIONS, "iterations: int"),
        ],
        Question::Velocity(_) => &[
            (VELOCITIES, "velocities: list[float]"),
            (ACHIEVED, "achieved: list[float]"),
        ],
    };
    for (doc, field) in fields {
        let _ = writeln!(out, "    # {doc}\n    {field}");
    }
    let mut lines = about(inverse);
    let length_of = |array: &str| {
        format!(
            "    if len({array}) != {count}:\n        raise ValueError(f\"expected {count} numbers of {array}, found {{len({array})}}\")\n"
        )
    };
    let question = |lines: &mut Vec<String>, array: &str| {
        lines.push(String::new());
        lines.push(format!("`{array}`: {}", inverse.question));
    };
    let documented = |lines: &[String]| {
        let text = lines
            .join("\n    ")
            .replace('\\', " ")
            .replace("\"\"\"", "'''");
        let text = text.replace("    \n", "\n");
        format!("    \"\"\"{text}\"\"\"\n")
    };
    match &inverse.asked {
        Question::Pose(search) => {
            question(&mut lines, "target");
            let last = match search.seed {
                Some(_) => "",
                None => ", last: Sequence[float]",
            };
            let _ = write!(
                out,
                "\n\ndef {name}(target: Sequence[Sequence[float]]{last}) -> {of}:\n"
            );
            if search.seed.is_none() {
                lines.push("`last`: the positions before, where the search begins.".to_owned());
            }
            out += &documented(&lines);
            if let Some(seed) = &search.seed {
                let _ = writeln!(out, "    positions = [{}]", IN_PYTHON.list(seed));
            } else {
                out += &length_of("last");
                out.push_str("    positions = [float(one) for one in last]\n");
            }
            let endless = search
                .endless
                .iter()
                .map(|is| if *is { "True" } else { "False" });
            let target = if cell.choices.by_columns {
                "zip(*target)"
            } else {
                "target"
            };
            let starts = search.starts.chunks(joints);
            let starts = starts.map(|start| format!("[{}]", IN_PYTHON.list(start)));
            let _ = write!(
                out,
                "    wanted = [[float(one) for one in row] for row in {target}]\n\
                \x20   if len(wanted) < 3 or any(len(row) != 4 for row in wanted):\n\
                \x20       raise ValueError(\"expected 4 rows of 4 numbers of target\")\n\
                \x20   found, reached, distance, angle, iterations = _search(\n\
                \x20       {motion},\n        wanted,\n        {:?},\n        {:?},\n        [{}],\n        [{}],\n        [{}],\n\
                \x20       {},\n        [{}],\n        {},\n        [{}],\n    )\n",
                search.near,
                search.turned,
                IN_PYTHON.list(&search.lower),
                IN_PYTHON.list(&search.upper),
                endless.collect::<Vec<_>>().join(", "),
                closed::python_call(inverse, search),
                starts.collect::<Vec<_>>().join(", "),
                search.iterations,
                each(inverse, |joint, _| format!("positions[{joint}]")),
            );
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    positions[{joint}] = found[{place}]");
            }
            let _ = writeln!(
                out,
                "    return {of}(positions, reached, distance, angle, iterations)"
            );
        }
        Question::Velocity(rates) => {
            question(&mut lines, "velocity");
            let bounds = |is_most| {
                each(inverse, |joint, place| {
                    bound(rates, joint, place, is_most, "_within", &IN_PYTHON)
                })
            };
            let _ = write!(
                out,
                "\n\ndef {name}(positions: Sequence[float], velocity: Sequence[float]) -> {of}:\n{}{}\
                \x20   if len(velocity) != 6:\n        raise ValueError(f\"expected 6 numbers of velocity, found {{len(velocity)}}\")\n\
                \x20   at = [float(one) for one in positions]\n\
                \x20   found, achieved = _rates(\n\
                \x20       {motion}([{}]),\n        [float(one) for one in velocity],\n        {:?},\n        [{}],\n        [{}],\n\
                \x20       [{}],\n    )\n    velocities = [0.0] * {count}\n",
                documented(&lines),
                length_of("positions"),
                each(inverse, |joint, _| format!("at[{joint}]")),
                rates.damping,
                each(inverse, |joint, place| preferred(rates, joint, place)),
                bounds(false),
                bounds(true),
            );
            for (place, joint) in inverse.joints.iter().enumerate() {
                let _ = writeln!(out, "    velocities[{joint}] = found[{place}]");
            }
            let _ = writeln!(out, "    return {of}(velocities, achieved)");
        }
    }
    out
}
