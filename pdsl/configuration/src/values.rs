//! The values of one configuration, for generated code and for the management socket.

use crate::model::{Kind, Parameter, Type, Value};
use serde_json::{Map, Value as Json};
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The replacement for secret values.
pub(crate) const SECRET: &str = "***";

/// The value of a name.
#[derive(Clone, PartialEq)]
pub(crate) enum Entry {
    /// A value, and whether it is secret.
    Value(Value, bool),
    /// A group.
    Group(Values),
    /// A list of structures.
    List(Vec<Values>),
}

/// The values of parameters in the order of their declarations.
///
/// The accessors are for code that was generated from the same model. A missing name or another
/// type gives zero, `false`, or something empty. `Debug` does not show secret values.
#[derive(Clone, Default, PartialEq)]
pub struct Values {
    entries: Vec<(String, Entry)>,
}

/// Value or table that the name of a parameter denotes.
#[derive(Clone, Copy, Debug)]
pub enum Field<'a> {
    /// A scalar or an array.
    Value(&'a Value),
    /// A group.
    Group(&'a Values),
    /// The structures of a list.
    List(&'a [Values]),
}

/// Where relative paths of parameters start.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PathFolders {
    /// Those of a configuration.
    pub configuration: PathBuf,
    /// The defaults of the `.pdsl`: the folder of the component.
    pub defaults: PathBuf,
}

impl PathFolders {
    /// The folder of this value of a parameter. A value that is also the default counts as one.
    pub fn of(&self, parameter: &Parameter, value: &Value) -> &Path {
        if parameter.default.as_ref() == Some(value) {
            &self.defaults
        } else {
            &self.configuration
        }
    }
}

/// The folder where relative paths of the configuration `file` start: its own folder. Those of a
/// file in a folder `etc` start at the folder that holds `etc`, which is that of the component.
pub fn folder_of_paths(file: &Path) -> &Path {
    let own = file.parent().unwrap_or(Path::new(""));
    match own.parent() {
        Some(component) if own.ends_with("etc") => component,
        _ => own,
    }
}

/// `path` from `folder` on, if it is relative. An empty path stays empty: it names nothing.
pub(crate) fn path_from(folder: &Path, path: &str) -> String {
    if path.is_empty() {
        return String::new();
    }
    folder.join(path).to_string_lossy().into_owned()
}

fn paths_from(folder: &Path, value: &Value) -> Value {
    match value {
        Value::Text(path) => Value::Text(path_from(folder, path)),
        Value::Array(values) => {
            let values = values.iter().map(|value| paths_from(folder, value));
            Value::Array(values.collect())
        }
        _ => value.clone(),
    }
}

static EMPTY: Values = Values {
    entries: Vec::new(),
};

impl Values {
    /// Adds a group. Of two entries with one name, the first one counts.
    #[must_use]
    pub fn with_group(mut self, name: &str, values: Self) -> Self {
        self.push(name.to_owned(), Entry::Group(values));
        self
    }

    /// Adds a value that is not a secret. Of two entries with one name, the first one counts.
    #[must_use]
    pub fn with_value(mut self, name: &str, value: Value) -> Self {
        self.push(name.to_owned(), Entry::Value(value, false));
        self
    }

    pub(crate) fn push(&mut self, name: String, entry: Entry) {
        self.entries.push((name, entry));
    }

    pub(crate) fn entries(&self) -> &[(String, Entry)] {
        &self.entries
    }

    /// All names with their values, for code that reads the model at run time.
    pub fn fields(&self) -> impl Iterator<Item = (&str, Field<'_>)> {
        self.entries.iter().map(|(name, entry)| {
            let field = match entry {
                Entry::Value(value, _) => Field::Value(value),
                Entry::Group(values) => Field::Group(values),
                Entry::List(list) => Field::List(list),
            };
            (name.as_str(), field)
        })
    }

    pub(crate) fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, entry)| entry)
    }

    /// The value of a scalar or an array.
    pub fn value(&self, name: &str) -> Option<&Value> {
        match self.entry(name) {
            Some(Entry::Value(value, _)) => Some(value),
            _ => None,
        }
    }

    fn elements(&self, name: &str) -> &[Value] {
        match self.value(name) {
            Some(Value::Array(values)) => values,
            _ => &[],
        }
    }

    /// The values of `parameters` for a worker, with absolute paths.
    #[must_use]
    pub fn with_paths_from(&self, folders: &PathFolders, parameters: &[Parameter]) -> Self {
        let entries = self.entries.iter().map(|(name, entry)| {
            let parameter = parameters.iter().find(|one| one.name == *name);
            let kind = parameter.map(|parameter| (parameter, &parameter.kind));
            let entry = match (entry, kind) {
                (Entry::Value(value, secret), Some((one, Kind::Scalar { ty: Type::Path, .. }))) => {
                    Entry::Value(paths_from(folders.of(one, value), value), *secret)
                }
                (Entry::Group(values), Some((_, Kind::Group(members)))) => {
                    Entry::Group(values.with_paths_from(folders, members))
                }
                (Entry::List(list), Some((_, Kind::List { parameters, .. }))) => {
                    let list = list.iter();
                    let list = list.map(|values| values.with_paths_from(folders, parameters));
                    Entry::List(list.collect())
                }
                _ => entry.clone(),
            };
            (name.clone(), entry)
        });
        Self {
            entries: entries.collect(),
        }
    }

    /// A `bool`.
    pub fn bool(&self, name: &str) -> bool {
        self.value(name)
            .and_then(Value::as_bool)
            .unwrap_or_default()
    }

    /// An `int` or a `long`.
    pub fn int(&self, name: &str) -> i64 {
        self.value(name).and_then(Value::as_int).unwrap_or_default()
    }

    /// A `float` or a `double`.
    pub fn float(&self, name: &str) -> f64 {
        self.value(name)
            .and_then(Value::as_float)
            .unwrap_or_default()
    }

    /// A `string`.
    pub fn text(&self, name: &str) -> String {
        let text = self.value(name).and_then(Value::as_text);
        text.unwrap_or_default().to_owned()
    }

    /// A `duration`.
    pub fn duration(&self, name: &str) -> Duration {
        self.value(name)
            .and_then(Value::as_duration)
            .unwrap_or_default()
    }

    /// A `path`.
    pub fn path(&self, name: &str) -> PathBuf {
        PathBuf::from(self.text(name))
    }

    /// An array of `bool`.
    pub fn bools(&self, name: &str) -> Vec<bool> {
        self.elements(name)
            .iter()
            .filter_map(Value::as_bool)
            .collect()
    }

    /// An array of `int` or `long`.
    pub fn ints(&self, name: &str) -> Vec<i64> {
        self.elements(name)
            .iter()
            .filter_map(Value::as_int)
            .collect()
    }

    /// An array of `float` or `double`.
    pub fn floats(&self, name: &str) -> Vec<f64> {
        self.elements(name)
            .iter()
            .filter_map(Value::as_float)
            .collect()
    }

    /// An array of `string`.
    pub fn texts(&self, name: &str) -> Vec<String> {
        let texts = self.elements(name).iter().filter_map(Value::as_text);
        texts.map(str::to_owned).collect()
    }

    /// An array of `duration`.
    pub fn durations(&self, name: &str) -> Vec<Duration> {
        self.elements(name)
            .iter()
            .filter_map(Value::as_duration)
            .collect()
    }

    /// An array of `path`.
    pub fn paths(&self, name: &str) -> Vec<PathBuf> {
        let texts = self.elements(name).iter().filter_map(Value::as_text);
        texts.map(PathBuf::from).collect()
    }

    /// A group.
    pub fn group(&self, name: &str) -> &Values {
        match self.entry(name) {
            Some(Entry::Group(values)) => values,
            _ => &EMPTY,
        }
    }

    /// The structures of a list.
    pub fn list(&self, name: &str) -> &[Values] {
        match self.entry(name) {
            Some(Entry::List(values)) => values,
            _ => &[],
        }
    }

    /// Converts all values into a JSON object. Durations are strings such as `50ms`; secret
    /// values are `***`.
    pub fn to_json(&self) -> Json {
        let mut object = Map::new();
        for (name, entry) in &self.entries {
            let value = match entry {
                Entry::Value(_, true) => Json::from(SECRET),
                Entry::Value(value, false) => value.to_json(),
                Entry::Group(values) => values.to_json(),
                Entry::List(list) => list.iter().map(Values::to_json).collect(),
            };
            object.insert(name.clone(), value);
        }
        Json::Object(object)
    }
}

impl fmt::Debug for Values {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.to_json())
    }
}
