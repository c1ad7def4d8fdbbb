//! A component in a process of its own, with its supervisor and with clients that behave badly.

use rc_management::component::{Changed, Done, Request, State, Status};
use rc_management::lines::{Line, Lines, Overlong};
use rc_management::link::{ComponentMessage, Heartbeat, SupervisorMessage};
use rc_management::{Client, rpc};
use rustix::net::sockopt::{set_socket_recv_buffer_size, set_socket_send_buffer_size};
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, kill_process, prlimit};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(15);
const PROGRAM: &str = env!("CARGO_BIN_EXE_rc-test-component");

/// The component, and this process as its supervisor.
struct Supervised {
    child: Child,
    link: UnixStream,
    lines: Lines,
    folder: TempDir,
}

impl Supervised {
    /// Starts it. `before` has both ends of its link: this one's, and the component's.
    fn start(before: impl FnOnce(&UnixStream, &UnixStream)) -> Self {
        Self::start_as(Command::new(PROGRAM), before)
    }

    fn start_as(mut command: Command, before: impl FnOnce(&UnixStream, &UnixStream)) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (link, theirs) = UnixStream::pair().expect("a pair");
        before(&link, &theirs);
        link.set_read_timeout(Some(LIMIT)).expect("a limit");
        let child = command
            .args(["--network", "n", "--name", "quiet"])
            .env("RC_SUPERVISED", "1")
            .env("XDG_RUNTIME_DIR", folder.path())
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .spawn()
            .expect("it starts");
        Self {
            child,
            link,
            lines: Lines::new(Overlong::Skip),
            folder,
        }
    }

    fn ready() -> Self {
        let mut supervised = Self::start(|_, _| {});
        supervised.until(|message| *message == ComponentMessage::Ready);
        supervised
    }

    /// The messages up to the first one that `is` wanted.
    fn until(&mut self, is: impl Fn(&ComponentMessage) -> bool) -> Vec<ComponentMessage> {
        let mut messages = Vec::new();
        let start = Instant::now();
        while !messages.iter().any(&is) {
            assert!(start.elapsed() < LIMIT, "{messages:?}");
            let (lines, ended) = self.lines.read(&self.link);
            assert!(!ended, "the link has ended after {messages:?}");
            // What filled the link is not a message.
            let lines = lines.iter().filter_map(Line::bytes);
            messages.extend(lines.filter_map(|line| ComponentMessage::decode(line).ok()));
        }
        messages
    }

    /// Sends messages at once.
    fn tell(&self, messages: &[SupervisorMessage]) {
        let lines: Vec<u8> = messages.iter().flat_map(rpc::notification).collect();
        (&self.link).write_all(&lines).expect("to tell it");
    }

    /// The messages up to the answer to a proposal, and what the worker has accepted.
    fn accepted(&mut self, of: u64) -> (Vec<ComponentMessage>, Changed) {
        let accepted = |message: &ComponentMessage| match message {
            ComponentMessage::Proposed {
                number, changes, ..
            } if *number == of => Some(changes.clone()),
            _ => None,
        };
        let messages = self.until(|message| accepted(message).is_some());
        let changed = messages.iter().find_map(accepted);
        (messages, changed.expect("an answer"))
    }

    fn heartbeat(&mut self) -> Heartbeat {
        let is = |message: &ComponentMessage| matches!(message, ComponentMessage::Heartbeat(_));
        let messages = self.until(is);
        let heartbeat = messages.into_iter().find_map(|message| match message {
            ComponentMessage::Heartbeat(heartbeat) => Some(heartbeat),
            _ => None,
        });
        heartbeat.expect("a heartbeat")
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("robocomp/n/quiet.sock")
    }

    /// A connection; the component may not listen yet.
    fn connect(&self) -> Client {
        let start = Instant::now();
        loop {
            match Client::connect(&self.socket(), LIMIT) {
                Ok(client) => return client,
                Err(error) => assert!(start.elapsed() < LIMIT, "{error}"),
            }
        }
    }

    fn terminate(&self) {
        kill_process(Pid::from_child(&self.child), Signal::TERM).expect("it runs");
    }

    fn end(&mut self) -> ExitStatus {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status;
            }
            assert!(start.elapsed() < LIMIT, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Supervised {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn status(client: &mut Client) -> Status {
    client.call(&Request::Status, LIMIT).expect("a status")
}

fn until_state(client: &mut Client, state: State) {
    let start = Instant::now();
    while status(client).state != state {
        assert!(start.elapsed() < LIMIT, "it is not {state}");
    }
}

fn emergency(client: &mut Client, active: bool) {
    let request = Request::Emergency { active };
    let _: Done = client.call(&request, LIMIT).expect("it is served");
}

/// Writes to a socket that does not block, until it is full.
fn fill(mut stream: &UnixStream, piece: &[u8]) {
    stream.set_nonblocking(true).expect("a mode");
    loop {
        match stream.write(piece) {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
            Err(error) => panic!("{error}"),
        }
    }
}

/// A code of a failure would start it again.
#[test]
fn a_log_that_cannot_be_written_is_no_failure_of_the_component() {
    let mut command = Command::new(PROGRAM);
    let full = std::fs::File::options().write(true).open("/dev/full");
    command.stdout(full.expect("Linux has it"));
    command.env("RC_TEST_PRINTS", "1");
    let mut supervised = Supervised::start_as(command, |_, _| {});
    supervised.until(|message| *message == ComponentMessage::Ready);
    supervised.terminate();
    assert_eq!(supervised.end().code(), Some(0));
}

/// It asks for about 10 MB, and reads 3 kB at a time: always a little, and always before anybody
/// loses patience with a single write.
#[test]
fn a_client_that_trickles_delays_nobody() {
    let mut supervised = Supervised::ready();
    let stream = UnixStream::connect(supervised.socket()).expect("a connection");
    // The less the socket holds, the sooner the component has to wait.
    let _ = set_socket_recv_buffer_size(&stream, 4096);
    let all = rpc::request(1, &Request::Parameters { paths: None });
    (&stream).write_all(&all.repeat(200)).expect("written");
    let answers = Arc::new(AtomicUsize::new(0));
    let count_answers = Arc::clone(&answers);
    let trickle = std::thread::spawn(move || {
        let mut piece = [0; 3072];
        // Until the component drops it, or ends.
        while let Ok(count @ 1..) = (&stream).read(&mut piece) {
            let ends = piece[..count].split(|byte| *byte == b'\n').count() - 1;
            count_answers.fetch_add(ends, Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(100));
        }
    });
    let mut client = supervised.connect();
    for active in [true, false, true] {
        emergency(&mut client, active);
    }
    until_state(&mut client, State::Emergency);
    supervised.heartbeat();
    // All that happened while the slow client was not served to its end.
    assert!(answers.load(Ordering::Relaxed) < 100);
    supervised.terminate();
    assert!(supervised.end().success());
    trickle.join().expect("it reads to the end");
}

#[test]
fn control_comes_before_the_queries_of_others() {
    let mut supervised = Supervised::ready();
    let query = rpc::request(1, &Request::Parameters { paths: None });
    // They never read, and the component holds the rest of one answer for each.
    let greedy: Vec<UnixStream> = (0..20)
        .map(|_| {
            let mut stream = UnixStream::connect(supervised.socket()).expect("a connection");
            stream.write_all(&query.repeat(500)).expect("written");
            stream
        })
        .collect();
    let mut client = supervised.connect();
    emergency(&mut client, true);
    until_state(&mut client, State::Emergency);
    supervised.heartbeat();
    supervised.terminate();
    assert!(supervised.end().success());
    drop(greedy);
}

#[test]
fn idle_clients_give_way_and_the_supervisor_keeps_its_place() {
    let supervised = Supervised::ready();
    let mut own = supervised.connect();
    status(&mut own);
    let mut idle = Command::new(PROGRAM)
        .arg("idle")
        .arg(supervised.socket())
        .arg("100")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut name = String::new();
    let mut output = BufReader::new(idle.stdout.take().expect("a pipe"));
    output.read_line(&mut name).expect("a line");
    assert_eq!(name, "quiet\n", "the last of a hundred is served");
    // It is older than all of them.
    assert_eq!(status(&mut own).name, "quiet");
    drop(idle.stdin.take());
    assert!(idle.wait().expect("it ends").success());
}

#[test]
fn a_component_without_a_free_descriptor_waits_for_one() {
    let mut supervised = Supervised::ready();
    let process = Pid::from_child(&supervised.child);
    let folder = format!("/proc/{}/fd", supervised.child.id());
    let open = std::fs::read_dir(folder).expect("it runs");
    let open = open.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u64>().ok());
    let limit = Rlimit {
        current: open.max().map(|most| most + 1),
        maximum: getrlimit(Resource::Nofile).maximum,
    };
    let before = prlimit(Some(process), Resource::Nofile, limit).expect("a lower limit");
    // More than there are gaps between its descriptors.
    let clients: Vec<UnixStream> = (0..40)
        .map(|_| UnixStream::connect(supervised.socket()).expect("it listens"))
        .collect();
    let time = || {
        let stat = format!("/proc/{}/stat", supervised.child.id());
        let stat = std::fs::read_to_string(stat).expect("it runs");
        let (_, rest) = stat.rsplit_once(')').expect("a name");
        let fields = rest.split_ascii_whitespace().skip(11).take(2);
        // In hundredths of a second.
        fields
            .map(|field| field.parse::<u64>().expect("ticks"))
            .sum::<u64>()
    };
    let start = time();
    std::thread::sleep(Duration::from_secs(1));
    let taken = time() - start;
    assert!(taken <= 20, "{taken} ticks in a second");
    supervised.heartbeat();
    prlimit(Some(process), Resource::Nofile, before).expect("the limit before");
    assert_eq!(status(&mut supervised.connect()).name, "quiet");
    drop(clients);
    supervised.terminate();
    assert!(supervised.end().success());
}

/// As if the supervisor had been stopped for minutes: nothing can be written from the beginning on.
#[test]
fn a_supervisor_that_did_not_read_learns_what_is_so() {
    let mut supervised = Supervised::start(|_, theirs| {
        let _ = set_socket_send_buffer_size(theirs, 4096);
        fill(theirs, b"it is full\n");
    });
    let mut client = supervised.connect();
    until_state(&mut client, State::Running);
    emergency(&mut client, true);
    until_state(&mut client, State::Emergency);
    let changes = [("p7".to_owned(), 2.5.into())].into_iter().collect();
    let request = Request::ParametersSet { changes };
    let _: rc_management::component::Changed = client.call(&request, LIMIT).expect("a change");
    let is = |message: &ComponentMessage| matches!(message, ComponentMessage::Parameters(_));
    let messages = supervised.until(is);
    let states = messages.iter().filter_map(|message| match message {
        ComponentMessage::State { state } => Some(*state),
        _ => None,
    });
    let states: Vec<State> = states.collect();
    // One line was on its way already; of all that followed, the newest is the only one.
    assert!(states.len() <= 2, "{states:?}");
    assert_eq!(states.last(), Some(&State::Emergency));
    assert!(messages.contains(&ComponentMessage::Ready), "{messages:?}");
    let changed = messages.iter().find_map(|message| match message {
        ComponentMessage::Parameters(unsaved) => Some(&unsaved.changed["p7"]),
        _ => None,
    });
    assert_eq!(changed, Some(&2.5.into()));
    supervised.heartbeat();
    supervised.terminate();
    assert!(supervised.end().success());
}

#[test]
fn a_part_of_a_change_is_taken_back_before_that_is_told_or_kept() {
    let mut supervised = Supervised::ready();
    let propose = |number, value: f64| SupervisorMessage::Propose {
        number,
        changes: [("p0".to_owned(), value.into())].into_iter().collect(),
    };
    let settle = |number, keep| SupervisorMessage::Settle { number, keep };
    supervised.tell(&[propose(1, 2.5)]);
    let (_, changed) = supervised.accepted(1);
    assert_eq!(changed.changed[0].new, 2.5);
    // It is told twice before its worker has had a turn.
    supervised.tell(&[settle(1, false), settle(1, false), propose(2, 3.5)]);
    let (messages, changed) = supervised.accepted(2);
    let settled = messages.iter();
    let settled = settled.filter(|m| **m == ComponentMessage::Settled { number: 1 });
    assert_eq!(settled.count(), 1, "{messages:?}");
    assert_eq!(changed.changed[0].old, 1.0);
    supervised.tell(&[settle(2, true)]);
    let messages = supervised.until(|m| *m == ComponentMessage::Settled { number: 2 });
    let kept = messages.iter().find_map(|message| match message {
        ComponentMessage::Parameters(unsaved) => Some(&unsaved.changed["p0"]),
        _ => None,
    });
    assert_eq!(kept, Some(&3.5.into()), "{messages:?}");
    supervised.terminate();
    assert!(supervised.end().success());
}

#[test]
fn a_peer_that_sends_only_garbage_is_no_supervisor() {
    for piece in [&[b'x'; 4096][..], b"{\"method\":\"dance\"}\n"] {
        let mut supervised = Supervised::ready();
        let link = supervised.link.try_clone().expect("a socket");
        let flood = std::thread::spawn(move || while (&link).write_all(piece).is_ok() {});
        assert!(supervised.end().success(), "as at the end of its link");
        flood.join().expect("the link has ended");
    }
}

#[test]
fn a_guard_that_panics_ends_the_process_which_names_the_states() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(PROGRAM)
        .args(["--network", "n", "--name", "guarded"])
        .env("RC_TEST_GUARD", "1")
        .env("XDG_RUNTIME_DIR", folder.path())
        .output()
        .expect("an end");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{words}");
    let expected = "panic in the guard `is_ready`; the active states are: a";
    assert!(words.contains(expected), "{words}");
}
