//! A `.ddsl` with everything that it names: loaded, checked, and made into a plan.

use crate::addresses::process_name;
use crate::configuration::{config, configurations, named_files, settings};
use crate::error::Error;
use crate::plan::{self, Component, Plan, Policy, Restart};
use crate::variant;
use rc_cdsl::model::Backend;
use rc_codegen::note::Note;
use rc_codegen::{FileLoader, Project, names};
use rc_ddsl::model::{Deployment, Instance, Setting};
use rc_ddsl::{Endpoint, Network as Connections};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceMap, Span};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ffi::OsString;
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
    /// The middleware that all components are to be variants for; none where they are as they were generated.
    pub variant: Option<Backend>,
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
    let network = Network {
        path: path.to_path_buf(),
        deployment,
        projects,
        connections,
        variant: middleware,
        handed,
        texts,
    };
    network.check_topics(&mut found);
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

/// Checks one executable by the note that was read from it.
fn check_executable(
    path: &Path,
    note: &io::Result<Option<Note>>,
    place: Span,
    instance: &Instance,
    project: &Project,
    build: &str,
    found: &mut Diagnostics,
) {
    let name = &instance.path;
    let (code, message) = match note {
        Err(error) if error.kind() == io::ErrorKind::NotFound => (
            "missing-executable",
            format!(
                "the executable of `{name}`, {}, does not exist",
                path.display()
            ),
        ),
        Err(error) => (
            "missing-executable",
            format!("{} cannot be read: {error}", path.display()),
        ),
        Ok(None) => (
            "not-a-component",
            format!(
                "{} is not a component: it has no note of its model",
                path.display()
            ),
        ),
        Ok(Some(note)) if note.component != project.component.name.text => (
            "other-component",
            format!(
                "{} is the component `{}`, not `{}`",
                path.display(),
                note.component,
                project.component.name.text
            ),
        ),
        Ok(Some(note)) if note.model != format!("{:016x}", project.hash) => (
            "stale-executable",
            format!(
                "the executable of `{name}` was generated from another version of {}",
                project.path.display()
            ),
        ),
        Ok(Some(note)) if note.middleware != instance.middleware.word() => (
            "middleware-mismatch",
            format!(
                "the executable of `{name}` uses {}, the network {}",
                note.middleware,
                instance.middleware.word()
            ),
        ),
        Ok(Some(_)) if may_run(path) => return,
        Ok(Some(_)) => {
            let message = format!("{} may not be executed by anybody", path.display());
            let error = Diagnostic::error("not-executable", place, message);
            found.push(error.help(format!("`chmod +x {}`", path.display())));
            return;
        }
    };
    found.push(Diagnostic::error(code, place, message).help(build));
}

