//! Parses the bytes of a terminal into keys.
//!
//! The reader of crossterm blocks for the rest of a sequence, and loses keys at a change of size.
//! This one takes the bytes that exist.

/// A key that the view uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    Char(char),
    /// A letter with the control key.
    Control(char),
    Enter,
    Esc,
    Tab,
    BackTab,
    Backspace,
    Up,
    Down,
    Left,
    Right,
    Home,
    End,
    PageUp,
    PageDown,
}

/// Collects bytes until a key is complete.
#[derive(Debug, Default)]
pub(crate) struct Keys(Vec<u8>);

/// The longest sequence. A longer one is not a key.
const LONGEST: usize = 32;
const ESC: u8 = 0x1b;

/// The key at the beginning of some bytes.
enum KeyPrefix {
    /// A sequence of this length, which need not be a key of the view.
    Key(usize, Option<Key>),
    /// More bytes are needed.
    Half,
}

impl Keys {
    /// Returns the keys that these bytes complete.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Vec<Key> {
        self.0.extend_from_slice(bytes);
        let mut keys = Vec::new();
        let mut at = 0;
        while at < self.0.len() {
            match begin(&self.0[at..]) {
                KeyPrefix::Key(length, key) => {
                    keys.extend(key);
                    at += length;
                }
                KeyPrefix::Half if self.0.len() - at > LONGEST => at = self.0.len(),
                KeyPrefix::Half => break,
            }
        }
        self.0.drain(..at);
        keys
    }

    /// Whether an incomplete key waits.
    pub(crate) fn is_half(&self) -> bool {
        !self.0.is_empty()
    }

    /// Takes an incomplete sequence as it is, because nothing has followed for a while.
    pub(crate) fn finish(&mut self) -> Option<Key> {
        let escaped = self.0 == [ESC];
        self.0.clear();
        escaped.then_some(Key::Esc)
    }
}

fn begin(bytes: &[u8]) -> KeyPrefix {
    match bytes {
        [ESC] | [ESC, b'[' | b'O'] => KeyPrefix::Half,
        [ESC, b'[', b'[', rest @ ..] => match rest {
            // A function key of the console of Linux.
            [_, ..] => KeyPrefix::Key(4, None),
            [] => KeyPrefix::Half,
        },
        [ESC, b'[', rest @ ..] => match rest.iter().position(|byte| !(0x20..0x40).contains(byte)) {
            Some(end) => KeyPrefix::Key(end + 3, sequence(&rest[..end], rest[end])),
            None => KeyPrefix::Half,
        },
        [ESC, b'O', b'M', ..] => KeyPrefix::Key(3, Some(Key::Enter)),
        [ESC, b'O', last, ..] => KeyPrefix::Key(3, sequence(&[], *last)),
        [ESC, ESC, ..] => KeyPrefix::Key(1, Some(Key::Esc)),
        // With the alt key.
        [ESC, rest @ ..] => match begin(rest) {
            KeyPrefix::Key(length, _) => KeyPrefix::Key(length + 1, None),
            KeyPrefix::Half => KeyPrefix::Half,
        },
        [b'\r' | b'\n', ..] => KeyPrefix::Key(1, Some(Key::Enter)),
        [b'\t', ..] => KeyPrefix::Key(1, Some(Key::Tab)),
        [0x08 | 0x7f, ..] => KeyPrefix::Key(1, Some(Key::Backspace)),
        [byte @ 1..=26, ..] => KeyPrefix::Key(1, Some(Key::Control(char::from(byte + b'a' - 1)))),
        [0..0x20, ..] => KeyPrefix::Key(1, None),
        _ => letter(bytes),
    }
}

/// A sequence `ESC [ PARAMETERS LAST`, whatever other keys are held.
fn sequence(parameters: &[u8], last: u8) -> Option<Key> {
    let first = parameters.split(|byte| *byte == b';').next();
    Some(match (last, first) {
        (b'A', _) => Key::Up,
        (b'B', _) => Key::Down,
        (b'C', _) => Key::Right,
        (b'D', _) => Key::Left,
        (b'H', _) | (b'~', Some(b"1" | b"7")) => Key::Home,
        (b'F', _) | (b'~', Some(b"4" | b"8")) => Key::End,
        (b'~', Some(b"5")) => Key::PageUp,
        (b'~', Some(b"6")) => Key::PageDown,
        (b'Z', _) => Key::BackTab,
        _ => return None,
    })
}

/// A letter in UTF-8.
fn letter(bytes: &[u8]) -> KeyPrefix {
    let length = match bytes.first() {
        Some(0xc0..0xe0) => 2,
        Some(0xe0..0xf0) => 3,
        Some(0xf0..0xf8) => 4,
        _ => 1,
    };
    let Some(bytes) = bytes.get(..length) else {
        return KeyPrefix::Half;
    };
    match std::str::from_utf8(bytes) {
        Ok(text) => KeyPrefix::Key(length, text.chars().next().map(Key::Char)),
        Err(_) => KeyPrefix::Key(1, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(bytes: &[u8]) -> Vec<Key> {
        let mut keys = Keys::default();
        let mut all = keys.push(bytes);
        all.extend(keys.finish());
        all
    }

    #[test]
    fn terminals_send_keys_in_several_ways() {
        assert_eq!(
            keys(b"q\r\x03\t\x7f\x1b"),
            [
                Key::Char('q'),
                Key::Enter,
                Key::Control('c'),
                Key::Tab,
                Key::Backspace,
                Key::Esc
            ]
        );
        assert_eq!(keys(b"\x1b[A\x1bOA\x1b[1;5A"), [Key::Up; 3]);
        assert_eq!(keys(b"\x1b[H\x1b[1~\x1b[7~\x1bOH"), [Key::Home; 4]);
        assert_eq!(
            keys(b"\x1b[5~\x1b[6~\x1b[Z\x1b[F"),
            [Key::PageUp, Key::PageDown, Key::BackTab, Key::End]
        );
        assert_eq!(keys("ä€".as_bytes()), [Key::Char('ä'), Key::Char('€')]);
        assert_eq!(keys(b"\x1b\x1b[A"), [Key::Esc, Key::Up]);
    }

    #[test]
    fn unused_sequences_are_skipped() {
        // A function key, one with alt, a position of the mouse, bytes that are not a letter.
        let bytes = b"\x1b[15~\x1bOP\x1b[[A\x1bx\x1b[<0;3;4M\x00\xff\xc3(j";
        assert_eq!(keys(bytes), [Key::Char('('), Key::Char('j')]);
        // A sequence without an end is ignored.
        let mut long = Keys::default();
        assert_eq!(long.push(&[b"\x1b[".as_slice(), &[b'1'; 100]].concat()), []);
        assert!(!long.is_half());
    }

    #[test]
    fn a_key_may_come_in_pieces() {
        let mut keys = Keys::default();
        let mut all = Vec::new();
        for byte in "\u{1b}[5~€\u{1b}OB".bytes() {
            all.extend(keys.push(&[byte]));
        }
        assert_eq!(all, [Key::PageUp, Key::Char('€'), Key::Down]);
        assert!(!keys.is_half());
        assert_eq!(keys.push(b"\x1b"), []);
        assert!(keys.is_half());
        assert_eq!(keys.finish(), Some(Key::Esc));
        assert_eq!(keys.finish(), None);
    }
}
