//! A `.ddsl` with everything that it names: loaded, checked, and made into a plan.

use crate::addresses::process_name;
use crate::plan::{Component, Plan, Policy, Restart};
use rc_codegen::note::Note;
use rc_codegen::{FileLoader, Project, names};
use rc_ddsl::model::{Deployment, Instance};
use rc_ddsl::{Endpoint, Network as Connections};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
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
/// no diagnostic is an error. Executables are not looked at.
pub fn load(
    path: &Path,
    sources: &mut SourceMap,
    loader: &FileLoader,
) -> io::Result<(Option<Network>, Diagnostics)> {
    let source = sources.add(path, rc_codegen::load::read(path)?);
    let (deployment, mut found) = rc_ddsl::load(sources, loader, source);
    let Some(deployment) = deployment else {
        return Ok((None, found));
    };
    let mut texts = HashMap::new();
    let projects = projects(&deployment, sources, loader, &mut texts, &mut found);
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
        texts,
    };
    network.check_topics(&mut found);
    network.warn_of_what_has_no_effect(&mut found);
    network.configurations(sources, &mut found);
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

/// Checks one configuration against the component's parameters and slots.
fn configuration(
    sources: &SourceMap,
    source: SourceId,
    project: &Project,
    found: &mut Diagnostics,
) {
    let (configuration, more) =
        rc_pdsl::config::check(sources, source, project.parameters.as_ref());
    found.extend(more);
    let addresses = configuration.bindings.values();
    for reason in addresses.filter_map(|a| rc_middleware::Address::parse(a).err()) {
        let message = format!("[bindings]: {reason}");
        found.push(Diagnostic::error(
            "bad-address",
            Span::new(source, 0, 0),
            message,
        ));
    }
    let slots: Vec<&str> = project
        .component
        .slots
        .iter()
        .map(|s| s.name.as_str())
        .collect();
    for slot in configuration
        .bindings
        .keys()
        .filter(|slot| !slots.contains(&slot.as_str()))
    {
        let message = format!(
            "[bindings]: `{slot}` is not a slot of {}",
            project.component.name.text
        );
        let diagnostic = Diagnostic::error("unknown-slot", Span::new(source, 0, 0), message);
        found.push(diagnostic.suggest(slot, slots.iter().copied()));
    }
}

/// Checks one executable by the note that was read from it.
fn check_executable(
    path: &Path,
    note: &io::Result<Option<Note>>,
    place: Span,
    instance: &Instance,
    project: &Project,
    found: &mut Diagnostics,
) {
    let name = &instance.path;
    let build = "build it: `rcdeploy up --build`";
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

    /// The configuration of an instance, if it has one.
    fn config(&self, at: usize) -> Option<PathBuf> {
        let instance = &self.deployment.instances[at];
        if let Some(config) = &instance.config {
            return Some(instance.folder.join(&config.text));
        }
        let project = self.projects.get(at)?.as_ref()?;
        Some(project.folder().join("etc/config.toml")).filter(|path| path.exists())
    }

    fn configurations(&self, sources: &mut SourceMap, found: &mut Diagnostics) {
        let mut checked: HashSet<(PathBuf, u64)> = HashSet::new();
        for (at, instance) in self.deployment.instances.iter().enumerate() {
            let Some(Some(project)) = self.projects.get(at) else {
                continue;
            };
            let place = instance
                .config
                .as_ref()
                .map_or(instance.name.span, |c| c.span);
            let Some(path) = self.config(at) else {
                if let Err(missing) = rc_pdsl::config::defaults(project.parameters.as_ref()) {
                    let message = format!(
                        "`{}` has no configuration, and these parameters have no default: {}",
                        instance.path,
                        missing.join(", ")
                    );
                    found.push(Diagnostic::error("missing-configuration", place, message));
                }
                continue;
            };
            if !checked.insert((path.clone(), project.hash)) {
                continue;
            }
            match rc_codegen::load::read(&path) {
                Ok(text) => {
                    let source = sources.add(path, text);
                    configuration(sources, source, project, found);
                }
                Err(error) => {
                    let message = format!(
                        "the configuration {} cannot be read: {error}",
                        path.display()
                    );
                    found.push(Diagnostic::error("missing-configuration", place, message));
                }
            }
        }
    }

    /// The program of an instance.
    pub fn executable(&self, at: usize, profile: Profile) -> Option<PathBuf> {
        let instance = &self.deployment.instances[at];
        if let Some(executable) = &instance.executable {
            return Some(instance.folder.join(&executable.text));
        }
        let project = self.projects.get(at)?.as_ref()?;
        let target = match std::env::var_os("CARGO_TARGET_DIR").filter(|dir| !dir.is_empty()) {
            // A relative one is meant from where cargo runs; an absolute one stays as it is.
            Some(dir) => workspace(project.folder())?.join(dir),
            None => workspace(project.folder())?.join("target"),
        };
        Some(
            target
                .join(profile.folder())
                .join(names::package(&project.component.name.text)),
        )
    }

    /// Checks that generated code is of the present model, where it is to be built.
    pub fn check_generated(&self, found: &mut Diagnostics) {
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
            check_executable(&path, note, place, instance, project, found);
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
            if let Some(config) = self.config(at) {
                option(
                    "--config",
                    std::path::absolute(config)?.to_string_lossy().into_owned(),
                );
            }
            let component = self.projects[at].as_ref().map(|p| &p.component);
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
                middleware: instance.middleware.word().to_owned(),
                ..Component::new(instance.path.clone(), executable, directory)
            });
        }
        Ok(Plan {
            network: self.name().to_owned(),
            ddsl: self.path.canonicalize()?,
            components: out,
        })
    }

    /// The packages that have to be built, by the folder of their workspace.
    pub fn packages(&self) -> BTreeMap<PathBuf, Vec<String>> {
        let mut packages: BTreeMap<PathBuf, Vec<String>> = BTreeMap::new();
        for (instance, project) in self.deployment.instances.iter().zip(&self.projects) {
            let Some(project) = project.as_ref().filter(|_| instance.executable.is_none()) else {
                continue;
            };
            if let Some(root) = workspace(project.folder()) {
                let list = packages.entry(root).or_default();
                let package = names::package(&project.component.name.text);
                if !list.contains(&package) {
                    list.push(package);
                }
            }
        }
        packages
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

/// The nearest folder above whose `Cargo.toml` is that of a workspace.
fn workspace(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let is_root = |dir: &&Path| {
        let manifest = std::fs::read_to_string(dir.join("Cargo.toml")).unwrap_or_default();
        manifest.lines().any(|line| line.trim() == "[workspace]")
    };
    folder.ancestors().find(is_root).map(Path::to_path_buf)
}
