//! What is to run, as plain data.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;
use std::time::Duration;

/// The longest pause before a component is started again, unless its `backoff` is longer.
pub const LONGEST_PAUSE: Duration = Duration::from_secs(30);

/// A network that is to be started.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// Its name.
    pub network: String,
    /// The file that describes it, for people.
    pub ddsl: PathBuf,
    /// Its components, in the order of their start.
    pub components: Vec<Component>,
}

/// One process of the network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Component {
    /// Its name, unique in the network; dotted if it is in a group.
    pub name: String,
    /// What is run.
    pub executable: PathBuf,
    /// With which arguments.
    #[serde(default)]
    pub args: Vec<String>,
    /// Environment, in addition to that of rcdeploy.
    #[serde(default)]
    pub env: BTreeMap<String, String>,
    /// The working directory.
    pub directory: PathBuf,
    /// The components that must be ready before this one starts.
    #[serde(default)]
    pub after: Vec<String>,
    /// How long it may take from its start until it is ready.
    #[serde(default = "default_ready")]
    pub ready: Duration,
    /// How long it may take to end when it is asked to.
    #[serde(default = "default_stop")]
    pub stop: Duration,
    /// Whether it is started again when it has ended by itself.
    #[serde(default)]
    pub restart: Restart,
    /// The processors that it may run on; any where there is none.
    #[serde(default)]
    pub cpu: Vec<u16>,
    /// Its real-time priority (`SCHED_FIFO`), 1 to 99, where it has one.
    #[serde(default)]
    pub priority: Option<u8>,
    /// The middleware that it was generated for, for people.
    #[serde(default)]
    pub middleware: String,
    /// The machine that it runs on; this one where there is none.
    #[serde(default)]
    pub host: Option<Host>,
    /// What it reads and its host has to have: its configuration, and files that this names.
    #[serde(default)]
    pub files: Vec<PathBuf>,
}

/// Another machine, which is reached by ssh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// Its name in the network.
    pub name: String,
    /// Its name or IP address, or an alias of the user's `~/.ssh/config`.
    pub address: String,
    /// Who runs components there; as ssh decides where there is none.
    pub user: Option<String>,
    /// The folder there that components run in, instead of a copy of the network's.
    pub workspace: Option<PathBuf>,
}

/// Whether a component is started again when it has ended by itself. The first start has to succeed
/// all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restart {
    /// After which ends.
    pub policy: Policy,
    /// How often within which time at most; a further end stops the network.
    pub limit: Option<(u32, Duration)>,
    /// How long after its end it is started again; the time doubles from one short run to the next,
    /// up to half a minute.
    pub backoff: Duration,
}

/// After which ends a component is started again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Policy {
    /// After none.
    Never,
    /// After those that are no success.
    OnFailure,
    /// After all.
    Always,
}

impl Default for Restart {
    fn default() -> Self {
        Self {
            policy: Policy::Never,
            limit: None,
            backoff: Duration::from_millis(500),
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
    /// A component with the default limits, which runs in `directory` and needs nothing.
    pub fn new(
        name: impl Into<String>,
        executable: impl Into<PathBuf>,
        directory: impl Into<PathBuf>,
    ) -> Self {
        Self {
            name: name.into(),
            executable: executable.into(),
            args: Vec::new(),
            env: BTreeMap::new(),
            directory: directory.into(),
            after: Vec::new(),
            ready: default_ready(),
            stop: default_stop(),
            restart: Restart::default(),
            cpu: Vec::new(),
            priority: None,
            middleware: String::new(),
            host: None,
            files: Vec::new(),
        }
    }
}

impl Plan {
    /// For each component, the indices of those that must be ready before it starts.
    ///
    /// Components that need each other, directly or through others, form a group: they start
    /// together, as soon as everything is ready that any of them needs from outside the group.
    pub fn needs(&self) -> Vec<BTreeSet<usize>> {
        let index: HashMap<&str, usize> = self
            .components
            .iter()
            .enumerate()
            .map(|(i, c)| (c.name.as_str(), i))
            .collect();
        let direct: Vec<BTreeSet<usize>> = self
            .components
            .iter()
            .map(|c| {
                c.after
                    .iter()
                    .filter_map(|n| index.get(n.as_str()).copied())
                    .collect()
            })
            .collect();
        let reached: Vec<BTreeSet<usize>> =
            (0..direct.len()).map(|i| reachable(&direct, i)).collect();
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
}

/// The nodes that edges lead to from a node, directly or through others.
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
        let components = components
            .iter()
            .map(|(name, after)| Component {
                after: after.iter().map(|&n| n.to_owned()).collect(),
                ..Component::new(*name, "/bin/true", "/")
            })
            .collect();
        Plan {
            network: "net".to_owned(),
            ddsl: "net.ddsl".into(),
            components,
        }
    }

    fn needs(components: &[(&str, &[&str])]) -> Vec<Vec<usize>> {
        let plan = plan(components);
        plan.needs()
            .into_iter()
            .map(|set| set.into_iter().collect())
            .collect()
    }

    #[test]
    fn a_chain_starts_one_by_one() {
        let chain = needs(&[("a", &[]), ("b", &["a"]), ("c", &["b", "a"])]);
        assert_eq!(chain, [vec![], vec![0], vec![0, 1]]);
    }

    #[test]
    fn a_cycle_starts_together_after_what_any_of_it_needs() {
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
    fn limits_have_defaults_in_json() {
        let text = r#"{"network":"n","ddsl":"n.ddsl","components":[{"name":"a","executable":"/x","directory":"/"}]}"#;
        let plan: Plan = serde_json::from_str(text).expect("a plan");
        assert_eq!(plan.components[0], Component::new("a", "/x", "/"));
    }
}
