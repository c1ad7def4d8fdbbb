//! The formula of a plan, as one over the numbers of a message.

use crate::plan::Plan;
use crate::plan::TRANSFORM;
use rc_conversion::{Formula, Operand, Operation, Step};
use rc_formula::Operand as Term;
use rc_formula::Operation as Done;
use rc_vocabulary::Primitive;
use std::collections::BTreeMap;

/// No number of the message: such a formula is refused when it becomes a program.
const NOWHERE: Operand = Operand::Input(u32::MAX);

impl Plan {
    /// The formula over so many numbers of a message, in place. `from` and `to` are the places of
    /// the numbers of both prototypes among them. Numbers that only the sender has a meaning for
    /// stay as they are. If it takes a transform, that is the one with this number among those of
    /// the message.
    pub fn formula(
        &self,
        (from, to): (&[Option<u32>], &[Option<u32>]),
        numbers: usize,
        transform: u32,
    ) -> Formula {
        let mut steps: Vec<Step> = Vec::new();
        let mut values: Vec<Operand> = Vec::new();
        let term = |of: &Term, values: &[Operand]| match of {
            Term::Constant(bits) => Operand::Constant(*bits),
            Term::Node(at) => values.get(*at).copied().unwrap_or(NOWHERE),
        };
        for node in self.program.nodes() {
            let operands: Vec<Operand> = node.operands.iter().map(|of| term(of, &values)).collect();
            let mut push = |operation, operands| {
                steps.push(Step {
                    operation,
                    operands,
                });
                Operand::Step(u32::try_from(steps.len() - 1).unwrap_or(u32::MAX))
            };
            let one = |operands: &[Operand]| operands.first().copied().unwrap_or(NOWHERE);
            let operation = match &node.operation {
                Done::Input(at) if *at >= from.len() && self.transform > 0 => {
                    let own = u32::try_from(*at - from.len() + TRANSFORM * transform as usize);
                    values.push(own.map_or(NOWHERE, Operand::Transform));
                    continue;
                }
                Done::Input(at) => {
                    let place = from.get(*at).copied().flatten();
                    values.push(place.map_or(NOWHERE, Operand::Input));
                    continue;
                }
                Done::Store(Primitive::F64) | Done::Result(_) | Done::Call { .. } => {
                    values.push(one(&operands));
                    continue;
                }
                Done::Store(Primitive::F32) => Operation::Single,
                Done::Store(_) => {
                    let nearest = push(Operation::Nearest, operands);
                    values.push(require(&node.operation, nearest, &mut push));
                    continue;
                }
                Done::Require(..) => {
                    values.push(require(&node.operation, one(&operands), &mut push));
                    continue;
                }
                Done::Negate => Operation::Negate,
                Done::Add => Operation::Add,
                Done::Subtract => Operation::Subtract,
                Done::Multiply => Operation::Multiply,
                Done::Divide => Operation::Divide,
                Done::Root => Operation::Root,
                Done::Floor => Operation::Floor,
                Done::Nearest => Operation::Nearest,
                Done::Sine => Operation::Sine,
                Done::Cosine => Operation::Cosine,
                Done::Angle => Operation::Angle,
                Done::Length => Operation::Length,
                Done::IfBelow => Operation::IfBelow,
            };
            values.push(push(operation, operands));
        }
        let results = self.program.results().iter().map(|of| term(of, &values));
        let locks = self.program.locks().iter();
        let locks = locks.map(|of| term(of, &values)).collect();
        let own: BTreeMap<u32, Operand> = to
            .iter()
            .zip(results)
            .filter_map(|(place, result)| Some(((*place)?, result)))
            .collect();
        let outputs = (0..).take(numbers);
        let outputs = outputs.map(|at| own.get(&at).copied().unwrap_or(Operand::Input(at)));
        Formula {
            outputs: outputs.collect(),
            steps,
            locks,
        }
    }
}

/// A requirement of an operation of a plan.
fn require(
    of: &Done,
    operand: Operand,
    push: &mut impl FnMut(Operation, Vec<Operand>) -> Operand,
) -> Operand {
    let Some((least, most)) = of.range() else {
        return operand;
    };
    let limits = [least, most].map(|limit| Operand::Constant(limit.to_bits()));
    push(Operation::Require, vec![operand, limits[0], limits[1]])
}
