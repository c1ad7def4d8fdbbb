//! Reads forward solvers in ILK: their operations become a formula.

use super::OPERATIONS;
use super::lua::{self, Kind, Table, Value};
use super::motion::{Joint, Known, moved, seen};
use crate::cell::{Cell, Choices, Output, Shape, Solver};
use crate::resolve::{identifier, is_taken};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_formula::{Recorder, Term};
use rc_quantity::rotation::{Matrix, cross, transposed};
use rc_quantity::{Real, Transform};
use rc_robot::Robot;
use rc_syntax::Loader;
use rc_vocabulary::Primitive;
use std::collections::BTreeMap;

/// The file with the constant poses of a robot, beside those of its solvers.
pub(super) const CONSTANTS: &str = "model-constants.lua";

/// The most joints, and operations of a file.
const MOST_JOINTS: usize = 200;
const MOST_OPERATIONS: usize = 10_000;

/// Reads a solver beside the constants of its robot. `None` if nothing is readable.
pub(crate) fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Option<Cell>, Diagnostics) {
    let (table, mut found) = lua::table(sources.text(source), source);
    let whole = Span::new(source, 0, 0);
    let Some(table) = table else {
        return (None, found);
    };
    let path = sources.path(source).to_path_buf();
    let constants = match loader.find(&path, CONSTANTS, "lua") {
        Ok(file) => {
            let source = sources.add(file.path, file.text);
            let (read, more) = lua::read(sources.text(source), source);
            found.extend(more);
            read
        }
        Err(error) => {
            found.push(error.diagnostic(CONSTANTS, "lua", whole));
            None
        }
    };
    let mut reader = Reader { found, whole };
    let cell = constants.and_then(|constants| reader.cell(&table, &constants));
    (cell, reader.found)
}

struct Reader {
    found: Diagnostics,
    whole: Span,
}

impl Reader {
    fn error(&mut self, span: Span, message: String) {
        self.found
            .push(Diagnostic::error("bad-value", span, message));
    }

