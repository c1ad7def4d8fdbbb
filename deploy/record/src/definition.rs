//! Definitions of ROS 2 messages as types, by which a message of any file can be decoded.

use crate::ENCAPSULATION;
use crate::error::RecordError;
use crate::reader::{Channel, Message};
use rc_middleware::Encoding;
use rc_values::description::{Kind, Member, Module, NamedType};
use rc_values::{Catalog, Named, Struct, Type, Value};
use rc_vocabulary::Primitive;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The fields of one message: type and name.
type Fields = Vec<(String, String)>;

/// The type of the messages of a channel.
pub fn of_channel(channel: &Channel) -> Result<Arc<Struct>, RecordError> {
    let topic = &channel.topic;
    if channel.encoding != "cdr" || channel.schema_encoding != "ros2msg" {
        return Err(RecordError::Value(format!(
            "`{topic}` has messages in `{}` described in `{}`; only `cdr` with `ros2msg` can be decoded",
            channel.encoding, channel.schema_encoding
        )));
    }
    let text = String::from_utf8_lossy(&channel.schema);
    parse(&channel.type_name, &text).map_err(|reason| {
        RecordError::Value(format!(
            "the definition of `{topic}` cannot be read: {reason}"
        ))
    })
}

/// Decodes a message by the type of its channel.
pub fn decode(ty: &Arc<Struct>, message: &Message) -> Result<Value, RecordError> {
    let wrong = |reason: String| {
        let topic = &message.channel.topic;
        RecordError::Value(format!(
            "a message of `{topic}` cannot be decoded: {reason}"
        ))
    };
    let body = body(&message.data).map_err(wrong)?;
    rc_values::decode(ty, Encoding::Cdr, body).map_err(|e| wrong(e.to_string()))
}

/// The body of a message after its encapsulation.
pub fn body(data: &[u8]) -> Result<&[u8], String> {
    match data.split_at_checked(ENCAPSULATION.len()) {
        Some((head, body)) if head[..2] == ENCAPSULATION[..2] => Ok(body),
        Some(([0, 0, ..], _)) => Err("it is in big endian".to_owned()),
        Some((head, _)) => Err(format!("its encapsulation is {head:02x?}")),
        None => Err("it is shorter than its encapsulation".to_owned()),
    }
}

/// Reads a definition: that of `name`, then those of the messages inside it.
pub fn parse(name: &str, text: &str) -> Result<Arc<Struct>, String> {
    let mut messages: BTreeMap<String, Fields> = BTreeMap::new();
    let own = key(name);
    let mut at = own.clone();
    messages.insert(at.clone(), Vec::new());
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if let Some(inner) = line.strip_prefix("MSG: ") {
            at = key(inner.trim());
            messages.insert(at.clone(), Vec::new());
        } else if let Some((ty, rest)) = line.split_once(char::is_whitespace) {
            let field = rest.split_whitespace().next().unwrap_or_default();
            // A constant is not on the wire.
            let is_constant = field.contains('=')
                || rest.trim_start()[field.len()..]
                    .trim_start()
                    .starts_with('=');
            if !is_constant && !line.starts_with("===") {
                let fields = messages.entry(at.clone()).or_default();
                fields.push((ty.to_owned(), field.to_owned()));
            }
        }
    }
    let mut modules: BTreeMap<String, Module> = BTreeMap::new();
    for (name, fields) in &messages {
        let (package, short) = split(name);
        let members = fields
            .iter()
            .map(|(ty, field)| member(ty, field, package, &messages));
        let mut members = members.collect::<Result<Vec<_>, _>>()?;
        if members.is_empty() {
            members.push(plain("structure_needs_at_least_one_member", "uint8"));
        }
        let module = modules.entry(package.to_owned()).or_default();
        package.clone_into(&mut module.module);
        module.types.push(NamedType {
            name: short.to_owned(),
            kind: Kind::Struct(members),
        });
    }
    let modules: Vec<Module> = modules.into_values().collect();
    let catalog = Catalog::new(&modules).map_err(|e| e.to_string())?;
    match catalog.named(&own.replace('/', "::")) {
        Some(Type::Named(Named::Struct(of))) => Ok(Arc::clone(of)),
        _ => Err(format!("it has no message `{name}`")),
    }
}

/// `package/Name` of `package/msg/Name`.
fn key(name: &str) -> String {
    let mut parts: Vec<&str> = name.split('/').collect();
    if parts.len() == 3 {
        parts.remove(1);
    }
    match parts.as_slice() {
        [package, name] => format!("{package}/{name}"),
        _ => format!("unnamed/{name}"),
    }
}

fn split(name: &str) -> (&str, &str) {
    name.split_once('/').unwrap_or(("unnamed", name))
}

fn plain(name: &str, ty: &str) -> Member {
    Member {
        name: name.to_owned(),
        ty: ty.to_owned(),
        ..Member::default()
    }
}

fn member(
    ty: &str,
    field: &str,
    package: &str,
    messages: &BTreeMap<String, Fields>,
) -> Result<Member, String> {
    let (element, count) = match ty.split_once('[') {
        Some((element, count)) => (element, count.strip_suffix(']')),
        None => (ty, None),
    };
    let element = element_type(element, package, messages)?;
    let ty = match count {
        None => element,
        Some("") => format!("sequence<{element}>"),
        Some(count) => match count.strip_prefix("<=") {
            Some(bound) => format!("sequence<{element},{bound}>"),
            None => format!("{element}[{count}]"),
        },
    };
    Ok(plain(field, &ty))
}

fn element_type(
    ty: &str,
    package: &str,
    messages: &BTreeMap<String, Fields>,
) -> Result<String, String> {
    if let Some(bound) = ty.strip_prefix("string<=") {
        return Ok(format!("string<{bound}>"));
    }
    Ok(match ty {
        "byte" | "char" => "uint8".to_owned(),
        "string" => ty.to_owned(),
        word if Primitive::from_word(word).is_some() => ty.to_owned(),
        "wstring" | "wchar" => return Err(format!("`{ty}` has no type here")),
        // Definitions of ROS 1 and of older files have these as words.
        "time" | "duration" => return Err(format!("`{ty}` is a type of ROS 1")),
        other => {
            let own = format!("{package}/{other}");
            let full = key(other);
            let name = if other.contains('/') { full } else { own };
            if !messages.contains_key(&name) {
                return Err(format!("it has no message `{other}`"));
            }
            name.replace('/', "::")
        }
    })
}
