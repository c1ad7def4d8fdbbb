//! Files that parameters name (`reads` of PDSL), and elements of such files (`element`). Errors
//! that would keep a component from starting are findings here.

use crate::configuration::config;
use crate::parameters::OverriddenParameters;
use crate::path_values::{PathValue, path_folders, path_values};
use crate::scenes::{document, names_scene};
use innermodel_language::{Document, Kind};
use planar_map::Map;
use rc_codegen::Project;
use rc_configuration::Values;
use rc_configuration::model::{Element, ElementKind, FileKind, Kind as Declared, Parameter};
use rc_ddsl::model::{Deployment, Instance};
use rc_diagnostics::{Diagnostic, Diagnostics, Span, nearest};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A file as far as its kind can be checked. The tree is that of an InnerModel file.
type Read = Result<Option<Rc<Document>>, String>;

/// Files that were read; several instances may name one.
type Known = HashMap<(PathBuf, FileKind, Vec<PathBuf>), Read>;

/// Reads the files that components read when they start, on the host of the network. Returns these
/// files.
pub(crate) fn check_files(
    deployment: &Deployment,
    projects: &[Option<Rc<Project>>],
    parameters: &[OverriddenParameters],
    found: &mut Diagnostics,
) -> Vec<PathBuf> {
    let mut known = Known::new();
    let instances = deployment.instances.iter().zip(projects).zip(parameters);
    for ((instance, project), parameters) in instances {
        // Another host has files of its own.
        if deployment.remote_host(instance).is_some() {
            continue;
        }
        if let (Some(project), Some(values)) = (project, &parameters.values) {
            check(instance, project, parameters, values, &mut known, found);
        }
    }
    known.into_keys().map(|(path, ..)| path).collect()
}

/// Checks the files of one instance.
fn check(
    instance: &Instance,
    project: &Project,
    parameters: &OverriddenParameters,
    values: &Values,
    known: &mut Known,
    found: &mut Diagnostics,
) {
    let Some(model) = &project.parameters else {
        return;
    };
    let config = config(instance, Some(project));
    let folders = path_folders(config.as_deref(), project);
    let mut paths = Vec::new();
    path_values(&model.parameters, values, &folders, "", &mut paths);
    let paths = paths.into_iter().filter_map(|value| {
        let kind = value.parameter.reads?;
        let folder = if parameters.is_set(&value.name) {
            &instance.folder
        } else {
            value.folder
        };
        // As the component opens it: after a link, `..` is the folder of the link's target.
        let path = folder.join(&value.path);
        (!value.path.as_os_str().is_empty()).then_some((kind, path, value))
    });
    let (search, files): (Vec<_>, Vec<_>) = paths.partition(|(kind, ..)| *kind == FileKind::Search);
    let search: Vec<PathBuf> = search.into_iter().map(|(_, path, _)| path).collect();
    let mut trees = HashMap::new();
    for (kind, path, PathValue { name, .. }) in files {
        let read = known
            .entry((path, kind, search.clone()))
            .or_insert_with_key(|(path, kind, search)| read(path, *kind, search));
        match read {
            Ok(None) => {}
            Ok(Some(tree)) => _ = trees.insert(name, tree.clone()),
            // The scene has a finding of its own.
            Err(_) if names_scene(project, &name) => {}
            Err(reason) => {
                let message = format!("`{}` cannot read its `{name}`: {reason}", instance.path);
                let place = place(instance, &name);
                found.push(Diagnostic::error("bad-file", place, message));
            }
        }
    }
    elements(
        &model.parameters,
        values,
        "",
        &mut |name, value, element| {
            let Some(tree) = trees.get(&element.of) else {
                return;
            };
            if let Some(reason) = missing(tree, element, value) {
                let message = format!("the `{name}` of `{}`: {reason}", instance.path);
                let error = Diagnostic::error("unknown-element", place(instance, name), message);
                let ids = tree.nodes.iter().filter(|node| fits(element, &node.kind));
                let ids = ids.map(|node| node.id.as_str());
                // The value is in another file than the finding.
                found.push(match nearest(value, ids) {
                    Some(near) => error.help(format!("did you mean `{near}`?")),
                    None => error,
                });
            }
        },
    );
}

/// Where the network sets a parameter or a part of it, else the name of the component.
fn place(instance: &Instance, name: &str) -> Span {
    let mut set = instance.parameters.iter();
    let set = set.find(|set| {
        let element = set.path.text.strip_prefix(name);
        element.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
    });
    set.map_or(instance.name.span, |set| set.path.span)
}

/// Reads a file as its component does.
fn read(path: &Path, kind: FileKind, search: &[PathBuf]) -> Read {
    match kind {
        FileKind::File => match rc_files::open_regular(path) {
            Ok(_) => Ok(None),
            Err(error) => Err(format!("{}: {error}", path.display())),
        },
        FileKind::Innermodel => document(path, search).map(|tree| Some(Rc::new(tree))),
        FileKind::PlanarMap => match Map::load(path) {
            Ok(_) => Ok(None),
            Err(error) => Err(error.to_string()),
        },
        FileKind::Search => Ok(None),
    }
}

/// Hands out all values that name elements, with the paths of their parameters.
fn elements(
    parameters: &[Parameter],
    values: &Values,
    within: &str,
    take: &mut impl FnMut(&str, &str, &Element),
) {
    for parameter in parameters {
        let name = &parameter.name;
        let path = format!("{within}{name}");
        match &parameter.kind {
            Declared::Scalar { array, .. } => {
                let Some(element) = &parameter.element else {
                    continue;
                };
                if array.is_none() {
                    take(&path, &values.text(name), element);
                }
                let all = array.iter().flat_map(|_| values.texts(name));
                for (at, value) in all.enumerate() {
                    take(&format!("{path}[{at}]"), &value, element);
                }
            }
            Declared::Group(parameters) => {
                elements(parameters, values.group(name), &format!("{path}."), take);
            }
            Declared::List { parameters, .. } => {
                for (at, value) in values.list(name).iter().enumerate() {
                    elements(parameters, value, &format!("{path}[{at}]."), take);
                }
            }
        }
    }
}

/// Why a tree has no such element. An empty value names none.
fn missing(tree: &Document, element: &Element, value: &str) -> Option<String> {
    if value.is_empty() {
        return None;
    }
    let Some(at) = tree.find(value) else {
        return Some(format!("its `{}` has no node `{value}`", element.of));
    };
    let wanted = element.kind.word();
    let fits = fits(element, &tree.nodes[at].kind);
    (!fits).then(|| format!("`{value}` of its `{}` is not a {wanted}", element.of))
}

fn fits(element: &Element, kind: &Kind) -> bool {
    match element.kind {
        ElementKind::Node => true,
        ElementKind::Joint => matches!(kind, Kind::Joint(_) | Kind::Prismatic(_)),
    }
}

#[cfg(test)]
mod tests;
