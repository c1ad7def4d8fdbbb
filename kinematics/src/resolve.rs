//! Resolves the names of a text in its robot.

mod cells;
mod driven;
mod grounding;
mod inverse;
mod tree;

use self::cells::Conditions;
use crate::ast::{self, MotionPart, OutputKind, Quantity};
use crate::cell::{
    Asked, Cell, Choices, Computed, Output, Payload, Shape, Solver, Subject, recorded,
};
use crate::names::{ARRAYS, identifier, is_taken, type_name};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_quantity::Unit;
use rc_robot::loops::Loop;
use rc_robot::{Chain, Grounding, LoopJoint, Robot, dynamics};
use rc_syntax::{Loader, Name};
use std::collections::{BTreeMap, HashMap};

/// The greatest acceleration of free fall, in m/s², that a file may say.
const MOST_GRAVITY: f64 = 1e6;

/// The most numbers that all outputs of a solver have. Each becomes operations of printed code.
const MOST_NUMBERS: usize = 20_000;

/// The most joints that the algorithms of all solvers of a file pass. Each takes some tens of operations.
const MOST_STEPS: usize = 20_000;

/// What is not told of a solver with text that was not understood: what it lacks may stand there.
const FOLLOWS: [&str; 3] = ["without-effect", "empty-solver", "missing-period"];

/// Loads one `.kdsl` text with its robot, or an `.ilk` text with the constants of its robot. `None` if nothing is readable. Use the cell only if no
/// diagnostic is an error.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Option<Cell>, Diagnostics) {
    let ending = sources.path(source).extension();
    if ending.is_some_and(|ending| ending == "ilk") {
        return crate::ilk::load(sources, loader, source);
    }
    let (file, mut found) = parse(sources, source);
    let Some(kinematics) = &file.kinematics else {
        return (None, found);
    };
    let robots = cells::robots(sources, (loader, source), &file, kinematics, &mut found);
    let choices = grounding::choices(&kinematics.choices, &mut found);
    let Some(robot) = robots else {
        return (None, found);
    };
    let is_usual = choices.grounding == Grounding::default();
    let robot = if is_usual {
        robot
    } else {
        choices.grounding.of(&robot)
    };
    let mut resolver = Resolver {
        robot: &robot,
        choices,
        bodies: robot.links().map(|(at, name)| (name, at)).collect(),
        loops: Vec::new(),
        has_loops: !kinematics.loops.is_empty(),
        closing: Vec::new(),
        found,
        steps: 0,
        postures: BTreeMap::new(),
    };
    resolver.reserved(&kinematics.name, "the kinematics");
    // Printed code has a function and a type for each solver.
    let mut known: HashMap<String, Span> = HashMap::new();
    let (mut solvers, mut inverses) = (Vec::new(), Vec::new());
    resolver.loops(&kinematics.loops);
    resolver.postures(&kinematics.postures);
    for solver in &kinematics.solvers {
        let name = &solver.name;
        resolver.reserved(name, "a solver");
        let names = [name.text.clone(), type_name(&name.text)];
        if let Some(first) = names.iter().find_map(|name| known.get(name)) {
            let message = format!(
                "`{}` is declared twice, or has the type of another one",
                name.text
            );
            resolver.duplicate(name.span, message, *first);
            continue;
        }
        known.extend(names.map(|of| (of, name.span)));
        let before = std::mem::take(&mut resolver.found);
        match solver.inverses.first() {
            Some(asked) => inverses.extend(resolver.inverse(solver, asked)),
            None => solvers.extend(resolver.solver(solver)),
        }
        let told = std::mem::replace(&mut resolver.found, before).into_iter();
        resolver
            .found
            .extend(told.filter(|told| solver.is_whole || !FOLLOWS.contains(&told.code)));
    }
    let (found, loops) = (resolver.found, resolver.closing);
    let name = kinematics.name.text.clone();
    let cell = Cell {
        name,
        choices,
        robot,
        loops,
        solvers,
        inverses,
    };
    (Some(cell), found)
}

struct Resolver<'r> {
    robot: &'r Robot,
    choices: Choices,
    /// The places of bodies by name.
    bodies: HashMap<&'r str, usize>,
    loops: Vec<Loop<'r>>,
    /// Whether the file declares any, also with errors.
    has_loops: bool,
    /// The joints that close them.
    closing: Vec<LoopJoint>,
    found: Diagnostics,
    /// The joints that all solvers so far pass.
    steps: usize,
    /// The positions of all coordinates, by the names of postures.
    postures: BTreeMap<String, Vec<f64>>,
}

