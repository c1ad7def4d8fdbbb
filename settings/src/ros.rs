//! Names of ROS 2, and rules that give others.

use rc_diagnostics::nearest;

/// What may be the name of a node: letters, digits and `_`, no digit first.
pub fn is_node(text: &str) -> bool {
    let first = text.bytes().next();
    first.is_some_and(|b| !b.is_ascii_digit())
        && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// What may be the namespace of a node: `/`, or `/` before each of its parts.
pub fn is_namespace(text: &str) -> bool {
    text == "/" || text.strip_prefix('/').is_some_and(is_path)
}

/// What may be the name of a topic or a service: `/scan`, `front/scan` within the namespace of its node, or `~/scan` below the
/// node itself.
pub fn is_name(text: &str) -> bool {
    let path = text.strip_prefix('/').or_else(|| text.strip_prefix("~/"));
    is_path(path.unwrap_or(text))
}

fn is_path(text: &str) -> bool {
    text.split('/')
        .all(|part| is_node(part) && !part.contains("__"))
}

/// The name in full of a topic or a service that is named at a node.
pub fn full(name: &str, namespace: &str, node: &str) -> String {
    let namespace = namespace.trim_end_matches('/');
    match name.strip_prefix("~/") {
        Some(rest) => format!("{namespace}/{node}/{rest}"),
        None if name.starts_with('/') => name.to_owned(),
        None => format!("{namespace}/{name}"),
    }
}

/// Reads `FROM:=TO`: a slot, `SLOT/operation` or a name that begins with `/`, and the name that takes its place.
pub fn remapping(text: &str) -> Option<(&str, &str)> {
    let (from, to) = text.split_once(":=")?;
    let fits = is_name(from) && !from.starts_with('~') && is_name(to);
    fits.then_some((from, to))
}

/// What to say where what a rule renames is no slot of a component, and no operation of one; `slots` are these, and what
/// each of them has.
pub fn misses(from: &str, slots: &[(&str, Vec<&str>)]) -> Option<String> {
    if from.starts_with('/') {
        return None;
    }
    let operations = slots
        .iter()
        .flat_map(|(slot, operations)| operations.iter().map(move |o| format!("{slot}/{o}")));
    let own = slots.iter().map(|(slot, _)| (*slot).to_owned());
    let names: Vec<String> = own.chain(operations).collect();
    if names.iter().any(|name| name == from) {
        return None;
    }
    let near = nearest(from, names.iter().map(String::as_str));
    Some(match near {
        Some(near) => format!("did you mean `{near}`?"),
        None => "a slot, SLOT/operation or a name that begins with `/` may stand there".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_ros() {
        for right in ["/scan", "scan", "~/scan", "/a/b_1", "_a"] {
            assert!(is_name(right), "{right}");
        }
        for wrong in [
            "", "/", "~", "~/", "//a", "a/", "a//b", "1a", "a/1", "a__b", "a b", "ä", "a-b",
        ] {
            assert!(!is_name(wrong), "{wrong}");
        }
        assert!(is_namespace("/") && is_namespace("/a/b"));
        for wrong in ["", "a", "/a/", "//", "/1"] {
            assert!(!is_namespace(wrong), "{wrong}");
        }
        assert!(is_node("lidar_1") && !is_node("1_lidar") && !is_node("a/b") && !is_node(""));
    }

    #[test]
    fn names_are_completed() {
        assert_eq!(full("/scan", "/robot", "lidar"), "/scan");
        assert_eq!(full("scan", "/robot", "lidar"), "/robot/scan");
        assert_eq!(full("~/scan", "/robot", "lidar"), "/robot/lidar/scan");
        assert_eq!(full("scan", "/", "lidar"), "/scan");
        assert_eq!(full("~/scan", "/", "lidar"), "/lidar/scan");
    }

    #[test]
    fn rules_have_two_names() {
        assert_eq!(
            remapping("LaserPub/newScan:=/scan"),
            Some(("LaserPub/newScan", "/scan"))
        );
        assert_eq!(remapping("/a:=b"), Some(("/a", "b")));
        for wrong in [
            "a", "~/a:=/b", ":=/b", "a:=", "a:=/b c", "a:=/", "a=b", "a:=b:=c",
        ] {
            assert_eq!(remapping(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_rule_for_nobody_is_told_with_the_nearest_name() {
        let slots = [("LaserPub", vec!["newScan"]), ("Base", vec!["stop"])];
        for right in ["LaserPub", "Base/stop", "/anything"] {
            assert_eq!(misses(right, &slots), None, "{right}");
        }
        let said = misses("LaserPub/newScn", &slots).expect("a hint");
        assert_eq!(said, "did you mean `LaserPub/newScan`?");
        assert!(misses("x", &slots).is_some_and(|said| said.contains("SLOT/operation")));
    }
}
