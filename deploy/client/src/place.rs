//! Where a running network has its run directory. The environment of its supervisor has chosen that,
//! and may differ from the one of this process.

use crate::names::check_name;
use rc_management::Client;
use rc_management::supervisor::{self, NetworkStatus, Request};
use rc_middleware::{RunDirectory, user_name};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io;
use std::time::Duration;

/// How long a supervisor may take to say where its network is.
const LIMIT: Duration = Duration::from_secs(3);
/// How many networks of other users a message names.
const MOST_NAMED: usize = 8;

/// The run directory of a network: where its supervisor says, else where this environment has it.
pub fn directory(network: &str) -> RunDirectory {
    let here = RunDirectory::of(network);
    if here.socket(supervisor::SOCKET).exists() {
        return here;
    }
    elsewhere(network).unwrap_or(here)
}

/// The run directory of a network whose supervisor has another one than this environment.
fn elsewhere(network: &str) -> Option<RunDirectory> {
    let mut client = Client::connect_supervisor(network, LIMIT).ok()?;
    let status: NetworkStatus = client.call(&Request::Status, LIMIT).ok()?;
    let path = status.directory;
    let is_its = path.file_name().is_some_and(|name| name == network);
    let base = path.parent().filter(|base| base.is_absolute());
    base.filter(|_| is_its)
        .map(|base| RunDirectory::below(base, network))
}

/// Connects to the supervisor of a network: in the run directory of this environment, else
/// wherever it is. Errors are those of [`Client::connect`].
pub fn connect(network: &str, limit: Duration) -> io::Result<Client> {
    let path = RunDirectory::of(network).socket(supervisor::SOCKET);
    match Client::connect(&path, limit) {
        Err(error) if is_absent(&error) => Client::connect_supervisor(network, limit),
        result => result,
    }
}

/// Whether no process listens.
pub(crate) fn is_absent(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::ConnectionRefused
    )
}

/// The networks of this user whose supervisors listen at an abstract socket.
pub(crate) fn networks() -> Vec<String> {
    let own = rustix::process::getuid().as_raw();
    let all = supervised().into_iter();
    all.filter_map(|(user, name)| (user == own).then_some(name))
        .collect()
}

/// The networks of all users whose supervisors listen at an abstract socket, each with its user. Any
/// process may have a socket of such a name.
fn supervised() -> BTreeSet<(u32, String)> {
    // proc_net(5): the last column is the path, with `@` for an abstract one. Its bytes are any.
    let sockets = std::fs::read("/proc/net/unix").unwrap_or_default();
    let sockets = String::from_utf8_lossy(&sockets);
    let names = sockets
        .lines()
        .filter_map(|line| line.split_ascii_whitespace().last());
    names
        .filter_map(|name| supervisor::of_abstract_name(name.strip_prefix('@')?))
        .filter(|(_, name)| check_name("network", name).is_ok())
        .collect()
}

/// That this user has no network, where they were looked for, and which networks other users have.
pub fn none_is_up() -> String {
    let own = rustix::process::getuid().as_raw();
    let base = RunDirectory::of("");
    let mut others = supervised();
    others.retain(|(user, _)| *user != own);
    format!(
        "no network is up: user {} has none in {} and no supervisor{}",
        user_name(own),
        base.path().display(),
        listed(&others)
    )
}

/// The networks of other users, as the end of a sentence.
fn listed(networks: &BTreeSet<(u32, String)>) -> String {
    let named = networks.iter().take(MOST_NAMED);
    let named = named.map(|(user, name)| format!("; user {} has {name}", user_name(*user)));
    let mut text: String = named.collect();
    if let Some(more @ 1..) = networks.len().checked_sub(MOST_NAMED) {
        let _ = write!(text, "; other users have {more} more");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixListener};

    #[test]
    fn networks_of_other_users_are_found_whatever_sockets_are_called() {
        let pid = std::process::id();
        let listen = |name: &[u8]| {
            let address = SocketAddr::from_abstract_name(name).expect("a name");
            UnixListener::bind_addr(&address).expect("a socket")
        };
        let kitchen = format!("kitchen-{pid}");
        let _sockets = [
            listen(format!("robocomp/4000000/{kitchen}").as_bytes()),
            listen(format!("robocomp/4000000/\u{1b}[2J{pid}").as_bytes()),
            listen(&[&b"\xff\xfe"[..], pid.to_string().as_bytes()].concat()),
        ];
        let found = supervised().into_iter();
        let found: Vec<_> = found.filter(|(user, _)| *user == 4_000_000).collect();
        assert_eq!(found, [(4_000_000, kitchen)]);
    }

    #[test]
    fn a_message_names_some_networks_of_other_users() {
        let networks = |count: u32| (0..count).map(|at| (4_000_000, format!("n{at}"))).collect();
        assert_eq!(listed(&networks(0)), "");
        assert_eq!(listed(&networks(1)), "; user 4000000 has n0");
        assert!(listed(&networks(8)).ends_with("has n7"));
        assert!(listed(&networks(10)).ends_with("has n7; other users have 2 more"));
    }
}
