//! A participant of the domain that is no server and writes replies, in both mappings of services.

use rc_conformance::network::{StopOnDrop, endpoint, serve_replies_until};
use rc_ddsc::{Domain, Event, Guid, Identity, Listener, Participant, Qos, Reader, Sample, Writer};
use rc_middleware::rpc::{self, ENVELOPE, RequestId};
use rc_middleware::{
    Backend, CallError, Cdr, Client, Environment, Header, QueueGauge, RunDirectory, Settings,
    WakeEvent, now,
};
use rc_vocabulary::Value;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);
/// The operation `any` of the conformance suite.
const OPERATION: i32 = 5;
const LARGE: usize = 20_000_000;
const RIGHT: i32 = 42;
const FORGED: i32 = 666;
/// The header before the body in the mapping of `rmw_cyclonedds`.
const HEADER: usize = 16;

fn join(domain: u32, instance: &str) -> (Box<dyn Backend>, RunDirectory) {
    let network = format!("attacker{domain}-{}", std::process::id());
    let directory = RunDirectory::open(&network).expect("a run directory");
    let mut settings = Settings::default();
    settings.set("ros2", "domain", Value::Int(domain.into()));
    settings.set("ros2", "interfaces", Value::Texts(vec!["lo".to_owned()]));
    let environment = Environment {
        network,
        instance: instance.to_owned(),
        directory: directory.clone(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings,
    };
    let backend = rc_ros2::connect(&environment, &[]).expect("the domain");
    (backend, directory)
}

struct Matches(Sender<()>);

impl Listener for Matches {
    fn event(&self, event: Event) {
        if let Event::Matched(_) = event {
            let _ = self.0.send(());
        }
    }
}

/// Reads the requests of `any` and writes replies, without being a component.
struct Stranger {
    requests: Reader,
    replies: Writer,
    // Dropped last.
    _participant: Participant,
    _domain: Domain,
}

/// A request that a stranger has read.
struct Overheard {
    related: Option<Identity>,
    body: Vec<u8>,
}

impl Stranger {
    /// Joins `domain` as the process `number`, and waits until its two endpoints have `peers`.
    fn join(domain: u32, number: u32, peers: usize) -> Self {
        let config = format!(
            "<Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
             </General><Discovery><ExternalDomainId>{domain}</ExternalDomainId></Discovery></Domain>"
        );
        let all = Domain::new(number, &config).expect("a domain");
        let participant = all.participant(b"").expect("a participant");
        let topic = |(word, part): (&str, &str), kind: &str| {
            let name = format!("{word}/default/Motor/any{kind}");
            let topic =
                participant.topic(&name, &format!("conformance_msgs::srv::dds_::any_{part}_"));
            topic.expect("a topic")
        };
        let (sender, matched) = channel();
        let listener = || Box::new(Matches(sender.clone()));
        let requests = topic(("rq", "Request"), "Request");
        let requests = participant.reader(&requests, &Qos::LOSSLESS, listener());
        let replies = topic(("rr", "Response"), "Reply");
        let replies = participant.writer(&replies, &Qos::LOSSLESS, listener());
        let stranger = Self {
            requests: requests.expect("a reader"),
            replies: replies.expect("a writer"),
            _participant: participant,
            _domain: all,
        };
        for _ in 0..peers {
            matched.recv_timeout(LIMIT).expect("the others");
        }
        stranger
    }

    fn overhear(&self) -> Overheard {
        self.overhear_within(LIMIT).expect("a request")
    }

    fn overhear_within(&self, limit: Duration) -> Option<Overheard> {
        let begin = Instant::now();
        loop {
            let mut found = None;
            let take = |sample: Sample| {
                found = Some(Overheard {
                    related: sample.related(),
                    body: rc_network::body(&sample).expect("a body").to_vec(),
                });
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

    /// Replies in the mapping of the request, and waits until the client has received the reply.
    fn reply(&self, request: &Overheard, value: i32, size: usize) {
        let mut body = match request.related {
            Some(_) => Vec::new(),
            None => request.body[..HEADER].to_vec(),
        };
        body.extend(value.to_le_bytes());
        body.resize(body.len().max(size), 0);
        let written = match request.related {
            Some(id) => self.replies.write_related(1, 1, &body, id),
            None => self.replies.write(1, 1, &body),
        };
        written.expect("to write");
        self.replies.wait_for_acks(LIMIT).expect("the client");
    }
}

/// Calls, and gives the value of the reply.
fn call(client: &mut dyn Client, sequence: u64, limit: Duration) -> Result<i32, CallError> {
    let mut writer = rc_middleware::Writer::default();
    let id = RequestId {
        writer: client.guid(),
        sequence,
    };
    rpc::begin_request(&mut writer, id, OPERATION);
    rpc::begin_body(&mut writer, client.profile());
    writer.put(&1_i32);
    let header = Header {
        sequence,
        sent: now(),
        ..Header::default()
    };
    let (request, mut value) = (writer.into_bytes(), None);
    client.call(header, &request, limit, &mut |_, reply| {
        let mut reader = rc_middleware::Reader::new(&reply[ENVELOPE..]);
        value = Some(i32::decode(&mut reader).expect("a value"));
    })?;
    Ok(value.expect("a reply"))
}

fn until(gauge: &QueueGauge, dropped: u64) {
    let begin = Instant::now();
    while gauge.dropped() < dropped {
        assert!(begin.elapsed() < LIMIT, "{} were dropped", gauge.dropped());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!((gauge.dropped(), gauge.bytes()), (dropped, 0));
}

/// Forges replies to a client, before, during and after its calls. `server` lets the server reply
/// to a request, with a reply of this size.
fn attack(client: &mut dyn Client, attacker: &Stranger, server: &(dyn Fn(usize) + Sync)) {
    let gauge = client.queue().expect("a queue");
    // The attacker knows the client's endpoints. The client may know those of the attacker later;
    // until then it sends it no request.
    let mut sequence = 1;
    let mut is_heard = false;
    while !is_heard {
        assert!(sequence < 30, "no request is heard");
        std::thread::scope(|scope| {
            let overhears = scope.spawn(|| {
                let request = attacker.overhear_within(Duration::from_secs(1));
                if let Some(request) = &request {
                    attacker.reply(request, FORGED, 100);
                }
                server(100);
                request.is_some()
            });
            assert_eq!(call(client, sequence, LIMIT).expect("a reply"), RIGHT);
            is_heard = overhears.join().expect("the attacker");
        });
        sequence += 1;
    }
    until(&gauge, 1);
    let late = call(client, sequence, Duration::from_millis(50)).expect_err("no reply");
    assert!(matches!(late, CallError::Deadline { .. }), "{late}");
    server(LARGE);
    std::thread::scope(|scope| {
        scope.spawn(|| server(100));
        assert_eq!(call(client, sequence + 1, LIMIT).expect("a reply"), RIGHT);
    });
    assert_eq!(gauge.bytes(), 0);
    let request = attacker.overhear();
    for dropped in 2..6 {
        attacker.reply(&request, FORGED, LARGE);
        until(&gauge, dropped);
    }
}

/// A component asks a component: the identity is beside the body.
#[test]
fn a_client_believes_its_component_alone() {
    const DOMAIN: u32 = 105;
    let stop = WakeEvent::new().expect("a wake event");
    std::thread::scope(|scope| {
        let ((ready, is_ready), (size, sizes)) = (channel(), channel::<usize>());
        let stopped = &stop;
        scope.spawn(move || {
            let (backend, _) = join(DOMAIN, "server");
            let mut server = backend
                .server(&endpoint("default/Motor"))
                .expect("a server");
            ready.send(()).expect("a test that waits");
            let handler = |_: Header, request: &[u8], reply: &mut dyn rc_middleware::Reply| {
                let id = rpc::request_id(request).expect("an envelope");
                let size = sizes.recv_timeout(LIMIT).expect("a size");
                let mut writer = rc_middleware::Writer::default();
                rpc::begin_reply(&mut writer, id, OPERATION, 0);
                rpc::begin_body(&mut writer, rc_middleware::Profile::Bare);
                writer.put(&RIGHT);
                *reply.body() = writer.into_bytes();
                let length = reply.body().len().max(size);
                reply.body().resize(length, 0);
            };
            serve_replies_until(&mut *server, stopped, &handler);
        });
        let _stop = StopOnDrop(&stop);
        is_ready.recv_timeout(LIMIT).expect("a server");
        let (backend, directory) = join(DOMAIN, "client");
        let client = backend.client(&endpoint("default/Motor"));
        let mut client = client.expect("a client");
        let attacker = Stranger::join(DOMAIN, 401, 2);
        attack(&mut *client, &attacker, &|wanted| {
            size.send(wanted).expect("a server");
        });
        drop((client, backend));
        directory.remove().expect("to remove it");
    });
}

/// A component asks a node on `rmw_cyclonedds`: the identity is before the body.
#[test]
fn a_client_believes_its_server_of_another_program_alone() {
    const DOMAIN: u32 = 106;
    let (backend, directory) = join(DOMAIN, "client");
    let server = Stranger::join(DOMAIN, 402, 0);
    let client = backend.client(&endpoint("default/Motor"));
    let mut client = client.expect("a client");
    rc_conformance::network::until("the server is there", || client.peers() == 1);
    // Its first request chooses the server.
    std::thread::scope(|scope| {
        scope.spawn(|| server.reply(&server.overhear(), RIGHT, 100));
        assert_eq!(call(&mut *client, 99, LIMIT).expect("a reply"), RIGHT);
    });
    let attacker = Stranger::join(DOMAIN, 403, 2);
    attack(&mut *client, &attacker, &|size| {
        server.reply(&server.overhear(), RIGHT, size);
    });
    drop((client, backend));
    directory.remove().expect("to remove it");
}

/// A stranger that names another participant's client in a request gets no reply for that client.
#[test]
fn a_server_replies_to_no_client_that_only_a_stranger_names() {
    const DOMAIN: u32 = 107;
    let (backend, directory) = join(DOMAIN, "server");
    let mut server = backend
        .server(&endpoint("default/Motor"))
        .expect("a server");
    let config = format!(
        "<Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
         </General><Discovery><ExternalDomainId>{DOMAIN}</ExternalDomainId></Discovery></Domain>"
    );
    let domain = Domain::new(404, &config).expect("a domain");
    let participant = domain.participant(b"").expect("a participant");
    let topic = participant.topic(
        "rq/default/Motor/anyRequest",
        "conformance_msgs::srv::dds_::any_Request_",
    );
    let (sender, matched) = channel();
    let listener = || Box::new(Matches(sender.clone()));
    let writer = participant.writer(&topic.expect("a topic"), &Qos::LOSSLESS, listener());
    let writer = writer.expect("a writer");
    let topic = participant.topic(
        "rr/default/Motor/anyReply",
        "conformance_msgs::srv::dds_::any_Response_",
    );
    let _replies = participant.reader(&topic.expect("a topic"), &Qos::LOSSLESS, listener());
    for _ in 0..2 {
        matched.recv_timeout(LIMIT).expect("the server");
    }
    let victim: Guid = [7; 16];
    let mut request = |guid| {
        let id = Identity { guid, number: 1 };
        writer.write_related(1, 1, &[0; 4], id).expect("to write");
        let begin = Instant::now();
        loop {
            let mut served = false;
            match server.serve(&mut |_, _, _| served = true) {
                Ok(false) => assert!(begin.elapsed() < LIMIT, "nothing arrives"),
                Ok(true) => return served.then_some(()).ok_or_else(String::new),
                Err(error) => return Err(error.to_string()),
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    let refusal = request(victim).expect_err("a refusal");
    assert!(refusal.contains("names another client"), "{refusal}");
    let own = writer.guid().expect("an identity");
    assert_eq!(request(own), Ok(()));
    drop((server, backend));
    directory.remove().expect("to remove it");
}
