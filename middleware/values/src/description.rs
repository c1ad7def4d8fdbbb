//! The description of an IDSL module, as generated code embeds it: JSON without documentation.
//!
//! A type is a text: `float32`, `string`, `string<8>`, `sequence<T>`, `sequence<T,16>`, `T[3]`,
//! `dictionary<K,V>`, or `Module::Name` for a type with a name. Absent parts are left out.

use serde::{Deserialize, Serialize};
use serde_json::{Number, Value};

/// An IDSL module.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Module {
    /// The name after `module`.
    pub module: String,
    /// The types, in their order.
    #[serde(default)]
    pub types: Vec<NamedType>,
    /// The interfaces, in their order.
    #[serde(default)]
    pub interfaces: Vec<Interface>,
}

/// A type with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedType {
    /// The name, without its module.
    pub name: String,
    /// Kind of the type, with its content.
    #[serde(flatten)]
    pub kind: Kind,
}

/// The kinds of types with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Members in order.
    Struct(Vec<Member>),
    /// The members of an exception, those of its base first.
    Exception(Vec<Member>),
    /// Names with their numbers on the wire.
    Enum(Vec<(String, i32)>),
    /// Another name for a type.
    Alias(String),
}

/// A member of a structure, or a parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// The name.
    pub name: String,
    /// The type.
    #[serde(rename = "type")]
    pub ty: String,
    /// Whether the value may be missing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub optional: bool,
    /// The unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The smallest and the largest allowed number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<(Option<Number>, Option<Number>)>,
    /// The default: a number, a text, a `bool`, or the name of an enumerator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub default: Option<Value>,
}

/// An interface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interface {
    /// The name, without its module.
    pub name: String,
    /// The operations, in their order.
    #[serde(default)]
    pub operations: Vec<Operation>,
}

/// An operation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Operation {
    /// The name.
    pub name: String,
    /// The hash of the name, which is in the envelope of a call.
    pub id: i32,
    /// The hash of the types, 16 hexadecimal digits.
    pub hash: String,
    /// `query` for an operation with a reply, else `command`; `publish` for one that is always a
    /// topic.
    pub pattern: String,
    /// The parameters of the request, or of a sample.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<Member>,
    /// The parameters of the reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<Member>,
    /// The type of the returned value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<String>,
    /// The exceptions, each with the number that is in the envelope of a reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub throws: Vec<(String, i32)>,
}

impl Module {
    /// The JSON text, a line for each type and each operation.
    pub fn text(&self) -> String {
        let types: Vec<String> = self.types.iter().map(json).collect();
        let interfaces: Vec<String> = self.interfaces.iter().map(Interface::text).collect();
        format!(
            "{{\"module\":{},\"types\":{},\"interfaces\":{}}}",
            json(&self.module),
            lines(&types),
            lines(&interfaces)
        )
    }
}

impl Interface {
    fn text(&self) -> String {
        let operations: Vec<String> = self.operations.iter().map(json).collect();
        let (name, operations) = (json(&self.name), lines(&operations));
        format!("{{\"name\":{name},\"operations\":{operations}}}")
    }
}

fn lines(items: &[String]) -> String {
    if items.is_empty() {
        "[]".to_owned()
    } else {
        format!("[\n{}\n]", items.join(",\n"))
    }
}

/// Texts, numbers and lists always have a JSON form.
fn json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
