//! The service `~/get_type_description` of a node: describes the types of its endpoints.

use crate::node::Node;
use crate::rcl::text;
use crate::services::{NodeRequest, NodeService, Services};
use crate::types::NodeTypes;
use rc_middleware::{DecodeError, OpenError, Reader, Writer};
use rc_ros_types::{FieldDescription, IndividualType};
use std::sync::Arc;

const SERVICE: NodeService = NodeService {
    name: "get_type_description",
    type_name: "type_description_interfaces/srv/GetTypeDescription",
};

/// Opens the service. `None` if another node of the same name has it: nodes may share a name.
pub(crate) fn open(node: &Node) -> Result<Option<Services>, OpenError> {
    let types = Arc::clone(&node.types);
    let answer = move |asked: &NodeRequest<'_>| answer(asked.body, &types);
    match Services::open(node, "rc-ros2-types", &[SERVICE], Box::new(answer)) {
        Ok(services) => Ok(Some(services)),
        Err(OpenError::AddressTaken { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The body of the reply to a request.
fn answer(request: &[u8], types: &NodeTypes) -> Result<Vec<u8>, String> {
    let wrong = |error: DecodeError| error.to_string();
    let mut reader = Reader::new(request);
    let name: String = reader.get().map_err(wrong)?;
    let hash: String = reader.get().map_err(wrong)?;
    let with_sources: bool = reader.get().map_err(wrong)?;
    let found = match types.with_hash(&hash) {
        Some(found) if found.main.name == name => Ok(found),
        Some(found) => Err(format!("the type with this hash is {}", found.main.name)),
        None => Err("no endpoint of this node has a type with this hash".to_owned()),
    };
    let mut writer = Writer::default();
    writer.put(&found.is_ok());
    text(found.as_ref().err().map_or("", String::as_str), &mut writer);
    if let Ok(found) = &found {
        describe(&found.main, &mut writer);
        writer.length(found.referenced.len());
        for one in &found.referenced {
            describe(one, &mut writer);
        }
    } else {
        // A type without name and fields, which refers to none.
        text("", &mut writer);
        writer.length(0);
        writer.length(0);
    }
    // A component has the fields of its types, but no sources.
    writer.length(0);
    if found.is_ok() && with_sources {
        writer.length(1);
        text("type_sources", &mut writer);
        text("this node has no sources of its types", &mut writer);
    } else {
        writer.length(0);
    }
    let body = writer.finish().map_err(|error| error.to_string())?;
    Ok(body.to_vec())
}

/// `type_description_interfaces/msg/IndividualTypeDescription`
fn describe(one: &IndividualType, writer: &mut Writer) {
    text(&one.name, writer);
    writer.length(one.fields.len());
    for field in &one.fields {
        let FieldDescription {
            name,
            type_id,
            capacity,
            string_capacity,
            nested_type_name,
        } = field;
        text(name, writer);
        writer.put(type_id);
        writer.put(capacity);
        writer.put(string_capacity);
        text(nested_type_name, writer);
        // The default, which is not part of the hash either.
        text("", writer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any request gives a reply or an error.
    #[test]
    fn requests_that_name_no_type_are_answered() {
        let types = NodeTypes::new(&[]);
        let labels = types.labels("std_msgs/msg/String");
        let hash = labels.strip_prefix("typehash=").expect("a hash");
        let hash = hash.trim_end_matches(';').to_owned();
        let ask = |name: &str, hash: &str| {
            let mut writer = Writer::default();
            writer.put(&name.to_owned());
            writer.put(&hash.to_owned());
            writer.put(&true);
            let reply = answer(&writer.into_bytes(), &types).expect("a reply");
            let mut reader = Reader::new(&reply);
            let done: bool = reader.get().expect("whether it was found");
            let reason: String = reader.get().expect("a reason");
            (done, reason)
        };
        assert_eq!(ask("std_msgs/msg/String", &hash), (true, String::new()));
        let other = "the type with this hash is std_msgs/msg/String";
        assert_eq!(ask("std_msgs/msg/Char", &hash), (false, other.to_owned()));
        assert!(!ask("std_msgs/msg/String", "RIHS01_0").0);
        for length in 0..8 {
            assert!(answer(&[0xff; 8][..length], &types).is_err());
        }
    }
}
