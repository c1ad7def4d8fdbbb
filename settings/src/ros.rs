//! Names of ROS 2, and rules that give others.

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

/// A name of ROS for an address and what is below it: `/` and its parts, with `_` for what ROS does not allow in one.
///
/// `default/Laser` and `getLaserData` become `/default/Laser/getLaserData`.
pub fn name(address: &str) -> String {
    let parts = address.split('/').filter(|part| !part.is_empty());
    parts.map(|part| format!("/{}", token(part))).collect()
}

/// The namespace and the name of the node of an instance of a network: what somebody chose, else their own.
pub fn node(
    network: &str,
    instance: &str,
    namespace: Option<String>,
    own: Option<String>,
) -> (String, String) {
    let usual = || {
        let parts = instance.split('.');
        parts.map(token).collect::<Vec<_>>().join("_")
    };
    let namespace = namespace.unwrap_or_else(|| name(network));
    (namespace, own.unwrap_or_else(usual))
}

/// A part of a name: letters, digits and single `_`, no digit at its start.
fn token(text: &str) -> String {
    let mut token = String::new();
    for c in text.chars() {
        let c = if c.is_ascii_alphanumeric() { c } else { '_' };
        if token.is_empty() && !c.is_ascii_alphabetic() {
            token.push('n');
        }
        if c != '_' || !token.ends_with('_') {
            token.push(c);
        }
    }
    token
}

/// `FROM:=TO` of ROS: a slot, `SLOT/operation` or a name in full, and the name in full that takes its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rule {
    from: String,
    to: String,
}

impl Rule {
    /// Reads a rule for a node; `None` where it is none.
    pub fn parse(text: &str, namespace: &str, node: &str) -> Option<Self> {
        let (from, to) = remapping(text)?;
        Some(Self {
            from: from.to_owned(),
            to: full(to, namespace, node),
        })
    }

    /// What an operation is called by this rule, which it has the name `usual` without.
    fn apply(&self, slot: &str, operation: &str, usual: &str) -> Option<String> {
        if self.from == usual || self.from.split_once('/') == Some((slot, operation)) {
            return Some(self.to.clone());
        }
        (self.from == slot).then(|| format!("{}/{}", self.to, token(operation)))
    }
}

/// The name of the topic or service of an operation that is at `address`: by the first rule that fits, as in ROS, else by the
/// address.
pub fn operation(address: &str, slot: &str, operation: &str, rules: &[Rule]) -> String {
    let usual = name(address);
    let mut others = rules.iter();
    let other = others.find_map(|rule| rule.apply(slot, operation, &usual));
    other.unwrap_or(usual)
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
    let may = "a slot, SLOT/operation or a name that begins with `/` may stand there";
    crate::misses(from, slots, may)
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
    fn addresses_are_names() {
        assert_eq!(name("patrol/lidar/Laser"), "/patrol/lidar/Laser");
        assert_eq!(name("t0-7/2d__lidar/a.b"), "/t0_7/n2d_lidar/a_b");
        assert_eq!(name("a/_b"), "/a/n_b");
        for name in ["/patrol/lidar/Laser", "/t0_7/n2d_lidar/a_b", "/a/n_b"] {
            assert!(name.starts_with('/') && is_name(name));
        }
        let pair = |namespace: &str, own: &str| (namespace.to_owned(), own.to_owned());
        assert_eq!(
            node("t0-7", "arm.left-motor", None, None),
            pair("/t0_7", "arm_left_motor")
        );
        assert_eq!(node("a", "7", Some("/".to_owned()), None), pair("/", "n7"));
        assert_eq!(node("a", "b", None, Some("c".to_owned())), pair("/a", "c"));
    }

    #[test]
    fn the_first_rule_that_fits_counts() {
        let named = |rules: &[&str]| {
            let rules = rules
                .iter()
                .filter_map(|rule| Rule::parse(rule, "/robot", "lidar"));
            operation(
                "default/Laser/get",
                "Laser1",
                "get",
                &rules.collect::<Vec<_>>(),
            )
        };
        assert_eq!(named(&[]), "/default/Laser/get");
        assert_eq!(named(&["Laser1/get:=/scan", "Laser1:=/front"]), "/scan");
        assert_eq!(
            named(&["Laser1:=/front", "Laser1/get:=/scan"]),
            "/front/get"
        );
        assert_eq!(named(&["/default/Laser/get:=scan"]), "/robot/scan");
        assert_eq!(
            named(&["Laser:=/no", "Laser1/set:=/no"]),
            "/default/Laser/get"
        );
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
