//! The plan of a network, as plain data.

use crate::planned_chain::PlannedChain;
pub use rc_codegen::python::environment_copy::Environment;
pub use rc_vocabulary::{Restart, RestartPolicy as Policy};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;
use std::time::Duration;

/// The plan of a network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the network.
    pub network: String,
    /// The file that describes it, for people.
    pub ddsl: PathBuf,
    /// Components, in the order of their start.
    pub components: Vec<Component>,
    /// The time over which its last messages are kept in memory.
    #[serde(default)]
    pub ring: Option<Duration>,
    /// The chains that are measured.
    #[serde(default)]
    pub chains: Vec<PlannedChain>,
}

/// One component of the network: a process, or a thread of one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Component {
    /// Name, unique in the network. Names of groups precede it, with dots.
    pub name: String,
    /// The process whose thread it is. `None`: one of its own.
    #[serde(default)]
    pub thread: Option<Thread>,
    /// The executable of its process.
    pub executable: PathBuf,
    /// Command-line arguments.
    #[serde(default)]
    pub args: Vec<String>,
    /// Environment, in addition to that of rcdeploy.
    #[serde(default)]
    pub env: BTreeMap<String, String>,
    /// Working directory.
    pub directory: PathBuf,
    /// The components that must be ready before this one starts.
    #[serde(default)]
    pub after: Vec<String>,
    /// Slots whose peers are not part of the network.
    #[serde(default)]
    pub external: Vec<String>,
    /// Slots that need no peer.
    #[serde(default)]
    pub optional: Vec<String>,
    /// For the proxy of a group: the components behind it. Empty for other components.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub behind: Vec<String>,
    /// Whether it has the life cycle of a managed component.
    #[serde(default)]
    pub managed: bool,
    /// The limit from its start until it is ready.
    #[serde(default = "default_ready")]
    pub ready: Duration,
    /// The limit for its end after SIGTERM.
    #[serde(default = "default_stop")]
    pub stop: Duration,
    /// When it is started again.
    #[serde(default)]
    pub restart: Restart,
    /// The processors that it may run on. Empty: any.
    #[serde(default)]
    pub cpu: Vec<u16>,
    /// Real-time priority (`SCHED_FIFO`, 1 to 99), if it has one.
    #[serde(default)]
    pub priority: Option<u8>,
    /// Whether everything that decides its life is recorded.
    #[serde(default)]
    pub exact: bool,
    /// The middlewares of its connections. Only for people.
    #[serde(default)]
    pub middleware: String,
    /// For connections of several middlewares, those of each slot with connections. Only for people.
    #[serde(default)]
    pub transports: BTreeMap<String, String>,
    /// The machine that it runs on. `None`: this machine.
    #[serde(default)]
    pub host: Option<Host>,
    /// The files that its host needs: its configuration, and files named there.
    #[serde(default)]
    pub files: Vec<PathBuf>,
    /// The virtual environment of a component in Python on another machine, whose packages are among
    /// the files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub venv: Option<Environment>,
    /// Whether its host builds its executable, which is then not among the files.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub built_there: bool,
}

/// A component as a thread of a process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Thread {
    /// Name of the process, unique in the network.
    pub process: String,
    /// The name by which its program knows the component.
    pub component: String,
}

/// Another machine, reached over ssh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// Name in the network.
    pub name: String,
    /// Name or IP address, or an alias of the user's `~/.ssh/config`.
    pub address: String,
    /// The user there. `None`: as ssh is configured.
    pub user: Option<String>,
    /// The working directory of components there. `None`: a copy of the network's folder.
    pub workspace: Option<PathBuf>,
    /// How its programs are made, if not as those of this machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elsewhere: Option<Elsewhere>,
}

/// How the programs of a host are made that are not those of this machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Elsewhere {
    /// The processor of the host, as `uname -m` names it. `None`: as the host says.
    pub machine: Option<String>,
    /// Whether the host builds its programs.
    pub there: bool,
    /// `rcdeploy` for that processor, on this machine. `None`: the host has one.
    pub program: Option<PathBuf>,
}

impl From<&rc_ddsl::model::Host> for Host {
    fn from(host: &rc_ddsl::model::Host) -> Self {
        Self {
            name: host.name.text.clone(),
            address: host.address.text.clone(),
            user: host.user.as_ref().map(|user| user.text.clone()),
            workspace: host.workspace.as_ref().map(|w| PathBuf::from(&w.text)),
            elsewhere: None,
        }
    }
}

