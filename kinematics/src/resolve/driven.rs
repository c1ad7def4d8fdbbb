//! Resolves outputs over transmissions: the numbers of actuators for those of joints, and the other way round.

use super::Resolver;
use crate::ast::{self, OutputKind, Rate, Side};
use rc_diagnostics::{Diagnostic, Span};

impl Resolver<'_> {
    /// Refuses a solver that takes numbers of joints and of actuators.
    pub(super) fn check_side(&mut self, solver: &ast::Solver) {
        let is_of_joints = |output: &&ast::Output| {
            !matches!(
                output.kind,
                OutputKind::Driven {
                    side: Side::Joint,
                    ..
                }
            )
        };
        let mut outputs = solver.outputs.iter();
        let first = outputs.clone().find(|output| !is_of_joints(output));
        if let (Some(first), Some(other)) = (first, outputs.find(is_of_joints)) {
            let message = "an output of `joint` takes the numbers of actuators, and others of the solver those of joints";
            let error = Diagnostic::error("bad-value", first.span, message);
            let error = error.label(other.span, "this one takes those of joints");
            self.found
                .push(error.help("write it in a solver of its own"));
        }
    }

    /// The comment of an output over transmissions, and the factor and the offset of each coordinate.
    pub(super) fn driven(
        &mut self,
        span: Span,
        side: Side,
        rate: Rate,
    ) -> Option<(String, Vec<(f64, f64)>)> {
        let robot = self.robot;
        if robot.transmissions.is_empty() {
            let message = format!("the robot `{}` has no transmission", robot.name);
            let error = Diagnostic::error("bad-value", span, message);
            self.found.push(error.help(
                "the URDF needs `transmission` with a joint, an actuator and `mechanicalReduction`",
            ));
            return None;
        }
        let mut factors = vec![(1.0, 0.0); robot.coordinates.len()];
        for own in &robot.transmissions {
            let (reduction, offset) = (own.reduction, own.offset);
            factors[own.coordinate] = match (side, rate) {
                (Side::Joint, Rate::Positions) => (1.0 / reduction, offset),
                (Side::Joint, Rate::Velocities) | (Side::Actuator, Rate::Efforts) => {
                    (1.0 / reduction, 0.0)
                }
                (Side::Actuator, Rate::Positions) => (reduction, -offset * reduction),
                (Side::Actuator, Rate::Velocities) | (Side::Joint, Rate::Efforts) => {
                    (reduction, 0.0)
                }
            };
        }
        let (gives, takes) = match side {
            Side::Joint => ("joints", "actuators"),
            Side::Actuator => ("actuators", "joints"),
        };
        let rate = rate.word();
        let doc = format!(
            "The {rate} of {gives}, for these {rate} of {takes}, in the order of the joints. Joints without a transmission \
            have the same ones."
        );
        Some((doc, factors))
    }
}
