//! Types of ROS 2: their fields as text, their descriptions, and their hashes.
//!
#![doc = include_str!("example.md")]

mod description;
pub mod words;

pub use description::{FieldDescription, IndividualType, TypeDescription};

use std::collections::BTreeMap;
use std::sync::LazyLock;

/// A field: type and name, as in a `.msg` file, where a message type has its package
/// (`std_msgs/Header`).
pub type Field<'t> = (&'t str, &'t str);

/// The fields of a message or a service.
#[derive(Debug, Default)]
pub struct Definition<'t> {
    /// The fields of a message or of a request.
    pub fields: Vec<Field<'t>>,
    /// The fields of a response. Empty for a message.
    pub response: Vec<Field<'t>>,
}

/// Definitions by the name of the type, such as `sensor_msgs/msg/LaserScan`.
#[derive(Debug, Default)]
pub struct Types<'t>(BTreeMap<&'t str, Definition<'t>>);

/// The types of ROS 2 Jazzy.
pub static STANDARD: LazyLock<Types<'static>> = LazyLock::new(|| {
    let lines = include_str!("standard.txt").lines();
    Types::read(lines.filter(|line| !line.starts_with('#')))
});

impl<'t> Types<'t> {
    /// Reads lines `NAME: TYPE FIELD, TYPE FIELD`; in the line of a service, the response follows
    /// `---`. Lines without `:` are ignored.
    pub fn read(lines: impl IntoIterator<Item = &'t str>) -> Self {
        let entries = lines.into_iter().filter_map(|line| line.split_once(':'));
        let entries = entries.map(|(name, text)| {
            let (fields, response) = text.split_once("---").unwrap_or((text, ""));
            let definition = Definition {
                fields: read(fields),
                response: read(response),
            };
            (name, definition)
        });
        Self(entries.collect())
    }

    /// The fields of a type.
    pub fn get(&self, name: &str) -> Option<&Definition<'t>> {
        self.0.get(name)
    }

    /// The name of a type as the table has it.
    pub fn name(&self, name: &str) -> Option<&'t str> {
        self.0.get_key_value(name).map(|(name, _)| *name)
    }

    /// The names of all types, sorted.
    pub fn names(&self) -> impl Iterator<Item = &'t str> + Clone {
        self.0.keys().copied()
    }
}

fn read(text: &str) -> Vec<Field<'_>> {
    let parts = text.split(',');
    parts
        .filter_map(|part| part.trim().split_once(' '))
        .collect()
}
