//! Programs of hosts with another processor, and of hosts that build.

use super::{Programs, RCDEPLOY};
use crate::forwarder;
use crate::launcher::Places;
use crate::plan::{self, Elsewhere, Environment};
use crate::profile::Profile;
use crate::python_copies::{self, HostFiles};
use crate::sites::{CrossTool, Site};
use crate::workspaces::{Target, Workspaces};
use rc_codegen::Project;
use rc_ddsl::model::{Instance, Processor};
use rc_diagnostics::Diagnostics;
use rc_vocabulary::{Builder, Language};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

impl Programs {
    /// Where programs of the workspace `root` are built.
    pub(super) fn target(&self, root: &Path, site: Site) -> io::Result<Target> {
        Ok(site.of(self.workspaces.target(root)?))
    }

    /// The workspace of the first component that is not installed: that of the programs which a host needs besides.
    pub(super) fn root(&self) -> io::Result<Option<PathBuf>> {
        let projects = self.declared.iter().zip(&self.installed);
        let mut projects = projects.filter(|(_, installed)| installed.is_none());
        match projects.find_map(|(project, _)| project.as_ref()) {
            Some(project) => Workspaces::root(project.code()),
            None => Ok(None),
        }
    }

    /// The program of an adaptor or a proxy on its host.
    pub(super) fn forwarder(
        &self,
        instance: &Instance,
        profile: Profile,
    ) -> io::Result<Option<PathBuf>> {
        if let Some(root) = self.root()? {
            let site = self.sites.of(&self.deployment, instance, &root);
            if site != Site::Own {
                let target = self.target(&root, site)?;
                return Ok(Some(target.programs(profile).join(forwarder::PROGRAM)));
            }
        }
        forwarder::program().map(Some)
    }

    /// Takes the processor that a host, an index into the hosts of the deployment, names itself.
    pub fn host_says(&self, host: usize, processor: Processor) {
        self.sites.hear(host, processor);
    }

    /// The processor of a host, an index into the hosts of the deployment, if it is known.
    pub fn processor(&self, host: usize) -> Option<Processor> {
        self.sites.processor(&self.deployment, host)
    }

    /// Where the programs of a host are built that no file names.
    pub fn site_of_host(&self, host: usize) -> Site {
        // A faulty manifest is reported where the programs are located.
        let root = self.root().ok().flatten().unwrap_or_default();
        self.sites.of_host(&self.deployment, host, &root)
    }

    /// What links programs for another processor here. `None`: this machine lacks something.
    pub(crate) fn cross_tool(&self, processor: Processor) -> Option<CrossTool> {
        let root = self.root().ok().flatten().unwrap_or_default();
        self.sites.tool(processor, &root).ok()
    }

    /// The hosts with components whose processor the file does not name.
    pub fn unknown_hosts(&self) -> Vec<usize> {
        let hosts = self.deployment.instances.iter().filter_map(|one| one.host);
        let hosts: BTreeSet<usize> = hosts.map(|(host, _)| host).collect();
        let unknown = |host: &usize| {
            !self.deployment.hosts[*host].is_local() && self.processor(*host).is_none()
        };
        hosts.into_iter().filter(unknown).collect()
    }

    /// Reports hosts for which this machine shall build, and cannot.
    pub fn check_hosts(&self, found: &mut Diagnostics) {
        // A faulty manifest is reported where the programs are located.
        if let Ok(Some(root)) = self.root() {
            self.sites.check(&self.deployment, &root, found);
        }
    }

    /// Where the program of an instance is built: [`Site::Own`] also for a named or installed one.
    pub(super) fn site(&self, at: usize) -> io::Result<Site> {
        let instance = &self.deployment.instances[at];
        let is_given = instance.executable.is_some() || self.installed[at].is_some();
        if is_given || instance.host.is_none() {
            return Ok(Site::Own);
        }
        let Some(project) = self.project(at) else {
            let root = self.root()?;
            let site = |root: PathBuf| self.sites.of(&self.deployment, instance, &root);
            return Ok(root.map_or(Site::Own, site));
        };
        let root = Workspaces::root(project.code())?;
        Ok(root.map_or(Site::Own, |root| self.site_in(instance, project, &root)))
    }

    /// Where the program of an instance is built, in the workspace `root`. Cmake builds for this
    /// machine only.
    pub(super) fn site_in(&self, instance: &Instance, project: &Project, root: &Path) -> Site {
        if project.builder() == Builder::Cmake {
            return Site::Own;
        }
        self.sites.of(&self.deployment, instance, root)
    }

    /// Whether the host of an instance builds its program. The program of a component in Python is a
    /// launcher, which is written here.
    pub(crate) fn is_built_there(&self, at: usize) -> io::Result<bool> {
        let language = self.project(at).and_then(Project::language);
        Ok(!language.is_some_and(Language::has_interpreter)
            && matches!(self.site(at)?, Site::There(_)))
    }

    /// A host, an index into the hosts of the deployment, without a program of its own.
    pub fn host(&self, host: usize) -> plan::Host {
        let site = self.site_of_host(host);
        let machine = self.processor(host).map(Processor::machine);
        plan::Host {
            elsewhere: (site != Site::Own).then(|| Elsewhere {
                machine: machine.map(str::to_owned),
                there: matches!(site, Site::There(_)),
                program: None,
            }),
            ..plan::Host::from(&self.deployment.hosts[host])
        }
    }

    /// The host of an instance, an index into the hosts of the deployment, for its plan.
    pub(crate) fn planned_host(&self, host: usize, profile: Profile) -> io::Result<plan::Host> {
        let mut planned = self.host(host);
        if let Some(elsewhere) = &mut planned.elsewhere
            && let Some(root) = self.root()?
        {
            let site = self.site_of_host(host);
            let program = self.target(&root, site)?.programs(profile).join(RCDEPLOY);
            elsewhere.program =
                Some(program).filter(|file| matches!(site, Site::Cross(_)) && file.is_file());
        }
        Ok(planned)
    }

    /// The files and the environment that an instance in Python needs on another machine. `None`
    /// for other instances, and for those outside of a workspace. `host` are all files of that
    /// machine.
    pub(crate) fn python_copies(
        &self,
        at: usize,
        profile: Profile,
        host: &mut HostFiles,
    ) -> io::Result<Option<(Vec<PathBuf>, Option<Environment>)>> {
        let is_python = |project: &&Project| project.language() == Some(Language::Python);
        let Some(project) = self.project(at).filter(is_python) else {
            return Ok(None);
        };
        let processor = self.deployment.instances[at].host;
        let processor = processor.and_then(|(host, _)| self.processor(host));
        if self.installed[at].is_some() {
            let places = Places::installed(project).map_err(io::Error::other)?;
            return python_copies::of(&places, processor, host).map(Some);
        }
        let Some(root) = Workspaces::root(project.code())? else {
            return Ok(None);
        };
        let site = self.site(at)?;
        let target = self.target(&root, site)?;
        let places = Places::of(project, &root, &target, profile, self.variants[at]);
        let mut places = places.map_err(io::Error::other)?;
        if let Site::There(_) = site {
            // It builds them.
            places.native.clear();
        }
        python_copies::of(&places, processor, host).map(Some)
    }
}
