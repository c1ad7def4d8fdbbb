//! Changes of a text, to undo and redo them.

use std::collections::VecDeque;

/// The most changes that can be undone.
pub(crate) const MOST_STEPS: usize = 1000;
/// The most bytes of their texts.
pub(crate) const MOST_BYTES: usize = 64 << 20;

/// A piece of a text that became another one.
#[derive(Debug)]
struct Step {
    start: usize,
    removed: String,
    inserted: String,
}

impl Step {
    /// The difference of two texts.
    fn between(old: &str, new: &str) -> Self {
        let pairs = old.bytes().zip(new.bytes());
        let start = pairs.take_while(|(a, b)| a == b).count();
        let start = old.floor_char_boundary(start);
        let (old, new) = (&old[start..], &new[start..]);
        let pairs = old.bytes().rev().zip(new.bytes().rev());
        let same = pairs.take_while(|(a, b)| a == b).count();
        let end = old.ceil_char_boundary(old.len() - same);
        let same = old.len() - end;
        Self {
            start,
            removed: old[..end].to_owned(),
            inserted: new[..new.len() - same].to_owned(),
        }
    }

    fn bytes(&self) -> usize {
        self.removed.len() + self.inserted.len()
    }
}

/// The changes of a text. If there are too many, the first ones cannot be undone any more.
#[derive(Debug, Default)]
pub(crate) struct History {
    done: VecDeque<Step>,
    undone: Vec<Step>,
}

impl History {
    /// Keeps a change. Undone changes before it cannot be redone any more.
    pub(crate) fn record(&mut self, old: &str, new: &str) {
        self.undone.clear();
        self.done.push_back(Step::between(old, new));
        let mut bytes: usize = self.done.iter().map(Step::bytes).sum();
        while self.done.len() > MOST_STEPS || bytes > MOST_BYTES {
            let Some(first) = self.done.pop_front() else {
                break;
            };
            bytes -= first.bytes();
        }
    }

    /// The text before the last change, if it is known.
    pub(crate) fn before(&self, text: &str) -> Option<String> {
        let step = self.done.back()?;
        replaced(text, step.start, &step.inserted, &step.removed)
    }

    /// The text after the change that was undone last.
    pub(crate) fn after(&self, text: &str) -> Option<String> {
        let step = self.undone.last()?;
        replaced(text, step.start, &step.removed, &step.inserted)
    }

    /// The text is [`History::before`] now.
    pub(crate) fn undo(&mut self) {
        self.undone.extend(self.done.pop_back());
    }

    /// The text is [`History::after`] now.
    pub(crate) fn redo(&mut self) {
        self.done.extend(self.undone.pop());
    }
}

fn replaced(text: &str, start: usize, old: &str, new: &str) -> Option<String> {
    let (before, rest) = text.split_at_checked(start)?;
    let after = rest.strip_prefix(old)?;
    Some([before, new, after].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_undone_and_redone() {
        let texts = [
            "", "aéb", "aèb", "aèèb", "aèb", "x", "xx", "xx\u{e9}", "xxé é",
        ];
        let mut history = History::default();
        for pair in texts.windows(2) {
            history.record(pair[0], pair[1]);
        }
        for pair in texts.windows(2).rev() {
            assert_eq!(history.before(pair[1]).as_deref(), Some(pair[0]));
            history.undo();
        }
        assert_eq!(history.before(""), None);
        for pair in texts.windows(2) {
            assert_eq!(history.after(pair[0]).as_deref(), Some(pair[1]));
            history.redo();
        }
        history.undo();
        history.record("xx\u{e9}", "new");
        assert_eq!(history.after("new"), None);
        assert_eq!(history.before("new").as_deref(), Some("xx\u{e9}"));
    }

    #[test]
    fn a_history_has_bounds() {
        let mut history = History::default();
        for number in 0..MOST_STEPS + 10 {
            history.record(&number.to_string(), &(number + 1).to_string());
        }
        let mut text = (MOST_STEPS + 10).to_string();
        while let Some(before) = history.before(&text) {
            text = before;
            history.undo();
        }
        assert_eq!(text, "10");
        // A change larger than the limit of all cannot be undone.
        history.record("", &"x".repeat(MOST_BYTES + 1));
        assert_eq!(history.done.len(), 0);
    }
}
