//! The types of fields in ROS 2.

use super::names::TypeName;
use rc_idsl::model::Primitive;

/// The type of a field.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct FieldType {
    pub(super) element: Element,
    pub(super) multiplicity: Multiplicity,
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Element {
    Word(&'static str),
    String(Option<u32>),
    Message(TypeName),
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Multiplicity {
    One,
    Array(u32),
    Sequence(Option<u32>),
}

impl FieldType {
    /// A single value.
    pub(super) fn one(element: Element) -> Self {
        Self {
            element,
            multiplicity: Multiplicity::One,
        }
    }

    /// The type as written in a file of `package`.
    pub(crate) fn written(&self, package: &str) -> String {
        let element = match &self.element {
            Element::Word(word) => (*word).to_owned(),
            Element::String(None) => "string".to_owned(),
            Element::String(Some(bound)) => format!("string<={bound}"),
            Element::Message(name) if name.package == package => name.name.clone(),
            Element::Message(name) => format!("{}/{}", name.package, name.name),
        };
        match self.multiplicity {
            Multiplicity::One => element,
            Multiplicity::Array(size) => format!("{element}[{size}]"),
            Multiplicity::Sequence(None) => format!("{element}[]"),
            Multiplicity::Sequence(Some(bound)) => format!("{element}[<={bound}]"),
        }
    }

    /// The package of the message type. `None` for other types.
    pub(super) fn package(&self) -> Option<&str> {
        match &self.element {
            Element::Message(name) => Some(&name.package),
            Element::Word(_) | Element::String(_) => None,
        }
    }
}

impl Element {
    /// The type of a primitive. `byte` and `char` are not used: they are aliases of `uint8`.
    pub(super) fn primitive(primitive: Primitive) -> Self {
        Self::Word(primitive.plain().word())
    }
}
