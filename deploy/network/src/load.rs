//! Reads a `.ddsl` with everything that it names, and checks it.

use crate::addresses::{addresses, check_outside, check_topics};
use crate::configuration::{Configured, configurations, settings};
use crate::files::check_files;
use crate::model::{Addresses, Network};
use crate::parameters::{given, overridden};
use crate::programs::Programs;
use crate::scenes::check_members;
use crate::{
    adaptors, chains, keeper, network_time, proxies, ros_names, rules, unsupported, world,
};
use rc_cdsl::model::{DEFAULT_PERIOD, Middleware};
use rc_codegen::paths::normal;
use rc_codegen::{FileLoader, Project};
use rc_ddsl::model::Deployment;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use std::collections::HashMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

/// Values that take precedence over the files of a network.
#[derive(Clone, Copy, Debug, Default)]
pub struct Overrides<'a> {
    /// All components are variants for this middleware.
    pub middleware: Option<Middleware>,
    /// Values of parameters, each as `COMPONENT.PATH=VALUE`.
    pub parameters: &'a [String],
}

/// Reads and checks a network. The result is none if the file itself cannot be parsed. Use the
/// network only if no diagnostic is an error. Executables are not checked.
pub fn load(
    path: &Path,
    overrides: &Overrides<'_>,
    sources: &mut SourceMap,
    loader: &FileLoader,
) -> io::Result<(Option<Network>, Diagnostics)> {
    let source = sources.add(path, rc_files::read(path)?);
    let (deployment, mut found) = rc_ddsl::load(sources, loader, source);
    let Some(mut deployment) = deployment else {
        return Ok((None, found));
    };
    let middleware = overrides.middleware;
    if let Some(middleware) = middleware {
        let instances = deployment.instances.iter_mut();
        instances.for_each(|instance| {
            instance.middleware = middleware;
            instance.auto = None;
        });
    }
    let mut texts = HashMap::new();
    let mut projects = projects(&deployment, sources, loader, &mut texts, &mut found);
    let peers = projects.split_off(deployment.instances.len());
    keeper::configure(&mut deployment, &projects, loader);
    check_members(&mut deployment, &projects, overrides.parameters, &mut found);
    let mut declared = projects.clone();
    name_members(&mut deployment, &mut projects, &mut found);
    let tools = (&mut *sources, loader as _);
    let mut proxies = rc_codegen::proxies::make(&mut deployment, &mut projects, tools, &mut found);
    let followers = adaptors::add(&mut deployment, &mut projects, &peers, &mut found);
    declared.resize(projects.len(), None);
    let mut configured = configurations(&deployment, &projects, sources, &mut found);
    let mut passed_settings = settings(&mut deployment, &configured);
    adaptors::follow(
        &followers,
        &mut deployment,
        &mut configured,
        &mut passed_settings,
    );
    let given = given(&deployment, overrides.parameters, sources, &mut found);
    let parameters = overridden(&deployment, &projects, &configured, given, &mut found);
    check_files(&deployment, &projects, &parameters, &mut found);
    let components: Vec<_> = projects
        .iter()
        .chain(&peers)
        .map(|p| p.as_ref().map(|p| &p.component))
        .collect();
    let (connections, more) = rc_ddsl::connect(&deployment, &components);
    found.extend(more);
    let made = &connections.connections;
    proxies::take_timeouts(&deployment, made, &mut projects, &mut proxies);
    let periods = periods(&projects, &configured);
    let deployment = Rc::new(deployment);
    let mut network = Network {
        path: path.to_path_buf(),
        programs: Programs::new(path, deployment.clone(), declared, middleware),
        deployment,
        projects,
        connections,
        proxies,
        addresses: Addresses::default(),
        time: None,
        clocks: Vec::new(),
        parameters,
        periods,
        chains: Vec::new(),
        passed_settings,
        texts,
    };
    let bindings: Vec<_> = configured.into_iter().map(|c| c.bindings).collect();
    network.addresses = addresses(&network, &bindings);
    check_topics(&network, &mut found);
    check_outside(&network, &mut found);
    network.time = network_time::check(&network, &mut found);
    network.clocks = network_time::clocks(&network);
    let needed = network.needed();
    network.programs.choose(needed);
    network.chains = chains::check(&network, &mut found);
    chains::check_freshness(&network, &mut found);
    rules::check(&network, &mut found);
    ros_names::check(&network, &mut found);
    unsupported::check(&network, &mut found);
    world::check(
        &network.deployment,
        &network.projects,
        sources,
        loader,
        &mut found,
    );
    world::check_frames(&network, &mut found);
    Ok((Some(network), found))
}

/// The period of each instance: that of its configuration, or of its component.
fn periods(projects: &[Option<Rc<Project>>], configured: &[Configured]) -> Vec<Duration> {
    let instances = projects.iter().zip(configured);
    let periods = instances.map(|(project, configured)| {
        let declared = project.as_deref().map(|project| project.component.period);
        configured.period.or(declared).unwrap_or(DEFAULT_PERIOD)
    });
    periods.collect()
}

