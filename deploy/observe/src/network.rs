//! A running network, from the descriptions of its components.

use crate::error::Error;
use crate::lookup::find;
use crate::reach::is_inside_process;
use rc_deploy_client::{by_hand, connection, names, place};
use rc_diagnostics::foreign::clean;
use rc_management::component::{Request, Role, Status};
use rc_management::observation::{Described, OperationDescription, SlotDescription};
use rc_management::{CallError, Client};
use rc_middleware::RunDirectory;
use rc_values::description::Module;
use rc_values::{Catalog, Interface};
use rc_vocabulary::Middleware;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// How long a component may take to reply.
const LIMIT: Duration = Duration::from_secs(4);
/// How many components are asked at a time.
const AT_A_TIME: usize = 16;

/// A running network.
#[derive(Debug)]
pub struct Network {
    /// Name of the network.
    pub name: String,
    /// The components that reply, by name.
    pub components: Vec<Component>,
    /// Errors of the components that give no description.
    pub silent: Vec<String>,
}

/// A running component.
#[derive(Debug)]
pub struct Component {
    /// Name of the component in the network.
    pub name: String,
    /// The machine on which it runs, if that is not this one.
    pub host: Option<String>,
    /// Description of the component's connections.
    pub described: Described,
    /// Status at the same time.
    pub status: Status,
    /// Types of the component's messages.
    pub catalog: Arc<Catalog>,
}

/// An end of a connection.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct End {
    /// The component.
    pub component: String,
    /// The slot.
    pub slot: String,
    /// The machine, if it is not this one.
    pub host: Option<String>,
    /// The middlewares of its connections.
    pub middlewares: Vec<String>,
}

/// A topic.
#[derive(Clone, Debug)]
pub struct Topic {
    /// Where its ends meet, with the name of the operation.
    pub address: String,
    /// The middleware.
    pub middleware: String,
    /// The settings of the middleware at one of the ends.
    pub settings: BTreeMap<String, String>,
    /// The interface.
    pub interface: Arc<Interface>,
    /// The operation.
    pub operation: rc_values::Operation,
    /// The endpoint's description of the operation: quality of service, and the type in ROS 2.
    pub description: OperationDescription,
    /// The publishers.
    pub publishers: Vec<End>,
    /// The subscribers.
    pub subscribers: Vec<End>,
}

/// The calls of an interface at one address.
#[derive(Clone, Debug)]
pub struct Service {
    /// Where its ends meet.
    pub address: String,
    /// The middleware.
    pub middleware: String,
    /// The interface.
    pub interface: Arc<Interface>,
    /// The servers: one, if all is well.
    pub servers: Vec<End>,
    /// The clients.
    pub clients: Vec<End>,
}

/// An operation that can be called.
#[derive(Clone, Debug)]
pub struct Operation {
    /// The end that replies.
    pub server: End,
    /// The ends that call.
    pub clients: Vec<End>,
    /// The operation.
    pub operation: rc_values::Operation,
}

impl Component {
    /// Whether it has a replica of the network's shared world. One that shares the world of any network
    /// has none where there is no world.
    pub fn has_world(&self) -> bool {
        !self.described.world.is_empty() || self.status.world.is_some()
    }
}

impl End {
    /// Whether its messages do not leave its process: tools reach it by its management alone.
    pub(crate) fn is_inside(&self) -> bool {
        let mut all = self.middlewares.iter();
        !self.middlewares.is_empty() && all.all(|middleware| is_inside_process(middleware))
    }

    /// Whether its messages also take this middleware. The topics of time name none: they take that of
    /// the topic.
    pub(crate) fn meets_over(&self, middleware: &str) -> bool {
        self.middlewares.is_empty() || self.middlewares.iter().any(|own| own == middleware)
    }
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.component, self.slot)
    }
}

/// The management socket of a component. Dots of a name become `-` there.
pub(crate) fn socket(network: &str, component: &str) -> PathBuf {
    place::directory(network).socket(&component.replace('.', "-"))
}

