//! The executables of a network: where they are, how cargo builds them, and whether they match the
//! network.
//!
//! A component is not bound to a middleware: its generated code is for one, and an instance may use
//! another. Its program is then a variant, built next to the program of its folder.

mod builds;
mod elsewhere;
mod executable;
pub(crate) mod processor;
mod sources;

pub use builds::Build;
pub use sources::{Source, Sources};

use crate::forwarder;
use crate::profile::Profile;
use crate::sanitizer::Sanitizer;
use crate::shared_process::{self, Member};
use crate::sites::Sites;
use crate::variant;
use crate::workspaces::Workspaces;
use rc_codegen::note::Note;
use rc_codegen::paths::normal;
use rc_codegen::{Project, copied, installed};
use rc_ddsl::model::{Deployment, Instance};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, Span};
use rc_vocabulary::{Builder, Language, Middleware, Middlewares};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The program that runs the components of another machine for its supervisor.
pub(crate) const RCDEPLOY: &str = "rcdeploy";

/// The programs of the components of a network.
#[derive(Debug)]
pub struct Programs {
    /// The `.ddsl`, for advice.
    path: PathBuf,
    deployment: Rc<Deployment>,
    /// The component of each instance as its files declare it, with slot arrays: code is generated
    /// from these.
    declared: Vec<Option<Rc<Project>>>,
    /// The programs of components that are installed.
    installed: Vec<Option<PathBuf>>,
    /// The middleware of all components, if the command line sets it.
    middleware: Option<Middleware>,
    /// The middlewares that each instance needs.
    needed: Vec<Middlewares>,
    /// The middlewares for which each instance is a variant. `None` if its program is built from
    /// its folder, is named, or is installed.
    variants: Vec<Option<Middlewares>>,
    /// The instances whose programs are built with a sanitizer.
    sanitized: RefCell<BTreeMap<usize, Sanitizer>>,
    workspaces: Workspaces,
    sites: Sites,
}

/// An instance whose program is built.
pub(crate) struct Built<'n> {
    pub(crate) instance: &'n Instance,
    pub(crate) project: &'n Project,
    /// The middlewares that it needs.
    pub(crate) needed: Middlewares,
    /// The middlewares of its variant, if its program is one.
    pub(crate) variant: Option<Middlewares>,
    pub(crate) sanitizer: Option<Sanitizer>,
}

/// Whether a program with this note has the middlewares that an instance needs.
fn has_all(note: &Note, needed: Middlewares) -> bool {
    note.middleware.parse().is_ok_and(|built: Middlewares| {
        built.main() == needed.main() && needed.iter().all(|one| built.contains(one))
    })
}

/// The component of an instance whose program is built. `None` if the program is named, or
/// installed.
fn built<'a>(
    instance: &Instance,
    project: Option<&'a Rc<Project>>,
    installed: Option<&PathBuf>,
) -> Option<&'a Project> {
    let project = project.filter(|_| instance.executable.is_none() && installed.is_none());
    project.map(Rc::as_ref)
}

/// The name of the program of a component that has a process of its own.
fn program(
    project: &Project,
    variant: Option<Middlewares>,
    sanitizer: Option<Sanitizer>,
) -> String {
    let package = installed::program_name(project);
    let mut program = variant.map_or(package.clone(), |middleware| {
        variant::program(&package, middleware)
    });
    if let Some(sanitizer) = sanitizer {
        let _ = write!(program, "-{}", sanitizer.word());
    }
    program
}

/// The hash of a component's model as in notes.
fn hash(project: &Project) -> String {
    format!("{:016x}", project.hash)
}

/// The command that generates a component into the folder of its code.
fn how_to_generate(project: &Project) -> String {
    let mut command = format!("rcgen {}", project.path.display());
    if project.code() != project.folder() {
        let _ = write!(command, " --out {}", project.code().display());
    }
    format!("generate it: `{command}`")
}

/// Checks that a variant can be generated and built.
fn check_variant(
    instance: &Instance,
    project: &Project,
    middleware: Middlewares,
    found: &mut Diagnostics,
) {
    // A generator that fails reports that when it writes.
    if let Ok((_, more)) = rc_codegen::generate::component(project, middleware, "") {
        let errors = more.iter().filter(|d| d.severity == Severity::Error);
        found.extend(errors.cloned());
    }
    if !project.code().join(project.manifest()).exists() {
        let named = instance.cdsl.as_ref().unwrap_or(&instance.name);
        let message = format!("`{}` has no code yet", instance.path);
        let generate = how_to_generate(project);
        let error = Diagnostic::error("missing-generated", named.span, message);
        found.push(error.help(generate));
    }
}

