//! The simulator on one host, the avoider and the pose monitor on another: two network namespaces
//! with a cable between them, and a run directory each.

use crate::{await_errors, await_well, computed, place};
use rc_test_site::site::{PATROL, Running, Site};
use rc_test_support::cable::{Cable, cable};

/// A site on a host, in the network `network`.
fn host(cable: &Cable, side: usize, network: &str, domain: u32) -> Site {
    let mut site = place(cable.name(side), domain, PATROL);
    network.clone_into(&mut site.network);
    let within = ["ip", "netns", "exec", cable.name(side)];
    site.within = within.map(str::to_owned).to_vec();
    site
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
        let [mut robot, mut desk] = [0, 1].map(|side| host(&cable, side, &network, domain));
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
