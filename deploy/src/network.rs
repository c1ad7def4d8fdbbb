//! A `.ddsl` with everything that it names: loaded, checked, and made into a plan.

use crate::plan::{Component, Plan};
use rc_cdsl::model::{Backend, Role};
use rc_codegen::note::Note;
use rc_codegen::{FileLoader, Project, names};
use rc_ddsl::model::{Deployment, Instance};
use rc_ddsl::{Connection, Endpoint, Network as Connections};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// A network, as far as it could be read.
#[derive(Debug)]
pub struct Network {
    /// The `.ddsl`.
    pub path: PathBuf,
    /// What it says.
    pub deployment: Deployment,
    /// One entry for each component, none where its files could not be read.
    pub projects: Vec<Option<Project>>,
    /// Who talks to whom.
    pub connections: Connections,
    /// The middleware of all slots that do not choose one.
    pub middleware: Backend,
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
    let source = sources.add(path, std::fs::read_to_string(path)?);
    let (deployment, mut found) = rc_ddsl::parse(sources, source);
    let Some(deployment) = deployment else {
        return Ok((None, found));
    };
    let mut projects = Vec::new();
    for instance in &deployment.components {
        projects.push(project(path, instance, sources, loader, &mut found));
    }
    let middleware = match &deployment.middleware {
        Some(name) => Backend::WORDS
            .iter()
            .find(|(word, _)| word.eq_ignore_ascii_case(&name.text))
            .map(|(_, b)| *b),
        None => None,
    };
    let middleware = middleware.unwrap_or(Backend::Iceoryx2);
    let components: Vec<_> = projects
        .iter()
        .map(|p| p.as_ref().map(|p: &Project| &p.component))
        .collect();
    let (connections, more) = rc_ddsl::connect(&deployment, &components, middleware);
    found.extend(more);
    let network = Network {
        path: path.to_path_buf(),
        deployment,
        projects,
        connections,
        middleware,
    };
    network.configurations(sources, &mut found);
    Ok((Some(network), found))
}

