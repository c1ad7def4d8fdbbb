//! Problems of a world, until its owner reads them.

/// The most problems that wait.
const MOST: usize = 100;

/// Problems that wait to be read. Each one waits once.
#[derive(Debug, Default)]
pub(crate) struct Problems(Vec<String>);

impl Problems {
    /// Adds a problem, if it is not in the list and there is room.
    pub(crate) fn add(&mut self, problem: String) {
        if self.0.len() < MOST && !self.0.contains(&problem) {
            self.0.push(problem);
        }
    }

    /// Takes those that wait.
    pub(crate) fn take(&mut self) -> Vec<String> {
        std::mem::take(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_waits_once_and_few_wait() {
        let mut problems = Problems::default();
        problems.add("a".to_owned());
        problems.add("a".to_owned());
        assert_eq!(problems.take(), ["a"]);
        problems.add("a".to_owned());
        (0..2 * MOST).for_each(|number| problems.add(number.to_string()));
        let waiting = problems.take();
        assert_eq!((waiting.len(), &*waiting[0]), (MOST, "a"));
        assert!(problems.take().is_empty());
    }
}
