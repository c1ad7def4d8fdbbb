//! The parameters of a component.

use rc_configuration::model::{self, Kind};
use serde::{Serialize, Serializer};

/// All parameters.
#[derive(Debug, Serialize)]
pub struct Parameters {
    /// The name after `ComponentParams`.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// Parameter model for the checker of configurations, as JSON.
    #[serde(skip)]
    pub json: String,
    /// The parameters, in the order of the text.
    pub members: Vec<Parameter>,
    /// The rules between parameters.
    pub rules: Vec<Rule>,
}

/// A rule between parameters.
#[derive(Debug, Serialize)]
pub struct Rule {
    /// The groups and lists that contain it, from outside; it holds for each element of a list.
    pub scope: Vec<String>,
    /// The condition, as it is written.
    pub text: String,
    /// The message if it does not hold.
    pub message: String,
}

/// The kind of a parameter's value; in JSON the word of its type, `group` or `list`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    /// A value of a type, or an array of them.
    Values(model::Type),
    /// A group of parameters.
    Group,
    /// A list of groups.
    List,
}

impl ValueKind {
    /// Whether it has parameters of its own.
    pub fn has_members(self) -> bool {
        match self {
            Self::Values(_) => false,
            Self::Group | Self::List => true,
        }
    }
}

impl Serialize for ValueKind {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Values(ty) => ty.serialize(to),
            Self::Group => to.serialize_str("group"),
            Self::List => to.serialize_str("list"),
        }
    }
}

/// A parameter, a group or a list of groups.
#[derive(Debug, Serialize)]
pub struct Parameter {
    /// The name.
    pub name: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The kind of its value.
    pub kind: ValueKind,
    /// Whether the value is an array.
    pub array: bool,
    /// The number of elements of an array or a list, as documents print it.
    pub length: Option<String>,
    /// The unit of the value.
    pub unit: Option<String>,
    /// The range of the value, as documents print it.
    pub range: Option<String>,
    /// The only values, in TOML; empty if there are others.
    pub choices: Vec<String>,
    /// Whether every configuration must set it.
    pub required: bool,
    /// The default in TOML, unless it is secret.
    pub default: Option<String>,
    /// When a change takes effect; none if it never does.
    pub change: Option<&'static str>,
    /// Whether the value is never shown.
    pub secret: bool,
    /// The allowed values, as documents print them.
    pub allowed: String,
    /// The parameters in a group, and in each group of a list.
    pub members: Vec<Parameter>,
}

pub(super) fn of(parameters: &model::Parameters) -> Parameters {
    Parameters {
        name: parameters.name.clone(),
        doc: parameters.doc.clone(),
        json: parameters.to_json(),
        members: parameters.parameters.iter().map(one).collect(),
        rules: parameters
            .rules
            .iter()
            .map(|rule| Rule {
                scope: rule.scope.clone(),
                text: rule.text.clone(),
                message: rule.message.clone(),
            })
            .collect(),
    }
}

fn one(parameter: &model::Parameter) -> Parameter {
    let (kind, length, members) = match &parameter.kind {
        Kind::Scalar { ty, array } => (ValueKind::Values(*ty), *array, [].as_slice()),
        Kind::Group(members) => (ValueKind::Group, None, members.as_slice()),
        Kind::List { length, parameters } => {
            (ValueKind::List, Some(*length), parameters.as_slice())
        }
    };
    let default = parameter.default.as_ref();
    Parameter {
        name: parameter.name.clone(),
        doc: parameter.doc.clone(),
        kind,
        array: length.is_some() && !kind.has_members(),
        length: length.map(model::Length::described),
        unit: parameter.unit.clone(),
        range: parameter.range.as_ref().map(model::Range::described),
        choices: parameter
            .choices
            .iter()
            .map(model::Value::to_toml)
            .collect(),
        required: default.is_none(),
        default: default
            .filter(|_| !parameter.secret)
            .map(model::Value::to_toml),
        change: parameter.change(),
        secret: parameter.secret,
        allowed: parameter.allowed(),
        members: members.iter().map(one).collect(),
    }
}
