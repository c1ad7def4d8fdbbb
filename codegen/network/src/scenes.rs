//! Scenes that components read when they start (`options InnerModelViewer`), and slot arrays whose
//! members are their devices (`options InnerModelSlots`). Errors that would keep a component from
//! starting are findings here, and `slots { all; }` needs no list.

use crate::configuration::{config, configurations};
use crate::parameters::{given, overridden};
use crate::path_values::path_folders;
use innermodel_language::slots::{self, Members};
use innermodel_language::{Document, Loader, load};
use rc_codegen::Project;
use rc_configuration::model::{Kind, Type};
use rc_ddsl::model::{Array, Deployment, Instance};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceMap, Span};
use rc_syntax::Name;
use rc_vocabulary::member;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The parameter that names the scene.
const SCENE: &str = "inner_model";

/// Completes `slots { all; }` and checks listed members by the scenes of their components. `set`: values of the
/// command line. Returns the files of the scenes.
pub(crate) fn check_members(
    deployment: &mut Deployment,
    projects: &[Option<Rc<Project>>],
    set: &[String],
    found: &mut Diagnostics,
) -> Vec<PathBuf> {
    let has_scene = |project: &Option<Rc<Project>>| project.as_deref().is_some_and(reads_scene);
    for (instance, project) in deployment.instances.iter().zip(projects) {
        let (Some(all), Some(project)) = (instance.all_members, project) else {
            continue;
        };
        let component = &project.component;
        if component.scene_slots.is_none() {
            let name = &component.name;
            let message = format!("`{}` does not say which members it opens", name.text);
            let error = Diagnostic::error("unknown-member", all, message);
            let error = error.label(name.span, "its component");
            found.push(error.help("list them, as in `slots { lasers \"front\"; }`"));
        }
    }
    if !projects.iter().any(has_scene) {
        return Vec::new();
    }
    let scenes = scenes(deployment, projects, set);
    let mut read: HashMap<PathBuf, Result<Vec<Members>, String>> = HashMap::new();
    let remote = deployment.instances.iter();
    let remote = remote.map(|instance| deployment.remote_host(instance).is_some());
    let remote: Vec<bool> = remote.collect();
    let instances = deployment.instances.iter_mut().zip(projects).zip(scenes);
    for (((instance, project), scene), is_remote) in instances.zip(remote) {
        let Some(project) = project.as_deref().filter(|project| reads_scene(project)) else {
            continue;
        };
        // An error of the parameters is reported elsewhere. Another host has files of its own.
        let Some(scene) = scene else { continue };
        if is_remote && instance.all_members.is_none() {
            continue;
        }
        let members = if scene.as_os_str().is_empty() {
            Ok(Vec::new())
        } else {
            read.entry(scene.clone())
                .or_insert_with(|| document(&scene, &[]).map(|scene| slots::of(&scene)))
                .clone()
        };
        match members {
            Ok(_) if project.component.scene_slots.is_none() => {}
            Ok(members) => compare(instance, project, &scene, members, found),
            Err(reason) => {
                let message = format!("`{}` cannot start with its scene: {reason}", instance.path);
                found.push(Diagnostic::error("bad-scene", place(instance), message));
            }
        }
    }
    read.into_keys().collect()
}

/// Whether a component reads a scene when it starts.
fn reads_scene(project: &Project) -> bool {
    project.component.viewer.is_some() || project.component.scene_slots.is_some()
}

/// Whether a parameter names the scene that is checked here.
pub(crate) fn names_scene(project: &Project, parameter: &str) -> bool {
    parameter == SCENE && reads_scene(project)
}

/// Where the network names the scene, else the name of the component.
fn place(instance: &Instance) -> Span {
    let mut parameters = instance.parameters.iter();
    let named = parameters.find(|parameter| parameter.path.text == SCENE);
    named.map_or(instance.name.span, |parameter| parameter.path.span)
}

/// The path of each scene. `None` where parameters have errors, which are reported later.
fn scenes(
    deployment: &Deployment,
    projects: &[Option<Rc<Project>>],
    set: &[String],
) -> Vec<Option<PathBuf>> {
    // Members of arrays, which configurations may name, are not known yet.
    let (mut sources, mut found) = (SourceMap::new(), Diagnostics::new());
    let configured = configurations(deployment, projects, &mut sources, &mut found);
    let given = given(deployment, set, &mut sources, &mut found);
    let parameters = overridden(deployment, projects, &configured, given, &mut found);
    let instances = deployment.instances.iter().zip(projects).zip(parameters);
    instances
        .map(|((instance, project), parameters)| {
            let project = project.as_ref()?;
            if !reads_scene(project) {
                return None;
            }
            let mut declared = project.parameters.as_ref()?.parameters.iter();
            let declared = declared.find(|of| {
                let is_path = matches!(
                    &of.kind,
                    Kind::Scalar {
                        ty: Type::Path,
                        array: None
                    }
                );
                of.name == SCENE && is_path
            })?;
            let values = parameters.values?;
            let scene = values.path(SCENE);
            if scene.as_os_str().is_empty() {
                return Some(scene);
            }
            if parameters.set.iter().any(|(name, _)| name == SCENE) {
                return Some(instance.folder.join(scene));
            }
            let config = config(instance, Some(project));
            let folders = path_folders(config.as_deref(), project);
            let folder = folders.of(declared, values.value(SCENE)?);
            Some(folder.join(scene))
        })
        .collect()
}

