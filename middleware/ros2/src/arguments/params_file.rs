//! The files of parameters of ROS 2, `--params-file`: for nodes, by their names, the values of
//! their parameters.
//!
//! ```yaml
//! /**:
//!   ros__parameters: { use_sim_time: true }
//! /robot/lidar:
//!   ros__parameters:
//!     rate: 10.0
//! ```

use rc_diagnostics::{Diagnostic, Diagnostics, Format, SourceMap, Span, render};
use serde_json::Value as Json;
use serde_norway::Value as Yaml;
use std::path::Path;

/// The key below which parameters are.
const PARAMETERS: &str = "ros__parameters";
/// Deepest nesting of maps.
const DEEPEST: usize = 32;

/// The parameters of one file for one node, in their order. An error is a diagnostic with the
/// place in the file.
pub(super) fn parameters(path: &Path, node: &str) -> Result<Vec<(String, Json)>, String> {
    let text = rc_files::read(path)
        .map_err(|error| format!("error: {} cannot be read: {error}\n", path.display()))?;
    let mut sources = SourceMap::new();
    let source = sources.add(path, text);
    let mut reader = Reader {
        text: sources.text(source),
        node,
        start: Span::new(source, 0, 0),
        found: Diagnostics::new(),
        out: Vec::new(),
    };
    match serde_norway::from_str(reader.text) {
        Ok(document) => reader.sections(&document, "", 0),
        Err(error) => {
            let at = error.location().map_or(0, |place| place.index());
            let end = reader.text.len();
            let span = Span::new(source, at.min(end), at.min(end));
            let message = format!("this is not YAML: {error}");
            reader
                .found
                .push(Diagnostic::error("params-file", span, message));
        }
    }
    let (found, out) = (reader.found, reader.out);
    if found.has_errors() {
        return Err(render(&sources, &found, Format::Human));
    }
    Ok(out)
}

/// The value of a text of a command line, which is YAML.
pub(super) fn scalar(text: &str) -> Json {
    let value = serde_norway::from_str(text).ok();
    let value = value.and_then(|value: Yaml| json(&value));
    value.unwrap_or_else(|| Json::from(text))
}

struct Reader<'a> {
    text: &'a str,
    node: &'a str,
    start: Span,
    found: Diagnostics,
    out: Vec<(String, Json)>,
}

impl Reader<'_> {
    fn wrong(&mut self, key: &str, message: String, help: &str) {
        let diagnostic = Diagnostic::error("params-file", self.place(key), message);
        self.found.push(diagnostic.help(help));
    }

    /// The first place of this key. The parser knows no places.
    fn place(&self, key: &str) -> Span {
        let is_key = |at: &usize| {
            let (before, rest) = (&self.text[..*at], &self.text[at + key.len()..]);
            let rest = rest.trim_start_matches(['\'', '"']);
            rest.starts_with(':') && !before.ends_with(|c: char| c.is_alphanumeric() || c == '_')
        };
        let mut places = self.text.match_indices(key).map(|(at, _)| at);
        places.find(is_key).map_or(self.start, |at| {
            Span::new(self.start.source, at, at + key.len())
        })
    }

    /// Nodes and namespaces below `name`.
    fn sections(&mut self, value: &Yaml, name: &str, depth: usize) {
        let help = "write `NODE:`, and below it `ros__parameters:` with `NAME: VALUE`; `/**` means all nodes";
        let Yaml::Mapping(map) = value else {
            if !(value.is_null() && depth == 0) {
                let key = name.rsplit('/').next().unwrap_or(name);
                self.wrong(
                    key,
                    format!("expected nodes below `{name}`, found {}", kind(value)),
                    help,
                );
            }
            return;
        };
        for (key, value) in map {
            let Some(key) = key.as_str() else {
                self.wrong(
                    "",
                    format!("expected the name of a node, found {}", kind(key)),
                    help,
                );
                continue;
            };
            if key == PARAMETERS {
                if name.is_empty() {
                    self.wrong(key, format!("`{PARAMETERS}` is below no node"), help);
                } else if matches(name, self.node) {
                    self.values(value, "", 0);
                }
            } else if depth == DEEPEST {
                self.wrong(key, format!("`{key}` is nested too deep"), help);
            } else if is_pattern(key) {
                let separator = if key.starts_with('/') || name.ends_with('/') {
                    ""
                } else {
                    "/"
                };
                self.sections(value, &format!("{name}{separator}{key}"), depth + 1);
            } else {
                self.wrong(key, format!("`{key}` is not the name of a node"), help);
            }
        }
    }

    /// The parameters below `path`.
    fn values(&mut self, value: &Yaml, path: &str, depth: usize) {
        let help = "write `NAME: VALUE`";
        let Yaml::Mapping(map) = value else {
            let place = if path.is_empty() { PARAMETERS } else { path };
            self.wrong(
                place,
                format!("expected parameters below `{place}`, found {}", kind(value)),
                help,
            );
            return;
        };
        for (key, value) in map {
            let Some(key) = key.as_str() else {
                self.wrong(
                    "",
                    format!("expected the name of a parameter, found {}", kind(key)),
                    help,
                );
                continue;
            };
            let path = if path.is_empty() {
                key.to_owned()
            } else {
                format!("{path}.{key}")
            };
            match (value, json(value)) {
                (Yaml::Mapping(_), _) if depth == DEEPEST => {
                    self.wrong(key, format!("`{key}` is nested too deep"), help);
                }
                (Yaml::Mapping(_), _) => self.values(value, &path, depth + 1),
                (_, Some(value)) => self.out.push((path, value)),
                (_, None) => {
                    let message = format!("`{path}` cannot be {}", kind(value));
                    self.wrong(
                        key,
                        message,
                        "allowed is a number, a boolean, a string, or a list of these",
                    );
                }
            }
        }
    }
}

