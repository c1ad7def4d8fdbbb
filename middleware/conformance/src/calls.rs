//! Commands and queries that succeed; the rule of one server an address.

use crate::Subject;
use crate::network::{LIMIT, Network, endpoint, header, serve, until};
use crate::topics::pattern;
use rc_middleware::{CallError, Client, Header, OpenError, TypeIdentity};
use std::sync::mpsc::channel;

/// Replies with the request and one byte more. The request `-` is a command.
pub(crate) fn echo(_: Header, request: &[u8], reply: &mut Vec<u8>) {
    reply.extend_from_slice(request);
    reply.push(b'!');
}

/// The reply to `request`, which must arrive.
pub(crate) fn ask(client: &mut dyn Client, request: &[u8]) -> Vec<u8> {
    let mut reply = b"what was there before".to_vec();
    client
        .call(header(1), &request, LIMIT, &mut |_, body| {
            body.clone_into(&mut reply);
        })
        .expect("a reply");
    reply
}

/// One client, one queue.
pub fn commands_and_queries_keep_their_order(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let served = std::sync::Mutex::new(Vec::new());
    let record = |header: Header, request: &[u8], reply: &mut Vec<u8>| {
        served.lock().expect("a record").push(header.sequence);
        echo(header, request, reply);
    };
    network.serving(&address, record, || {
        let backend = network.join("client");
        let mut client = network.client(&*backend, &address);
        for sequence in 1..=60 {
            if sequence % 6 == 0 {
                let mut reply = Vec::new();
                client
                    .call(header(sequence), b"q", LIMIT, &mut |_, body| {
                        body.clone_into(&mut reply);
                    })
                    .expect("a reply");
                assert_eq!(reply, b"q!");
            } else {
                client
                    .send(header(sequence), b"command")
                    .expect("to be sent");
            }
        }
        backend.linger(LIMIT);
    });
    let served = served.into_inner().expect("a record");
    assert_eq!(served, (1..=60).collect::<Vec<_>>());
}

/// In lockstep, a component acknowledges its tick when its commands have arrived.
pub fn commands_that_have_arrived_are_served_at_once(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let backend = network.join("server");
    let mut server = backend.server(&address).expect("a server");
    let backend = network.join("client");
    let mut client = network.client(&*backend, &address);
    // Then the server knows the client, too.
    client.send(header(1), b"command").expect("to be sent");
    serve(&mut *server, 1, &|_, _, _| ());
    for sequence in 2..=100 {
        let sent = client.send(header(sequence), b"command");
        sent.expect("to be sent");
        assert!(backend.have_arrived(LIMIT), "{sequence}");
        server.acknowledge(false);
        let mut served = Vec::new();
        let mut serve = || server.serve(&mut |header, _, _| served.push(header.sequence));
        while serve().expect("requests") {}
        assert_eq!(served, [sequence]);
    }
}

/// Eight clients at once, 200 calls each.
pub fn each_client_gets_its_own_replies(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    network.serving(&address, echo, || {
        std::thread::scope(|scope| {
            for number in 0..8 {
                let (network, address) = (&network, &address);
                scope.spawn(move || {
                    let backend = network.join("client");
                    let mut client = network.client(&*backend, address);
                    for call in 0..200 {
                        let request = format!("{number}/{call}");
                        let reply = ask(&mut *client, request.as_bytes());
                        assert_eq!(reply, format!("{request}!").as_bytes());
                    }
                });
            }
        });
    });
}

/// The client opens before its server.
pub fn a_late_server_is_found(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let backend = network.join("client");
    let mut client = backend.client(&address).expect("a client");
    assert_eq!(client.peers(), 0);
    network.serving(&address, echo, || {
        until("the server is seen", || client.peers() == 1);
        assert_eq!(ask(&mut *client, b"late"), b"late!");
    });
}

/// Three servers, one after the other, and one client that stays.
pub fn a_client_survives_its_servers(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let backend = network.join("client");
    let mut client = backend.client(&address).expect("a client");
    for _ in 0..3 {
        network.serving(&address, echo, || {
            network.meet(|| client.peers() == 1);
            assert_eq!(ask(&mut *client, b"again"), b"again!");
        });
        until("the server has left", || client.peers() == 0);
        let gone = client.send(header(1), b"without a server");
        assert_eq!(gone, Err(CallError::NoServer("default/Motor".to_owned())));
    }
}

/// Three clients, one after the other, and one server that stays.
pub fn a_server_survives_its_clients(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    network.serving(&address, echo, || {
        for _ in 0..3 {
            let backend = network.join("client");
            let mut client = network.client(&*backend, &address);
            assert_eq!(ask(&mut *client, b"again"), b"again!");
        }
    });
}

