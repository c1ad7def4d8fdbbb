//! What the configuration of a component and its network say of each middleware.

use std::collections::BTreeMap;

/// The settings of middlewares, by the middleware's name and a key; checked before a backend sees them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings(BTreeMap<String, BTreeMap<String, Vec<String>>>);

impl Settings {
    /// What `key` is set to, in its order; empty where it is not set. A number is decimal, a choice `true` or `false`, a
    /// time has its unit as in `500ms`; a key that takes one value has one.
    pub fn values(&self, middleware: &str, key: &str) -> &[String] {
        let keys = self.0.get(middleware);
        keys.and_then(|keys| keys.get(key))
            .map_or(&[], Vec::as_slice)
    }

    /// Takes over what `others` sets; where both do, that counts.
    pub fn extend(&mut self, others: &Self) {
        for (middleware, keys) in &others.0 {
            for (key, values) in keys {
                self.set(middleware, key, values.clone());
            }
        }
    }

    /// Sets a key; what it was set to before is forgotten.
    pub fn set(&mut self, middleware: &str, key: &str, values: Vec<String>) {
        let keys = self.0.entry(middleware.to_owned()).or_default();
        keys.insert(key.to_owned(), values);
    }
}
