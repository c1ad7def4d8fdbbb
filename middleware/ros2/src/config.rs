//! The settings of `[middleware.ros2]`. Environment variables of ROS 2 apply to keys that are not set.

use crate::names;
use rc_middleware::{Environment, OpenError};
use rc_settings::ros::{self, ResolvedRemapping};
use ros2_client::NodeName;
use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

/// Where requests and replies carry the identity of the request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mapping {
    /// In the inline quality of service, as in `rmw_fastrtps`.
    Enhanced,
    /// In a header before the body, as in `rmw_cyclonedds`.
    Cyclone,
}

/// The configuration of a node.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) domain: u16,
    /// The addresses of the interfaces to use; `None` for all.
    pub(crate) networks: Option<Vec<IpAddr>>,
    pub(crate) mapping: Mapping,
    pub(crate) node: NodeName,
    pub(crate) rules: Vec<ResolvedRemapping>,
    pub(crate) lease: Duration,
}

/// The error of a component that cannot join ROS 2.
pub(crate) fn refused(environment: &Environment, reason: String) -> OpenError {
    OpenError::Backend {
        address: environment.network.clone(),
        reason,
    }
}

pub(crate) fn of(environment: &Environment) -> Result<Config, OpenError> {
    let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    read(environment, &variable).map_err(|reason| refused(environment, reason))
}

fn read(
    environment: &Environment,
    variable: &dyn Fn(&str) -> Option<String>,
) -> Result<Config, String> {
    let settings = &environment.settings;
    let name = |key: &str| settings.text(crate::NAME, key).map(str::to_owned);
    let mapping = match settings.text(crate::NAME, "service_mapping") {
        Some("cyclone") => Mapping::Cyclone,
        _ => Mapping::Enhanced,
    };
    let (namespace, own) = ros::node(
        &environment.network,
        &environment.instance,
        name("namespace"),
        name("node"),
    );
    let node = names::node(&namespace, &own)?;
    let rules = settings.remappings(crate::NAME, "remap").iter();
    let rules = rules.map(|rule| rule.resolve(&namespace, &own));
    let lease = settings.duration(crate::NAME, "lease");
    Ok(Config {
        domain: domain(settings.int(crate::NAME, "domain"), variable)?,
        networks: networks(settings.texts(crate::NAME, "interfaces"), variable)?,
        mapping,
        node,
        rules: rules.collect(),
        lease: lease.ok_or("there is no lease")?,
    })
}

/// The domain: the setting, else `ROS_DOMAIN_ID`, else 0.
fn domain(setting: Option<i64>, variable: &dyn Fn(&str) -> Option<String>) -> Result<u16, String> {
    let wrong = |domain: &dyn std::fmt::Display| {
        format!("`{domain}` is not a domain; ROS_DOMAIN_ID is a number from 0 to 232")
    };
    if let Some(domain) = setting {
        return u16::try_from(domain).map_err(|_| wrong(&domain));
    }
    let Some(text) = variable("ROS_DOMAIN_ID") else {
        return Ok(0);
    };
    let domain = text.parse().ok().filter(|domain| *domain <= 232);
    domain.ok_or_else(|| wrong(&text))
}

