//! A network for an engine of another kind: units of systemd, a file of Compose, manifests of
//! Kubernetes.
//!
//! All are made of the plan that `rcdeploy up` runs, and of nothing else: the same programs with
//! the same arguments, in the same order, with the same limits and policies. What an engine cannot
//! do is said, in the file and to who exports.

mod compose;
mod kubernetes;
mod systemd;
mod yaml;

use rc_cdsl::model::Backend;
use rc_codegen::Files;
use rc_ddsl::model::Host;
use rc_deploy_network::Network;
use rc_deploy_network::plan::{Component, Plan, Policy};
use rc_deploy_network::process_name;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// For whom a network is exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Units, for the manager of a user or of the system.
    Systemd,
    /// A file for `docker compose`.
    Compose,
    /// Manifests for `kubectl apply`.
    Kubernetes,
}

impl Engine {
    /// The words of the command line.
    pub const WORDS: [(&'static str, Self); 3] = [
        ("systemd", Self::Systemd),
        ("compose", Self::Compose),
        ("kubernetes", Self::Kubernetes),
    ];
}

/// What every file begins with.
pub const FIRST_WORDS: &str = "# Made by `rcdeploy export`";

/// Where the components of containers are found.
const RUN_DIRECTORY: &str = "the run directory is in /dev/shm: `rcdeploy params` and `NAME --probe` find it on the machine itself as the same user, with XDG_RUNTIME_DIR unset";

/// What is written, and what is to be said.
#[derive(Debug)]
pub struct Export {
    /// The files.
    pub files: Files,
    /// What the engine does otherwise than rcdeploy, and what it needs.
    pub notes: Vec<String>,
}

/// One machine of the network, with its components.
struct Machine<'n> {
    /// None is the one that rcdeploy runs on.
    host: Option<&'n Host>,
    parts: Vec<Part<'n>>,
}

/// One component, as far as engines care.
struct Part<'n> {
    component: &'n Component,
    /// `arm-left-motor`.
    name: String,
    /// The components that must be ready first, of the same machine, and of others.
    needs: Vec<&'n str>,
    needs_elsewhere: Vec<&'n str>,
    /// The groups that it is in, from outside to inside.
    groups: Vec<String>,
    /// Whether it talks over shared memory, and over DDS.
    memory: bool,
    dds: bool,
}

/// Everything that an engine makes its files of.
struct Source<'n> {
    network: &'n str,
    /// The name of the `.ddsl`.
    file: String,
    image: Option<&'n str>,
    machines: Vec<Machine<'n>>,
}

/// Makes the files of a network, which has no errors. `image` is the container image, where there
/// is one.
pub fn export(
    network: &Network,
    plan: &Plan,
    engine: Engine,
    image: Option<&str>,
) -> Result<Export, String> {
    let source = Source {
        network: network.name(),
        file: network
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        image,
        machines: machines(network, plan),
    };
    for part in source.parts() {
        part.check()?;
    }
    let mut export = match engine {
        Engine::Systemd => systemd::units(&source),
        Engine::Compose => compose::files(&source),
        Engine::Kubernetes => kubernetes::manifests(&source),
    };
    let mut seen = BTreeSet::new();
    export.notes.retain(|note| seen.insert(note.clone()));
    Ok(export)
}

fn machines<'n>(network: &'n Network, plan: &'n Plan) -> Vec<Machine<'n>> {
    let needs = plan.needs();
    let deployment = &network.deployment;
    let hosts: Vec<Option<&Host>> = deployment
        .instances
        .iter()
        .map(|i| deployment.remote_host(i))
        .collect();
    let names: Vec<Option<&str>> = hosts
        .iter()
        .map(|h| h.map(|h| h.name.text.as_str()))
        .collect();
    let mut machines: Vec<Machine<'n>> = Vec::new();
    // The plan has the components of the deployment, in its order.
    for (at, (component, instance)) in plan
        .components
        .iter()
        .zip(&deployment.instances)
        .enumerate()
    {
        let (here, elsewhere): (Vec<usize>, Vec<usize>) = needs[at]
            .iter()
            .partition(|need| names[**need] == names[at]);
        let name = |need: usize| plan.components[need].name.as_str();
        let groups = deployment
            .enclosing(instance.group)
            .map(|group| process_name(&deployment.groups[group].path));
        let mut groups: Vec<String> = groups.collect();
        groups.reverse();
        let slots = network.projects[at]
            .iter()
            .flat_map(|project| &project.component.slots);
        let chosen = slots.map(|slot| slot.backend.unwrap_or(instance.middleware));
        let chosen: Vec<Backend> = chosen.collect();
        let part = Part {
            component,
            name: process_name(&component.name),
            needs: here.into_iter().map(name).collect(),
            needs_elsewhere: elsewhere.into_iter().map(name).collect(),
            groups,
            memory: chosen.contains(&Backend::Iceoryx2),
            dds: chosen.contains(&Backend::Dds),
        };
        let of =
            |machine: &&mut Machine<'_>| machine.host.map(|h| h.name.text.as_str()) == names[at];
        match machines.iter_mut().find(of) {
            Some(machine) => machine.parts.push(part),
            None => machines.push(Machine {
                host: hosts[at],
                parts: vec![part],
            }),
        }
    }
    machines
}

