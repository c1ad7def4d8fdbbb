//! The address at which slots of components are connected: a path of names.

use std::fmt;

/// A path of names, as in `default/Laser` or `patrol/simulator/Laser`. A topic adds its operation.
///
/// The pages of the backends in `docs` say how an address becomes names of its middleware.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Address(String);

impl Address {
    /// Reads an address; the error says why `text` is none.
    ///
    /// ```
    /// use rc_middleware::Address;
    ///
    /// let laser = Address::parse("patrol/simulator/Laser").expect("an address");
    /// assert_eq!(laser.join("scan").as_str(), "patrol/simulator/Laser/scan");
    /// assert!(Address::parse("/Laser").is_err());
    /// ```
    pub fn parse(text: &str) -> Result<Self, String> {
        rc_vocabulary::address::check(text)?;
        Ok(Self(text.to_owned()))
    }

    /// This address with one more name.
    #[must_use]
    pub fn join(&self, name: &str) -> Self {
        Self(format!("{}/{name}", self.0))
    }

    /// The path.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::Address;

    #[test]
    fn an_address_is_a_path_of_names() {
        assert!(Address::parse("patrol/simulator/Laser").is_ok());
        for wrong in ["", "/a", "a//b", "a b", "ä"] {
            assert!(Address::parse(wrong).is_err(), "{wrong}");
        }
    }
}
