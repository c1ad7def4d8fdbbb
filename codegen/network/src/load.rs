//! Reads a `.ddsl` with everything that it names, and checks it.

use crate::addresses::{addresses, check_outside, check_topics};
use crate::configuration::{Configured, configurations, settings};
use crate::files::check_files;
use crate::model::{Addresses, Network};
use crate::parameters::{given, overridden};
use crate::programs::Programs;
use crate::reading::Reading;
use crate::scenes::check_members;
use crate::{
    adaptors, chains, keeper, network_time, proxies, ros_names, rules, unsupported, world,
};
use rc_cdsl::model::{DEFAULT_PERIOD, Middleware};
use rc_codegen::{FileLoader, Project};
use rc_ddsl::model::Deployment;
use rc_diagnostics::{Diagnostics, SourceMap};
use std::collections::HashMap;
use std::io;
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
    /// The longest time of a message over each middleware that was measured on this machine.
    pub transports: &'a [(Middleware, Duration)],
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
    let Some(deployment) = deployment else {
        return Ok((None, found));
    };
    let mut reading = Reading::new(path, deployment);
    while reading.read_next(sources, loader) {}
    let (network, more) = reading.check(overrides, sources, loader);
    found.extend(more);
    Ok((Some(network), found))
}

/// The components of a network, as far as they could be read.
pub(crate) struct Components {
    /// Those of the instances.
    pub(crate) projects: Vec<Option<Rc<Project>>>,
    /// Those of the external slots whose peer is described.
    pub(crate) peers: Vec<Option<Rc<Project>>>,
    /// For each source file, the instances of the components that it belongs to.
    pub(crate) texts: HashMap<PathBuf, Vec<usize>>,
}

/// Checks a network whose components were read.
pub(crate) fn check(
    path: &Path,
    mut deployment: Deployment,
    components: Components,
    overrides: &Overrides<'_>,
    (sources, loader): (&mut SourceMap, &FileLoader),
    found: &mut Diagnostics,
) -> Network {
    let Components {
        mut projects,
        peers,
        texts,
    } = components;
    let middleware = overrides.middleware;
    if let Some(middleware) = middleware {
        let instances = deployment.instances.iter_mut();
        instances.for_each(|instance| {
            instance.middleware = middleware;
            instance.auto = None;
        });
    }
    keeper::configure(&mut deployment, &projects, loader);
    let mut files = check_members(&mut deployment, &projects, overrides.parameters, found);
    let mut declared = projects.clone();
    name_members(&mut deployment, &mut projects, found);
    let tools = (&mut *sources, loader as _);
    let mut proxies = rc_codegen::proxies::make(&mut deployment, &mut projects, tools, found);
    let followers = adaptors::add(&mut deployment, &mut projects, &peers, found);
    declared.resize(projects.len(), None);
    let mut configured = configurations(&deployment, &projects, sources, found);
    let mut passed_settings = settings(&mut deployment, &configured);
    adaptors::follow(
        &followers,
        &mut deployment,
        &mut configured,
        &mut passed_settings,
    );
    let given = given(&deployment, overrides.parameters, sources, found);
    let parameters = overridden(&deployment, &projects, &configured, given, found);
    files.extend(check_files(&deployment, &projects, &parameters, found));
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
        transports: overrides.transports.to_vec(),
        passed_settings,
        texts,
        files,
        world: None,
    };
    let bindings: Vec<_> = configured.into_iter().map(|c| c.bindings).collect();
    network.addresses = addresses(&network, &bindings);
    check_topics(&network, found);
    check_outside(&network, found);
    network.time = network_time::check(&network, found);
    network.clocks = network_time::clocks(&network);
    let needed = network.needed();
    network.programs.choose(needed);
    network.chains = chains::check(&network, found);
    chains::check_freshness(&network, found);
    rules::check(&network, found);
    ros_names::check(&network, found);
    unsupported::check(&network, found);
    network.world = world::check(
        &network.deployment,
        &network.projects,
        &network.parameters,
        sources,
        loader,
        found,
    );
    world::check_frames(&network, found);
    network
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
