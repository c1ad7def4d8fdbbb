//! The graph that a component shares with others: its schema, and a check that it has what the
//! component reads and writes.

use graph_language::Schema;
use graph_language::model::Attribute;
use rc_cdsl::Component;
use rc_cdsl::model::Write;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use rc_syntax::{Loader, Name};
use std::path::Path;
use std::sync::Arc;

/// The schema of a component's world.
#[derive(Clone, Debug)]
pub struct World {
    /// The types.
    pub schema: Arc<Schema>,
    /// Its files, the one that the component names first: names without folders, and texts.
    pub files: Vec<(String, String)>,
}

/// Reads the schema of a component's world, and checks what the component says about it.
pub(crate) fn load(
    cdsl: &Path,
    component: &Component,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Option<World> {
    let world = component.world.as_ref()?;
    let first = sources.ids().count();
    let (schema, more) = graph_language::import(sources, loader, cdsl, &world.schema);
    found.extend(more);
    let schema = schema?;
    if let Some(access) = &world.access {
        for kind in &access.reads {
            attributes(&schema, kind, found);
        }
        for write in &access.writes {
            check(&schema, write, found);
        }
    }
    let files = sources.ids().skip(first).map(|id| {
        let name = sources.path(id).file_name().unwrap_or_default();
        let name = name.to_string_lossy().into_owned();
        (name, sources.text(id).to_owned())
    });
    let files: Vec<(String, String)> = files.collect();
    let is_taken = |at: usize| files[..at].iter().any(|(name, _)| *name == files[at].0);
    if let Some(at) = (0..files.len()).find(|at| is_taken(*at)) {
        let message = format!(
            "two files of the schema are called `{}`: the component has them without their folders",
            files[at].0
        );
        let error = Diagnostic::error("name-collision", world.schema.span, message);
        found.push(error.help("give one of them another name"));
    }
    Some(World {
        files,
        schema: Arc::new(schema),
    })
}

/// The attributes of a type, or a finding that there is no such type.
fn attributes<'a>(
    schema: &'a Schema,
    kind: &Name,
    found: &mut Diagnostics,
) -> Option<&'a [Attribute]> {
    let attributes = schema.attributes(&kind.text);
    if attributes.is_none() {
        let message = format!("the domain `{}` has no type `{}`", schema.name, kind.text);
        let error = Diagnostic::error("unknown-world-type", kind.span, message);
        found.push(error.suggest(&kind.text, schema.types()));
    }
    attributes
}

/// Checks the attribute that a component writes.
fn check(schema: &Schema, write: &Write, found: &mut Diagnostics) {
    let Some(attributes) = attributes(schema, &write.kind, found) else {
        return;
    };
    let Some(name) = &write.attribute else {
        return;
    };
    let Some(attribute) = attributes.iter().find(|own| own.name == name.text) else {
        let message = format!("`{}` has no attribute `{}`", write.kind.text, name.text);
        let error = Diagnostic::error("unknown-world-type", name.span, message);
        let known = attributes.iter().map(|own| own.name.as_str());
        found.push(error.suggest(&name.text, known));
        return;
    };
    if write.stream.is_some() && attribute.key {
        let message = format!(
            "`{}` is a key, and a stream may lose its values",
            write.path()
        );
        let error = Diagnostic::error("bad-world-access", name.span, message);
        found.push(error.help("write it without `stream`"));
    }
}
