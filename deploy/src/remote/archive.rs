//! An archive in the format of tar (ustar, with GNU's records of long names), as `tar -x` reads it.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// The unit of the format.
const BLOCK: usize = 512;
/// The longest name in a header.
const NAME: usize = 100;
/// The unit in which `tar` reads: a shorter end would let it wait for more.
const RECORD: u64 = 10_240;

/// One entry.
#[derive(Debug)]
pub(super) struct Entry {
    /// The path in the archive, relative.
    pub(super) path: PathBuf,
    pub(super) content: Content,
}

#[derive(Debug)]
pub(super) enum Content {
    /// The bytes of a file of this machine, which has this length.
    File {
        from: PathBuf,
        size: u64,
        executable: bool,
    },
    /// These bytes.
    Text(Vec<u8>),
    /// A link to this path.
    Link(PathBuf),
}

impl Content {
    fn size(&self) -> u64 {
        match self {
            Self::File { size, .. } => *size,
            Self::Text(text) => text.len() as u64,
            Self::Link(_) => 0,
        }
    }
}

/// The length of the archive.
pub(super) fn size(entries: &[Entry]) -> u64 {
    let long = |path: &Path| match path.as_os_str().len() {
        length if length > NAME => BLOCK as u64 + padded(length as u64 + 1, BLOCK as u64),
        _ => 0,
    };
    let sizes = entries.iter().map(|entry| {
        let link = match &entry.content {
            Content::Link(to) => long(to),
            Content::File { .. } | Content::Text(_) => 0,
        };
        let content = padded(entry.content.size(), BLOCK as u64);
        long(&entry.path) + link + BLOCK as u64 + content
    });
    padded(sizes.sum::<u64>() + 2 * BLOCK as u64, RECORD)
}

/// Writes the archive, exactly [`size`] bytes.
///
/// # Errors
/// A file cannot be read or has another length by now, or `out` refuses.
pub(super) fn write(entries: &[Entry], out: &mut impl Write) -> io::Result<()> {
    let mut out = Counted { out, count: 0 };
    for entry in entries {
        let path = entry.path.as_os_str();
        long(b'L', path, &mut out)?;
        match &entry.content {
            Content::File {
                from,
                size,
                executable,
            } => {
                out.write_all(&header(path, OsStr::new(""), b'0', *size, *executable))?;
                let sent = io::copy(&mut File::open(from)?.take(*size), &mut out)?;
                if sent != *size {
                    let message = format!(
                        "{} has changed while it was copied; try again",
                        from.display()
                    );
                    return Err(io::Error::other(message));
                }
            }
            Content::Text(text) => {
                let size = text.len() as u64;
                out.write_all(&header(path, OsStr::new(""), b'0', size, false))?;
                out.write_all(text)?;
            }
            Content::Link(to) => {
                let to = to.as_os_str();
                long(b'K', to, &mut out)?;
                out.write_all(&header(path, to, b'2', 0, false))?;
            }
        }
        out.pad(BLOCK as u64)?;
    }
    out.write_all(&[0; 2 * BLOCK])?;
    out.pad(RECORD)
}

/// A record with a name that is too long for a header.
fn long(kind: u8, name: &OsStr, out: &mut Counted<impl Write>) -> io::Result<()> {
    if name.len() <= NAME {
        return Ok(());
    }
    let size = name.len() as u64 + 1;
    let title = OsStr::new("././@LongLink");
    out.write_all(&header(title, OsStr::new(""), kind, size, false))?;
    out.write_all(name.as_bytes())?;
    out.write_all(&[0])?;
    out.pad(BLOCK as u64)
}

fn header(name: &OsStr, link: &OsStr, kind: u8, size: u64, executable: bool) -> [u8; BLOCK] {
    let mut header = [0; BLOCK];
    let mut put = |at: usize, text: &[u8]| header[at..at + text.len()].copy_from_slice(text);
    let short = |name: &OsStr| name.as_bytes()[..name.len().min(NAME)].to_vec();
    put(0, &short(name));
    put(
        100,
        if executable {
            b"0000700\0"
        } else {
            b"0000600\0"
        },
    );
    put(108, b"0000000\0");
    put(116, b"0000000\0");
    put(124, format!("{size:011o}\0").as_bytes());
    put(136, b"00000000000\0");
    // The sum counts its own field as blanks.
    put(148, b"        ");
    put(156, &[kind]);
    put(157, &short(link));
    put(257, b"ustar  \0");
    let sum: u32 = header.iter().copied().map(u32::from).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    header
}

fn padded(size: u64, unit: u64) -> u64 {
    size.next_multiple_of(unit)
}

/// Counts the bytes that it writes.
struct Counted<'w, W> {
    out: &'w mut W,
    count: u64,
}

impl<W: Write> Counted<'_, W> {
    fn pad(&mut self, unit: u64) -> io::Result<()> {
        let missing = padded(self.count, unit) - self.count;
        io::copy(&mut io::repeat(0).take(missing), self).map(drop)
    }
}

impl<W: Write> Write for Counted<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.out.write(bytes)?;
        self.count += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};

    #[test]
    fn tar_reads_an_archive() {
        let folder = tempfile::tempdir().expect("a folder");
        let from = folder.path().join("from");
        std::fs::write(&from, vec![b'x'; 1000]).expect("a file");
        let deep = format!("{}/{}", "a".repeat(90), "b".repeat(90));
        let text = |path: &str, text: &str| Entry {
            path: path.into(),
            content: Content::Text(text.into()),
        };
        let entries = [
            text("src/main.rs", "fn main() {}\n"),
            text(&deep, "deep"),
            text("empty", ""),
            Entry {
                path: "bin/run".into(),
                content: Content::File {
                    from,
                    size: 1000,
                    executable: true,
                },
            },
            Entry {
                path: "link".into(),
                content: Content::Link(PathBuf::from(&deep)),
            },
        ];
        let mut archive = Vec::new();
        write(&entries, &mut archive).expect("it is written");
        assert_eq!(archive.len() as u64, size(&entries));
        let out = folder.path().join("out");
        std::fs::create_dir(&out).expect("a folder");
        let mut tar = Command::new("tar")
            .args(["-xmf", "-", "-C"])
            .arg(&out)
            .stdin(Stdio::piped())
            .spawn()
            .expect("tar");
        tar.stdin
            .take()
            .expect("its input")
            .write_all(&archive)
            .expect("it reads");
        assert!(tar.wait().expect("it ends").success());
        let read = |path: &str| std::fs::read_to_string(out.join(path)).expect("a file");
        assert_eq!(read("src/main.rs"), "fn main() {}\n");
        assert_eq!(
            (read("link"), read("empty")),
            ("deep".into(), String::new())
        );
        assert_eq!(read("bin/run").len(), 1000);
        let run = out.join("bin/run").metadata().expect("a file");
        assert_eq!(
            std::os::unix::fs::PermissionsExt::mode(&run.permissions()) & 0o777,
            0o700
        );
    }

    #[test]
    fn a_file_that_shrinks_is_an_error() {
        let folder = tempfile::tempdir().expect("a folder");
        let from = folder.path().join("from");
        std::fs::write(&from, "short").expect("a file");
        let entry = Entry {
            path: "run".into(),
            content: Content::File {
                from,
                size: 6,
                executable: false,
            },
        };
        let error = write(&[entry], &mut Vec::new()).expect_err("it is short");
        assert!(error.to_string().contains("has changed"), "{error}");
    }
}
