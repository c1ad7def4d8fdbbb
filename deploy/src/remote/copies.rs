//! Files of a network that are copied to another machine if their hashes differ.

use super::known_hashes::{KnownHashes, Stamp};
use super::timed_stream::{TimedStream, bytes};
use rc_management::agent::File;
use rustix::fs::{Mode, OFlags};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::{self, BufReader, Read, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::{Component, Path, PathBuf};
use std::time::{Duration, SystemTime};

/// A copy of rcdeploy that was not used for this long is removed.
const UNUSED: Duration = Duration::from_hours(30 * 24);

/// How many bytes of a copy may wait for a slow disk: the other side waits meanwhile.
const UNSYNCED: u64 = 16 << 20;

/// Shows the other side, which waits, that this one works. It is called for each buffer.
pub(crate) type Step<'s> = &'s mut dyn FnMut() -> io::Result<()>;

/// The hash and the length of a stream.
fn hash(mut from: impl Read, mut also: impl Write, step: Step<'_>) -> io::Result<(String, u64)> {
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 256 * 1024];
    let mut size = 0;
    loop {
        let count = match from.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        hasher.update(&buffer[..count]);
        also.write_all(&buffer[..count])?;
        size += count as u64;
        step()?;
    }
    let hash = hasher.finalize();
    Ok((
        hash.iter().map(|byte| format!("{byte:02x}")).collect(),
        size,
    ))
}

/// Describes a file of this machine for an agent. Reads it only if its hash is not known.
pub(crate) fn describe(
    path: &Path,
    known: Option<&mut KnownHashes>,
    step: Step<'_>,
) -> io::Result<File> {
    let file = open(path)?;
    let metadata = file.metadata()?;
    let stamp = Stamp::of(&metadata);
    let described = |(hash, size)| File {
        path: mirrored(Path::new("/"), path),
        hash,
        size,
        executable: metadata.permissions().mode() & 0o111 != 0,
    };
    let Some(known) = known else {
        return hash(file, io::sink(), step).map(described);
    };
    if let Some(hash) = known.get(path, &stamp) {
        return Ok(described((hash, metadata.len())));
    }
    let (hash, size) = hash(&file, io::sink(), step)?;
    if Stamp::of(&file.metadata()?) == stamp {
        known.keep(path, stamp, &hash);
    }
    Ok(described((hash, size)))
}

/// Whether the same file is already below `root`. An error is one of `step`.
pub(crate) fn is_below(
    file: &File,
    root: &Path,
    known: &mut KnownHashes,
    step: Step<'_>,
) -> io::Result<bool> {
    let mut stepped = Ok(());
    let there = describe(&mirrored(root, &file.path), Some(known), &mut || {
        stepped = step();
        match &stepped {
            Ok(()) => Ok(()),
            Err(error) => Err(error.kind().into()),
        }
    });
    stepped?;
    Ok(there.is_ok_and(|there| there.hash == file.hash && there.executable == file.executable))
}

/// Sends the bytes of `from`, exactly as many as announced.
pub(crate) fn send(file: &File, from: &Path, out: &mut impl Write) -> io::Result<()> {
    let sent = io::copy(&mut open(from)?.take(file.size), out)?;
    if sent == file.size {
        return Ok(());
    }
    let message = format!(
        "{} has changed while it was copied; try again",
        from.display()
    );
    Err(io::Error::other(message))
}

/// Receives its bytes and stores them below `root`, atomically.
pub(crate) fn receive(
    file: &File,
    root: &Path,
    input: &mut BufReader<TimedStream>,
    step: Step<'_>,
) -> io::Result<()> {
    let place = mirrored(root, &file.path);
    let folder = place.parent().unwrap_or(root);
    // It was a file before.
    for above in folder.ancestors().take_while(|above| *above != root) {
        if above.symlink_metadata().is_ok_and(|above| above.is_file()) {
            fs::remove_file(above)?;
        }
    }
    make_folder(folder)?;
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    // One agent at a time receives. Another one may have been killed.
    let new = folder.join(format!(".{name}.rcdeploy"));
    match fs::remove_file(&new) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let received = receive_as(file, &new, input, step).and_then(|()| {
        // It was a folder before.
        if place.is_dir() {
            fs::remove_dir_all(&place)?;
        }
        fs::rename(&new, &place)
    });
    if received.is_err() {
        let _ = fs::remove_file(&new);
    }
    received
}

