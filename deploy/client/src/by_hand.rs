//! Components of a network that were started by hand: they have a management socket in the
//! run directory, and the supervisor, if there is one, does not know them.

use crate::connection::{Connection, is_listening};
use crate::names::check_name;
use crate::place;
use rc_management::component::{
    self, ClockKind, Request, Role, SlotStatus, State, TransportStatus,
};
use rc_management::lifecycle::LifecycleState;
use rc_management::supervisor::{ComponentState, ComponentStatus};
use rc_middleware::RunDirectory;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long all components together may take to reply.
const ANSWER_LIMIT: Duration = Duration::from_secs(2);
/// The least time for each of them.
const LEAST: Duration = Duration::from_millis(50);
/// The age of the last turn from which on a component hangs, as for a supervisor.
const HUNG_MS: u64 = 2000;

/// The names of the component sockets in a run directory without those of `supervised`, sorted.
/// A socket may have no listener: a component that was killed leaves its own.
pub fn sockets<'s>(
    directory: &RunDirectory,
    supervised: impl IntoIterator<Item = &'s str>,
) -> Vec<String> {
    let supervised: Vec<String> = supervised
        .into_iter()
        .map(|name| name.replace('.', "-"))
        .collect();
    let entries = std::fs::read_dir(directory.path()).into_iter().flatten();
    let names = entries.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        name.strip_suffix(".sock").map(str::to_owned)
    });
    let mut names: Vec<String> = names
        .filter(|name| check_name("component", name).is_ok() && !supervised.contains(name))
        .collect();
    names.sort();
    names
}

/// The components of a network that were started by hand. `supervised` are the names of the others.
pub(crate) fn components<'s>(
    network: &str,
    supervised: impl IntoIterator<Item = &'s str>,
) -> Vec<ComponentStatus> {
    let directory = place::directory(network);
    let deadline = Instant::now() + ANSWER_LIMIT;
    let names = sockets(&directory, supervised).into_iter();
    names
        .filter_map(|name| {
            let limit = deadline.saturating_duration_since(Instant::now());
            let peer = format!("component {name} of network {network}");
            let path = directory.socket(&name);
            let connection = Connection::to(&path, peer, limit.max(LEAST)).ok()?;
            // The next component of this name removes a socket without a listener.
            let report = connection?.request::<component::Status>(&Request::Status);
            Some(report.map_or_else(|_| silent(&name), |report| status(&report)))
        })
        .collect()
}

/// The networks of this user in which a component runs that was started by hand, or by a
/// supervisor.
pub fn networks() -> Vec<String> {
    let mut names = RunDirectory::networks();
    names.retain(|name| {
        let directory = RunDirectory::of(name);
        let mut sockets = sockets(&directory, []).into_iter();
        check_name("network", name).is_ok()
            && sockets.any(|name| is_listening(&directory.socket(&name)))
    });
    names
}

/// The messages of a slot by middleware.
fn carried(slot: &SlotStatus) -> Option<(String, Vec<TransportStatus>)> {
    slot.address.as_ref()?;
    let messages = match slot.role {
        Role::Requires | Role::Publishes => slot.sent,
        Role::Implements | Role::SubscribesTo => slot.handlers.count,
    };
    let mut all = slot.transports.clone();
    if all.is_empty() {
        let middleware = slot.middleware.clone();
        all.push(TransportStatus {
            middleware,
            messages,
        });
    }
    Some((slot.name.clone(), all))
}

/// The status of a component that was started by hand, from its own report.
pub fn status(report: &component::Status) -> ComponentStatus {
    let lost = report.slots.iter().filter(|slot| slot.lost > 0);
    let converted = report.slots.iter();
    let converted = converted.filter_map(|slot| Some((slot.name.clone(), slot.converted.clone()?)));
    let forwarded = report.slots.iter();
    let forwarded = forwarded.filter_map(|slot| Some((slot.name.clone(), slot.forwarded?)));
    let pid = i32::try_from(report.pid).ok();
    let runs = matches!(report.state, State::Running | State::Emergency)
        && report.lifecycle.is_none_or(LifecycleState::is_configured);
    ComponentStatus {
        state: match report.state {
            State::Running if report.age_ms >= HUNG_MS => ComponentState::Hung,
            state @ (State::Starting | State::Running | State::Emergency | State::Stopping) => {
                state.into()
            }
        },
        lifecycle: report.lifecycle,
        pid,
        uptime_s: Some((report.uptime_s * 1e3).round() / 1e3),
        ready: runs,
        middleware: report.middleware.clone(),
        executable: pid.and_then(executable).unwrap_or_default(),
        log: pid.and_then(log).unwrap_or_default(),
        clock: Some(report.clock.clone()).filter(|clock| clock.kind != ClockKind::System),
        machine: report.machine.clone(),
        lost: lost
            .map(|slot| (slot.name.clone(), slot.lost))
            .collect::<BTreeMap<String, u64>>(),
        messages: report.slots.iter().filter_map(carried).collect(),
        forwarded: forwarded.collect(),
        converted: converted.collect(),
        ..silent(&report.name)
    }
}

/// The status of a component that does not reply.
fn silent(name: &str) -> ComponentStatus {
    ComponentStatus {
        name: name.to_owned(),
        by_hand: true,
        process: None,
        behind: Vec::new(),
        host: None,
        state: ComponentState::Hung,
        lifecycle: None,
        pid: None,
        uptime_s: None,
        ready: false,
        middleware: String::new(),
        transports: BTreeMap::new(),
        cpu: Vec::new(),
        priority: None,
        executable: PathBuf::new(),
        log: PathBuf::new(),
        restarts: 0,
        ready_ms: 0,
        stop_ms: 0,
        lost: BTreeMap::new(),
        messages: BTreeMap::new(),
        forwarded: BTreeMap::new(),
        converted: BTreeMap::new(),
        troubles: Vec::new(),
        clock: None,
        machine: None,
        exit: None,
    }
}

fn executable(pid: i32) -> Option<PathBuf> {
    std::fs::read_link(format!("/proc/{pid}/exe")).ok()
}

/// The file that a process logs to: its standard error, if that is a file.
fn log(pid: i32) -> Option<PathBuf> {
    let link = format!("/proc/{pid}/fd/2");
    let is_file = std::fs::metadata(&link).is_ok_and(|file| file.is_file());
    is_file.then(|| std::fs::read_link(&link).ok())?
}

/// Where a process prints, for people: `/dev/pts/3`.
pub(crate) fn prints_to(pid: i32) -> String {
    let link = std::fs::read_link(Path::new("/proc").join(pid.to_string()).join("fd/2"));
    link.map_or_else(|_| "nowhere".to_owned(), |path| path.display().to_string())
}
