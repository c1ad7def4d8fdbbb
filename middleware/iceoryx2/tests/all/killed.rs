//! Killed processes.

use crate::processes::{Network, Process, ask, map};
use rc_conformance::network::{
    LIMIT, StopOnDrop, endpoint, header, receive, receive_all, serve_until, until,
};
use rc_middleware::{CallError, OpenError, WakeEvent, wait};
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

#[test]
fn a_killed_server_ends_the_call_and_is_replaced() {
    let network = Network::new("ks");
    let backend = network.join("client");
    let motor = endpoint("default/Motor");
    let mut client = backend.client(&motor).expect("a client");
    for _ in 0..3 {
        let mut server = network.start("server");
        assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        let refused = backend.server(&motor).err();
        let holder = format!("pid {} (server)", server.child.id());
        assert!(
            matches!(&refused, Some(OpenError::AddressTaken { holder: other, .. }) if *other == holder),
            "{refused:?}"
        );

        // Kill the server while it handles the call.
        let (died, late) = std::thread::scope(|scope| {
            let killer = scope.spawn(|| {
                server.says("holding");
                server.kill();
                Instant::now()
            });
            let died = ask(&mut *client, b"hold");
            let noticed = Instant::now();
            let killed = killer.join().expect("the killing thread");
            (died, noticed.saturating_duration_since(killed))
        });
        assert_eq!(died, Err(CallError::ServerDied("default/Motor".to_owned())));
        assert!(late < LIMIT / 10, "noticed after {late:?}");
        let nobody = Err(CallError::NoServer("default/Motor".to_owned()));
        assert_eq!(ask(&mut *client, b"still?"), nobody);
        assert_eq!(client.peers(), 0);

        // Kill the server while no call is pending.
        let mut server = network.start("server");
        assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        server.kill();
        assert_eq!(
            client.send(header(1), b"command"),
            Err(CallError::NoServer("default/Motor".to_owned()))
        );
    }
    // A process that has the service open can take the place of a dead server.
    let mut server = network.start("server");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    server.kill();
    let own = backend
        .server(&motor)
        .expect("the place of the dead server");
    assert_eq!(own.peers(), 1);
}

/// Calls that were started end once, also those that the killed server had not taken.
#[test]
fn a_killed_server_ends_started_calls() {
    let network = Network::new("kt");
    let backend = network.join("client");
    let motor = endpoint("default/Motor");
    let mut client = backend.client(&motor).expect("a client");
    let mut server = network.start("server");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    for (sequence, request) in [(1, &b"hold"[..]), (2, b"queued"), (3, b"queued")] {
        client
            .start(header(sequence), &request, LIMIT)
            .expect("to be started");
    }
    server.says("holding");
    assert_eq!(client.poll(&mut |_, _, _| {}), None);
    server.kill();
    let killed = Instant::now();
    for sequence in 1..=3 {
        let ended = loop {
            if let Some(ended) = client.poll(&mut |_, _, _| panic!("a reply")) {
                break ended;
            }
            assert!(killed.elapsed() < LIMIT, "the calls do not end");
            let awaiting = client.awaiting().expect("a started call");
            let left = awaiting.until.saturating_duration_since(Instant::now());
            wait(&[awaiting.descriptor], left);
        };
        let died = CallError::ServerDied("default/Motor".to_owned());
        assert_eq!(ended, (sequence, Err(died)));
    }
    assert!(killed.elapsed() < LIMIT / 10, "{:?}", killed.elapsed());
    assert_eq!(client.poll(&mut |_, _, _| {}), None);
    assert!(client.awaiting().is_none());
    let nobody = Err(CallError::NoServer("default/Motor".to_owned()));
    assert_eq!(client.start(header(4), b"still?", LIMIT), nobody);
}