/// A number in this unit. A number without a unit is in it.
fn quantity(found: &mut Diagnostics, quantity: &Quantity, wanted: &str) -> Option<f64> {
    let value = quantity.number.as_f64().filter(|value| value.is_finite());
    let Some(value) = value else {
        let message = format!("expected a number, found {}", quantity.number.described());
        found.push(Diagnostic::error(
            "bad-value",
            quantity.number.span,
            message,
        ));
        return None;
    };
    let Some(unit) = &quantity.unit else {
        return Some(value);
    };
    let given = Unit::parse(&unit.text).ok();
    let conversion = given
        .zip(Unit::parse(wanted).ok())
        .and_then(|(given, wanted)| given.conversion_to(&wanted));
    if conversion.is_none() {
        let message = format!("expected a number in `{wanted}`, found `{}`", unit.text);
        let error = Diagnostic::error("bad-value", unit.span, message);
        found.push(error.help(format!("write `{wanted}`, or a unit that converts into it")));
    }
    Some(conversion?.apply(value))
}

impl<'r> Resolver<'r> {
    fn error(&mut self, code: &'static str, span: Span, message: String) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    fn duplicate(&mut self, span: Span, message: String, first: Span) {
        let error = Diagnostic::error("duplicate-name", span, message);
        self.found.push(error.label(first, "first declared here"));
    }

    /// Printed code cannot have all names.
    fn reserved(&mut self, name: &Name, of: &str) {
        if is_taken(&name.text) {
            let message = format!(
                "`{}` cannot be the name of {of}: printed code has it for something else",
                name.text
            );
            self.error("reserved-in-code", name.span, message);
        }
    }

    fn too_great(&mut self, span: Span) {
        let message = format!(
            "the numbers of the robot `{}` are too great: their products have no float64",
            self.robot.name
        );
        self.error("bad-value", span, message);
    }

    fn body(&mut self, name: &Name) -> Option<usize> {
        let found = self.bodies.get(name.text.as_str()).copied();
        if found.is_none() {
            let message = format!(
                "the robot `{}` has no link `{}`",
                self.robot.name, name.text
            );
            let error = Diagnostic::error("unknown-link", name.span, message);
            let known = self.robot.links().map(|(_, name)| name);
            self.found.push(error.suggest(&name.text, known));
        }
        found
    }

