//! Types of interfaces as definitions of ROS 2 messages, which Foxglove and the tools of ROS 2
//! read.
//!
//! The mapping is that of `rcgen export`, see `docs/ros2-mapping.md`. It expresses every type.
//! Where two messages of a definition want one name, the second one has a number at its end.

use rc_ros_types::{STANDARD, words};
use rc_values::{Member, Named, Operation, Struct, Type};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The definition of a type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// The name of the type.
    pub name: String,
    /// The language of the definition.
    pub encoding: String,
    /// The definition.
    pub text: Vec<u8>,
}

/// Separates the definitions of messages in a schema.
const SEPARATOR: &str =
    "================================================================================\n";

/// Field that ROS 2 adds to a message without fields: one byte.
const NOTHING: &str = "uint8 structure_needs_at_least_one_member\n";

/// The samples of a topic. `external` is the name that ROS 2 knows for it, if the component says
/// so.
pub fn sample(interface: &str, operation: &Operation, external: Option<&str>) -> Schema {
    if let Some(schema) = external.and_then(standard) {
        return schema;
    }
    let only = only_structure(&operation.request);
    let name = only.map_or_else(
        || operation_name(interface, &operation.name),
        |only| name_of(only),
    );
    let full = external.map_or_else(|| with_kind(&name, "msg"), str::to_owned);
    let mut definitions = Definitions::of(&full);
    let (package, place) = parts(&name);
    let members = only.map_or(&operation.request.members, |only| &only.members);
    let text = definitions.fields(members, package, place);
    definitions.schema(&full, &text)
}

/// The requests of an operation. Its name is that of a message, since libraries of others know no
/// parts of services.
pub fn request(interface: &str, operation: &Operation) -> Schema {
    let name = operation_name(interface, &operation.name);
    let full = format!("{}_Request", with_kind(&name, "msg"));
    let mut definitions = Definitions::of(&full);
    let (package, place) = parts(&name);
    let text = definitions.fields(&operation.request.members, package, place);
    definitions.schema(&full, &text)
}

/// The replies of an operation: the code, the exceptions, the output parameters and the result.
pub fn reply(interface: &str, operation: &Operation) -> Schema {
    let name = operation_name(interface, &operation.name);
    let full = format!("{}_Response", with_kind(&name, "msg"));
    let mut definitions = Definitions::of(&full);
    let (package, place) = parts(&name);
    let mut text = String::new();
    if !operation.throws.is_empty() {
        text += "int32 code\n";
        for exception in &operation.throws {
            let field = exception_field(&exception.ty);
            let ty = definitions.needs(&exception.ty);
            text += &format!("{ty} {field}\n");
        }
    }
    let members = reply_members(&operation.reply);
    if operation.throws.is_empty() || !members.is_empty() {
        text += &definitions.fields(&members, package, place);
    }
    definitions.schema(&full, &text)
}

/// The members of a reply, with the name of the result in ROS 2.
fn reply_members(reply: &Struct) -> Vec<Member> {
    let members = reply.members.iter().cloned();
    let members = members.map(|mut member| {
        if member.name == "return" {
            "result".clone_into(&mut member.name);
        }
        member
    });
    members.collect()
}

/// The field of an exception in a reply.
pub fn exception_field(exception: &Struct) -> String {
    words::field(last(&exception.name))
}

/// The structure that is the only parameter.
fn only_structure(parameters: &Struct) -> Option<&Arc<Struct>> {
    match parameters.members.as_slice() {
        [
            Member {
                ty: Type::Named(Named::Struct(only)),
                optional: false,
                ..
            },
        ] => Some(only),
        _ => None,
    }
}

/// `package/InterfaceOperation`.
fn operation_name(interface: &str, operation: &str) -> String {
    let (module, name) = interface.split_once("::").unwrap_or(("", interface));
    let package = words::package(module);
    format!(
        "{package}/{}{}",
        words::camel(name),
        words::camel(operation)
    )
}

fn parts(name: &str) -> (&str, &str) {
    name.split_once('/').unwrap_or(("", name))
}

/// `package/Name` of `package/msg/Name`.
fn short(full: &str) -> String {
    match (full.split_once('/'), full.rsplit_once('/')) {
        (Some((package, _)), Some((_, name))) => format!("{package}/{name}"),
        _ => full.to_owned(),
    }
}

fn with_kind(name: &str, kind: &str) -> String {
    let (package, name) = parts(name);
    format!("{package}/{kind}/{name}")
}

fn last(name: &str) -> &str {
    name.rsplit("::").next().unwrap_or(name)
}

/// A message of ROS 2 itself.
fn standard(name: &str) -> Option<Schema> {
    let mut out = Definitions::default();
    let text = standard_fields(name, &mut out)?;
    Some(out.schema(name, &text))
}