/// Removing the files of dead processes takes seconds. Calls do not wait for it.
#[test]
fn a_call_keeps_its_deadline_while_many_processes_die() {
    const TIMEOUT: Duration = Duration::from_secs(1);
    let network = Network::new("km");
    let backend = network.join("client");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    let mut killed = vec![network.begin("server")];
    killed.extend((0..30).map(|_| network.begin("idle")));
    killed.iter_mut().for_each(|process| process.says("ready"));
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));

    // Holds up every clean-up for half a second, like a process stopped while it opens an endpoint.
    let root = network
        .environment("client")
        .directory
        .middleware(rc_iceoryx2::NAME);
    let opening = File::open(&root).expect("the root");
    flock(&opening, FlockOperation::LockShared).expect("the lock of openings");
    for process in &mut killed {
        process.child.kill().expect("to kill");
    }
    killed[0].child.wait().expect("to reap");
    let start = Instant::now();
    let reply = ask(&mut *client, b"still?");
    assert!(
        matches!(
            reply,
            Err(CallError::ServerDied(_) | CallError::NoServer(_))
        ),
        "{reply:?}"
    );
    assert_eq!(client.peers(), 0);
    let took = start.elapsed();
    assert!(took < Duration::from_millis(500), "{took:?}");
    drop(opening);
    let successor = std::thread::scope(|scope| {
        let starter = scope.spawn(|| network.start("server"));
        let end = Instant::now() + LIMIT;
        loop {
            let start = Instant::now();
            let answered = client.call(header(1), b"here", TIMEOUT, &mut |_, _| {});
            let took = start.elapsed();
            assert!(took < 2 * TIMEOUT, "{answered:?} after {took:?}");
            let start = Instant::now();
            client.peers();
            assert!(start.elapsed() < TIMEOUT, "{:?}", start.elapsed());
            if answered.is_ok() {
                return starter.join().expect("a successor");
            }
            assert!(Instant::now() < end, "{answered:?}");
            wait(&[], Duration::from_millis(1));
        }
    });
    drop(successor);
    until("what the dead left is gone", || {
        assert_eq!(client.peers(), 0);
        // One folder per node.
        let nodes = entries(&root.join("nodes"));
        nodes.iter().filter(|path| path.is_dir()).count() == 1
    });
}

/// The clean-up releases the lock for openings again and again.
#[test]
fn openings_proceed_during_the_clean_up_of_many_processes() {
    const DEAD: usize = 24;
    let network = Network::new("kb");
    let holder = rc_iceoryx2::Holder::new(&network.environment("holder")).expect("a holder");
    let mut killed: Vec<_> = (0..DEAD).map(|_| network.begin("idle")).collect();
    killed.iter_mut().for_each(|process| process.says("ready"));
    killed.iter_mut().for_each(Process::kill);
    let root = network
        .environment("holder")
        .directory
        .middleware(rc_iceoryx2::NAME);
    let opening = File::open(&root).expect("the root");
    let turns = std::thread::scope(|scope| {
        let cleaner = scope.spawn(|| until("all are gone", || holder.clean() == 0));
        let (mut turns, mut waited) = (0, false);
        while !cleaner.is_finished() {
            match flock(&opening, FlockOperation::NonBlockingLockShared) {
                Ok(()) => {
                    turns += usize::from(waited);
                    waited = false;
                    flock(&opening, FlockOperation::Unlock).expect("to unlock");
                }
                Err(_) => waited = true,
            }
            wait(&[], Duration::from_micros(50));
        }
        turns
    });
    assert!(turns >= 2, "{turns} turns");
}

/// Many processes that need the places of the dead wait for one that cleans up, and do not list all
/// nodes themselves.
#[test]
fn one_clean_up_serves_all_that_wait() {
    const DEAD: usize = 8;
    const WAITING: usize = 10;
    let network = Network::new("ko");
    let holders: Vec<_> = (0..WAITING)
        .map(|at| network.environment(&format!("holder{at}")))
        .map(|environment| rc_iceoryx2::Holder::new(&environment).expect("a holder"))
        .collect();
    let mut killed: Vec<_> = (0..DEAD).map(|_| network.begin("idle")).collect();
    killed.iter_mut().for_each(|process| process.says("ready"));
    let root = network
        .environment("holder")
        .directory
        .middleware(rc_iceoryx2::NAME);
    // No process cleans up, nor begins to.
    let leading = lead(&root);
    let before = rounds(&root);
    killed.iter_mut().for_each(Process::kill);
    let (waits, waiting) = channel();
    std::thread::scope(|scope| {
        // A panic drops it, and the others do not wait forever.
        let leading = leading;
        for holder in &holders {
            let mut waits = Some(waits.clone());
            scope.spawn(move || {
                holder.clean_while(&mut |_| {
                    if let Some(waits) = waits.take() {
                        waits.send(()).expect("a test that waits");
                    }
                    true
                });
            });
        }
        for _ in &holders {
            waiting.recv_timeout(LIMIT).expect("a holder that waits");
        }
        drop(leading);
    });
    let [begun, completed, removed] = rounds(&root);
    assert_eq!(removed - before[2], DEAD as u64);
    assert_eq!(begun - before[0], 1);
    assert_eq!(completed, begun);
}