    fn chain(&mut self, base: usize, tip: usize, span: Span) -> Option<Chain<'r>> {
        let chain = self.robot.chain(base, tip);
        if chain.is_none() {
            let bodies = &self.robot.bodies;
            let message = format!(
                "nothing connects `{}` and `{}`: they are parts of different robots",
                bodies[base].name, bodies[tip].name
            );
            let error = Diagnostic::error("unconnected-frames", span, message);
            let root = &bodies[self.robot.root(tip)].name;
            self.found.push(error.help(format!(
                "write where one is, such as `fixed {root} in {} at 1 m, 0, 0;`",
                bodies[base].name
            )));
        }
        chain
    }

    fn gravity(&mut self, solver: &ast::Solver) -> [f64; 3] {
        let mut gravity = [0.0, 0.0, -9.80665];
        if let [(first, _), (second, _), ..] = solver.gravity.as_slice() {
            let message = "`gravity` occurs twice".to_owned();
            self.duplicate(*second, message, *first);
        }
        let given = solver.gravity.iter().flat_map(|(_, numbers)| numbers);
        for (part, literal) in gravity.iter_mut().zip(given) {
            if let Some(value) = literal.as_f64().filter(|value| value.abs() <= MOST_GRAVITY) {
                *part = value;
                continue;
            }
            let message = format!(
                "expected an acceleration up to {MOST_GRAVITY} m/s², found {}",
                literal.described()
            );
            self.error("bad-value", literal.span, message);
        }
        let needs = |output: &ast::Output| {
            matches!(
                output.kind,
                OutputKind::Efforts | OutputKind::Accelerations | OutputKind::LoopForces
            )
        };
        if let Some((span, _)) = solver.gravity.first()
            && !solver.outputs.iter().any(needs)
        {
            let message =
                "`gravity` changes nothing: this solver gives no `efforts`, `accelerations` or `loop_forces`"
                    .to_owned();
            self.found
                .push(Diagnostic::warning("without-effect", *span, message));
        }
        // It is along the axes of the URDF.
        self.choices.grounding.direction(gravity)
    }

    fn solver(&mut self, solver: &ast::Solver) -> Option<Solver> {
        self.without_settings(solver);
        self.check_side(solver);
        let conditions = Conditions {
            gravity: self.gravity(solver),
            held: self.holding(solver),
            passive: self.passive(solver),
        };
        let mut known: HashMap<String, Span> = HashMap::new();
        let (mut outputs, mut computed, mut numbers) = (Vec::new(), Vec::new(), 0);
        for output in &solver.outputs {
            let Some((described, what)) = self.output(output, &conditions) else {
                continue;
            };
            if let Some(first) = known.get(&described.name) {
                let message = format!("the solver gives `{}` twice", described.name);
                self.duplicate(output.span, message, *first);
                continue;
            }
            numbers += described.shape.size();
            self.steps += what.steps(self.robot, &self.loops);
            if numbers > MOST_NUMBERS || self.steps > MOST_STEPS {
                let message = format!(
                    "too much for printed code: a solver gives at most {MOST_NUMBERS} numbers, and those of a \
                    file pass at most {MOST_STEPS} joints"
                );
                let error = Diagnostic::error("too-many-numbers", output.span, message);
                self.found
                    .push(error.help("write several solvers, or several files"));
                return None;
            }
            known.insert(described.name.clone(), output.span);
            outputs.push(described);
            computed.push(what);
        }
        if solver.outputs.is_empty() {
            let message = format!("the solver `{}` gives nothing", solver.name.text);
            let error = Diagnostic::error("empty-solver", solver.name.span, message);
            self.found
                .push(error.help("write what it computes, such as `pose TIP in BASE;`"));
        }
        let needs = |of: fn((bool, bool)) -> bool| {
            computed.iter().any(|what: &Computed<'_>| of(what.needs()))
        };
        let (payloads, bodies) = self.payloads(solver, &computed);
        let subject = Subject {
            robot: self.robot,
            loops: &self.loops,
            payloads: &bodies,
        };
        let program = recorded(&subject, &computed);
        if !self.fits(&program) {
            self.too_great(solver.name.span);
            return None;
        }
        Some(Solver {
            name: solver.name.text.clone(),
            doc: solver.doc.clone(),
            takes_velocities: needs(|(velocities, _)| velocities),
            takes_accelerations: needs(|(_, accelerations)| accelerations),
            takes_efforts: computed.iter().any(Computed::needs_efforts),
            payloads,
            program,
            outputs,
        })
    }

    /// The payloads of a solver, and the bodies that carry them.
    fn payloads(
        &mut self,
        solver: &ast::Solver,
        computed: &[Computed<'_>],
    ) -> (Vec<Payload>, Vec<usize>) {
        let (mut payloads, mut bodies) = (Vec::new(), Vec::new());
        let mut known: HashMap<&str, Span> = HashMap::new();
        for payload in &solver.payloads {
            let name = &payload.name;
            self.reserved(name, "a payload");
            if ARRAYS.contains(&name.text.as_str()) {
                let message = format!("`{}` is the name of another argument", name.text);
                self.error("reserved-in-code", name.span, message);
                continue;
            }
            if let Some(first) = known.insert(&name.text, name.span) {
                let message = format!("the payload `{}` is declared twice", name.text);
                self.duplicate(name.span, message, first);
                continue;
            }
            let Some(body) = self.body(&payload.link) else {
                continue;
            };
            if !computed.is_empty() && !computed.iter().any(Computed::has_masses) {
                let message = "`payload` changes nothing: this solver computes no masses";
                self.error("without-effect", payload.span, message.to_owned());
            }
            let doc = format!(
                "`{}`: what `{}` carries: the mass in kg, the centre of mass in its frame in m (3 numbers), and the \
                moments xx, xy, xz, yy, yz and zz about that centre along the axes of the frame in kg m².",
                name.text, payload.link.text
            );
            payloads.push(Payload {
                name: name.text.clone(),
                doc: doc.replace(char::is_control, " "),
            });
            bodies.push(body);
        }
        (payloads, bodies)
    }

    fn output(
        &mut self,
        output: &ast::Output,
        conditions: &Conditions,
    ) -> Option<(Output, Computed<'r>)> {
        if !self.is_chosen(output, &conditions.passive) {
            return None;
        }
        let count = self.robot.coordinates.len();
        let gravity = conditions.gravity;
        let described = |name: &str, doc: String, shape| Output {
            name: name.to_owned(),
            // Names of links may have any character. A line of a comment stays one.
            doc: doc.replace(char::is_control, " "),
            shape,
            asked: None,
        };
        let is_of_joints = match &output.kind {
            OutputKind::Motion { what, .. } => *what == MotionPart::Jacobian,
            _ => true,
        };
        if is_of_joints && count == 0 {
            let message = format!("the robot `{}` has no joint that moves", self.robot.name);
            self.error("empty-solver", output.span, message);
            return None;
        }
        let has_accelerations =
            [OutputKind::Accelerations, OutputKind::LoopForces].contains(&output.kind);
        if has_accelerations && let Some(joint) = dynamics::weightless(self.robot) {
            let name = &self.robot.coordinates[joint];
            let message =
                format!("the joint `{name}` moves no mass: an effort gives it no acceleration");
            let error = Diagnostic::error("weightless-joint", output.span, message);
            self.found.push(
                error.help(
                    "the URDF needs `inertial` with mass and moments for links that it moves",
                ),
            );
            return None;
        }
        if let Some((name, doc, shape, computed)) = self.of_loops(output, conditions).ok()? {
            return Some((described(name, doc, shape), Computed::Closed(computed)));
        }
        if let OutputKind::Driven { side, rate } = output.kind {
            let (doc, factors) = self.driven(output.span, side, rate)?;
            let name = format!("{}_{}", side.word(), rate.word());
            let output = described(&name, doc, Shape::Vector(count));
            return Some((output, Computed::Driven(rate, factors)));
        }
        let (what, tip, base, expressed) = match &output.kind {
            OutputKind::Accelerations => {
                let doc = format!(
                    "The accelerations in rad/s², of joints that slide in m/s², under these efforts and a gravity of \
                    {gravity:?} m/s² in the root{}.",
                    if self.loops.is_empty() {
                        ""
                    } else {
                        ", while all loops stay closed"
                    }
                );
                let output = described("accelerations", doc, Shape::Vector(count));
                return Some((output, Computed::Accelerations(gravity)));
            }
            OutputKind::Efforts => {
                let doc = format!(
                    "The torques in Nm, and forces in N of joints that slide, for these accelerations \
                    under a gravity of {gravity:?} m/s² in the root{}.",
                    if self.loops.is_empty() {
                        ""
                    } else {
                        ", with which the loops carry no force"
                    }
                );
                let output = described("efforts", doc, Shape::Vector(count));
                return Some((output, Computed::Efforts(gravity)));
            }
            OutputKind::MassMatrix => {
                let doc = "The efforts for an acceleration of 1 of each joint alone, at rest and without gravity.";
                let output = described("mass_matrix", doc.to_owned(), Shape::Matrix(count, count));
                return Some((output, Computed::MassMatrix));
            }
            OutputKind::Motion {
                what,
                tip,
                base,
                expressed,
            } => (*what, tip, base, expressed.as_ref()),
            // The others are known above.
            _ => return None,
        };
        let places = (self.body(tip), self.body(base));
        let frame = expressed.map(|name| self.body(name));
        let (tip_at, base_at) = (places.0?, places.1?);
        let chain = self.chain(base_at, tip_at, output.span)?;
        let expressed_at = match frame {
            Some(frame) => Some(frame?),
            None => None,
        };
        let expressed_chain = match expressed_at {
            Some(frame) => Some(self.chain(base_at, frame, output.span)?),
            None => None,
        };
        let mut name = format!("{}_{}_in_{}", what.word(), tip.text, base.text);
        let mut axes = format!("along the axes of `{}`", base.text);
        if let Some(frame) = expressed {
            if matches!(what, MotionPart::Pose | MotionPart::Quaternion) {
                let message =
                    "a pose has no `expressed in`: it is in the frame after `in`".to_owned();
                self.error("without-effect", frame.span, message);
                return None;
            }
            name = format!("{name}_expressed_in_{}", frame.text);
            axes = format!("along the axes of `{}`", frame.text);
        }
        if what == MotionPart::Quaternion {
            name += "_as_quaternion";
        }
        let (tip, base) = (&tip.text, &base.text);
        let length = self.choices.length();
        let (doc, shape) = match what {
            MotionPart::Quaternion => (
                format!(
                    "Where `{tip}` is in `{base}`: the place in {length}, then the unit quaternion x, y, z, w, whose w is \
                    not negative."
                ),
                Shape::Vector(7),
            ),
            MotionPart::Pose => (
                format!(
                    "Where `{tip}` is in `{base}`: the homogeneous matrix for columns, in {length}."
                ),
                Shape::Matrix(4, 4),
            ),
            MotionPart::Jacobian => (
                format!(
                    "For each joint, a column: the velocity of the origin of `{tip}` in `{base}` in {length}, then the \
                    angular velocity in rad, {axes}, for each unit that the joint moves."
                ),
                Shape::Matrix(6, count),
            ),
            MotionPart::Velocity => (
                format!(
                    "The velocity of the origin of `{tip}` in `{base}` in {length}/s, then the angular velocity in \
                    rad/s, {axes}."
                ),
                Shape::Vector(6),
            ),
            MotionPart::Acceleration => (
                format!(
                    "The acceleration of the origin of `{tip}` in `{base}` in {length}/s², then the angular \
                    acceleration in rad/s², {axes}."
                ),
                Shape::Vector(6),
            ),
        };
        let computed = Computed::Motion {
            what,
            chain,
            expressed: expressed_chain,
        };
        let asked = Asked {
            what,
            tip: tip_at,
            base: base_at,
            expressed: expressed_at,
        };
        let described = described(&identifier(&name), doc, shape);
        let asked = Some(asked);
        Some((Output { asked, ..described }, computed))
    }
}
