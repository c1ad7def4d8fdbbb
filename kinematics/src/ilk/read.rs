//! Reads forward solvers in ILK: their operations become a formula.

use super::lua::{self, Kind, Table, Value};
use super::motion::{Acceleration, Joint, Known, moved, seen};
use crate::cell::{Cell, Choices, Output, Shape, Solver};
use crate::names::{identifier, is_taken};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_formula::{Operation, Recorder, Term};
use rc_quantity::rotation::{Matrix, transposed};
use rc_quantity::{Real, Transform};
use rc_robot::Robot;
use rc_syntax::Loader;
use rc_vocabulary::Primitive;
use std::collections::BTreeMap;

/// The file with the constant poses of a robot, beside those of its solvers.
pub(super) const CONSTANTS: &str = "model-constants.lua";

/// The most joints, and operations of a file.
pub(super) const MOST_JOINTS: usize = 200;
pub(super) const MOST_OPERATIONS: usize = 10_000;

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

pub(super) struct Reader {
    pub(super) found: Diagnostics,
    whole: Span,
}

impl Reader {
    pub(super) fn error(&mut self, span: Span, message: String) {
        self.found
            .push(Diagnostic::error("bad-value", span, message));
    }

    /// A field that a table needs.
    pub(super) fn field<'v>(
        &mut self,
        table: &'v Table,
        place: Span,
        name: &str,
    ) -> Option<&'v Value> {
        let value = table.get(name);
        if value.is_none() {
            self.error(place, format!("`{name}` is missing"));
        }
        value
    }

    pub(super) fn text<'v>(
        &mut self,
        table: &'v Table,
        place: Span,
        name: &str,
    ) -> Option<(&'v str, Span)> {
        let value = self.field(table, place, name)?;
        if let Kind::Text(text) = &value.kind {
            return Some((text, value.span));
        }
        self.error(value.span, format!("`{name}` is a text"));
        None
    }

    /// A table that may be missing: then it is empty.
    pub(super) fn part(&mut self, table: &Table, name: &str) -> Table {
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

    pub(super) fn inner<'v>(&mut self, value: &'v Value) -> Option<&'v Table> {
        if let Kind::Table(table) = &value.kind {
            return Some(table);
        }
        self.error(value.span, "expected a table".to_owned());
        None
    }

    pub(super) fn whole_number(&mut self, value: &Value, most: usize) -> Option<usize> {
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
    pub(super) fn known<'k, V>(
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

    pub(super) fn sign(&mut self, table: &Table) -> f64 {
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
            if let Some(joint) = kind.and_then(|kind| self.of_kind(kind, own, value.span)) {
                joints.insert(name.text.clone(), joint);
            }
        }
        // Older models have no list: their poses say the kind and the number of each joint.
        let poses = self.part(table, "poses");
        for (_, value) in &self.part(&poses, "joint").fields {
            let Kind::Table(own) = &value.kind else {
                continue;
            };
            let input = own.get("input").map(|input| &input.kind);
            if own.get("joint").is_none()
                && let Some(Kind::Number(at)) = input
                && !joints
                    .values()
                    .any(|joint| joint.coordinate().is_some_and(|known| known as f64 == *at))
                && let Some(joint) = self.joint_of(own, value.span, &joints)
            {
                joints.insert(format!("joint_{at}"), joint);
            }
        }
        joints
    }

    fn of_kind(&mut self, (kind, at): (&str, Span), own: &Table, place: Span) -> Option<Joint> {
        let make = match kind {
            "revolute" => Joint::Turns,
            "prismatic" => Joint::Slides,
            "fixed" => return Some(Joint::Fixed),
            _ => {
                let message =
                    format!("expected `revolute`, `prismatic` or `fixed`, found `{kind}`");
                self.error(at, message);
                return None;
            }
        };
        let names = ["input", "index", "col"];
        let number = names.into_iter().find_map(|name| own.get(name));
        let number = match number {
            Some(number) => number,
            None => self.field(own, place, "coordinate")?,
        };
        Some(make(self.whole_number(number, MOST_JOINTS)?))
    }

    /// The joint that a table names; of older models, the one that it describes.
    pub(super) fn joint_of(
        &mut self,
        own: &Table,
        place: Span,
        joints: &BTreeMap<String, Joint>,
    ) -> Option<Joint> {
        if own.get("joint").is_none() && own.get("jtype").is_some() {
            let kind = self.text(own, place, "jtype")?;
            return self.of_kind(kind, own, place);
        }
        let name = self.text(own, place, "joint")?;
        self.known(joints, name, "joint").copied()
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
        let numbers = || {
            joints
                .iter()
                .filter_map(|(name, joint)| Some((name, joint.coordinate()?)))
        };
        let most = numbers().map(|(_, at)| at + 1).max();
        let mut coordinates: Vec<String> = vec![String::new(); most.unwrap_or(0)];
        for (name, at) in numbers() {
            coordinates[at].clone_from(name);
        }
        if let Some(at) = coordinates.iter().position(String::is_empty) {
            self.error(self.whole, format!("no joint has the coordinate {at}"));
            return None;
        }
        let count = coordinates.len();
        let recorder = Recorder::new(4 * count);
        let input = |at: usize| recorder.input(at, Primitive::F64);
        let array = |from: usize| -> Vec<Term<'_>> {
            (from * count..(from + 1) * count).map(input).collect()
        };
        let mut known = self.poses(table, constants, &joints, &array(0))?;
        self.twists(table, &joints, [&array(1), &array(2)], &mut known);
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
        let takes = |array: usize| {
            let mut nodes = program.nodes().iter();
            nodes.any(|node| matches!(node.operation, Operation::Input(at) if at / count == array))
        };
        let solver = Solver {
            doc: vec![format!("The solver `{solver}` of a model in ILK.")],
            name: solver,
            takes_velocities: takes(1),
            takes_accelerations: takes(2),
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
                coordinates,
                ..Robot::default()
            },
            loops: Vec::new(),
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
            accelerations: BTreeMap::new(),
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
            let joint = self.joint_of(own, value.span, joints);
            let direction = self.text(own, value.span, "dir");
            let (Some(joint), Some((direction, span))) = (joint, direction) else {
                continue;
            };
            if joint.coordinate().is_some_and(|at| at >= positions.len()) {
                self.error(value.span, format!("there are {} joints", positions.len()));
                continue;
            }
            let pose = moved(joint, positions);
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

    /// The velocities and accelerations that joints give. Older models have `joint_velocities`.
    fn twists<'r>(
        &mut self,
        table: &Table,
        joints: &BTreeMap<String, Joint>,
        [velocities, accelerations]: [&[Term<'r>]; 2],
        known: &mut Known<Term<'r>>,
    ) {
        for list in ["joint_vel_twists", "joint_velocities", "joint_acc_twists"] {
            for (name, value) in &self.part(table, list).fields {
                let Some(own) = self.inner(value) else {
                    continue;
                };
                let Some(joint) = self.joint_of(own, value.span, joints) else {
                    continue;
                };
                if joint.coordinate().is_some_and(|at| at >= velocities.len()) {
                    self.error(value.span, format!("there are {} joints", velocities.len()));
                    continue;
                }
                let sign = self.sign(own);
                let mut twists = [velocities, accelerations].map(|rates| joint.twist(rates, sign));
                // The predecessor in the successor: seen from the predecessor.
                if sign < 0.0 {
                    let frame = self.text(own, value.span, "ctransform");
                    let frame = frame.and_then(|name| self.known(&known.poses, name, "pose"));
                    let Some(frame) = frame else { continue };
                    twists = twists.map(|twist| seen(frame, twist));
                }
                let [velocity, rate] = twists;
                if list == "joint_acc_twists" {
                    let own = Acceleration { rate, velocity };
                    known.accelerations.insert(name.text.clone(), own);
                } else {
                    known.twists.insert(name.text.clone(), velocity);
                }
            }
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
                "acceleration" => {
                    let own = self.known(&known.accelerations, asked, "acceleration");
                    let Some(own) = own else { continue };
                    let doc = "The spatial acceleration along the axes of the frame that moves: the angular one, then that of the origin less ω × v.";
                    (doc, Shape::Vector(6), own.rate.concat())
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
                    let message = format!(
                        "expected `pose`, `velocity`, `acceleration` or `jacobian`, found `{kind}`"
                    );
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
