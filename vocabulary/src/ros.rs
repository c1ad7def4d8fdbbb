//! Names of ROS 2, and rules that remap them.

use std::fmt;

/// Whether `text` may be the name of a node: letters, digits and `_`, no digit first.
pub fn is_node(text: &str) -> bool {
    let first = text.bytes().next();
    first.is_some_and(|b| !b.is_ascii_digit())
        && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// Whether `text` may be the namespace of a node: `/`, or parts that each follow a `/`.
pub fn is_namespace(text: &str) -> bool {
    text == "/" || text.strip_prefix('/').is_some_and(is_path)
}

/// Whether `text` may be the name of a topic or a service: absolute as `/scan`, relative to the
/// namespace of its node as `front/scan`, or private to the node as `~/scan`.
pub fn is_name(text: &str) -> bool {
    let path = text.strip_prefix('/').or_else(|| text.strip_prefix("~/"));
    is_path(path.unwrap_or(text))
}

fn is_path(text: &str) -> bool {
    text.split('/')
        .all(|part| is_node(part) && !part.contains("__"))
}

/// The absolute name of a topic or a service of a node.
pub fn full(name: &str, namespace: &str, node: &str) -> String {
    let namespace = namespace.trim_end_matches('/');
    match name.strip_prefix("~/") {
        Some(rest) => format!("{namespace}/{node}/{rest}"),
        None if name.starts_with('/') => name.to_owned(),
        None => format!("{namespace}/{name}"),
    }
}

/// The absolute name for an address. A `_` replaces characters that ROS does not allow.
///
/// `default/Laser` and `getLaserData` become `/default/Laser/getLaserData`.
pub fn name(address: &str) -> String {
    let parts = address.split('/').filter(|part| !part.is_empty());
    parts.map(|part| format!("/{}", token(part))).collect()
}

/// The namespace and the name of the node of an instance. The settings `namespace` and `own` take
/// precedence over the names of the network and the instance.
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

/// Converts a part of an address: letters, digits and single `_`, no digit first.
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

/// The end of both names of a rule for all default names of a network.
const ALL_BELOW: &str = "/*";

/// A rule `FROM:=TO`, as ROS 2 writes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remapping {
    /// A slot, `SLOT/operation`, or an absolute name.
    pub from: String,
    /// The name that takes its place.
    pub to: String,
}

impl Remapping {
    /// Parses `FROM:=TO`.
    pub fn parse(text: &str) -> Option<Self> {
        let (from, to) = text.split_once(":=")?;
        Self::new(from, to)
    }

    /// A rule of its parts. `None` if one of them is not a name.
    pub fn new(from: &str, to: &str) -> Option<Self> {
        let fits = is_name(from) && !from.starts_with('~') && is_name(to);
        fits.then(|| Self {
            from: from.to_owned(),
            to: to.to_owned(),
        })
    }

    /// The rule of another namespace on a command line: default names below `/NETWORK` are below
    /// `namespace` instead. Files cannot have such a rule.
    ///
    /// ```
    /// use rc_vocabulary::ros::{Remapping, operation};
    /// let rule = Remapping::of_namespace("patrol", "/robot").resolve("/robot", "lidar");
    /// let name = operation("patrol/LaserPub/newScan", "LaserPub", "newScan", &[rule]);
    /// assert_eq!(name, "/robot/LaserPub/newScan");
    /// ```
    pub fn of_namespace(network: &str, namespace: &str) -> Self {
        let all = |prefix: &str| format!("{}{ALL_BELOW}", prefix.trim_end_matches('/'));
        Self {
            from: all(&name(network)),
            to: all(namespace),
        }
    }

    /// The rule for a node, with an absolute name in place of `TO`.
    pub fn resolve(&self, namespace: &str, node: &str) -> ResolvedRemapping {
        ResolvedRemapping {
            from: self.from.clone(),
            to: full(&self.to, namespace, node),
        }
    }
}

impl fmt::Display for Remapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:={}", self.from, self.to)
    }
}

/// A [`Remapping`] of a node, whose new name is absolute.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResolvedRemapping {
    from: String,
    to: String,
}

