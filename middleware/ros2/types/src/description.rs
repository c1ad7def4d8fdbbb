//! Descriptions of types as `type_description_interfaces` has them, and the hash `RIHS01` (REP
//! 2016): SHA-256 of the description in JSON, without defaults, as
//! `rosidl_generator_type_description` prints it.

use crate::{Definition, Field, STANDARD, Types};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Write;

/// A type and all types that it refers to, as `type_description_interfaces/msg/TypeDescription`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeDescription {
    /// The type itself.
    pub main: IndividualType,
    /// The types of its fields, of their fields, and so on, sorted by name.
    pub referenced: Vec<IndividualType>,
}

/// The fields of one type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IndividualType {
    /// Name: `sensor_msgs/msg/LaserScan`, `std_srvs/srv/Trigger_Request`.
    pub name: String,
    /// Fields, in their order.
    pub fields: Vec<FieldDescription>,
}

/// A field, as `type_description_interfaces/msg/Field`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldDescription {
    /// Name of the field.
    pub name: String,
    /// A constant of `type_description_interfaces/msg/FieldType`.
    pub type_id: u8,
    /// The size of an array or the bound of a sequence; otherwise 0.
    pub capacity: u64,
    /// The bound of a string; otherwise 0.
    pub string_capacity: u64,
    /// The name of a message type; otherwise empty.
    pub nested_type_name: String,
}

/// `FIELD_TYPE_NESTED_TYPE`
const NESTED: u8 = 1;
/// Offset that a kind of collection adds to the constant of its element.
const ARRAY: u8 = 48;
const BOUNDED_SEQUENCE: u8 = 96;
const SEQUENCE: u8 = 144;
/// The types in a `.msg` file with their constants. `char` is an alias of `uint8` there.
const WORDS: [(&str, u8); 17] = [
    ("int8", 2),
    ("uint8", 3),
    ("char", 3),
    ("int16", 4),
    ("uint16", 5),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("bool", 15),
    ("byte", 16),
    ("string", 17),
    ("wstring", 18),
    ("string<=", 21),
    ("wstring<=", 22),
];
/// The field of a message without fields.
const NO_FIELDS: Field<'static> = ("uint8", "structure_needs_at_least_one_member");
/// The parts of a service, each with its field in the type of the service.
const PARTS: [(&str, &str); 3] = [
    ("_Request", "request_message"),
    ("_Response", "response_message"),
    ("_Event", "event_message"),
];

impl TypeDescription {
    /// Describes a message, a service or a part of a service (`std_srvs/srv/Trigger_Request`) of
    /// ROS 2 or of `own`. `None` if the type, or one that it refers to, is in neither.
    pub fn of(name: &str, own: &Types<'_>) -> Option<Self> {
        let main = individual(name, own)?;
        let mut referenced = BTreeMap::new();
        let mut open = nested(&main);
        while let Some(name) = open.pop() {
            if let Entry::Vacant(place) = referenced.entry(name) {
                let found = individual(place.key(), own)?;
                open.extend(nested(&found));
                place.insert(found);
            }
        }
        Some(Self {
            main,
            referenced: referenced.into_values().collect(),
        })
    }

    /// The hash, as ROS 2 prints it: `RIHS01_` and 64 hexadecimal digits.
    pub fn hash(&self) -> String {
        let all: Vec<String> = self.referenced.iter().map(json).collect();
        let text = format!(
            "{{\"type_description\": {}, \"referenced_type_descriptions\": [{}]}}",
            json(&self.main),
            all.join(", ")
        );
        let mut hash = "RIHS01_".to_owned();
        for byte in Sha256::digest(text) {
            let _ = write!(hash, "{byte:02x}");
        }
        hash
    }
}

/// One type as JSON, as Python prints it. Names are ASCII.
fn json(one: &IndividualType) -> String {
    let fields = one.fields.iter().map(|field| {
        let FieldDescription {
            name,
            type_id,
            capacity,
            string_capacity,
            nested_type_name,
        } = field;
        format!(
            "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {type_id}, \"capacity\": {capacity}, \"string_capacity\": {string_capacity}, \"nested_type_name\": \"{nested_type_name}\"}}}}"
        )
    });
    let fields: Vec<String> = fields.collect();
    let (name, fields) = (&one.name, fields.join(", "));
    format!("{{\"type_name\": \"{name}\", \"fields\": [{fields}]}}")
}

/// The names of the types of fields.
fn nested(one: &IndividualType) -> Vec<String> {
    let names = one.fields.iter().map(|field| &field.nested_type_name);
    names.filter(|name| !name.is_empty()).cloned().collect()
}

