//! A `.ddsl` with everything that it names: loaded, checked, and made into a plan.

use crate::network::addresses::process_name;
use crate::network::configuration::{config, configurations, named_files, settings};
use crate::network::plan::{self, Component, Plan, Policy, Restart};
use crate::network::programs::variants;
use rc_cdsl::model::Backend;
use rc_codegen::{FileLoader, Project};
use rc_ddsl::model::{Deployment, Setting};
use rc_ddsl::{Endpoint, Network as Connections};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap};
use std::collections::{BTreeSet, HashMap};
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A network, as far as it could be read.
#[derive(Debug)]
pub struct Network {
    /// The `.ddsl`.
    pub path: PathBuf,
    /// What it says.
    pub deployment: Deployment,
    /// One entry for each instance, none where its files could not be read. Instances of one component share it.
    pub projects: Vec<Option<Rc<Project>>>,
    /// Who talks to whom.
    pub connections: Connections,
    /// The middleware that all components were loaded for, whatever the files say.
    pub(crate) middleware: Option<Backend>,
    /// The middleware that each instance is a variant for; none where its program is made of the code in its folder, or
    /// is named.
    pub(crate) variants: Vec<Option<Backend>>,
    /// What each instance has to be told of middlewares: what its configuration does not say itself.
    handed: Vec<Vec<Setting>>,
    /// For each file that components are made of, these components.
    pub(crate) texts: HashMap<PathBuf, Vec<usize>>,
}

/// What `cargo build` makes of a workspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// With optimisation, in `target/release`.
    Release,
    /// Quickly built, in `target/debug`.
    Dev,
}

impl Profile {
    /// The folder under `target/`.
    pub fn folder(self) -> &'static str {
        match self {
            Self::Release => "release",
            Self::Dev => "debug",
        }
    }

    /// The word of cargo's `--profile`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Release => "release",
            Self::Dev => "dev",
        }
    }
}

impl std::str::FromStr for Profile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "release" => Ok(Self::Release),
            "dev" => Ok(Self::Dev),
            other => Err(format!(
                "`{other}` is not a profile; there are release and dev"
            )),
        }
    }
}

/// Reads a network. There is none only where its own file could not be read as one; it may be used only where
/// no diagnostic is an error. Executables are not looked at. With a `middleware`, all components are variants of
/// themselves for it, whatever the files say.
pub fn load(
    path: &Path,
    middleware: Option<Backend>,
    sources: &mut SourceMap,
    loader: &FileLoader,
) -> io::Result<(Option<Network>, Diagnostics)> {
    let source = sources.add(path, rc_codegen::load::read(path)?);
    let (deployment, mut found) = rc_ddsl::load(sources, loader, source);
    let Some(mut deployment) = deployment else {
        return Ok((None, found));
    };
    if let Some(middleware) = middleware {
        let instances = deployment.instances.iter_mut();
        instances.for_each(|instance| instance.middleware = middleware);
    }
    let mut texts = HashMap::new();
    let projects = projects(&deployment, sources, loader, &mut texts, &mut found);
    let configured = configurations(&deployment, &projects, sources, &mut found);
    let handed = settings(&mut deployment, configured);
    let components: Vec<_> = projects
        .iter()
        .map(|p| p.as_ref().map(|p| &p.component))
        .collect();
    let (connections, more) = rc_ddsl::connect(&deployment, &components);
    found.extend(more);
    let variants = variants(&deployment, &projects, middleware);
    let network = Network {
        path: path.to_path_buf(),
        deployment,
        projects,
        connections,
        middleware,
        variants,
        handed,
        texts,
    };
    network.check_topics(&mut found);
    network.check_ros_names(&mut found);
    network.warn_of_what_has_no_effect(&mut found);
    Ok((Some(network), found))
}

/// The component of each instance; one that several instances share is read, and complained of, once.
fn projects(
    deployment: &Deployment,
    sources: &mut SourceMap,
    loader: &FileLoader,
    texts: &mut HashMap<PathBuf, Vec<usize>>,
    found: &mut Diagnostics,
) -> Vec<Option<Rc<Project>>> {
    let mut known: HashMap<PathBuf, (Option<Rc<Project>>, Vec<PathBuf>)> = HashMap::new();
    let instances = deployment.instances.iter().enumerate();
    instances
        .map(|(at, instance)| {
            let named = instance.cdsl.as_ref()?;
            let path = instance.folder.join(&named.text);
            let mut belong = |read: &[PathBuf]| {
                for file in read {
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
                    let message = format!("`{}` cannot be read: {error}", named.text);
                    let error = Diagnostic::error("component-not-found", named.span, message);
                    found.push(error.help("the path is relative to this file"));
                    None
                }
            }
        })
        .collect()
}

