//! The simulator on one host, the avoider and the pose monitor on another: two network namespaces
//! with a cable between them, and a run directory each.

use crate::{await_errors, await_well, computed, place};
use rc_test_site::site::{PATROL, Running, Site};
use rc_test_support::python::skipped;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// Runs a command. The error is what the command printed.
pub(crate) fn run(program: &str, args: &[&str]) -> Result<(), String> {
    let mut command = Command::new(program);
    let output = command.args(args).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.trim_end().lines().last().unwrap_or("it failed");
    Err(format!("{program} {}: {last}", args.join(" ")))
}

/// Installs packages of Debian. Another test may be installing others.
pub(crate) fn install(packages: &[&str]) -> Result<(), String> {
    let options = ["-o", "DPkg::Lock::Timeout=120", "install", "--yes"];
    let args = [&options[..], &["--no-install-recommends"], packages];
    run("apt-get", &args.concat())
}

fn ip(args: &[&str]) -> Result<(), String> {
    run("ip", args)
}

/// Two hosts and the cable between them. Dropping it removes all three.
pub(crate) struct Cable {
    names: [String; 2],
}

impl Cable {
    /// Connects two hosts. The error says why this machine cannot.
    pub(crate) fn lay() -> Result<Self, String> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        if !rustix::process::geteuid().is_root() {
            return Err("only root makes network namespaces".to_owned());
        }
        if ip(&["-Version"]).is_err() {
            install(&["iproute2"])?;
        }
        // The name of a network interface has at most 15 bytes.
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = |side| format!("rc{}{side}{number}", std::process::id());
        let cable = Self {
            names: [name('a'), name('b')],
        };
        let [a, b] = [cable.name(0), cable.name(1)];
        for host in [a, b] {
            ip(&["netns", "add", host])?;
        }
        let link = ["type", "veth", "peer", "name", b, "netns", b];
        ip(&[&["link", "add", a, "netns", a][..], &link].concat())?;
        for (host, address) in [(a, "10.77.0.1/24"), (b, "10.77.0.2/24")] {
            ip(&["-n", host, "address", "add", address, "dev", host])?;
            ip(&["-n", host, "link", "set", "lo", "up"])?;
            ip(&["-n", host, "link", "set", host, "up"])?;
        }
        Ok(cable)
    }

    /// The name of a host, and of its end of the cable.
    pub(crate) fn name(&self, side: usize) -> &str {
        &self.names[side]
    }

    pub(crate) fn set(&self, side: usize, state: &str) {
        let name = self.name(side);
        ip(&["-n", name, "link", "set", name, state]).expect("to set the link");
    }

    /// A site on a host, in the network `network`.
    fn host(&self, side: usize, network: &str, domain: u32) -> Site {
        let mut site = place(self.name(side), domain, PATROL);
        network.clone_into(&mut site.network);
        let within = ["ip", "netns", "exec", self.name(side)];
        site.within = within.map(str::to_owned).to_vec();
        site
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for host in &self.names {
            let _ = ip(&["netns", "delete", host]);
        }
    }
}

/// A cable; `None` if the test is skipped, after a line with the reason.
pub(crate) fn cable(test: &str) -> Option<Cable> {
    let cable = Cable::lay();
    cable.map_err(|reason| skipped(test, &reason)).ok()
}

/// The two hosts and their components. The components end first, then the hosts, then the cable.
struct Patrol {
    monitor: Running,
    _avoider: Running,
    _simulator: Running,
    robot: Site,
    desk: Site,
    cable: Cable,
}

/// How the two hosts discover each other.
#[derive(Clone, Copy, PartialEq)]
enum By {
    Multicast,
    Addresses,
    /// By addresses: multicast is enabled, and the cable drops it.
    AddressesBeside,
}

fn settings(cable: &Cable, side: usize, domain: u32, by: By) -> Vec<String> {
    let mut settings = vec![format!("dds.domain={domain}")];
    if by != By::Multicast {
        let peer = ["10.77.0.2", "10.77.0.1"][side];
        settings.push(format!("dds.interfaces={}", cable.name(side)));
        settings.push(format!("dds.peers={peer}"));
    }
    if by == By::Addresses {
        settings.push("dds.multicast=false".to_owned());
    }
    let set = |text| ["--set-middleware".to_owned(), text];
    settings.into_iter().flat_map(set).collect()
}

