//! Many ports of one kind with their services: the memory that a hand-written slot costs.

use crate::services::{EventService, Failure, Ipc, Stamp, calls, event_service, node, topic};
use bench_protocol::LARGEST;
use bench_protocol::slots::{Role, SIZE, each, hold};
use iceoryx2::port::client::Client;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::server::Server;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::Node;

/// A port with its notifier or listener, or both.
enum Port {
    Publisher(Publisher<Ipc, [u8], Stamp>, Notifier<Ipc>),
    Subscriber(Subscriber<Ipc, [u8], Stamp>, Listener<Ipc>),
    Server(
        Server<Ipc, [u8], (), [u8], ()>,
        Listener<Ipc>,
        Notifier<Ipc>,
    ),
    Client(
        Client<Ipc, [u8], (), [u8], ()>,
        Notifier<Ipc>,
        Listener<Ipc>,
    ),
}

/// Opens `count` ports and keeps them open.
pub(crate) fn run(role: &str, count: &str, root: &str, prefix: &str) -> Result<(), Failure> {
    let role: Role = role.parse()?;
    let node = node(root, prefix)?;
    let mut ports = (0..count.parse()?)
        .map(|at| Port::open(&node, role, at))
        .collect::<Result<Vec<Port>, Failure>>()?;
    hold(|| match role {
        Role::Publishers | Role::Clients => ports.iter().try_for_each(Port::send),
        Role::Subscribers | Role::Servers => each(&mut ports, |port| port.take()),
    })
}

impl Port {
    fn open(node: &Node<Ipc>, role: Role, at: usize) -> Result<Self, Failure> {
        let event = |what: &str| -> Result<EventService, Failure> {
            event_service(node, &format!("{what}{at}"))
        };
        let (sample, echo) = (format!("sample{at}"), format!("echo{at}"));
        Ok(match role {
            Role::Publishers => Self::Publisher(
                topic(node, &sample)?
                    .publisher_builder()
                    .initial_max_slice_len(LARGEST)
                    .max_loaned_samples(1)
                    .create()?,
                event("sample")?.notifier_builder().create()?,
            ),
            Role::Subscribers => Self::Subscriber(
                topic(node, &sample)?
                    .subscriber_builder()
                    .buffer_size(10)
                    .create()?,
                event("sample")?.listener_builder().create()?,
            ),
            Role::Servers => Self::Server(
                calls(node, &echo)?
                    .server_builder()
                    .initial_max_slice_len(LARGEST)
                    .create()?,
                event("asked")?.listener_builder().create()?,
                event("answered")?.notifier_builder().create()?,
            ),
            Role::Clients => Self::Client(
                calls(node, &echo)?
                    .client_builder()
                    .initial_max_slice_len(LARGEST)
                    .create()?,
                event("asked")?.notifier_builder().create()?,
                event("answered")?.listener_builder().create()?,
            ),
        })
    }

    /// Publishes a sample, or sends a request and awaits the reply.
    fn send(&self) -> Result<(), Failure> {
        let data = [7; SIZE];
        match self {
            Self::Publisher(port, notifier) => {
                port.loan_slice_uninit(SIZE)?
                    .write_from_slice(&data)
                    .send()?;
                notifier.notify()?;
            }
            Self::Client(port, notifier, listener) => {
                let loan = port.loan_slice_uninit(SIZE)?;
                let mut pending = loan.write_from_slice(&data).send()?;
                notifier.notify()?;
                each(std::slice::from_mut(&mut pending), |pending| {
                    listener.try_wait(|_| {})?;
                    Ok(pending.receive()?.is_some())
                })?;
            }
            Self::Subscriber(..) | Self::Server(..) => {}
        }
        Ok(())
    }

    /// Receives a sample or replies to a request, if there is one.
    fn take(&self) -> Result<bool, Failure> {
        match self {
            Self::Subscriber(port, listener) => {
                listener.try_wait(|_| {})?;
                Ok(port.receive()?.is_some())
            }
            Self::Server(port, listener, notifier) => {
                listener.try_wait(|_| {})?;
                let Some(request) = port.receive()? else {
                    return Ok(false);
                };
                let loan = request.loan_slice_uninit(SIZE)?;
                loan.write_from_slice(request.payload()).send()?;
                notifier.notify()?;
                Ok(true)
            }
            Self::Publisher(..) | Self::Client(..) => Ok(true),
        }
    }
}
