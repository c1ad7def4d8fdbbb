//! Prints forward solvers in ILK.

use super::read::CONSTANTS;
use crate::ast::MotionPart;
use crate::cell::{Asked, Cell, Solver};
use crate::names::identifier;
use rc_quantity::Transform;
use rc_quantity::rotation::{Matrix, cross};
use rc_robot::{Joint, Motion, Robot};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::{self, Write};

/// ILK has no words for this.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unprintable {
    solver: String,
    what: String,
}

impl fmt::Display for Unprintable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the solver `{}` has {}: ILK has poses and Jacobians along the axes of their base, velocities and accelerations \
            along those of their frame, of joints that follow no other one",
            self.solver, self.what
        )
    }
}

impl std::error::Error for Unprintable {}

/// All solvers, by the names of their files, and the constants of the robot.
///
/// # Errors
/// A solver has something else than motions of frames, or along axes that ILK does not have.
pub fn print(cell: &Cell) -> Result<Vec<(String, String)>, Unprintable> {
    let mut constants = BTreeMap::new();
    let mut files = Vec::new();
    for solver in &cell.solvers {
        let mut printer = Printer::new(cell);
        printer.solver(solver).map_err(|what| Unprintable {
            solver: solver.name.clone(),
            what,
        })?;
        let text = super::layout::layout(&printer.text(solver));
        files.push((format!("{}.ilk", solver.name), text));
        constants.append(&mut printer.constants);
    }
    if let Some(inverse) = cell.inverses.first() {
        return Err(Unprintable {
            solver: inverse.name.clone(),
            what: "an inverse question".to_owned(),
        });
    }
    let mut text = String::from("return {\n  poses = {\n");
    for (name, pose) in &constants {
        let rows = pose
            .rotation
            .map(|row| row.map(|part| format!("{part:?}")).join(", "));
        let place = pose.translation.map(|part| format!("{part:?}")).join(", ");
        let _ = writeln!(
            text,
            "    {name} = {{\n      p = {{{place}}},\n      r = {{{}}}\n    }},",
            rows.join(",\n           ")
        );
    }
    text.push_str("  }\n}\n");
    files.push((CONSTANTS.to_owned(), text));
    Ok(files)
}

/// A step from one frame to the next one, away from the base.
struct Step<'r> {
    joint: &'r Joint,
    /// The frames, from the base on: a body, those of the joint, a body.
    frames: [String; 4],
    is_back: bool,
}

struct Printer<'c> {
    cell: &'c Cell,
    /// Names of frames: of bodies by their places, of joints by names.
    bodies: HashMap<usize, String>,
    taken: BTreeSet<String>,
    joints: HashMap<&'c str, [String; 2]>,
    constants: BTreeMap<String, Transform>,
    moving: BTreeMap<String, (&'c Joint, bool)>,
    operations: Vec<String>,
    made: BTreeSet<String>,
    jacobians: Vec<String>,
    /// Velocities that joints give, by names, with what their entries have.
    twists: BTreeMap<String, String>,
    rates: BTreeMap<String, String>,
    outputs: Vec<String>,
}

/// The joint of frames that nothing moves in each other.
const RIGID: &str = "rigid";

/// The rotation whose z axis is this one.
fn with_z(axis: [f64; 3]) -> Matrix {
    if axis == [0.0, 0.0, 1.0] {
        return rc_quantity::rotation::IDENTITY;
    }
    let mut other = [0.0; 3];
    let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()));
    other[least.unwrap_or(0)] = 1.0;
    let across = cross(other, axis);
    let length = across.iter().map(|part| part * part).sum::<f64>().sqrt();
    let x = across.map(|part| part / length);
    let y = cross(axis, x);
    std::array::from_fn(|row| [x[row], y[row], axis[row]])
}

impl<'c> Printer<'c> {
    fn new(cell: &'c Cell) -> Self {
        Self {
            cell,
            bodies: HashMap::new(),
            taken: BTreeSet::new(),
            joints: HashMap::new(),
            constants: BTreeMap::new(),
            moving: BTreeMap::new(),
            operations: Vec::new(),
            made: BTreeSet::new(),
            jacobians: Vec::new(),
            twists: BTreeMap::new(),
            rates: BTreeMap::new(),
            outputs: Vec::new(),
        }
    }

    /// A name of Lua that no other frame has. Two `_` separate the frames of a pose.
    fn name(&mut self, wanted: &str) -> String {
        let mut name = identifier(wanted);
        while name.contains("__") {
            name = name.replace("__", "_");
        }
        let name = format!("fr_{}", name.trim_matches('_'));
        let mut own = name.clone();
        let mut number = 2;
        while !self.taken.insert(own.clone()) {
            own = format!("{name}_{number}");
            number += 1;
        }
        own
    }

