//! Many ports of one kind, with their services and bells: what a slot costs that is written by
//! hand.

use crate::services::{Bells, Failure, Ipc, Stamp, bells, calls, node, topic};
use bench_protocol::LARGEST;
use bench_protocol::slots::{Role, SIZE, each, hold};
use iceoryx2::port::client::Client;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::server::Server;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::Node;

/// A port with what it wakes, and what wakes it.
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

/// Opens `count` ports and holds them.
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
        let bell = |what: &str| -> Result<Bells, Failure> { bells(node, &format!("{what}{at}")) };
        let (sample, echo) = (format!("sample{at}"), format!("echo{at}"));
        Ok(match role {
            Role::Publishers => Self::Publisher(
                topic(node, &sample)?
                    .publisher_builder()
                    .initial_max_slice_len(LARGEST)
                    .max_loaned_samples(1)
                    .create()?,
                bell("sample")?.notifier_builder().create()?,
            ),
            Role::Subscribers => Self::Subscriber(
                topic(node, &sample)?
                    .subscriber_builder()
                    .buffer_size(10)
                    .create()?,
                bell("sample")?.listener_builder().create()?,
            ),
            Role::Servers => Self::Server(
                calls(node, &echo)?
                    .server_builder()
                    .initial_max_slice_len(LARGEST)
                    .create()?,
                bell("asked")?.listener_builder().create()?,
                bell("answered")?.notifier_builder().create()?,
            ),
            Role::Clients => Self::Client(
                calls(node, &echo)?
                    .client_builder()
                    .initial_max_slice_len(LARGEST)
                    .create()?,
                bell("asked")?.notifier_builder().create()?,
                bell("answered")?.listener_builder().create()?,
            ),
        })
    }

    /// Publishes, or asks and awaits the answer.
    fn send(&self) -> Result<(), Failure> {
        let data = [7; SIZE];
        match self {
            Self::Publisher(port, bell) => {
                port.loan_slice_uninit(SIZE)?
                    .write_from_slice(&data)
                    .send()?;
                bell.notify()?;
            }
            Self::Client(port, bell, ear) => {
                let loan = port.loan_slice_uninit(SIZE)?;
                let mut pending = loan.write_from_slice(&data).send()?;
                bell.notify()?;
                each(std::slice::from_mut(&mut pending), |pending| {
                    ear.try_wait(|_| {})?;
                    Ok(pending.receive()?.is_some())
                })?;
            }
            Self::Subscriber(..) | Self::Server(..) => {}
        }
        Ok(())
    }

    /// Receives a value, or answers a request, where there is one.
    fn take(&self) -> Result<bool, Failure> {
        match self {
            Self::Subscriber(port, ear) => {
                ear.try_wait(|_| {})?;
                Ok(port.receive()?.is_some())
            }
            Self::Server(port, ear, bell) => {
                ear.try_wait(|_| {})?;
                let Some(request) = port.receive()? else {
                    return Ok(false);
                };
                let loan = request.loan_slice_uninit(SIZE)?;
                loan.write_from_slice(request.payload()).send()?;
                bell.notify()?;
                Ok(true)
            }
            Self::Publisher(..) | Self::Client(..) => Ok(true),
        }
    }
}
