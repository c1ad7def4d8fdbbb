//! The server of a management socket, with clients that come, go and say strange things.

use rc_management::rpc::Error;
use rc_management::server::{MAX_CLIENTS, Received};
use rc_management::{Server, ServerSource};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, getpid, getppid};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_secs(30);

struct Bench {
    server: Server,
    path: PathBuf,
    _folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.sock");
        Self {
            server: Server::bind(&path).expect("a socket"),
            path,
            _folder: folder,
        }
    }

    fn connect(&mut self) -> UnixStream {
        let stream = UnixStream::connect(&self.path).expect("a connection");
        stream.set_read_timeout(Some(LIMIT)).expect("a limit");
        // So that clients are older in the order of their connections.
        self.turn();
        stream
    }

    /// One turn of the owner's loop, which waits for nothing. Returns the requests.
    fn turn(&mut self) -> Vec<Received> {
        let ready: Vec<(ServerSource, PollFlags)> = {
            let (sources, mut polled): (Vec<_>, Vec<_>) = self
                .server
                .descriptors()
                .map(|(source, fd, flags)| (source, PollFd::from_borrowed_fd(fd, flags)))
                .unzip();
            poll(&mut polled, Some(&Timespec::default())).expect("it can be waited for");
            let events = polled.iter().map(PollFd::revents);
            let ready = sources.into_iter().zip(events);
            ready.filter(|(_, events)| !events.is_empty()).collect()
        };
        for (source, events) in ready {
            self.server.turn(source, events);
        }
        let requests = self.server.requests();
        self.server.check(Instant::now());
        requests
    }

    fn clients(&mut self) -> usize {
        self.server.clients_mut().count()
    }
}

fn request(id: u32) -> String {
    format!("{{\"id\":{id},\"method\":\"status\"}}\n")
}

fn ids(requests: &[Received]) -> Vec<Value> {
    let calls = requests.iter().map(|request| request.call.as_ref());
    calls
        .map(|call| call.expect("a request").id.clone().expect("an identifier"))
        .collect()
}

fn line(stream: &UnixStream) -> Value {
    let mut line = String::new();
    let mut reader = BufReader::new(stream);
    reader.read_line(&mut line).expect("an answer");
    serde_json::from_str(&line).expect("JSON")
}

#[test]
fn each_client_gets_one_request_served_a_turn() {
    let mut bench = Bench::new();
    let [mut many, mut few] = [bench.connect(), bench.connect()];
    let requests: String = (0..5).map(request).collect();
    many.write_all(requests.as_bytes()).expect("written");
    few.write_all(request(7).as_bytes()).expect("written");
    let first = bench.turn();
    assert_eq!(ids(&first), [0, 7]);
    assert!(
        bench.server.deadline() <= Some(Instant::now()),
        "there is more to do"
    );
    for received in first {
        bench
            .server
            .answer(received.client, &7.into(), Ok(json!({})));
    }
    for id in 1..5 {
        let requests = bench.turn();
        assert_eq!(ids(&requests), [id]);
        bench
            .server
            .answer(requests[0].client, &id.into(), Ok(json!({})));
    }
    assert_eq!(bench.turn(), []);
    assert_eq!(bench.server.deadline(), None);
}

#[test]
fn a_client_that_takes_no_answer_is_not_served_on() {
    let mut bench = Bench::new();
    let mut slow = bench.connect();
    slow.write_all((request(1) + &request(2)).as_bytes())
        .expect("written");
    let requests = bench.turn();
    let long = Value::from("x".repeat(1 << 20));
    bench
        .server
        .answer(requests[0].client, &1.into(), Ok(long.clone()));
    assert_eq!(bench.turn(), []);
    let deadline = bench.server.deadline().expect("a deadline");
    assert!(deadline > Instant::now());
    // A part is not all.
    slow.read_exact(&mut [0; 1000]).expect("a part");
    assert_eq!(bench.turn(), []);
    assert_eq!(
        bench.server.deadline(),
        Some(deadline),
        "which gains it no time"
    );

    // As soon as it has taken the answer, it is served on.
    let reader = std::thread::spawn(move || {
        let read = BufReader::new(&slow).skip_until(b'\n');
        (read, slow)
    });
    let start = Instant::now();
    let next = loop {
        assert!(start.elapsed() < LIMIT);
        let requests = bench.turn();
        if !requests.is_empty() {
            break requests;
        }
    };
    assert_eq!(ids(&next), [2]);
    let (read, _slow) = reader.join().expect("it reads");
    assert!(read.expect("the rest") > 1 << 19);
}

#[test]
fn answers_that_take_their_time_have_a_bound() {
    let mut bench = Bench::new();
    let mut client = bench.connect();
    let requests: String = (0..100).map(request).collect();
    client.write_all(requests.as_bytes()).expect("written");
    let mut waiting = Vec::new();
    for _ in 0..100 {
        for received in bench.turn() {
            bench.server.defer(received.client);
            waiting.push(received.client);
        }
    }
    assert_eq!(waiting.len(), 16);
    bench.server.settle(waiting[0]);
    bench.server.answer(waiting[0], &0.into(), Ok(json!({})));
    assert_eq!(bench.turn().len(), 1);
}

