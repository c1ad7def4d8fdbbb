//! The builds of cargo and cmake that make the programs of a network.

use super::{Built, Programs, RCDEPLOY, program};
use crate::cmake;
use crate::error::{Error, cannot, refused};
use crate::forwarder;
use crate::launcher::{self, Launcher};
use crate::profile::Profile;
use crate::shared_process::{self, Members};
use crate::sites::{CrossTool, Site};
use crate::variant::{self, Staged};
use crate::workspaces::Workspaces;
use rc_codegen::Project;
use rc_codegen::installed::program_name;
use rc_vocabulary::Builder;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The crate of `rcdeploy`.
const RCDEPLOY_CRATE: &str = "rc-deploy";

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
        let mut scripts: BTreeMap<_, BTreeMap<String, Built<'_>>> = BTreeMap::new();
        let mut processes: BTreeMap<_, Members<'_>> = BTreeMap::new();
        let mut tools: BTreeMap<(PathBuf, Site), bool> = BTreeMap::new();
        let refused = || refused("prepare the build");
        for built in self.built() {
            let (instance, project, variant) = (built.instance, built.project, built.variant);
            let root = Workspaces::root(project.code()).map_err(refused())?;
            let site = root
                .as_deref()
                .map_or(Site::Own, |root| self.site_in(instance, project, root));
            if let Some(root) = root.clone().filter(|_| site != Site::Own) {
                tools.entry((root, site)).or_default();
            }
            if let Some(process) = instance.process.as_ref()
                && project.is_built_by_cargo()
            {
                let members = processes.entry((&*process.text, site)).or_default();
                members.insert(program_name(project), (project, variant));
                continue;
            }
            if let Some(root) = root {
                if !project.is_built_by_cargo() {
                    let program = program(project, variant, built.sanitizer);
                    let scripts = scripts.entry((root, site)).or_default();
                    scripts.entry(program).or_insert(built);
                    continue;
                }
                let package = program_name(project);
                let packages = groups.entry((root, variant, site)).or_default();
                packages.entry(package).or_insert(project);
            }
        }
        let mut scripted = scripts.values().flat_map(BTreeMap::values);
        if scripted.any(|built| built.project.builder() == Builder::Cmake) {
            // Before cargo builds for minutes.
            cmake::check()?;
        }
        if let Some(root) = self.root().map_err(refused())? {
            let forwarders = self.deployment.instances.iter();
            for instance in forwarders.filter(|of| of.adaptor.is_some() || of.proxy.is_some()) {
                let site = self.sites.of(&self.deployment, instance, &root);
                if site != Site::Own {
                    tools.insert((root.clone(), site), true);
                }
            }
        }
        let shared = processes
            .into_iter()
            .map(move |((process, site), members)| self.shared(process, site, &members, profile));
        let launched = scripts
            .into_iter()
            .map(move |((root, site), scripts)| self.launched(root, site, scripts, profile));
        let tools = tools
            .into_iter()
            .filter_map(move |((root, site), forwards)| {
                self.tools(root, site, forwards, profile).transpose()
            });
        Ok(groups
            .into_iter()
            .map(move |((root, variant, site), projects)| {
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
                let packages: Vec<String> = projects.into_keys().collect();
                let program = |package: &String| match variant {
                    None => package.clone(),
                    Some(middleware) => variant::program(package, middleware),
                };
                let programs = packages.iter().map(program).collect();
                Ok(self
                    .build(root, site, args, packages, profile)?
                    .with(programs, staged))
            })
            .chain(shared)
            .chain(launched)
            .chain(tools))
    }

    /// A build in the workspace `root`, without programs so far.
    fn build(
        &self,
        root: PathBuf,
        site: Site,
        mut args: Vec<OsString>,
        packages: Vec<String>,
        profile: Profile,
    ) -> Result<Build, Error> {
        if let Site::Cross(processor) = site
            && let Some(command) = args.first_mut()
        {
            let tool = self.sites.tool(processor, &root);
            let tool = tool.map_err(|missing| {
                let missing = missing.join(", and ");
                Error::Workspace(format!("cannot build for {processor}: {missing}"))
            })?;
            if tool == CrossTool::Zig {
                *command = "zigbuild".into();
            }
            args.extend(["--target".into(), processor.platform().into()]);
            if tool == CrossTool::Gcc {
                let linker = format!("{}-gcc", processor.toolchain());
                let key = format!("target.{}.linker={linker:?}", processor.platform());
                args.extend(["--config".into(), key.into()]);
            }
        }
        let target = self.target(&root, site);
        let target = target.map_err(cannot("prepare the build"))?;
        Ok(Build {
            results: target.programs(profile),
            target: target.folder,
            site,
            root,
            args,
            packages,
            built: Vec::new(),
            launchers: Vec::new(),
            programs: Vec::new(),
            staged: None,
        })
    }

    /// The build of what a host of another processor needs besides its components: `rcdeploy` and, if
    /// it `forwards`, the program of adaptors and proxies. `None` without the framework's sources.
    fn tools(
        &self,
        root: PathBuf,
        site: Site,
        forwards: bool,
        profile: Profile,
    ) -> Result<Option<Build>, Error> {
        let target = self.workspaces.target(&root);
        let target = target.map_err(cannot("prepare the build"))?;
        let mut programs = vec![RCDEPLOY.to_owned()];
        let mut crates = vec![RCDEPLOY_CRATE];
        if forwards {
            programs.push(forwarder::PROGRAM.to_owned());
            crates.push(forwarder::CRATE);
        }
        let Some(mut args) = launcher::build(&root, &target, profile, &crates)? else {
            return Ok(None);
        };
        for program in &programs {
            args.extend(["--bin".into(), program.into()]);
        }
        let build = self.build(root, site, args, programs.clone(), profile)?;
        Ok(Some(build.with(programs, None)))
    }

    /// The build of the program of a process of several components.
    fn shared(
        &self,
        process: &str,
        site: Site,
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
        option("--bin", program.clone().into());
        option("--manifest-path", staged.manifest().into());
        option("--target-dir", target.folder.into());
        let packages = members.keys().cloned().collect();
        Ok(self
            .build(root, site, args, packages, profile)?
            .with(vec![program], Some(staged)))
    }

    /// The build of the components in Python and C++ of one workspace.
    fn launched(
        &self,
        root: PathBuf,
        site: Site,
        scripts: BTreeMap<String, Built<'_>>,
        profile: Profile,
    ) -> Result<Build, Error> {
        let target = self.target(&root, site);
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
        let (mut crates, mut built) = (Vec::new(), Vec::new());
        let mut library = |of: (&'static str, &'static str)| {
            crates.push(of.0);
            built.push(of.1.to_owned());
        };
        if !launchers.is_empty() {
            library((launcher::CRATE, launcher::LIBRARY));
        }
        if has_tree {
            library((launcher::TREE_CRATE, launcher::TREE_LIBRARY));
        }
        if has_world {
            library((launcher::GRAPH_CRATE, launcher::GRAPH_LIBRARY));
        }
        if !programs.is_empty() {
            crates.push(cmake::CRATE);
        }
        let args = launcher::build(&root, &target, profile, &crates)?.unwrap_or_default();
        let build = self.build(root, site, args, packages, profile)?;
        Ok(Build {
            built,
            launchers,
            programs,
            ..build
        })
    }
}

