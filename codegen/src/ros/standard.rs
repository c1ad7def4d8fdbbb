//! Searches in the types of ROS 2 that annotations are compared with.

use super::names::{Kind, TypeName};
use rc_diagnostics::nearest;
use rc_ros_types::{Definition, STANDARD};

/// The fields of a type. `None` if the table does not have it.
pub(super) fn of(name: &TypeName) -> Option<&'static Definition<'static>> {
    STANDARD.get(&name.to_string())
}

/// All types of a kind in a package. The table has either all types of a package or none.
pub(super) fn names(package: &str, kind: Kind) -> Vec<&'static str> {
    let folder = format!("{package}/{}/", kind.word());
    let all = STANDARD.names();
    all.filter(|name| name.starts_with(&folder)).collect()
}

/// A type with the same name in a package with a similar name.
pub(super) fn elsewhere(name: &TypeName) -> Option<&'static str> {
    let ending = format!("/{}/{}", name.kind.word(), name.name);
    let packages = STANDARD.names();
    let packages = packages.filter_map(|known| known.strip_suffix(&ending));
    let package = nearest(&name.package, packages)?;
    STANDARD.name(&format!("{package}{ending}"))
}

/// A type with a name similar to `text`.
pub(super) fn near(text: &str) -> Option<&'static str> {
    nearest(text, STANDARD.names())
}

/// Whether this is a package of ROS 2.
pub(super) fn has_package(name: &str) -> bool {
    [Kind::Message, Kind::Service]
        .iter()
        .any(|kind| !names(name, *kind).is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_ros_types::words;

    #[test]
    fn the_types_of_ros_have_valid_names_and_known_fields() {
        for name in STANDARD.names() {
            let standard = STANDARD.get(name).expect("a type");
            let name = TypeName::parse(name).expect("a name");
            let service = name.kind == Kind::Service;
            assert!(service || standard.response.is_empty());
            for (ty, field) in standard.fields.iter().chain(&standard.response) {
                assert_eq!(words::field(field), *field, "{name}");
                let element = ty.split('[').next().expect("a part");
                // The table also has the types of fields.
                if let Some((package, of)) = element.split_once('/') {
                    let inner = TypeName::parse(&format!("{package}/msg/{of}"));
                    assert!(of_table(&inner.expect("a name")), "{name}: {ty}");
                }
            }
        }
        let scan = TypeName::parse("sensor_msgs/msg/LaserScan").expect("a name");
        let scan = super::of(&scan).expect("a type");
        assert_eq!(scan.fields.len(), 10);
        assert_eq!(scan.fields[8], ("float32[]", "ranges"));
        let sum = TypeName::parse("example_interfaces/srv/AddTwoInts").expect("a name");
        let sum = super::of(&sum).expect("a type");
        assert_eq!(sum.fields, [("int64", "a"), ("int64", "b")]);
        assert_eq!(sum.response, [("int64", "sum")]);
    }

    fn of_table(name: &TypeName) -> bool {
        super::of(name).is_some()
    }
}
