//! As many ends as are promised.

use crate::Subject;
use crate::calls::{ask, echo};
use crate::network::{Network, endpoint, header, keep_last, receive, until};
use rc_middleware::qos::{MAX_PUBLISHERS, MAX_READERS};

/// In eight components of eight clients each.
pub fn sixty_four_clients_are_served(subject: &dyn Subject) {
    const COMPONENTS: usize = 8;
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    network.serving(&address, echo, || {
        std::thread::scope(|scope| {
            for number in 0..COMPONENTS {
                let (network, address) = (&network, &address);
                scope.spawn(move || {
                    let backend = network.join("client");
                    let mut clients: Vec<_> = (0..MAX_READERS / COMPONENTS)
                        .map(|_| backend.client(address).expect("a client"))
                        .collect();
                    for round in 0..5 {
                        for (at, client) in clients.iter_mut().enumerate() {
                            let request = format!("{number}/{at}/{round}");
                            let answer = ask(&mut **client, request.as_bytes());
                            assert_eq!(answer, format!("{request}!").as_bytes());
                        }
                    }
                });
            }
        });
    });
}

/// Each value reaches each subscriber.
pub fn sixteen_publishers_reach_sixty_four_subscribers(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = keep_last(MAX_PUBLISHERS as u32, &endpoint("default/Laser/scan"));
    let backend = network.join("all");
    let mut subscribers: Vec<_> = (0..MAX_READERS)
        .map(|_| backend.subscriber(&topic).expect("a subscriber"))
        .collect();
    let mut publishers: Vec<_> = (0..MAX_PUBLISHERS)
        .map(|_| backend.publisher(&topic).expect("a publisher"))
        .collect();
    for (publisher, number) in publishers.iter_mut().zip(0_u8..) {
        until("all are there", || publisher.peers() == MAX_READERS);
        publisher.publish(header(1), &[number]).expect("to publish");
    }
    for subscriber in &mut subscribers {
        let values = receive(&mut **subscriber, MAX_PUBLISHERS);
        let mut senders: Vec<_> = values.iter().map(|(_, body)| body[0]).collect();
        senders.sort_unstable();
        assert_eq!(senders, (0..MAX_PUBLISHERS as u8).collect::<Vec<_>>());
    }
}