/// Whether this can name nodes: names and wildcards between `/`.
fn is_pattern(text: &str) -> bool {
    let parts = text.strip_prefix('/').unwrap_or(text);
    let is_part = |part: &str| matches!(part, "*" | "**") || rc_vocabulary::ros::is_node(part);
    parts.split('/').all(is_part)
}

/// Whether a pattern, with `*` for one name and `**` for any number of them, means this node.
fn matches(pattern: &str, node: &str) -> bool {
    fn all(pattern: &[&str], names: &[&str]) -> bool {
        match (pattern.split_first(), names.split_first()) {
            (None, None) => true,
            (Some((&"**", rest)), _) if all(rest, names) => true,
            (Some((&"**", _)), Some((_, names))) => all(pattern, names),
            (Some((&part, rest)), Some((&name, names))) => {
                (part == "*" || part == name) && all(rest, names)
            }
            _ => false,
        }
    }
    let parts = |text: &str| -> Vec<String> {
        text.split('/')
            .filter(|part| !part.is_empty())
            .map(str::to_owned)
            .collect()
    };
    let (mut pattern, names) = (parts(pattern), parts(node));
    // Several in a row mean the same, and would cost time.
    pattern.dedup_by(|a, b| a == "**" && b == "**");
    let pattern: Vec<&str> = pattern.iter().map(String::as_str).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    all(&pattern, &names)
}

/// A value of a parameter: a scalar, or a list of them.
fn json(value: &Yaml) -> Option<Json> {
    Some(match value {
        Yaml::Bool(value) => Json::Bool(*value),
        Yaml::String(value) => Json::from(value.as_str()),
        Yaml::Number(number) => match (number.as_i64(), number.as_u64(), number.as_f64()) {
            (Some(value), ..) => value.into(),
            (_, Some(value), _) => value.into(),
            // JSON has no words for these; the reader of parameters knows them.
            (_, _, Some(value)) if value.is_nan() => "nan".into(),
            (_, _, Some(value)) if value.is_infinite() => {
                if value > 0.0 { "inf" } else { "-inf" }.into()
            }
            (_, _, value) => value?.into(),
        },
        Yaml::Sequence(values) => {
            let is_list = |value: &Yaml| value.is_sequence();
            if values.iter().any(is_list) {
                return None;
            }
            values.iter().map(json).collect::<Option<Json>>()?
        }
        Yaml::Null | Yaml::Mapping(_) | Yaml::Tagged(_) => return None,
    })
}

