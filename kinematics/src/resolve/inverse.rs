//! Resolves inverse solvers and postures.

use super::{MOST_NUMBERS, MOST_STEPS, Resolver};
use crate::ast::{self, MotionPart, Quantity, SettingKind};
use crate::inverse::{Inverse, Question, RateLimits, Rates, motion, question_of_pose};
use crate::search::{RESOLVED_ANGLE, Search, Settings, ranges, resolved_length, turns};
use rc_diagnostics::{Diagnostic, Span};
use rc_robot::Chain;
use rc_syntax::{Literal, Name};
use std::collections::HashMap;

/// The least number of a setting: the square of a smaller one may underflow.
const TINY: f64 = 1e-12;

/// The least damping of velocities, with 64 and with 32 bits. Its square is greater than rounding errors.
const LEAST_DAMPING: [f64; 2] = [1e-6, 0.003];

/// The tolerance of a search with numbers of 32 bits, in m and in rad.
const TOLERANCE_OF_SINGLE: f64 = 1e-5;

/// The most computations of a motion after each beginning of a search.
const MOST_ITERATIONS: i64 = 10_000;

/// The most beginnings of a search.
const MOST_RESTARTS: i64 = 1_000;

impl Resolver<'_> {
    /// The positions of all coordinates in each posture.
    pub(super) fn postures(&mut self, postures: &[ast::Posture]) {
        let mut known: HashMap<&str, Span> = HashMap::new();
        for posture in postures {
            let name = &posture.name;
            if let Some(first) = known.insert(&name.text, name.span) {
                let message = format!("the posture `{}` is declared twice", name.text);
                self.duplicate(name.span, message, first);
                continue;
            }
            if name.text == "last" {
                let message = "`last` cannot be the name of a posture: it is the one before";
                self.error("reserved-in-code", name.span, message.to_owned());
                continue;
            }
            let positions = self.posture(posture);
            self.postures.insert(name.text.clone(), positions);
        }
    }

    fn posture(&mut self, posture: &ast::Posture) -> Vec<f64> {
        let ranges = ranges(self.robot);
        // Joints that the posture does not name are at 0, or at the nearest limit.
        let middle = ranges
            .iter()
            .map(|(lower, upper)| 0.0_f64.clamp(*lower, *upper));
        let mut positions: Vec<f64> = middle.collect();
        let mut known: HashMap<&str, Span> = HashMap::new();
        for (joint, place) in &posture.joints {
            if let Some(first) = known.insert(&joint.text, joint.span) {
                let message = format!("the joint `{}` occurs twice in the posture", joint.text);
                self.duplicate(joint.span, message, first);
                continue;
            }
            let Some(at) = self.coordinate(joint) else {
                continue;
            };
            let unit = if turns(self.robot, at) { "rad" } else { "m" };
            let Some(value) = self.quantity(place, unit) else {
                continue;
            };
            let value = if unit == "m" {
                value * self.choices.grounding.metre
            } else {
                value
            };
            let unit = if unit == "m" {
                self.choices.length()
            } else {
                unit
            };
            let (lower, upper) = ranges[at];
            if value < lower || value > upper {
                let message = format!(
                    "`{}` goes from {lower} to {upper} {unit}, found {value} {unit}",
                    joint.text
                );
                self.error("bad-value", place.number.span, message);
                continue;
            }
            positions[at] = value;
        }
        positions
    }

    /// The place of a joint that moves on its own.
    pub(super) fn coordinate(&mut self, joint: &Name) -> Option<usize> {
        let robot = self.robot;
        let mut names = robot.coordinates.iter();
        let found = names.position(|name| *name == joint.text);
        if found.is_none() {
            let message = format!(
                "the robot `{}` has no joint `{}` that moves on its own",
                robot.name, joint.text
            );
            let error = Diagnostic::error("unknown-joint", joint.span, message);
            let known = robot.coordinates.iter().map(String::as_str);
            self.found.push(error.suggest(&joint.text, known));
        }
        found
    }

    fn quantity(&mut self, quantity: &Quantity, wanted: &str) -> Option<f64> {
        super::quantity(&mut self.found, quantity, wanted)
    }

    /// A number in this unit that is neither too small nor too great.
    fn positive(&mut self, quantity: &Quantity, unit: &str, least: f64) -> Option<f64> {
        let value = self.quantity(quantity, unit)?;
        self.in_range(value, quantity.number.span, unit, (least, 1e3))
    }

    fn in_range(
        &mut self,
        value: f64,
        span: Span,
        unit: &str,
        (least, most): (f64, f64),
    ) -> Option<f64> {
        if (least..=most).contains(&value) {
            return Some(value);
        }
        let message = format!("expected a number from {least:e} to {most} {unit}, found {value}");
        let error = Diagnostic::error("bad-value", span, message);
        self.found.push(if least > TINY {
            error.help("numbers of 32 bits resolve no less: write it in a file with `scalars f64`")
        } else {
            error
        });
        None
    }

    fn integer(&mut self, literal: &Literal, least: i64, most: i64) -> Option<usize> {
        let value = literal
            .as_i64()
            .filter(|value| (least..=most).contains(value));
        if value.is_none() {
            let message = format!(
                "expected an integer from {least} to {most}, found {}",
                literal.described()
            );
            self.error("bad-value", literal.span, message);
        }
        usize::try_from(value?).ok()
    }

    fn named_posture(&mut self, name: &Name, has_last: bool) -> Option<Vec<f64>> {
        let found = self.postures.get(&name.text).cloned();
        if found.is_none() {
            let message = format!("there is no posture `{}`", name.text);
            let error = Diagnostic::error("unknown-posture", name.span, message);
            let known = self.postures.keys().map(String::as_str);
            let known = known.chain(has_last.then_some("last"));
            let known: Vec<&str> = known.collect();
            self.found.push(if known.is_empty() {
                error.help("write `posture NAME { JOINT = NUMBER; };` before the solvers")
            } else {
                error.suggest(&name.text, known)
            });
        }
        found
    }

    /// Settings of another kind of solver, or duplicate ones.
    fn fitting(&mut self, solver: &ast::Solver, words: &[&str]) {
        let mut known: HashMap<&str, Span> = HashMap::new();
        for setting in &solver.settings {
            let word = setting.kind.word();
            if let Some(first) = known.insert(word, setting.span) {
                let message = format!("`{word}` occurs twice");
                self.duplicate(setting.span, message, first);
            } else if !words.contains(&word) {
                let words: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
                let message = match words.as_slice() {
                    [] => format!("`{word}` changes nothing: this solver is not an inverse"),
                    words => format!(
                        "`{word}` changes nothing: this inverse has {}",
                        words.join(", ")
                    ),
                };
                self.error("without-effect", setting.span, message);
            }
        }
    }

    /// A solver without an inverse has no settings.
    pub(super) fn without_settings(&mut self, solver: &ast::Solver) {
        self.fitting(solver, &[]);
    }

    /// An inverse solver, without other outputs.
    pub(super) fn inverse(
        &mut self,
        solver: &ast::Solver,
        asked: &ast::Inverse,
    ) -> Option<Inverse> {
        let others = solver.inverses.iter().skip(1).map(|other| other.span);
        let others = others.chain(solver.outputs.iter().map(|output| output.span));
        let others = others.chain(solver.gravity.iter().map(|(span, _)| *span));
        let others = others.chain(solver.payloads.iter().map(|payload| payload.span));
        let others = others.chain(
            solver
                .holding
                .iter()
                .chain(&solver.passive)
                .map(|(span, _)| *span),
        );
        for other in others {
            let message = "an inverse solver gives nothing else".to_owned();
            let error = Diagnostic::error("mixed-solver", other, message);
            let error = error.label(asked.span, "the inverse");
            self.found
                .push(error.help("write a solver of its own for it"));
        }
        let is_pose = match asked.what {
            MotionPart::Pose => true,
            MotionPart::Velocity => false,
            // The grammar has no others.
            MotionPart::Quaternion | MotionPart::Jacobian | MotionPart::Acceleration => {
                return None;
            }
        };
        self.fitting(
            solver,
            if is_pose {
                &["within", "tolerance", "iterations", "restarts", "seed"]
            } else {
                &["within", "damped", "null", "period"]
            },
        );
        if !is_pose && self.choices.length() == "mm" {
            let message = "velocities in m/s and rad/s are weighed, which `lengths mm` changes";
            let error = Diagnostic::error("bad-value", asked.span, message.to_owned());
            self.found.push(error.help("write it in a file of its own"));
            return None;
        }
        let places = (self.body(&asked.tip), self.body(&asked.base));
        let frame = asked
            .expressed
            .as_ref()
            .map(|name| (name.span, self.body(name)));
        let (tip, base) = (places.0?, places.1?);
        let chain = self.chain(base, tip, asked.span)?;
        let expressed = match frame {
            Some((span, _)) if is_pose => {
                let message = "a pose has no `expressed in`: it is in the frame after `in`";
                self.error("without-effect", span, message.to_owned());
                return None;
            }
            Some((_, frame)) => Some(self.chain(base, frame?, asked.span)?),
            None => None,
        };
        let mut joints = chain.coordinates();
        if joints.is_empty() {
            let message = format!(
                "no joint moves `{}` in `{}`",
                asked.tip.text, asked.base.text
            );
            self.error("empty-solver", asked.span, message);
            return None;
        }
        if let Some(frame) = &expressed {
            joints.extend(frame.coordinates());
            joints.sort_unstable();
            joints.dedup();
        }
        self.steps += chain.len() + expressed.as_ref().map_or(0, Chain::len);
        let frames = [tip, base];
        let (tip, base) = (&asked.tip.text, &asked.base.text);
        let axes = asked.expressed.as_ref().map_or(base, |name| &name.text);
        let question = if is_pose {
            let question = question_of_pose(tip, base, self.choices.length());
            let order = if self.choices.by_columns {
                " By columns."
            } else {
                ""
            };
            question + order
        } else {
            format!(
                "The velocity of the origin of `{tip}` in `{base}` in m/s, then the angular velocity in rad/s, along \
                the axes of `{axes}`."
            )
        };
        let how = if is_pose {
            Question::Pose(self.search(solver, &chain, &joints))
        } else {
            Question::Velocity(self.rates(solver, &joints))
        };
        let starts = match &how {
            Question::Pose(search) => search.starts.len() + search.closed_numbers(),
            Question::Velocity(_) => 0,
        };
        if 12 + 6 * joints.len() + starts > MOST_NUMBERS || self.steps > MOST_STEPS {
            let message = format!(
                "too much for printed code: a solver has at most {MOST_NUMBERS} numbers, and those of a file pass \
                at most {MOST_STEPS} joints"
            );
            let error = Diagnostic::error("too-many-numbers", asked.span, message);
            self.found
                .push(error.help("write fewer `restarts`, or several files"));
            return None;
        }
        let coordinates = self.robot.coordinates.len();
        let motion = motion(&chain, expressed.as_ref(), coordinates, &joints, is_pose);
        let closed = match &how {
            Question::Pose(search) => search.closed.as_ref(),
            Question::Velocity(_) => None,
        };
        if !self.fits(&motion) || closed.is_some_and(|form| !self.fits(&form.positions)) {
            self.too_great(solver.name.span);
            return None;
        }
        Some(Inverse {
            name: solver.name.text.clone(),
            doc: solver.doc.clone(),
            question: question.replace(char::is_control, " "),
            frames,
            coordinates,
            joints,
            motion,
            asked: how,
        })
    }

    fn search(&mut self, solver: &ast::Solver, chain: &Chain<'_>, joints: &[usize]) -> Search {
        let metre = self.choices.grounding.metre;
        let mut settings = Settings::default();
        let (mut near, mut turned) = (TINY, TINY);
        if self.choices.is_single {
            near = resolved_length(self.robot, metre, chain).max(TINY);
            turned = RESOLVED_ANGLE;
            settings.near = TOLERANCE_OF_SINGLE.max(near);
            settings.turned = TOLERANCE_OF_SINGLE;
        }
        settings.near *= metre;
        for setting in &solver.settings {
            match &setting.kind {
                SettingKind::Within => settings.keeps_limits = true,
                SettingKind::Tolerance(way, angle) => {
                    let way = self.positive(way, "m", near);
                    settings.near = way.map_or(settings.near, |way| way * metre);
                    let angle = self.positive(angle, "rad", turned);
                    settings.turned = angle.unwrap_or(settings.turned);
                }
                SettingKind::Iterations(number) => {
                    let given = self.integer(number, 1, MOST_ITERATIONS);
                    settings.iterations = given.unwrap_or(settings.iterations);
                }
                SettingKind::Restarts(number) => {
                    let given = self.integer(number, 0, MOST_RESTARTS);
                    settings.restarts = given.unwrap_or(settings.restarts);
                }
                SettingKind::Seed(name) if name.text == "last" => {}
                SettingKind::Seed(name) => settings.seed = self.named_posture(name, true),
                _ => {}
            }
        }
        Search::new((self.robot, &self.choices), chain, joints, settings)
    }

    fn rates(&mut self, solver: &ast::Solver, joints: &[usize]) -> Rates {
        let (mut damping, mut period, mut within, mut posture) = (0.01, None, None, None);
        for setting in &solver.settings {
            match &setting.kind {
                SettingKind::Within => within = Some(setting.span),
                SettingKind::Damped(number) => {
                    let least = LEAST_DAMPING[usize::from(self.choices.is_single)];
                    let value = number
                        .as_f64()
                        .filter(|value| (least..=1e3).contains(value));
                    if let Some(value) = value {
                        damping = value;
                        continue;
                    }
                    let message = format!(
                        "expected a number from {least:e} to 1000, found {}",
                        number.described()
                    );
                    self.error("bad-value", number.span, message);
                }
                SettingKind::Null(name, gain) => {
                    let gain = match gain {
                        Some(gain) => {
                            let value = gain.as_f64().unwrap_or(f64::NAN);
                            self.in_range(value, gain.span, "1/s", (TINY, 1e6))
                        }
                        None => Some(1.0),
                    };
                    posture = self.named_posture(name, false).zip(gain);
                }
                SettingKind::Period(given) => {
                    let value = self.positive(given, "s", TINY);
                    period = Some((setting.span, value.unwrap_or(1.0)));
                }
                _ => {}
            }
        }
        match (within, period) {
            (Some(span), None) => {
                let message = "the period within which the limits hold is missing".to_owned();
                let error = Diagnostic::error("missing-period", span, message);
                self.found
                    .push(error.help("write the period of the loop, such as `period 1 ms;`"));
            }
            (None, Some((span, _))) => {
                let message = "`period` changes nothing without `within limits`".to_owned();
                self.error("without-effect", span, message);
            }
            _ => {}
        }
        let of_joints = |all: &[f64]| joints.iter().map(|at| all[*at]).collect::<Vec<f64>>();
        let limits = within.zip(period).map(|(_, (_, period))| {
            let kept = |range: (f64, f64)| self.choices.limits(range);
            let (lower, upper): (Vec<f64>, Vec<f64>) =
                ranges(self.robot).into_iter().map(kept).unzip();
            let fastest = self.robot.limits().into_iter().map(|limits| {
                let said = limits.map(|limits| limits.velocity);
                let said = said.filter(|fastest| *fastest > 0.0);
                kept((0.0, said.unwrap_or(f64::INFINITY))).1
            });
            RateLimits {
                lower: of_joints(&lower),
                upper: of_joints(&upper),
                fastest: of_joints(&fastest.collect::<Vec<_>>()),
                period,
            }
        });
        Rates {
            damping,
            limits,
            posture: posture.map(|(posture, gain)| (of_joints(&posture), gain)),
        }
    }
}
