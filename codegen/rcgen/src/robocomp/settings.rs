//! A configuration of a component of RoboComp: TOML, or lines `Name.key = value`.

use rc_diagnostics::foreign::clean;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, Item, TableLike};

/// A value of a configuration.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
    Array(Vec<Self>),
}

/// A line of a configuration.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) path: Vec<String>,
    pub(super) value: Value,
    /// The comment above it and behind it.
    pub(super) doc: Vec<String>,
}

/// Where an endpoint of Ice listens: `laser:tcp -h localhost -p 10003`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Address {
    pub(super) host: String,
    pub(super) port: u16,
}

/// Contents of a configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Settings {
    /// The file.
    pub(super) file: PathBuf,
    /// Where required interfaces are served.
    pub(super) proxies: Vec<(String, Address)>,
    /// Where implemented interfaces listen.
    pub(super) endpoints: Vec<(String, u16)>,
    /// The prefixes of topics, without empty ones.
    pub(super) prefixes: Vec<(String, String)>,
    /// The period of `compute()` in milliseconds.
    pub(super) period: Option<f64>,
    /// Values that the component itself reads.
    pub(super) parameters: Vec<Entry>,
    /// Settings without a counterpart, in sentences.
    pub(super) left: Vec<String>,
}

impl Address {
    /// Reads `NAME:tcp -h HOST -p PORT`. Without a host, it is this machine.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut words = text.split_whitespace();
        let (mut host, mut port) = ("localhost", None);
        while let Some(word) = words.next() {
            match word {
                "-h" => host = words.next()?,
                "-p" => port = words.next()?.parse().ok(),
                _ => {}
            }
        }
        Some(Self {
            host: host.to_owned(),
            port: port?,
        })
    }

    /// Whether the host is the machine that reads it.
    pub(super) fn is_here(&self) -> bool {
        matches!(self.host.as_str(), "localhost" | "::1") || self.host.starts_with("127.")
    }
}

impl Settings {
    /// Reads a text. A file that is not TOML has lines.
    pub(super) fn parse(file: &Path, text: &str) -> Self {
        let mut settings = Self {
            file: file.to_owned(),
            ..Self::default()
        };
        let mut entries = Vec::new();
        match text.parse::<DocumentMut>() {
            Ok(document) => of_table(
                document.as_table(),
                &mut Vec::new(),
                &mut entries,
                &mut settings.left,
            ),
            Err(error) => {
                if file.extension().is_some_and(|ending| ending == "toml") {
                    let error = error.to_string();
                    let error = error.lines().next().unwrap_or_default();
                    let text = format!(
                        "{} is read line by line, because it is not TOML: {error}",
                        name(file)
                    );
                    settings.left.push(clean(&text));
                }
                entries = lines(text);
            }
        }
        entries.into_iter().for_each(|entry| settings.take(entry));
        settings
    }

    fn take(&mut self, entry: Entry) {
        let path: Vec<&str> = entry.path.iter().map(String::as_str).collect();
        let text = match &entry.value {
            Value::Text(text) => text.as_str(),
            _ => "",
        };
        match path[..] {
            ["Ice" | "IceBox" | "IceStorm" | "TopicManager", ..]
            | ["Proxies", "TopicManager"]
            | ["CommonBehavior" | "CommonBehaviorComponent", "Endpoints"] => {}
            ["Period", "Compute"] => {
                let ms = match &entry.value {
                    Value::Int(ms) => i32::try_from(*ms).ok().map(f64::from),
                    Value::Float(ms) => Some(*ms),
                    Value::Text(ms) => ms.parse().ok(),
                    _ => None,
                };
                self.period = ms.filter(|ms| ms.is_finite() && *ms > 0.0);
                if self.period.is_none() {
                    self.leave(&entry, "it is no period in milliseconds");
                }
            }
            ["Period", ..] => self.leave(&entry, "`emergency` runs with the period of `compute`"),
            ["Agent" | "ViewAgent", ..] => {
                self.leave(
                    &entry,
                    "it belongs to DSR, whose place the world of a network takes (docs/world.md)",
                );
            }
            ["Component", "Debug", ..] => self.leave(&entry, "`--log debug` shows more"),
            ["Proxies" | "Endpoints", name] if name.ends_with("Prefix") => {
                let topic = name.trim_end_matches("Prefix");
                if !text.is_empty() {
                    self.prefixes.push((topic.to_owned(), text.to_owned()));
                }
            }
            ["Endpoints", name] | [name, "Endpoints"] => {
                // A subscriber listens anywhere.
                let address = Address::parse(text).filter(|_| !name.ends_with("Topic"));
                self.endpoints
                    .extend(address.map(|address| (name.to_owned(), address.port)));
            }
            ["Proxies", name] => self.take_proxy(name, text, &entry),
            [name] if name.len() > 5 && name.ends_with("Proxy") && text.contains(':') => {
                self.take_proxy(&name[..name.len() - 5], text, &entry);
            }
            _ => self.parameters.push(entry),
        }
    }

