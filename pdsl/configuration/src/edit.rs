//! The differences between the values of the next start and those of the file.

use crate::block::{Block, Content};
use crate::change::ParamChange;
use crate::model::{Kind, Parameter, Value};

/// A value that differs from the file.
pub(crate) struct Edit<'m> {
    pub(crate) parameter: &'m Parameter,
    /// The path from the outermost table: each name with the index of a list element.
    pub(crate) steps: Vec<(&'m str, Option<usize>)>,
    pub(crate) change: ParamChange,
}

/// The values of `next` that differ from those of `saved`.
pub(crate) fn edits<'m>(parameters: &'m [Parameter], saved: &Block, next: &Block) -> Vec<Edit<'m>> {
    let mut edits = Vec::new();
    compare(parameters, saved, next, &mut Vec::new(), &mut edits);
    edits
}

fn compare<'m>(
    parameters: &'m [Parameter],
    old: &Block,
    new: &Block,
    steps: &mut Vec<(&'m str, Option<usize>)>,
    edits: &mut Vec<Edit<'m>>,
) {
    for (parameter, (a, b)) in parameters.iter().zip(old.fields.iter().zip(&new.fields)) {
        steps.push((&parameter.name, None));
        match (&parameter.kind, &a.content, &b.content) {
            (Kind::Group(members), Some(Content::Group(a)), Some(Content::Group(b))) => {
                compare(members, a, b, steps, edits);
            }
            (Kind::List { parameters, .. }, Some(Content::List(a)), Some(Content::List(b))) => {
                for (at, (a, b)) in a.iter().zip(b).enumerate() {
                    steps.pop();
                    steps.push((&parameter.name, Some(at)));
                    compare(parameters, a, b, steps, edits);
                }
            }
            (_, Some(Content::Value(old)), Some(Content::Value(new))) if old != new => {
                let change = ParamChange {
                    path: a.path.clone(),
                    old: old.clone(),
                    new: new.clone(),
                    secret: parameter.secret,
                };
                edits.push(Edit {
                    parameter,
                    steps: steps.clone(),
                    change,
                });
            }
            _ => {}
        }
        steps.pop();
    }
}

impl Edit<'_> {
    /// The value in another block of the same model.
    pub(crate) fn value_in<'b>(&self, mut block: &'b Block) -> Option<&'b Value> {
        for (name, element) in &self.steps {
            block = match (block.field(name)?.content.as_ref()?, element) {
                (Content::Value(value), _) => return Some(value),
                (Content::Group(block), _) => block,
                (Content::List(blocks), Some(at)) => blocks.get(*at)?,
                (Content::List(_), None) => return None,
            };
        }
        None
    }
}
