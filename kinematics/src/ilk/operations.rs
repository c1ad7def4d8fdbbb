//! The operations of a model in ILK, as terms of a formula.

use super::OPERATIONS;
use super::lua::Table;
use super::motion::{Acceleration, Joint, Known, added, crossed, seen};
use super::read::{MOST_JOINTS, MOST_OPERATIONS, Reader};
use rc_diagnostics::{Diagnostic, Span};
use rc_formula::Term;
use rc_quantity::Real;
use rc_quantity::rotation::cross;
use std::collections::BTreeMap;

impl Reader {
    pub(super) fn operations(
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
            "joint-vel-twist" | "joint-vel" => {
                let twist = self.text(own, place, "arg")?;
                self.known(&known.twists, twist, "velocity")?;
            }
            "joint-acc-twist" => {
                let rate = self.text(own, place, "arg")?;
                self.known(&known.accelerations, rate, "acceleration")?;
            }
            "vel-compose" => {
                let one = self.text(own, place, "arg1")?;
                let other = self.text(own, place, "arg2")?;
                let pose = self.text(own, place, "pose")?;
                let (result, _) = self.text(own, place, "res")?;
                let own = *self.known(&known.twists, one, "velocity")?;
                let other = *self.known(&known.twists, other, "velocity")?;
                let frame = self.known(&known.poses, pose, "pose")?;
                let sum = added(own, seen(frame, other));
                known.twists.insert(result.to_owned(), sum);
            }
            "acc-compose" => {
                let one = self.text(own, place, "arg1")?;
                let other = self.text(own, place, "arg2")?;
                let pose = self.text(own, place, "ctransform")?;
                let velocity = self.text(own, place, "velocity")?;
                let (result, _) = self.text(own, place, "res")?;
                let one = *self.known(&known.accelerations, one, "acceleration")?;
                let other = self
                    .known(&known.accelerations, other, "acceleration")?
                    .rate;
                let frame = self.known(&known.poses, pose, "pose")?;
                let velocity = *self.known(&known.twists, velocity, "velocity")?;
                // The velocity of `arg1` is along axes that turn.
                let carried = added(seen(frame, other), crossed(velocity, one.velocity));
                let rate = added(one.rate, carried);
                let sum = Acceleration { rate, velocity };
                known.accelerations.insert(result.to_owned(), sum);
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
                let joint = self.joint_of(own, place, joints)?;
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
                let parts = match joint {
                    Joint::Turns(_) => [axis, cross(axis, arm)],
                    Joint::Slides(_) => [zero, axis],
                    Joint::Fixed => [zero, zero],
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
}