    fn take_proxy(&mut self, name: &str, text: &str, entry: &Entry) {
        match Address::parse(text) {
            Some(address) => self.proxies.push((name.to_owned(), address)),
            None => self.leave(entry, "it names no port"),
        }
    }

    fn leave(&mut self, entry: &Entry, why: &str) {
        let path = entry.path.join(".");
        self.left
            .push(clean(&format!("`{path}` is left out: {why}")));
    }
}

/// The name of a file, for messages.
pub(super) fn name(file: &Path) -> String {
    clean(&file.file_name().unwrap_or_default().to_string_lossy())
}

fn of_table(
    table: &dyn TableLike,
    path: &mut Vec<String>,
    entries: &mut Vec<Entry>,
    left: &mut Vec<String>,
) {
    for (name, item) in table.iter() {
        path.push(name.to_owned());
        if let Some(inner) = item.as_table_like() {
            of_table(inner, path, entries, left);
        } else if let Some(value) = item.as_value().and_then(value) {
            let key = table.get_key_value(name).map(|(key, _)| key);
            let above = key.and_then(|key| key.leaf_decor().prefix()?.as_str());
            let behind = item
                .as_value()
                .and_then(|value| value.decor().suffix()?.as_str());
            let mut doc = comment_above(above.unwrap_or_default());
            doc.extend(comment(behind.unwrap_or_default()));
            let path = path.clone();
            entries.push(Entry { path, value, doc });
        } else {
            let what = if matches!(item, Item::ArrayOfTables(_)) {
                "it is a list of tables; declare a `list` in the .pdsl"
            } else {
                "a parameter has no value of this kind"
            };
            left.push(clean(&format!("`{}` is left out: {what}", path.join("."))));
        }
        path.pop();
    }
}

fn value(value: &toml_edit::Value) -> Option<Value> {
    Some(match value {
        toml_edit::Value::String(text) => Value::Text(text.value().clone()),
        toml_edit::Value::Integer(value) => Value::Int(*value.value()),
        toml_edit::Value::Float(value) => Value::Float(*value.value()),
        toml_edit::Value::Boolean(value) => Value::Bool(*value.value()),
        toml_edit::Value::Datetime(date) => Value::Text(date.value().to_string()),
        toml_edit::Value::Array(values) => {
            let values = values.iter().map(|one| match self::value(one) {
                Some(Value::Array(_)) | None => None,
                value => value,
            });
            Value::Array(values.collect::<Option<_>>()?)
        }
        toml_edit::Value::InlineTable(_) => return None,
    })
}

/// The lines of a file that is not TOML. `[Name]` precedes the keys that follow.
fn lines(text: &str) -> Vec<Entry> {
    let (mut section, mut entries) = (Vec::new(), Vec::new());
    let mut above = String::new();
    for line in text.lines() {
        let trimmed = line.trim();
        if let Some(name) = trimmed
            .strip_prefix('[')
            .and_then(|name| name.strip_suffix(']'))
        {
            section = words(name);
            above.clear();
            continue;
        }
        let pair = trimmed
            .split_once('=')
            .filter(|_| !trimmed.starts_with('#'));
        let Some((key, word)) = pair else {
            above.push_str(line);
            above.push('\n');
            continue;
        };
        let (word, behind) = split_comment(word.trim());
        let mut doc = comment_above(&above);
        above.clear();
        doc.extend(comment(behind));
        let path = section.iter().cloned().chain(words(key)).collect();
        let value = word_value(word);
        entries.push(Entry { path, value, doc });
    }
    entries.retain(|entry| !entry.path.is_empty());
    entries
}

fn words(key: &str) -> Vec<String> {
    let parts = key
        .split('.')
        .map(|part| part.trim().trim_matches('"').to_owned());
    parts.filter(|part| !part.is_empty()).collect()
}

/// A value and the comment behind it.
fn split_comment(text: &str) -> (&str, &str) {
    let quoted = text.strip_prefix('"').and_then(|rest| rest.find('"'));
    let from = quoted.map_or(0, |end| end + 2);
    match text[from..].find('#') {
        Some(at) => (text[..from + at].trim(), &text[from + at..]),
        None => (text, ""),
    }
}

