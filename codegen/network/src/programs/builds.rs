//! The builds of cargo and cmake that make the programs of a network.

use super::{Built, Programs, program};
use crate::cmake;
use crate::error::{Error, cannot, refused};
use crate::launcher::{self, Launcher};
use crate::profile::Profile;
use crate::shared_process::{self, Members};
use crate::variant::{self, Staged};
use crate::workspaces::Workspaces;
use rc_codegen::Project;
use rc_codegen::installed::program_name;
use rc_vocabulary::Builder;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;

impl Programs {
    /// The builds that the network needs: a cargo command for each workspace, and for each
    /// middleware of its variants. A variant is generated when its build is requested, and locked
    /// as long as the [`Build`] exists.
    ///
    /// # Errors
    /// A manifest is not TOML, or the system refuses it.
    pub fn builds(
        &self,
        profile: Profile,
    ) -> Result<impl Iterator<Item = Result<Build, Error>>, Error> {
        let mut groups: BTreeMap<_, BTreeMap<String, &Project>> = BTreeMap::new();
        let mut scripts: BTreeMap<PathBuf, BTreeMap<String, Built<'_>>> = BTreeMap::new();
        let mut processes: BTreeMap<&str, Members<'_>> = BTreeMap::new();
        for built in self.built() {
            let (instance, project, variant) = (built.instance, built.project, built.variant);
            if let Some(process) = instance.process.as_ref()
                && project.is_built_by_cargo()
            {
                let members = processes.entry(&process.text).or_default();
                members.insert(program_name(project), (project, variant));
                continue;
            }
            let root = Workspaces::root(project.code());
            if let Some(root) = root.map_err(refused("prepare the build"))? {
                if !project.is_built_by_cargo() {
                    let program = program(project, variant, built.sanitizer);
                    let scripts = scripts.entry(root).or_default();
                    scripts.entry(program).or_insert(built);
                    continue;
                }
                let package = program_name(project);
                let packages = groups.entry((root, variant)).or_default();
                packages.entry(package).or_insert(project);
            }
        }
        let mut scripted = scripts.values().flat_map(BTreeMap::values);
        if scripted.any(|built| built.project.builder() == Builder::Cmake) {
            // Before cargo builds for minutes.
            cmake::check()?;
        }
        let shared = processes
            .into_iter()
            .map(move |(process, members)| self.shared(process, &members, profile));
        let launched = scripts
            .into_iter()
            .map(move |(root, scripts)| self.launched(root, scripts, profile));
        Ok(groups
            .into_iter()
            .map(move |((root, variant), projects)| {
                // The features of a dependency follow from all packages that cargo selects. With
                // the whole workspace selected, each build of it, whatever its programs, shares the
                // libraries of the others.
                let mut args: Vec<OsString> = ["build", "--workspace", "--profile", profile.word()]
                    .map(Into::into)
                    .to_vec();
                let mut option = |name: &str, value: OsString| args.extend([name.into(), value]);
                let program = |package: &String| match variant {
                    None => package.into(),
                    Some(middleware) => variant::program(package, middleware).into(),
                };
                for package in projects.keys() {
                    option("--bin", program(package));
                }
                let mut staged = None;
                if let Some(middleware) = variant {
                    let components: Vec<&Project> = projects.values().copied().collect();
                    let target = self.workspaces.target(&root);
                    let target = target.map_err(cannot("prepare the build"))?;
                    let dependencies = self.workspaces.dependencies(&root);
                    let dependencies = dependencies.map_err(cannot("prepare the build"))?;
                    let there = variant::stage(
                        &root,
                        &target.folder,
                        &components,
                        &dependencies,
                        middleware,
                    )?;
                    option("--manifest-path", there.manifest().into());
                    option("--target-dir", target.folder.into());
                    staged = Some(there);
                }
                let packages = projects.into_keys().collect();
                Ok(Build {
                    root,
                    args,
                    packages,
                    launchers: Vec::new(),
                    programs: Vec::new(),
                    _staged: staged,
                })
            })
            .chain(shared)
            .chain(launched))
    }

    /// The build of the program of a process of several components.
    fn shared(
        &self,
        process: &str,
        members: &Members<'_>,
        profile: Profile,
    ) -> Result<Build, Error> {
        let root = shared_process::root(members)?;
        let target = self.workspaces.target(&root);
        let target = target.map_err(cannot("prepare the build"))?;
        let dependencies = self.workspaces.dependencies(&root);
        let dependencies = dependencies.map_err(cannot("prepare the build"))?;
        let program = self.shared_program(process);
        let staged =
            shared_process::stage(&root, &target.folder, &program, members, &dependencies)?;
        let mut args: Vec<OsString> = ["build", "--workspace", "--profile", profile.word()]
            .map(Into::into)
            .to_vec();
        let mut option = |name: &str, value: OsString| args.extend([name.into(), value]);
        option("--bin", program.into());
        option("--manifest-path", staged.manifest().into());
        option("--target-dir", target.folder.into());
        Ok(Build {
            root,
            args,
            packages: members.keys().cloned().collect(),
            launchers: Vec::new(),
            programs: Vec::new(),
            _staged: Some(staged),
        })
    }

    /// The build of the components in Python and C++ of one workspace.
    fn launched(
        &self,
        root: PathBuf,
        scripts: BTreeMap<String, Built<'_>>,
        profile: Profile,
    ) -> Result<Build, Error> {
        let target = self.workspaces.target(&root);
        let target = target.map_err(cannot("prepare the build"))?;
        let (mut launchers, mut programs) = (Vec::new(), Vec::new());
        let packages = scripts.keys().cloned().collect();
        let (mut has_tree, mut has_world) = (false, false);
        for (program, built) in scripts {
            let (project, variant) = (built.project, built.variant);
            let path = target.programs(profile).join(program);
            match project.builder() {
                Builder::Cmake => {
                    programs.push(cmake::of(&built, &root, &target, profile, &path)?);
                }
                Builder::Interpreter => {
                    has_tree |= launcher::has_tree(project);
                    has_world |= project.world.is_some();
                    launchers.push(launcher::of(
                        project, &root, &target, profile, variant, path,
                    )?);
                }
                // Its workspace has its program.
                Builder::Cargo => {}
            }
        }
        let mut crates = Vec::new();
        if !launchers.is_empty() {
            crates.push(launcher::CRATE);
        }
        if has_tree {
            crates.push(launcher::TREE_CRATE);
        }
        if has_world {
            crates.push(launcher::GRAPH_CRATE);
        }
        if !programs.is_empty() {
            crates.push(cmake::CRATE);
        }
        Ok(Build {
            args: launcher::build(&root, &target, profile, &crates)?.unwrap_or_default(),
            root,
            packages,
            launchers,
            programs,
            _staged: None,
        })
    }
}

/// One command of cargo.
#[derive(Debug)]
pub struct Build {
    /// The user's workspace, where it runs.
    pub root: PathBuf,
    /// Arguments; none if cargo has nothing to build.
    pub args: Vec<OsString>,
    /// The packages that it builds, for people.
    pub packages: Vec<String>,
    launchers: Vec<Launcher>,
    programs: Vec<cmake::Program>,
    _staged: Option<Staged>,
}

impl Build {
    /// Writes and builds what cargo does not, after it has succeeded.
    ///
    /// # Errors
    /// The system refuses a file, or cmake fails, which then has printed why.
    pub fn finish(self) -> Result<(), Error> {
        self.launchers.iter().try_for_each(Launcher::write)?;
        self.programs.iter().try_for_each(cmake::Program::build)
    }
}
