//! The two parts of a log: `NAME.log`, and `NAME.log.1` with the older part.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The longest first line of an older part.
const LONGEST_HEADER: u64 = 200;

/// The older part of a log.
pub fn older(log: &Path) -> PathBuf {
    beside(log, ".1")
}

/// Another file next to a log.
pub fn beside(log: &Path, end: &str) -> PathBuf {
    let mut name = log.as_os_str().to_owned();
    name.push(end);
    name.into()
}

/// The first line of an older part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The number of the part, from 1.
    pub part: u64,
    /// How many bytes at its beginning were left out.
    pub left_out: u64,
    /// The length of the line in bytes.
    pub length: u64,
}

impl Header {
    /// The header as text, with an end of line.
    pub fn line(self) -> String {
        format!(
            "[rcdeploy: part {} of this log, without its first {} bytes]\n",
            self.part, self.left_out
        )
    }

    fn parse(line: &str) -> Option<Self> {
        let rest = line.strip_prefix("[rcdeploy: part ")?;
        let (part, rest) = rest.split_once(" of this log, without its first ")?;
        let left_out = rest.strip_suffix(" bytes]\n")?;
        Some(Self {
            part: part.parse().ok()?,
            left_out: left_out.parse().ok()?,
            length: line.len() as u64,
        })
    }

    /// Reads the header of the older part of a log. `None` if there is none.
    pub fn of(log: &Path) -> Option<(Self, File)> {
        let file = File::open(older(log)).ok()?;
        let mut line = String::new();
        BufReader::new((&file).take(LONGEST_HEADER))
            .read_line(&mut line)
            .ok()?;
        Some((Self::parse(&line)?, file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_an_older_part_is_recognised() {
        let header = Header {
            part: 3,
            left_out: 70,
            length: 0,
        };
        let line = header.line();
        let length = line.len() as u64;
        assert_eq!(Header::parse(&line), Some(Header { length, ..header }));
        assert_eq!(Header::parse("[rcdeploy: part 3\n"), None);
    }
}