/// Gives each instance with slot arrays a component of its own, with the members that it lists.
fn name_members(
    deployment: &mut Deployment,
    projects: &mut [Option<Rc<Project>>],
    found: &mut Diagnostics,
) {
    let network = &deployment.name.text;
    for (instance, project) in deployment.instances.iter_mut().zip(projects) {
        let Some(known) = project.as_deref() else {
            continue;
        };
        if let Some(component) = rc_ddsl::expand(network, instance, &known.component, found) {
            let mut own = known.clone();
            own.component = component;
            *project = Some(Rc::new(own));
        }
    }
}

/// The path of the component near `folder` that `wanted` most likely means: with the same file
/// name, or with a similar path.
fn nearest_file(folder: &Path, wanted: &str) -> Option<String> {
    let mut left = MAX_ENTRIES;
    let (mut known, mut beside) = (Vec::new(), Vec::new());
    components_in(folder, Path::new(""), 0, &mut left, &mut known);
    components_in(
        &folder.join(".."),
        Path::new(".."),
        0,
        &mut left,
        &mut beside,
    );
    known.sort();
    beside.sort();
    // Shorter paths come first.
    known.extend(beside);
    let name = |path: &str| Path::new(path).file_name().map(ToOwned::to_owned);
    let same = known.iter().find(|path| name(path) == name(wanted));
    let near = || rc_diagnostics::nearest(wanted, known.iter().map(String::as_str));
    same.map(String::as_str).or_else(near).map(str::to_owned)
}

/// How many entries of folders are looked at for a suggestion, and how deep.
const MAX_ENTRIES: usize = 2000;
const MAX_DEPTH: usize = 3;

/// Adds the components below a folder, each with its path below `shown`.
fn components_in(
    folder: &Path,
    shown: &Path,
    depth: usize,
    left: &mut usize,
    known: &mut Vec<String>,
) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if *left == 0 {
            return;
        }
        *left -= 1;
        let name = entry.file_name();
        let path = shown.join(&name);
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let is_left_out = ["target", "generated", "node_modules"]
            .iter()
            .any(|n| name == *n)
            || name.as_encoded_bytes().starts_with(b".");
        if is_folder && !is_left_out && depth < MAX_DEPTH {
            components_in(&entry.path(), &path, depth + 1, left, known);
        } else if path.extension().is_some_and(|e| e == "cdsl") {
            known.extend(path.to_str().map(str::to_owned));
        }
    }
}

/// The component of each instance, then that of each external slot whose peer is described. A
/// component of several instances is read and reported once.
fn projects(
    deployment: &Deployment,
    sources: &mut SourceMap,
    loader: &FileLoader,
    texts: &mut HashMap<PathBuf, Vec<usize>>,
    found: &mut Diagnostics,
) -> Vec<Option<Rc<Project>>> {
    let mut known: HashMap<PathBuf, (Option<Rc<Project>>, Vec<PathBuf>)> = HashMap::new();
    let instances = deployment.instances.iter().enumerate();
    let instances = instances.map(|(at, instance)| {
        let named = instance.cdsl.as_ref()?;
        Some((Some(at), &instance.folder, named))
    });
    let externals = deployment.externals.iter().map(|external| {
        let peer = external.peer.as_ref()?;
        Some((None, &peer.folder, &peer.cdsl))
    });
    instances
        .chain(externals)
        .map(|described| {
            let (at, folder, named) = described?;
            let path = normal(&folder.join(&named.text));
            let mut belong = |read: &[PathBuf]| {
                for (file, at) in read.iter().zip(at.into_iter().cycle()) {
                    texts.entry(file.clone()).or_default().push(at);
                }
            };
            if let Some((project, read)) = known.get(&path) {
                belong(read);
                return project.clone();
            }
            let first = sources.ids().count();
            match Project::load(&path, sources, loader) {
                Ok((project, more)) => {
                    let project = project.filter(|_| !more.has_errors()).map(Rc::new);
                    found.extend(more);
                    let read = sources.ids().skip(first);
                    let read: Vec<PathBuf> = read.map(|id| sources.path(id).into()).collect();
                    belong(&read);
                    known.insert(path, (project.clone(), read));
                    project
                }
                Err(error) => {
                    let is_relative = Path::new(&named.text).is_relative();
                    let near = is_relative.then(|| nearest_file(folder, &named.text));
                    let near = near.flatten();
                    let reason = match &near {
                        Some(_) if error.kind() == ErrorKind::NotFound => {
                            "No such file or directory".to_owned()
                        }
                        _ => error.to_string(),
                    };
                    let message = format!("`{}` cannot be read: {reason}", named.text);
                    let error = Diagnostic::error("component-not-found", named.span, message);
                    found.push(match near {
                        Some(near) => error.did_you_mean(&named.text, Some(&near)),
                        None if is_relative => error.help("the path is relative to this file"),
                        None => error,
                    });
                    None
                }
            }
        })
        .collect()
}
