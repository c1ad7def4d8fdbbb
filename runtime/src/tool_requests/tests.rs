//! Requests of tools, without a component.

use super::*;
use crate::description::{Description, Slot};
use crate::hops::HopNotes;
use crate::slots::Listed;
use crate::waker::waker;
use rc_management::ServerSource;
use rc_management::hops::Way;
use rc_management::observation::TappedKind;
use rc_middleware::{Header, WakeEvent};
use rustix::event::PollFlags;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;

const SLOT: Slot = Slot {
    name: "Numbers",
    role: Role::Implements,
    interface: "Numbers",
    type_name: "Test::Numbers",
    type_hash: 7,
    backend: "none",
    qos: rc_middleware::Qos::CALL,
    is_array: false,
    operations: &[],
    external_types: &[],
};

pub(crate) static DESCRIPTION: Description = Description {
    name: "tested",
    model_hash: 1,
    middleware: "none",
    period: Duration::from_millis(2),
    parameters: None,
    folder: "/nowhere",
    slots: &[SLOT],
    types: &[],
    backends: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

fn tools(wake: &WakeEvent) -> (ToolRequests, Arc<CommandQueue>) {
    let commands = Arc::new(CommandQueue::new(wake.clone()));
    let (management, _wakeups) = waker().expect("a pair");
    let taps = Arc::new(Taps::new(1, None));
    let slots = Arc::new(SlotTable::replayed(&DESCRIPTION, ("n", "c"), Listed::new()));
    let tools = ToolRequests::new(
        slots,
        (taps, Arc::default()),
        Arc::clone(&commands),
        management,
    );
    (tools, commands)
}

#[test]
fn one_message_is_handled_a_turn_after_what_controls() {
    let wake = WakeEvent::new().expect("an event");
    let (mut tools, commands) = tools(&wake);
    let limit = Duration::from_mins(1);
    for client in 0..3 {
        let call = tools.call((client, None), "Numbers", vec![1], limit);
        assert_eq!(call, Ok(()));
    }
    commands.push(Command::Emergency(true));
    let mut turns = Vec::new();
    while rc_middleware::wait(&[wake.as_fd()], Duration::ZERO) > 0 {
        wake.clear();
        let turn = commands.take().1.map(|command| match command {
            Command::Message(_) => "message",
            Command::Emergency(_) => "emergency",
            _ => "another one",
        });
        turns.push(turn.collect::<Vec<_>>().join(" "));
    }
    assert_eq!(turns, ["emergency message", "message", "message"]);
}

#[test]
fn messages_that_wait_are_answered_at_the_end() {
    let (mut tools, _) = tools(&WakeEvent::new().expect("an event"));
    let limit = Duration::from_mins(1);
    let id = Some(Value::from(7));
    let call = tools.call((3, id.clone()), "Numbers", vec![1], limit);
    assert_eq!(call, Ok(()));
    let error = Error::new(Error::WORKER_REFUSES, "the component ends");
    assert_eq!(tools.end(), [(3, id, Err(error))]);
}

/// Connects a client that taps the slot. Returns its number, and its end.
fn tap(socket: &mut Socket<Tapping>, tools: &ToolRequests, path: &Path) -> (u64, UnixStream) {
    let stream = UnixStream::connect(path).expect("a connection");
    let listener = socket.descriptors().next();
    let listener = listener.map(|(source, _, flags)| (source, flags));
    let (source, flags) = listener.expect("a listener");
    socket.turn(source, flags);
    let known = (0..9).filter(|number| socket.client_mut(*number).is_some());
    let number = known.last().expect("a client");
    tools
        .tap(socket, number, "Numbers", true)
        .expect("to switch it on");
    (number, stream)
}

fn copy(body: Vec<u8>) -> Copied {
    Copied {
        slot: 0,
        kind: TappedKind::Request,
        operation: None,
        header: Header::default(),
        profile: Profile::Rpc,
        dropped: 0,
        body,
    }
}

#[test]
fn each_client_gets_the_number_of_messages_that_it_has_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("socket");
    let mut socket: Socket<Tapping> = Socket::bind(&path).expect("a socket");
    let (tools, _) = tools(&WakeEvent::new().expect("an event"));
    let _slow = tap(&mut socket, &tools, &path);
    for _ in 0..5 {
        tools.send(&mut socket, copy(vec![1; 1 << 20]));
    }
    let _quick = tap(&mut socket, &tools, &path);
    tools.send(&mut socket, copy(vec![1; 1 << 20]));
    tools.send(&mut socket, copy(vec![2]));
    let mut clients = socket.clients_mut();
    let mut lost = || clients.next().map(|client| client.state[&0].dropped);
    assert_eq!((lost(), lost()), (Some(4), Some(0)));
}

