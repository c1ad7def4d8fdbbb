//! The values of one table with their locations, so that a violated rule can point to them.

use crate::model::{Kind, Parameter, Value};
use crate::values::{Entry, Values};
use rc_diagnostics::Span;

/// The values of one table: all parameters, a group, or one element of a list.
#[derive(Clone, Default)]
pub(crate) struct Block {
    /// In the order of the model.
    pub(crate) fields: Vec<Field>,
}

/// The origin of a value. A later variant is more likely the mistake of a user who violates a
/// rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Origin {
    /// The default in the `.pdsl`.
    Default,
    /// The value before the change that is checked.
    Existing,
    /// The file or the change that is checked.
    UntypedValue,
}

/// The value of one parameter, group or list.
#[derive(Clone)]
pub(crate) struct Field {
    pub(crate) name: String,
    /// The path from the outermost table: `motors[2].max`.
    pub(crate) path: String,
    /// The location. If the file does not set the field, that of the table around it.
    pub(crate) at: Span,
    pub(crate) origin: Origin,
    /// Whether the value is invalid. Rules that refer to an invalid value are not evaluated.
    pub(crate) faulty: bool,
    pub(crate) secret: bool,
    pub(crate) content: Option<Content>,
    /// The locations of the elements of an array.
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

    /// The values without their locations.
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

    /// The values of a configuration that is already checked, by the model of its parameters.
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

/// The path of `name` inside `path`.
pub(crate) fn inner(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}
