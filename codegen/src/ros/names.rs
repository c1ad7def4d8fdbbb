//! What the types of an interface are called in ROS 2, the same for who exports them and for a component that runs.

use super::words;
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, ModuleId, Operation, Type, TypeDeclKind, TypeId};
use rc_syntax::Name;
use std::fmt;

/// The kinds of interfaces that are mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// `msg`
    Message,
    /// `srv`
    Service,
}

impl Kind {
    /// The word between package and name.
    pub fn word(self) -> &'static str {
        match self {
            Self::Message => "msg",
            Self::Service => "srv",
        }
    }
}

/// The name of a type, as ROS has it: `sensor_msgs/msg/LaserScan`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TypeName {
    /// Its package.
    pub package: String,
    /// Its kind.
    pub kind: Kind,
    /// Its own name.
    pub name: String,
}

impl TypeName {
    /// Reads `package/msg/Name`; none where it is not such a name.
    pub fn parse(text: &str) -> Option<Self> {
        let mut parts = text.split('/');
        let (package, kind, name) = (parts.next()?, parts.next()?, parts.next()?);
        let kind = match kind {
            "msg" => Kind::Message,
            "srv" => Kind::Service,
            _ => return None,
        };
        let right = parts.next().is_none() && words::is_package(package) && words::is_type(name);
        right.then(|| Self {
            package: package.to_owned(),
            kind,
            name: name.to_owned(),
        })
    }

    /// As DDS knows a message: `sensor_msgs::msg::dds_::LaserScan_`.
    pub fn in_dds(&self) -> String {
        self.in_dds_with("")
    }

    /// As DDS knows the request of a service: `std_srvs::srv::dds_::Trigger_Request_`.
    pub fn request_in_dds(&self) -> String {
        self.in_dds_with("_Request")
    }

    /// The same of its response.
    pub fn response_in_dds(&self) -> String {
        self.in_dds_with("_Response")
    }

    fn in_dds_with(&self, part: &str) -> String {
        let (package, kind, name) = (&self.package, self.kind.word(), &self.name);
        format!("{package}::{kind}::dds_::{name}{part}_")
    }
}

impl fmt::Display for TypeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}", self.package, self.kind.word(), self.name)
    }
}

/// The package of a module.
pub fn package(library: &Library, module: ModuleId) -> String {
    let module = library.module(module);
    match &module.ros_package {
        Some(own) => own.text.clone(),
        None => words::package(&module.name.text),
    }
}

/// The message of a structure or an exception, the constants of an enum, one entry of a dictionary.
pub fn message(library: &Library, id: TypeId) -> TypeName {
    let decl = library.ty(id);
    if let Some(other) = decl
        .ros_type
        .as_ref()
        .and_then(|ros| TypeName::parse(&ros.text))
    {
        return other;
    }
    let name = &decl.name.text;
    TypeName {
        package: package(library, decl.module),
        kind: Kind::Message,
        name: match &decl.kind {
            TypeDeclKind::Alias(_) => format!("{}Entry", words::camel(name)),
            _ => words::ty(name),
        },
    }
}

/// The structure whose message an operation is as a topic: that of its only parameter.
pub fn structure_of_topic(library: &Library, operation: &Operation) -> Option<TypeId> {
    let [only] = operation.inputs.as_slice() else {
        return None;
    };
    match library.resolved(&only.ty) {
        Type::Named(id) if !only.optional => {
            matches!(library.ty(*id).kind, TypeDeclKind::Struct(_)).then_some(*id)
        }
        _ => None,
    }
}

/// The type of the topic that an operation is.
pub fn topic_type(library: &Library, interface: InterfaceId, operation: &Operation) -> TypeName {
    if let Some((_, other)) = annotated(operation, Kind::Message) {
        return other;
    }
    match structure_of_topic(library, operation) {
        Some(only) => message(library, only),
        None => of_operation(library, interface, operation, Kind::Message),
    }
}

/// The type of the service that an operation is.
pub fn service_type(library: &Library, interface: InterfaceId, operation: &Operation) -> TypeName {
    match annotated(operation, Kind::Service) {
        Some((_, other)) => other,
        None => of_operation(library, interface, operation, Kind::Service),
    }
}

/// The type that an operation says it has, and where it says so.
pub(super) fn annotated(operation: &Operation, kind: Kind) -> Option<(&Name, TypeName)> {
    let mut all = operation
        .ros_types
        .iter()
        .filter_map(|ros| Some((ros, TypeName::parse(&ros.text)?)));
    all.find(|(_, other)| other.kind == kind)
}

/// `InterfaceOperation`.
fn of_operation(
    library: &Library,
    interface: InterfaceId,
    operation: &Operation,
    kind: Kind,
) -> TypeName {
    let interface = library.interface(interface);
    let (first, second) = (&interface.name.text, &operation.name.text);
    TypeName {
        package: package(library, interface.module),
        kind,
        name: words::camel(first) + &words::camel(second),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_three_parts() {
        let name = TypeName::parse("sensor_msgs/msg/LaserScan").expect("a name");
        assert_eq!(name.to_string(), "sensor_msgs/msg/LaserScan");
        assert_eq!(name.in_dds(), "sensor_msgs::msg::dds_::LaserScan_");
        let name = TypeName::parse("std_srvs/srv/Trigger").expect("a name");
        assert_eq!(
            name.request_in_dds(),
            "std_srvs::srv::dds_::Trigger_Request_"
        );
        assert_eq!(
            name.response_in_dds(),
            "std_srvs::srv::dds_::Trigger_Response_"
        );
        for wrong in [
            "LaserScan",
            "sensor_msgs/LaserScan",
            "sensor_msgs/action/LaserScan",
            "sensor_msgs/msg/laserScan",
            "Sensor/msg/LaserScan",
            "a/msg/B",
            "sensor_msgs/msg/LaserScan/x",
            "",
        ] {
            assert_eq!(TypeName::parse(wrong), None, "{wrong}");
        }
    }
}
