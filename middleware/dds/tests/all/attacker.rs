//! A participant of the domain that is no server and writes replies.

use crate::qos::Network;
use rc_ddsc::{Domain, Event, Listener, Participant, Qos, Reader, Writer};
use rc_middleware::rpc::{self, RequestId};
use rc_middleware::{
    Address, CallError, Cdr, Client, Endpoint, Header, QueueGauge, TypeIdentity, WakeEvent, now,
    wait,
};
use std::os::fd::AsFd;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);
const DOMAIN: u32 = 104;
const OPERATION: i32 = 5;
const LARGE: usize = 20_000_000;
const RIGHT: i32 = 42;
const FORGED: i32 = 666;

fn service() -> Endpoint {
    Endpoint {
        address: Address::parse("default/Motor").expect("an address"),
        types: TypeIdentity {
            name: "Test::Motor".to_owned(),
            hash: 7,
        },
        qos: rc_middleware::Qos::CALL,
        external_types: Vec::new(),
    }
}

struct Matches(std::sync::mpsc::Sender<()>);

impl Listener for Matches {
    fn event(&self, event: Event) {
        if let Event::Matched(_) = event {
            let _ = self.0.send(());
        }
    }
}

/// Reads the requests and writes replies, as the server does.
struct Attacker {
    requests: Reader,
    replies: Writer,
    // Dropped last.
    _participant: Participant,
    _domain: Domain,
}

impl Attacker {
    /// Joins, and waits until the client and the server have found it.
    fn join() -> Self {
        let config = format!(
            "<Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
             </General><Discovery><ExternalDomainId>{DOMAIN}</ExternalDomainId></Discovery></Domain>"
        );
        let domain = Domain::new(400, &config).expect("a domain");
        let participant = domain.participant(b"").expect("a participant");
        let topic = |word: &str| {
            let topic = participant.topic(
                &format!("default/Motor_{word}"),
                &format!("Test::Motor_{word}"),
            );
            topic.expect("a topic")
        };
        let (sender, matched) = channel();
        let listener = || Box::new(Matches(sender.clone()));
        let requests = participant.reader(&topic("Request"), &Qos::LOSSLESS, listener());
        let replies = participant.writer(&topic("Reply"), &Qos::LOSSLESS, listener());
        for _ in 0..2 {
            matched.recv_timeout(LIMIT).expect("the client");
        }
        Self {
            requests: requests.expect("a reader"),
            replies: replies.expect("a writer"),
            _participant: participant,
            _domain: domain,
        }
    }

    /// The identity of the next request on the network.
    fn overhear(&self) -> RequestId {
        self.overhear_within(LIMIT).expect("a request")
    }

