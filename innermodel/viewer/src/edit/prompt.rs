//! A text that the user of a window writes.

use crate::input::Key;

/// The question for the element to add.
pub(super) const CHOICE: &str =
    "add: b box, s sphere, c cylinder, k cone, t transform, m mesh; Escape: nothing";
/// The most characters of a text.
const LONGEST: usize = 1000;

/// The subject of the question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ask {
    /// The id of a node.
    Id,
    /// An attribute and its value.
    Attribute,
    /// The file of a mesh.
    Mesh,
}

/// A question, and the typed answer.
#[derive(Clone, Debug)]
pub(super) struct Prompt {
    pub(super) ask: Ask,
    pub(super) text: String,
}

/// Effect of a key on a text.
pub(super) enum Written {
    /// It goes on.
    More(Prompt),
    /// It is over.
    Done(Prompt),
    /// It is dropped.
    Cancelled,
}

impl Prompt {
    pub(super) fn new(ask: Ask) -> Self {
        Self {
            ask,
            text: String::new(),
        }
    }

    /// The line in the window. The end of a long text is visible.
    pub(super) fn line(&self, units: &str) -> String {
        const SEEN: usize = 50;
        let question = match self.ask {
            Ask::Id => "select",
            Ask::Attribute => &format!("attribute=value, lengths in {units}"),
            Ask::Mesh => "file of the mesh",
        };
        let count = self.text.chars().count();
        let end: String = self.text.chars().skip(count.saturating_sub(SEEN)).collect();
        format!("{question}: {end}_")
    }

    pub(super) fn key(mut self, key: Key) -> Written {
        match key {
            Key::Escape => return Written::Cancelled,
            Key::Return => return Written::Done(self),
            Key::Backspace => drop(self.text.pop()),
            Key::Character(c) if self.text.len() < LONGEST => self.text.push(c),
            _ => {}
        }
        Written::More(self)
    }
}
