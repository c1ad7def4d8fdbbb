//! The settings of middlewares, from configurations, networks and command lines.

use rc_vocabulary::{Value, qos};
use std::collections::BTreeMap;
use std::time::Duration;

/// The settings of middlewares, by the name of the middleware and the key.
///
/// Text is converted where it is read, by the table of `rc_vocabulary`, so a backend finds values
/// that are valid. If a key is not set, the methods give the default of that table.
///
/// ```
/// use rc_middleware::Settings;
/// use rc_vocabulary::Value;
///
/// let mut settings = Settings::default();
/// settings.set("dds", "domain", Value::Int(7));
/// assert_eq!(settings.int("dds", "domain"), Some(7));
/// assert_eq!(settings.bool("dds", "multicast"), Some(true));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings(BTreeMap<String, BTreeMap<String, Value>>);

impl Settings {
    /// The value of `key`, or its default. `None` if it has neither.
    pub fn value(&self, middleware: &str, key: &str) -> Option<&Value> {
        let value = self.0.get(middleware).and_then(|keys| keys.get(key));
        value.or_else(|| rc_vocabulary::key(middleware, key)?.default.as_ref())
    }

    /// The value of a key that takes `true` or `false`.
    pub fn bool(&self, middleware: &str, key: &str) -> Option<bool> {
        match self.value(middleware, key)? {
            Value::Bool(value) => Some(*value),
            _ => None,
        }
    }

    /// The value of a key that takes a whole number.
    pub fn int(&self, middleware: &str, key: &str) -> Option<i64> {
        match self.value(middleware, key)? {
            Value::Int(value) => Some(*value),
            _ => None,
        }
    }

    /// The value of a key that takes a duration.
    pub fn duration(&self, middleware: &str, key: &str) -> Option<Duration> {
        match self.value(middleware, key)? {
            Value::Duration(value) => Some(*value),
            _ => None,
        }
    }

    /// The value of a key that takes a word or a name.
    pub fn text(&self, middleware: &str, key: &str) -> Option<&str> {
        match self.value(middleware, key)? {
            Value::Text(value) => Some(value),
            _ => None,
        }
    }

    /// The elements of a list of names or addresses, in order.
    pub fn texts(&self, middleware: &str, key: &str) -> &[String] {
        match self.value(middleware, key) {
            Some(Value::Texts(values)) => values,
            _ => &[],
        }
    }

    /// The rules of a key that overrides the quality of service of topics, in order.
    pub fn qos(&self, middleware: &str, key: &str) -> &[qos::Rule] {
        match self.value(middleware, key) {
            Some(Value::Qos(rules)) => rules,
            _ => &[],
        }
    }

    /// Adds the settings of `others`, which replace those with the same keys.
    pub fn extend(&mut self, others: &Self) {
        for (middleware, keys) in &others.0 {
            for (key, value) in keys {
                self.set(middleware, key, value.clone());
            }
        }
    }

    /// Sets a key, in place of its earlier value.
    pub fn set(&mut self, middleware: &str, key: &str, value: Value) {
        let keys = self.0.entry(middleware.to_owned()).or_default();
        keys.insert(key.to_owned(), value);
    }
}