/// Files of the disk.
struct Disk<'s> {
    search: &'s [PathBuf],
}

impl Loader for Disk<'_> {
    fn read(&self, path: &Path) -> io::Result<String> {
        rc_files::read(path)
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn search(&self) -> &[PathBuf] {
        self.search
    }
}

/// Reads an InnerModel file. It looks for included files also in the folders `search`.
pub(crate) fn document(scene: &Path, search: &[PathBuf]) -> Result<Document, String> {
    let text = rc_files::read(scene).map_err(|error| format!("{}: {error}", scene.display()))?;
    let mut sources = SourceMap::new();
    let source = sources.add(scene, text);
    let (document, found) = load(&mut sources, &Disk { search }, source);
    let mut errors = found.iter();
    let error = errors.find(|finding| finding.severity == Severity::Error);
    match error {
        None => Ok(document),
        Some(error) => {
            let path = scene.display();
            Err(format!(
                "{path}: {} (`rcgen check {path}` says where)",
                error.message
            ))
        }
    }
}

/// Takes the members of a scene for `all`, or compares them with those that the network lists.
fn compare(
    instance: &mut Instance,
    project: &Project,
    scene: &Path,
    mut members: Vec<Members>,
    found: &mut Diagnostics,
) {
    let slots = &project.component.slots;
    members.retain(|of| {
        slots
            .iter()
            .any(|slot| slot.is_array && slot.name == of.array)
    });
    let place = instance.all_members.unwrap_or_else(|| place(instance));
    for Members { array, members, .. } in &members {
        if let Some((bad, reason)) = members
            .iter()
            .find_map(|name| Some((name, member::check(name).err()?)))
        {
            let message = format!("the id `{bad}` of the scene cannot be a member of `{array}`");
            found.push(Diagnostic::error("bad-member", place, message).help(reason));
            return;
        }
    }
    if let Some(all) = instance.all_members {
        let arrays = members.into_iter().map(|of| Array {
            name: Name::new(of.array, all),
            members: of
                .members
                .iter()
                .map(|name| Name::new(name.as_str(), all))
                .collect(),
        });
        instance.arrays = arrays.collect();
        return;
    }
    let empty = Vec::new();
    for slot in slots.iter().filter(|slot| slot.is_array) {
        let of_scene = members.iter().find(|of| of.array == slot.name);
        let of_scene = of_scene.map_or(&empty, |of| &of.members);
        let listed = instance
            .arrays
            .iter()
            .find(|array| array.name.text == slot.name);
        let names = listed.map_or(&[][..], |array| &array.members);
        let unknown = names.iter().find(|name| !of_scene.contains(&name.text));
        let missing = of_scene
            .iter()
            .find(|of_scene| names.iter().all(|name| name.text != **of_scene));
        let scene = scene.display();
        let (span, message) = match (unknown, missing) {
            (Some(unknown), _) => {
                let name = &unknown.text;
                let message = format!(
                    "the scene {scene} has no member `{name}` of `{}`",
                    slot.name
                );
                (unknown.span, message)
            }
            (None, Some(missing)) => {
                let span = listed.map_or(place, |array| array.name.span);
                let message = format!(
                    "the scene {scene} has the member `{missing}` of `{}`, which the network does not list",
                    slot.name
                );
                (span, message)
            }
            (None, None) => continue,
        };
        let error = Diagnostic::error("unknown-member", span, message);
        let error = error.label(instance.name.span, "the component");
        let quoted: Vec<String> = of_scene.iter().map(|name| format!("\"{name}\"")).collect();
        found.push(error.help(if quoted.is_empty() {
            format!("remove `{}`, or write `slots {{ all; }}`", slot.name)
        } else {
            let list = quoted.join(", ");
            format!(
                "write `slots {{ {} {list}; }}`, or `slots {{ all; }}` for all",
                slot.name
            )
        }));
    }
}

#[cfg(test)]
mod tests;
