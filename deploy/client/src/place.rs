//! Where a running network has its run directory. The environment of its supervisor has chosen that,
//! and may differ from the one of this process.

use rc_diagnostics::foreign::clean;
use rc_management::Client;
use rc_management::supervisor::{self, NetworkStatus, Request};
use rc_middleware::{RunDirectory, user_name};
use std::collections::BTreeSet;
use std::io;
use std::time::Duration;

/// How long a supervisor may take to say where its network is.
const LIMIT: Duration = Duration::from_secs(3);

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

/// The networks of all users whose supervisors listen at an abstract socket, each with its user.
fn supervised() -> BTreeSet<(u32, String)> {
    // proc_net(5): the last column is the path, with `@` for an abstract one.
    let sockets = std::fs::read_to_string("/proc/net/unix").unwrap_or_default();
    let names = sockets
        .lines()
        .filter_map(|line| line.split_ascii_whitespace().last());
    names
        .filter_map(|name| supervisor::of_abstract_name(name.strip_prefix('@')?))
        .collect()
}

/// That this user has no network, where they were looked for, and which networks other users have.
pub fn none_is_up() -> String {
    let own = rustix::process::getuid().as_raw();
    let base = RunDirectory::of("");
    let mut text = format!(
        "no network is up: user {} has none in {} and no supervisor",
        user_name(own),
        base.path().display()
    );
    let others = supervised().into_iter().filter(|(user, _)| *user != own);
    let others: Vec<String> = others
        .map(|(user, name)| format!("; user {} has {}", user_name(user), clean(&name)))
        .collect();
    text.extend(others);
    text
}
