//! Memory use, in a process of its own.

use rc_middleware::now;
use rc_middleware::rpc::{self, RequestId};
use rc_middleware::{
    Address, Endpoint, Environment, Header, Qos, Reader, RunDirectory, Settings, TypeIdentity,
    WakeEvent, Writer, wait,
};
use rc_vocabulary::Value;
use std::os::fd::AsFd;
use std::sync::mpsc::channel;
use std::time::Duration;

/// Longest time of a call.
const LIMIT: Duration = Duration::from_secs(30);
const CALLS: u64 = 10_000;
/// Most memory for unconfirmed samples on both sides, with the overhead of the allocator.
const KEPT: u64 = 6 << 10;

fn environment(instance: &str) -> Environment {
    let network = format!("growth-{}", std::process::id());
    let mut settings = Settings::default();
    settings.set("dds", "domain", Value::Int(15));
    settings.set("dds", "interfaces", Value::Texts(vec!["lo".to_owned()]));
    Environment {
        directory: RunDirectory::open(&network).expect("a run directory"),
        network,
        instance: instance.to_owned(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings,
    }
}

/// Anonymous memory of this process, in kB.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("a status");
    let line = status.lines().find(|line| line.starts_with("RssAnon"));
    let number = line.and_then(|line| line.split_whitespace().nth(1));
    number.and_then(|n| n.parse().ok()).expect("a number")
}

/// Calls without a pause, during which readers do not confirm by themselves.
#[test]
fn answered_calls_leave_nothing_behind() {
    let served = Endpoint {
        address: Address::parse("default/Motor").expect("an address"),
        types: TypeIdentity {
            name: "Test::Motor".to_owned(),
            hash: 7,
        },
        qos: Qos::CALL,
        external_types: Vec::new(),
    };
    let stop = WakeEvent::new().expect("a wake event");
    let here = environment("client");
    std::thread::scope(|scope| {
        let (ready, is_ready) = channel();
        let (stop, served) = (&stop, &served);
        scope.spawn(move || {
            let backend = rc_dds::connect(&environment("server")).expect("the domain");
            let mut server = backend.server(served).expect("a server");
            ready.send(()).expect("a test that waits");
            while !stop.is_stopping() {
                let woken = wait(&[server.descriptor(), stop.as_fd()], LIMIT) & 1 != 0;
                server.acknowledge(woken);
                while server
                    .serve(&mut |_, request, reply| {
                        let mut reader = Reader::new(request);
                        let opened = rpc::open_request(&mut reader).expect("an envelope");
                        let mut writer = Writer::default();
                        rpc::begin_reply(&mut writer, opened.0, opened.1, 0);
                        writer.put(&7_i32);
                        *reply.body() = writer.into_bytes();
                    })
                    .expect("requests")
                {}
            }
        });
        is_ready.recv_timeout(LIMIT).expect("a server");
        let backend = rc_dds::connect(&here).expect("the domain");
        let mut client = backend.client(served).expect("a client");
        let mut sequence = 0;
        let mut call = || {
            sequence += 1;
            let id = RequestId {
                writer: client.guid(),
                sequence,
            };
            let mut writer = Writer::default();
            rpc::begin_request(&mut writer, id, 5);
            writer.put(&1_i32);
            let header = Header {
                sequence,
                sent: now(),
                ..Header::default()
            };
            let request = writer.into_bytes();
            client.call(header, &request, LIMIT, &mut |_, _| ())
        };
        let before = {
            (0..CALLS).for_each(|_| call().expect("an answer"));
            memory()
        };
        (0..3 * CALLS).for_each(|_| call().expect("an answer"));
        let grown = memory().saturating_sub(before);
        stop.stop();
        assert!(grown < KEPT, "{grown} kB more after {} calls", 3 * CALLS);
    });
    here.directory
        .remove()
        .expect("a folder that can be removed");
}
