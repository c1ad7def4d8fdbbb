//! Offers of the network to clients: channels, services, parameters and its graph.

use crate::frames::Frames;
use crate::graph::Graph;
use crate::poll::Snapshot;
use crate::protocol;
use crate::shapes::{Shape, shapes};
use crate::world::Part;
use rc_observe::{Component, End, Network, Operation, SendingClock, Topic};
use rc_record::{Schema, schema};
use rc_values::{Interface, Struct};
use serde_json::{Value as Json, json};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Where the messages of channels come from.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Source {
    /// A topic.
    Topic {
        address: String,
        middleware: String,
        hash: u64,
    },
    /// The calls of a slot, which this process copies.
    Calls {
        component: String,
        slot: String,
        pid: u32,
    },
    /// The world that the components share.
    World,
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Topic { address, .. } => f.write_str(address),
            Self::Calls {
                component, slot, ..
            } => write!(f, "{component}.{slot}"),
            Self::World => f.write_str("the world"),
        }
    }
}

/// The form of the messages of a source.
#[derive(Clone)]
pub(crate) enum Reading {
    Topic(Box<Topic>),
    Calls {
        interface: Arc<Interface>,
        /// Whether the component is on this machine.
        is_here: bool,
    },
}

impl Reading {
    /// Whether all senders are on this machine, so that their monotonic clock is the one here.
    pub(crate) fn is_here(&self) -> bool {
        match self {
            Self::Topic(topic) => topic.sending_clock() == SendingClock::Here,
            Self::Calls { is_here, .. } => *is_here,
        }
    }
}

/// Form in which a channel shows the messages of its source.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Form {
    /// The samples.
    Sample,
    /// The requests of the operation with this number.
    Request(i32),
    /// Replies of that operation.
    Reply(i32),
    /// A member of the samples in a schema of Foxglove.
    Shape(Shape, usize),
    /// A member of the results of an operation in a schema of Foxglove.
    ShapeOfResult(i32, Shape, usize),
    /// A part of the world.
    World(Part),
}

/// Channel to which clients subscribe.
pub(crate) struct Channel {
    pub(crate) topic: String,
    pub(crate) schema: Schema,
    pub(crate) sources: Vec<Source>,
    pub(crate) form: Form,
    /// The frame of a measured value.
    pub(crate) frame: String,
}

/// Service that clients call.
pub(crate) struct Service {
    pub(crate) operation: Operation,
    advertisement: Json,
}

/// A parameter.
pub(crate) struct Parameter {
    pub(crate) component: String,
    pub(crate) path: String,
    pub(crate) value: Json,
}

/// A channel, or a service, whatever process is at its other end.
type Key = (String, String, u64, Form);

/// Offers of the network.
#[derive(Default)]
pub(crate) struct Offers {
    pub(crate) channels: BTreeMap<u64, Channel>,
    pub(crate) readings: BTreeMap<Source, Reading>,
    pub(crate) services: BTreeMap<u32, Service>,
    pub(crate) parameters: BTreeMap<String, Parameter>,
    pub(crate) graph: Graph,
    ids: BTreeMap<Key, u64>,
    service_ids: BTreeMap<(String, u64), u32>,
    /// Numbers are not used again.
    next: u32,
}

/// Documents that clients get after a poll.
#[derive(Default)]
pub(crate) struct Change {
    /// Messages to all clients.
    pub(crate) documents: Vec<Json>,
    /// The parameters whose values are others.
    pub(crate) parameters: BTreeSet<String>,
    /// The message to those that watch the graph.
    pub(crate) graph: Option<Json>,
}

impl Offers {
    /// Takes what was found. `frames` are those of topics, by name; unknown names are skipped.
    pub(crate) fn update(
        &mut self,
        snapshot: &Snapshot,
        frames: &[(String, String)],
        read_only: bool,
    ) -> Change {
        let network = &snapshot.network;
        let frames = Frames::find(network, frames);
        let (mut channels, mut readings) = (BTreeMap::new(), BTreeMap::new());
        let mut graph = Graph::default();
        let topics = network.topics();
        if network.components.iter().any(Component::has_world) {
            for part in Part::ALL {
                let (topic, form) = (part.topic().to_owned(), Form::World(part));
                let id = self.id(topic.clone(), "", 0, &form);
                let channel = Channel {
                    topic,
                    schema: part.schema(),
                    sources: vec![Source::World],
                    form,
                    frame: String::new(),
                };
                channels.insert(id, channel);
            }
        }
        for topic in topics {
            self.topic(topic, &frames, &mut channels, &mut readings, &mut graph);
        }
        let mut services = BTreeMap::new();
        for service in network.services() {
            self.calls(network, &service, &frames, &mut channels, &mut readings);
            for server in &service.servers {
                for operation in &service.interface.operations {
                    let name = format!("/{}/{}", service.address, operation.name);
                    let ends = graph.services.entry(name.clone()).or_default();
                    ends.insert(server.component.clone());
                    let operation = Operation {
                        server: server.clone(),
                        clients: service.clients.clone(),
                        operation: operation.clone(),
                    };
                    if !read_only {
                        self.service(&name, operation, &service.interface.name, &mut services);
                    }
                }
            }
        }
        let mut change = Change::default();
        self.replace_channels(channels, &mut change);
        self.replace_services(services, &mut change);
        self.readings = readings;
        change.graph = self.graph.update_to(&graph);
        self.graph = graph;
        change.parameters = self.replace_parameters(parameters(snapshot));
        change
    }