impl Network {
    /// The name of the network.
    pub fn name(&self) -> &str {
        &self.deployment.name.text
    }

    /// What an instance has to be told of the middlewares that it uses.
    fn handed(&self, at: usize) -> impl Iterator<Item = &Setting> {
        let default = self.deployment.instances[at].middleware;
        let project = self.projects[at].as_deref();
        let slots = project.map_or(&[][..], |project| &project.component.slots);
        self.handed[at].iter().filter(move |set| {
            let mut chosen = slots.iter().filter_map(|slot| slot.backend);
            set.middleware == default || chosen.any(|backend| backend == set.middleware)
        })
    }

    /// What is to be started, where no diagnostic is an error. Paths are absolute.
    pub fn plan(&self, profile: Profile) -> io::Result<Plan> {
        let addresses = self.addresses();
        let instances = &self.deployment.instances;
        let mut out = Vec::new();
        for (at, instance) in instances.iter().enumerate() {
            // Where there is none, that was an error, or nobody asked.
            let executable = self.executable(at, profile);
            let executable = executable.map(std::path::absolute).transpose()?;
            let executable = executable.unwrap_or_default();
            let directory = match instance.folder.as_path() {
                here if here.as_os_str().is_empty() => Path::new(".").canonicalize()?,
                folder => folder.canonicalize()?,
            };
            let mut args: Vec<String> = Vec::new();
            let mut option = |name: &str, value: String| args.extend([name.to_owned(), value]);
            option("--network", self.name().to_owned());
            option("--name", process_name(&instance.path));
            let project = self.projects[at].as_deref();
            let host = self.deployment.remote_host(instance);
            let config = config(instance, project).map(std::path::absolute);
            let config = config.transpose()?;
            let mut files = Vec::new();
            if let Some(config) = &config {
                option("--config", config.to_string_lossy().into_owned());
            }
            if let Some(host) = host {
                files.extend(config.clone());
                // In a folder of its own it finds what is there.
                if host.workspace.is_none() {
                    files.extend(named_files(project, config.as_deref(), &directory));
                }
            }
            let component = project.map(|p| &p.component);
            for set in self.handed(at) {
                let (middleware, key) = (set.middleware.word(), set.key);
                let values = set.values.join(",");
                option("--set-middleware", format!("{middleware}.{key}={values}"));
            }
            for (slot, index) in component.iter().flat_map(|c| c.slots.iter().zip(0..)) {
                let end = Endpoint {
                    instance: at,
                    slot: index,
                };
                option("--bind", format!("{}={}", slot.name, addresses[&end]));
            }
            args.extend(instance.args.iter().map(|a| a.text.clone()));
            let after = instance.after.iter();
            let after = after.flat_map(|(place, _)| self.deployment.instances_of(*place));
            let required = self.connections.required[at].iter().copied();
            let after: BTreeSet<usize> = after.chain(required).collect();
            out.push(Component {
                args,
                after: after.iter().map(|i| instances[*i].path.clone()).collect(),
                env: instance
                    .env
                    .iter()
                    .map(|(n, v)| (n.text.clone(), v.text.clone()))
                    .collect(),
                ready: instance.ready,
                stop: instance.stop,
                restart: restart(instance.restart),
                cpu: instance.cpu.clone(),
                priority: instance.priority.map(|(priority, _)| priority),
                middleware: instance.middleware.word().to_owned(),
                host: host.map(|host| plan::Host {
                    name: host.name.text.clone(),
                    address: host.address.text.clone(),
                    user: host.user.as_ref().map(|user| user.text.clone()),
                    workspace: host.workspace.as_ref().map(|w| PathBuf::from(&w.text)),
                }),
                files,
                ..Component::new(instance.path.clone(), executable, directory)
            });
        }
        Ok(Plan {
            network: self.name().to_owned(),
            ddsl: self.path.canonicalize()?,
            components: out,
        })
    }
}

fn restart(described: rc_ddsl::model::Restart) -> Restart {
    use rc_ddsl::model::Policy as Described;
    Restart {
        policy: match described.policy {
            Described::Never => Policy::Never,
            Described::OnFailure => Policy::OnFailure,
            Described::Always => Policy::Always,
        },
        limit: described.limit,
        backoff: described.backoff,
    }
}
