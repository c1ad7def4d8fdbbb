//! What a picture shows. `--format json` prints it as it is.

use rc_deploy_network::topology::{Connection, End, Host, Kind};
use rc_diagnostics::Severity;
use serde::Serialize;
use std::path::PathBuf;

/// A network as a picture.
#[derive(Clone, Debug, Serialize)]
pub struct Graph {
    /// Its name.
    pub network: String,
    /// The file that describes it.
    pub ddsl: PathBuf,
    /// The machines on which something runs; this one, unless it is named otherwise, is
    /// `localhost`.
    pub hosts: Vec<Host>,
    /// The groups, each before those inside it.
    pub groups: Vec<Group>,
    /// The components, in the order of the file.
    pub components: Vec<Component>,
    /// Who talks to whom, also where that was refused.
    pub connections: Vec<Connection>,
    /// What the check has found, in the order of places.
    pub findings: Vec<Finding>,
}

/// A group.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// Its name with those of the groups that it is in.
    pub name: String,
    /// The whole name of the group that it is in.
    pub parent: Option<String>,
    /// What it lets out.
    pub exports: Vec<String>,
}

/// A component.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Its name with those of the groups that it is in.
    pub name: String,
    /// What it is called in its `.cdsl`, where that could be read.
    pub component: Option<String>,
    /// The whole name of the group that it is in.
    pub group: Option<String>,
    /// The name of its host.
    pub host: String,
    /// The middleware of its slots that choose none.
    pub middleware: &'static str,
    /// Its slots, in the order of its `.cdsl`.
    pub slots: Vec<Slot>,
}

/// A slot.
#[derive(Clone, Debug, Serialize)]
pub struct Slot {
    /// Its name.
    pub name: String,
    /// What is said: `Module::Interface`.
    pub interface: String,
    /// `implements`, `requires`, `publishes` or `subscribesTo`.
    pub role: &'static str,
    /// Its middleware.
    pub middleware: &'static str,
}

/// Something that the check has found.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Its stable code.
    pub code: &'static str,
    /// `error`, `warning` or `note`.
    pub severity: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    /// In which file.
    pub file: PathBuf,
    /// In which line, from 1.
    pub line: usize,
    /// In which column, from 1.
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
    /// What it is called in its `.cdsl`, where that is not its own name.
    pub(crate) fn kind(&self) -> Option<&str> {
        let own = Graph::own_name(&self.name);
        self.component.as_deref().filter(|kind| *kind != own)
    }
}

impl Graph {
    /// Whether the network may be used.
    pub fn has_errors(&self) -> bool {
        let error = Severity::Error.name();
        self.findings.iter().any(|f| f.severity == error)
    }

    /// The part of a whole name that a component or group has by itself.
    pub(crate) fn own_name(name: &str) -> &str {
        name.rsplit('.').next().unwrap_or(name)
    }
}

/// What both ends call it.
pub(crate) fn connection_name(connection: &Connection) -> String {
    if connection.from.slot == connection.to.slot {
        connection.from.slot.clone()
    } else {
        format!("{} → {}", connection.from.slot, connection.to.slot)
    }
}

/// The whole of it as a sentence.
pub(crate) fn sentence(connection: &Connection) -> String {
    let verb = match connection.kind {
        Kind::Call => "calls",
        Kind::Topic => "sends to",
    };
    let address = connection.address.as_ref();
    let address = address.map_or("refused".to_owned(), |a| format!("at {a}"));
    format!(
        "{}.{} {verb} {}.{}: {} over {}, {address}",
        connection.from.component,
        connection.from.slot,
        connection.to.component,
        connection.to.slot,
        connection.interface,
        connection.middleware
    )
}

/// The ends as numbers of components and slots: who provides, and who consumes.
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