#[test]
fn the_client_that_was_idle_the_longest_gives_way() {
    let mut bench = Bench::new();
    let mut clients: Vec<UnixStream> = (0..MAX_CLIENTS).map(|_| bench.connect()).collect();
    // The first one waits for an answer, the second one has asked last.
    for id in [0, 1] {
        clients[id]
            .write_all(request(7).as_bytes())
            .expect("written");
        let requests = bench.turn();
        bench.server.defer(requests[0].client);
        if id == 1 {
            bench.server.settle(requests[0].client);
            bench
                .server
                .answer(requests[0].client, &7.into(), Ok(json!({})));
        }
    }
    // The third one follows notifications.
    let third = bench.server.clients_mut().nth(2);
    third.expect("a client").follows = true;
    let _new = bench.connect();
    assert_eq!(bench.clients(), MAX_CLIENTS);
    assert_eq!(clients[3].read(&mut [0]).expect("its end"), 0);
    assert_eq!(line(&clients[1])["id"], 7);
    // If no client is idle, the oldest one gives way, so one always does.
    for client in &mut clients {
        let _ = client.write_all(request(8).as_bytes());
    }
    for received in bench.turn() {
        bench.server.defer(received.client);
    }
    let _another = bench.connect();
    assert_eq!(bench.clients(), MAX_CLIENTS);
}

/// A client that connects, asks, and gets its answer, so that it was active last.
fn asks(bench: &mut Bench, client: &mut UnixStream, id: u32) {
    client.write_all(request(id).as_bytes()).expect("written");
    for received in bench.turn() {
        if received.call.is_ok_and(|call| call.id == Some(id.into())) {
            bench
                .server
                .answer(received.client, &id.into(), Ok(json!({})));
        }
    }
    assert_eq!(line(client)["id"], id);
}

#[test]
fn a_client_whose_requests_or_output_wait_is_not_idle() {
    let mut bench = Bench::new();
    let mut clients: Vec<UnixStream> = (0..MAX_CLIENTS).map(|_| bench.connect()).collect();
    // The requests of the first one outlast the test, the second one has not read all.
    let requests = request(9999).repeat(10 * MAX_CLIENTS);
    clients[0].write_all(requests.as_bytes()).expect("written");
    let piece = vec![b'x'; 1 << 20];
    let second = bench.server.clients_mut().nth(1).expect("a client");
    second.push(&piece);
    bench.server.flush();
    for (id, client) in (0..).zip(&mut clients).skip(2) {
        asks(&mut bench, client, id);
    }
    let before: Vec<usize> = bench.server.clients_mut().map(|c| c.waiting()).collect();
    let _new = bench.connect();
    assert_eq!(bench.clients(), MAX_CLIENTS);
    assert!(before[1] > 0);
    assert_eq!(clients[2].read(&mut [0]).expect("its end"), 0);
    for client in &mut clients[..2] {
        client.set_nonblocking(true).expect("a mode");
        assert!(!matches!(client.read(&mut [0]), Ok(0)), "it is connected");
    }
}

#[test]
fn the_only_connection_of_the_supervisor_never_gives_way() {
    let mut bench = Bench::new();
    let (own, other) = (getpid(), getppid().unwrap_or(Pid::INIT));
    bench.server.reserve(own);
    let mut supervisor = bench.connect();
    // All others are of another process, as far as the server knows.
    bench.server.reserve(other);
    let mut clients: Vec<UnixStream> = (1..MAX_CLIENTS).map(|_| bench.connect()).collect();
    let mut more = vec![bench.connect(), bench.connect()];
    assert_eq!(bench.clients(), MAX_CLIENTS);
    for client in &mut clients[..2] {
        assert_eq!(client.read(&mut [0]).expect("its end"), 0);
    }
    // A second connection of the supervisor is its new one: the old one gives way.
    bench.server.reserve(own);
    more.push(bench.connect());
    supervisor.set_nonblocking(true).expect("a mode");
    let is_connected = supervisor.read(&mut [0]);
    assert!(is_connected.is_err_and(|e| e.kind() == ErrorKind::WouldBlock));
    supervisor.set_nonblocking(false).expect("a mode");
    more.push(bench.connect());
    assert_eq!(supervisor.read(&mut [0]).expect("its end"), 0);
}

#[test]
fn what_was_asked_before_the_end_counts_and_half_a_request_does_not() {
    let mut bench = Bench::new();
    let mut client = bench.connect();
    client
        .write_all((request(1) + &request(2) + "{\"id\":3,\"method\":\"stop\"}").as_bytes())
        .expect("written");
    drop(client);
    let mut seen = Vec::new();
    for _ in 0..10 {
        let requests = bench.turn();
        seen.extend(ids(&requests));
        for received in requests {
            bench
                .server
                .answer(received.client, &1.into(), Ok(json!({})));
        }
    }
    assert_eq!(seen, [1, 2]);
    assert_eq!(bench.clients(), 0);
}