fn word_value(word: &str) -> Value {
    if let Some(text) = word
        .strip_prefix('"')
        .and_then(|text| text.strip_suffix('"'))
    {
        return Value::Text(text.to_owned());
    }
    match word.to_ascii_lowercase().as_str() {
        "true" => return Value::Bool(true),
        "false" => return Value::Bool(false),
        _ => {}
    }
    // Words such as `inf` and `nan` are texts.
    let is_number = word.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.'));
    if let Some(value) = word.parse().ok().filter(|_| is_number) {
        return Value::Int(value);
    }
    match word.parse::<f64>() {
        Ok(value) if is_number && value.is_finite() => Value::Float(value),
        _ => Value::Text(word.to_owned()),
    }
}

/// The comment directly above an entry.
fn comment_above(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let begin = lines.iter().rposition(|line| line.is_empty());
    let last = &lines[begin.map_or(0, |at| at + 1)..];
    last.iter().flat_map(|line| comment(line)).collect()
}

/// The text of comments. Lines without a letter, such as rules, are left out.
fn comment(text: &str) -> Vec<String> {
    let lines = text.lines().filter_map(|line| {
        let line = clean(
            line.trim()
                .strip_prefix('#')?
                .trim_matches(['#', ' ', '\t']),
        );
        line.chars().any(char::is_alphanumeric).then_some(line)
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(path: &[&str], value: Value, doc: &[&str]) -> Entry {
        let texts = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        Entry {
            path: texts(path),
            value,
            doc: texts(doc),
        }
    }

    fn address(host: &str, port: u16) -> Address {
        let host = host.to_owned();
        Address { host, port }
    }

    #[test]
    fn toml_and_lines_say_the_same() {
        let toml = "# Where IceStorm is.\n[Proxies]\nTopicManager = \"IceStorm/TopicManager:default -p 9999\"\n\
             LaserPubPrefix = \"front\"\nGrip = \"grip:tcp -h 10.0.0.7 -p 10009\"\n\n\
             [Endpoints]\nLaser = \"tcp -p 10003\"\nJoyTopic = \"tcp -p 0\"\nJoyPrefix = \"\"\n\n\
             [Period]\nCompute = 20\nEmergency = 500\n\n[Config]\n# ── Speed ──\n\n# How fast.\nSpeed = 0.5 # m/s\nOn = true\n\
             [Ice]\nWarn.Connections = \"0\"\n";
        let lines = "Proxies.TopicManager = \"IceStorm/TopicManager:default -p 9999\"\n\
             Proxies.LaserPubPrefix = \"front\"\nGripProxy = grip:tcp -h 10.0.0.7 -p 10009\nLaser.Endpoints=tcp -p 10003\n\
             JoyTopic.Endpoints=tcp -p 0\nPeriod.Compute=20\nPeriod.Emergency = 500\n\n# How fast.\nConfig.Speed = 0.5# m/s\n\
             Config.On = True\nIce.Warn.Connections=0\n";
        let toml = Settings::parse(Path::new("config"), toml);
        assert_eq!(toml, Settings::parse(Path::new("config"), lines));
        assert_eq!(
            toml.proxies,
            [("Grip".to_owned(), address("10.0.0.7", 10009))]
        );
        assert_eq!(toml.endpoints, [("Laser".to_owned(), 10003)]);
        assert_eq!(toml.prefixes, [("LaserPub".to_owned(), "front".to_owned())]);
        assert_eq!(toml.period, Some(20.0));
        let speed = entry(
            &["Config", "Speed"],
            Value::Float(0.5),
            &["How fast.", "m/s"],
        );
        assert_eq!(
            toml.parameters,
            [speed, entry(&["Config", "On"], Value::Bool(true), &[])]
        );
        assert_eq!(toml.left.len(), 1, "{:?}", toml.left);
    }

    #[test]
    fn odd_files_are_read_as_far_as_they_go() {
        let text = "[Proxies]\nA = \"a:tcp\"\n= 3\n[[x]]\ny\nPort = 12 # \"#\nName = \"a # b\" # c\ninf = inf\n";
        let read = Settings::parse(Path::new("c.toml"), text);
        assert!(
            read.left[0].contains("read line by line"),
            "{:?}",
            read.left
        );
        assert!(
            read.proxies.is_empty() && read.left.iter().any(|line| line.contains("names no port"))
        );
        let toml = "a = [[1], [2]]\nb = 1979-05-27\nc = {d = 1}\n[[list]]\nx = 1\n";
        let read = Settings::parse(Path::new("c.toml"), toml);
        assert_eq!(read.left.len(), 2, "{:?}", read.left);
        assert_eq!(read.parameters.len(), 2);
        assert_eq!(Address::parse("laser:tcp -h"), None);
        assert_eq!(Address::parse("tcp -p 70000"), None);
    }
}
