//! The ports by which time travels.

use super::protocol::{DONE, TICK};
use rc_middleware::linked::NodeClock;
use rc_middleware::network_time::{TYPE_HASH, call_types, topic_types};
use rc_middleware::typed::Request;
use rc_middleware::{
    Address, Backend, Client, Endpoint, ExternalType, OpenError, Publisher, Qos, Reader,
    ReceiveError, Reliability, Server, Subscriber, TypeIdentity,
};
use std::os::fd::BorrowedFd;

/// The most messages that are taken from a port in a turn of the loop.
const MESSAGES_A_TURN: usize = 1024;

/// The slot of time, in messages and rules for names.
pub(crate) const SLOT: &str = "rc_time";

fn endpoint(address: Address, types: TypeIdentity, qos: Qos, external: ExternalType) -> Endpoint {
    Endpoint {
        address,
        types,
        qos,
        external_types: vec![external],
    }
}

fn topic(address: &Address) -> Endpoint {
    let qos = Qos {
        reliability: Reliability::Reliable,
        ..Qos::PUBLISHER
    };
    let external = ExternalType {
        slot: SLOT.to_owned(),
        operation: TICK.name.to_owned(),
        id: TICK.id,
        type_name: "rc_time/msg/Tick".to_owned(),
    };
    endpoint(address.join(TICK.name), topic_types(), qos, external)
}

fn calls(address: &Address) -> Endpoint {
    let external = ExternalType {
        slot: SLOT.to_owned(),
        operation: DONE.name.to_owned(),
        id: DONE.id,
        type_name: "rc_time/srv/Done".to_owned(),
    };
    endpoint(address.clone(), call_types(), Qos::CALL, external)
}

/// The topic of time of a middleware's nodes, which publish and read it best effort.
fn node_clock(address: &Address, clock: &NodeClock) -> Endpoint {
    let external = ExternalType {
        slot: SLOT.to_owned(),
        operation: "clock".to_owned(),
        id: 0,
        type_name: clock.type_name.to_owned(),
    };
    let qos = Qos {
        depth: 1,
        reliability: Reliability::BestEffort,
        ..Qos::SUBSCRIBER
    };
    let types = TypeIdentity {
        name: clock.types.to_owned(),
        hash: TYPE_HASH,
    };
    endpoint(address.join("clock"), types, qos, external)
}

pub(crate) fn publisher(
    backend: &dyn Backend,
    address: &Address,
) -> Result<Box<dyn Publisher>, OpenError> {
    backend.publisher(&topic(address))
}

pub(crate) fn server(
    backend: &dyn Backend,
    address: &Address,
) -> Result<Box<dyn Server>, OpenError> {
    backend.server(&calls(address))
}

pub(crate) fn subscriber(
    backend: &dyn Backend,
    address: &Address,
) -> Result<Box<dyn Subscriber>, OpenError> {
    backend.subscriber(&topic(address))
}

pub(crate) fn client(
    backend: &dyn Backend,
    address: &Address,
) -> Result<Box<dyn Client>, OpenError> {
    backend.client(&calls(address))
}

pub(crate) fn node_clock_publisher(
    backend: &dyn Backend,
    address: &Address,
    clock: &NodeClock,
) -> Result<Box<dyn Publisher>, OpenError> {
    let mut endpoint = node_clock(address, clock);
    endpoint.qos.reliability = Reliability::Reliable;
    backend.publisher(&endpoint)
}

pub(crate) fn node_clock_subscriber(
    backend: &dyn Backend,
    address: &Address,
    clock: &NodeClock,
) -> Result<Box<dyn Subscriber>, OpenError> {
    backend.subscriber(&node_clock(address, clock))
}

/// A receiving port, of the source or of a follower.
pub(crate) trait Receiving {
    /// Readable when a message may have arrived.
    fn descriptor(&self) -> BorrowedFd<'_>;
    /// Clears readiness, see [`Subscriber::acknowledge`].
    fn acknowledge(&mut self, woken: bool);
    /// Takes one message, if there is one.
    fn receive(&mut self, take: &mut dyn FnMut(&mut Reader<'_>)) -> Result<bool, ReceiveError>;
}

impl Receiving for Box<dyn Subscriber> {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.as_ref().descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.as_mut().acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(&mut Reader<'_>)) -> Result<bool, ReceiveError> {
        self.as_mut()
            .receive(&mut |_, body| take(&mut Reader::new(body)))
    }
}

impl Receiving for Box<dyn Server> {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.as_ref().descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.as_mut().acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(&mut Reader<'_>)) -> Result<bool, ReceiveError> {
        self.serve(&mut |header, body, reply| {
            // A message that is not a command of a follower is for others.
            if let Ok(mut request) = Request::open(header, body, reply) {
                let _ = request.arguments(&DONE, |reader| {
                    take(reader);
                    Ok(())
                });
                request.close();
            }
        })
    }
}

/// Takes all messages of a port, if it was woken or is to be looked at. Unreadable ones are
/// dropped: the sender repeats what counts.
pub(crate) fn drain(port: &mut dyn Receiving, woken: bool, take: &mut dyn FnMut(&mut Reader<'_>)) {
    let mut left = MESSAGES_A_TURN;
    let mut all = |port: &mut dyn Receiving| {
        while left > 0 && !matches!(port.receive(take), Ok(false)) {
            left -= 1;
        }
    };
    all(port);
    port.acknowledge(woken);
    all(port);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_network_has_its_own_address() {
        let address = rc_middleware::network_time::address("patrol").expect("an address");
        assert_eq!(topic(&address).address.as_str(), "patrol/rc-time/tick");
        assert_eq!(calls(&address).address.as_str(), "patrol/rc-time");
    }
}
