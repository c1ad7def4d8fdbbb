//! The settings of `[middleware.ros2]`, and what the environment of ROS 2 says where they leave something open.

use crate::names;
use rc_middleware::{Environment, OpenError};
use rc_settings::ros::{self, Rule};
use ros2_client::NodeName;
use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

/// How requests and replies are told apart in ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mapping {
    /// Beside the body, in the inline quality of service, as `rmw_fastrtps` does.
    Enhanced,
    /// In a header before the body, as `rmw_cyclonedds` does.
    Cyclone,
}

/// What is set.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) domain: u16,
    /// The addresses of the interfaces that are used; all where there is none.
    pub(crate) networks: Option<Vec<IpAddr>>,
    pub(crate) mapping: Mapping,
    pub(crate) node: NodeName,
    pub(crate) rules: Vec<Rule>,
    pub(crate) lease: Duration,
}

/// Why a component does not come into ROS 2.
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
    let values = |key: &str| environment.settings.values(crate::NAME, key);
    let one = |key: &str| values(key).first().cloned();
    let domain = match one("domain").or_else(|| variable("ROS_DOMAIN_ID")) {
        None => 0,
        Some(text) => text
            .parse()
            .ok()
            .filter(|domain| *domain <= 232)
            .ok_or_else(|| {
                format!("`{text}` is no domain; ROS_DOMAIN_ID is a number from 0 to 232")
            })?,
    };
    let mapping = match one("service_mapping").as_deref() {
        Some("cyclone") => Mapping::Cyclone,
        _ => Mapping::Enhanced,
    };
    let (namespace, own) = ros::node(
        &environment.network,
        &environment.instance,
        one("namespace"),
        one("node"),
    );
    let node = names::node(&namespace, &own)?;
    let rules = values("remap").iter();
    let rules = rules.filter_map(|text| Rule::parse(text, &namespace, &own));
    let lease = one("lease").and_then(|text| rc_network::milliseconds(&text));
    Ok(Config {
        domain,
        networks: networks(values("interfaces"), variable)?,
        mapping,
        node,
        rules: rules.collect(),
        lease: lease.map_or(Duration::from_secs(1), Duration::from_millis),
    })
}

/// The addresses that are used, by the settings and else by the variables of ROS 2.
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