/// Takes the place of each process that may clean up, and of those that follow a stopped one.
fn lead(root: &Path) -> Vec<File> {
    let names = ["lock", "lock1", "lock2", "lock3"];
    let files = names.map(|name| {
        let mut options = File::options();
        let file = options.create(true).truncate(false).write(true);
        let file = file.open(root.join("cleaning").with_extension(name));
        let file = file.expect("a lock file");
        flock(&file, FlockOperation::LockExclusive).expect("the lock of clean-ups");
        file
    });
    files.into()
}

/// How many clean-ups have begun, how many were completed, and how many nodes they removed: the
/// numbers in `cleaning.rounds`.
fn rounds(root: &Path) -> [u64; 3] {
    let bytes = std::fs::read(root.join("cleaning.rounds")).unwrap_or_default();
    let number = |at: usize| {
        let bytes = bytes.get(at..at + 8).map(TryInto::try_into);
        bytes.map_or(0, |bytes| u64::from_le_bytes(bytes.expect("eight bytes")))
    };
    [number(0), number(8), number(16)]
}

/// The processes die with a loan that is written and not sent.
#[test]
fn loans_of_dead_processes_are_neither_sent_nor_leaked() {
    let network = Network::new("kl");
    let backend = network.join("both");
    let mut scan = backend
        .subscriber(&endpoint("default/Laser/scan"))
        .expect("a subscriber");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    let directory = network.environment("both").directory;
    let mut used = Vec::new();
    for round in 0..30 {
        let mut publisher = network.start("lending publisher");
        for (_, body) in receive(&mut *scan, 3) {
            assert_eq!(body, [1; 500]);
        }
        let mut server = network.start("lending server");
        assert_eq!(ask(&mut *client, b"here"), Ok([b'h'; 500].to_vec()));
        used.push(
            rc_iceoryx2::leftovers(&directory)
                .iter()
                .filter_map(|path| path.metadata().ok())
                .map(|metadata| metadata.blocks() * 512)
                .sum::<u64>(),
        );
        publisher.kill();
        let died = std::thread::scope(|scope| {
            scope.spawn(|| {
                server.says("holding");
                server.kill();
            });
            ask(&mut *client, b"hold")
        });
        let expected = Err(CallError::ServerDied("default/Motor".to_owned()));
        assert_eq!(died, expected, "round {round}");
        assert!(receive_all(&mut *scan).is_empty(), "round {round}");
    }
    // An additional page per round would double the usage. (One of the last rounds may not be
    // cleaned up yet.)
    let (early, late) = (used[9], used[25..].iter().min().expect("a round"));
    assert!(*late <= early + early / 10, "{used:?}");
}

/// The clean-up removes the tag of a dead endpoint before it frees the endpoint's place. A cleaner
/// killed in between leaves dead endpoints without tags, and backups of the tags.
#[test]
fn a_killed_cleaner_is_replaced() {
    let network = Network::new("kk");
    let backend = network.join("bystander");
    // Keeps the service open.
    let _client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    let directory = network.environment("bystander").directory;
    let root = directory.middleware(rc_iceoryx2::NAME);
    let living = entries(&root.join("nodes"));
    for _ in 0..3 {
        network.start("server").kill();
        let mut tags = 0;
        let nodes = entries(&root.join("nodes"));
        for node in nodes.iter().filter(|node| !living.contains(node)) {
            let kept = root.join("tags").join(node.file_name().expect("a name"));
            for tag in entries(node) {
                if tag.extension().is_some_and(|e| e == "port_tag") {
                    std::fs::create_dir_all(&kept).expect("a folder");
                    let name = tag.file_name().expect("a name");
                    std::fs::rename(&tag, kept.join(name)).expect("to move");
                    tags += 1;
                }
            }
        }
        // A server and its listener.
        assert_eq!(tags, 2);
        let mut server = network.start("server");
        assert!(entries(&root.join("tags")).is_empty());
        server.kill();
    }
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    entries
        .map(|entry| entry.expect("an entry").path())
        .collect()
}