fn project(
    ddsl: &Path,
    instance: &Instance,
    sources: &mut SourceMap,
    loader: &FileLoader,
    found: &mut Diagnostics,
) -> Option<Project> {
    let named = instance.cdsl.as_ref()?;
    let path = beside(ddsl, &named.text);
    match Project::load(&path, sources, loader) {
        Ok((project, more)) => {
            let broken = more.has_errors();
            found.extend(more);
            project.filter(|_| !broken)
        }
        Err(error) => {
            let message = format!("`{}` cannot be read: {error}", named.text);
            let help = "the path is relative to this file";
            found.push(Diagnostic::error("component-not-found", named.span, message).help(help));
            None
        }
    }
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

fn beside(ddsl: &Path, relative: &str) -> PathBuf {
    ddsl.parent().unwrap_or(Path::new("")).join(relative)
}

impl Network {
    /// The name of the network.
    pub fn name(&self) -> &str {
        &self.deployment.name.text
    }

    /// The configuration of an instance, if it has one.
    fn config(&self, at: usize) -> Option<PathBuf> {
        if let Some(config) = &self.deployment.components[at].config {
            return Some(beside(&self.path, &config.text));
        }
        let project = self.projects.get(at)?.as_ref()?;
        Some(project.folder().join("etc/config.toml")).filter(|path| path.exists())
    }

    fn configurations(&self, sources: &mut SourceMap, found: &mut Diagnostics) {
        let mut checked: Vec<(PathBuf, u64)> = Vec::new();
        for (at, instance) in self.deployment.components.iter().enumerate() {
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
                        instance.name.text,
                        missing.join(", ")
                    );
                    found.push(Diagnostic::error("missing-configuration", place, message));
                }
                continue;
            };
            if checked.contains(&(path.clone(), project.hash)) {
                continue;
            }
            checked.push((path.clone(), project.hash));
            match std::fs::read_to_string(&path) {
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
        if let Some(executable) = &self.deployment.components[at].executable {
            return Some(beside(&self.path, &executable.text));
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
        for (instance, project) in self.deployment.components.iter().zip(&self.projects) {
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
                        instance.name.text
                    );
                    found.push(Diagnostic::error("stale-generated", place, message).help(generate));
                }
                Err(_) => {
                    let message = format!("`{}` has no generated code", instance.name.text);
                    found.push(
                        Diagnostic::error("missing-generated", place, message).help(generate),
                    );
                }
            }
        }
    }

    /// Checks that every executable is there, and of the present model and middleware.
    pub fn check_executables(&self, profile: Profile, found: &mut Diagnostics) {
        for (at, instance) in self.deployment.components.iter().enumerate() {
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
            self.check_executable(&path, place, instance, project, found);
        }
    }

    fn check_executable(
        &self,
        path: &Path,
        place: Span,
        instance: &Instance,
        project: &Project,
        found: &mut Diagnostics,
    ) {
        let name = &instance.name.text;
        let build = "build it: `rcdeploy up --build`";
        let (code, message) = match Note::read(path) {
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
                "no-component",
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
            Ok(Some(note)) if note.middleware != self.middleware.word() => (
                "middleware-mismatch",
                format!(
                    "the executable of `{name}` uses {}, the network {}",
                    note.middleware,
                    self.middleware.word()
                ),
            ),
            Ok(Some(_)) => return,
        };
        found.push(Diagnostic::error(code, place, message).help(build));
    }

    /// What is to be started, where no diagnostic is an error. Paths are absolute.
    pub fn plan(&self, profile: Profile) -> io::Result<Plan> {
        let ddsl = self.path.canonicalize()?;
        let directory = ddsl.parent().map(Path::to_path_buf).unwrap_or_default();
        let addresses = self.addresses();
        let components: Vec<_> = self
            .projects
            .iter()
            .map(|p| p.as_ref().map(|p| &p.component))
            .collect();
        let mut out = Vec::new();
        for (at, instance) in self.deployment.components.iter().enumerate() {
            let executable = self.executable(at, profile).unwrap_or_default();
            let executable = std::path::absolute(executable)?;
            let mut args: Vec<String> = Vec::new();
            let mut option = |name: &str, value: String| args.extend([name.to_owned(), value]);
            option("--network", self.name().to_owned());
            option("--name", instance.name.text.clone());
            if let Some(config) = self.config(at) {
                option(
                    "--config",
                    std::path::absolute(config)?.to_string_lossy().into_owned(),
                );
            }
            for (slot, index) in components[at].iter().flat_map(|c| c.slots.iter().zip(0..)) {
                let end = Endpoint {
                    instance: at,
                    slot: index,
                };
                option("--bind", format!("{}={}", slot.name, addresses[&end]));
            }
            args.extend(instance.args.iter().map(|a| a.text.clone()));
            let mut after: Vec<String> = instance.after.iter().map(|a| a.text.clone()).collect();
            for required in self.connections.required_by(at, &components) {
                let name = self.deployment.components[required].name.text.clone();
                if !after.contains(&name) {
                    after.push(name);
                }
            }
            out.push(Component {
                args,
                after,
                env: instance
                    .env
                    .iter()
                    .map(|(n, v)| (n.text.clone(), v.text.clone()))
                    .collect(),
                ready: instance.ready,
                stop: instance.stop,
                middleware: self.middleware.word().to_owned(),
                ..Component::new(instance.name.text.clone(), executable, directory.clone())
            });
        }
        Ok(Plan {
            network: self.name().to_owned(),
            ddsl,
            components: out,
        })
    }

    /// Where each slot meets its other ends: `NETWORK/INSTANCE/SLOT` of the provider. Topics that share a
    /// subscriber share one address, that of the first of them.
    pub(crate) fn addresses(&self) -> BTreeMap<Endpoint, String> {
        let mut leader: BTreeMap<Endpoint, Endpoint> = BTreeMap::new();
        let ends = self
            .projects
            .iter()
            .enumerate()
            .filter_map(|(instance, p)| Some((instance, p.as_ref()?)));
        for (instance, project) in ends {
            for slot in 0..project.component.slots.len() {
                let end = Endpoint { instance, slot };
                leader.insert(end, end);
            }
        }
        for Connection { consumer, provider } in &self.connections.connections {
            let (from, to) = (leader[consumer], leader[provider]);
            // A consumer that leads nobody yet follows its provider; two groups follow the first provider.
            let first = if self.is_provider(from) && from < to {
                from
            } else {
                to
            };
            leader
                .values_mut()
                .filter(|l| **l == from || **l == to)
                .for_each(|l| *l = first);
        }
        let name = |end: &Endpoint| {
            let slot = self.projects[end.instance]
                .as_ref()
                .map(|p| p.component.slots[end.slot].name.as_str());
            let instance = &self.deployment.components[end.instance].name.text;
            format!("{}/{instance}/{}", self.name(), slot.unwrap_or_default())
        };
        leader
            .iter()
            .map(|(end, leader)| (*end, name(leader)))
            .collect()
    }

    fn is_provider(&self, end: Endpoint) -> bool {
        let slot = self.projects.get(end.instance).and_then(Option::as_ref);
        let role = slot
            .and_then(|p| p.component.slots.get(end.slot))
            .map(|s| s.role);
        matches!(role, Some(Role::Implements | Role::Publishes))
    }

    /// The packages that have to be built, by the folder of their workspace.
    pub fn packages(&self) -> BTreeMap<PathBuf, Vec<String>> {
        let mut packages: BTreeMap<PathBuf, Vec<String>> = BTreeMap::new();
        for (instance, project) in self.deployment.components.iter().zip(&self.projects) {
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

/// The nearest folder above whose `Cargo.toml` is that of a workspace.
fn workspace(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let is_root = |dir: &&Path| {
        let manifest = std::fs::read_to_string(dir.join("Cargo.toml")).unwrap_or_default();
        manifest.lines().any(|line| line.trim() == "[workspace]")
    };
    folder.ancestors().find(is_root).map(Path::to_path_buf)
}
