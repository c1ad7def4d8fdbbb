//! The world of a network: checks the schemas of its components, who writes what, and the contents
//! of its start file.

mod part;

pub(crate) use part::handed;

use crate::model::Network;
use crate::parameters::OverriddenParameters;
use crate::{keeper, link_load};
use graph_exchange::{Document, dsr, graph_json};
use graph_language::Schema;
use rc_cdsl::model::{Access, World as Clause, Write};
use rc_codegen::Project;
use rc_codegen::world::World as Known;
use rc_ddsl::Endpoint;
use rc_ddsl::model::{Deployment, Instance, InstanceOrGroup, SlotPath, World};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, nearest};
use rc_syntax::{Loader, Name};
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

/// A component that shares the world.
pub(crate) struct Member<'a> {
    pub(crate) instance: &'a Instance,
    pub(crate) clause: &'a Clause,
    /// Its schema; `None` for any.
    own: Option<&'a Known>,
    /// The default period of its `compute()`.
    pub(crate) period: Duration,
}

impl Member<'_> {
    fn is_other(&self, other: &Member<'_>) -> bool {
        self.instance.path != other.instance.path
    }

    /// Its declared access; `None` for any.
    fn access(&self) -> Option<&Access> {
        self.clause.access.as_ref()
    }
}