fn receive_as(
    expected: &File,
    new: &Path,
    input: &mut BufReader<TimedStream>,
    step: Step<'_>,
) -> io::Result<()> {
    let mode = if expected.executable { 0o700 } else { 0o600 };
    let file = fs::OpenOptions::new()
        .write(true)
        .create_new(true)
        .mode(mode)
        .open(new)?;
    let mut out = Synced { file, waiting: 0 };
    let (hash, size) = hash(bytes(input, expected.size), &mut out, step)?;
    if size != expected.size {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    if hash != expected.hash {
        let message = format!(
            "{} has changed while it was copied; try again",
            expected.path.display()
        );
        return Err(io::Error::other(message));
    }
    out.file.sync_data()
}

/// A file of which few bytes wait for the disk.
struct Synced {
    file: fs::File,
    waiting: u64,
}

impl Write for Synced {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let count = self.file.write(buffer)?;
        self.waiting += count as u64;
        if self.waiting >= UNSYNCED {
            self.file.sync_data()?;
            self.waiting = 0;
        }
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The place below `root` of an absolute path of the supervisor's machine. The result never leads
/// out of `root`.
pub(crate) fn mirrored(root: &Path, path: &Path) -> PathBuf {
    let mut mirrored = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => mirrored.push(name),
            Component::ParentDir => drop(mirrored.pop()),
            Component::Prefix(_) | Component::RootDir | Component::CurDir => {}
        }
    }
    root.join(mirrored)
}

/// Opens a regular file. A pipe is refused, because reading it could block.
fn open(path: &Path) -> io::Result<fs::File> {
    let file = rustix::fs::open(
        path,
        OFlags::RDONLY | OFlags::NONBLOCK | OFlags::CLOEXEC,
        Mode::empty(),
    )?;
    let file = fs::File::from(file);
    if file.metadata()?.is_file() {
        Ok(file)
    } else {
        Err(io::Error::other("it is not a file"))
    }
}

/// Creates a folder that only its user can access.
pub(crate) fn make_folder(path: &Path) -> io::Result<()> {
    fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(path)
}

/// The folder for the copies of a network: next to the running copy of rcdeploy.
pub(crate) fn root(program: &Path, network: &str) -> io::Result<PathBuf> {
    let cache = program.parent().unwrap_or(Path::new("/"));
    let root = cache.join("networks").join(network);
    make_folder(&root)?;
    Ok(root)
}

/// A list about the copies below `root`, next to them. No network has a name that starts with a
/// point.
pub(super) fn beside(root: &Path, what: &str) -> PathBuf {
    let name = root.file_name().unwrap_or_default().to_string_lossy();
    root.with_file_name(format!(".{name}.{what}.json"))
}

