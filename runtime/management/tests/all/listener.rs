//! Sockets that listen: who may connect, and what happens where nobody can be accepted.

use rc_management::{Client, Listener, component, supervisor};
use rc_test_support::python::skipped;
use rustix::io::Errno;
use rustix::process::{Resource, Rlimit, Uid, getpid, getrlimit, setrlimit};
use std::io::{ErrorKind, Read};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::process::Command;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(30);

/// Listens where the supervisor of a network does.
fn abstract_socket(network: &str) -> UnixListener {
    let address = SocketAddr::from_abstract_name(supervisor::abstract_name(network));
    UnixListener::bind_addr(&address.expect("an address")).expect("a socket")
}

/// A name that no other process has.
fn network(test: &str) -> String {
    format!("{test}-{}", getpid())
}

/// Runs on a thread of another user. `None` where this user must not: `test` is listed as skipped.
fn as_a_stranger<T: Send>(test: &str, work: impl FnOnce() -> T + Send) -> Option<T> {
    let stranger = Uid::from_raw(65_534);
    let result = std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            match rustix::thread::set_thread_res_uid(stranger, stranger, stranger) {
                Err(Errno::PERM) => return None,
                set => set.expect("the other user"),
            }
            Some(work())
        });
        thread.join().expect("a result")
    });
    if result.is_none() {
        skipped(test, "only root can run a thread of another user");
    }
    result
}

#[test]
fn a_supervisor_is_found_by_user_and_network() {
    let network = network("found");
    let connect = || Client::connect_supervisor(&network, LIMIT);
    let kind = connect().map_err(|error| error.kind()).err();
    assert_eq!(kind, Some(ErrorKind::ConnectionRefused));
    let mut listener = Listener::of(abstract_socket(&network)).expect("a socket");
    let client = connect().expect("a connection");
    assert_eq!(client.peer(), Some(getpid().as_raw_nonzero().get()));
    assert!(listener.accept().is_some(), "it is of this user");
    assert!(listener.accept().is_none(), "nobody else has connected");
    assert_eq!(listener.deadline(), None);
    assert!(!listener.restore().expect("it has no file"));
    let others = ["", "found", "other"].map(supervisor::abstract_name);
    assert!(!others.contains(&supervisor::abstract_name(&network)));
}

#[test]
fn an_abstract_socket_accepts_nobody_else() {
    let network = network("strange");
    let mut listener = Listener::of(abstract_socket(&network)).expect("a socket");
    let name = supervisor::abstract_name(&network);
    let address = SocketAddr::from_abstract_name(&name).expect("an address");
    let connect = || UnixStream::connect_addr(&address).expect("a connection");
    let Some(mut stranger) = as_a_stranger("an_abstract_socket_accepts_nobody_else", connect)
    else {
        return;
    };
    assert!(listener.accept().is_none());
    assert_eq!(stranger.read(&mut [0]).expect("its end"), 0);
    assert_eq!(listener.deadline(), None, "the next one is accepted");
    let _own = connect();
    assert!(listener.accept().is_some());
}

#[test]
fn a_stranger_is_no_supervisor() {
    let network = network("impostor");
    let Some(_listener) = as_a_stranger("a_stranger_is_no_supervisor", || {
        let name = format!("robocomp/0/{network}");
        let address = SocketAddr::from_abstract_name(name).expect("an address");
        UnixListener::bind_addr(&address).expect("a socket")
    }) else {
        return;
    };
    let mut connected = Client::connect_supervisor(&network, LIMIT);
    if let Ok(client) = &mut connected {
        client.send(&component::Request::Stop);
    }
    let kind = connected.map_err(|error| error.kind()).err();
    assert_eq!(kind, Some(ErrorKind::NotFound));
}

/// Runs in a process of its own, which the test below starts.
#[test]
#[ignore = "another test starts it"]
fn descriptors_run_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.sock");
    let mut listener = Listener::bind(&path).expect("a socket");
    let _caller = UnixStream::connect(&path).expect("a connection");
    let limit = getrlimit(Resource::Nofile);
    let none = Rlimit {
        current: Some(0),
        ..limit
    };
    setrlimit(Resource::Nofile, none).expect("a lower limit");
    let begin = Instant::now();
    assert!(listener.accept().is_none());
    // It is not asked again until the pause is over: the socket would be readable all the time.
    assert!(listener.descriptor().is_none());
    let end = listener.deadline().expect("an end of the pause");
    assert!(begin < end && end <= Instant::now() + Duration::from_secs(1));
    listener.resume(begin);
    assert!(listener.descriptor().is_none());
    listener.resume(end);
    assert!(listener.descriptor().is_some());
    assert_eq!(listener.deadline(), None);
    setrlimit(Resource::Nofile, limit).expect("the old limit");
    assert!(listener.accept().is_some(), "the caller has waited");
}

#[test]
fn a_process_without_a_free_descriptor_waits_and_accepts_later() {
    let out = Command::new(std::env::current_exe().expect("this program"))
        .args(["listener::descriptors_run_out", "--exact", "--ignored"])
        .output()
        .expect("to run");
    let text = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{text}");
    assert!(text.contains("1 passed"), "{text}");
}
