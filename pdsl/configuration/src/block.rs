//! The values of one table as they were read, each with its place, so that a broken rule can name it.

use crate::model::{Kind, Parameter, Value};
use crate::values::{Entry, Values};
use rc_diagnostics::Span;

/// A table: all parameters, a group, or one element of a list.
#[derive(Clone, Default)]
pub(crate) struct Block {
    /// In the order of the model.
    pub(crate) fields: Vec<Field>,
}

/// Where a value comes from. What stands later is more likely what was meant by somebody who broke a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Origin {
    /// From the `.pdsl`.
    Default,
    /// It was there before the change that is checked.
    Existing,
    /// From the file or the change that is checked.
    Given,
}

/// What stands under one name.
#[derive(Clone)]
pub(crate) struct Field {
    pub(crate) name: String,
    /// From the outermost table: `motors[2].max`.
    pub(crate) path: String,
    /// Its place; that of the table around it where the file does not give it.
    pub(crate) at: Span,
    pub(crate) origin: Origin,
    /// Whether something is wrong with it, so that rules about it say nothing.
    pub(crate) faulty: bool,
    pub(crate) secret: bool,
    pub(crate) content: Option<Content>,
    /// The places of an array's elements.
    pub(crate) elements: Vec<Span>,
}

#[derive(Clone)]
pub(crate) enum Content {
    Value(Value),
    Group(Block),
    List(Vec<Block>),
}

impl Block {
    pub(crate) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// The values without their places.
    pub(crate) fn values(&self) -> Values {
        let mut values = Values::default();
        for field in &self.fields {
            let entry = match &field.content {
                Some(Content::Value(value)) => Entry::Value(value.clone(), field.secret),
                Some(Content::Group(block)) => Entry::Group(block.values()),
                Some(Content::List(blocks)) => {
                    Entry::List(blocks.iter().map(Block::values).collect())
                }
                None => continue,
            };
            values.push(field.name.clone(), entry);
        }
        values
    }

    /// The values of a configuration that was checked, by the model of its parameters.
    pub(crate) fn of(parameters: &[Parameter], values: &Values, path: &str, at: Span) -> Self {
        let field = |parameter: &Parameter| {
            let name = &parameter.name;
            let path = inner(path, name);
            let content = match &parameter.kind {
                Kind::Scalar { .. } => values.value(name).cloned().map(Content::Value),
                Kind::Group(members) => {
                    let group = Self::of(members, values.group(name), &path, at);
                    Some(Content::Group(group))
                }
                Kind::List { parameters, .. } => {
                    let elements = values.list(name).iter().enumerate();
                    let block = |(index, element)| {
                        Self::of(parameters, element, &format!("{path}[{index}]"), at)
                    };
                    Some(Content::List(elements.map(block).collect()))
                }
            };
            Field {
                name: name.clone(),
                path,
                at,
                origin: Origin::Existing,
                faulty: content.is_none(),
                secret: parameter.secret,
                content,
                elements: Vec::new(),
            }
        };
        let fields = parameters.iter().map(field).collect();
        Self { fields }
    }
}

/// The path of what is called `name` in `path`.
pub(crate) fn inner(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}
