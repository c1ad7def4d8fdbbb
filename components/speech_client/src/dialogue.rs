//! Next turn of a one-sided conversation.

/// The next thing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Next {
    /// Tell the voice how it is to announce its words.
    Synchronize,
    /// Say the sentence with this index.
    Say(usize),
    /// Ask whether the voice is still busy.
    Listen,
    /// Everything has been said.
    End,
}

/// The state of the conversation.
///
/// Each `…ed` method is called after the request of [`Dialogue::next`] has succeeded; until then it
/// repeats the request.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dialogue {
    sentences: usize,
    repeat: bool,
    synchronized: bool,
    listening: bool,
    said: usize,
}

impl Dialogue {
    /// A dialogue of `sentences`, once or repeated.
    pub(crate) fn new(sentences: usize, repeat: bool) -> Self {
        Self {
            sentences,
            repeat,
            synchronized: false,
            listening: false,
            said: 0,
        }
    }

    /// The next action.
    pub(crate) fn next(&self) -> Next {
        if !self.synchronized {
            Next::Synchronize
        } else if self.listening {
            Next::Listen
        } else if self.said < self.sentences {
            Next::Say(self.said)
        } else {
            Next::End
        }
    }

    /// The voice knows how to announce its words.
    pub(crate) fn synchronized(&mut self) {
        self.synchronized = true;
    }

    /// The voice has accepted a sentence.
    pub(crate) fn accepted(&mut self) {
        self.said += 1;
        self.listening = true;
    }

    /// The voice is quiet again.
    pub(crate) fn finished(&mut self) {
        self.listening = false;
        if self.repeat && self.said == self.sentences {
            self.said = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sentence(dialogue: &mut Dialogue) {
        dialogue.accepted();
        assert_eq!(dialogue.next(), Next::Listen);
        dialogue.finished();
    }

    #[test]
    fn every_sentence_is_said_once_and_listened_to() {
        let mut dialogue = Dialogue::new(2, false);
        assert_eq!(dialogue.next(), Next::Synchronize);
        dialogue.synchronized();
        assert_eq!(dialogue.next(), Next::Say(0));
        // The voice refused, or does not exist: try again.
        assert_eq!(dialogue.next(), Next::Say(0));
        sentence(&mut dialogue);
        assert_eq!(dialogue.next(), Next::Say(1));
        sentence(&mut dialogue);
        assert_eq!(dialogue.next(), Next::End);
    }

    #[test]
    fn a_repeated_conversation_begins_again() {
        let mut dialogue = Dialogue::new(1, true);
        dialogue.synchronized();
        sentence(&mut dialogue);
        assert_eq!(dialogue.next(), Next::Say(0));
    }
}