/// Whether a file is one that somebody may execute.
fn may_run(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    let mode = |file: std::fs::Metadata| file.permissions().mode();
    path.metadata().is_ok_and(|file| mode(file) & 0o111 != 0)
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

    /// The program of an instance.
    pub fn executable(&self, at: usize, profile: Profile) -> Option<PathBuf> {
        let instance = &self.deployment.instances[at];
        if let Some(executable) = &instance.executable {
            return Some(instance.folder.join(&executable.text));
        }
        let project = self.projects.get(at)?.as_ref()?;
        let package = names::package(&project.component.name.text);
        let program = match self.variant {
            Some(middleware) => variant::program(&package, middleware),
            None => package,
        };
        let target = variant::target(&workspace(project.folder())?);
        Some(target.join(profile.folder()).join(program))
    }

    /// Checks that code can be generated for the variants, and that there is something to join it with.
    fn check_variants(&self, middleware: Backend, found: &mut Diagnostics) {
        let mut seen: Vec<&Path> = Vec::new();
        for (instance, project) in self.deployment.instances.iter().zip(&self.projects) {
            let Some(project) = project.as_ref().filter(|_| instance.executable.is_none()) else {
                continue;
            };
            if seen.contains(&project.path.as_path()) {
                continue;
            }
            seen.push(&project.path);
            // A template that does not fit is told where it is written.
            if let Ok((_, more)) = rc_codegen::generate::generate(project, middleware) {
                let errors = more.iter().filter(|d| d.severity == Severity::Error);
                found.extend(errors.cloned());
            }
            if !project.folder().join("Cargo.toml").exists() {
                let named = instance.cdsl.as_ref().unwrap_or(&instance.name);
                let message = format!("`{}` has no code yet", instance.path);
                let generate = format!("generate it: `rcgen {}`", project.path.display());
                let error = Diagnostic::error("missing-generated", named.span, message);
                found.push(error.help(generate));
            }
        }
    }

    /// Checks that generated code is of the present model, where it is to be built.
    pub fn check_generated(&self, found: &mut Diagnostics) {
        if let Some(middleware) = self.variant {
            return self.check_variants(middleware, found);
        }
        for (instance, project) in self.deployment.instances.iter().zip(&self.projects) {
            let Some(project) = project.as_ref().filter(|_| instance.executable.is_none()) else {
                continue;
            };
            let place = instance
                .cdsl
                .as_ref()
                .map_or(instance.name.span, |c| c.span);
            let description = project.folder().join("generated/src/description.rs");
            let generate = format!("generate it: `rcgen {}`", project.path.display());
            let wanted = format!("model_hash: 0x{:016x},", project.hash);
            match std::fs::read_to_string(&description) {
                Ok(text) if text.contains(&wanted) => {}
                Ok(_) => {
                    let message = format!(
                        "the generated code of `{}` is of an older model",
                        instance.path
                    );
                    found.push(Diagnostic::error("stale-generated", place, message).help(generate));
                }
                Err(_) => {
                    let message = format!("`{}` has no generated code", instance.path);
                    found.push(
                        Diagnostic::error("missing-generated", place, message).help(generate),
                    );
                }
            }
        }
    }

    /// What to type where a program is not what it has to be.
    fn how_to_build(&self, instance: &Instance) -> String {
        match self.variant {
            Some(middleware) if instance.executable.is_some() => format!(
                "leave `executable` out, or let it name a program that was generated for {}",
                middleware.word()
            ),
            Some(middleware) => format!(
                "build it: `rcdeploy up --build --middleware {} {}`",
                middleware.word(),
                self.path.display()
            ),
            None => "build it: `rcdeploy up --build`".to_owned(),
        }
    }

    /// Checks that every executable is there, and of the present model and middleware.
    pub fn check_executables(&self, profile: Profile, found: &mut Diagnostics) {
        // Executables are large, and instances of one component share one.
        let mut notes: HashMap<PathBuf, io::Result<Option<Note>>> = HashMap::new();
        for (at, instance) in self.deployment.instances.iter().enumerate() {
            let Some(project) = self.projects.get(at).and_then(Option::as_ref) else {
                continue;
            };
            let named = instance.executable.as_ref().or(instance.cdsl.as_ref());
            let place = named.map_or(instance.name.span, |n| n.span);
            let Some(path) = self.executable(at, profile) else {
                let message = format!("{} is in no cargo workspace", project.path.display());
                let help = "make one with `rcgen init`, or name the program with `executable`";
                found.push(Diagnostic::error("missing-executable", place, message).help(help));
                continue;
            };
            let note = notes
                .entry(path.clone())
                .or_insert_with(|| Note::read(&path));
            let build = self.how_to_build(instance);
            check_executable(&path, note, place, instance, project, &build, found);
        }
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

    /// What has to be built, a command of cargo for each workspace. Variants are generated first.
    pub fn builds(&self, profile: Profile) -> Result<Vec<Build>, Error> {
        let mut workspaces: BTreeMap<PathBuf, BTreeMap<String, &Project>> = BTreeMap::new();
        for (instance, project) in self.deployment.instances.iter().zip(&self.projects) {
            let Some(project) = project.as_ref().filter(|_| instance.executable.is_none()) else {
                continue;
            };
            if let Some(root) = workspace(project.folder()) {
                let package = names::package(&project.component.name.text);
                let packages = workspaces.entry(root).or_default();
                packages.entry(package).or_insert(project);
            }
        }
        let builds = workspaces.into_iter().map(|(root, projects)| {
            let mut args: Vec<OsString> = ["build", "--profile", profile.word()]
                .map(Into::into)
                .to_vec();
            let mut option = |name: &str, value: OsString| args.extend([name.into(), value]);
            for package in projects.keys() {
                option("--package", package.into());
            }
            if let Some(middleware) = self.variant {
                for package in projects.keys() {
                    option("--bin", variant::program(package, middleware).into());
                }
                let staged: Vec<&Project> = projects.values().copied().collect();
                let manifest = variant::stage(&root, &staged, middleware)?;
                option("--manifest-path", manifest.into());
                option("--target-dir", variant::target(&root).into());
            }
            let packages = projects.into_keys().collect();
            Ok(Build {
                root,
                args,
                packages,
            })
        });
        builds.collect()
    }
}

/// One command of cargo.
#[derive(Debug)]
pub struct Build {
    /// The user's workspace, where it runs.
    pub root: PathBuf,
    /// Its arguments.
    pub args: Vec<OsString>,
    /// What it builds, for people.
    pub packages: Vec<String>,
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

/// The nearest folder above whose `Cargo.toml` is that of a workspace.
fn workspace(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let is_root = |dir: &&Path| {
        let manifest = std::fs::read_to_string(dir.join("Cargo.toml")).unwrap_or_default();
        manifest.lines().any(|line| line.trim() == "[workspace]")
    };
    folder.ancestors().find(is_root).map(Path::to_path_buf)
}
