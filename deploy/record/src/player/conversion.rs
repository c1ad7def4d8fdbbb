//! Converts messages of a recording into samples of a topic.

use crate::definition;
use crate::meaning::Converter;
use crate::reader::{Channel, Message};
use crate::{keys, schema};
use rc_observe::Topic;
use rc_values::{Named, Struct, Type, encode_body, from_json};
use serde_json::Value as Json;
use std::borrow::Cow;
use std::sync::Arc;

/// The conversion of messages of a channel into samples of a topic.
pub(super) enum Conversion {
    /// The bytes are those of the network's type.
    None,
    /// By the names of members: the type of the file, and the network's type with the names of
    /// ROS 2.
    ByName(Arc<Struct>, Arc<Struct>),
}

impl Conversion {
    /// Compares the types. The error says why they do not fit.
    pub(super) fn of(
        channel: &Channel,
        topic: &Topic,
        convert: bool,
        meaning: Option<&Converter>,
    ) -> Result<Self, String> {
        if let Some(meaning) = meaning {
            let theirs = definition::of_channel(channel).map_err(|e| e.to_string())?;
            if meaning.converts(&theirs) {
                return Ok(Self::ByName(theirs, own_type(topic)?));
            }
        }
        let hash = format!("{:016x}", topic.operation.hash);
        if channel.get(keys::HASH) == Some(hash.as_str()) {
            return Ok(Self::None);
        }
        let theirs = definition::of_channel(channel).map_err(|e| e.to_string())?;
        let ours = own_type(topic)?;
        if same_members(&theirs, &ours) {
            return Ok(Self::None);
        }
        if convert {
            return Ok(Self::ByName(theirs, ours));
        }
        Err(format!(
            "its type `{}` is another one than that of `{}`; --convert converts by the names of members",
            channel.type_name, topic.address
        ))
    }

    /// The body of a sample.
    pub(super) fn body<'m>(
        &self,
        message: &'m Message,
        meaning: Option<&Converter>,
    ) -> Result<Cow<'m, [u8]>, String> {
        match self {
            Self::None => definition::body(&message.data).map(Cow::Borrowed),
            Self::ByName(theirs, ours) => {
                let value = definition::decode(theirs, message).map_err(|e| e.to_string())?;
                let value = match meaning {
                    Some(meaning) => meaning.value(value).map_err(|e| e.to_string())?,
                    None => value,
                };
                let json = serde_json::to_value(&value).map_err(|e| e.to_string())?;
                let json = pruned(json, &Type::Named(Named::Struct(Arc::clone(ours))));
                let value = from_json(ours, &json).map_err(|e| e.to_string())?;
                // The mapping to ROS 2 keeps the bytes.
                let body = encode_body(&value).map_err(|e| e.to_string())?;
                Ok(Cow::Owned(body))
            }
        }
    }
}

/// Whether the samples of a topic have this type in ROS 2.
pub(super) fn has_type(topic: &Topic, name: &str) -> bool {
    let external = topic.description.external_type.as_deref();
    let own = schema::sample(&topic.interface.name, &topic.operation, external);
    !name.is_empty() && own.name == name
}

/// The type of a topic with the names of ROS 2.
fn own_type(topic: &Topic) -> Result<Arc<Struct>, String> {
    let external = topic.description.external_type.as_deref();
    let own = schema::sample(&topic.interface.name, &topic.operation, external);
    definition::parse(&own.name, &String::from_utf8_lossy(&own.text))
}

/// A value without the members that a type does not have.
fn pruned(mut json: Json, ty: &Type) -> Json {
    match (ty, &mut json) {
        (Type::Named(Named::Struct(ty)), Json::Object(object)) => {
            object.retain(|name, _| ty.member(name).is_some());
            for member in &ty.members {
                if let Some(value) = object.get_mut(&member.name) {
                    *value = pruned(value.take(), &member.ty);
                }
            }
        }
        (Type::Sequence { element, .. } | Type::Array { element, .. }, Json::Array(items)) => {
            for item in items {
                *item = pruned(item.take(), element);
            }
        }
        _ => {}
    }
    json
}

/// Whether two types have the same bytes and names.
fn same_members(a: &Struct, b: &Struct) -> bool {
    let mut pairs = a.members.iter().zip(&b.members);
    a.members.len() == b.members.len()
        && pairs.all(|(a, b)| a.name == b.name && same_type(&a.ty, &b.ty))
}

fn same_type(a: &Type, b: &Type) -> bool {
    match (a, b) {
        (Type::Named(Named::Struct(a)), Type::Named(Named::Struct(b))) => same_members(a, b),
        (
            Type::Sequence {
                element: a,
                bound: x,
            },
            Type::Sequence {
                element: b,
                bound: y,
            },
        ) => x == y && same_type(a, b),
        (
            Type::Array {
                element: a,
                length: x,
            },
            Type::Array {
                element: b,
                length: y,
            },
        ) => x == y && same_type(a, b),
        (a, b) => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ENCAPSULATION;
    use serde_json::json;
    use std::collections::BTreeMap;

    #[test]
    fn a_value_of_another_type_is_converted_by_the_names_of_its_members() {
        let theirs = "float64 x\nstring note\na/Part[] parts\n================\nMSG: a/Part\nint32 id\nint32 more\n";
        let ours =
            "float32 x\nint32 missing\nb/Part[] parts\n================\nMSG: b/Part\nint64 id\n";
        let (theirs, ours) = (
            definition::parse("a/msg/Whole", theirs).expect("a type"),
            definition::parse("b/msg/Whole", ours).expect("a type"),
        );
        assert!(!same_members(&theirs, &ours));
        let value = json!({"x": 1.5, "note": "n", "parts": [{"id": 7, "more": 8}]});
        let value = from_json(&theirs, &value).expect("a value");
        let mut data = ENCAPSULATION.to_vec();
        data.extend(encode_body(&value).expect("bytes"));
        let channel = Channel {
            id: 1,
            topic: "/a".to_owned(),
            encoding: "cdr".to_owned(),
            type_name: "a/msg/Whole".to_owned(),
            schema_encoding: "ros2msg".to_owned(),
            schema: Arc::from([]),
            metadata: BTreeMap::new(),
        };
        let message = Message {
            channel: Arc::new(channel),
            sequence: 0,
            log_time: 0,
            publish_time: 0,
            data,
        };
        let conversion = Conversion::ByName(theirs, Arc::clone(&ours));
        let body = conversion.body(&message, None).expect("a body");
        let back = rc_values::decode(&ours, rc_middleware::Encoding::Cdr, &body);
        let back = serde_json::to_value(back.expect("a value")).expect("JSON");
        assert_eq!(back, json!({"x": 1.5, "missing": 0, "parts": [{"id": 7}]}));
    }
}