fn individual(name: &str, own: &Types<'_>) -> Option<IndividualType> {
    let is_service = name.contains("/srv/");
    let fields = match definition(name, own) {
        Some(_) if is_service => parts(name),
        Some(found) => of_fields(&found.fields)?,
        None => of_part(name, own)?,
    };
    Some(IndividualType {
        name: name.to_owned(),
        fields,
    })
}

fn definition<'a>(name: &str, own: &'a Types<'_>) -> Option<&'a Definition<'a>> {
    STANDARD.get(name).or_else(|| own.get(name))
}

/// The fields of the type of a service: its parts.
fn parts(service: &str) -> Vec<FieldDescription> {
    let parts = PARTS.iter();
    parts
        .map(|(part, field)| of_message(field, NESTED, 0, format!("{service}{part}")))
        .collect()
}

/// The fields of a part of a service.
fn of_part(name: &str, own: &Types<'_>) -> Option<Vec<FieldDescription>> {
    let mut parts = PARTS.iter();
    let (service, part) = parts.find_map(|(part, _)| Some((name.strip_suffix(part)?, *part)))?;
    let found = definition(service, own).filter(|_| service.contains("/srv/"))?;
    match part {
        "_Request" => of_fields(&found.fields),
        "_Response" => of_fields(&found.response),
        _ => {
            let info = "service_msgs/msg/ServiceEventInfo".to_owned();
            let one = NESTED + BOUNDED_SEQUENCE;
            Some(vec![
                of_message("info", NESTED, 0, info),
                of_message("request", one, 1, format!("{service}_Request")),
                of_message("response", one, 1, format!("{service}_Response")),
            ])
        }
    }
}

fn of_message(name: &str, type_id: u8, capacity: u64, nested: String) -> FieldDescription {
    FieldDescription {
        name: name.to_owned(),
        type_id,
        capacity,
        string_capacity: 0,
        nested_type_name: nested,
    }
}

fn of_fields(fields: &[Field<'_>]) -> Option<Vec<FieldDescription>> {
    if fields.is_empty() {
        return Some(vec![field(NO_FIELDS)?]);
    }
    fields.iter().copied().map(field).collect()
}

/// Describes a field. `None` if its type cannot be read.
fn field((ty, name): Field<'_>) -> Option<FieldDescription> {
    let (element, many) = match ty.split_once('[') {
        Some((element, many)) => (element, Some(many.strip_suffix(']')?)),
        None => (ty, None),
    };
    let (collection, capacity) = match many {
        None => (0, 0),
        Some("") => (SEQUENCE, 0),
        Some(many) => match many.strip_prefix("<=") {
            Some(bound) => (BOUNDED_SEQUENCE, bound.parse().ok()?),
            None => (ARRAY, many.parse().ok()?),
        },
    };
    if let Some((package, message)) = element.split_once('/') {
        let nested = format!("{package}/msg/{message}");
        return Some(of_message(name, NESTED + collection, capacity, nested));
    }
    let (word, string_capacity) = match element.find("<=") {
        Some(at) => {
            let (word, bound) = element.split_at(at + 2);
            (word, bound.parse().ok()?)
        }
        None => (element, 0),
    };
    let (_, id) = WORDS.iter().find(|(known, _)| *known == word)?;
    Some(FieldDescription {
        name: name.to_owned(),
        type_id: id + collection,
        capacity,
        string_capacity,
        nested_type_name: String::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hashes of ROS 2 Jazzy. `codegen` compares all standard types with those that ROS 2 installs.
    #[test]
    fn hashes_are_those_of_ros() {
        let none = Types::default();
        let hash = |name: &str| TypeDescription::of(name, &none).map(|found| found.hash());
        assert_eq!(
            hash("std_msgs/msg/String").as_deref(),
            Some("RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18")
        );
        assert_eq!(hash("std_msgs/msg/Strnig"), None);
        assert_eq!(hash("std_msgs/msg/String_Request"), None);
    }

    #[test]
    fn own_types_refer_to_standard_types_and_to_each_other() {
        let own = Types::read([
            "a_msgs/msg/A: a_msgs/B[<=3] all, string<=8[2] words",
            "a_msgs/msg/B: std_msgs/Header header",
            "a_msgs/srv/C: a_msgs/Missing it",
        ]);
        let found = TypeDescription::of("a_msgs/msg/A", &own).expect("a type");
        let names: Vec<&str> = found.referenced.iter().map(|t| t.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "a_msgs/msg/B",
                "builtin_interfaces/msg/Time",
                "std_msgs/msg/Header"
            ]
        );
        let [all, words] = found.main.fields.as_slice() else {
            panic!("two fields");
        };
        assert_eq!((all.type_id, all.capacity), (97, 3));
        let of_words = (words.type_id, words.capacity, words.string_capacity);
        assert_eq!(of_words, (69, 2, 8));
        assert_eq!(TypeDescription::of("a_msgs/srv/C", &own), None);
    }
}