/// Checks the world of a network with the components that share it. Returns its schema.
pub(crate) fn check(
    deployment: &Deployment,
    projects: &[Option<Rc<Project>>],
    parameters: &[OverriddenParameters],
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Option<Known> {
    let members: Vec<Member<'_>> = deployment
        .instances
        .iter()
        .zip(projects)
        .zip(parameters)
        .filter_map(|((instance, project), parameters)| {
            let project = project.as_deref()?;
            let clause = project.component.world.as_ref()?;
            let own = project.world.as_ref();
            // A schema with errors has been reported.
            let is_known = own.is_some() || clause.schema.is_none();
            let values = parameters.values.as_ref();
            (is_known && keeper::takes_part(clause, values)).then_some(Member {
                instance,
                clause,
                own,
                period: project.component.period,
            })
        })
        .collect();
    let Some(world) = &deployment.world else {
        without(&members, found);
        return None;
    };
    let all_are_known = projects.iter().all(Option::is_some);
    // A keeper alone, which writes and reads nothing, has no world to keep.
    let is_user =
        |member: &Member<'_>| member.own.is_some() || member.access() != Some(&Access::default());
    if !members.iter().any(is_user) && all_are_known {
        let message = format!("no component shares the world `{}`", world.name.text);
        let warning = Diagnostic::warning("unused-world", world.name.span, message);
        found.push(warning.help("write a clause `world` in a `.cdsl`"));
    }
    let name = world.schema.as_ref()?;
    let from = world.folder.join("network.ddsl");
    let known = Known::import(&from, name, sources, loader, found)?;
    let schema = &*known.schema;
    let fits = members.iter().filter(|member| {
        let access = member.clause.access.as_ref();
        let misfit = member
            .own
            .and_then(|own| part::misfit(&known, access, own, sources));
        let fits = misfit.is_none();
        found.extend(misfit.map(|misfit| {
            let span = member.clause.span;
            let error = misfit.diagnostic(&member.instance.path, span, name.span);
            error.label(member.instance.name.span, "the component in the network")
        }));
        fits
    });
    let all_fit = fits.count() == members.len();
    let start = start(world, schema, sources, found);
    if check_keep(world, found) {
        let mut all = deployment.instances.iter().zip(projects);
        let is_read_here = all.any(|(instance, project)| {
            let is_keeper = |project: &Rc<Project>| project.component.name.text == keeper::KEEPER;
            project.as_ref().is_some_and(is_keeper) && deployment.remote_host(instance).is_none()
        });
        if is_read_here {
            check_kept(world, schema, sources, found);
        }
    }
    if all_fit && all_are_known {
        writers(schema, &members, found);
        readers(schema, &members, start.as_ref(), found);
        link_load::check(deployment, &members, schema, start.as_ref(), found);
    }
    Some(known)
}

/// Reports connections that look for frames in a world whose nodes have none.
pub(crate) fn check_frames(network: &Network, found: &mut Diagnostics) {
    let connections = network.connections.connections.iter();
    let consumers: BTreeSet<Endpoint> = connections.map(|made| made.consumer).collect();
    for end in consumers {
        let conversion = network.connections.conversion(end);
        let tree = conversion.and_then(|conversion| conversion.tree.as_deref());
        let project = network.projects[end.instance].as_deref();
        let clause = project.and_then(|project| project.component.world.as_ref());
        let (Some(tree), Some(clause)) = (tree, clause) else {
            continue;
        };
        let own = project.and_then(|project| project.world.as_ref());
        let schema = network.world.as_ref().or(own).map(|world| &world.schema);
        let Some(declared) = &clause.schema else {
            continue;
        };
        if tree != clause.name.text || schema.is_none_or(|schema| schema.has_transforms()) {
            continue;
        }
        let own = network.slot(end).map(|slot| slot.name.as_str());
        let binds = network.deployment.binds.iter().filter(|bind| {
            let SlotPath { place, slot, .. } = &bind.consumer;
            // A group exports a slot by its name.
            let is_instance =
                !matches!(place, InstanceOrGroup::Instance(at) if *at != end.instance);
            is_instance && own == slot.text.split('.').next()
        });
        let mut named = binds.flat_map(|bind| &bind.frames);
        let named = named.find(|name| name.text == tree);
        let instance = &network.deployment.instances[end.instance];
        let span = named.map_or(instance.name.span, |name| name.span);
        let message = format!("the nodes of the world `{tree}` have no frames");
        let error = Diagnostic::error("wrong-frames", span, message)
            .label(declared.span, "its schema")
            .help("import `geometry.gdsl` there: edges of its relation `RT` say where a node is in another one");
        found.push(error);
    }
}

/// Reports components with a world in a network that has none.
fn without(members: &[Member<'_>], found: &mut Diagnostics) {
    for member in members {
        // What can share any world works without one, too.
        let Some(schema) = &member.clause.schema else {
            continue;
        };
        let message = format!(
            "`{}` shares a world, and the network declares none",
            member.instance.path
        );
        let error = Diagnostic::error("no-world", member.instance.name.span, message);
        let schema = &schema.text;
        found.push(error.help(format!("add `World g {{ schema \"{schema}\"; }};`")));
    }
}

/// Reads the file with the initial contents of the world, and compares it with the schema.
fn start(
    world: &World,
    schema: &Schema,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Option<Document> {
    let name = world.start.as_ref()?;
    let path = rc_codegen::paths::normal(&world.folder.join(&name.text));
    let text = match rc_files::read(&path) {
        Ok(text) => text,
        Err(error) => {
            let message = format!("`{}` cannot be read: {error}", name.text);
            let error = Diagnostic::error("world-file", name.span, message);
            let near = nearest_in_folder(&path);
            found.push(match near {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error.help("the path is relative to this file"),
            });
            return None;
        }
    };
    document(&path, text, schema, sources, found)
}

/// Reads the text of a graph, and compares it with the schema.
fn document(
    path: &Path,
    text: String,
    schema: &Schema,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Option<Document> {
    let (source, mark) = graph_exchange::add(sources, path, text);
    if let Some(mark) = mark {
        found.push(mark);
        return None;
    }
    let (document, more) = if dsr::is_dsr(sources.text(source)) {
        dsr::read(sources, source)
    } else {
        graph_json::read(sources, source)
    };
    found.extend(more);
    let document = document?;
    found.extend(graph_exchange::check(&document, schema, sources, source));
    Some(document)
}

/// Reports a world that is kept already and that its keeper cannot read: it would not start.
fn check_kept(world: &World, schema: &Schema, sources: &mut SourceMap, found: &mut Diagnostics) {
    let Some((name, _)) = &world.keep else {
        return;
    };
    let path = rc_codegen::paths::normal(&world.folder.join(&name.text));
    let start = world
        .start
        .as_ref()
        .map(|start| world.folder.join(&start.text));
    // A world may be kept in its start file, which is read already.
    if start.is_some_and(|start| rc_codegen::paths::normal(&start) == path) {
        return;
    }
    let mut inside = Diagnostics::new();
    let reason = match rc_files::read(&path) {
        Ok(text) => {
            document(&path, text, schema, sources, &mut inside);
            inside.has_errors().then(|| "it has errors".to_owned())
        }
        // Nothing is kept yet, or no longer.
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => Some(error.to_string()),
    };
    found.extend(inside);
    if let Some(reason) = reason {
        let message = format!(
            "the world that `{}` keeps cannot be read: {reason}",
            name.text
        );
        let error = Diagnostic::error("world-file", name.span, message);
        found.push(error.help("fix the file, or move it away: then the world begins again"));
    }
}

/// The file next to `path` with a similar name.
fn nearest_in_folder(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_str()?;
    let entries = std::fs::read_dir(path.parent()?).ok()?.flatten();
    let is_graph = |path: &PathBuf| {
        let ending = path.extension();
        ending.is_some_and(|ending| ending == "graph" || ending == "json")
    };
    let paths = entries.map(|entry| entry.path()).filter(is_graph);
    let names = paths.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()));
    let names: Vec<String> = names.take(1_000).collect();
    nearest(wanted, names.iter().map(String::as_str)).map(str::to_owned)
}

/// Reports a file to keep the world in that cannot be written. Returns whether there is one that can.
fn check_keep(world: &World, found: &mut Diagnostics) -> bool {
    let Some((name, _)) = &world.keep else {
        return false;
    };
    let path: PathBuf = world.folder.join(&name.text);
    let folder = path.parent().filter(|own| !own.as_os_str().is_empty());
    let is_there = folder.is_none_or(Path::is_dir);
    let reason = if path.is_dir() {
        "it is a folder"
    } else if !is_there {
        "its folder does not exist"
    } else if path.extension().is_none_or(|ending| ending != "graph") {
        "a world is kept in a `.graph` file"
    } else {
        return true;
    };
    let message = format!("`{}` cannot keep the world: {reason}", name.text);
    found.push(Diagnostic::error("world-file", name.span, message));
    false
}

/// Reports attributes that two components write, unless both share them.
fn writers(schema: &Schema, members: &[Member<'_>], found: &mut Diagnostics) {
    let writes = |member: &'_ Member<'_>| -> Vec<Write> {
        let access = member.access();
        access.map_or_else(Vec::new, |access| access.writes.clone())
    };
    let all: Vec<(&Member<'_>, Write)> = members
        .iter()
        .flat_map(|member| writes(member).into_iter().map(move |write| (member, write)))
        .collect();
    for (at, (member, write)) in all.iter().enumerate() {
        let other = all[..at].iter().find(|(other, earlier)| {
            let both_share = write.shared && earlier.shared;
            other.is_other(member) && !both_share && is_same(schema, write, earlier)
        });
        let mut others = members.iter().filter(|other| other.is_other(member));
        let everything = others.find(|other| other.access().is_none() && !write.shared);
        let (path, other) = match (other, everything) {
            (Some((other, earlier)), _) => (earlier.path(), *other),
            (None, Some(other)) => ("everything".to_owned(), other),
            (None, None) => continue,
        };
        let message = format!(
            "`{}` writes `{}`, and `{}` writes {}",
            member.instance.path,
            write.path(),
            other.instance.path,
            if path == "everything" {
                path
            } else {
                format!("`{path}`")
            },
        );
        let error = Diagnostic::error("world-writers", write.span(), message);
        let error = error.label(member.instance.name.span, "the component in the network");
        let error = error.label(other.instance.name.span, "the other one");
        found.push(error.help(format!(
            "if both are right, write `{} shared` in both",
            write.path()
        )));
    }
}

/// Whether two writers set one attribute.
fn is_same(schema: &Schema, one: &Write, other: &Write) -> bool {
    let types = overlap(schema, &one.kind.text, &other.kind.text);
    let attributes = match (&one.attribute, &other.attribute) {
        (Some(one), Some(other)) => one.text == other.text,
        _ => true,
    };
    types && attributes
}

/// Whether a node or an edge may have both types.
fn overlap(schema: &Schema, one: &str, other: &str) -> bool {
    schema.is_a(one, other) || schema.is_a(other, one)
}

/// Warns of types that a component reads, that no component writes and that are not there at first.
fn readers(
    schema: &Schema,
    members: &[Member<'_>],
    start: Option<&Document>,
    found: &mut Diagnostics,
) {
    if members.iter().any(|member| member.access().is_none()) {
        return;
    }
    let is_written = |kind: &str| {
        let accesses = members.iter().filter_map(Member::access);
        let mut written = accesses.flat_map(|access| &access.writes);
        written.any(|write| write.attribute.is_none() && overlap(schema, kind, &write.kind.text))
    };
    let is_there = |kind: &str| {
        start.is_some_and(|start| {
            let nodes = start.nodes.iter().map(|node| &*node.kind);
            let edges = start.edges.iter().map(|edge| &*edge.kind);
            nodes.chain(edges).any(|own| schema.is_a(own, kind))
        })
    };
    let mut reported: Vec<&Name> = Vec::new();
    for member in members {
        for kind in member.access().into_iter().flat_map(|access| &access.reads) {
            // Two instances of a component read in one line.
            if is_written(&kind.text) || is_there(&kind.text) || reported.contains(&kind) {
                continue;
            }
            reported.push(kind);
            let message = format!(
                "`{}` reads `{}`, which no component writes",
                member.instance.path, kind.text
            );
            let warning = Diagnostic::warning("world-unwritten", kind.span, message);
            let warning = warning.label(member.instance.name.span, "the component in the network");
            found.push(warning.help(
                "add a component that writes it, or a file that has one: `start \"FILE.graph\";`",
            ));
        }
    }
}
