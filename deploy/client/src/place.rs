//! Where a running network has its run directory. The environment of its supervisor has chosen that,
//! and may differ from the one of this process.

use rc_management::Client;
use rc_management::supervisor::{self, NetworkStatus, Request};
use rc_middleware::RunDirectory;
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
    // proc_net(5): the last column is the path, with `@` for an abstract one.
    let sockets = std::fs::read_to_string("/proc/net/unix").unwrap_or_default();
    let start = supervisor::abstract_name("");
    let start = format!("@{}", String::from_utf8_lossy(&start));
    let mut names: Vec<String> = sockets
        .lines()
        .filter_map(|line| line.split_ascii_whitespace().last()?.strip_prefix(&start))
        .map(str::to_owned)
        .collect();
    names.sort();
    names.dedup();
    names
}
