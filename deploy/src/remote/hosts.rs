//! Links to the other machines of a plan, and which component runs on which of them.

use super::connection::Setup;
use super::host::{Host, HostEvent, HostSource};
use super::remote_process::Outbox;
use crate::process::identity::Mark;
use rc_deploy_client::logs;
use rc_deploy_network::plan::{self, Component, Plan};
use rustix::event::PollFlags;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::time::{Duration, Instant};

/// The other machines of a plan. A machine is known by its index, a component by its index in the
/// plan.
pub(crate) struct Hosts {
    hosts: Vec<Host>,
    /// The machine of each component; `None` is this machine.
    of: Vec<Option<usize>>,
}

impl Hosts {
    /// The machines of a plan, none of which is connected. Hosts with the same address and the same
    /// user are one machine. `services` are those that each host has to hold open; `memory_pause`
    /// passes between two readings of the memory of its components.
    pub(crate) fn new(
        plan: &Plan,
        services: &BTreeMap<String, String>,
        memory_pause: Duration,
        log_directory: &Path,
    ) -> Self {
        let mut hosts: Vec<plan::Host> = Vec::new();
        let mut host_of = Vec::new();
        for component in &plan.components {
            host_of.push(component.host.as_ref().map(|host| {
                let same = |h: &plan::Host| (&h.address, &h.user) == (&host.address, &host.user);
                hosts.iter().position(same).unwrap_or_else(|| {
                    hosts.push(host.clone());
                    hosts.len() - 1
                })
            }));
        }
        let hosts = hosts.into_iter().enumerate().map(|(h, host)| {
            let components = plan.components.iter().zip(&host_of);
            let components = components.filter(|(_, of)| **of == Some(h)).map(|(c, _)| c);
            let files = components.clone().flat_map(|c| {
                let executable = Some(&c.executable).filter(|_| !c.built_there);
                c.files.iter().chain(executable)
            });
            let files: BTreeSet<_> = files.cloned().collect();
            let environments = components.filter_map(|c| c.venv.clone());
            let environments: BTreeSet<_> = environments.collect();
            let setup = Setup {
                network: plan.network.clone(),
                files: files.into_iter().collect(),
                hashes: log_directory.join(format!(".{}.hashes.json", host.name)),
                environments: environments.into_iter().collect(),
                services: services.get(&host.name).cloned(),
                memory_pause,
            };
            let log = logs::file(
                log_directory,
                &format!("{}-{}", logs::SUPERVISOR, host.name),
            );
            Host::new(host, setup, log)
        });
        Self {
            hosts: hosts.collect(),
            of: host_of,
        }
    }

    /// The indices of all machines.
    pub(crate) fn indices(&self) -> std::ops::Range<usize> {
        0..self.hosts.len()
    }

    /// The machine of a component; `None` is this machine.
    pub(crate) fn of(&self, component: usize) -> Option<usize> {
        self.of[component]
    }

    /// The components of a machine; `None` is this machine.
    pub(crate) fn members(&self, place: Option<usize>) -> BTreeSet<usize> {
        let of = self.of.iter().enumerate();
        let members = of.filter(|(_, of)| **of == place);
        members.map(|(component, _)| component).collect()
    }

    /// The outbox of a component's machine.
    pub(crate) fn outbox_of(&self, component: usize) -> Option<Outbox> {
        let host = self.of(component)?;
        Some(self.hosts[host].outbox.clone())
    }

    /// Name of a machine in the `.ddsl`.
    pub(crate) fn name(&self, host: usize) -> &str {
        &self.hosts[host].plan.name
    }

    /// Destination as in `ssh DESTINATION`.
    pub(crate) fn destination(&self, host: usize) -> String {
        self.hosts[host].destination()
    }

    /// The logs of the connections.
    pub(crate) fn logs(&self) -> impl Iterator<Item = &Path> {
        self.hosts.iter().map(|host| &*host.log)
    }

    /// Whether a machine was connected before.
    pub(crate) fn was_connected(&self, host: usize) -> bool {
        self.hosts[host].was_connected()
    }

    /// The time until the next attempt to connect a machine.
    pub(crate) fn next_attempt(&self, host: usize, now: Instant) -> Duration {
        self.hosts[host].next_attempt(now)
    }

    /// Whether the machine of a component is connected. Nothing starts before all machines were
    /// connected, so that an unreachable machine is known early.
    pub(crate) fn lets_start(&self, component: usize) -> bool {
        self.hosts.iter().all(Host::was_connected)
            && self.of(component).is_none_or(|h| self.hosts[h].is_there())
    }

    /// The component with the paths of a machine.
    pub(crate) fn component(&self, host: usize, component: &Component) -> Component {
        self.hosts[host].component(component)
    }

    /// The descriptors to wait for, each with its machine.
    pub(crate) fn descriptors(
        &self,
    ) -> impl Iterator<Item = (usize, HostSource, BorrowedFd<'_>, PollFlags)> {
        let hosts = self.hosts.iter().enumerate();
        hosts.flat_map(|(h, host)| {
            let descriptors = host.descriptors();
            descriptors.map(move |(source, descriptor, flags)| (h, source, descriptor, flags))
        })
    }