/// Connects to a component.
pub(crate) fn connect(network: &str, component: &str, limit: Duration) -> Result<Client, Error> {
    Client::connect(&socket(network, component), limit).map_err(|error| {
        let (component, reason) = (component.to_owned(), error.to_string());
        match error.kind() {
            ErrorKind::NotFound | ErrorKind::ConnectionRefused => {
                Error::NoServer { component, reason }
            }
            _ => Error::Component { component, reason },
        }
    })
}

pub(crate) fn failed(component: &str, error: &CallError) -> Error {
    let reason = match error {
        CallError::Refused(error) => error.message.clone(),
        other @ (CallError::Io(_)
        | CallError::TimedOut(_)
        | CallError::Closed
        | CallError::Unexpected(_)) => other.to_string(),
    };
    Error::Component {
        component: component.to_owned(),
        reason,
    }
}

impl Network {
    /// Asks all components of a network, also those on other machines, for their descriptions.
    pub fn look(network: &str) -> Result<Self, Error> {
        names::check_name("network", network).map_err(|error| Error::system("the name", &error))?;
        let hosts = hosts(network);
        let directory = place::directory(network);
        let (mut components, mut silent) = (Vec::new(), Vec::new());
        for (name, found) in ask(&directory, &by_hand::sockets(&directory, []), &hosts) {
            match found {
                Ok(Some(component)) => components.push(component),
                // A component that was killed leaves its socket.
                Ok(None) => {}
                Err(reason) => silent.push(format!("{name}: {reason}")),
            }
        }
        silent.sort();
        components.sort_by(|a, b| a.name.cmp(&b.name));
        if components.is_empty() && silent.is_empty() {
            return Err(not_running(network));
        }
        Ok(Self {
            name: network.to_owned(),
            components,
            silent,
        })
    }

    /// A component.
    pub fn component(&self, name: &str) -> Option<&Component> {
        self.components.iter().find(|c| c.name == name)
    }

    fn slots(&self) -> impl Iterator<Item = (&Component, &SlotDescription, End)> {
        self.components.iter().flat_map(|component| {
            component.described.slots.iter().map(move |slot| {
                let end = End {
                    component: component.name.clone(),
                    slot: slot.name.clone(),
                    host: component.host.clone(),
                    middlewares: middlewares(slot).map(str::to_owned).collect(),
                };
                (component, slot, end)
            })
        })
    }

    /// For each address, the middlewares that are one place there: an end has connections over all
    /// of them. The first one is that which tools use.
    fn meetings(&self) -> BTreeMap<&str, Vec<Vec<&str>>> {
        let mut all: BTreeMap<&str, Vec<Vec<&str>>> = BTreeMap::new();
        for (_, slot, _) in self.slots() {
            let Some(address) = slot.address.as_deref() else {
                continue;
            };
            let mut own: Vec<&str> = middlewares(slot).collect();
            let here = all.entry(address).or_default();
            let (joined, mut others): (Vec<_>, Vec<_>) = here
                .drain(..)
                .partition(|one| one.iter().any(|middleware| own.contains(middleware)));
            own.extend(joined.into_iter().flatten());
            own.sort_by_key(|word| (rank(word), *word));
            own.dedup();
            others.push(own);
            *here = others;
        }
        all
    }