/// One command of cargo.
#[derive(Debug)]
pub struct Build {
    /// What builds, and for what.
    pub site: Site,
    /// The user's workspace, where it runs.
    pub root: PathBuf,
    /// Arguments; none if cargo has nothing to build.
    pub args: Vec<OsString>,
    /// The packages that it builds, for people.
    pub packages: Vec<String>,
    /// The target folder.
    pub target: PathBuf,
    /// The folder of the programs.
    pub results: PathBuf,
    /// The names of the programs and libraries that cargo makes.
    pub built: Vec<String>,
    launchers: Vec<Launcher>,
    programs: Vec<cmake::Program>,
    staged: Option<Staged>,
}

impl Build {
    fn with(self, built: Vec<String>, staged: Option<Staged>) -> Self {
        Self {
            built,
            staged,
            ..self
        }
    }

    /// The folder of generated variants that it builds, if it does.
    pub fn staged(&self) -> Option<&Path> {
        self.staged.as_ref().map(Staged::folder)
    }

    /// Writes and builds what cargo does not, after it has succeeded.
    ///
    /// # Errors
    /// The system refuses a file, or cmake fails, which then has printed why.
    pub fn finish(self) -> Result<(), Error> {
        self.launchers.iter().try_for_each(Launcher::write)?;
        self.programs.iter().try_for_each(cmake::Program::build)
    }
}