    fn overhear_within(&self, limit: Duration) -> Option<RequestId> {
        let begin = Instant::now();
        loop {
            let mut found = None;
            let take = |sample: rc_ddsc::Sample| {
                found = rpc::request_id(rc_network::body(&sample).expect("a body"));
            };
            self.requests.take(take).expect("requests");
            if found.is_some() {
                return found;
            }
            if begin.elapsed() >= limit {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Writes a reply, and waits until the client has received it.
    fn forge(&self, id: RequestId, size: usize) {
        let reply = reply(id, FORGED, size);
        self.replies.write(1, 1, &reply).expect("to write");
        self.replies.wait_for_acks(LIMIT).expect("the client");
    }
}

fn reply(id: RequestId, value: i32, size: usize) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    rpc::begin_reply(&mut writer, id, OPERATION, 0);
    writer.put(&value);
    let mut bytes = writer.into_bytes();
    bytes.resize(bytes.len().max(size), 0);
    bytes
}

/// Calls, and gives the value of the reply.
fn call(client: &mut dyn Client, sequence: u64, limit: Duration) -> Result<i32, CallError> {
    let mut writer = rc_middleware::Writer::default();
    let id = RequestId {
        writer: client.guid(),
        sequence,
    };
    rpc::begin_request(&mut writer, id, OPERATION);
    let header = Header {
        sequence,
        sent: now(),
        ..Header::default()
    };
    let (request, mut value) = (writer.into_bytes(), None);
    client.call(header, &request, limit, &mut |_, reply| {
        let mut reader = rc_middleware::Reader::new(reply);
        rpc::open_reply(&mut reader, OPERATION).expect("an envelope");
        value = Some(i32::decode(&mut reader).expect("a value"));
    })?;
    Ok(value.expect("a reply"))
}

/// Serves until `stop`. Each reply waits for a size on the channel.
fn serve(network: &Network, stop: &WakeEvent, sizes: &Receiver<usize>, ready: &dyn Fn()) {
    let backend = network.join();
    let mut server = backend.server(&service()).expect("a server");
    ready();
    while !stop.is_stopping() {
        let woken = wait(
            &[server.descriptor(), stop.as_fd()],
            Duration::from_millis(50),
        ) & 1
            != 0;
        server.acknowledge(woken);
        let mut handle = |_: Header, request: &[u8], buffer: &mut dyn rc_middleware::Reply| {
            let id = rpc::request_id(request).expect("an envelope");
            let size = sizes.recv_timeout(LIMIT).expect("a size");
            *buffer.body() = reply(id, RIGHT, size);
        };
        while server.serve(&mut handle).expect("requests") {
            // A writer refuses a reply while a large one before it waits for its acknowledgement.
            backend.linger(LIMIT);
        }
    }
}

fn until(gauge: &QueueGauge, dropped: u64) {
    let begin = Instant::now();
    while gauge.dropped() < dropped {
        assert!(begin.elapsed() < LIMIT, "{} were dropped", gauge.dropped());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!((gauge.dropped(), gauge.bytes()), (dropped, 0));
}

#[test]
fn replies_count_only_from_the_server_and_only_to_pending_requests() {
    let network = Network::new(DOMAIN);
    let stop = WakeEvent::new().expect("a wake event");
    std::thread::scope(|scope| {
        let ((ready, is_ready), (size, sizes)) = (channel(), channel());
        let (of_server, stopped) = (&network, &stop);
        scope.spawn(move || {
            serve(of_server, stopped, &sizes, &|| {
                ready.send(()).expect("a test that waits");
            });
        });
        let _stop = rc_conformance::network::StopOnDrop(&stop);
        is_ready.recv_timeout(LIMIT).expect("a server");
        let backend = network.join();
        let mut client = backend.client(&service()).expect("a client");
        let gauge = client.queue().expect("a queue");
        let attacker = Attacker::join();
        // The client has found the attacker, who serves the same address.
        let own = client.guid();
        for sequence in 1000..1004 {
            let id = RequestId {
                writer: own,
                sequence,
            };
            attacker.forge(id, LARGE);
        }
        until(&gauge, 4);
        // The server replies after the forged reply has arrived. The client may know the attacker's
        // reader later than its writer; until then it sends it no request.
        let mut sequence = 1;
        let mut is_heard = false;
        while !is_heard {
            assert!(sequence < 30, "no request is heard");
            std::thread::scope(|scope| {
                let (attacker, size) = (&attacker, size.clone());
                let overhears = scope.spawn(move || {
                    let request = attacker.overhear_within(Duration::from_secs(1));
                    if let Some(request) = request {
                        attacker.forge(request, 100);
                    }
                    size.send(100).expect("a server");
                    request.is_some()
                });
                assert_eq!(call(&mut *client, sequence, LIMIT).expect("a reply"), RIGHT);
                is_heard = overhears.join().expect("the attacker");
            });
            sequence += 1;
        }
        until(&gauge, 5);
        // A late reply takes no memory, nor does one of the attacker after the call.
        let error = call(&mut *client, sequence, Duration::from_millis(50)).expect_err("no reply");
        assert!(matches!(error, CallError::Deadline { .. }), "{error}");
        size.send(LARGE).expect("a server");
        size.send(100).expect("a server");
        assert_eq!(
            call(&mut *client, sequence + 1, LIMIT).expect("a reply"),
            RIGHT
        );
        assert_eq!(gauge.bytes(), 0);
        attacker.forge(attacker.overhear(), LARGE);
        until(&gauge, 6);
    });
}
