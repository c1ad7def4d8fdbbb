//! The picture of a schema: a box for each entity, a row for each of its own attributes and for each
//! relation that starts there.

use crate::{Box, Picture, Row, short};
use graph_schema::{Entity, Port, Relation, Schema};
use rc_diagnostics::foreign;

/// The picture of a schema with all that it imports.
pub fn of_schema(schema: &Schema) -> Picture {
    let place = |name: &str| schema.entities.iter().position(|e| e.name == name);
    let boxes = schema.entities.iter().map(|entity| {
        let mut rows = Vec::new();
        if let Some(parent) = &entity.parent {
            rows.push(Row {
                text: short(&format!("is a {parent}")),
                ends: place(parent)
                    .map(|at| (at, format!("{} is a {parent}", entity.name)))
                    .into_iter()
                    .collect(),
                is_parent: true,
            });
        }
        let starts = |relation: &&Relation| first(relation) == Some(entity.name.as_str());
        for relation in schema.relations.iter().filter(starts) {
            rows.push(leaving(relation, entity, &place));
        }
        let parent = entity
            .parent
            .as_deref()
            .and_then(|name| schema.entity(name));
        let inherited = |name: &str| parent.is_some_and(|p| p.attribute(name).is_some());
        let own = entity.attributes.iter().filter(|a| !inherited(&a.name));
        rows.extend(own.map(|attribute| Row {
            text: short(&format!("{} {}", attribute.name, attribute.text())),
            ..Row::default()
        }));
        let doc = entity.doc.iter().map(|line| foreign::clean(line));
        let title = format!("entity {} of {}", entity.name, entity.domain);
        Box {
            name: short(&entity.name),
            kind: short(&entity.domain),
            tooltip: [title].into_iter().chain(doc).collect(),
            rows,
        }
    });
    Picture {
        title: foreign::clean(&schema.name),
        boxes: boxes.collect(),
    }
}

fn first(relation: &Relation) -> Option<&str> {
    relation.ports.first().map(|port| port.entity.as_str())
}

/// The row of a relation at the entity where its edges start.
fn leaving(relation: &Relation, from: &Entity, place: &dyn Fn(&str) -> Option<usize>) -> Row {
    let name = &relation.name;
    let port = |port: &Port| match (port.min, port.max) {
        (0, None) => port.name.clone(),
        (min, None) => format!("{} {min}:", port.name),
        (min, Some(max)) => format!("{} {min}:{max}", port.name),
    };
    let ports: Vec<String> = relation.ports.iter().map(port).collect();
    let tree = if relation.tree.is_some() {
        ", tree"
    } else {
        ""
    };
    let to = relation
        .ports
        .get(1)
        .map_or("", |port| port.entity.as_str());
    let mut about = vec![format!("{} {name} {to}", from.name)];
    about.extend(
        relation
            .attributes
            .iter()
            .map(|a| format!("{} {}", a.name, a.text())),
    );
    about.extend(relation.doc.iter().cloned());
    let about = about.iter().map(|line| foreign::clean(line));
    let about = about.collect::<Vec<_>>().join("\n");
    let sign = if to == from.name { "↺ " } else { "" };
    let end = place(to).filter(|_| to != from.name);
    Row {
        text: short(&format!("{sign}{name} ({}{tree})", ports.join(", "))),
        ends: end.map(|at| (at, about)).into_iter().collect(),
        is_parent: false,
    }
}