    /// The topics, by address.
    pub fn topics(&self) -> Vec<Topic> {
        let meetings = self.meetings();
        let mut topics: BTreeMap<(String, String), Topic> = BTreeMap::new();
        for (component, slot, end) in self.slots() {
            let sends = match slot.role {
                Role::Publishes => true,
                Role::SubscribesTo => false,
                Role::Implements | Role::Requires => continue,
            };
            let interface = component.catalog.interface(&slot.interface);
            let Some((interface, address)) = interface.zip(slot.address.as_deref()) else {
                continue;
            };
            let middleware = met(&meetings, address, &slot.middleware);
            for description in &slot.operations {
                let Some(operation) = interface.operation(&description.name) else {
                    continue;
                };
                let address = format!("{address}/{}", description.name);
                let key = (address.clone(), middleware.to_owned());
                let topic = topics.entry(key).or_insert_with(|| Topic {
                    address,
                    middleware: middleware.to_owned(),
                    settings: BTreeMap::new(),
                    interface: Arc::clone(interface),
                    operation: operation.clone(),
                    description: description.clone(),
                    publishers: Vec::new(),
                    subscribers: Vec::new(),
                });
                if let Some(own) = component.described.middlewares.get(middleware)
                    && topic.settings.is_empty()
                {
                    topic.settings.clone_from(own);
                }
                if sends {
                    // The publisher's offer counts.
                    topic.description = description.clone();
                    topic.operation = operation.clone();
                    topic.publishers.push(end.clone());
                } else {
                    topic.subscribers.push(end.clone());
                }
            }
        }
        topics.into_values().collect()
    }

    /// The services, by address.
    pub fn services(&self) -> Vec<Service> {
        let meetings = self.meetings();
        let mut services: BTreeMap<(String, String), Service> = BTreeMap::new();
        for (component, slot, end) in self.slots() {
            let serves = match slot.role {
                Role::Implements => true,
                Role::Requires => false,
                Role::Publishes | Role::SubscribesTo => continue,
            };
            let interface = component.catalog.interface(&slot.interface);
            let Some((interface, address)) = interface.zip(slot.address.clone()) else {
                continue;
            };
            let middleware = met(&meetings, &address, &slot.middleware).to_owned();
            let key = (address.clone(), middleware.clone());
            let service = services.entry(key).or_insert_with(|| Service {
                address,
                middleware,
                interface: Arc::clone(interface),
                servers: Vec::new(),
                clients: Vec::new(),
            });
            if serves {
                // The server's operations count.
                service.interface = Arc::clone(interface);
                service.servers.push(end);
            } else {
                service.clients.push(end);
            }
        }
        services.into_values().collect()
    }

    /// The topic that a name means: `COMPONENT.SLOT.OPERATION` of one of its ends, its address, or
    /// an end of these.
    pub fn topic(&self, wanted: &str) -> Result<Topic, Error> {
        let topics = self.topics();
        find(&self.name, "topic", wanted, &topics, Topic::names).cloned()
    }

    /// The operation that a name means: `COMPONENT.SLOT.OPERATION`, or an end of it.
    pub fn operation(&self, wanted: &str) -> Result<Operation, Error> {
        let operations = self.operations();
        let name = |operation: &Operation| vec![operation.name()];
        find(&self.name, "operation", wanted, &operations, name).cloned()
    }

    /// All operations that can be called.
    pub fn operations(&self) -> Vec<Operation> {
        let services = self.services();
        let servers = services.iter().flat_map(|service| {
            let ends = service.servers.iter();
            ends.flat_map(move |server| {
                let operations = service.interface.operations.iter();
                operations.map(move |operation| Operation {
                    server: server.clone(),
                    clients: service.clients.clone(),
                    operation: operation.clone(),
                })
            })
        });
        servers.collect()
    }
}

impl Topic {
    /// The names of the topic, the shortest whole one first.
    pub fn names(&self) -> Vec<String> {
        let ends = self.publishers.iter().chain(&self.subscribers);
        let names = ends.map(|end| format!("{end}.{}", self.operation.name));
        names.chain([self.address.clone()]).collect()
    }

    /// The name that is shown.
    pub fn name(&self) -> String {
        self.names().into_iter().next().unwrap_or_default()
    }
}

impl Operation {
    /// The whole name.
    pub fn name(&self) -> String {
        format!("{}.{}", self.server, self.operation.name)
    }
}

