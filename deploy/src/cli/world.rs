//! `rcdeploy world`: the shared world of a network, its replicas, and its contents.

mod arguments;
mod at;
mod diff;
mod elements;
mod follow;
mod graph;
mod newcomers;
mod query;
mod replica;
mod state;
mod tree;
mod watch;

pub(super) use arguments::WorldAction;

use super::output::{Failure, counted, show, system};
use elements::{
    attributes, document, json_of, kind, named, shown, text, unknown_attribute, value, word,
};
use graph_exchange::{Document, graph_json};
use rc_deploy_client::Format;
use rc_world::Token;
use rc_world::property_graph::{Element, Snapshot};
use replica::Listener;
use serde_json::json;
use std::path::Path;

/// Asks for the world of a network when a recording begins: the answer is recorded, too, so that the recording
/// has more than changes.
pub(super) struct WorldRequest(Option<Listener>);

impl WorldRequest {
    /// No component is asked if none has a world.
    pub(super) fn new(network: &rc_observe::Network) -> Result<Self, Failure> {
        let has_world = replica::has_world(network);
        let listener = has_world.then(|| Listener::open(&network.name, None));
        Ok(Self(listener.transpose()?))
    }

    /// Takes what has come, and waits for nothing.
    pub(super) fn advance(&mut self) -> Result<(), Failure> {
        let arrived = self.0.as_mut().map_or(Ok(false), Listener::advance);
        if !matches!(arrived, Ok(false)) {
            self.0 = None;
        }
        arrived.map(|_| ())
    }
}

/// Prints the replicas of a network.
pub(super) fn world(network: &str, format: Format) -> Result<u8, Failure> {
    state::state(network, format)
}

/// A picture of a network's world, as SVG. `None` if its components have none, or at Ctrl-C.
pub(super) fn picture(network: &str) -> Result<Option<String>, Failure> {
    if !replica::has_world(&super::look::look(network)?) {
        return Ok(None);
    }
    graph::drawn(network, arguments::PictureFormat::Svg)
}

/// Reads or changes a world.
pub(super) fn act(action: WorldAction) -> Result<u8, Failure> {
    match action {
        WorldAction::Get {
            of,
            elements,
            after,
        } => get(&of.network, &elements, after, of.format),
        WorldAction::Set { of, changes } => set(&of.network, &changes, of.format),
        WorldAction::Watch { of, words, count } => {
            let format = of.format;
            watch::watch(
                &of.network,
                &watch::Wanted {
                    words,
                    count,
                    format,
                },
            )
        }
        WorldAction::Query {
            network,
            query,
            parameters,
            after,
        } => query::query(&network, query.as_deref(), &parameters, after),
        WorldAction::Graph {
            network,
            format,
            output,
        } => graph::graph(&network, format, output.as_deref()),
        WorldAction::Tree {
            network,
            output,
            follow,
        } => tree::tree(&network, output.as_deref(), follow),
        WorldAction::Save { of, file } => save(&of.network, &file, of.format),
        WorldAction::At {
            time,
            file,
            schema,
            elements,
            save,
            format,
        } => {
            if let Some(to) = &save {
                check_ending(to)?;
            }
            let world = at::world(time, &file, &schema)?;
            let Some(to) = save else {
                return show_elements(&world, &elements, format);
            };
            let name = schema
                .file_name()
                .map(|name| name.to_string_lossy().into_owned());
            write(&to, &world, name, format)
        }
        WorldAction::Diff {
            first,
            second,
            format,
        } => diff::diff(&first, &second, format),
    }
}

fn get(
    network: &str,
    elements: &[String],
    after: Option<Token>,
    format: Format,
) -> Result<u8, Failure> {
    let Some(listener) = Listener::joined_after(network, after)? else {
        return Ok(0);
    };
    show_elements(&listener.world.snapshot(), elements, format)
}