/// The addresses to use: the setting, else the variables of ROS 2.
fn networks(
    interfaces: &[String],
    variable: &dyn Fn(&str) -> Option<String>,
) -> Result<Option<Vec<IpAddr>>, String> {
    let local = Some(vec![IpAddr::V4(Ipv4Addr::LOCALHOST)]);
    if !interfaces.is_empty() {
        let all = netdev::get_interfaces();
        let mut found = Vec::new();
        for wanted in interfaces {
            let addresses: Vec<IpAddr> = all
                .iter()
                .flat_map(|one| one.ip_addrs().into_iter().map(|ip| (&one.name, ip)))
                .filter(|(name, ip)| *name == wanted || ip.to_string() == *wanted)
                .map(|(_, ip)| ip)
                .collect();
            if addresses.is_empty() {
                let names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
                return Err(format!(
                    "there is no network interface `{wanted}`; there are {}",
                    names.join(", ")
                ));
            }
            found.extend(addresses);
        }
        return Ok(Some(found));
    }
    if variable("ROS_LOCALHOST_ONLY").is_some_and(|value| value != "0") {
        return Ok(local);
    }
    match variable("ROS_AUTOMATIC_DISCOVERY_RANGE").as_deref() {
        None | Some("SUBNET" | "SYSTEM_DEFAULT") => Ok(None),
        Some("LOCALHOST") => Ok(local),
        Some("OFF") => Err("ROS_AUTOMATIC_DISCOVERY_RANGE is OFF, and this backend finds others in no other way; unset it, or set LOCALHOST".to_owned()),
        Some(other) => Err(format!("ROS_AUTOMATIC_DISCOVERY_RANGE is `{other}`; it is SUBNET, LOCALHOST or OFF")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::typed::{HandlerError, Request};
    use rc_middleware::{Backend, Reader};
    use rc_runtime::{Component, Core, Description, Ports, StartError, Values, WorkerError, embed};
    use std::sync::Mutex;

    static DESCRIPTION: Description = Description {
        name: "configured",
        model_hash: 1,
        middleware: crate::NAME,
        period: Duration::from_millis(2),
        parameters: None,
        folder: "/nowhere",
        slots: &[],
        backends: &[(crate::NAME, record)],
        simulates_time: false,
        note: b"",
    };

    static LEASES: Mutex<Vec<Duration>> = Mutex::new(Vec::new());

    /// Keeps the lease, and refuses to start.
    fn record(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let lease = of(environment)?.lease;
        LEASES.lock().expect("the leases").push(lease);
        Err(refused(environment, "only the lease is wanted".to_owned()))
    }

    struct Worker(Core);

    impl Worker {
        #[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
        fn start(core: Core, _: &Ports, _: &Values) -> Result<Self, StartError> {
            Ok(Self(core))
        }
    }

    impl Component for Worker {
        fn core(&mut self) -> &mut Core {
            &mut self.0
        }

        fn compute(&mut self) -> Result<(), WorkerError> {
            Ok(())
        }

        fn emergency(&mut self) {}

        fn restore(&mut self) {}

        fn finalize(&mut self) {}

        fn sending_peers(&self, _: &mut [usize]) {}

        fn serve(&mut self, _: usize, request: &mut Request<'_>) -> Result<(), HandlerError> {
            request.unknown()
        }

        fn receive(&mut self, _: usize, _: usize, _: &mut Reader<'_>) -> Result<(), HandlerError> {
            Ok(())
        }
    }

    /// The lease that a component with these arguments has in ROS 2.
    fn lease(arguments: &[&str]) -> Duration {
        let network = format!("lease-{}", std::process::id());
        let arguments = [&["--network", &network], arguments].concat();
        assert!(embed(&DESCRIPTION, Worker::start, &arguments).is_err());
        let mut leases = LEASES.lock().expect("the leases");
        leases.pop().expect("a lease")
    }

    #[test]
    fn a_lease_is_exact_on_its_way_from_text_to_ros() {
        let exact = Duration::from_nanos(100_000_001);
        let file = std::env::temp_dir().join(format!("lease-{}.toml", std::process::id()));
        std::fs::write(&file, "[middleware.ros2]\nlease = \"100000.001us\"\n").expect("to write");
        let path = file.to_string_lossy();
        let configured = lease(&["--config", &path]);
        let replaced = lease(&["--config", &path, "--set-middleware", "ros2.lease=1.5s"]);
        std::fs::remove_file(&file).expect("to remove");
        assert_eq!(configured, exact);
        assert_eq!(replaced, Duration::from_millis(1500));
        let set = lease(&["--set-middleware", "ros2.lease=100000.001us"]);
        assert_eq!(set, exact);
    }
}