impl Source<'_> {
    fn parts(&self) -> impl Iterator<Item = &Part<'_>> {
        self.machines.iter().flat_map(|machine| &machine.parts)
    }

    /// What opens every file.
    fn head(&self) -> String {
        let words = FIRST_WORDS.trim_start_matches("# ");
        format!("{words} from {}; rewritten at every export.", self.file)
    }

    fn restarts(&self) -> bool {
        self.parts()
            .any(|part| part.component.restart.policy != Policy::Never)
    }

    /// What is the same for all engines.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for part in self.parts() {
            for need in &part.needs_elsewhere {
                notes.push(format!(
                    "{} is to start after {need}, which runs on another machine: it does not wait there",
                    part.component.name
                ));
            }
        }
        if self.machines.iter().any(|machine| machine.host.is_some()) {
            notes.push("all paths are those of this machine: programs and configurations have to be there on the others, too".to_owned());
        }
        if self.parts().any(|part| part.memory) {
            notes.push("no guard holds the shared memory: of the components of a network the last one to end wipes it, and the next start what the dead left".to_owned());
        }
        notes.push(
            "`rcdeploy status`, `logs` and `down` know only what rcdeploy has started".to_owned(),
        );
        notes
    }
}

impl Part<'_> {
    /// What the running component is asked with.
    fn probe(&self, network: &str) -> Vec<String> {
        let program = self.component.executable.to_string_lossy().into_owned();
        let words = ["--probe", "--network", network, "--name", &self.name];
        [program]
            .into_iter()
            .chain(words.map(str::to_owned))
            .collect()
    }

    /// No format has a place for bytes that are no text, or for lines in a path.
    fn check(&self) -> Result<(), String> {
        for path in [&self.component.executable, &self.component.directory] {
            let text = path
                .to_str()
                .filter(|text| !text.contains(char::is_control));
            if text.is_none_or(|text| text != text.trim() || text.ends_with('\\')) {
                return Err(format!(
                    "the path `{}` of {} cannot be exported: it has to be UTF-8 without control characters, without white space at its ends and without `\\` at the end; move it",
                    path.display(),
                    self.component.name
                ));
            }
        }
        Ok(())
    }
}

/// A time in the writing that systemd and Compose share.
fn time(time: Duration) -> String {
    match time.as_micros() {
        us if us % 1_000_000 == 0 => format!("{}s", us / 1_000_000),
        us if us % 1000 == 0 => format!("{}ms", us / 1000),
        us => format!("{us}us"),
    }
}

/// Whole seconds, at least one, no less than `time`.
fn seconds(time: Duration) -> u64 {
    (time.as_secs() + u64::from(time.subsec_nanos() > 0)).max(1)
}

impl Export {
    /// Files in `folder` that an earlier export of this network has left, and that do not belong to
    /// it any more.
    pub fn left(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        let first = self
            .files
            .iter()
            .find_map(|(_, _, text)| text.lines().next());
        let folders: BTreeSet<PathBuf> = self
            .files
            .iter()
            .filter_map(|(name, ..)| Some(folder.join(name.parent()?)))
            .collect();
        let mut left = Vec::new();
        for entry in folders
            .iter()
            .map(std::fs::read_dir)
            .collect::<io::Result<Vec<_>>>()?
            .into_iter()
            .flatten()
        {
            let path = entry?.path();
            let ours = self
                .files
                .iter()
                .any(|(name, ..)| folder.join(name) == path);
            if !ours
                && path.is_file()
                && std::fs::read_to_string(&path).is_ok_and(|text| text.lines().next() == first)
            {
                left.push(path);
            }
        }
        left.sort();
        Ok(left)
    }
}
