//! Warnings of the simulator, each of which is logged once.

use innermodel_simulation::Error;
use rcis_generated::tracing::warn;
use std::collections::HashSet;

/// How many different warnings are logged.
const MOST: usize = 1000;

/// The warnings that were logged.
#[derive(Debug, Default)]
pub(crate) struct Warnings(HashSet<String>);

impl Warnings {
    /// Logs a warning, the first time it comes.
    pub(crate) fn log(&mut self, text: String) {
        if self.is_new(&text) {
            warn!("{text}");
        }
    }

    fn is_new(&mut self, text: &str) -> bool {
        self.0.len() < MOST && self.0.insert(text.to_owned())
    }

    /// A result for an interface that has no exception for it: the default, and a warning.
    pub(crate) fn or_default<T: Default>(&mut self, result: Result<T, Error>) -> T {
        result.unwrap_or_else(|error| {
            self.log(error.to_string());
            T::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_new_once_and_clients_cannot_fill_the_list() {
        let mut warnings = Warnings::default();
        assert!(warnings.is_new("a") && !warnings.is_new("a"));
        let all = (0..2 * MOST).map(|number| number.to_string());
        let new = all.filter(|text| warnings.is_new(text)).count();
        assert_eq!(new, MOST - 1);
        let number: i32 = warnings.or_default(Err(Error::TooManySteps(1)));
        assert_eq!(number, 0);
    }
}
