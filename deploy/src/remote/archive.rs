//! Archives in the format of tar (ustar, with GNU's records of long names), as `tar -x` reads them.

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
/// A file up to this length is read before it is sent, and an archive begins to be sent at this length.
const READ_WHOLE: u64 = 4 << 20;

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
    /// A file with these bytes.
    Bytes { bytes: Vec<u8>, executable: bool },
    /// A link to this path.
    Link(PathBuf),
}

impl Content {
    fn size(&self) -> u64 {
        match self {
            Self::File { size, .. } => *size,
            Self::Bytes { bytes, .. } => bytes.len() as u64,
            Self::Link(_) => 0,
        }
    }
}

impl Entry {
    /// Reads the file, which may have changed since it was listed; `None` if it is gone. A long one gets
    /// the length that it has now.
    fn read(self) -> io::Result<Option<Self>> {
        let Content::File {
            from, executable, ..
        } = self.content
        else {
            return Ok(Some(self));
        };
        let read = || -> io::Result<(Vec<u8>, u64)> {
            let file = File::open(&from)?;
            let mut bytes = Vec::new();
            (&file).take(READ_WHOLE + 1).read_to_end(&mut bytes)?;
            Ok((bytes, file.metadata()?.len()))
        };
        let (bytes, size) = match read() {
            Err(error) if is_gone(&error) => return Ok(None),
            read => read.map_err(|error| {
                io::Error::new(
                    error.kind(),
                    format!("cannot read {}: {error}", from.display()),
                )
            })?,
        };
        let content = if bytes.len() as u64 <= READ_WHOLE {
            Content::Bytes { bytes, executable }
        } else {
            Content::File {
                from,
                size,
                executable,
            }
        };
        let path = self.path;
        Ok(Some(Self { path, content }))
    }
}

/// Whether somebody has removed a file, or a folder above it.
pub(super) fn is_gone(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::NotFound
}

/// Sends the entries in archives, each after a line with its length, and `0` after the last one. Files may
/// be written and removed meanwhile.
///
/// # Errors
/// A file cannot be read, a long one becomes shorter while it is sent, or `out` refuses.
pub(super) fn send(entries: Vec<Entry>, out: &mut impl Write) -> io::Result<()> {
    let mut batch = Vec::new();
    let mut length = 0;
    let mut entries = entries.into_iter();
    loop {
        let next = entries.next();
        let is_last = next.is_none();
        if let Some(entry) = next.map(Entry::read).transpose()?.flatten() {
            length += BLOCK as u64 + entry.content.size();
            batch.push(entry);
        }
        if !batch.is_empty() && (is_last || length >= READ_WHOLE) {
            out.write_all(format!("{}\n", size(&batch)).as_bytes())?;
            write(&batch, out)?;
            batch.clear();
            length = 0;
        }
        if is_last {
            return out.write_all(b"0\n");
        }
    }
}

/// The length of the archive.
fn size(entries: &[Entry]) -> u64 {
    let long = |path: &Path| match path.as_os_str().len() {
        length if length > NAME => BLOCK as u64 + padded(length as u64 + 1, BLOCK as u64),
        _ => 0,
    };
    let sizes = entries.iter().map(|entry| {
        let link = match &entry.content {
            Content::Link(to) => long(to),
            Content::File { .. } | Content::Bytes { .. } => 0,
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
fn write(entries: &[Entry], out: &mut impl Write) -> io::Result<()> {
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
            Content::Bytes { bytes, executable } => {
                let size = bytes.len() as u64;
                out.write_all(&header(path, OsStr::new(""), b'0', size, *executable))?;
                out.write_all(bytes)?;
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
            content: Content::Bytes {
                bytes: text.into(),
                executable: false,
            },
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
    fn files_are_sent_as_they_are_by_now() {
        let folder = tempfile::tempdir().expect("a folder");
        let listed = |name: &str| Entry {
            path: name.into(),
            content: Content::File {
                from: folder.path().join(name),
                size: 6,
                executable: true,
            },
        };
        let now = |name: &str, bytes: Vec<u8>| {
            std::fs::write(folder.path().join(name), &bytes).expect("a file");
            Entry {
                path: name.into(),
                content: Content::Bytes {
                    bytes,
                    executable: true,
                },
            }
        };
        let long = vec![b'x'; READ_WHOLE as usize + 1];
        let first = [now("short", b"short".into()), now("long", long)];
        let second = [now("last", b"grown by now".into())];
        let mut wanted = Vec::new();
        for archive in [&first[..], &second] {
            wanted.extend(format!("{}\n", size(archive)).as_bytes());
            write(archive, &mut wanted).expect("it is written");
        }
        wanted.extend(b"0\n");
        let mut sent = Vec::new();
        let entries = ["short", "gone", "long", "last"].map(listed);
        send(entries.into(), &mut sent).expect("it is sent");
        assert!(sent == wanted);
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
