//! The contents of a picture. `--format json` prints them as they are.

use rc_deploy_network::chains::ChainReport;
use rc_deploy_network::topology::{Connection, End, Host, Kind};
use rc_diagnostics::Severity;
use rc_smdsl::StateMachine;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A network as a picture.
#[derive(Clone, Debug, Serialize)]
pub struct Graph {
    /// Name of the network.
    pub network: String,
    /// The file that describes it.
    pub ddsl: PathBuf,
    /// The machines with components. This machine is `localhost` unless it has a name.
    pub hosts: Vec<Host>,
    /// The component that publishes the network's time. `None`: all have their own clocks.
    pub time: Option<String>,
    /// The groups, each before those inside it.
    pub groups: Vec<Group>,
    /// The components, in the order of the file.
    pub components: Vec<Component>,
    /// The connections, including refused ones.
    pub connections: Vec<Connection>,
    /// The chains, with their worst cases.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub chains: Vec<ChainReport>,
    /// The findings of the check, in the order of positions.
    pub findings: Vec<Finding>,
}

/// A group.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// Name with those of its groups.
    pub name: String,
    /// The full name of the group that contains it.
    pub parent: Option<String>,
    /// The slots that it exports.
    pub exports: Vec<String>,
}

/// A component.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Name with those of its groups.
    pub name: String,
    /// Name in its `.cdsl`, if that could be read.
    pub component: Option<String>,
    /// The full name of the group that contains it.
    pub group: Option<String>,
    /// The name of its host.
    pub host: String,
    /// The process whose thread it is, unless it has one of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub process: Option<String>,
    /// The middleware of its slots that name none.
    pub middleware: &'static str,
    /// Clock: `system`, `simulated`, `source` or `ros`.
    pub clock: &'static str,
    /// Whether it is a peer that is not part of the network. Its name is its address.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub external: bool,
    /// Present state of the component, in the picture of a running network.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub live: Option<Live>,
    /// States and transitions, for the drawing.
    #[serde(skip)]
    pub machine: Option<StateMachine>,
    /// Slots, in the order of its `.cdsl`.
    pub slots: Vec<Slot>,
}

/// State of a running component.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Live {
    /// `running`, or another state of its process.
    pub state: String,
    /// The active states of its machine without substates, each with its ancestors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<String>,
    /// The messages of its slots in a second; silent slots are left out.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub rates_hz: BTreeMap<String, f64>,
    /// The samples that its slots have lost in this run; slots without loss are left out.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub lost: BTreeMap<String, u64>,
}

/// How many rates, and how many losses, a picture shows of a component.
const SHOWN: usize = 3;

impl Live {
    fn text(&self) -> String {
        let state = if self.states.is_empty() {
            self.state.clone()
        } else {
            format!("{} in {}", self.state, self.states.join(", "))
        };
        let mut rates: Vec<(&String, &f64)> = self.rates_hz.iter().collect();
        rates.sort_by(|(_, one), (_, other)| other.total_cmp(one));
        let rates = rates.into_iter().take(SHOWN);
        let rates = rates.map(|(slot, rate)| format!("{slot} {rate} Hz"));
        let lost = self.lost.iter().take(SHOWN);
        let lost = lost.map(|(slot, lost)| format!("{slot} lost {lost}"));
        let parts: Vec<String> = std::iter::once(state).chain(rates).chain(lost).collect();
        parts.join(", ")
    }
}

/// A slot.
#[derive(Clone, Debug, Serialize)]
pub struct Slot {
    /// Name of the slot, unique in the component.
    pub name: String,
    /// The interface: `Module::Interface`.
    pub interface: String,
    /// Which end of a connection it is.
    pub role: Role,
    /// Middleware of the slot.
    pub middleware: &'static str,
    /// Whether it needs no peer.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub optional: bool,
}

/// A finding of the check.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Code of the finding; it never changes.
    pub code: &'static str,
    /// `error`, `warning` or `note`.
    pub severity: &'static str,
    /// The message.
    pub message: String,
    /// Advice.
    pub help: Option<String>,
    /// The file.
    pub file: PathBuf,
    /// The line, from 1.
    pub line: usize,
    /// The column, from 1.
    pub column: usize,
    /// The components concerned.
    pub components: Vec<String>,
    /// The slots concerned.
    pub slots: Vec<End>,
    /// The connections concerned: indices into the list of connections.
    pub connections: Vec<usize>,
    /// The group concerned.
    pub group: Option<String>,
    /// The host concerned.
    pub host: Option<String>,
}