/// The middlewares of a slot.
fn middlewares(slot: &SlotDescription) -> impl Iterator<Item = &str> {
    let further = slot.further.iter().map(String::as_str);
    std::iter::once(slot.middleware.as_str()).chain(further)
}

/// The middleware by which tools know a place where ends meet.
fn met<'n>(
    meetings: &BTreeMap<&str, Vec<Vec<&'n str>>>,
    address: &str,
    middleware: &'n str,
) -> &'n str {
    let all = meetings.get(address).into_iter().flatten();
    let own = all.into_iter().find(|one| one.contains(&middleware));
    own.and_then(|one| one.first().copied())
        .unwrap_or(middleware)
}

/// The order of middlewares for tools.
fn rank(word: &str) -> usize {
    let mut all = Middleware::ALL.iter();
    let known = all.position(|one| one.word() == word);
    known.unwrap_or(Middleware::ALL.len())
}

/// The machines of components that do not run on this one, as the supervisor knows them, by the name
/// that a component has in its socket: that of one in a group has no dots there.
fn hosts(network: &str) -> BTreeMap<String, String> {
    let Ok(status) = connection::status(network) else {
        return BTreeMap::new();
    };
    let components = status.components.into_iter();
    let remote = components
        .filter_map(|component| Some((component.name.replace('.', "-"), component.host?)));
    remote.collect()
}

/// A component, `None` if no process listens, or the reason why it has no description.
type Found = Result<Option<Component>, String>;

/// Asks components, several at a time: one that hangs delays no other.
fn ask(
    directory: &RunDirectory,
    names: &[String],
    hosts: &BTreeMap<String, String>,
) -> Vec<(String, Found)> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        while let Some(name) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
            found.push((name.clone(), component(directory, name, hosts)));
        }
        found
    };
    std::thread::scope(|scope| {
        let others = names.len().min(AT_A_TIME).saturating_sub(1);
        let others: Vec<_> = (0..others).map(|_| scope.spawn(work)).collect();
        let mut found = work();
        for other in others {
            found.extend(other.join().unwrap_or_default());
        }
        found
    })
}

fn component(directory: &RunDirectory, name: &str, hosts: &BTreeMap<String, String>) -> Found {
    let deadline = Instant::now() + LIMIT;
    let left = || deadline.saturating_duration_since(Instant::now());
    let Ok(mut client) = Client::connect(&directory.socket(name), LIMIT) else {
        return Ok(None);
    };
    let text = |error: CallError| error.to_string();
    let described: Described = client.call(&Request::Describe, left()).map_err(text)?;
    // Its name becomes the path of its socket again.
    let own = &described.name;
    if names::check_name("component", own).is_err() || own.replace('.', "-") != name {
        return Err(format!("it calls itself `{}`", clean(own)));
    }
    let status: Status = client.call(&Request::Status, left()).map_err(text)?;
    let modules = described.types.iter();
    let modules = modules.map(|module| serde_json::from_value(module.clone()));
    let modules: Vec<Module> = modules
        .collect::<Result<_, _>>()
        .map_err(|error| format!("its description cannot be read: {error}"))?;
    let catalog = Catalog::new(&modules).map_err(|error| error.to_string())?;
    Ok(Some(Component {
        host: hosts.get(name).cloned(),
        name: described.name.clone(),
        described,
        status,
        catalog: Arc::new(catalog),
    }))
}

/// The error about a network that does not run, with those that do.
fn not_running(network: &str) -> Error {
    let mut known = connection::networks();
    known.extend(by_hand::networks());
    known.retain(|known| known != network);
    // A network with a supervisor may be in both.
    known.sort_unstable();
    known.dedup();
    let help = match rc_diagnostics::nearest(network, known.iter().map(String::as_str)) {
        Some(near) => format!("; did you mean `{near}`?"),
        None if known.is_empty() => String::new(),
        None => format!("; these networks run: {}", known.join(", ")),
    };
    Error::NotRunning {
        network: network.to_owned(),
        help,
    }
}
