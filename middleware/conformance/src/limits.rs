//! The maximum number of endpoints.

use crate::Subject;
use crate::calls::{ask, echo};
use crate::network::{LIMIT, Network, endpoint, header, keep_last, receive, serve, until};
use rc_middleware::Header;
use rc_middleware::qos::{MAX_PUBLISHERS, MAX_READERS, MOST_PUBLISHERS, REQUEST_QUEUE};
use std::cell::RefCell;
use std::sync::mpsc::channel;

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
                        .map(|_| network.client(&*backend, address))
                        .collect();
                    for round in 0..5 {
                        for (at, client) in clients.iter_mut().enumerate() {
                            let request = format!("{number}/{at}/{round}");
                            let reply = ask(&mut **client, request.as_bytes());
                            assert_eq!(reply, format!("{request}!").as_bytes());
                        }
                    }
                });
            }
        });
    });
}

/// Sixty-four clients, each with a full queue: fifteen commands and a call that waits for its
/// reply. More than a thousand requests wait before the server takes the first one. Each reply
/// holds its own request and the number of commands that the client sent before.
pub fn a_thousand_requests_get_their_own_replies(subject: &dyn Subject) {
    const ROUNDS: u8 = 2;
    const COMMANDS: u8 = REQUEST_QUEUE as u8 - 1;
    let network = Network::new(subject);
    let all = MAX_READERS;
    let address = endpoint("default/Motor");
    let served = RefCell::new([0; MAX_READERS]);
    let handler = |_: Header, request: &[u8], reply: &mut Vec<u8>| {
        let count = &mut served.borrow_mut()[usize::from(request[0])];
        match *request {
            [number, round] => reply.extend([number, round, *count]),
            _ => *count += 1,
        }
    };
    std::thread::scope(|scope| {
        let (network, address) = (&network, &address);
        let backend = network.join("server");
        let mut server = backend.server(address).expect("a server");
        let (sent, all_sent) = channel();
        let mut clients = Vec::new();
        for number in 0..all as u8 {
            let (go, may_go) = channel();
            let sent = sent.clone();
            clients.push(go);
            scope.spawn(move || {
                let backend = network.join("client");
                let mut client = network.client(&*backend, address);
                for round in 1..=ROUNDS {
                    may_go.recv_timeout(LIMIT).expect("a round");
                    for at in 1..=u64::from(COMMANDS) {
                        let command = client.send(header(at), &[number]);
                        command.expect("to be sent");
                    }
                    sent.send(()).expect("a test that waits");
                    let reply = ask(&mut *client, &[number, round]);
                    assert_eq!(reply, [number, round, round * COMMANDS]);
                }
            });
        }
        for _ in 0..ROUNDS {
            for client in &clients {
                client.send(()).expect("a client");
            }
            for _ in &clients {
                all_sent.recv_timeout(LIMIT).expect("its commands");
            }
            serve(&mut *server, all * REQUEST_QUEUE, &handler);
        }
        backend.linger(LIMIT);
    });
}

/// Each sample reaches each subscriber.
pub fn sixteen_publishers_reach_sixty_four_subscribers(subject: &dyn Subject) {
    all_reach_all(subject, MAX_PUBLISHERS, MAX_READERS);
}

/// A topic admits as many publishers as it is deep.
pub fn sixty_four_publishers_share_a_topic_of_that_depth(subject: &dyn Subject) {
    all_reach_all(subject, MOST_PUBLISHERS, 2);
}

fn all_reach_all(subject: &dyn Subject, publishers: usize, subscribers: usize) {
    let network = Network::new(subject);
    let topic = keep_last(publishers as u32, &endpoint("default/Laser/scan"));
    let backend = network.join("all");
    let mut readers: Vec<_> = (0..subscribers)
        .map(|_| backend.subscriber(&topic).expect("a subscriber"))
        .collect();
    let mut writers: Vec<_> = (0..publishers)
        .map(|_| backend.publisher(&topic).expect("a publisher"))
        .collect();
    network.meet(|| readers.iter().all(|reader| reader.peers() == publishers));
    for (writer, number) in writers.iter_mut().zip(0_u8..) {
        until("all are there", || writer.peers() == subscribers);
        writer.publish(header(1), &[number]).expect("to publish");
    }
    for reader in &mut readers {
        let values = receive(&mut **reader, publishers);
        let mut senders: Vec<_> = values.iter().map(|(_, body)| body[0]).collect();
        senders.sort_unstable();
        assert_eq!(senders, (0..publishers as u8).collect::<Vec<_>>());
    }
}
