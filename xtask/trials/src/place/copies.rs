//! The allocations of a sample, from its sender to the value of its receiver.

use crate::pair::Network;
use crate::programs::Failure;
use rc_middleware::typed::{self, Operation, TypedPublisher};
use rc_middleware::{
    Address, Backend, Endpoint, Environment, OpenError, Qos, Settings, TypeIdentity, WakeEvent,
};

/// The cost of a sample in the typed layer and a middleware.
const SAMPLE: Operation = Operation::one_way("sample", 1, 7);
type Connect = fn(&Environment) -> Result<Box<dyn Backend>, OpenError>;

/// Counts the allocations of a sample from its sender to the value of its receiver, and prints them.
pub(super) fn print() -> Result<(), Failure> {
    println!("| a sample and its value at the receiver | allocations | allocated bytes |");
    println!("|---|---|---|");
    let middlewares: [(_, Connect); 2] = [
        ("one process", rc_local::connect),
        ("shared memory", rc_iceoryx2::connect),
    ];
    for (name, connect) in middlewares {
        let network = Network::new("copies")?;
        let environment = Environment {
            network: network.name.clone(),
            instance: "both".to_owned(),
            directory: network.directory.clone(),
            wake_event: WakeEvent::new()?,
            settings: Settings::default(),
        };
        let backend = connect(&environment)?;
        let endpoint = |qos: Qos| -> Result<Endpoint, Failure> {
            Ok(Endpoint {
                address: Address::parse(&format!("{}/Sample", network.name))?,
                types: TypeIdentity {
                    name: "RcBench::Sample".to_owned(),
                    hash: SAMPLE.type_hash,
                },
                external_types: Vec::new(),
                qos,
            })
        };
        let mut subscriber = backend.subscriber(&endpoint(Qos::SUBSCRIBER)?)?;
        let port = backend.publisher(&endpoint(Qos::PUBLISHER)?)?;
        let mut topic = TypedPublisher::new(port, SAMPLE);
        for (what, size) in [("64 B", 64), ("1 MiB", 1 << 20)] {
            let data = vec![7_u8; size];
            let mut exchange = || -> Result<(), Failure> {
                topic.publish_parts((&1_i64, &data[..]))?;
                let mut read = None;
                let received = subscriber.receive_message(&mut |header, message| {
                    let value = typed::read::<(i64, Vec<u8>)>(&mut message.reader(header.encoding));
                    read = value.ok();
                })?;
                let whole = read.is_some_and(|(_, value)| value.len() == size);
                if received && whole {
                    Ok(())
                } else {
                    Err("the sample did not come".into())
                }
            };
            // Buffers and pools have their sizes after some samples.
            for _ in 0..20 {
                exchange()?;
            }
            let mut outcome = Ok(());
            let used = allocation_counter::measure(|| outcome = exchange());
            outcome?;
            println!(
                "| {what}, {name} | {} | {} |",
                used.count_total, used.bytes_total
            );
        }
    }
    println!();
    Ok(())
}