/// Removes copies of rcdeploy that were not used for long.
pub(crate) fn remove_unused(program: &Path) {
    let cache = program.parent().unwrap_or(Path::new("/"));
    let now = SystemTime::now();
    for entry in fs::read_dir(cache).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let is_copy = name
            .to_str()
            .is_some_and(|n| n.starts_with(super::ssh::COPY));
        let used = entry.metadata().and_then(|file| file.modified());
        let unused = used.is_ok_and(|used| now.duration_since(used).is_ok_and(|t| t > UNUSED));
        if is_copy && unused && entry.path() != program {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No side waits.
    #[expect(clippy::unnecessary_wraps, reason = "a step may fail")]
    fn quiet() -> io::Result<()> {
        Ok(())
    }

    #[test]
    fn a_file_is_identified_by_its_content() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x/../a");
        fs::create_dir(folder.path().join("x")).expect("a folder");
        fs::write(&path, "abc").expect("written");
        let mut known = KnownHashes::read(folder.path().join("known"));
        let file = describe(&path, None, &mut quiet).expect("a file");
        assert_eq!(file.path, folder.path().join("a"));
        let sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!((file.hash.as_str(), file.size), (sha256, 3));
        let root = folder.path().join("root");
        let mut below =
            |root: &Path| is_below(&file, root, &mut known, &mut quiet).expect("nobody waits");
        assert!(!below(&root));
        let there = mirrored(&root, &file.path);
        fs::create_dir_all(there.parent().expect("a parent")).expect("a folder");
        fs::write(&there, "abd").expect("written");
        assert!(!below(&root));
        fs::write(&there, "abc").expect("written");
        assert!(below(&root));
        let gone = || Err(io::ErrorKind::BrokenPipe.into());
        let lost = is_below(&file, &root, &mut known, &mut { gone }).expect_err("nobody hears it");
        assert_eq!(lost.kind(), io::ErrorKind::BrokenPipe);
        let mut sent = Vec::new();
        send(&file, &path, &mut sent).expect("sent");
        assert_eq!(sent, b"abc");
        fs::write(&path, "a").expect("written");
        assert!(send(&file, &path, &mut sent).is_err());
        assert!(describe(folder.path(), None, &mut quiet).is_err());
    }

    #[test]
    fn files_that_differ_from_their_hash_are_not_stored() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        fs::write(&path, "abc").expect("written");
        let file = describe(&path, None, &mut quiet).expect("a file");
        let root = folder.path().join("root");
        let received = |bytes: &[u8]| {
            let (here, there) = std::os::unix::net::UnixStream::pair().expect("a pair");
            there.set_nonblocking(true).expect("a mode");
            (&here).write_all(bytes).expect("written");
            drop(here);
            let mut input = BufReader::new(TimedStream(there.into()));
            receive(&file, &root, &mut input, &mut quiet)
        };
        let other = received(b"abd").expect_err("it has another hash");
        assert!(other.to_string().contains("has changed"), "{other}");
        let short = received(b"ab").expect_err("it is too short");
        assert_eq!(short.kind(), io::ErrorKind::UnexpectedEof);
        let place = mirrored(&root, &file.path);
        let above = place.parent().expect("a folder");
        assert!(!place.exists());
        let left = fs::read_dir(above).expect("it was made");
        assert_eq!(left.count(), 0, "no part of it is left");
        received(b"abc and what follows").expect("its bytes");
        assert_eq!(fs::read(&place).expect("a file"), b"abc");
        // It was a folder before.
        fs::remove_file(&place).expect("a file");
        fs::create_dir_all(place.join("b")).expect("a folder");
        received(b"abc").expect("its bytes");
        assert_eq!(fs::read(&place).expect("a file"), b"abc");
        // The folder above was a file before.
        fs::remove_dir_all(above).expect("a folder");
        fs::write(above, "").expect("a file");
        received(b"abc").expect("its bytes");
        assert_eq!(fs::read(&place).expect("a file"), b"abc");
        // Only its user reads it: it may hold secrets.
        let mode = fs::metadata(&place).expect("a file").permissions().mode();
        assert_eq!(mode & 0o077, 0);
    }

    #[test]
    fn a_long_file_is_read_in_steps() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("long");
        let file = fs::File::create(&path).expect("a file");
        file.set_len(10 << 20).expect("room");
        let mut steps = 0;
        let described = describe(&path, None, &mut || {
            steps += 1;
            Ok(())
        });
        assert_eq!(described.expect("a file").size, 10 << 20);
        assert!(steps >= 40, "{steps}");
    }

    #[test]
    fn a_file_that_has_not_changed_is_not_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, list) = (folder.path().join("a"), folder.path().join("known"));
        fs::write(&path, "abc").expect("written");
        let modified = fs::metadata(&path).and_then(|file| file.modified());
        let modified = modified.expect("a time");
        // The hash, and whether the file was read, so long after the test has begun.
        let at = |seconds| {
            let now = SystemTime::now() + Duration::from_secs(seconds);
            let mut known = KnownHashes::read_at(list.clone(), now);
            let mut read = false;
            let described = describe(&path, Some(&mut known), &mut || {
                read = true;
                Ok(())
            });
            known.finish();
            (described.expect("a file").hash, read)
        };
        // A file that has just changed may change again at the same time.
        let (first, read) = at(0);
        assert!(read);
        assert_eq!(at(10), (first.clone(), true));
        assert_eq!(at(10), (first.clone(), false));
        assert_eq!(at(0), (first.clone(), false));
        // Another content of this length, with the old time of modification.
        fs::write(&path, "abd").expect("written");
        let file = fs::File::options().write(true).open(&path);
        file.and_then(|file| file.set_modified(modified))
            .expect("set");
        let (second, read) = at(10);
        assert!(read && second != first);
        assert_eq!(at(10), (second.clone(), false));
        // A damaged list is none.
        fs::write(&list, "{\"a").expect("written");
        assert_eq!(at(10), (second, true));
    }

    #[test]
    fn a_file_that_was_received_and_one_from_before_an_error_are_not_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let list = folder.path().join("known");
        let later = SystemTime::now() + Duration::from_secs(10);
        let path = |name: &str| folder.path().join(name);
        let is_read = |known: &mut KnownHashes, name: &str| {
            let mut read = false;
            let described = describe(&path(name), Some(known), &mut || {
                read = true;
                Ok(())
            });
            described.expect("a file");
            read
        };
        for name in ["old", "new", "received"] {
            fs::write(path(name), name).expect("written");
        }
        let mut known = KnownHashes::read_at(list.clone(), later);
        assert!(is_read(&mut known, "old"));
        known.finish();
        // An error ends the second start before it has asked for the old file.
        let mut known = KnownHashes::read_at(list.clone(), later);
        assert!(is_read(&mut known, "new"));
        known.keep_own(&path("received"), "its hash");
        drop(known);
        let mut known = KnownHashes::read_at(list.clone(), later);
        for name in ["old", "new", "received"] {
            assert!(!is_read(&mut known, name), "{name}");
        }
        // A completed start forgets the files that it was not asked for.
        known.finish();
        let mut known = KnownHashes::read_at(list.clone(), later);
        assert!(!is_read(&mut known, "old"));
        known.finish();
        let mut known = KnownHashes::read_at(list, later);
        assert!(is_read(&mut known, "new"));
    }

    #[test]
    fn no_path_leads_out_of_the_copies() {
        let at = |path: &str| mirrored(Path::new("/cache"), Path::new(path));
        assert_eq!(at("/a/b/../c.map"), Path::new("/cache/a/c.map"));
        assert_eq!(at("/../../etc/passwd"), Path::new("/cache/etc/passwd"));
        assert_eq!(at("/"), Path::new("/cache/"));
    }
}