/// Prints the elements and attributes that words name, or a list of all.
fn show_elements(world: &Snapshot, elements: &[String], format: Format) -> Result<u8, Failure> {
    if elements.is_empty() {
        let nodes = world.nodes().map(|node| Element::Node(node.node_id()));
        let edges = world.edges().map(|edge| Element::Edge(edge.edge_id()));
        let mut all: Vec<Element> = nodes.chain(edges).collect();
        // Ids have no order that means something.
        all.sort_by_cached_key(|element| {
            let is_edge = matches!(element, Element::Edge(_));
            (
                is_edge,
                kind(world, *element).to_owned(),
                word(world, *element),
            )
        });
        let documents: Vec<_> = all
            .iter()
            .map(|element| document(world, *element))
            .collect();
        return show(format, &documents, |_| {
            let line = |element: &Element| {
                format!(
                    "{} {}\n",
                    rc_diagnostics::foreign::clean(kind(world, *element)),
                    word(world, *element)
                )
            };
            all.iter().map(line).collect()
        });
    }
    let (mut documents, mut lines) = (Vec::new(), String::new());
    for wanted in elements {
        let found = named(world, wanted)?;
        let Some(attribute) = &found.attribute else {
            documents.push(document(world, found.element));
            lines += &text(world, found.element);
            continue;
        };
        if !attributes(world, found.element).contains(attribute.as_str()) {
            return Err(unknown_attribute(world, found.element, attribute));
        }
        let value = world.get(found.element, attribute.as_str());
        documents.push(json!({
            "element": word(world, found.element),
            "attribute": attribute,
            "value": value.map(json_of),
        }));
        let value = value.map_or_else(|| "no value".to_owned(), shown);
        lines += &format!("{} = {value}\n", rc_diagnostics::foreign::clean(wanted));
    }
    show(format, &documents, |_| lines)
}

fn set(network: &str, changes: &[(String, String)], format: Format) -> Result<u8, Failure> {
    let Some(mut listener) = Listener::joined(network, None)? else {
        return Ok(0);
    };
    let world = listener.world.snapshot();
    let mut values = Vec::new();
    for (place, text) in changes {
        let found = named(&world, place)?;
        let Some(attribute) = found.attribute else {
            let message = format!(
                "`{}` is an element; name an attribute, as in `{0}.{}=…`",
                rc_diagnostics::foreign::clean(place),
                attributes(&world, found.element).first().unwrap_or(&"name")
            );
            return Err(Failure(2, message));
        };
        let value = value(&world, found.element, &attribute, text)?;
        values.push((found.element, attribute, value));
    }
    let changed = listener.world.change(|edit| {
        for (element, attribute, value) in &values {
            edit.set(*element, attribute.as_str(), value.clone())?;
        }
        Ok(())
    });
    let token = changed.map_err(|error| Failure(2, error.to_string()))?;
    let before = &world;
    // Values that were set already are no change.
    if token.sequence > 0 && listener.spread(token)?.is_none() {
        return Ok(0);
    }
    let now = listener.world.snapshot();
    let told: Vec<_> = values
        .iter()
        .map(|(element, attribute, _)| {
            let of = |world: &Snapshot| world.get(*element, attribute.as_str()).map(json_of);
            json!({
                "element": word(&now, *element), "attribute": attribute,
                "before": of(before), "after": of(&now), "token": token.to_string(),
            })
        })
        .collect();
    show(format, &told, |_| {
        let line = |(element, attribute, _): &(Element, String, _)| {
            let of = |world: &Snapshot| {
                let value = world.get(*element, attribute.as_str());
                value.map_or_else(|| "no value".to_owned(), shown)
            };
            let name = rc_diagnostics::foreign::clean(attribute);
            format!(
                "{}.{name} = {}, was {}\n",
                word(&now, *element),
                of(&now),
                of(before)
            )
        };
        values.iter().map(line).collect()
    })
}

/// The document of a listener's world, which names its schema.
fn document_of(listener: &Listener) -> Document {
    let mut document = Document::of(&listener.world.snapshot());
    document.schema = schema_of(listener);
    document
}

/// The file of the schema.
fn schema_of(listener: &Listener) -> Option<String> {
    listener.files.first().map(|(name, _)| name.clone())
}

fn save(network: &str, file: &Path, format: Format) -> Result<u8, Failure> {
    check_ending(file)?;
    let Some(listener) = Listener::joined(network, None)? else {
        return Ok(0);
    };
    write(
        file,
        &listener.world.snapshot(),
        schema_of(&listener),
        format,
    )
}

fn check_ending(file: &Path) -> Result<(), Failure> {
    if file.extension().is_none_or(|ending| ending != "graph") {
        let message = format!("expected a .graph file, found {}", file.display());
        return Err(Failure(2, message));
    }
    Ok(())
}

/// Writes a world into a file that names its schema.
fn write(
    file: &Path,
    world: &Snapshot,
    schema: Option<String>,
    format: Format,
) -> Result<u8, Failure> {
    let mut document = Document::of(world);
    document.schema = schema;
    let written = rc_files::write(file, graph_json::write(&document));
    written.map_err(|error| system(&format_args!("cannot write {}: {error}", file.display())))?;
    let (nodes, edges) = (document.nodes.len() as u64, document.edges.len() as u64);
    let told = json!({"file": file, "schema": document.schema, "nodes": nodes, "edges": edges});
    show(format, &told, |_| {
        let counts = format!("{}, {}", counted(nodes, "node"), counted(edges, "edge"));
        format!("{}: {counts}\n", file.display())
    })
}
