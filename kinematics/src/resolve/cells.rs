//! Resolves the robots of a cell: how they are held, and which frames stay together.

use super::{Resolver, tree};
use crate::ast::{self, LoopKind, OutputKind};
use crate::cell::{OfLoops, Shape};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_quantity::Transform;
use rc_quantity::rotation::EulerOrder;
use rc_robot::loops::{self, Loop};
use rc_robot::{Kept, LoopJoint, Mount, Refused, Robot};
use rc_syntax::{Literal, Loader};
use std::collections::HashMap;
use std::path::Path;

/// Reads the robots that a text imports. `None` if one of them is wrong.
pub(super) fn robots(
    sources: &mut SourceMap,
    (loader, source): (&dyn Loader, SourceId),
    file: &ast::File,
    kinematics: &ast::Kinematics,
    found: &mut Diagnostics,
) -> Option<Robot> {
    if file.imports.is_empty() {
        let message = "no robot is imported".to_owned();
        let error = Diagnostic::error("missing-robot", kinematics.name.span, message);
        found.push(error.help("write `import \"robot.urdf\";` before it"));
        return None;
    }
    let from = sources.path(source).to_path_buf();
    let mut read = HashMap::new();
    let mut names: HashMap<&str, Span> = HashMap::new();
    let (mut cell, mut titles) = (Robot::default(), Vec::new());
    let (mut unnamed, mut is_wrong) = (None, false);
    for import in &file.imports {
        let wanted = import.file.text.as_str();
        let endings = ["xml", "yaml", "yml"];
        let ending = Path::new(wanted).extension().and_then(|own| own.to_str());
        let ending = ending.filter(|own| endings.contains(own)).unwrap_or("urdf");
        let given = match loader.find(&from, wanted, ending) {
            Ok(given) => given,
            Err(missing) => {
                found.push(missing.diagnostic(wanted, ending, import.file.span));
                is_wrong = true;
                continue;
            }
        };
        let identity = loader.identity(&given.path);
        if let Some(alias) = &import.alias {
            if let Some(first) = names.insert(&alias.text, alias.span) {
                let message = format!("two robots have the name `{}`", alias.text);
                let error = Diagnostic::error("duplicate-name", alias.span, message);
                found.push(error.label(first, "first declared here"));
                continue;
            }
        } else if let Some((first, other)) = &unnamed {
            // One file by two paths is one robot.
            if *other != identity {
                let message = "a second robot is imported without a name".to_owned();
                let error = Diagnostic::error("second-robot", import.file.span, message);
                let error = error.label(*first, "the first one");
                found.push(error.help(
                    "write `import \"FILE\" as NAME;`, which makes its links and joints `NAME.LINK` and `NAME.JOINT`",
                ));
            }
            continue;
        } else {
            unnamed = Some((import.file.span, identity.clone()));
        }
        let robot = read.entry(identity).or_insert_with(|| {
            let source = sources.add(given.path, given.text);
            let (robot, of_robot) = match ending {
                "xml" => tree::read(sources, loader, source),
                "yaml" | "yml" => crate::sets::read(sources, loader, source),
                _ => rc_robot::read(sources, source),
            };
            is_wrong |= of_robot.has_errors();
            found.extend(of_robot);
            robot
        });
        titles.push(robot.name.clone());
        let alias = import.alias.as_ref().map(|alias| alias.text.as_str());
        cell.add(alias, robot.clone());
    }
    if is_wrong {
        return None;
    }
    cell.name = titles.join(" and ");
    for mount in &kinematics.mounts {
        hold(&mut cell, mount, found);
    }
    Some(cell)
}

/// Connects a root to what holds it.
fn hold(cell: &mut Robot, mount: &ast::Mount, found: &mut Diagnostics) {
    let mut numbers = [0.0; 6];
    let units = ["m", "m", "m", "rad", "rad", "rad"];
    for ((number, given), unit) in numbers.iter_mut().zip(&mount.place).zip(units) {
        *number = super::quantity(found, given, unit).unwrap_or(0.0);
    }
    let [x, y, z, roll, pitch, yaw] = numbers;
    if numbers.iter().any(|number| number.abs() > 1e9) {
        let message = "expected numbers up to 1e9".to_owned();
        found.push(Diagnostic::error("bad-value", mount.span, message));
        return;
    }
    let (link, base) = (&mount.link, &mount.base);
    let held = cell.mount(&Mount {
        link: &link.text,
        base: &base.text,
        place: Transform {
            translation: [x, y, z],
            rotation: EulerOrder::RPY.matrix([roll, pitch, yaw]),
        },
        held: mount.held,
    });
    let error = |span, message| Diagnostic::error("not-a-root", span, message);
    found.push(match held {
        Ok(()) => return,
        Err(Refused::Unknown) => {
            let message = format!("the robot `{}` has no link `{}`", cell.name, link.text);
            let error = Diagnostic::error("unknown-link", link.span, message);
            error.suggest(&link.text, cell.links().map(|(_, name)| name))
        }
        Err(Refused::NoRoot) => {
            let root = cell.body(&link.text).map_or(0, |at| cell.root(at));
            let message = format!("something holds `{}` already", link.text);
            let root = &cell.bodies[root].name;
            error(link.span, message).help(format!("the root of its tree is `{root}`"))
        }
        Err(Refused::Circle) => {
            let message = format!(
                "`{}` moves with `{}`, and cannot hold it",
                base.text, link.text
            );
            error(base.span, message)
                .help("write a link of another robot, or a new name, such as `world`")
        }
        Err(Refused::Taken) => {
            let message = format!("a joint has the name of `{}`", link.text);
            Diagnostic::error("duplicate-name", link.span, message)
        }
    });
}

