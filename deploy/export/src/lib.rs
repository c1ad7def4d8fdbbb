//! Exports a network to another orchestrator: systemd units, Compose files, Kubernetes manifests.
//!
//! Exports are made from the plan that `rcdeploy up` runs: same programs, arguments, order, limits
//! and policies. Unsupported features are reported, and noted in the files.

mod compose;
mod dockerfile;
mod kubernetes;
mod processes;
mod systemd;
mod yaml;

use processes::{Probed, Process};
use rc_cdsl::model::Middleware;
use rc_codegen::Files;
use rc_ddsl::model::Host;
use rc_deploy_network::Network;
use rc_deploy_network::plan::{Component, Plan, Policy};
use rc_deploy_network::process_name;
use rc_vocabulary::Language;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The orchestrator of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// systemd units, for a user or the system.
    Systemd,
    /// A file for `docker compose`.
    Compose,
    /// Manifests for `kubectl apply`.
    Kubernetes,
}

impl Engine {
    /// The names on the command line.
    pub const WORDS: [(&'static str, Self); 3] = [
        ("systemd", Self::Systemd),
        ("compose", Self::Compose),
        ("kubernetes", Self::Kubernetes),
    ];
}

/// The beginning of every exported file.
pub const FIRST_WORDS: &str = "# Made by `rcdeploy export`";

/// The beginning of the unit of [`supervised`].
pub const INSTALLED: &str = "# Made by `rcdeploy install-service`";

/// A network that systemd runs by a supervisor.
#[derive(Clone, Copy, Debug)]
pub struct Supervised<'n> {
    /// Its name.
    pub network: &'n str,
    /// The name of its file, for people.
    pub file: &'n str,
    /// The command line of the supervisor.
    pub command: &'n [String],
    /// Its working directory.
    pub directory: &'n Path,
    /// The user, if the manager is that of the system.
    pub user: Option<&'n str>,
    /// The longest time until all components have ended.
    pub stop: Duration,
    /// The highest real-time priority that it gives.
    pub priority: Option<u8>,
}

/// The unit of systemd that runs a network as `rcdeploy up` does.
pub fn supervised(service: &Supervised<'_>) -> Export {
    systemd::supervisor(service)
}

/// The name of that unit.
pub fn supervisor_unit(network: &str) -> String {
    systemd::supervisor_unit(network)
}

/// A note on how to find components in containers.
const RUN_DIRECTORY: &str = "the run directory is in /dev/shm: `rcdeploy params` and `NAME --probe` find it on the machine itself as the same user, with XDG_RUNTIME_DIR unset";

/// The result of an export.
#[derive(Debug)]
pub struct Export {
    /// The files.
    pub files: Files,
    /// Differences from rcdeploy, and requirements.
    pub notes: Vec<String>,
}

/// A machine and its processes.
struct Machine<'n> {
    /// `None`: the machine of rcdeploy.
    host: Option<&'n Host>,
    parts: Vec<Part<'n>>,
}

/// A process of an export: a component of its own, or several.
struct Part<'n> {
    component: &'n Component,
    /// `arm-left-motor`.
    name: String,
    /// The components that it is probed by.
    probed: &'n [Probed],
    /// The highest priority that a thread sets for itself.
    thread_priority: Option<u8>,
    /// The processes that must be ready first: of the same machine, and of others.
    needs: Vec<&'n Process>,
    needs_elsewhere: Vec<&'n Process>,
    /// The groups that it is in, from outside to inside.
    groups: Vec<String>,
    /// Configuration, and the files that its parameters name.
    files: Vec<PathBuf>,
    /// Whether it uses shared memory, and DDS.
    memory: bool,
    dds: bool,
    language: Option<Language>,
}

/// The input of all exports.
struct Source<'n> {
    network: &'n str,
    /// The name of the `.ddsl`.
    file: String,
    image: Option<&'n str>,
    /// The user and the group of this process.
    user: (u32, u32),
    machines: Vec<Machine<'n>>,
    /// Whether the network keeps its last messages.
    has_ring: bool,
}

