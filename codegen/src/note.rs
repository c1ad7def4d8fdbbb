//! What tools find in an executable without running it: which component it is, of which model, for which
//! middleware.
//!
//! The note is read-only data: [`MAGIC`], a JSON object, a zero byte.

use memchr::memmem;
use object::{Object, ObjectSection, ReadCache};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Begins a note. No text has these bytes by chance.
pub const MAGIC: &[u8] = b"\x02rc-note\x03\x1e\x1f";
/// The same in a Rust byte string.
const MAGIC_TEXT: &str = "\\x02rc-note\\x03\\x1e\\x1f";

/// What a note says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// The name of the component.
    pub component: String,
    /// The hash of its model, sixteen hexadecimal digits.
    pub model: String,
    /// The middleware that it was generated for.
    pub middleware: String,
}

impl Note {
    /// The content of a Rust byte string that holds this note.
    pub fn to_byte_string(&self) -> String {
        let json = serde_json::to_string(self)
            .unwrap_or_default()
            .replace('"', "\\\"");
        format!("{MAGIC_TEXT}{json}\\0")
    }

    /// The note of an executable; none where it has none, so that it is no component.
    pub fn read(path: &Path) -> std::io::Result<Option<Self>> {
        // Executables are large, and a network has many: as little of them is read as can be.
        let cache = ReadCache::new(std::fs::File::open(path)?);
        let section = object::File::parse(&cache).ok().and_then(|file| {
            let section = file.section_by_name(".rodata")?;
            section.data().ok().and_then(find)
        });
        match section {
            Some(note) => Ok(Some(note)),
            None => Ok(find(&std::fs::read(path)?)),
        }
    }
}

fn find(bytes: &[u8]) -> Option<Note> {
    memmem::find_iter(bytes, MAGIC).find_map(|at| {
        let rest = &bytes[at + MAGIC.len()..];
        let end = rest.iter().take(4096).position(|b| *b == 0)?;
        serde_json::from_slice(&rest[..end]).ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_is_found_among_other_bytes() {
        let note = Note {
            component: "a".to_owned(),
            model: "0".repeat(16),
            middleware: "local".to_owned(),
        };
        let mut bytes = vec![2; 100];
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(b"{broken\0");
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(
            serde_json::to_string(&note)
                .expect("a note is JSON")
                .as_bytes(),
        );
        bytes.push(0);
        assert_eq!(find(&bytes), Some(note));
        assert_eq!(find(&[0; 64]), None);
    }
}