    /// When the passing of time next matters.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.hosts.iter().filter_map(Host::deadline).min()
    }

    /// Reads from a machine, and writes to it.
    pub(crate) fn turn(&mut self, host: usize, now: Instant) -> Vec<HostEvent> {
        self.hosts[host].turn(now)
    }

    /// Forwards what callers of a machine's components send.
    pub(crate) fn turn_socket(&mut self, host: usize, number: u64) {
        self.hosts[host].turn_socket(number);
    }

    /// Handles the passing of time. Unless `reconnects`, machines that are not connected stay so.
    pub(crate) fn check(
        &mut self,
        now: Instant,
        mark: &Mark,
        reconnects: bool,
    ) -> Vec<(usize, HostEvent)> {
        let mut events = Vec::new();
        for (h, host) in self.hosts.iter_mut().enumerate() {
            if !reconnects && !host.is_there() {
                host.leave(now);
            }
            events.extend(host.check(now, mark).map(|event| (h, event)));
        }
        events
    }

    /// Disconnects all machines. Returns whether all are disconnected for good.
    pub(crate) fn leave(&mut self, now: Instant) -> bool {
        self.hosts.iter_mut().for_each(|host| host.leave(now));
        self.hosts.iter().all(Host::is_over)
    }

    /// Makes the management socket of a component of a machine available at `path`.
    pub(crate) fn listen(&mut self, host: usize, name: &str, path: &Path) -> io::Result<()> {
        self.hosts[host].listen(name, path)
    }

    /// Closes the management socket of a component that has ended.
    pub(crate) fn close(&mut self, host: usize, name: &str) {
        self.hosts[host].close(name);
    }
}

#[cfg(test)]
impl Hosts {
    /// Connects a machine without an agent, whose part the test takes.
    pub(crate) fn pretend(&mut self, host: usize) {
        self.hosts[host].pretend();
    }

    /// Disconnects a machine.
    pub(crate) fn leave_one(&mut self, host: usize) {
        self.hosts[host].leave(Instant::now());
    }

    /// Whether each machine is disconnected for good.
    pub(crate) fn over(&self) -> Vec<bool> {
        self.hosts.iter().map(Host::is_over).collect()
    }

    /// Takes the messages for a machine.
    pub(crate) fn take_messages(&self, host: usize) -> Vec<super::SupervisorMessage> {
        self.hosts[host].outbox.take()
    }
}

#[cfg(test)]
mod tests {
    use super::super::SupervisorMessage;
    use super::*;

    fn on(host: Option<(&str, &str)>, name: &str) -> Component {
        Component {
            host: host.map(|(name, address)| plan::Host {
                name: name.to_owned(),
                address: address.to_owned(),
                user: None,
                workspace: None,
                elsewhere: None,
            }),
            ..Component::new(name, "/bin/true", "/")
        }
    }

    /// `a` on `g`, `b` here, `c` on `h`, and `d` on `i`, which is the machine of `h`.
    fn hosts() -> Hosts {
        let components = [
            (Some(("g", "10.0.0.1")), "a"),
            (None, "b"),
            (Some(("h", "10.0.0.2")), "c"),
            (Some(("i", "10.0.0.2")), "d"),
        ];
        let components = components.map(|(host, name)| on(host, name));
        let plan = Plan::new("net", "net.ddsl", components);
        let pause = Duration::from_secs(30);
        Hosts::new(&plan, &BTreeMap::new(), pause, Path::new("/nowhere"))
    }

    #[test]
    fn hosts_with_one_address_are_one_machine() {
        let hosts = hosts();
        assert_eq!(hosts.indices(), 0..2);
        let names: Vec<&str> = hosts.indices().map(|h| hosts.name(h)).collect();
        assert_eq!(names, ["g", "h"]);
        let of = [0, 1, 2, 3].map(|component| hosts.of(component));
        assert_eq!(of, [Some(0), None, Some(1), Some(1)]);
        let members = [None, Some(0), Some(1)].map(|place| hosts.members(place));
        let wanted = [vec![1], vec![0], vec![2, 3]];
        assert_eq!(members, wanted.map(BTreeSet::from_iter));
        assert!(hosts.outbox_of(1).is_none() && hosts.outbox_of(3).is_some());
    }

    #[test]
    fn a_component_starts_when_all_machines_were_there_and_its_own_is() {
        let mut hosts = hosts();
        let lets = |hosts: &Hosts| [0, 1, 2, 3].map(|component| hosts.lets_start(component));
        hosts.pretend(0);
        assert_eq!(lets(&hosts), [false; 4], "the second one was never there");
        hosts.pretend(1);
        assert_eq!(lets(&hosts), [true; 4]);
        hosts.leave_one(1);
        assert_eq!(lets(&hosts), [true, true, false, false]);
    }

    #[test]
    fn machines_that_are_not_connected_are_over_at_once() {
        let mut hosts = hosts();
        hosts.pretend(0);
        assert!(!hosts.leave(Instant::now()), "the first one gets time");
        assert_eq!(hosts.over(), [false, true]);
        let farewell = SupervisorMessage::Farewell;
        assert_eq!(hosts.take_messages(0).last(), Some(&farewell));
    }

    #[test]
    fn a_network_that_stops_connects_no_machine_again() {
        let mut hosts = hosts();
        hosts.pretend(0);
        let events = hosts.check(Instant::now(), &Mark::none(), false);
        assert!(events.is_empty());
        assert_eq!(hosts.over(), [false, true]);
    }
}