/// Exports a network, which has no errors. `image` is the container image, if one is given. `user`
/// are the user and the group that containers of Compose have unless a variable sets others.
pub fn export(
    network: &Network,
    plan: &Plan,
    engine: Engine,
    image: Option<&str>,
    user: (u32, u32),
) -> Result<Export, String> {
    // No supervisor takes them through their life cycle.
    let mut plan = plan.clone();
    let components = plan.components.iter_mut();
    for managed in components.filter(|component| component.managed) {
        managed.args.push("--active".to_owned());
    }
    let processes = processes::all(&plan);
    let source = Source {
        network: network.name(),
        file: network
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        image,
        user,
        machines: machines(network, &plan, &processes),
        has_ring: plan.ring.is_some(),
    };
    for part in source.parts() {
        part.check()?;
        part.check_language(engine)?;
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

fn machines<'n>(network: &'n Network, plan: &Plan, processes: &'n [Process]) -> Vec<Machine<'n>> {
    let deployment = &network.deployment;
    // The plan has the components in the order of the deployment.
    let first = |process: &Process| &deployment.instances[process.members[0]];
    let hosts = processes.iter().map(first);
    let hosts: Vec<Option<&Host>> = hosts.map(|of| deployment.remote_host(of)).collect();
    let names = hosts.iter().map(|host| host.map(|h| h.name.text.as_str()));
    let names: Vec<Option<&str>> = names.collect();
    let mut machines: Vec<Machine<'n>> = Vec::new();
    for (at, process) in processes.iter().enumerate() {
        let (here, elsewhere): (Vec<usize>, Vec<usize>) = process
            .needs
            .iter()
            .partition(|need| names[**need] == names[at]);
        let needed = |needs: Vec<usize>| needs.into_iter().map(|need| &processes[need]).collect();
        let uses = |is_meant: &dyn Fn(&Middleware) -> bool| {
            let mut members = process.members.iter();
            members.any(|member| network.middlewares_of(*member).iter().any(is_meant))
        };
        let members = process.members.iter();
        let files: BTreeSet<PathBuf> = members
            .flat_map(|member| network.files(*member, &plan.components[*member]))
            .collect();
        let part = Part {
            component: &process.component,
            name: process_name(&process.component.name),
            probed: &process.probed,
            thread_priority: process.thread_priority,
            needs: needed(here),
            needs_elsewhere: needed(elsewhere),
            groups: groups(network, process),
            files: files.into_iter().collect(),
            memory: uses(&|one| one.can().shares_memory),
            dds: uses(&|one| *one == Middleware::Dds),
            // All components of a process of several ones are in Rust.
            language: network.projects[process.members[0]]
                .as_deref()
                .and_then(rc_codegen::Project::language),
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

/// The groups that all components of a process are in, from outside to inside.
fn groups(network: &Network, process: &Process) -> Vec<String> {
    let deployment = &network.deployment;
    let of_each = process.members.iter().map(|at| {
        let groups = deployment.enclosing(deployment.instances[*at].group);
        let groups = groups.map(|group| process_name(&deployment.groups[group].path));
        let mut groups: Vec<String> = groups.collect();
        groups.reverse();
        groups
    });
    let common = of_each.reduce(|all, other| {
        let both = all.into_iter().zip(other);
        let both = both.take_while(|(one, other)| one == other);
        both.map(|(group, _)| group).collect()
    });
    common.unwrap_or_default()
}

impl Source<'_> {
    fn parts(&self) -> impl Iterator<Item = &Part<'_>> {
        self.machines.iter().flat_map(|machine| &machine.parts)
    }

    /// The header of a file.
    fn head(&self) -> String {
        let words = FIRST_WORDS.trim_start_matches("# ");
        format!("{words} from {}; rewritten at every export.", self.file)
    }

    fn restarts(&self) -> bool {
        self.parts()
            .any(|part| part.component.restart.policy != Policy::Never)
    }

    /// Notes that hold for all orchestrators.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for part in self.parts() {
            for need in &part.needs_elsewhere {
                notes.push(format!(
                    "{} is to start after {}, which runs on another machine: it does not wait there",
                    part.component.name, need.component.name
                ));
            }
            if part.component.thread.is_some() {
                notes.push(format!(
                    "{} is a process of several components: the lines of all are in one log, each with its component's name",
                    part.component.name
                ));
            }
        }
        if self.machines.iter().any(|machine| machine.host.is_some()) {
            notes.push("all paths are those of this machine: programs and configurations have to be there on the others, too".to_owned());
        }
        if self.parts().any(|part| part.memory) {
            notes.push("no guard holds the shared memory: the last component of a network to end removes it, and the next start removes what killed ones have left".to_owned());
        }
        if self
            .parts()
            .any(|part| part.language == Some(Language::Python))
        {
            notes.push("a component in Python runs on `.venv` in its folder, else on the `python3` in the path of the manager: `rcgen venv FILE.cdsl` makes `.venv` with its packages".to_owned());
        }
        if self.has_ring {
            notes.push("the ring of `record` is not exported: start `rcdeploy record NETWORK --ring TIME` yourself".to_owned());
        }
        if self.parts().any(|part| part.component.exact) {
            notes.push("`record { exact; }` is not exported: give the component `args \"--record\", FILE;`".to_owned());
        }
        notes.push(
            "`rcdeploy status`, `logs` and `down` know only networks that rcdeploy has started"
                .to_owned(),
        );
        notes
    }
}

impl Part<'_> {
    /// The command that probes the running components of this process.
    fn probe(&self, network: &str) -> Vec<String> {
        let mut command = vec![self.component.executable.to_string_lossy().into_owned()];
        for probed in self.probed {
            command.extend(probe(network, probed.word.as_deref(), &probed.name));
        }
        command
    }

    /// The limit for that command, in seconds: the components are asked one after the other.
    fn probe_limit(&self) -> u64 {
        2 * u64::try_from(self.probed.len()).unwrap_or(1) + 1
    }

    /// The command that probes one component of another process.
    fn probe_other(&self, network: &str, name: &str) -> Vec<String> {
        let word = self.probed.first().and_then(|own| own.word.as_deref());
        let program = self.component.executable.to_string_lossy().into_owned();
        [program]
            .into_iter()
            .chain(probe(network, word, name))
            .collect()
    }

    /// The highest real-time priority in this process.
    fn highest_priority(&self) -> Option<u8> {
        self.component.priority.max(self.thread_priority)
    }

    /// Refuses components in Python and C++ in a container: an image has only their programs, not
    /// the files next to them.
    fn check_language(&self, engine: Engine) -> Result<(), String> {
        let needs = self.language.and_then(Language::needs);
        let Some((language, needs)) = self.language.zip(needs) else {
            return Ok(());
        };
        let (language, missing) = (language.title(), needs.missing);
        if engine == Engine::Systemd {
            return Ok(());
        }
        let word = Engine::WORDS.iter().find(|(_, known)| *known == engine);
        let word = word.map_or("", |(word, _)| word);
        Err(format!(
            "`{}` is in {language}, and the containers of an export to {word} have {missing} for it; \
             export with `--to systemd`, or start the network by `rcdeploy up`",
            self.component.name
        ))
    }

    /// Refuses paths that are not text or contain control characters: no format can hold them.
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

/// The arguments that probe a component; `word` is the name by which the program of a process of
/// several components knows one of its own, which does it.
fn probe(network: &str, word: Option<&str>, name: &str) -> Vec<String> {
    let member = word.iter().flat_map(|word| ["--member", word]);
    let probe = ["--probe", "--network", network, "--name", name];
    member.chain(probe).map(str::to_owned).collect()
}

/// A time in the syntax of systemd and Compose.
fn time(time: Duration) -> String {
    match time.as_micros() {
        us if us % 1_000_000 == 0 => format!("{}s", us / 1_000_000),
        us if us % 1000 == 0 => format!("{}ms", us / 1000),
        us => format!("{us}us"),
    }
}

/// A time in whole seconds, rounded up, at least one.
fn seconds(time: Duration) -> u64 {
    (time.as_secs() + u64::from(time.subsec_nanos() > 0)).max(1)
}

impl Export {
    /// Finds files in `folder` from an earlier export of this network that do not belong to it any
    /// more.
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