    fn topic(
        &mut self,
        topic: Topic,
        frames: &Frames,
        channels: &mut BTreeMap<u64, Channel>,
        readings: &mut BTreeMap<Source, Reading>,
        graph: &mut Graph,
    ) {
        let name = format!("/{}", topic.address);
        let components = |ends: &[End]| ends.iter().map(|end| end.component.clone()).collect();
        if !topic.publishers.is_empty() {
            let all = components(&topic.publishers);
            graph.published.insert(name.clone(), all);
        }
        if !topic.subscribers.is_empty() {
            let all = components(&topic.subscribers);
            graph.subscribed.insert(name.clone(), all);
        }
        let source = Source::Topic {
            address: topic.address.clone(),
            middleware: topic.middleware.clone(),
            hash: topic.operation.hash,
        };
        let mut ends = topic.publishers.iter().chain(&topic.subscribers);
        let frame = frames.of(&name, ends.next());
        let operation = &topic.operation;
        let external = topic.description.external_type.as_deref();
        let plain = schema::sample(&topic.interface.name, operation, external);
        let mut forms = vec![(name.clone(), plain, Form::Sample)];
        for (shape, at) in shapes(&operation.request) {
            let name = format!("{name}/{}", shape.word());
            forms.push((name, shape.schema(), Form::Shape(shape, at)));
        }
        for (name, schema, form) in forms {
            let id = self.id(name.clone(), &topic.middleware, operation.hash, &form);
            let channel = Channel {
                topic: name,
                schema,
                sources: vec![source.clone()],
                form,
                frame: frame.clone(),
            };
            channels.insert(id, channel);
        }
        readings.insert(source, Reading::Topic(Box::new(topic)));
    }

    /// The calls of a service, copied by its server; by its clients if no component of the network
    /// serves them.
    fn calls(
        &mut self,
        network: &Network,
        service: &rc_observe::Service,
        frames: &Frames,
        channels: &mut BTreeMap<u64, Channel>,
        readings: &mut BTreeMap<Source, Reading>,
    ) {
        let ends = if service.servers.is_empty() {
            &service.clients
        } else {
            &service.servers
        };
        let sources = ends.iter().filter_map(|end| {
            Some(Source::Calls {
                component: end.component.clone(),
                slot: end.slot.clone(),
                pid: network.component(&end.component)?.described.pid,
            })
        });
        let sources: Vec<Source> = sources.collect();
        let interface = &service.interface;
        let is_here = ends.iter().all(|end| end.host.is_none());
        for source in &sources {
            let interface = Arc::clone(interface);
            readings.insert(source.clone(), Reading::Calls { interface, is_here });
        }
        for operation in &interface.operations {
            let name = format!("/{}/{}", service.address, operation.name);
            let frame = frames.of(&name, ends.first());
            let request = schema::request(&interface.name, operation);
            let mut forms = vec![(
                format!("{name}/_request"),
                request,
                Form::Request(operation.id),
            )];
            if operation.pattern == rc_values::Pattern::Query {
                let reply = schema::reply(&interface.name, operation);
                forms.push((format!("{name}/_reply"), reply, Form::Reply(operation.id)));
                forms.extend(results(&name, operation.id, &operation.reply));
            }
            for (name, schema, form) in forms {
                let id = self.id(name.clone(), &service.middleware, operation.hash, &form);
                let channel = Channel {
                    topic: name,
                    schema,
                    sources: sources.clone(),
                    form,
                    frame: frame.clone(),
                };
                channels.insert(id, channel);
            }
        }
    }

    fn service(
        &mut self,
        name: &str,
        operation: Operation,
        interface: &str,
        services: &mut BTreeMap<u32, Service>,
    ) {
        let request = schema::request(interface, &operation.operation);
        let reply = schema::reply(interface, &operation.operation);
        // `package/msg/NAME_Request` is a part of `package/srv/NAME`.
        let ty = request.name.replace("/msg/", "/srv/");
        let ty = ty.strip_suffix("_Request").unwrap_or(&ty);
        let key = (name.to_owned(), operation.operation.hash);
        let id = *self.service_ids.entry(key).or_insert_with(|| {
            self.next += 1;
            self.next
        });
        // The first server of an address is called.
        services.entry(id).or_insert_with(|| Service {
            advertisement: protocol::service(id, name, ty, &request, &reply),
            operation,
        });
    }

