//! The differences between two schemas.

use crate::{Attribute, Kind, Port, Schema};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// One declaration that two schemas do not have alike.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Difference {
    /// The name, as in `Object.mass`.
    pub what: String,
    /// The declaration in the first schema. `None` if there is none.
    pub first: Option<String>,
    /// The declaration in the second schema. `None` if there is none.
    pub second: Option<String>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = &self.what;
        match (&self.first, &self.second) {
            (Some(first), Some(second)) => {
                write!(
                    f,
                    "{what}: `{first}` in the first schema, `{second}` in the second"
                )
            }
            (Some(first), None) => write!(f, "{what}: `{first}` in the first schema only"),
            (None, Some(second)) => write!(f, "{what}: `{second}` in the second schema only"),
            (None, None) => write!(f, "{what}"),
        }
    }
}

impl Schema {
    /// The different declarations of this schema and another one, in the order of names. Empty if
    /// each accepts what the other one does and has the same queries: the order of declarations and
    /// documentation make no difference.
    pub fn differences(&self, other: &Self) -> Vec<Difference> {
        let (first, second) = (self.declared(), other.declared());
        let all: BTreeSet<&String> = first.keys().chain(second.keys()).collect();
        let differ = all
            .into_iter()
            .filter(|what| first.get(*what) != second.get(*what));
        differ
            .map(|what| Difference {
                what: what.clone(),
                first: first.get(what).cloned(),
                second: second.get(what).cloned(),
            })
            .collect()
    }

    /// All declarations: what each is about, and its text.
    fn declared(&self) -> BTreeMap<String, String> {
        let mut all = BTreeMap::new();
        let mut add = |what: String, text: String| {
            all.insert(what, text);
        };
        let kind = if self.open { "open" } else { "strict" };
        add("domain".to_owned(), format!("{} {kind}", self.name));
        for entity in &self.entities {
            let name = &entity.name;
            let parent = entity.parent.as_ref();
            let parent = parent.map_or(String::new(), |parent| format!(" : {parent}"));
            let parts = match entity.parts.as_slice() {
                [] => String::new(),
                parts => format!(" composed_by {}", parts.join(", ")),
            };
            add(
                name.clone(),
                format!("entity {name}{parent}{parts} of {}", entity.domain),
            );
            for attribute in &entity.attributes {
                add(format!("{name}.{}", attribute.name), attribute.text());
            }
        }
        for relation in &self.relations {
            let name = &relation.name;
            let ports: Vec<String> = relation.ports.iter().map(Port::text).collect();
            let mut text = format!(
                "relation {name}({}) of {}",
                ports.join(", "),
                relation.domain
            );
            if let Some(tree) = &relation.tree {
                let child = relation.ports.get(tree.child);
                let child = child.map_or("?", |port| port.name.as_str());
                text += &format!(" tree of {child}");
            }
            if let Some(placed) = relation.placed() {
                let attributes = match &placed.pose {
                    crate::PoseOf::One(pose) => pose.clone(),
                    crate::PoseOf::Two(by, angles) => format!("{by}, {angles}"),
                };
                text += &format!(" placed by {attributes}");
            }
            if let Some(promotes) = &relation.promotes {
                text += &format!(" promotes {promotes}");
            }
            add(name.clone(), text);
            for attribute in &relation.attributes {
                add(format!("{name}.{}", attribute.name), attribute.text());
            }
        }
        for rule in &self.rules {
            let side = |(port, attribute): &(usize, String)| {
                let relation = self.relation(&rule.relation);
                let port = relation.and_then(|r| r.ports.get(*port));
                format!(
                    "{}.{attribute}",
                    port.map_or("?", |port| port.name.as_str())
                )
            };
            let (left, right) = (side(&rule.left), side(&rule.right));
            let comparison = rule.comparison.text();
            let what = format!("require {left} {comparison} {right} of {}", rule.relation);
            add(what, rule.message.clone());
        }
        for query in &self.queries {
            let parameters = query.parameters.iter();
            let parameters = parameters.map(|(name, kind)| format!("{name} {kind}"));
            let parameters = parameters.collect::<Vec<_>>().join(", ");
            let text = format!("({parameters}) \"{}\"", query.text);
            add(format!("query {}", query.name), text);
        }
        all
    }
}

impl Port {
    /// The port as a schema declares it.
    fn text(&self) -> String {
        let (name, entity) = (&self.name, &self.entity);
        match (self.min, self.max) {
            (0, None) => format!("{name} {entity}"),
            (min, None) => format!("{name} {entity} {min}:"),
            (min, Some(max)) => format!("{name} {entity} {min}:{max}"),
        }
    }
}

impl Attribute {
    /// Type and properties, as a schema declares them.
    pub fn text(&self) -> String {
        let mut text = self.kind.text();
        if let Kind::Block(block) = &self.kind {
            // Two files may declare one name differently.
            let numbers = block.numbers.iter().map(|number| {
                let unit = number.unit.as_ref();
                let unit = unit.map_or(String::new(), |unit| format!(" in {unit}"));
                format!("{}{unit}, {}", number.name, number.number.word())
            });
            let numbers: Vec<String> = numbers.collect();
            text += &format!(" ({}: {})", block.meaning, numbers.join("; "));
            text += if block.is_sequence { " sequence" } else { "" };
            if let Some(of) = &block.consistent_with {
                text += &format!(" consistency {of}");
            }
        }
        if let Some(unit) = &self.unit {
            text += &format!(" unit \"{unit}\"");
        }
        if let Some((low, high)) = self.range {
            // A missing limit is left out, as in a file.
            let end = |end: f64| {
                if end.is_finite() {
                    end.to_string()
                } else {
                    String::new()
                }
            };
            text += &format!(" {}:{}", end(low), end(high));
        }
        for (is, word) in [(self.optional, " optional"), (self.key, " key")] {
            text += if is { word } else { "" };
        }
        if let Some(history) = self.history {
            text += &format!(" history {history:?}");
        }
        text
    }
}
