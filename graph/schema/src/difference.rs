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

/// Names an open domain in a difference between the schemas of a component and its network.
const OPEN: &str = "Domain … open";

/// What declarations are compared by.
#[derive(Clone, Copy)]
enum Names {
    /// Names of types and of the domains that declare them.
    OfDomains,
    /// Names of types. What an entity inherits from and is composed by are declarations of their own.
    OfTypes,
}

impl Difference {
    /// The difference between the schema of a network and that of a component, which is to be a part of
    /// it, as a sentence.
    pub fn of_part(&self) -> String {
        let what = &self.what;
        match (&self.first, &self.second) {
            (Some(first), Some(second)) => format!(
                "the component declares `{what}` as `{second}`, and the network as `{first}`"
            ),
            _ => format!("the component declares `{what}`, and the network does not"),
        }
    }
}

impl Schema {
    /// The declarations of `part` that this schema does not have alike, in the order of names. Empty
    /// if a component that knows `part` alone may share a graph of this schema: types have the same
    /// ports, properties and attributes, as far as `part` declares these, and rules and queries are
    /// there. Domains have other names in parts of a schema, so these make no difference.
    pub fn lacks(&self, part: &Self) -> Vec<Difference> {
        let (whole, part) = (self.declared(Names::OfTypes), part.declared(Names::OfTypes));
        let all = part.into_iter();
        let missing = all.filter(|(what, text)| whole.get(what) != Some(text));
        missing
            .map(|(what, text)| Difference {
                first: whole.get(&what).cloned(),
                second: Some(text),
                what,
            })
            .collect()
    }

    /// The different declarations of this schema and another one, in the order of names. Empty if
    /// each accepts what the other one does and has the same queries: the order of declarations and
    /// documentation make no difference.
    pub fn differences(&self, other: &Self) -> Vec<Difference> {
        let (first, second) = (
            self.declared(Names::OfDomains),
            other.declared(Names::OfDomains),
        );
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
    fn declared(&self, names: Names) -> BTreeMap<String, String> {
        let mut all = BTreeMap::new();
        let mut add = |what: String, text: String| {
            all.insert(what, text);
        };
        let of = |domain: &str| match names {
            Names::OfDomains => format!(" of {domain}"),
            Names::OfTypes => String::new(),
        };
        match (names, self.open) {
            (Names::OfDomains, true) => add("domain".to_owned(), format!("{} open", self.name)),
            (Names::OfDomains, false) => add("domain".to_owned(), format!("{} strict", self.name)),
            (Names::OfTypes, true) => add(OPEN.to_owned(), OPEN.to_owned()),
            // A strict domain may be a part of any other one.
            (Names::OfTypes, false) => {}
        }
        for entity in &self.entities {
            let name = &entity.name;
            match names {
                Names::OfDomains => {
                    let parent = entity.parent.as_ref();
                    let parent = parent.map_or(String::new(), |parent| format!(" : {parent}"));
                    let parts = match entity.parts.as_slice() {
                        [] => String::new(),
                        parts => format!(" composed_by {}", parts.join(", ")),
                    };
                    add(
                        name.clone(),
                        format!("entity {name}{parent}{parts}{}", of(&entity.domain)),
                    );
                }
                Names::OfTypes => {
                    add(name.clone(), format!("entity {name}"));
                    for parent in self.ancestry(name).skip(1) {
                        let what = format!("{name} : {parent}");
                        add(what.clone(), format!("entity {what}"));
                    }
                    for part in &entity.parts {
                        let what = format!("{name} composed_by {part}");
                        add(what.clone(), format!("entity {what}"));
                    }
                }
            }
            for attribute in &entity.attributes {
                add(format!("{name}.{}", attribute.name), attribute.text());
            }
        }
        for relation in &self.relations {
            let name = &relation.name;
            let ports: Vec<String> = relation.ports.iter().map(Port::text).collect();
            let mut text = format!(
                "relation {name}({}){}",
                ports.join(", "),
                of(&relation.domain)
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
