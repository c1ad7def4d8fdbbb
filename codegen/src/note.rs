//! The note of a component: its name, the hash of its model, and its middleware. Tools read it from
//! an executable without running it, and from generated code without building it.
//!
//! The note is read-only data: [`MAGIC`], a JSON object, a zero byte. In generated code it is a
//! byte string.

use crate::files::GENERATED;
use memchr::memmem;
use object::{Object, ObjectSection, ReadCache};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The start of a note, which no other data contains by chance.
pub const MAGIC: &[u8] = b"\x02rc-note\x03\x1e\x1f";
/// [`MAGIC`] in a Rust byte string.
const MAGIC_TEXT: &str = "\\x02rc-note\\x03\\x1e\\x1f";

/// The file in `generated/` that contains the note of a component in Rust.
pub(crate) const RUST_SOURCE: &str = "src/backend.rs";
/// The files that contain notes, of a component in Rust and of one in C++.
const SOURCES: [&str; 2] = [RUST_SOURCE, "description.cpp"];

/// The file in the package of a component in Python that describes it.
pub const DESCRIPTION: &str = "description.json";

/// The part of this file that is a note.
#[derive(Deserialize)]
struct Described {
    name: String,
    model: String,
    middleware: String,
}

/// The content of a note.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// The name of the component.
    pub component: String,
    /// The hash of its model: 16 hexadecimal digits.
    pub model: String,
    /// The middlewares it was generated for, as [`rc_vocabulary::Middlewares`] writes them.
    pub middleware: String,
}

impl Note {
    /// The content of a Rust byte string with this note.
    pub fn to_byte_string(&self) -> String {
        let json = serde_json::to_string(self)
            .unwrap_or_default()
            .replace('"', "\\\"");
        format!("{MAGIC_TEXT}{json}\\0")
    }

    /// A line of a text file with this note, as it is read from an executable.
    pub fn to_text(&self) -> String {
        let json = serde_json::to_string(self).unwrap_or_default();
        format!("{}{json}\0", String::from_utf8_lossy(MAGIC))
    }

    /// Reads the note from the generated code in a component's folder. `None` if the file has no
    /// note. For a component in Python, it is a part of the description in its package.
    ///
    /// # Errors
    /// The system cannot read the file. `NotFound` before the first generation.
    pub fn of_generated(folder: &Path) -> std::io::Result<Option<Self>> {
        let generated = folder.join(GENERATED);
        let read = |source: &str| rc_files::read(&generated.join(source));
        let is_missing = |text: &std::io::Result<String>| {
            let error = text.as_ref().err();
            error.is_some_and(|error| error.kind() == std::io::ErrorKind::NotFound)
        };
        let mut texts = SOURCES.into_iter().map(read);
        let Some(text) = texts.find(|text| !is_missing(text)) else {
            let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
            return Self::of_package(&generated)?.ok_or(missing).map(Some);
        };
        let text = text?;
        Ok(text.split(MAGIC_TEXT).skip(1).find_map(|rest| {
            let (json, _) = rest.split_once("\\0")?;
            serde_json::from_str(&json.replace("\\\"", "\"")).ok()
        }))
    }

    /// Reads the note from the package of a component in Python, which is in `generated`.
    fn of_package(generated: &Path) -> std::io::Result<Option<Self>> {
        for entry in std::fs::read_dir(generated).into_iter().flatten() {
            match rc_files::read(&entry?.path().join(DESCRIPTION)) {
                Ok(text) => {
                    let described = serde_json::from_str::<Described>(&text).ok();
                    return Ok(described.map(|described| Self {
                        component: described.name,
                        model: described.model,
                        middleware: described.middleware,
                    }));
                }
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                // A file next to the package.
                Err(error) if error.kind() == std::io::ErrorKind::NotADirectory => {}
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }

    /// Reads the notes from an executable: none if the executable is not a component, several if it
    /// runs components on threads of one process.
    ///
    /// # Errors
    /// The system cannot read the file.
    pub fn read(path: &Path) -> std::io::Result<Vec<Self>> {
        // Read only the necessary parts: executables are large, and a network has many.
        let cache = ReadCache::new(std::fs::File::open(path)?);
        let section = object::File::parse(&cache).ok().and_then(|file| {
            let section = file.section_by_name(".rodata")?;
            Some(find(section.data().ok()?))
        });
        match section.filter(|notes| !notes.is_empty()) {
            Some(notes) => Ok(notes),
            None => Ok(find(&std::fs::read(path)?)),
        }
    }
}

fn find(bytes: &[u8]) -> Vec<Note> {
    let notes = memmem::find_iter(bytes, MAGIC).filter_map(|at| {
        let rest = &bytes[at + MAGIC.len()..];
        let end = rest.iter().take(4096).position(|b| *b == 0)?;
        serde_json::from_slice(&rest[..end]).ok()
    });
    notes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_note_of_a_component_is_read_from_its_generated_source() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join(GENERATED).join(SOURCES[0]);
        let read = || Note::of_generated(folder.path());
        let missing = read().expect_err("nothing is generated");
        assert_eq!(missing.kind(), std::io::ErrorKind::NotFound);
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        let note = Note {
            component: "a".to_owned(),
            model: "0".repeat(16),
            middleware: "ros2".to_owned(),
        };
        let text = note.to_byte_string();
        for (text, wanted) in [
            (
                format!("const NOTE: &[u8] =\n    b\"{text}\";\n"),
                Some(note),
            ),
            (text[..text.len() - 2].to_owned(), None),
            (text.replace("model", "mode"), None),
            (String::new(), None),
        ] {
            std::fs::write(&file, &text).expect("to write");
            assert_eq!(read().expect("a file"), wanted, "{text}");
        }
    }

    #[test]
    fn notes_are_found_among_other_bytes() {
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
        assert_eq!(find(&bytes), std::slice::from_ref(&note));
        bytes.extend_from_within(100..);
        assert_eq!(find(&bytes), [note.clone(), note]);
        assert_eq!(find(&[0; 64]), []);
    }
}