#[test]
fn a_client_that_sends_no_more_still_gets_its_answers() {
    let mut bench = Bench::new();
    let mut client = bench.connect();
    client.write_all(request(1).as_bytes()).expect("written");
    client
        .shutdown(std::net::Shutdown::Write)
        .expect("a connection");
    let requests = bench.turn();
    bench.server.defer(requests[0].client);
    for _ in 0..5 {
        bench.turn();
    }
    bench.server.settle(requests[0].client);
    bench
        .server
        .answer(requests[0].client, &1.into(), Ok(json!({})));
    assert_eq!(line(&client)["id"], 1);
    bench.turn();
    assert_eq!(bench.clients(), 0);
}

#[test]
fn notifications_have_a_bound_and_no_deadline() {
    let mut bench = Bench::new();
    let (_idle, _slow) = (bench.connect(), bench.connect());
    let piece = vec![b'x'; 1 << 20];
    let slow = |bench: &mut Bench| {
        let slow = bench.server.clients_mut().nth(1).expect("a client");
        slow.push(&piece);
        let waiting = slow.waiting();
        bench.server.flush();
        waiting
    };
    while slow(&mut bench) <= 4 << 20 {
        assert_eq!(bench.server.deadline(), None);
        assert_eq!(bench.clients(), 2);
    }
    slow(&mut bench);
    assert_eq!(bench.clients(), 1, "only this client is dropped");
}

#[test]
fn an_answer_that_nobody_could_read_is_an_error() {
    let mut bench = Bench::new();
    let mut client = bench.connect();
    client.write_all(request(1).as_bytes()).expect("written");
    let requests = bench.turn();
    let long = Value::from("x".repeat(5 << 20));
    bench.server.answer(requests[0].client, &1.into(), Ok(long));
    let answer = line(&client);
    assert_eq!(answer["error"]["code"], Error::SYSTEM);
    // A request has a bound, too.
    let long = "x".repeat(100_000) + "\n" + &request(2);
    let mut sender = client.try_clone().expect("a socket");
    let writer = std::thread::spawn(move || sender.write_all(long.as_bytes()));
    let mut seen = Vec::new();
    while seen.len() < 2 {
        seen.extend(bench.turn());
    }
    assert!(
        seen[0]
            .call
            .as_ref()
            .is_err_and(|e| e.code == Error::INVALID_PARAMS)
    );
    assert_eq!(ids(&seen[1..]), [2]);
    writer.join().expect("written").expect("written");
    let _ = client.as_fd();
}

#[test]
fn a_client_that_takes_no_answer_in_time_is_dropped_and_no_other() {
    let mut bench = Bench::new();
    let (mut slow, _other) = (bench.connect(), bench.connect());
    slow.write_all(request(1).as_bytes()).expect("written");
    let requests = bench.turn();
    let asked = Instant::now();
    let long = Value::from("x".repeat(1 << 20));
    bench.server.answer(requests[0].client, &1.into(), Ok(long));
    let deadline = bench.server.deadline().expect("a deadline");
    let patience = Duration::from_secs(5);
    assert!(asked + patience <= deadline && deadline <= Instant::now() + patience);
    bench.turn();
    assert_eq!(bench.clients(), 2, "it has time until then");
    std::thread::sleep(deadline.saturating_duration_since(Instant::now()));
    bench.turn();
    assert_eq!(bench.clients(), 1);
    assert_eq!(bench.server.deadline(), None);
}

#[test]
fn a_socket_that_was_removed_is_made_again_and_its_clients_stay() {
    let mut bench = Bench::new();
    let mut old = bench.connect();
    assert!(!bench.server.restore().expect("a socket"), "it is there");
    std::fs::remove_file(&bench.path).expect("it is ours");
    assert!(bench.server.restore().expect("a socket"));
    assert!(!bench.server.restore().expect("a socket"));
    let mut new = bench.connect();
    old.write_all(request(1).as_bytes()).expect("written");
    new.write_all(request(2).as_bytes()).expect("written");
    assert_eq!(ids(&bench.turn()), [1, 2]);
    // Another file in its place is replaced: the owner has the path.
    std::fs::remove_file(&bench.path).expect("it is ours");
    std::fs::write(&bench.path, "").expect("written");
    assert!(bench.server.restore().expect("a socket"));
    bench.connect();
    assert_eq!(bench.clients(), 3);
    // Without its folder, nothing is possible.
    std::fs::remove_dir_all(bench.path.parent().expect("a folder")).expect("it is ours");
    assert!(bench.server.restore().is_err());
    assert_eq!(bench.clients(), 3);
}
