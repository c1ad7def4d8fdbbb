//! The values of one table as they were read, each with its place, so that a broken rule can name it.

use super::values::{Entry, Values};
use crate::model::Value;
use rc_diagnostics::Span;

/// A table: all parameters, a group, or one element of a list.
#[derive(Default)]
pub(super) struct Block {
    /// In the order of the model.
    pub(super) fields: Vec<Field>,
}

/// What stands under one name.
pub(super) struct Field {
    pub(super) name: String,
    /// From the outermost table: `motors[2].max`.
    pub(super) path: String,
    /// Its place; that of the table around it where the file does not give it.
    pub(super) at: Span,
    /// Whether the file gives it.
    pub(super) given: bool,
    /// Whether something is wrong with it, so that rules about it say nothing.
    pub(super) faulty: bool,
    pub(super) secret: bool,
    pub(super) content: Option<Content>,
    /// The places of an array's elements.
    pub(super) elements: Vec<Span>,
}

pub(super) enum Content {
    Value(Value),
    Group(Block),
    List(Vec<Block>),
}

impl Block {
    pub(super) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// The values without their places.
    pub(super) fn into_values(self) -> Values {
        let mut values = Values::default();
        for field in self.fields {
            let entry = match field.content {
                Some(Content::Value(value)) => Entry::Value(value, field.secret),
                Some(Content::Group(block)) => Entry::Group(block.into_values()),
                Some(Content::List(blocks)) => {
                    Entry::List(blocks.into_iter().map(Block::into_values).collect())
                }
                None => continue,
            };
            values.push(field.name, entry);
        }
        values
    }
}