fn default_ready() -> Duration {
    Duration::from_secs(10)
}

fn default_stop() -> Duration {
    Duration::from_secs(3)
}

impl Component {
    /// A component with default limits that runs in `directory` and needs no other one.
    pub fn new(
        name: impl Into<String>,
        executable: impl Into<PathBuf>,
        directory: impl Into<PathBuf>,
    ) -> Self {
        Self {
            name: name.into(),
            thread: None,
            executable: executable.into(),
            args: Vec::new(),
            env: BTreeMap::new(),
            directory: directory.into(),
            after: Vec::new(),
            external: Vec::new(),
            optional: Vec::new(),
            behind: Vec::new(),
            managed: false,
            ready: default_ready(),
            stop: default_stop(),
            restart: Restart::default(),
            cpu: Vec::new(),
            priority: None,
            exact: false,
            middleware: String::new(),
            transports: BTreeMap::new(),
            host: None,
            files: Vec::new(),
            venv: None,
            built_there: false,
        }
    }
}

impl Component {
    /// The arguments of this component for the program of a process of several, which knows it as
    /// `word` and starts it when the components `after` are ready.
    pub fn thread_arguments(&self, word: &str, after: &[String]) -> Vec<String> {
        let mut options = vec![("--member", word.to_owned())];
        if !after.is_empty() {
            options.push(("--after", after.join(",")));
        }
        if !self.cpu.is_empty() {
            let cpu: Vec<String> = self.cpu.iter().map(u16::to_string).collect();
            options.push(("--cpu", cpu.join(",")));
        }
        if let Some(priority) = self.priority {
            options.push(("--priority", priority.to_string()));
        }
        options.push(("--stop", self.stop.as_secs_f64().to_string()));
        let options = options.into_iter();
        let options = options.flat_map(|(option, value)| [option.to_owned(), value]);
        options.chain(self.args.iter().cloned()).collect()
    }

    /// Name of its process: its own one has its name.
    pub fn process(&self) -> &str {
        let thread = self.thread.as_ref();
        thread.map_or(&self.name, |thread| &thread.process)
    }
}

impl Plan {
    /// A plan without recording and chains.
    pub fn new(
        network: impl Into<String>,
        ddsl: impl Into<PathBuf>,
        components: impl IntoIterator<Item = Component>,
    ) -> Self {
        Self {
            network: network.into(),
            ddsl: ddsl.into(),
            components: components.into_iter().collect(),
            ring: None,
            chains: Vec::new(),
        }
    }

    /// For each component, the components of its process, also itself.
    pub fn mates(&self) -> Vec<BTreeSet<usize>> {
        let mut processes: HashMap<&str, BTreeSet<usize>> = HashMap::new();
        for (at, component) in self.components.iter().enumerate() {
            processes.entry(component.process()).or_default().insert(at);
        }
        let components = self.components.iter();
        components
            .map(|component| processes[component.process()].clone())
            .collect()
    }

    /// For each component, the indices of the components that must be ready before it starts.
    ///
    /// Components that need each other, directly or indirectly, start together, as soon as
    /// everything that any of them needs is ready. A process starts when everything outside of it
    /// is ready that any of its threads needs.
    pub fn needs(&self) -> Vec<BTreeSet<usize>> {
        let direct = self.direct_needs();
        let mates = self.mates();
        let inside = needs_over(&direct);
        let inside = inside.iter().zip(&mates).map(|(all, mates)| all & mates);
        let whole = direct.iter().zip(&mates).map(|(all, mates)| all | mates);
        let outside = needs_over(&whole.collect::<Vec<_>>());
        let both = inside.zip(outside);
        both.map(|(inside, outside)| &inside | &outside).collect()
    }

    fn direct_needs(&self) -> Vec<BTreeSet<usize>> {
        let index: HashMap<&str, usize> = self
            .components
            .iter()
            .enumerate()
            .map(|(i, c)| (c.name.as_str(), i))
            .collect();
        self.components
            .iter()
            .map(|c| {
                c.after
                    .iter()
                    .filter_map(|n| index.get(n.as_str()).copied())
                    .collect()
            })
            .collect()
    }
}