impl ResolvedRemapping {
    /// The default name in another namespace, if the rule is about namespaces.
    fn relocate(&self, default: &str) -> Option<String> {
        let [from, to] = [&self.from, &self.to].map(|name| name.strip_suffix(ALL_BELOW));
        let below = default.strip_prefix(from?)?;
        below
            .starts_with('/')
            .then(|| format!("{}{below}", to.unwrap_or_default()))
    }

    /// The name of an operation by this rule, if the rule matches. Its name without rules is
    /// `default`.
    fn apply(&self, slot: &str, operation: &str, default: &str) -> Option<String> {
        if self.from == default || self.from.rsplit_once('/') == Some((slot, operation)) {
            return Some(self.to.clone());
        }
        (self.from == slot).then(|| format!("{}/{}", self.to, token(operation)))
    }
}

/// The name of the topic or service of an operation at `address`: by the first matching rule,
/// else by the address.
pub fn operation(
    address: &str,
    slot: &str,
    operation: &str,
    rules: &[ResolvedRemapping],
) -> String {
    let default = name(address);
    let relocated = rules.iter().find_map(|rule| rule.relocate(&default));
    let default = relocated.unwrap_or(default);
    let mut remapped = rules.iter();
    let remapped = remapped.find_map(|rule| rule.apply(slot, operation, &default));
    remapped.unwrap_or(default)
}

/// Help for a rule that remaps neither an absolute name nor a slot or operation of a component.
/// `slots` are its slots with their operations. `None` if the target exists.
pub fn unknown_target_help(from: &str, slots: &[(&str, Vec<&str>)]) -> Option<String> {
    if from.starts_with('/') {
        return None;
    }
    let allowed = "allowed is a slot, SLOT/operation or a name that begins with `/`";
    crate::target::unknown_target_help(from, slots, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_the_rules_of_ros() {
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
    fn the_first_matching_rule_wins() {
        let named = |rules: &[&str]| {
            let rules = rules
                .iter()
                .filter_map(|rule| Remapping::parse(rule))
                .map(|rule| rule.resolve("/robot", "lidar"));
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
    fn default_names_are_relative_to_the_network() {
        let named = |namespace: &str, rule: &str, address: &str| {
            let rules = [
                Remapping::of_namespace("my-robot", namespace),
                Remapping::parse(rule).expect("a rule"),
            ];
            let rules = rules.map(|rule| rule.resolve(namespace, "lidar"));
            operation(address, "Laser", "get", &rules)
        };
        let other = "/other:=/no";
        assert_eq!(named("/a/b", other, "my-robot/Laser/get"), "/a/b/Laser/get");
        assert_eq!(named("/", other, "my-robot/Laser/get"), "/Laser/get");
        assert_eq!(
            named("/a", other, "my-robots/Laser/get"),
            "/my_robots/Laser/get"
        );
        assert_eq!(
            named("/a", "/a/Laser/get:=scan", "my-robot/Laser/get"),
            "/a/scan"
        );
        assert_eq!(named("/a", "Laser:=/x", "my-robot/Laser/get"), "/x/get");
    }

    #[test]
    fn invalid_rules_are_rejected() {
        let parsed = |text: &str| {
            let rule = Remapping::parse(text)?;
            assert_eq!(rule.to_string(), text);
            Some((rule.from, rule.to))
        };
        let names = |from: &str, to: &str| Some((from.to_owned(), to.to_owned()));
        assert_eq!(
            parsed("LaserPub/newScan:=/scan"),
            names("LaserPub/newScan", "/scan")
        );
        assert_eq!(parsed("/a:=b"), names("/a", "b"));
        for wrong in [
            "a", "~/a:=/b", ":=/b", "a:=", "a:=/b c", "a:=/", "a=b", "a:=b:=c",
        ] {
            assert_eq!(parsed(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn an_unknown_target_is_reported_with_the_nearest_name() {
        let slots = [("LaserPub", vec!["newScan"]), ("Base", vec!["stop"])];
        for right in ["LaserPub", "Base/stop", "/anything"] {
            assert_eq!(unknown_target_help(right, &slots), None, "{right}");
        }
        let said = unknown_target_help("LaserPub/newScn", &slots).expect("a hint");
        assert_eq!(said, "did you mean `LaserPub/newScan`?");
        assert!(
            unknown_target_help("x", &slots).is_some_and(|said| said.contains("SLOT/operation"))
        );
    }
}
