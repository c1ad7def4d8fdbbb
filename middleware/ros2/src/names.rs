//! The names of addresses and types in ROS 2, and in DDS below it.

use rc_middleware::{Endpoint, ExternalType, OpenError};
use rc_vocabulary::ros::{self, ResolvedRemapping};

/// The names of a topic of DDS and of its type.
pub(crate) type Topic = (String, String);

/// The topic of a publisher or subscriber, whose address includes the operation.
pub(crate) fn topic(endpoint: &Endpoint, rules: &[ResolvedRemapping]) -> Result<Topic, OpenError> {
    let external = endpoint
        .external_types
        .first()
        .ok_or_else(|| not_generated(endpoint))?;
    let name = renamed(endpoint.address.as_str(), external, rules);
    let (package, own) = parts(endpoint, external)?;
    Ok((format!("rt{name}"), format!("{package}::msg::dds_::{own}_")))
}

/// The topics of the requests and of the replies of an operation.
pub(crate) fn service(
    endpoint: &Endpoint,
    external: &ExternalType,
    rules: &[ResolvedRemapping],
) -> Result<[Topic; 2], OpenError> {
    let usual = format!("{}/{}", endpoint.address, external.operation);
    let name = renamed(&usual, external, rules);
    let (package, own) = parts(endpoint, external)?;
    Ok(service_topics(&name, package, own))
}

/// The topics of the service `name` of the type `PACKAGE/srv/OWN`.
pub(crate) fn service_topics(name: &str, package: &str, own: &str) -> [Topic; 2] {
    let parts = [("rq", "Request", "Request"), ("rr", "Reply", "Response")];
    parts.map(|(prefix, ending, part)| {
        (
            format!("{prefix}{name}{ending}"),
            format!("{package}::srv::dds_::{own}_{part}_"),
        )
    })
}

/// The address of a service, for the topic of its requests.
pub(crate) fn address_of_requests(topic: &str) -> &str {
    let address = topic.strip_prefix("rq").unwrap_or(topic);
    address.strip_suffix("Request").unwrap_or(address)
}

fn not_generated(endpoint: &Endpoint) -> OpenError {
    OpenError::Backend {
        address: endpoint.address.to_string(),
        reason: "this component was generated without types of ROS 2; generate it again with --middleware ros2"
            .to_owned(),
    }
}

/// The package and the name of a type.
fn parts<'a>(
    endpoint: &Endpoint,
    external: &'a ExternalType,
) -> Result<(&'a str, &'a str), OpenError> {
    let mut parts = external.type_name.split('/');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(package), Some("msg" | "srv"), Some(name), None) => Ok((package, name)),
        _ => Err(OpenError::Backend {
            address: endpoint.address.to_string(),
            reason: format!("`{}` is not a type of ROS 2", external.type_name),
        }),
    }
}

fn renamed(address: &str, external: &ExternalType, rules: &[ResolvedRemapping]) -> String {
    ros::operation(address, &external.slot, &external.operation, rules)
}

/// The name of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NodeName {
    /// `/` or `/a/b`.
    pub(crate) namespace: String,
    /// Name without its namespace.
    pub(crate) name: String,
}

impl NodeName {
    /// The namespace and the name, as one absolute name.
    pub(crate) fn full(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::{Address, Qos, TypeIdentity};
    use rc_vocabulary::ros::Remapping;

    fn endpoint(address: &str, type_name: &str) -> Endpoint {
        Endpoint {
            address: Address::parse(address).expect("an address"),
            types: TypeIdentity {
                name: "RoboCompLaser::Laser".to_owned(),
                hash: 1,
            },
            qos: Qos::CALL,
            external_types: vec![ExternalType {
                slot: "Laser1".to_owned(),
                operation: "getLaserData".to_owned(),
                id: 1,
                type_name: type_name.to_owned(),
            }],
        }
    }

    #[test]
    fn a_service_has_two_topics() {
        let end = endpoint("default/Laser", "robocomp_laser_msgs/srv/LaserGetLaserData");
        let topics = service(&end, &end.external_types[0], &[]).expect("a service");
        assert_eq!(
            topics,
            [
                (
                    "rq/default/Laser/getLaserDataRequest".to_owned(),
                    "robocomp_laser_msgs::srv::dds_::LaserGetLaserData_Request_".to_owned()
                ),
                (
                    "rr/default/Laser/getLaserDataReply".to_owned(),
                    "robocomp_laser_msgs::srv::dds_::LaserGetLaserData_Response_".to_owned()
                )
            ]
        );
    }

    #[test]
    fn a_node_may_be_in_the_root() {
        let full = |namespace: &str| {
            let node = NodeName {
                namespace: namespace.to_owned(),
                name: "lidar".to_owned(),
            };
            node.full()
        };
        assert_eq!(full("/"), "/lidar");
        assert_eq!(full("/robot/front"), "/robot/front/lidar");
    }

    #[test]
    fn names_can_be_others() {
        let end = endpoint("default/LaserPub/newScan", "sensor_msgs/msg/LaserScan");
        let with = |rule: &str| {
            let rule = Remapping::parse(rule).expect("a rule");
            let rule = rule.resolve("/robot", "lidar");
            let (topic, _) = topic(&end, &[rule]).expect("a topic");
            topic.strip_prefix("rt").expect("a topic of ROS").to_owned()
        };
        assert_eq!(with("Laser1/getLaserData:=/scan"), "/scan");
        assert_eq!(with("Laser1:=/front"), "/front/getLaserData");
        assert_eq!(with("/default/LaserPub/newScan:=scan"), "/robot/scan");
        assert_eq!(with("Laser1/getLaserData:=~/scan"), "/robot/lidar/scan");
        assert_eq!(with("Laser:=/scan"), "/default/LaserPub/newScan");
        let wrong = endpoint("default/LaserPub/newScan", "LaserScan");
        assert!(topic(&wrong, &[]).is_err());
    }

    #[test]
    fn the_address_of_requests_may_end_like_their_topic() {
        assert_eq!(address_of_requests("rq/a/armRequest"), "/a/arm");
        assert_eq!(address_of_requests("rq/a/RequestRequest"), "/a/Request");
    }
}