/// Checks that the generated code in a component's folder is up to date.
fn check_folder(instance: &Instance, project: &Project, found: &mut Diagnostics) {
    let name = &instance.path;
    let (code, message) = match Note::of_generated(project.code()) {
        Ok(Some(note)) if note.model == hash(project) => return,
        Ok(_) => (
            "stale-generated",
            format!("the generated code of `{name}` is of an older model"),
        ),
        Err(_) => (
            "missing-generated",
            format!("`{name}` has no generated code"),
        ),
    };
    let named = instance.cdsl.as_ref().unwrap_or(&instance.name);
    let generate = how_to_generate(project);
    found.push(Diagnostic::error(code, named.span, message).help(generate));
}

impl Programs {
    /// The programs of instances with these components. [`Self::choose`] follows.
    pub(crate) fn new(
        path: &Path,
        deployment: Rc<Deployment>,
        declared: Vec<Option<Rc<Project>>>,
        middleware: Option<Middleware>,
    ) -> Self {
        let programs = declared.iter().map(|project| {
            let project = project.as_deref()?;
            installed::program(project)
        });
        Self {
            path: path.to_path_buf(),
            installed: programs.collect(),
            needed: Vec::new(),
            variants: Vec::new(),
            sanitized: RefCell::default(),
            deployment,
            declared,
            middleware,
            workspaces: Workspaces::default(),
            sites: Sites::default(),
        }
    }

    /// Chooses the programs of instances that need these middlewares. An instance is a variant if the
    /// generated code in its folder is without one of them, or the command line sets the middleware.
    pub(crate) fn choose(&mut self, needed: Vec<Middlewares>) {
        let instances = self.deployment.instances.iter().zip(&self.declared);
        let instances = instances.zip(&self.installed).zip(&needed);
        let variants = instances.map(|(((instance, project), installed), needed)| {
            let project = built(instance, project.as_ref(), installed.as_ref())?;
            if self.middleware.is_some() {
                return Some(*needed);
            }
            let note = Note::of_generated(project.code()).ok()??;
            (!has_all(&note, *needed)).then_some(*needed)
        });
        self.variants = variants.collect();
        self.needed = needed;
    }

    /// The component of an instance, if its files could be read.
    fn project(&self, at: usize) -> Option<&Project> {
        self.declared.get(at)?.as_deref()
    }

    /// The middlewares that an instance needs.
    pub(crate) fn needed(&self, at: usize) -> Middlewares {
        self.needed[at]
    }

    /// The word for a component on the command line of a process of several ones; none if it has a
    /// process of its own.
    pub fn member_word(&self, at: usize) -> Option<String> {
        self.deployment.instances[at].process.as_ref()?;
        Some(self.project(at)?.component.name.text.clone())
    }

    /// The program of a process of several components.
    fn shared_program(&self, process: &str) -> String {
        shared_process::program(&self.deployment.name.text, process, self.middleware)
    }

    /// Checks that the components of each process can be linked into one program.
    pub fn check_processes(&self, found: &mut Diagnostics) {
        let mut processes: BTreeMap<&str, Vec<Member<'_>>> = BTreeMap::new();
        for built in self.built() {
            if let Some(process) = &built.instance.process
                && built.project.is_built_by_cargo()
            {
                let members = processes.entry(&process.text).or_default();
                members.push(Member {
                    process,
                    instance: built.instance,
                    project: built.project,
                    needed: built.needed,
                    variant: built.variant,
                });
            }
        }
        for members in processes.values() {
            shared_process::check(members, found);
        }
    }

    /// Target folders without asking cargo: `CARGO_TARGET_DIR`, or `target` in the workspaces. For
    /// commands that need no program, and no manifest of a component.
    pub fn ask_no_cargo(&self) {
        self.workspaces.unasked.set(true);
    }

    /// The program of an instance; none if it has no component, or a component outside of a
    /// workspace.
    ///
    /// # Errors
    /// Cargo does not say where it builds the component, or a manifest is not TOML.
    pub fn executable(&self, at: usize, profile: Profile) -> io::Result<Option<PathBuf>> {
        let instance = &self.deployment.instances[at];
        if let Some(executable) = &instance.executable {
            return Ok(Some(normal(&instance.folder.join(&executable.text))));
        }
        if instance.adaptor.is_some() || instance.proxy.is_some() {
            return self.forwarder(instance, profile);
        }
        let Some(project) = self.project(at) else {
            return Ok(None);
        };
        if let Some(installed) = &self.installed[at] {
            let is_own = instance.process.is_none();
            return Ok(is_own.then(|| installed.clone()));
        }
        let program = match &instance.process {
            Some(process) => self.shared_program(&process.text),
            None => program(project, self.variants[at], self.sanitizer(at)),
        };
        let Some(root) = Workspaces::root(project.code())? else {
            return Ok(None);
        };
        let target = self.target(&root, self.site_in(instance, project, &root))?;
        Ok(Some(target.programs(profile).join(program)))
    }