fn standard_fields(name: &str, out: &mut Definitions) -> Option<String> {
    let definition = STANDARD.get(name)?;
    let mut text = String::new();
    for (ty, field) in &definition.fields {
        text += &format!("{ty} {field}\n");
        let element = ty.split('[').next().unwrap_or(ty);
        if let Some((package, inner)) = element.split_once('/') {
            let key = element.to_owned();
            if !out.messages.contains_key(&key) {
                out.messages.insert(key.clone(), String::new());
                let inner = standard_fields(&format!("{package}/msg/{inner}"), out)?;
                out.messages.insert(key, inner);
            }
        }
    }
    if definition.fields.is_empty() {
        text += NOTHING;
    }
    Some(text)
}

/// The messages that a definition refers to, by `package/Name`.
#[derive(Default)]
struct Definitions {
    messages: BTreeMap<String, String>,
    /// The names of structures of the interface, by the structure's own name.
    structures: BTreeMap<String, String>,
}

/// `package/Name` of a structure.
fn name_of(of: &Struct) -> String {
    let (module, name) = of.name.rsplit_once("::").unwrap_or(("", &of.name));
    format!("{}/{}", words::package(module), words::ty(name))
}

impl Definitions {
    /// Reserves the name of the message `full`.
    fn of(full: &str) -> Self {
        let mut definitions = Self::default();
        definitions.claim(&short(full));
        definitions
    }

    /// Takes a name: `wanted`, or with a number if another message has it. Two types can want one
    /// name: `scan_data` and `ScanData`, or a structure `ScanRowsElement` and the element of `rows`
    /// in `Scan`. Each gets its own message, because one definition would hide the other.
    fn claim(&mut self, wanted: &str) -> String {
        let mut name = wanted.to_owned();
        let mut number = 2;
        while self.messages.contains_key(&name) {
            name = format!("{wanted}{number}");
            number += 1;
        }
        self.messages.insert(name.clone(), String::new());
        name
    }

    fn schema(&self, name: &str, text: &str) -> Schema {
        let mut text = text.to_owned();
        let own = short(name);
        for (name, fields) in self.messages.iter().filter(|(name, _)| **name != own) {
            text += &format!("{SEPARATOR}MSG: {name}\n{fields}");
        }
        Schema {
            name: name.to_owned(),
            encoding: "ros2msg".to_owned(),
            text: text.into_bytes(),
        }
    }

    /// Adds the message of a structure, and returns its name.
    fn needs(&mut self, of: &Arc<Struct>) -> String {
        if let Some(name) = self.structures.get(&of.name) {
            return name.clone();
        }
        let name = self.claim(&name_of(of));
        self.structures.insert(of.name.clone(), name.clone());
        let (package, place) = parts(&name);
        let text = self.fields(&of.members, package, place);
        self.messages.insert(name.clone(), text);
        name
    }

    /// The lines of members. `place` names the messages of what has no name of its own.
    fn fields(&mut self, members: &[Member], package: &str, place: &str) -> String {
        let mut text = String::new();
        for member in members {
            let inner = format!("{place}{}", words::camel(&member.name));
            let ty = if member.optional {
                let element = self.element(&member.ty, package, &format!("{inner}Element"));
                format!("{element}[<=1]")
            } else {
                self.ty(&member.ty, package, &inner)
            };
            let unit = member.unit.as_ref();
            let comment = unit.map_or(String::new(), |unit| format!(" # [{unit}]"));
            text += &format!("{ty} {}{comment}\n", words::field(&member.name));
        }
        if members.is_empty() {
            text += NOTHING;
        }
        text
    }

    fn ty(&mut self, ty: &Type, package: &str, place: &str) -> String {
        match ty {
            Type::Sequence { element, bound } => {
                let element = self.element(element, package, &format!("{place}Element"));
                match bound {
                    Some(bound) => format!("{element}[<={bound}]"),
                    None => format!("{element}[]"),
                }
            }
            Type::Array { element, length } => {
                let element = self.element(element, package, &format!("{place}Element"));
                format!("{element}[{length}]")
            }
            Type::Dictionary { key, value } => {
                let name = self.claim(&format!("{package}/{place}Entry"));
                let key = self.ty(key, package, &format!("{place}EntryKey"));
                let value = self.ty(value, package, &format!("{place}EntryValue"));
                let fields = format!("{key} key\n{value} value\n");
                self.messages.insert(name.clone(), fields);
                format!("{name}[]")
            }
            other @ (Type::Primitive(_) | Type::Text { .. } | Type::Named(_)) => {
                self.element(other, package, place)
            }
        }
    }

    /// The type of one value. A collection becomes a message with one field, which adds nothing
    /// on the wire.
    fn element(&mut self, ty: &Type, package: &str, place: &str) -> String {
        match ty {
            Type::Primitive(primitive) => primitive.word().to_owned(),
            Type::Text { bound: None } => "string".to_owned(),
            Type::Text { bound: Some(bound) } => format!("string<={bound}"),
            Type::Named(Named::Enum(_)) => "int32".to_owned(),
            Type::Named(Named::Struct(of)) => self.needs(of),
            Type::Sequence { .. } | Type::Array { .. } | Type::Dictionary { .. } => {
                let name = self.claim(&format!("{package}/{place}"));
                let data = self.ty(ty, package, place);
                self.messages.insert(name.clone(), format!("{data} data\n"));
                name
            }
        }
    }
}