impl Patrol {
    fn start(cable: Cable, domain: u32, by: By) -> Self {
        let network = format!("hosts_{}_{domain}", std::process::id());
        let [mut robot, mut desk] = [0, 1].map(|side| cable.host(side, &network, domain));
        for (side, site) in [&mut robot, &mut desk].into_iter().enumerate() {
            // The library gives up an address after half a minute without an answer; in this test
            // at once.
            let patience = "<InitialLocatorPruneDelay>100ms</InitialLocatorPruneDelay><DiscoveredLocatorPruneDelay>100ms</DiscoveredLocatorPruneDelay>";
            let group = match by {
                By::Multicast | By::Addresses => String::new(),
                By::AddressesBeside => {
                    format!(
                        "<SPDPMulticastAddress>239.255.0.{}</SPDPMulticastAddress>",
                        10 + side
                    )
                }
            };
            let uri = format!("CYCLONEDDS_URI=<Discovery>{patience}{group}</Discovery>");
            site.within.extend(["env".to_owned(), uri]);
        }
        let (robot, desk) = (robot, desk);
        let start = |site: &Site, side, name: &str, more: &[&str]| {
            let mut args = settings(&cable, side, domain, by);
            // Its own configuration, and the files that the configuration names.
            let config = Site::components().join(name).join("etc/config.toml");
            if !more.contains(&"--config") {
                args.extend(["--config".to_owned(), config.display().to_string()]);
            }
            for slot in ["Laser", "DifferentialRobot"] {
                if name != "pose_monitor" {
                    let address = format!("{slot}={network}/simulator/{slot}");
                    args.extend(["--bind".to_owned(), address]);
                }
            }
            let args: Vec<&str> = args
                .iter()
                .map(String::as_str)
                .chain(more.iter().copied())
                .collect();
            site.start_program(&format!("{name}-dds"), name, &args, &[])
        };
        let simulator = start(&robot, 0, "simulator", &[]);
        let monitor = desk.monitor("trace", 0);
        let monitor = start(&desk, 1, "pose_monitor", &["--config", &monitor]);
        let avoider = start(&desk, 1, "avoider", &[]);
        Self {
            monitor,
            _avoider: avoider,
            _simulator: simulator,
            robot,
            desk,
            cable,
        }
    }

    fn poses(&self) -> u64 {
        let slot = &self.desk.ask("pose_monitor", "status")["slots"][0];
        slot["handlers"]["count"].as_u64().expect("a count")
    }

    /// Waits until calls and poses go over the cable.
    fn await_well(&self) {
        await_well(&self.desk, "avoider");
        let before = self.poses();
        Site::until("poses come", || self.poses() > before);
    }

    /// Unplugs the cable at one end until both hosts have noticed it, then plugs it in.
    fn interrupt(&self, side: usize) {
        self.cable.set(side, "down");
        let status = await_errors(&self.desk, "avoider");
        assert_eq!(status["state"], "running", "{status}");
        let error = status["last_error"].as_str().unwrap_or_default();
        // The lease is shorter than the deadline of a call, so no call waits for its deadline.
        assert!(
            error.contains("no server at") || error.contains("died"),
            "{status}"
        );
        assert_eq!(computed(&self.robot, "simulator").1, 0);
        let peers = |site: &Site, name: &str, slot: usize| {
            site.ask(name, "status")["slots"][slot]["peers"].as_u64()
        };
        Site::until("both hosts have noticed it", || {
            peers(&self.robot, "simulator", 0) == Some(0)
                && peers(&self.desk, "pose_monitor", 0) == Some(0)
        });
        self.cable.set(side, "up");
        self.await_well();
    }

    /// Ends all components; gives the received poses in their order.
    fn end(self) -> Vec<String> {
        let signal = rustix::process::Signal::TERM;
        rustix::process::kill_process(self.monitor.pid(), signal).expect("to stop it");
        let Self { monitor, desk, .. } = self;
        assert_eq!(monitor.end(), Some(0));
        let trace = std::fs::read_to_string(desk.path("trace")).expect("a trace");
        let pose = |line: &str| line.split_once(',').map(|(_, pose)| pose.to_owned());
        trace.lines().filter_map(pose).collect()
    }
}

/// The robot never returns to a pose, so an equal pose was received twice.
fn assert_each_once(poses: &[String]) {
    let mut seen = std::collections::HashSet::new();
    let mut last = None;
    for pose in poses {
        assert!(seen.insert(pose) || last == Some(pose), "{pose} came again");
        last = Some(pose);
    }
}

#[test]
fn two_hosts_discover_each_other_by_multicast() {
    let Some(cable) = cable("two_hosts_discover_each_other_by_multicast") else {
        return;
    };
    let patrol = Patrol::start(cable, 174, By::Multicast);
    patrol.await_well();
    patrol.interrupt(0);
    patrol.interrupt(1);
    assert_each_once(&patrol.end());
}

#[test]
fn two_hosts_discover_each_other_by_address() {
    let Some(cable) = cable("two_hosts_discover_each_other_by_address") else {
        return;
    };
    let patrol = Patrol::start(cable, 175, By::Addresses);
    patrol.await_well();
    patrol.interrupt(1);
    assert_each_once(&patrol.end());
}

#[test]
fn two_hosts_discover_each_other_by_address_where_multicast_is_dropped() {
    let Some(cable) = cable("two_hosts_discover_each_other_by_address_where_multicast_is_dropped")
    else {
        return;
    };
    let patrol = Patrol::start(cable, 176, By::AddressesBeside);
    patrol.await_well();
    assert_each_once(&patrol.end());
}