    /// A field that a table needs.
    fn field<'v>(&mut self, table: &'v Table, place: Span, name: &str) -> Option<&'v Value> {
        let value = table.get(name);
        if value.is_none() {
            self.error(place, format!("`{name}` is missing"));
        }
        value
    }

    fn text<'v>(&mut self, table: &'v Table, place: Span, name: &str) -> Option<(&'v str, Span)> {
        let value = self.field(table, place, name)?;
        if let Kind::Text(text) = &value.kind {
            return Some((text, value.span));
        }
        self.error(value.span, format!("`{name}` is a text"));
        None
    }

    /// A table that may be missing: then it is empty.
    fn part(&mut self, table: &Table, name: &str) -> Table {
        match table.get(name) {
            None => Table::default(),
            Some(Value {
                kind: Kind::Table(table),
                ..
            }) => table.clone(),
            Some(value) => {
                self.error(value.span, format!("`{name}` is a table"));
                Table::default()
            }
        }
    }

    fn inner<'v>(&mut self, value: &'v Value) -> Option<&'v Table> {
        if let Kind::Table(table) = &value.kind {
            return Some(table);
        }
        self.error(value.span, "expected a table".to_owned());
        None
    }

    fn whole_number(&mut self, value: &Value, most: usize) -> Option<usize> {
        let number = match value.kind {
            Kind::Number(number) if number >= 0.0 && number.fract() == 0.0 => number,
            _ => -1.0,
        };
        let fits = number >= 0.0 && number <= most as f64;
        if !fits {
            self.error(value.span, format!("expected an integer from 0 to {most}"));
            return None;
        }
        Some(number as usize)
    }

    /// The value of a name.
    fn known<'k, V>(
        &mut self,
        known: &'k BTreeMap<String, V>,
        (name, span): (&str, Span),
        what: &str,
    ) -> Option<&'k V> {
        let value = known.get(name);
        if value.is_none() {
            let message = format!("no {what} `{name}` is known here");
            let error = Diagnostic::error("bad-value", span, message);
            self.found
                .push(error.suggest(name, known.keys().map(String::as_str)));
        }
        value
    }

    fn sign(&mut self, table: &Table) -> f64 {
        match table.get("polarity").map(|value| (&value.kind, value.span)) {
            None => 1.0,
            Some((Kind::Number(sign), _)) if sign.abs() == 1.0 => *sign,
            Some((_, span)) => {
                self.error(span, "a polarity is 1 or -1".to_owned());
                1.0
            }
        }
    }

    fn joints(&mut self, table: &Table) -> BTreeMap<String, Joint> {
        let mut joints = BTreeMap::new();
        for (name, value) in &self.part(table, "joints").fields {
            let Some(own) = self.inner(value) else {
                continue;
            };
            let kind = self.text(own, value.span, "kind");
            let place = self.field(own, value.span, "coordinate");
            let place = place.and_then(|place| self.whole_number(place, MOST_JOINTS));
            let (Some((kind, span)), Some(coordinate)) = (kind, place) else {
                continue;
            };
            let turns = match kind {
                "revolute" => true,
                "prismatic" => false,
                // It moves nothing.
                "fixed" => continue,
                _ => {
                    let message =
                        format!("expected `revolute`, `prismatic` or `fixed`, found `{kind}`");
                    self.error(span, message);
                    continue;
                }
            };
            joints.insert(name.text.clone(), Joint { coordinate, turns });
        }
        joints
    }

    /// The numbers of a pose: `p` and, by rows, `r`.
    fn constant(&mut self, value: &Value) -> Option<Transform> {
        let table = self.inner(value)?;
        let mut numbers = |name: &str, count: usize| -> Option<Vec<f64>> {
            let list = self.field(table, value.span, name)?;
            let items = self.inner(list)?.items.iter().map(|item| match item.kind {
                Kind::Number(number) => Some(number),
                _ => None,
            });
            let numbers = items.collect::<Option<Vec<f64>>>();
            let numbers = numbers.filter(|numbers| numbers.len() == count);
            if numbers.is_none() {
                self.error(list.span, format!("`{name}` has {count} numbers"));
            }
            numbers
        };
        let (place, turn) = (numbers("p", 3)?, numbers("r", 9)?);
        let rotation: Matrix =
            std::array::from_fn(|row| std::array::from_fn(|column| turn[3 * row + column]));
        let square = rc_quantity::rotation::product(&rotation, &transposed(&rotation));
        let is_turn = square.iter().enumerate().all(|(row, parts)| {
            let wanted = |column| if row == column { 1.0 } else { 0.0 };
            let mut parts = parts.iter().enumerate();
            parts.all(|(column, part)| (part - wanted(column)).abs() < 1e-6)
        });
        if !is_turn {
            self.error(value.span, "`r` is not a rotation matrix".to_owned());
            return None;
        }
        let translation = [place[0], place[1], place[2]];
        Some(Transform {
            rotation,
            translation,
        })
    }

    /// A name in printed code.
    fn printed(&mut self, text: &str, span: Span) -> String {
        let name = identifier(text);
        let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic());
        if !is_name || is_taken(&name) {
            self.error(span, format!("`{text}` cannot be a name in printed code"));
        }
        name
    }

    fn cell(&mut self, table: &Table, constants: &Value) -> Option<Cell> {
        let (kind, span) = self.text(table, self.whole, "solver_type")?;
        if kind != "forward" {
            let message = format!("only solvers of the type `forward` are read, found `{kind}`");
            let error = Diagnostic::error("bad-value", span, message);
            self.found.push(error.help(
                "an inverse solver of ILK has no operations: write `inverse pose TIP in BASE;` in a .kdsl",
            ));
            return None;
        }
        let mut name = |field| {
            let (text, span) = self.text(table, self.whole, field)?;
            Some(self.printed(text, span))
        };
        let (solver, robot) = (name("solverid")?, name("robot_name")?);
        let joints = self.joints(table);
        let most = joints.values().map(|joint| joint.coordinate + 1).max();
        let mut coordinates: Vec<String> = vec![String::new(); most.unwrap_or(0)];
        for (name, joint) in &joints {
            coordinates[joint.coordinate].clone_from(name);
        }
        if let Some(at) = coordinates.iter().position(String::is_empty) {
            self.error(self.whole, format!("no joint has the coordinate {at}"));
            return None;
        }
        let count = coordinates.len();
        let recorder = Recorder::new(4 * count);
        let input = |at: usize| recorder.input(at, Primitive::F64);
        let positions: Vec<Term<'_>> = (0..count).map(input).collect();
        let velocities: Vec<Term<'_>> = (count..2 * count).map(input).collect();
        let mut known = self.poses(table, constants, &joints, &positions)?;
        self.twists(table, &joints, &velocities, &mut known);
        self.operations(table, &joints, count, &mut known);
        let (outputs, numbers) = self.outputs(table, &known);
        if self.found.has_errors() {
            return None;
        }
        let program = recorder.program(&numbers);
        if !program.is_finite() {
            let message = "its poses are too great: their products have no float64".to_owned();
            self.error(self.whole, message);
            return None;
        }
        let solver = Solver {
            doc: vec![format!("The solver `{solver}` of a model in ILK.")],
            name: solver,
            takes_velocities: outputs
                .iter()
                .any(|output| output.shape == Shape::Vector(6)),
            takes_accelerations: false,
            takes_efforts: false,
            payloads: Vec::new(),
            outputs,
            program,
        };
        Some(Cell {
            name: format!("{robot}_{}", solver.name),
            choices: Choices::default(),
            robot: Robot {
                name: robot,
                bodies: Vec::new(),
                coordinates,
            },
            solvers: vec![solver],
            inverses: Vec::new(),
        })
    }

    fn poses<'r>(
        &mut self,
        table: &Table,
        constants: &Value,
        joints: &BTreeMap<String, Joint>,
        positions: &[Term<'r>],
    ) -> Option<Known<Term<'r>>> {
        let mut known = Known {
            poses: BTreeMap::new(),
            twists: BTreeMap::new(),
            jacobians: BTreeMap::new(),
        };
        let values = self.inner(constants)?;
        let values = self.part(values, "poses");
        let poses = self.part(table, "poses");
        for (name, _) in &self.part(&poses, "constant").fields {
            let Some(value) = values.get(&name.text) else {
                let message = format!("{CONSTANTS} has no pose `{}`", name.text);
                let error = Diagnostic::error("bad-value", name.span, message);
                let names = values.fields.iter().map(|(name, _)| name.text.as_str());
                self.found.push(error.suggest(&name.text, names));
                continue;
            };
            if let Some(pose) = self.constant(value) {
                known.poses.insert(name.text.clone(), pose.constant());
            }
        }
        for (name, value) in &self.part(&poses, "joint").fields {
            let Some(own) = self.inner(value) else {
                continue;
            };
            let joint = self.text(own, value.span, "joint");
            let direction = self.text(own, value.span, "dir");
            let (Some(joint), Some((direction, span))) = (joint, direction) else {
                continue;
            };
            let Some(joint) = self.known(joints, joint, "joint").copied() else {
                continue;
            };
            let pose = moved(joint, positions[joint.coordinate]);
            let pose = match direction {
                "a_x_b" => pose,
                "b_x_a" => pose.inverse(),
                _ => {
                    self.error(
                        span,
                        format!("expected `a_x_b` or `b_x_a`, found `{direction}`"),
                    );
                    continue;
                }
            };
            known.poses.insert(name.text.clone(), pose);
        }
        Some(known)
    }

    fn twists<'r>(
        &mut self,
        table: &Table,
        joints: &BTreeMap<String, Joint>,
        velocities: &[Term<'r>],
        known: &mut Known<Term<'r>>,
    ) {
        for (name, value) in &self.part(table, "joint_vel_twists").fields {
            let Some(own) = self.inner(value) else {
                continue;
            };
            let joint = self.text(own, value.span, "joint");
            let joint = joint.and_then(|joint| self.known(joints, joint, "joint").copied());
            let Some(joint) = joint else { continue };
            let sign = self.sign(own);
            let rate = velocities[joint.coordinate] * Term::constant(sign);
            let (zero, axis) = ([Term::constant(0.0); 3], [0.0, 0.0, 1.0]);
            let along = axis.map(|part| rate * Term::constant(part));
            let mut twist = if joint.turns {
                [along, zero]
            } else {
                [zero, along]
            };
            // The predecessor in the successor: seen from the predecessor.
            if sign < 0.0 {
                let frame = self.text(own, value.span, "ctransform");
                let frame = frame.and_then(|name| self.known(&known.poses, name, "pose"));
                let Some(frame) = frame else { continue };
                twist = seen(frame, twist);
            }
            known.twists.insert(name.text.clone(), twist);
        }
    }

    fn operations(
        &mut self,
        table: &Table,
        joints: &BTreeMap<String, Joint>,
        count: usize,
        known: &mut Known<Term<'_>>,
    ) {
        let operations = self.part(table, "ops").items;
        if operations.len() > MOST_OPERATIONS {
            let message = format!("at most {MOST_OPERATIONS} operations are read");
            self.error(operations[MOST_OPERATIONS].span, message);
            return;
        }
        for value in &operations {
            let Some(own) = self.inner(value) else {
                continue;
            };
            let Some((name, span)) = self.text(own, value.span, "op") else {
                continue;
            };
            let words = OPERATIONS.map(|(name, _)| name);
            if !words.contains(&name) {
                let message = format!("the operation `{name}` is not read");
                let error = Diagnostic::error("bad-value", span, message);
                let error = error.help(format!("expected one of {}", words.join(", ")));
                self.found.push(error.suggest(name, words));
                continue;
            }
            // Findings are told at each operation: one that lacks its operands gives nothing.
            let _ = self.operation(name, (own, value.span), joints, count, known);
        }
    }

    fn operation<'r>(
        &mut self,
        name: &str,
        (own, place): (&Table, Span),
        joints: &BTreeMap<String, Joint>,
        count: usize,
        known: &mut Known<Term<'r>>,
    ) -> Option<()> {
        match name {
            "pose-compose" => {
                let one = self.text(own, place, "arg1")?;
                let other = self.text(own, place, "arg2")?;
                let (result, span) = self.text(own, place, "res")?;
                self.fits([one.0, other.0, result], span);
                let inner = *self.known(&known.poses, one, "pose")?;
                let outer = *self.known(&known.poses, other, "pose")?;
                known.poses.insert(result.to_owned(), outer.then(&inner));
            }
            "joint-vel-twist" => {
                let twist = self.text(own, place, "arg")?;
                self.known(&known.twists, twist, "velocity")?;
            }
            "vel-compose" => {
                let one = self.text(own, place, "arg1")?;
                let other = self.text(own, place, "arg2")?;
                let pose = self.text(own, place, "pose")?;
                let (result, _) = self.text(own, place, "res")?;
                let own = *self.known(&known.twists, one, "velocity")?;
                let other = *self.known(&known.twists, other, "velocity")?;
                let frame = self.known(&known.poses, pose, "pose")?;
                let other = seen(frame, other);
                let part = |at: usize| std::array::from_fn(|part| own[at][part] + other[at][part]);
                known.twists.insert(result.to_owned(), [part(0), part(1)]);
            }
            "geom-jacobian" => {
                let (name, _) = self.text(own, place, "name")?;
                let pose = self.text(own, place, "pose")?;
                let columns = match own.get("columns") {
                    Some(value) => self.whole_number(value, MOST_JOINTS)?,
                    None => count,
                };
                let origin = self.known(&known.poses, pose, "pose")?.translation;
                let zeros = vec![[Term::constant(0.0); 6]; columns];
                known.jacobians.insert(name.to_owned(), (origin, zeros));
            }
            _ => {
                let joint = self.text(own, place, "joint")?;
                let joint = *self.known(joints, joint, "joint")?;
                let jacobian = self.text(own, place, "jac")?;
                let pose = self.text(own, place, "joint_pose")?;
                let column = self.field(own, place, "col")?;
                let at = self.whole_number(column, MOST_JOINTS)?;
                let sign = Term::constant(self.sign(own));
                let (origin, columns) = self.known(&known.jacobians, jacobian, "Jacobian")?;
                if at >= columns.len() {
                    let message = format!("the Jacobian has {} columns, from 0 on", columns.len());
                    self.error(column.span, message);
                    return None;
                }
                let origin = *origin;
                let frame = self.known(&known.poses, pose, "pose")?;
                let axis = frame.rotation.map(|row| row[2] * sign);
                let arm: [Term<'r>; 3] =
                    std::array::from_fn(|part| origin[part] - frame.translation[part]);
                let zero = [Term::constant(0.0); 3];
                let parts = if joint.turns {
                    [axis, cross(axis, arm)]
                } else {
                    [zero, axis]
                };
                let (_, columns) = known.jacobians.get_mut(jacobian.0)?;
                columns[at] = std::array::from_fn(|row| parts[row / 3][row % 3]);
            }
        }
        Some(())
    }

    /// Whether the names of poses say that one is in the frame of the other one: `a__b` and `b__c` give `a__c`.
    fn fits(&mut self, names: [&str; 3], span: Span) {
        let halves = names.map(|name| name.split_once("__"));
        let [
            Some((target, middle)),
            Some((same, reference)),
            Some(result),
        ] = halves
        else {
            return;
        };
        // A name with more of these characters says nothing.
        let is_plain = names.iter().all(|name| name.matches("__").count() == 1);
        if is_plain && (middle != same || result != (target, reference)) {
            let message = format!(
                "`{}` and `{}` do not give `{}`: expected `{target}__{middle}`, `{middle}__{reference}` and `{target}__{reference}`",
                names[0], names[1], names[2]
            );
            self.error(span, message);
        }
    }

    fn outputs<T: Real>(&mut self, table: &Table, known: &Known<T>) -> (Vec<Output>, Vec<T>) {
        let mut sorted = Vec::new();
        let listed = self.part(table, "outputs");
        for (name, value) in &listed.fields {
            let Some(own) = self.inner(value) else {
                continue;
            };
            let place = match own.get("usersort") {
                Some(place) => self.whole_number(place, MOST_OPERATIONS),
                None => Some(sorted.len()),
            };
            let (Some(place), Some(kind)) = (place, self.text(own, value.span, "otype")) else {
                continue;
            };
            sorted.push((place, name, kind));
        }
        if sorted.is_empty() {
            self.error(self.whole, "the solver has no `outputs`".to_owned());
        }
        sorted.sort_by_key(|(place, ..)| *place);
        let (mut outputs, mut numbers) = (Vec::new(), Vec::new());
        let mut names: BTreeMap<String, Span> = BTreeMap::new();
        for (_, name, (kind, span)) in sorted {
            let asked = (name.text.as_str(), name.span);
            let (doc, shape, own) = match kind {
                "pose" => {
                    let Some(pose) = self.known(&known.poses, asked, "pose") else {
                        continue;
                    };
                    let rows = pose.rotation.iter().zip(pose.translation);
                    let rows = rows.flat_map(|(row, place)| [row[0], row[1], row[2], place]);
                    let last = [0.0, 0.0, 0.0, 1.0].map(T::constant);
                    let own: Vec<T> = rows.chain(last).collect();
                    (
                        "The homogeneous matrix for columns.",
                        Shape::Matrix(4, 4),
                        own,
                    )
                }
                "velocity" => {
                    let Some(twist) = self.known(&known.twists, asked, "velocity") else {
                        continue;
                    };
                    let doc = "The angular velocity, then that of the origin, along the axes of the frame that moves.";
                    (doc, Shape::Vector(6), twist.concat())
                }
                "jacobian" => {
                    let Some((_, columns)) = self.known(&known.jacobians, asked, "Jacobian") else {
                        continue;
                    };
                    let rows = (0..6).flat_map(|row| columns.iter().map(move |one| one[row]));
                    let doc = "For each joint, a column: the angular velocity, then that of the origin, along the axes of the reference.";
                    (doc, Shape::Matrix(6, columns.len()), rows.collect())
                }
                _ => {
                    let message =
                        format!("expected `pose`, `velocity` or `jacobian`, found `{kind}`");
                    self.error(span, message);
                    continue;
                }
            };
            numbers.extend(own);
            let printed = self.printed(&name.text, name.span);
            if let Some(first) = names.insert(printed.clone(), name.span) {
                let message = format!("`{}` is `{printed}` in printed code", name.text);
                let error = Diagnostic::error("duplicate-name", name.span, message);
                self.found.push(error.label(first, "so is this output"));
            }
            outputs.push(Output {
                name: printed,
                // A line of a comment stays one.
                doc: format!("`{}`. {doc}", name.text).replace(char::is_control, " "),
                shape,
                asked: None,
            });
        }
        (outputs, numbers)
    }
}