/// The needs of each node, where those that need each other have their needs together.
fn needs_over(direct: &[BTreeSet<usize>]) -> Vec<BTreeSet<usize>> {
    let reached: Vec<BTreeSet<usize>> = (0..direct.len()).map(|i| reachable(direct, i)).collect();
    (0..direct.len())
        .map(|i| {
            let group: BTreeSet<usize> = reached[i]
                .iter()
                .copied()
                .filter(|&j| reached[j].contains(&i))
                .chain([i])
                .collect();
            let all: BTreeSet<usize> = group
                .iter()
                .flat_map(|&j| direct[j].iter().copied())
                .collect();
            all.difference(&group).copied().collect()
        })
        .collect()
}

/// For each component, the length of the longest chain of components that it waits for.
pub fn waves(needs: &[BTreeSet<usize>]) -> Vec<usize> {
    let mut waves = vec![0; needs.len()];
    // The needs have no cycle, so this ends.
    for _ in 0..needs.len() {
        let next =
            |all: &BTreeSet<usize>| all.iter().map(|other| waves[*other] + 1).max().unwrap_or(0);
        let better: Vec<usize> = needs.iter().map(next).collect();
        if better == waves {
            break;
        }
        waves = better;
    }
    waves
}

/// The nodes that can be reached from a node.
pub fn reachable(edges: &[BTreeSet<usize>], from: usize) -> BTreeSet<usize> {
    let mut seen = BTreeSet::new();
    let mut left = vec![from];
    while let Some(node) = left.pop() {
        left.extend(
            edges[node]
                .iter()
                .copied()
                .filter(|&next| seen.insert(next)),
        );
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(components: &[(&str, &[&str])]) -> Plan {
        let components = components.iter().map(|(name, after)| Component {
            after: after.iter().map(|&n| n.to_owned()).collect(),
            ..Component::new(*name, "/bin/true", "/")
        });
        Plan::new("net", "net.ddsl", components)
    }

    fn needs(components: &[(&str, &[&str])]) -> Vec<Vec<usize>> {
        let plan = plan(components);
        plan.needs()
            .into_iter()
            .map(|set| set.into_iter().collect())
            .collect()
    }

    #[test]
    fn a_chain_starts_in_order() {
        let chain = needs(&[("a", &[]), ("b", &["a"]), ("c", &["b", "a"])]);
        assert_eq!(chain, [vec![], vec![0], vec![0, 1]]);
    }

    #[test]
    fn a_cycle_starts_together_after_its_dependencies() {
        let cycle = needs(&[
            ("base", &[]),
            ("a", &["b", "base"]),
            ("b", &["c"]),
            ("c", &["a"]),
            ("top", &["c"]),
        ]);
        assert_eq!(cycle, [vec![], vec![0], vec![0], vec![0], vec![3]]);
        assert_eq!(needs(&[("self", &["self"])]), [Vec::<usize>::new()]);
    }

    #[test]
    fn a_process_starts_when_all_that_its_threads_need_is_ready() {
        let mut plan = plan(&[
            ("base", &[]),
            ("a", &["base"]),
            ("b", &["a"]),
            ("c", &["x"]),
            ("x", &["a"]),
            ("top", &["b"]),
        ]);
        for (at, process) in [(1, "p"), (2, "p"), (3, "q"), (4, "q")] {
            plan.components[at].thread = Some(Thread {
                process: process.to_owned(),
                component: "c".to_owned(),
            });
        }
        let needs = |plan: &Plan| -> Vec<Vec<usize>> {
            let needs = plan.needs().into_iter();
            needs.map(|all| all.into_iter().collect()).collect()
        };
        let mates = plan.mates();
        assert_eq!(mates[1], BTreeSet::from([1, 2]));
        assert_eq!(mates[5], BTreeSet::from([5]));
        assert_eq!(
            needs(&plan),
            [vec![], vec![0], vec![0, 1], vec![1, 4], vec![1], vec![2]]
        );
        // Two processes need each other: they start together.
        plan.components[0].after = vec!["x".to_owned()];
        plan.components[0].thread = plan.components[1].thread.clone();
        assert_eq!(needs(&plan)[4], Vec::<usize>::new());
    }

    #[test]
    fn limits_have_defaults_in_json() {
        let text = r#"{"network":"n","ddsl":"n.ddsl","components":[{"name":"a","executable":"/x","directory":"/"}]}"#;
        let plan: Plan = serde_json::from_str(text).expect("a plan");
        assert_eq!(plan.components[0], Component::new("a", "/x", "/"));
    }
}