#[test]
fn a_killed_publisher_is_replaced() {
    let network = Network::new("kp");
    let backend = network.join("subscriber");
    let mut scan = backend
        .subscriber(&endpoint("default/Laser/scan"))
        .expect("a subscriber");
    let mut late = backend.subscriber(&map()).expect("a subscriber");
    // More than the maximum number at a time.
    for _ in 0..20 {
        let mut publisher = network.start("publisher");
        receive(&mut *scan, 20);
        receive(&mut *late, 20);
        publisher.kill();
    }
    let holder = rc_iceoryx2::Holder::new(&network.environment("holder")).expect("a holder");
    holder.clean();
    until("the dead publishers are gone", || {
        scan.peers() + late.peers() == 0
    });
}

#[test]
fn killed_subscribers_and_clients_free_their_places() {
    let network = Network::new("kc");
    let backend = network.join("all");
    let mut publisher = backend
        .publisher(&endpoint("default/Laser/scan"))
        .expect("a publisher");
    let stop = WakeEvent::new().expect("a wake event");
    std::thread::scope(|scope| {
        let (network, stop) = (&network, &stop);
        scope.spawn(move || {
            let backend = network.join("server");
            let mut server = backend
                .server(&endpoint("default/Motor"))
                .expect("a server");
            serve_until(&mut *server, stop, &|_, request, reply| {
                reply.extend_from_slice(request);
            });
        });
        let _stop = StopOnDrop(stop);
        let mut client = backend
            .client(&endpoint("default/Motor"))
            .expect("a client");
        until("the server is there", || client.peers() == 1);
        // More than the maximum number at a time.
        for _ in 0..20 {
            let mut killed: Vec<_> = (0..4).map(|_| network.start("client")).collect();
            killed.push(network.start("subscriber"));
            publisher.publish(header(1), b"x").expect("to publish");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
            killed.iter_mut().for_each(Process::kill);
            publisher.publish(header(2), b"x").expect("to publish");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        }
    });
}

#[test]
fn a_holder_keeps_services_and_a_wipe_removes_them() {
    let network = Network::new(&format!("a-network-with-a-name-of-{}", "x".repeat(60)));
    let environment = network.environment("holder");
    let mut holder = rc_iceoryx2::Holder::new(&environment).expect("a holder");
    holder
        .hold_topic(&endpoint("default/Laser/scan"))
        .expect("to hold");
    holder.hold_topic(&map()).expect("to hold");
    holder
        .hold_call(&endpoint("default/Motor"))
        .expect("to hold");
    let mut server = network.start("server");
    let backend = network.join("client");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    server.kill();
    assert_eq!(holder.clean(), 1);
    assert_eq!(client.peers(), 0);
    // The last process that leaves removes everything.
    assert!(!rc_iceoryx2::leftovers(&environment.directory).is_empty());
    drop((client, backend, holder));
    assert!(rc_iceoryx2::leftovers(&environment.directory).is_empty());
    // A killed process cannot clean up; `wipe` does.
    network.start("server").kill();
    assert!(!rc_iceoryx2::leftovers(&environment.directory).is_empty());
    assert!(rc_iceoryx2::wipe(&environment.directory).expect("to wipe") > 0);
    assert!(rc_iceoryx2::leftovers(&environment.directory).is_empty());
}

/// Kills processes at many moments of their start while a holder keeps the services open. Later
/// processes must not be affected. (Without a holder, a kill can leave an incomplete service;
/// openings then fail after their time limit, see `docs/shared-memory-wire.md`.)
#[test]
fn a_process_killed_at_its_start_harms_nobody() {
    let network = Network::new("st");
    let mut holder = rc_iceoryx2::Holder::new(&network.environment("holder")).expect("a holder");
    holder
        .hold_topic(&endpoint("default/Laser/scan"))
        .expect("to hold");
    holder.hold_topic(&map()).expect("to hold");
    holder
        .hold_call(&endpoint("default/Motor"))
        .expect("to hold");
    for step in 0..40 {
        for role in ["server", "publisher", "subscriber"] {
            let mut killed = network.begin(role);
            wait(&[], Duration::from_micros(2000 + 250 * step));
            killed.kill();
        }
        if step % 10 == 9 {
            let backend = network.join("client");
            let motor = endpoint("default/Motor");
            let mut client = backend.client(&motor).expect("a client");
            let mut scan = backend
                .subscriber(&endpoint("default/Laser/scan"))
                .expect("a subscriber");
            let _server = network.start("server");
            let _publisher = network.start("publisher");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
            receive(&mut *scan, 5);
        }
    }
}
