//! The keys of a middleware, found by words of users.

use crate::key::Key;
use crate::middleware::Middleware;
use rc_diagnostics::nearest;

/// The keys of the middleware with this word. `None` for an unknown middleware.
pub fn keys(middleware: &str) -> Option<&'static [Key]> {
    Middleware::from_word(middleware).map(|middleware| middleware.can().keys)
}

/// The key `name` of a middleware.
pub fn key(middleware: &str, name: &str) -> Option<&'static Key> {
    Middleware::from_word(middleware)?.key(name)
}

/// The help for a key that `middleware` does not have: the nearest name, or all names.
pub fn unknown_key_help(middleware: &str, name: &str) -> String {
    let names = keys(middleware).unwrap_or_default().iter().map(|k| k.name);
    if let Some(near) = nearest(name, names.clone()) {
        return format!("did you mean `{near}`?");
    }
    let names: Vec<&str> = names.collect();
    if names.is_empty() {
        format!("there are no settings of {middleware} yet")
    } else {
        format!("there are {}", names.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_values() {
        for key in Middleware::ALL.iter().flat_map(|one| one.can().keys) {
            let Some(default) = &key.default else {
                continue;
            };
            let parsed = key.kind.parse(&default.to_string());
            assert_eq!(parsed.as_ref(), Ok(default), "{}", key.name);
        }
    }

    #[test]
    fn an_unknown_key_gets_help() {
        assert_eq!(unknown_key_help("dds", "domian"), "did you mean `domain`?");
        assert!(unknown_key_help("iceoryx2", "domain").contains("no settings"));
    }
}
