//! Holds many ports of one kind, opened as a generated component opens those of its slots, for the
//! measurement of the memory of a slot.
//!
//! `bench_slots publishers|subscribers|servers|clients COUNT NETWORK`. `bench_protocol::slots`
//! describes the protocol.

use bench_protocol::slots::{Failure, Role, SIZE, each, hold};
use rc_middleware::typed::{Operation, Request, TypedClient, TypedPublisher};
use rc_middleware::{
    Address, Backend, CallError, Endpoint, Environment, Qos, RunDirectory, Server, Settings,
    Subscriber, TypeIdentity, WakeEvent,
};
use std::process::ExitCode;

const OPERATION: Operation = Operation {
    name: "data",
    id: 1,
    type_hash: 1,
    two_way: true,
    replies: &[],
};

enum Ports {
    Publishers(Vec<TypedPublisher>),
    Subscribers(Vec<Box<dyn Subscriber>>),
    Servers(Vec<Box<dyn Server>>),
    Clients(Vec<TypedClient>),
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [role, count, network] => run(role, count, network),
        _ => Err(Failure::from(
            "usage: bench_slots publishers|subscribers|servers|clients COUNT NETWORK",
        )),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench_slots: error: {error}");
            ExitCode::from(3)
        }
    }
}

fn run(role: &str, count: &str, network: &str) -> Result<(), Failure> {
    let role: Role = role.parse()?;
    let environment = Environment {
        network: network.to_owned(),
        instance: role.to_string(),
        directory: RunDirectory::open(network)?,
        wake_event: WakeEvent::new()?,
        settings: Settings::default(),
    };
    let backend = rc_iceoryx2::connect(&environment)?;
    let mut ports = open(backend.as_ref(), role, count.parse()?, network)?;
    hold(|| ports.exchange())?;
    Ok(())
}

fn open(backend: &dyn Backend, role: Role, count: usize, network: &str) -> Result<Ports, Failure> {
    let endpoint = |at: usize, qos: Qos| -> Result<Endpoint, Failure> {
        Ok(Endpoint {
            address: Address::parse(&format!("{network}/Slot{at}"))?,
            types: TypeIdentity {
                name: "RcBench::Slot".to_owned(),
                hash: OPERATION.type_hash,
            },
            external_types: Vec::new(),
            qos,
        })
    };
    let all = 0..count;
    Ok(match role {
        Role::Publishers => Ports::Publishers(
            all.map(|at| {
                let port = backend.publisher(&endpoint(at, Qos::PUBLISHER)?)?;
                Ok(TypedPublisher::new(port, OPERATION))
            })
            .collect::<Result<_, Failure>>()?,
        ),
        Role::Subscribers => Ports::Subscribers(
            all.map(|at| Ok(backend.subscriber(&endpoint(at, Qos::SUBSCRIBER)?)?))
                .collect::<Result<_, Failure>>()?,
        ),
        Role::Servers => Ports::Servers(
            all.map(|at| Ok(backend.server(&endpoint(at, Qos::CALL)?)?))
                .collect::<Result<_, Failure>>()?,
        ),
        Role::Clients => Ports::Clients(
            all.map(|at| {
                let port = backend.client(&endpoint(at, Qos::CALL)?)?;
                Ok(TypedClient::new(port, Qos::CALL.timeout))
            })
            .collect::<Result<_, Failure>>()?,
        ),
    })
}

impl Ports {
    /// Sends or receives one message at each port.
    fn exchange(&mut self) -> Result<(), Failure> {
        let data = vec![7_u8; SIZE];
        match self {
            Self::Publishers(ports) => {
                for port in ports {
                    port.publish_with(|writer| writer.put(&data))?;
                }
            }
            Self::Subscribers(ports) => each(ports, |port| Ok(port.receive(&mut |_, _| {})?))?,
            Self::Servers(ports) => each(ports, |port| {
                Ok(port.serve(&mut |header, body, reply| {
                    // A request without an envelope gets no reply, and its client reports that.
                    if let Ok(mut request) = Request::open(header, body, reply) {
                        let _ = request.reply_with(0, |writer| writer.put(&data));
                        request.close();
                    }
                })?)
            })?,
            Self::Clients(ports) => {
                for port in ports {
                    port.call_with(
                        &OPERATION,
                        |writer| writer.put(&data),
                        |_, _| Ok::<_, CallError>(()),
                    )?;
                }
            }
        }
        Ok(())
    }
}
