//! Which files a recording has: one, the parts of a long one, or those of a folder of rosbag2.

use crate::error::RecordError;
use rc_mcap::MAGIC;
use rc_mcap::read::{PREFIX, Record, prefix};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The name of the table at the beginning of each part.
pub(crate) const PART: &str = "part";
/// The keys of this table: the recording, the number of the part from 0 on, and how many messages
/// and attachments at its beginning repeat those of earlier parts.
pub(crate) const RECORDING: &str = "recording";
pub(crate) const NUMBER: &str = "number";
pub(crate) const REPEATED: &str = "repeated";
pub(crate) const REPEATED_FILES: &str = "repeated files";

/// The list of files in a folder of rosbag2.
const LIST: &str = "metadata.yaml";
/// The longest record at the beginning of a file that is read to find its table.
const LONGEST_BEGINNING: u64 = 1 << 16;

/// How many missing parts are named.
pub(super) const MOST_MISSING: usize = 8;

/// The files of the recording at `path`, in their order, and the numbers of parts between them that
/// are missing, at most one more than is named.
///
/// A folder is one of rosbag2. The first of the parts of a long recording means all that are there;
/// another one means itself alone.
pub(super) fn files(path: &Path) -> Result<(Vec<PathBuf>, Vec<u32>), RecordError> {
    if path.is_dir() {
        return Ok((in_folder(path)?, Vec::new()));
    }
    let alone = || Ok((vec![path.to_owned()], Vec::new()));
    let Some((stem, number)) = number_of(path) else {
        return alone();
    };
    let Some((recording, _)) = part_of(path) else {
        return alone();
    };
    let mut parts = BTreeMap::new();
    for entry in entries(path.parent().unwrap_or(Path::new(""))) {
        if let Some((other, number)) = number_of(&entry)
            && other == stem
            && part_of(&entry) == Some((recording.clone(), number))
        {
            parts.insert(number, entry);
        }
    }
    if parts.keys().next() != Some(&number) {
        return alone();
    }
    let last = parts.keys().next_back().map_or(number, |last| *last);
    let missing = (number..last).filter(|number| !parts.contains_key(number));
    let missing = missing.take(MOST_MISSING + 1).collect();
    Ok((parts.into_values().collect(), missing))
}

/// The paths in a folder; an empty path is the present one.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let here = folder.as_os_str().is_empty();
    let found = std::fs::read_dir(if here { Path::new(".") } else { folder });
    let entries = found.into_iter().flatten().flatten();
    entries
        .map(|entry| folder.join(entry.file_name()))
        .collect()
}

/// `x` and 3 of `x.3.mcap`; `x` and 0 of `x.mcap`.
fn number_of(path: &Path) -> Option<(String, u32)> {
    let name = path.file_name()?.to_str()?.strip_suffix(".mcap")?;
    let numbered = name.rsplit_once('.');
    let numbered = numbered.and_then(|(stem, number)| Some((stem, number.parse().ok()?)));
    let (stem, number) = numbered.unwrap_or((name, 0));
    Some((stem.to_owned(), number))
}

/// The recording of which a file is a part, and its number in it.
fn part_of(path: &Path) -> Option<(String, u32)> {
    let mut file = rc_files::open_regular(path).ok()?;
    let mut magic = [0; MAGIC.len()];
    file.read_exact(&mut magic).ok()?;
    // The header, then the table.
    for _ in 0..2 {
        let mut begin = [0; PREFIX];
        file.read_exact(&mut begin).ok()?;
        let (code, length) = prefix(&begin)?;
        let mut body = Vec::new();
        let length = Some(length).filter(|length| *length <= LONGEST_BEGINNING)?;
        file.by_ref().take(length).read_to_end(&mut body).ok()?;
        if let Record::Metadata { name, metadata } = Record::parse(code, &body).ok()? {
            let number = metadata.get(NUMBER)?.parse().ok()?;
            return (name == PART).then(|| Some((metadata.get(RECORDING)?.clone(), number)))?;
        }
    }
    None
}

/// The files of a folder of rosbag2, as its list names them.
fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let no_recording = |reason: String| RecordError::NoRecording {
        path: folder.to_owned(),
        reason,
    };
    let list = folder.join(LIST);
    let text = rc_files::read(&list).map_err(|error| {
        no_recording(format!(
            "it is a folder, and its {LIST} cannot be read: {error}"
        ))
    })?;
    let entry = |key: &str| {
        let mut lines = text.lines().map(str::trim);
        let found = lines.find_map(|line| line.strip_prefix(key)?.trim_start().strip_prefix(':'));
        found.map(|value| value.trim().trim_matches(['"', '\'']))
    };
    if let Some(storage) = entry("storage_identifier").filter(|storage| *storage != "mcap") {
        let storage = rc_diagnostics::foreign::clean(storage);
        return Err(no_recording(format!(
            "its storage is `{storage}`, not `mcap`; `ros2 bag convert` converts it"
        )));
    }
    if entry("compression_mode").is_some_and(|mode| mode.eq_ignore_ascii_case("message")) {
        return Err(no_recording(
            "its messages are compressed one by one; `ros2 bag convert` converts it".to_owned(),
        ));
    }
    let mut lines = text.lines().map(str::trim);
    let mut found = Vec::new();
    if lines.any(|line| line == "relative_file_paths:") {
        for name in lines.map_while(|line| line.strip_prefix("- ")) {
            // Older versions also name the folder. A file outside the folder is never meant.
            let name = Path::new(name.trim().trim_matches(['"', '\''])).file_name();
            found.extend(name.map(|name| folder.join(name)));
        }
    }
    if found.is_empty() {
        return Err(no_recording(format!("its {LIST} lists no files")));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_parts() {
        let of = |name: &str| number_of(Path::new(name));
        assert_eq!(of("a/x.mcap"), Some(("x".to_owned(), 0)));
        assert_eq!(of("x.12.mcap"), Some(("x".to_owned(), 12)));
        assert_eq!(of("x.y.mcap"), Some(("x.y".to_owned(), 0)));
        assert_eq!(of("x.txt"), None);
    }
}
