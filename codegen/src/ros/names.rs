//! The names of types in ROS 2. The export and running components use the same names.

use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, ModuleId, Operation, Type, TypeDeclKind, TypeId};
use rc_ros_types::words;
use rc_syntax::Name;
use std::fmt;

/// The kind of a ROS 2 interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// `msg`
    Message,
    /// `srv`
    Service,
}

impl Kind {
    /// The part of a type's name between package and name.
    pub fn word(self) -> &'static str {
        match self {
            Self::Message => "msg",
            Self::Service => "srv",
        }
    }
}

/// The name of a type in ROS 2: `sensor_msgs/msg/LaserScan`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TypeName {
    /// The package: `sensor_msgs`.
    pub package: String,
    /// The kind.
    pub kind: Kind,
    /// The name without package: `LaserScan`.
    pub name: String,
}

impl TypeName {
    /// Parses `package/msg/Name` or `package/srv/Name`. `None` if the text has another form.
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

    /// The name of a message type in DDS: `sensor_msgs::msg::dds_::LaserScan_`.
    pub fn in_dds(&self) -> String {
        self.in_dds_with("")
    }

    /// The name of a request type in DDS: `std_srvs::srv::dds_::Trigger_Request_`.
    pub fn request_in_dds(&self) -> String {
        self.in_dds_with("_Request")
    }

    /// The name of a response type in DDS: `std_srvs::srv::dds_::Trigger_Response_`.
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

/// The message of a struct or an exception, of the constants of an enum, or of an entry of a
/// dictionary.
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
            TypeDeclKind::Enum(_) | TypeDeclKind::Struct(_) | TypeDeclKind::Exception(_) => {
                words::ty(name)
            }
        },
    }
}

/// The struct whose message is the type of an operation's topic: that of its only parameter.
pub fn structure_of_topic(library: &Library, operation: &Operation) -> Option<TypeId> {
    let [only] = operation.inputs.as_slice() else {
        return None;
    };
    match library.resolved(&only.ty) {
        Type::Named(id) if !only.optional => {
            matches!(library.ty(*id).kind, TypeDeclKind::Struct(_)).then_some(*id)
        }
        Type::Primitive(_)
        | Type::Text { .. }
        | Type::Sequence { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. }
        | Type::Named(_) => None,
    }
}

/// The type of an operation's topic.
pub fn topic_type(library: &Library, interface: InterfaceId, operation: &Operation) -> TypeName {
    if let Some((_, other)) = annotated(operation, Kind::Message) {
        return other;
    }
    match structure_of_topic(library, operation) {
        Some(only) => message(library, only),
        None => of_operation(library, interface, operation, Kind::Message),
    }
}

/// The type of an operation's service.
pub fn service_type(library: &Library, interface: InterfaceId, operation: &Operation) -> TypeName {
    match annotated(operation, Kind::Service) {
        Some((_, other)) => other,
        None => of_operation(library, interface, operation, Kind::Service),
    }
}

/// The type of this kind in the `@ros` annotations of an operation, and the annotation.
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
    fn a_type_name_has_package_kind_and_name() {
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
