//! Resolves the choices of printed code: functions, types, units, layouts and axes.

use super::Resolver;
use crate::ast::{self, Choice, Math, OutputKind, Rate, Subject};
use crate::cell::Choices;
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_formula::{Operand, Program};
use rc_quantity::Axes;

/// The words of each subject, the usual one first.
fn words(subject: Subject) -> &'static [&'static str] {
    match subject {
        Subject::Math => &["std", "libm"],
        Subject::Scalars => &["f64", "f32"],
        Subject::Lengths => &["m", "mm"],
        Subject::Matrices => &["row_major", "column_major"],
        Subject::Frames => &["ros", "ros_optical", "robocomp", "innermodel"],
    }
}

/// The choices of a text.
pub(super) fn choices(chosen: &[Choice], found: &mut Diagnostics) -> Choices {
    let mut choices = Choices::default();
    let mut known: Vec<(Subject, Span)> = Vec::new();
    for Choice {
        span,
        subject,
        word,
    } in chosen
    {
        if let Some((_, first)) = known.iter().find(|(other, _)| other == subject) {
            let message = format!("`{}` occurs twice", subject.word());
            let error = Diagnostic::error("duplicate-name", *span, message);
            found.push(error.label(*first, "first declared here"));
            continue;
        }
        known.push((*subject, *span));
        let words = words(*subject);
        if !words.contains(&word.text.as_str()) {
            let message = format!("`{}` has no choice `{}`", subject.word(), word.text);
            let error = Diagnostic::error("bad-value", word.span, message);
            found.push(error.suggest(&word.text, words.iter().copied()));
            continue;
        }
        match word.text.as_str() {
            "libm" => choices.math = Math::Libm,
            "f32" => choices.is_single = true,
            "mm" => choices.grounding.metre = 1000.0,
            "column_major" => choices.by_columns = true,
            "ros_optical" => choices.grounding.axes = Axes::ROS_OPTICAL,
            "robocomp" => choices.grounding.axes = Axes::ROBOCOMP,
            "innermodel" => choices.grounding.axes = Axes::INNER_MODEL,
            _ => {}
        }
    }
    choices
}

impl Choices {
    /// The unit of lengths.
    pub(crate) fn length(&self) -> &'static str {
        if self.grounding.metre > 1.0 {
            "mm"
        } else {
            "m"
        }
    }

    /// Limits as printed code has them. With 32 bits, they are rounded into the range, so that no joint passes its limit.
    #[expect(clippy::cast_possible_truncation, reason = "rounded on purpose")]
    pub(crate) fn limits(&self, (lower, upper): (f64, f64)) -> (f64, f64) {
        if !self.is_single {
            return (lower, upper);
        }
        let (mut least, mut most) = (lower as f32, upper as f32);
        if f64::from(least) < lower {
            least = least.next_up();
        }
        if f64::from(most) > upper {
            most = most.next_down();
        }
        if least > most {
            (least, most) = (lower as f32, lower as f32);
        }
        (f64::from(least), f64::from(most))
    }
}

impl Resolver<'_> {
    /// Outputs that have no meaning, or no digits, with the choices of the file.
    pub(super) fn is_chosen(&mut self, output: &ast::Output, passive: &[usize]) -> bool {
        let of_masses = matches!(
            output.kind,
            OutputKind::Efforts
                | OutputKind::MassMatrix
                | OutputKind::Accelerations
                | OutputKind::LoopForces
                | OutputKind::Driven {
                    rate: Rate::Efforts,
                    ..
                }
        );
        if of_masses && self.choices.length() == "mm" {
            let message = "forces and masses are computed in metres, not with `lengths mm`";
            let error = Diagnostic::error("bad-value", output.span, message.to_owned());
            self.found
                .push(error.help("write them in a file of their own"));
            return false;
        }
        let of_loops = matches!(
            output.kind,
            OutputKind::ClosedPositions | OutputKind::ClosedVelocities | OutputKind::LoopForces
        );
        let closes = output.kind == OutputKind::Accelerations && !self.loops.is_empty();
        let closes = closes || (output.kind == OutputKind::Efforts && !passive.is_empty());
        if (of_loops || closes) && self.choices.is_single {
            let message = "loops are closed with f64 only, not with `scalars f32`";
            let error = Diagnostic::error("bad-value", output.span, message.to_owned());
            self.found.push(error.help("write it in a file of its own"));
            return false;
        }
        true
    }

    /// Whether the constants of a program are numbers of the type of the file.
    pub(super) fn fits(&self, program: &Program) -> bool {
        let nodes = program.nodes().iter().flat_map(|node| &node.operands);
        let mut all = nodes.chain(program.results());
        program.is_finite()
            && (!self.choices.is_single
                || all.all(|operand| match operand {
                    Operand::Constant(bits) => f64::from_bits(*bits).abs() <= f64::from(f32::MAX),
                    Operand::Node(_) => true,
                }))
    }
}