/// The settings of a solver that hold for all its outputs.
pub(super) struct Conditions {
    /// Acceleration in m/s².
    pub(super) gravity: [f64; 3],
    /// Indices of coordinates that do not move.
    pub(super) held: Vec<usize>,
    /// Indices of coordinates without a motor.
    pub(super) passive: Vec<usize>,
}

impl Resolver<'_> {
    /// The loops of its robots, then those of a cell.
    pub(super) fn loops(&mut self, loops: &[ast::Loop]) {
        let robot = self.robot;
        let of_robots = robot.loops.iter().filter_map(|own| {
            let [first, second] = own.frames;
            let chain = robot.chain(first, second)?;
            let kept = own.kept;
            Some((Loop { chain, kept }, own.clone()))
        });
        (self.loops, self.closing) = of_robots.unzip();
        let mut known: HashMap<&str, Span> = HashMap::new();
        for closed in loops {
            let name = &closed.name;
            if let Some(first) = known.insert(&name.text, name.span) {
                let message = format!("the loop `{}` is declared twice", name.text);
                self.duplicate(name.span, message, first);
                continue;
            }
            if let [(first, _), (second, _), ..] = closed.joints.as_slice() {
                let message = "a loop has one joint".to_owned();
                self.duplicate(*second, message, *first);
            }
            let kept = match closed.joints.first() {
                None => Kept::Whole,
                Some((_, LoopKind::Point)) => Kept::Point,
                Some((span, LoopKind::Revolute(axis))) => {
                    let axis = self.axis(*span, axis);
                    Kept::Turning(self.choices.grounding.axis(axis))
                }
                Some((span, LoopKind::Prismatic(axis))) => {
                    let axis = self.axis(*span, axis);
                    Kept::Sliding(self.choices.grounding.direction(axis))
                }
            };
            let [(one, other)] = closed.pairs.as_slice() else {
                let message = format!(
                    "the loop `{}` connects {} pairs of frames",
                    name.text,
                    closed.pairs.len()
                );
                let error = Diagnostic::error("bad-loop", name.span, message);
                self.found
                    .push(error.help("write one pair: `loop NAME { FRAME = FRAME; };`"));
                continue;
            };
            let (first, second) = (self.body(one), self.body(other));
            let (Some(first), Some(second)) = (first, second) else {
                continue;
            };
            let Some(chain) = self.chain(first, second, other.span) else {
                continue;
            };
            if chain.coordinates().is_empty() {
                let message = format!("no joint moves `{}` in `{}`", other.text, one.text);
                self.error("bad-loop", other.span, message);
                continue;
            }
            self.loops.push(Loop { chain, kept });
            self.closing.push(LoopJoint {
                name: name.text.clone(),
                frames: [first, second],
                kept,
            });
        }
    }

    /// A direction of length 1. A wrong one is told.
    fn axis(&mut self, span: Span, numbers: &[Literal]) -> [f64; 3] {
        let mut axis = [0.0; 3];
        for (part, number) in axis.iter_mut().zip(numbers) {
            *part = number.as_f64().unwrap_or(f64::NAN);
        }
        let length = axis
            .iter()
            .fold(0.0, |length: f64, part| length.hypot(*part));
        if (1e-9..=1e9).contains(&length) {
            return axis.map(|part| part / length);
        }
        let message = format!("no axis has the direction {axis:?}");
        self.error("bad-value", span, message);
        [0.0, 0.0, 1.0]
    }

    /// The coordinates that a solver holds.
    pub(super) fn holding(&mut self, solver: &ast::Solver) -> Vec<usize> {
        let closes = |output: &ast::Output| {
            matches!(
                output.kind,
                OutputKind::ClosedPositions | OutputKind::ClosedVelocities
            )
        };
        if let [(first, _), (second, _), ..] = solver.holding.as_slice() {
            self.duplicate(*second, "`holding` occurs twice".to_owned(), *first);
        }
        if let Some((span, _)) = solver.holding.first()
            && !solver.outputs.iter().any(closes)
        {
            let message = "`holding` changes nothing: this solver gives no `closed_positions` and no `closed_velocities`";
            self.error("without-effect", *span, message.to_owned());
        }
        let joints = solver.holding.iter().flat_map(|(_, joints)| joints);
        joints.filter_map(|joint| self.coordinate(joint)).collect()
    }

    /// The coordinates of a solver that have no motor.
    pub(super) fn passive(&mut self, solver: &ast::Solver) -> Vec<usize> {
        let Some((span, _)) = solver.passive.first() else {
            return Vec::new();
        };
        if let [(first, _), (second, _), ..] = solver.passive.as_slice() {
            self.duplicate(*second, "`passive` occurs twice".to_owned(), *first);
        }
        let mut outputs = solver.outputs.iter();
        let has_efforts = outputs.any(|output| output.kind == OutputKind::Efforts);
        if !has_efforts {
            let message = "`passive` changes nothing: this solver gives no `efforts`";
            self.error("without-effect", *span, message.to_owned());
        }
        let joints = solver.passive.iter().flat_map(|(_, joints)| joints);
        let mut passive: Vec<usize> = joints.filter_map(|joint| self.coordinate(joint)).collect();
        passive.sort_unstable();
        passive.dedup();
        let moved = loops::moved_by_others(self.robot, &self.loops, &passive);
        // Without loops, the output is refused.
        if moved < passive.len() && has_efforts && !self.loops.is_empty() {
            let message = format!(
                "the loops move {moved} of {} joints without a motor",
                passive.len()
            );
            let error = Diagnostic::error("bad-loop", *span, message);
            self.found
                .push(error.help("leave the joints that have a motor out of `passive`"));
        }
        passive
    }

    /// An output of all loops: its name, its comment, its shape and its computation. `None` if it is another
    /// one, and an error if it is wrong.
    pub(super) fn of_loops(
        &mut self,
        output: &ast::Output,
        conditions: &Conditions,
    ) -> Result<Option<(&'static str, String, Shape, OfLoops)>, ()> {
        let Conditions {
            gravity,
            held,
            passive,
        } = conditions;
        let count = self.robot.coordinates.len();
        let rows = self.loops.iter().map(Loop::rows).sum();
        let order = "For each loop, the way from its first frame to its second one along the axes of the first one";
        let hinges = self.loops.iter().filter(|own| own.rows() == 5).count();
        let rest = if hinges > 0 {
            " Of the turn of a loop with `revolute`, and of the way of one with `prismatic`, there are two rows: along axes across that of the joint."
        } else {
            ""
        };
        let length = self.choices.length();
        let staying = "Joints that are held stay.";
        let found = match output.kind {
            OutputKind::LoopErrors => (
                "loop_errors",
                format!(
                    "{order}, in {length}, then the axis of the turn times twice the sine of half its angle.{rest}"
                ),
                Shape::Vector(rows),
                OfLoops::Errors,
            ),
            OutputKind::LoopJacobian => (
                "loop_jacobian",
                format!(
                    "{order}, in {length}, then the turn in rad, for each unit that a joint moves.{rest}"
                ),
                Shape::Matrix(rows, count),
                OfLoops::Jacobian,
            ),
            OutputKind::LoopForces => (
                "loop_forces",
                format!(
                    "For each loop, the force in N on its second frame along the axes of the first one, then the \
                    torque in Nm, under these efforts and a gravity of {gravity:?} m/s² in the root.{rest}"
                ),
                Shape::Vector(rows),
                OfLoops::Forces(*gravity),
            ),
            OutputKind::ClosedPositions => (
                "closed_positions",
                format!("The positions near these ones that close all loops. {staying}"),
                Shape::Vector(count),
                OfLoops::Positions(held.clone()),
            ),
            OutputKind::ClosedVelocities => (
                "closed_velocities",
                format!(
                    "The velocities nearest to these ones that keep all loops closed. {staying}"
                ),
                Shape::Vector(count),
                OfLoops::Velocities(held.clone()),
            ),
            OutputKind::Efforts if !passive.is_empty() => (
                "efforts",
                format!(
                    "The least torques in Nm, and forces in N of joints that slide, with which these accelerations keep all \
                    loops closed, under a gravity of {gravity:?} m/s² in the root. Those of joints without a motor are 0."
                ),
                Shape::Vector(count),
                OfLoops::Efforts(*gravity, passive.clone()),
            ),
            _ => return Ok(None),
        };
        if rows == 0 {
            // Of a loop with an error, that error is told.
            if !self.has_loops {
                let message = "there is no loop".to_owned();
                let error = Diagnostic::error("bad-loop", output.span, message);
                self.found
                    .push(error.help("write `loop NAME { FRAME = FRAME; };` before the solvers"));
            }
            return Err(());
        }
        Ok(Some(found))
    }
}