    fn id(&mut self, topic: String, middleware: &str, hash: u64, form: &Form) -> u64 {
        let key = (topic, middleware.to_owned(), hash, form.clone());
        *self.ids.entry(key).or_insert_with(|| {
            self.next += 1;
            u64::from(self.next)
        })
    }

    fn replace_channels(&mut self, channels: BTreeMap<u64, Channel>, change: &mut Change) {
        let gone = self.channels.keys().filter(|id| !channels.contains_key(id));
        let gone: Vec<u64> = gone.copied().collect();
        let new = channels
            .iter()
            .filter(|(id, _)| !self.channels.contains_key(id));
        let new: Vec<Json> = new
            .map(|(id, channel)| channel.advertisement(*id))
            .collect();
        self.channels = channels;
        self.ids.retain(|_, id| self.channels.contains_key(id));
        if !gone.is_empty() {
            let document = json!({"op": "unadvertise", "channelIds": gone});
            change.documents.push(document);
        }
        if !new.is_empty() {
            let document = json!({"op": "advertise", "channels": new});
            change.documents.push(document);
        }
    }

    fn replace_services(&mut self, services: BTreeMap<u32, Service>, change: &mut Change) {
        let gone = self.services.keys().filter(|id| !services.contains_key(id));
        let gone: Vec<u32> = gone.copied().collect();
        let new = services
            .iter()
            .filter(|(id, _)| !self.services.contains_key(id));
        let new: Vec<Json> = new
            .map(|(_, service)| service.advertisement.clone())
            .collect();
        self.services = services;
        self.service_ids
            .retain(|_, id| self.services.contains_key(id));
        if !gone.is_empty() {
            let document = json!({"op": "unadvertiseServices", "serviceIds": gone});
            change.documents.push(document);
        }
        if !new.is_empty() {
            let document = json!({"op": "advertiseServices", "services": new});
            change.documents.push(document);
        }
    }

    /// Takes parameters. Returns the names of those whose values are others.
    pub(crate) fn replace_parameters(
        &mut self,
        parameters: BTreeMap<String, Parameter>,
    ) -> BTreeSet<String> {
        let is_other = |(name, new): &(&String, &Parameter)| {
            let old = self.parameters.get(*name);
            old.is_none_or(|old| old.value != new.value)
        };
        let others = parameters.iter().filter(is_other);
        let others = others.map(|(name, _)| name.clone()).collect();
        self.parameters = parameters;
        others
    }

    /// Documents for a new client.
    pub(crate) fn advertisements(&self) -> Vec<Json> {
        let channels = self.channels.iter();
        let channels: Vec<Json> = channels.map(|(id, c)| c.advertisement(*id)).collect();
        let services = self.services.values();
        let services: Vec<Json> = services.map(|s| s.advertisement.clone()).collect();
        let mut documents = vec![json!({"op": "advertise", "channels": channels})];
        if !services.is_empty() {
            documents.push(json!({"op": "advertiseServices", "services": services}));
        }
        documents
    }
}

impl Channel {
    fn advertisement(&self, id: u64) -> Json {
        protocol::channel(id, &self.topic, &self.schema)
    }
}

/// The channels of results that Foxglove can show.
fn results(name: &str, operation: i32, reply: &Struct) -> Vec<(String, Schema, Form)> {
    let all = shapes(reply).into_iter();
    let all = all.map(|(shape, at)| {
        let form = Form::ShapeOfResult(operation, shape, at);
        (format!("{name}/{}", shape.word()), shape.schema(), form)
    });
    all.collect()
}

/// The parameters of all components, without secret ones.
fn parameters(snapshot: &Snapshot) -> BTreeMap<String, Parameter> {
    let all = snapshot.parameters.iter();
    let all = all.flat_map(|(component, listed)| of_component(component, listed));
    all.collect()
}

/// The parameters of a component, by the names that clients see, without secret ones.
pub(crate) fn of_component<'l>(
    component: &'l str,
    listed: &'l rc_management::component::Parameters,
) -> impl Iterator<Item = (String, Parameter)> + 'l {
    let shown = listed.parameters.iter().filter(|one| !one.secret);
    shown.map(move |one| {
        let parameter = Parameter {
            component: component.to_owned(),
            path: one.path.clone(),
            value: one.value.clone(),
        };
        (format!("{component}.{}", one.path), parameter)
    })
}