    /// The instances whose programs are built.
    pub(crate) fn built(&self) -> impl Iterator<Item = Built<'_>> {
        let instances = self.deployment.instances.iter().zip(&self.declared);
        let chosen = self.needed.iter().zip(&self.variants);
        let all = instances.zip(&self.installed).zip(chosen).enumerate();
        all.filter_map(
            |(at, (((instance, project), installed), (needed, variant)))| {
                Some(Built {
                    instance,
                    project: built(instance, project.as_ref(), installed.as_ref())?,
                    needed: *needed,
                    variant: *variant,
                    sanitizer: self.sanitizer(at),
                })
            },
        )
    }

    /// Builds the program of an instance with a sanitizer from now on.
    ///
    /// # Errors
    /// The program is not of a component in C++ that is built; the text says why.
    pub fn sanitize(&self, at: usize, sanitizer: Sanitizer) -> Result<(), String> {
        let instance = &self.deployment.instances[at];
        let project = self.declared.get(at).and_then(Option::as_ref);
        let Some(project) = built(instance, project, self.installed[at].as_ref()) else {
            return Err("nothing builds its program".to_owned());
        };
        if project.language() != Some(Language::Cpp) {
            return Err(format!(
                "it is in {}; a sanitizer needs a component in C++",
                project.component.language.text
            ));
        }
        self.sanitized.borrow_mut().insert(at, sanitizer);
        Ok(())
    }

    fn sanitizer(&self, at: usize) -> Option<Sanitizer> {
        self.sanitized.borrow().get(&at).copied()
    }

    /// The instances whose programs their components choose, with those, and whether they are
    /// installed.
    pub(crate) fn described(&self) -> impl Iterator<Item = (&Instance, &Project, bool)> {
        let instances = self.deployment.instances.iter().zip(&self.declared);
        let all = instances.zip(&self.installed);
        all.filter_map(|((instance, project), installed)| {
            let project = project.as_deref()?;
            let is_chosen = instance.executable.is_none();
            is_chosen.then_some((instance, project, installed.is_some()))
        })
    }

    /// Whether an instance runs on this machine.
    pub(crate) fn is_here(&self, instance: &Instance) -> bool {
        self.deployment.remote_host(instance).is_none()
    }

    /// Checks that generated code is up to date and that variants can be generated.
    pub fn check_generated(&self, found: &mut Diagnostics) {
        self.check_copies(found);
        self.check_processes(found);
        let mut seen: HashSet<(&Path, Middlewares)> = HashSet::new();
        for built in self.built() {
            let (instance, project, variant) = (built.instance, built.project, built.variant);
            match variant {
                None => check_folder(instance, project, found),
                Some(middleware) => {
                    if seen.insert((&project.path, middleware)) {
                        check_variant(instance, project, middleware, found);
                    }
                }
            }
        }
    }

    /// Reports components whose workspace has another one of their name, also one that this network
    /// does not use: both have one program, and cargo refuses the workspace. Most likely, a folder
    /// was copied.
    fn check_copies(&self, found: &mut Diagnostics) {
        let mut named: BTreeMap<(PathBuf, String), Vec<(&Project, Span)>> = BTreeMap::new();
        for built in self.built() {
            let (instance, project) = (built.instance, built.project);
            // A manifest that cannot be read is reported where it is needed.
            let Ok(Some(root)) = Workspaces::root(project.code()) else {
                continue;
            };
            let place = instance.cdsl.as_ref().unwrap_or(&instance.name).span;
            let same = named
                .entry((root, installed::program_name(project)))
                .or_default();
            if same.iter().all(|(known, _)| known.path != project.path) {
                same.push((project, place));
            }
        }
        let mut packages = copied::Packages::default();
        for same in named.values() {
            let Some(((project, first), copies)) = same.split_first() else {
                continue;
            };
            let name = &project.component.name.text;
            for (_, place) in copies {
                let message = format!(
                    "two components of the workspace have the name `{name}`, and one program"
                );
                let error = Diagnostic::error("copied-component", *place, message);
                found.push(error.label(*first, "first named here").help(copied::HELP));
            }
            if copies.is_empty()
                && let Ok(Some(twin)) = packages.twin(project)
            {
                let message = copied::message(project, &twin);
                let error = Diagnostic::error("copied-component", *first, message);
                found.push(error.help(copied::HELP));
            }
        }
    }

    /// Advice for an executable that does not match.
    fn how_to_build(&self, at: usize, profile: Profile) -> String {
        let instance = &self.deployment.instances[at];
        let mut command = "rcdeploy up --build".to_owned();
        if profile != Profile::Release {
            let _ = write!(command, " --profile {}", profile.word());
        }
        if let Some(middleware) = self.middleware {
            let _ = write!(command, " --middleware {}", middleware.word());
        }
        if let Some(sanitizer) = self.sanitizer(at) {
            let _ = write!(
                command,
                " --sanitize {}={}",
                instance.path,
                sanitizer.word()
            );
        }
        let _ = write!(command, " {}", self.path.display());
        if let Some(program) = &self.installed[at]
            && instance.executable.is_none()
        {
            return format!(
                "{} is installed: install it anew, built from these files for {} (its package, or `rcgen install`), or put the component into a workspace, where `{command}` builds it",
                program.display(),
                self.needed[at],
            );
        }
        let host = instance.host.and_then(|(host, _)| self.processor(host));
        let is_of_cmake = self
            .project(at)
            .is_some_and(|of| of.builder() == Builder::Cmake);
        if instance.executable.is_none()
            && is_of_cmake
            && host.is_some_and(|of| processor::own() != Some(of))
        {
            return "`up --build` runs cmake for this machine only: build it with a toolchain file or on a machine like the host, and name the program with `executable`".to_owned();
        }
        if instance.executable.is_none() {
            return format!("build it: `{command}`");
        }
        format!(
            "leave `executable` out, so that `{command}` builds it, or let it name a program that was generated for {}",
            self.needed[at],
        )
    }

    /// Checks that every executable exists and matches model and middleware.
    pub fn check_executables(&self, profile: Profile, found: &mut Diagnostics) {
        forwarder::check_program(&self.deployment, found);
        // Executables are large, and instances of one component share one.
        let mut notes: HashMap<PathBuf, io::Result<Vec<Note>>> = HashMap::new();
        for (at, place, path) in self.located(profile, found) {
            let instance = &self.deployment.instances[at];
            let Some(project) = self.project(at) else {
                continue;
            };
            // A faulty manifest was reported.
            if self.is_built_there(at).unwrap_or_default() {
                continue;
            }
            let notes = notes
                .entry(path.clone())
                .or_insert_with(|| Note::read(&path));
            let build = self.how_to_build(at, profile);
            let host = instance.host.map(|(host, _)| host);
            let processor = host.and_then(|host| self.processor(host));
            let instance = (instance, self.needed[at], processor);
            executable::check(&path, notes, place, instance, project, &build, found);
        }
    }

    /// Checks that every component has a place for its executable, whether it is built or not.
    pub fn check_locations(&self, profile: Profile, found: &mut Diagnostics) {
        self.located(profile, found);
    }

    /// Checks the manifests that say where components are built. A component may be outside of a
    /// workspace.
    pub fn check_manifests(&self, profile: Profile, found: &mut Diagnostics) {
        let mut all = Diagnostics::new();
        self.located(profile, &mut all);
        found.extend(all.into_iter().filter(|error| error.code == "cargo-failed"));
    }

    /// The executables of the instances, with the place that names each. Adds a finding for one
    /// that has no location.
    fn located(&self, profile: Profile, found: &mut Diagnostics) -> Vec<(usize, Span, PathBuf)> {
        let mut reported: HashSet<String> = HashSet::new();
        let mut all = Vec::new();
        for (at, instance) in self.deployment.instances.iter().enumerate() {
            let Some(project) = self.project(at) else {
                continue;
            };
            let named = instance.executable.as_ref().or(instance.cdsl.as_ref());
            let place = named.map_or(instance.name.span, |n| n.span);
            match self.executable(at, profile) {
                Ok(Some(path)) => all.push((at, place, path)),
                Ok(None) if self.installed[at].is_some() => {
                    let message = format!(
                        "`{}` is installed with a program of its own, and shares no process",
                        instance.path
                    );
                    let help = "leave `process` out, or put the component into a workspace";
                    found.push(Diagnostic::error("missing-executable", place, message).help(help));
                }
                Ok(None) => {
                    let message = format!("{} is in no cargo workspace", project.path.display());
                    let help = "make one with `rcgen init`, or name the program with `executable`";
                    found.push(Diagnostic::error("missing-executable", place, message).help(help));
                }
                Err(error) => {
                    // A failure concerns all instances of a workspace.
                    let message = error.to_string().trim_end().to_owned();
                    if reported.insert(message.clone()) {
                        found.push(Diagnostic::error("cargo-failed", place, message));
                    }
                }
            }
        }
        all
    }
}

#[cfg(test)]
mod tests;
