//! The configuration with which a component joins ROS 2, from the settings of `[middleware.ros2]`.
//! Environment variables of ROS 2 apply to keys that are not set.

use crate::names::{self, NodeName};
use crate::remap;
use rc_middleware::{Environment, OpenError};
use rc_network::{Configuration, Joining, refused};
use rc_vocabulary::ros::{self, ResolvedRemapping};

/// The configuration of a node.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) joining: Joining,
    pub(crate) node: NodeName,
    pub(crate) rules: Vec<ResolvedRemapping>,
}

/// Reads an environment variable; `None` for an empty one.
type Variable<'a> = dyn Fn(&str) -> Option<String> + 'a;

pub(crate) fn of(environment: &Environment) -> Result<Config, OpenError> {
    let variable = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    read(environment, &variable).map_err(|reason| refused(environment, reason))
}

fn read(environment: &Environment, variable: &Variable<'_>) -> Result<Config, String> {
    let settings = &environment.settings;
    let name = |key: &str| settings.text(crate::NAME, key).map(str::to_owned);
    let (namespace, own) = ros::node(
        &environment.network,
        &environment.instance,
        name("namespace"),
        name("node"),
    );
    let rules = remap::rules(settings).iter();
    let rules = rules.map(|rule| rule.resolve(&namespace, &own)).collect();
    let domain = domain(settings.int(crate::NAME, "domain"), variable)?;
    let lease = settings.duration(crate::NAME, "lease");
    let lease = lease.ok_or("there is no lease")?;
    let configuration = Configuration::new(domain, lease);
    let interfaces = settings.texts(crate::NAME, "interfaces");
    Ok(Config {
        joining: Joining {
            middleware: crate::NAME,
            domain,
            configuration: discovery(configuration, interfaces, variable)?.text(),
            lease,
            // The identity of a participant in the graph of ROS; messages are neither encrypted nor
            // signed.
            user_data: "enclave=/;".to_owned(),
            service: names::address_of_requests,
        },
        node: NodeName {
            namespace,
            name: own,
        },
        rules,
    })
}

/// The domain: the setting, else `ROS_DOMAIN_ID`, else 0.
fn domain(setting: Option<i64>, variable: &Variable<'_>) -> Result<u32, String> {
    let wrong = |domain: &dyn std::fmt::Display| {
        format!("`{domain}` is not a domain; ROS_DOMAIN_ID is a number from 0 to 232")
    };
    if let Some(domain) = setting {
        return u32::try_from(domain).map_err(|_| wrong(&domain));
    }
    let Some(text) = variable("ROS_DOMAIN_ID") else {
        return Ok(0);
    };
    let domain = text.parse().ok().filter(|domain| *domain <= 232);
    domain.ok_or_else(|| wrong(&text))
}

/// Where others are looked for: on the interfaces of the setting, else as the variables of ROS 2
/// say.
fn discovery(
    mut configuration: Configuration,
    interfaces: &[String],
    variable: &Variable<'_>,
) -> Result<Configuration, String> {
    let is_local = variable("ROS_LOCALHOST_ONLY").is_some_and(|value| value != "0");
    let range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE");
    let range = match range.as_deref() {
        _ if is_local => "LOCALHOST",
        None => "SUBNET",
        Some(range @ ("SUBNET" | "SYSTEM_DEFAULT" | "LOCALHOST" | "OFF")) => range,
        Some(other) => {
            return Err(format!(
                "ROS_AUTOMATIC_DISCOVERY_RANGE is `{other}`; it is SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT"
            ));
        }
    };
    for wanted in interfaces {
        configuration = configuration.interface(wanted)?;
    }
    let configuration = match range {
        // Nodes with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST look at known ports.
        _ if !interfaces.is_empty() && interfaces.iter().all(|wanted| is_loopback(wanted)) => {
            configuration.known_ports()
        }
        _ if !interfaces.is_empty() => configuration,
        "LOCALHOST" => configuration.localhost(),
        "OFF" => return Ok(configuration.localhost().without_discovery()),
        _ => configuration,
    };
    let peers = variable("ROS_STATIC_PEERS").filter(|_| !is_local);
    let peers = peers.unwrap_or_default();
    let peers = peers
        .split(';')
        .map(str::trim)
        .filter(|peer| !peer.is_empty());
    Ok(peers.fold(configuration, |configuration, peer| {
        configuration.peer(peer)
    }))
}

/// Whether an interface, by its name or its address, is that of this machine alone.
fn is_loopback(wanted: &str) -> bool {
    let known = rc_ddsc::interfaces();
    let named = known.iter().find(|(name, _)| name == wanted);
    named
        .map_or(wanted, |(_, address)| address)
        .starts_with("127.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::Backend;
    use rc_runtime::{
        Component, Core, Description, Linked, Ports, StartError, Values, WorkerError, embed,
    };
    use std::sync::Mutex;
    use std::time::Duration;

    static DESCRIPTION: Description = Description {
        name: "configured",
        model_hash: 1,
        middleware: crate::NAME,
        period: Duration::from_millis(2),
        parameters: None,
        folder: "/nowhere",
        slots: &[],
        backends: &[Linked {
            connect: record,
            ..crate::LINKED
        }],
        types: &[],
        simulates_time: false,
        converter: None,
        managed: false,
        note: b"",
    };

    static LEASES: Mutex<Vec<Duration>> = Mutex::new(Vec::new());

    /// Keeps the lease, and refuses to start.
    fn record(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let configuration = of(environment)?.joining.configuration;
        let (_, lease) = configuration.split_once("<LeaseDuration>").expect("one");
        let (lease, _) = lease.split_once("ns<").expect("nanoseconds");
        let lease = lease.parse().expect("a number");
        LEASES
            .lock()
            .expect("the leases")
            .push(Duration::from_nanos(lease));
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

    /// The configuration with these variables of ROS 2.
    fn discovered(variables: &[(&str, &str)]) -> Result<String, String> {
        let variable = |name: &str| {
            let mut set = variables.iter().filter(|(set, _)| *set == name);
            set.next().map(|(_, value)| (*value).to_owned())
        };
        let configuration = Configuration::new(0, Duration::from_secs(1));
        Ok(discovery(configuration, &[], &variable)?.text())
    }

    #[test]
    fn the_variables_of_ros_choose_who_is_found() {
        const RANGE: &str = "ROS_AUTOMATIC_DISCOVERY_RANGE";
        const PEERS: (&str, &str) = ("ROS_STATIC_PEERS", "10.0.0.1; robot ;");
        let found = |variables: &[(&str, &str)]| {
            let text = discovered(variables).expect("a configuration");
            let has = |part: &str| text.contains(part);
            (
                has("127.0.0.1"),
                has("\"10.0.0.1\"") && has("\"robot\""),
                !has("<AllowMulticast>false"),
            )
        };
        assert_eq!(found(&[]), (false, false, true));
        assert_eq!(found(&[PEERS]), (false, true, true));
        assert_eq!(found(&[(RANGE, "SUBNET"), PEERS]), (false, true, true));
        assert_eq!(found(&[(RANGE, "LOCALHOST"), PEERS]), (true, true, true));
        assert_eq!(found(&[(RANGE, "OFF"), PEERS]), (true, false, false));
        let only = ("ROS_LOCALHOST_ONLY", "1");
        assert_eq!(found(&[only, PEERS]), (true, false, true));
        assert_eq!(found(&[("ROS_LOCALHOST_ONLY", "0")]), (false, false, true));
        assert!(discovered(&[(RANGE, "NEAR")]).is_err());
    }
}
