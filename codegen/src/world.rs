//! The graph that components share: its schema, and a check that it has what a component reads and
//! writes.

use graph_language::Schema;
use graph_language::model::Attribute;
use rc_cdsl::Component;
use rc_cdsl::model::Write;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::{Loader, Name};
use std::path::Path;
use std::sync::Arc;

/// The schema of the world of a component or a network.
#[derive(Clone, Debug)]
pub struct World {
    /// The types.
    pub schema: Arc<Schema>,
    /// Its files, the one that is named first: names without folders, and texts.
    pub files: Vec<(String, String)>,
    /// The same files among the sources that were read.
    pub sources: Vec<SourceId>,
}

impl World {
    /// Reads the schema that the file `from` names.
    pub fn import(
        from: &Path,
        name: &Name,
        sources: &mut SourceMap,
        loader: &dyn Loader,
        found: &mut Diagnostics,
    ) -> Option<Self> {
        let first = sources.ids().count();
        let (schema, more) = graph_language::import(sources, loader, from, name);
        found.extend(more);
        let schema = Arc::new(schema?);
        let own: Vec<SourceId> = sources.ids().skip(first).collect();
        let files = own.iter().map(|id| {
            let name = sources.path(*id).file_name().unwrap_or_default();
            let name = name.to_string_lossy().into_owned();
            (name, sources.text(*id).to_owned())
        });
        let files: Vec<(String, String)> = files.collect();
        let is_taken = |at: usize| files[..at].iter().any(|(name, _)| *name == files[at].0);
        if let Some(at) = (0..files.len()).find(|at| is_taken(*at)) {
            let message = format!(
                "two files of the schema are called `{}`: components have them without their folders",
                files[at].0
            );
            let error = Diagnostic::error("name-collision", name.span, message);
            found.push(error.help("give one of them another name"));
        }
        Some(Self {
            schema,
            files,
            sources: own,
        })
    }

    /// Whether a file comes with the framework, so that every component has it.
    pub fn comes_with_framework((name, text): &(String, String)) -> bool {
        graph_language::DOMAINS.contains(&(name, text))
    }
}

/// Reads the schema of a component's world, and checks what the component says about it.
pub(crate) fn load(
    cdsl: &Path,
    component: &Component,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Option<World> {
    let declared = component.world.as_ref()?;
    let world = World::import(cdsl, declared.schema.as_ref()?, sources, loader, found)?;
    if let Some(access) = &declared.access {
        for kind in &access.reads {
            attributes(&world.schema, kind, found);
        }
        for write in &access.writes {
            check(&world.schema, write, found);
        }
    }
    Some(world)
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