impl Component {
    /// Name in its `.cdsl`, if it differs from its own name, its process, if it is a thread of one,
    /// its part in the network's time, if it has one, and its present state.
    pub(crate) fn kind(&self) -> Option<String> {
        if self.external {
            return Some("external".to_owned());
        }
        let own = Graph::own_name(&self.name);
        let kind = self.component.as_deref().filter(|kind| *kind != own);
        let clock = match self.clock {
            "source" => Some("publishes time"),
            "ros" => Some("time of /clock"),
            _ => None,
        };
        let live = self.live.as_ref().map(Live::text);
        let process = self
            .process
            .as_ref()
            .map(|name| format!("in process {name}"));
        let parts = kind
            .into_iter()
            .chain(process.as_deref())
            .chain(clock)
            .chain(live.as_deref());
        let parts: Vec<&str> = parts.collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}

impl Graph {
    /// Notes what components do now, by their full names. Others do not run.
    pub fn set_live(&mut self, mut live: BTreeMap<String, Live>) {
        for component in self.components.iter_mut().filter(|c| !c.external) {
            let now = live.remove(&component.name);
            component.live = Some(now.unwrap_or_else(|| Live {
                state: "not running".to_owned(),
                ..Live::default()
            }));
        }
    }

    /// Whether the check found errors.
    pub fn has_errors(&self) -> bool {
        let error = Severity::Error.name();
        self.findings.iter().any(|f| f.severity == error)
    }

    /// The last part of a full name.
    pub(crate) fn own_name(name: &str) -> &str {
        name.rsplit('.').next().unwrap_or(name)
    }
}

/// The name of a connection: its slot, or both slots if they differ.
fn connection_name(connection: &Connection) -> String {
    if connection.from.slot == connection.to.slot {
        connection.from.slot.clone()
    } else {
        format!("{} → {}", connection.from.slot, connection.to.slot)
    }
}

/// How many conversions a label lists.
const LISTED: usize = 3;

/// The chains whose messages a connection carries, in words.
fn chains(connection: &Connection) -> Option<String> {
    let chains = connection.chains.iter().take(LISTED).map(String::as_str);
    let mut listed = chains.collect::<Vec<_>>().join(", ");
    if connection.chains.len() > LISTED {
        listed += &format!(" and {} more", connection.chains.len() - LISTED);
    }
    (!listed.is_empty()).then(|| format!("chain {listed}"))
}

/// The colours of chains, in turn: those of Okabe and Ito (2008) that are far from the colours of
/// findings.
const CHAIN_COLOURS: [&str; 4] = ["#0072b2", "#009e73", "#cc79a7", "#56b4e9"];

/// The colour of a connection on a chain: that of its first one.
pub(crate) fn chain_colour(graph: &Graph, connection: &Connection) -> Option<&'static str> {
    let first = connection.chains.first()?;
    let number = graph.chains.iter().position(|chain| chain.name == *first)?;
    Some(CHAIN_COLOURS[number % CHAIN_COLOURS.len()])
}

/// The label of a connection: its name, its middleware, and its conversion.
pub(crate) fn label(connection: &Connection) -> String {
    let mut label = format!("{}\n{}", connection_name(connection), connection.middleware);
    for member in connection.converts.iter().take(LISTED) {
        label += &format!("\nconverts {member}");
    }
    if connection.converts.len() > LISTED {
        label += &format!("\nconverts {} more", connection.converts.len() - LISTED);
    }
    label.extend(chains(connection).map(|chains| format!("\n{chains}")));
    label
}

/// A connection as a sentence.
pub(crate) fn sentence(connection: &Connection) -> String {
    let verb = match connection.kind {
        Kind::Call => "calls",
        Kind::Topic => "sends to",
    };
    let end = |end: &End| {
        if end.external {
            "an external peer".to_owned()
        } else {
            format!("{}.{}", end.component, end.slot)
        }
    };
    let address = connection.address.as_ref();
    let address = address.map_or("refused".to_owned(), |a| format!("at {a}"));
    let converts = if connection.converts.is_empty() {
        String::new()
    } else {
        format!(", converts {}", connection.converts.join("; "))
    };
    let chains = chains(connection).map_or_else(String::new, |chains| format!(", {chains}"));
    format!(
        "{} {verb} {}: {} over {}, {address}{converts}{chains}",
        end(&connection.from),
        end(&connection.to),
        connection.interface,
        connection.middleware
    )
}

/// The endpoints as indices of components and slots: provider, then consumer.
pub(crate) fn provider_and_consumer(connection: &Connection) -> ((usize, usize), (usize, usize)) {
    match connection.kind {
        Kind::Call => (connection.to.at, connection.from.at),
        Kind::Topic => (connection.from.at, connection.to.at),
    }
}

/// `host robot (pi@10.0.0.2)`
pub(crate) fn host_title(host: &Host) -> String {
    let user = host
        .user
        .as_ref()
        .map_or(String::new(), |u| format!("{u}@"));
    if host.name == host.address && user.is_empty() {
        format!("host {}", host.name)
    } else {
        format!("host {} ({user}{})", host.name, host.address)
    }
}

#[cfg(test)]
mod tests {
    use super::Live;

    #[test]
    fn a_running_component_has_the_highest_rates_and_its_losses() {
        let live = Live {
            state: "running".to_owned(),
            states: vec!["idle".to_owned()],
            rates_hz: [("a", 1.0), ("b", 30.5), ("c", 2.0), ("d", 4.0)]
                .map(|(slot, rate)| (slot.to_owned(), rate))
                .into(),
            lost: [("b".to_owned(), 7)].into(),
        };
        assert_eq!(
            live.text(),
            "running in idle, b 30.5 Hz, d 4 Hz, c 2 Hz, b lost 7"
        );
    }
}
