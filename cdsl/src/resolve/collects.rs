//! The clause `collect`: topics whose samples one handler gets together.

use super::reactions::{COMPUTE, Side};
use crate::ast;
use crate::model::{Collect, Role, Slot, Step};
use crate::resolver::Resolver;
use rc_diagnostics::Diagnostic;
use std::collections::HashMap;
use std::time::Duration;

impl Resolver<'_> {
    pub(super) fn collects(&mut self, declared: &[&ast::Collect], slots: &[Slot]) -> Vec<Collect> {
        let mut seen = HashMap::new();
        let mut out = Vec::new();
        for tree in declared {
            self.check_unique(&mut seen, &tree.name, "collection");
            if tree.name.text.eq_ignore_ascii_case(COMPUTE) {
                self.bad_collect(
                    tree.name.span,
                    "`compute` is the periodic function",
                    "rename it",
                );
            }
            let within = self.within(tree);
            let mut topics: Vec<(String, String)> = Vec::new();
            let mut complete = true;
            for path in &tree.topics {
                let Some(topic) = self.topic(path, slots) else {
                    complete = false;
                    continue;
                };
                if topics.contains(&topic) {
                    let message = format!("`{}.{}` occurs twice", topic.0, topic.1);
                    self.bad_collect(path.span(), &message, "name each topic once");
                    complete = false;
                } else {
                    topics.push(topic);
                }
            }
            if complete && !(2..=MOST).contains(&topics.len()) {
                let message = format!(
                    "a collection has 2 to {MOST} topics, this one has {}",
                    topics.len()
                );
                self.bad_collect(
                    tree.name.span,
                    &message,
                    "the handler of one topic needs none",
                );
            }
            out.extend(within.map(|within| Collect {
                name: tree.name.clone(),
                topics,
                within,
            }));
        }
        out
    }

    fn within(&mut self, tree: &ast::Collect) -> Option<Duration> {
        let Some(literal) = &tree.within else {
            return Some(Duration::ZERO);
        };
        let time = literal.as_nanoseconds().filter(|ns| *ns > 0);
        if time.is_none() {
            let message = "`within` takes a duration of more than 0, such as `20ms`";
            let help = "write `exact` in its place for samples of equal times";
            self.bad_collect(literal.span, message, help);
        }
        time.map(Duration::from_nanos)
    }

    /// The slot and the operation of a topic that can be collected.
    fn topic(&mut self, path: &ast::OperationPath, slots: &[Slot]) -> Option<(String, String)> {
        let step = self.step(path, slots, Side::Cause)?;
        let Step::Operation { slot, operation } = step else {
            self.bad_collect(path.span(), "`compute` has no samples", "name topics");
            return None;
        };
        let of = slots.iter().find(|of| of.name == slot)?;
        let reason = if of.role != Role::SubscribesTo {
            "is not a topic that the component subscribes to"
        } else if of.is_array {
            "is a topic of a slot array"
        } else if of.in_place {
            "travels in place, and is not kept"
        } else {
            return Some((slot, operation));
        };
        let message = format!("`{slot}.{operation}` {reason}");
        let help = "name topics of slots under `subscribesTo`";
        self.bad_collect(path.span(), &message, help);
        None
    }

    fn bad_collect(&mut self, span: rc_diagnostics::Span, message: &str, help: &str) {
        let error = Diagnostic::error("bad-collect", span, message.to_owned());
        self.found.push(error.help(help.to_owned()));
    }
}

/// The most topics of a collection: the traits of tuples end there.
const MOST: usize = 8;