/// Kind of a value, for messages.
fn kind(value: &Yaml) -> &'static str {
    match value {
        Yaml::Null => "nothing",
        Yaml::Bool(_) => "a boolean",
        Yaml::Number(_) => "a number",
        Yaml::String(_) => "a string",
        Yaml::Sequence(_) => "a list",
        Yaml::Mapping(_) => "a map",
        Yaml::Tagged(_) => "a value with a tag",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(text: &str, node: &str) -> Result<Vec<(String, Json)>, String> {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), text).expect("to write");
        let read = parameters(file.path(), node);
        read.map_err(|error| error.replace(&file.path().display().to_string(), "FILE"))
    }

    #[test]
    fn nodes_have_names_namespaces_and_wildcards() {
        for (pattern, node, expected) in [
            ("/**", "/a/b/lidar", true),
            ("/**", "/lidar", true),
            ("/*", "/lidar", true),
            ("/*", "/a/lidar", false),
            ("lidar", "/lidar", true),
            ("lidar", "/a/lidar", false),
            ("/a/lidar", "/a/lidar", true),
            ("/a/*", "/a/lidar", true),
            ("/*/lidar", "/a/lidar", true),
            ("/**/lidar", "/a/b/lidar", true),
            ("/**/lidar", "/lidar", true),
            ("/**/b/**", "/a/b/c/lidar", true),
            ("/a/**", "/b/lidar", false),
        ] {
            assert_eq!(matches(pattern, node), expected, "{pattern} {node}");
        }
        let many = "/**/x".repeat(40);
        assert!(!matches(&many, &"/a".repeat(40)));
    }

    #[test]
    fn a_file_has_parameters_for_many_nodes() {
        let text = "\
/**:
  ros__parameters:
    use_sim_time: true
    rate: 1
a:
  lidar:
    ros__parameters:
      rate: 2.5
      arm: {joints: [x, 'y'], gain: .inf}
      qos_overrides:
        /scan: {publisher: {depth: 3}}
/a/camera:
  ros__parameters: {rate: 7}
";
        let expected = [
            ("use_sim_time", json!(true)),
            ("rate", json!(1)),
            ("rate", json!(2.5)),
            ("arm.joints", json!(["x", "y"])),
            ("arm.gain", json!("inf")),
            ("qos_overrides./scan.publisher.depth", json!(3)),
        ];
        let expected = expected.map(|(name, value)| (name.to_owned(), value));
        assert_eq!(read(text, "/a/lidar").expect("a file"), expected);
        assert_eq!(read(text, "/b/lidar").expect("a file"), expected[..2]);
        assert_eq!(read("", "/a").expect("nothing"), []);
    }

    #[test]
    fn errors_of_a_parameter_file_have_positions() {
        for (text, place, message) in [
            (
                "a:\n  ros__parameters:\n    x: [[1]]\n",
                "FILE:3:5",
                "`x` cannot be a list",
            ),
            (
                "a:\n  ros__parameters:\n    x:\n",
                "FILE:3:5",
                "`x` cannot be nothing",
            ),
            (
                "a:\n  rate: 1\n",
                "FILE:2:3",
                "expected nodes below `/a/rate`, found a number",
            ),
            (
                "ros__parameters: {x: 1}\n",
                "FILE:1:1",
                "`ros__parameters` is below no node",
            ),
            (
                "a-b: {ros__parameters: {x: 1}}\n",
                "FILE:1:1",
                "`a-b` is not the name of a node",
            ),
            ("a: {ros__parameters: 3}\n", "FILE:1:5", "found a number"),
            ("a: [\n", "FILE:2:1", "this is not YAML"),
        ] {
            let error = read(text, "/a").expect_err(text);
            assert!(
                error.contains(place) && error.contains(message),
                "{text}: {error}"
            );
        }
    }

    #[test]
    fn parameters_on_the_command_line_are_yaml() {
        assert_eq!(scalar("1.5"), json!(1.5));
        assert_eq!(scalar("[a, b]"), json!(["a", "b"]));
        assert_eq!(scalar("/dev/tty"), json!("/dev/tty"));
        assert_eq!(scalar("'7'"), json!("7"));
        assert_eq!(scalar("a: b"), json!("a: b"));
        assert_eq!(scalar(""), json!(""));
        assert_eq!(scalar("[[["), json!("[[["));
    }
}
