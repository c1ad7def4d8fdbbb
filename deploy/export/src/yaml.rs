//! Prints the YAML that manifests need: ordered maps, lists, plain values, and comments.

/// A value. Texts are always quoted, so that YAML reads them as texts.
#[derive(Clone, Debug)]
pub(crate) enum Yaml {
    Text(String),
    Number(u64),
    Bool(bool),
    List(Vec<Yaml>),
    Map(Map),
}

/// Ordered entries, each with a comment above it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Map(Vec<(String, String, Yaml)>);

impl Map {
    pub(crate) fn with(self, key: &str, value: impl Into<Yaml>) -> Self {
        self.commented("", key, value)
    }

    /// An entry with a comment.
    pub(crate) fn commented(mut self, comment: &str, key: &str, value: impl Into<Yaml>) -> Self {
        self.0
            .push((comment.to_owned(), key.to_owned(), value.into()));
        self
    }
}

impl From<&str> for Yaml {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Yaml {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u64> for Yaml {
    fn from(number: u64) -> Self {
        Self::Number(number)
    }
}

impl From<bool> for Yaml {
    fn from(is: bool) -> Self {
        Self::Bool(is)
    }
}

impl From<Map> for Yaml {
    fn from(map: Map) -> Self {
        Self::Map(map)
    }
}

impl<T: Into<Yaml>> From<Vec<T>> for Yaml {
    fn from(all: Vec<T>) -> Self {
        Self::List(all.into_iter().map(Into::into).collect())
    }
}

/// Lines of comment.
pub(crate) fn comment(text: &str, indent: usize) -> String {
    let lines = text.lines();
    lines
        .map(|line| format!("{:indent$}# {line}\n", ""))
        .collect()
}

/// A document without its `---`.
pub(crate) fn print(map: &Map) -> String {
    let mut out = String::new();
    print_map(map, 0, &mut out);
    out
}

fn print_map(map: &Map, indent: usize, out: &mut String) {
    for (note, key, value) in &map.0 {
        out.push_str(&comment(note, indent));
        out.push_str(&format!("{:indent$}{}:", "", plain_key(key)));
        print_value(value, indent + 2, out);
    }
}

/// A value after its key or dash.
fn print_value(value: &Yaml, indent: usize, out: &mut String) {
    match value {
        Yaml::Map(map) if !map.0.is_empty() => {
            out.push('\n');
            print_map(map, indent, out);
        }
        Yaml::List(all) if all.iter().any(|one| matches!(one, Yaml::Map(_))) => {
            out.push('\n');
            for one in all {
                // The first key follows the dash.
                let mut text = String::new();
                match one {
                    Yaml::Map(map) => print_map(map, indent + 2, &mut text),
                    other @ (Yaml::Text(_) | Yaml::Number(_) | Yaml::Bool(_) | Yaml::List(_)) => {
                        text = format!("{:1$}{2}\n", "", indent + 2, scalar(other));
                    }
                }
                text.replace_range(indent..=indent, "-");
                out.push_str(&text);
            }
        }
        other
        @ (Yaml::Text(_) | Yaml::Number(_) | Yaml::Bool(_) | Yaml::List(_) | Yaml::Map(_)) => {
            out.push_str(&format!(" {}\n", scalar(other)));
        }
    }
}

fn scalar(value: &Yaml) -> String {
    match value {
        // A JSON string is valid YAML.
        Yaml::Text(text) => serde_json::Value::from(text.as_str()).to_string(),
        Yaml::Number(number) => number.to_string(),
        Yaml::Bool(is) => is.to_string(),
        Yaml::List(all) => format!(
            "[{}]",
            all.iter().map(scalar).collect::<Vec<_>>().join(", ")
        ),
        Yaml::Map(_) => "{}".to_owned(),
    }
}

fn plain_key(key: &str) -> String {
    let fine = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '/');
    let word = key.chars().all(fine) && key.starts_with(|c: char| c.is_ascii_alphabetic());
    // Words that YAML reads as something else.
    let other = ["y", "n", "yes", "no", "on", "off", "true", "false", "null"];
    if word && !other.contains(&key.to_lowercase().as_str()) {
        key.to_owned()
    } else {
        scalar(&key.into())
    }
}