/// A client that sends many requests does not delay another client.
pub fn clients_are_served_round_robin(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let backend = network.join("all");
    let mut server = backend.server(&address).expect("a server");
    let mut busy = backend.client(&address).expect("a client");
    let mut modest = backend.client(&address).expect("a client");
    network.meet(|| (server.peers(), busy.peers(), modest.peers()) == (2, 1, 1));
    for _ in 0..10 {
        busy.send(header(1), b"busy").expect("to be sent");
    }
    modest.send(header(1), b"modest").expect("to be sent");
    // Where a middleware delivers by itself; over shared memory nothing happens until the server
    // looks.
    backend.linger(LIMIT / 24);
    server.acknowledge(true);
    let served = serve(&mut *server, 11, &|_, _, _| {});
    assert!(
        served[..2].iter().any(|body| body == b"modest"),
        "{served:?}"
    );
}

/// A request of 8 MiB, a reply of 8 MiB and a byte; then small ones again.
pub fn requests_and_replies_may_be_large(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Map");
    network.serving(&address, echo, || {
        let backend = network.join("client");
        let mut client = network.client(&*backend, &address);
        for size in [0, 1, 300, 70_000, 8 << 20, 3, 8 << 20, 1 << 20] {
            let request = pattern(size);
            let reply = ask(&mut *client, &request);
            assert_eq!(reply.len(), size + 1);
            assert!(reply[..size] == request, "{size} bytes differ");
        }
    });
}

/// Client and server count each other.
pub fn clients_and_servers_are_counted(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let (one, other) = (network.join("one"), network.join("other"));
    let first = one.client(&address).expect("a client");
    let second = other.client(&address).expect("a client");
    assert_eq!((first.peers(), second.peers()), (0, 0));
    let server = one.server(&address).expect("a server");
    until("both clients are seen", || server.peers() == 2);
    until("the server is seen", || second.peers() == 1);
    drop(second);
    until("one has left", || server.peers() == 1);
    drop(server);
    until("the server has left", || first.peers() == 0);
}

/// The error of the second server names the first one. The second one succeeds after the first has
/// left.
pub fn a_second_server_is_refused(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let (one, other) = (network.join("lidar"), network.join("simulator"));
    let first = one.server(&address).expect("a server");
    network.meet(|| other.server(&address).is_err());
    let refused = other.server(&address).err();
    let Some(OpenError::AddressTaken {
        address: taken,
        holder,
    }) = refused
    else {
        panic!("{refused:?}");
    };
    assert_eq!(taken, "default/Motor");
    let known = format!("pid {} (lidar)", std::process::id());
    match holder.strip_prefix(&known) {
        Some("") => {}
        Some(on) => assert!(
            on.starts_with(" on ") && !subject.meets_at_once(),
            "{holder}"
        ),
        None => panic!("{holder}"),
    }
    drop(first);
    network.meet(|| other.server(&address).is_ok());
    assert!(other.server(&address).is_ok());
}

/// The error has both types, whichever side opens first.
pub fn calls_of_different_types_refuse_each_other(subject: &dyn Subject) {
    let network = Network::new(subject);
    let (one, other) = (network.join("one"), network.join("other"));
    let ours = endpoint("default/Motor");
    let mut theirs = ours.clone();
    theirs.types = TypeIdentity {
        name: "Other::Motor".to_owned(),
        hash: 8,
    };
    let mismatch = |ours: &TypeIdentity, theirs: &TypeIdentity| OpenError::TypeMismatch {
        address: "default/Motor".to_owned(),
        ours: ours.to_string(),
        theirs: theirs.to_string(),
    };
    let client = one.client(&theirs).expect("a client");
    network.meet(|| other.server(&ours).is_err());
    let refused = other.server(&ours).err();
    assert_eq!(refused, Some(mismatch(&ours.types, &theirs.types)));
    drop(client);
    network.meet(|| other.server(&ours).is_ok());
    let _server = other.server(&ours).expect("a server");
    network.meet(|| one.client(&theirs).is_err());
    let refused = one.client(&theirs).err();
    assert_eq!(refused, Some(mismatch(&theirs.types, &ours.types)));
}

/// Equal addresses in two networks are not connected.
pub fn networks_are_separate(subject: &dyn Subject) {
    let (network, elsewhere) = (Network::new(subject), Network::new(subject));
    let address = endpoint("default/Motor");
    let other = elsewhere.join("client");
    let mut client = other.client(&address).expect("a client");
    let (sender, receiver) = channel();
    network.serving(&address, echo, || {
        let sent = client.send(header(1), b"into another network");
        sender.send(sent).expect("a test that waits");
    });
    assert_eq!(
        receiver.recv().expect("a result"),
        Err(CallError::NoServer("default/Motor".to_owned()))
    );
}