    fn body(&mut self, at: usize) -> String {
        if let Some(name) = self.bodies.get(&at) {
            return name.clone();
        }
        let name = &self.cell.robot.bodies[at].name;
        let name = self.name(if name.is_empty() { "inside" } else { name });
        self.bodies.insert(at, name.clone());
        name
    }

    /// The frames of a joint, on the body that it is fixed to and on the one that it moves.
    fn joint(&mut self, joint: &'c Joint) -> [String; 2] {
        if let Some(names) = self.joints.get(joint.name.as_str()) {
            return names.clone();
        }
        let names = [
            self.name(&joint.name),
            self.name(&format!("{}_moved", joint.name)),
        ];
        self.joints.insert(&joint.name, names.clone());
        names
    }

    /// The steps from one body to another one.
    fn steps(&mut self, base: usize, tip: usize) -> Result<Vec<Step<'c>>, String> {
        let robot: &'c Robot = &self.cell.robot;
        let above = |at: usize| {
            let joint = |body: &usize| robot.bodies[*body].joint.as_ref();
            std::iter::successors(Some(at), move |body| Some(joint(body)?.parent))
                .take_while(move |body| joint(body).is_some())
                .collect::<Vec<usize>>()
        };
        let (up, down) = (above(base), above(tip));
        let shared = up.iter().rev().zip(down.iter().rev());
        let shared = shared.take_while(|(one, other)| one == other).count();
        let back = up[..up.len() - shared].iter().map(|body| (*body, true));
        let on = down[..down.len() - shared]
            .iter()
            .rev()
            .map(|body| (*body, false));
        let mut steps = Vec::new();
        for (body, is_back) in back.chain(on) {
            let Some(joint) = robot.bodies[body].joint.as_ref() else {
                continue;
            };
            let plain = match joint.motion {
                Motion::Fixed => true,
                Motion::Turns {
                    coordinate,
                    ratio,
                    offset,
                }
                | Motion::Slides {
                    coordinate,
                    ratio,
                    offset,
                } => {
                    // Joints that follow have another name than their coordinate.
                    let own = robot.coordinates.get(coordinate);
                    (ratio, offset) == (1.0, 0.0) && own == Some(&joint.name)
                }
            };
            if !plain {
                return Err(format!(
                    "the joint `{}`, which follows another one",
                    joint.name
                ));
            }
            let [fixed, moved] = self.joint(joint);
            let (parent, own) = (self.body(joint.parent), self.body(body));
            let frames = if is_back {
                [own, moved, fixed, parent]
            } else {
                [parent, fixed, moved, own]
            };
            steps.push(Step {
                joint,
                frames,
                is_back,
            });
        }
        Ok(steps)
    }

    /// Composes the pose of each frame of a chain in its base. Returns that of the tip, and those of moving joints.
    fn compose(&mut self, steps: &[Step<'c>]) -> (String, Vec<(&'c Joint, String, bool)>) {
        let mut whole = String::new();
        let mut axes = Vec::new();
        let Some(base) = steps.first().map(|step| step.frames[0].clone()) else {
            return (whole, axes);
        };
        for step in steps {
            let joint = step.joint;
            let [from, first, second, to] = &step.frames;
            let pose = |target: &str, reference: &str| format!("{target}__{reference}");
            let turn = Transform {
                rotation: with_z(joint.axis),
                translation: [0.0; 3],
            };
            let placed = joint.place.then(&turn);
            if joint.motion == Motion::Fixed {
                let place = if step.is_back {
                    joint.place.inverse()
                } else {
                    joint.place
                };
                self.constants.insert(pose(to, from), place);
                whole = self.then(&whole, to, from, &base);
                continue;
            }
            let (before, after) = if step.is_back {
                (turn, placed.inverse())
            } else {
                (placed, turn.inverse())
            };
            self.constants.insert(pose(first, from), before);
            whole = self.then(&whole, first, from, &base);
            axes.push((joint, whole.clone(), step.is_back));
            self.moving
                .insert(pose(second, first), (joint, step.is_back));
            whole = self.then(&whole, second, first, &base);
            self.constants.insert(pose(to, second), after);
            whole = self.then(&whole, to, second, &base);
        }
        (whole, axes)
    }

    /// The pose of the next frame in the base.
    fn then(&mut self, before: &str, target: &str, reference: &str, base: &str) -> String {
        let own = format!("{target}__{reference}");
        if before.is_empty() {
            return own;
        }
        let whole = format!("{target}__{base}");
        if self.made.insert(whole.clone()) {
            self.operations.push(format!(
                "{{ op='pose-compose', arg1='{own}', arg2='{before}', res='{whole}' }}"
            ));
        }
        whole
    }

    /// Composes the velocity of the tip in its base, and its acceleration if it is asked for. Returns the name of both frames.
    fn motion(&mut self, steps: &[Step<'c>], has_rates: bool) -> String {
        let Some(base) = steps.first().map(|step| step.frames[0].clone()) else {
            return String::new();
        };
        // The frame whose motion is known, and where the next one is in it.
        let (mut known, mut way) = (base.clone(), Transform::IDENTITY);
        let mut at = base.clone();
        for step in steps {
            let joint = step.joint;
            let [_, first, second, to] = &step.frames;
            let turn = Transform {
                rotation: with_z(joint.axis),
                translation: [0.0; 3],
            };
            let placed = joint.place.then(&turn);
            at.clone_from(to);
            if joint.motion == Motion::Fixed {
                let place = if step.is_back {
                    joint.place.inverse()
                } else {
                    joint.place
                };
                way = way.then(&place);
                continue;
            }
            let (before, after) = if step.is_back {
                (turn, placed.inverse())
            } else {
                (placed, turn.inverse())
            };
            let own = self.constant(&known, first, way.then(&before).inverse());
            let back = format!("{first}__{second}");
            self.moving.insert(back.clone(), (joint, !step.is_back));
            let pose = format!("{known}__{second}");
            self.composed(&own, &back, &pose);
            let [name, _] = self.joint(joint);
            if step.is_back {
                // What the joint is fixed to moves in what it moves: along the axes of the former.
                let frame = self.constant(second, to, after.inverse());
                let whole = format!("{known}__{to}");
                self.composed(&pose, &frame, &whole);
                let entry = format!("joint='{name}', polarity=-1, ctransform='{frame}'");
                self.moved(&entry, [to, first, &known, &base], has_rates);
                (known, way) = (to.clone(), Transform::IDENTITY);
            } else {
                let entry = format!("joint='{name}', polarity=1");
                self.moved(&entry, [second, first, &known, &base], has_rates);
                (known, way) = (second.clone(), after);
            }
        }
        if known != at {
            self.constant(&known, &at, way.inverse());
            let entry = format!("joint='{RIGID}', polarity=1");
            self.moved(&entry, [&at, &known, &known, &base], has_rates);
        }
        format!("{at}__{base}")
    }

    /// A constant pose. Returns its name.
    fn constant(&mut self, target: &str, reference: &str, pose: Transform) -> String {
        let name = format!("{target}__{reference}");
        self.constants.insert(name.clone(), pose);
        name
    }

    fn composed(&mut self, one: &str, other: &str, whole: &str) {
        if self.made.insert(whole.to_owned()) {
            self.operations.push(format!(
                "{{ op='pose-compose', arg1='{one}', arg2='{other}', res='{whole}' }}"
            ));
        }
    }

    /// Goes on to a frame that a joint moves in `within`, which is fixed in the frame `known`.
    fn moved(&mut self, entry: &str, [frame, within, known, base]: [&str; 4], has_rates: bool) {
        // In the base, what the joint gives is the whole.
        let is_first = known == base;
        let within = if is_first { base } else { within };
        let own = format!("{frame}__{within}");
        let (before, whole) = (format!("{known}__{base}"), format!("{frame}__{base}"));
        let pose = format!("{known}__{frame}");
        for (is_rate, letter, word) in [(false, "v", "vel"), (true, "a", "acc")] {
            if is_rate && !has_rates {
                continue;
            }
            let entries = if is_rate {
                &mut self.rates
            } else {
                &mut self.twists
            };
            entries.insert(format!("{letter}__{own}"), entry.to_owned());
            if self.made.insert(format!("{letter}__{own}")) {
                self.operations.push(format!(
                    "{{ op='joint-{word}-twist', arg='{letter}__{own}' }}"
                ));
            }
            if is_first || !self.made.insert(format!("{letter}__{whole}")) {
                continue;
            }
            let places = if is_rate {
                format!("ctransform='{pose}', velocity='v__{whole}'")
            } else {
                format!("pose='{pose}'")
            };
            self.operations.push(format!(
                "{{ op='{word}-compose', arg1='{letter}__{own}', arg2='{letter}__{before}', {places}, res='{letter}__{whole}' }}"
            ));
        }
    }

    fn solver(&mut self, solver: &Solver) -> Result<(), String> {
        for output in &solver.outputs {
            let unknown = || format!("`{}`", output.name);
            let asked: &Asked = output.asked.as_ref().ok_or_else(unknown)?;
            let is_motion = matches!(asked.what, MotionPart::Velocity | MotionPart::Acceleration);
            let has_axes = match asked.expressed {
                None => true,
                Some(frame) => is_motion && frame == asked.tip,
            };
            if asked.what == MotionPart::Quaternion || !has_axes {
                return Err(unknown());
            }
            let steps = self.steps(asked.base, asked.tip)?;
            let place = self.outputs.len() + 1;
            if steps.iter().all(|step| step.joint.motion == Motion::Fixed) {
                return Err(format!("{}, which is constant,", unknown()));
            }
            if is_motion {
                let is_rate = asked.what == MotionPart::Acceleration;
                let frames = self.motion(&steps, is_rate);
                let (letter, kind) = if is_rate {
                    ("a", "acceleration")
                } else {
                    ("v", "velocity")
                };
                self.outputs.push(format!(
                    "{letter}__{frames} = {{ otype='{kind}', usersort={place} }}"
                ));
                continue;
            }
            let (pose, axes) = self.compose(&steps);
            if asked.what == MotionPart::Pose {
                self.outputs
                    .push(format!("{pose} = {{ otype='pose', usersort={place} }}"));
                continue;
            }
            let name = format!("J_{pose}");
            let columns = self.cell.robot.coordinates.len();
            self.jacobians.push(format!(
                "{{ op='geom-jacobian', name='{name}', pose='{pose}', columns={columns} }}"
            ));
            for (joint, pose, is_back) in axes {
                let column = joint.motion.driven().map_or(0, |(at, _)| at);
                let sign = if is_back { -1 } else { 1 };
                let [own, _] = self.joint(joint);
                self.jacobians.push(format!(
                    "{{ op='GJac-col', joint='{own}', jac='{name}', col={column}, joint_pose='{pose}', polarity={sign} }}"
                ));
            }
            self.outputs
                .push(format!("{name} = {{ otype='jacobian', usersort={place} }}"));
        }
        Ok(())
    }

    fn text(&mut self, solver: &Solver) -> String {
        let robot = &self.cell.robot;
        let mut joints = Vec::new();
        for (at, coordinate) in robot.coordinates.iter().enumerate() {
            let mut all = robot.bodies.iter().filter_map(|body| body.joint.as_ref());
            let Some(joint) = all.find(|joint| joint.name == *coordinate) else {
                continue;
            };
            let kind = match joint.motion {
                Motion::Slides { .. } => "prismatic",
                _ => "revolute",
            };
            let [name, _] = self.joint(joint);
            joints.push(format!("{name} = {{ kind='{kind}', coordinate={at} }}"));
        }
        let entries = |all: &BTreeMap<String, String>| {
            let all = all
                .iter()
                .map(|(name, entry)| format!("{name} = {{ {entry} }}"));
            all.collect::<Vec<String>>()
        };
        let (twists, rates) = (entries(&self.twists), entries(&self.rates));
        let rigid = format!("joint='{RIGID}'");
        if self.twists.values().any(|entry| entry.starts_with(&rigid)) {
            joints.push(format!("{RIGID} = {{ kind='fixed' }}"));
        }
        let constant = self.constants.keys().map(|name| format!("{name} = {{}}"));
        let constant: Vec<String> = constant.collect();
        let moving: Vec<(String, &Joint, bool)> = self
            .moving
            .iter()
            .map(|(name, (joint, is_back))| (name.clone(), *joint, *is_back))
            .collect();
        let moving = moving.into_iter().map(|(name, joint, is_back)| {
            let direction = if is_back { "b_x_a" } else { "a_x_b" };
            let joint = self.joints.get(joint.name.as_str());
            let joint = joint.map_or("", |names| names[0].as_str());
            format!("{name} = {{ joint='{joint}', dir='{direction}' }}")
        });
        let moving: Vec<String> = moving.collect();
        let operations = [self.operations.as_slice(), &self.jacobians].concat();
        let list = |lines: &[String], depth: usize| {
            let spaces = " ".repeat(depth);
            let lines = lines.iter().map(|line| format!("{spaces}{line}"));
            lines.collect::<Vec<_>>().join(",\n") + "\n"
        };
        format!(
            "return {{\n    solverid = '{}',\n    solver_type = 'forward',\n    robot_name = '{}',\n    joint_space_size = {},\n    \
            joints = {{\n{}    }},\n    poses = {{\n        constant = {{\n{}        }},\n        joint = {{\n{}        }}\n    }},\n    \
            joint_vel_twists = {{\n{}    }},\n    joint_acc_twists = {{\n{}    }},\n    ops = {{\n{}    }},\n    outputs = {{\n{}    }}\n}}\n",
            solver.name,
            identifier(&robot.name),
            robot.coordinates.len(),
            list(&joints, 8),
            list(&constant, 12),
            list(&moving, 12),
            list(&twists, 8),
            list(&rates, 8),
            list(&operations, 8),
            list(&self.outputs, 8),
        )
    }
}