/// Lets the server write until the client has read so many lines.
fn read(
    socket: &mut Socket<Tapping>,
    number: u64,
    client: &UnixStream,
    lines: usize,
) -> Vec<Notification> {
    client.set_nonblocking(true).expect("a mode");
    let (mut text, mut piece) = (Vec::new(), vec![0; 1 << 16]);
    while text.split(|byte| *byte == b'\n').count() <= lines {
        socket.turn(ServerSource::Client(number), PollFlags::OUT);
        match (&*client).read(&mut piece) {
            Ok(count) if count > 0 => text.extend_from_slice(&piece[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            other => panic!("the connection has ended: {other:?}"),
        }
    }
    let lines = text.split(|byte| *byte == b'\n');
    let lines = lines.filter(|line| !line.is_empty()).map(|line| {
        let line: Value = serde_json::from_slice(line).expect("JSON");
        let method = line["method"].as_str().expect("a method");
        rpc::message(method, line["params"].clone()).expect("a notification")
    });
    lines.collect()
}

#[test]
fn a_long_copy_finds_room_at_a_client_that_has_read_everything() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("socket");
    let mut socket: Socket<Tapping> = Socket::bind(&path).expect("a socket");
    let (mut tools, _) = tools(&WakeEvent::new().expect("an event"));
    let (number, client) = tap(&mut socket, &tools, &path);
    // A picture of 1280 x 720 pixels with 3 bytes each.
    let picture = vec![7; 1280 * 720 * 3];
    tools.send(&mut socket, copy(picture.clone()));
    let received = read(&mut socket, number, &client, 1);
    let Some(Notification::Tapped(tapped)) = received.first() else {
        panic!("{} notifications", received.len());
    };
    assert!(tapped.body == picture && tapped.dropped == 0);
    // A line longer than any message is lost, and no later copy has to report it.
    tools.send(&mut socket, copy(vec![7; LONGEST]));
    tools.turn(&mut socket);
    let told = |dropped| Notification::Dropped {
        slot: "Numbers".to_owned(),
        dropped,
    };
    assert_eq!(read(&mut socket, number, &client, 1), [told(1)]);
    tools.turn(&mut socket);
    let client = socket.client_mut(number).expect("the client");
    assert_eq!(client.waiting(), 0, "a loss is told once");
}

/// The supervisor has asked and given up, and asks again on another connection: the first request
/// takes no notes, and does not keep them from the second one.
#[test]
fn notes_wait_for_a_client_that_reads_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("socket");
    let mut socket: Socket<Tapping> = Socket::bind(&path).expect("a socket");
    let (mut tools, _) = tools(&WakeEvent::new().expect("an event"));
    let [client, _other] = [0, 1].map(|_| {
        let client = UnixStream::connect(&path).expect("a connection");
        socket.turn(ServerSource::Listener(0), PollFlags::IN);
        client
    });
    let [first, second] = [0, 1];
    let output = FollowedEnd {
        slots: vec![0],
        operation: 0,
        id: 5,
    };
    let pair = FollowedPair {
        input: None,
        output: Some(output),
        way: Way::Any,
        stamp: None,
    };
    tools.follower = Some(first);
    tools.hops.follow(vec![pair]);
    let notes = HopNotes::new(Arc::clone(&tools.hops));
    notes.published(0, 0, &Header::default(), || &[]);
    let ask = b"{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"hops\"}\n";
    (&client).write_all(ask).expect("to ask");
    drop(client);
    socket.turn(ServerSource::Client(first), PollFlags::IN | PollFlags::HUP);
    assert_eq!(socket.requests().len(), 1, "it counts");
    tools.hops(&mut socket, first, true).expect_err("nobody");
    tools.turn(&mut socket);
    let (waits, _) = tools.hops.take();
    assert_eq!(waits.len(), 1);
    // The first connection is there until the end of the turn.
    tools.follow(&mut socket, second, &[]).expect("to follow");
}
