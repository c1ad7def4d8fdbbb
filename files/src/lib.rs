//! Reading and replacing the files that belong to users: nothing is waited for, nothing is left half written.

use rustix::fs::{FlockOperation, Gid, OFlags, Uid, fchown, flock};
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// The largest file that is read or written, in bytes: a thousand times what anybody writes.
pub const LARGEST: u64 = 64 << 20;

/// The text of a file. A pipe would be waited for, a device read for ever: neither is taken, and nothing above
/// [`LARGEST`]. The error for what is no UTF-8 is `InvalidData`.
pub fn read(path: &Path) -> io::Result<String> {
    // Before it is opened: to open a device may do something.
    check(&fs::metadata(path)?)?;
    text(&open(path, false)?)
}

/// Gives the file at `path`, whose text is `old`, the text `new`, or changes nothing. A link stays one; owner, group
/// and rights stay as they are; a file that may not be written into is refused, also where its folder may be. The
/// text is on the disk before it takes the file's name. Of several who replace one file at once, one does.
pub fn replace(path: &Path, old: &str, new: &str) -> io::Result<()> {
    if new.len() as u64 > LARGEST {
        return Err(too_large());
    }
    let path = path.canonicalize()?;
    let before = fs::metadata(&path)?;
    check(&before)?;
    if before.permissions().readonly() {
        return Err(io::Error::new(
            ErrorKind::PermissionDenied,
            "it is read-only",
        ));
    }
    // The lock goes with the process, however that ends: what lies at `beside` while it is ours is of a process that
    // was killed.
    let file = open(&path, true)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|error| {
        if error == rustix::io::Errno::WOULDBLOCK {
            being_edited()
        } else {
            error.into()
        }
    })?;
    let beside = beside(&path);
    unchanged(&path, &file, old)?;
    match fs::remove_file(&beside) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let staged = stage(&beside, &file, new)
        .and_then(|()| unchanged(&path, &file, old))
        .and_then(|()| fs::rename(&beside, &path));
    if let Err(error) = staged {
        let _ = fs::remove_file(&beside);
        return Err(error);
    }
    match path.parent() {
        Some(folder) => File::open(folder)?.sync_all(),
        None => Ok(()),
    }
}

/// Where the new text of a file lies until it takes the name of the file.
fn beside(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".rc-new");
    path.with_file_name(name)
}

/// Writes `new` to the disk as `beside`, which is as `file` in all else.
fn stage(beside: &Path, file: &File, new: &str) -> io::Result<()> {
    let wanted = file.metadata()?;
    let mut options = OpenOptions::new();
    // Nobody else reads it before it has its owner and its rights.
    let mut out = options
        .write(true)
        .create_new(true)
        .mode(0o600)
        .open(beside)?;
    let have = out.metadata()?;
    if (have.uid(), have.gid()) != (wanted.uid(), wanted.gid()) {
        let owner = Some(Uid::from_raw(wanted.uid())).filter(|_| have.uid() != wanted.uid());
        fchown(&out, owner, Some(Gid::from_raw(wanted.gid()))).map_err(|error| {
            let why = format!(
                "it would lose its owner ({}:{}): {error}",
                wanted.uid(),
                wanted.gid()
            );
            io::Error::new(ErrorKind::PermissionDenied, why)
        })?;
    }
    out.set_permissions(Permissions::from_mode(wanted.mode() & 0o7777))?;
    out.write_all(new.as_bytes())?;
    out.sync_all()
}

/// `path` still is `file`, and its text still is `old`.
fn unchanged(path: &Path, file: &File, old: &str) -> io::Result<()> {
    let (now, then) = (fs::metadata(path)?, file.metadata()?);
    if (now.dev(), now.ino()) == (then.dev(), then.ino()) && text(&open(path, false)?)? == old {
        Ok(())
    } else {
        Err(being_edited())
    }
}

/// Opens what is to be a regular file, without waiting for anybody if it is none.
fn open(path: &Path, write: bool) -> io::Result<File> {
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let mut options = OpenOptions::new();
    options.read(true).write(write);
    let file = options.custom_flags(flags.bits() as i32).open(path)?;
    check(&file.metadata()?)?;
    Ok(file)
}

fn text(mut file: &File) -> io::Result<String> {
    let mut text = String::new();
    // It may grow while it is read.
    let read = Read::by_ref(&mut file)
        .take(LARGEST + 1)
        .read_to_string(&mut text)?;
    if read as u64 > LARGEST {
        return Err(too_large());
    }
    Ok(text)
}

fn check(metadata: &fs::Metadata) -> io::Result<()> {
    if !metadata.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is not a file"));
    }
    if metadata.len() > LARGEST {
        return Err(too_large());
    }
    Ok(())
}

fn too_large() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "it has more than 64 MB")
}

fn being_edited() -> io::Error {
    io::Error::other("it is being edited; try again")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, FileType, Mode, mknodat};

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a folder")
    }

    fn file(folder: &tempfile::TempDir, mode: u32) -> PathBuf {
        let path = folder.path().join("config.toml");
        fs::write(&path, "old").expect("to write");
        fs::set_permissions(&path, Permissions::from_mode(mode)).expect("to set");
        path
    }

    fn names(folder: &tempfile::TempDir) -> Vec<String> {
        let entries = fs::read_dir(folder.path()).expect("a folder").flatten();
        let names = entries.map(|e| e.file_name().into_string().expect("a name"));
        names.collect()
    }

    #[test]
    fn a_file_keeps_its_rights_its_owner_and_its_link() {
        let folder = folder();
        let path = file(&folder, 0o640);
        // Only root may give a file away.
        let owner = if rustix::process::geteuid().is_root() {
            std::os::unix::fs::chown(&path, Some(1000), Some(1001)).expect("to give away");
            (1000, 1001)
        } else {
            let own = fs::metadata(&path).expect("a file");
            (own.uid(), own.gid())
        };
        let link = folder.path().join("link.toml");
        std::os::unix::fs::symlink(&path, &link).expect("a link");
        // What a process has left that was killed is in nobody's way.
        fs::write(beside(&path), "half").expect("to write");
        replace(&link, "old", "new").expect("to replace");
        assert_eq!(read(&path).expect("to read"), "new");
        let now = fs::metadata(&path).expect("a file");
        assert_eq!((now.uid(), now.gid()), owner);
        assert_eq!(now.mode() & 0o7777, 0o640);
        assert!(fs::symlink_metadata(&link).expect("a link").is_symlink());
        assert_eq!(names(&folder).len(), 2, "{:?}", names(&folder));
    }

    #[test]
    fn what_is_read_only_locked_or_changed_stays() {
        let folder = folder();
        let path = file(&folder, 0o444);
        let refused = replace(&path, "old", "new").expect_err("it is read-only");
        assert_eq!(refused.kind(), ErrorKind::PermissionDenied);
        fs::set_permissions(&path, Permissions::from_mode(0o600)).expect("to set");
        let refused = replace(&path, "older", "new").expect_err("it has another text");
        assert!(refused.to_string().contains("being edited"), "{refused}");
        let held = open(&path, true).expect("to open");
        flock(&held, FlockOperation::LockExclusive).expect("to lock");
        let refused = replace(&path, "old", "new").expect_err("another one replaces it");
        assert!(refused.to_string().contains("being edited"), "{refused}");
        drop(held);
        // What was put in its place meanwhile has the same text, and may have another owner.
        let moved = open(&path, true).expect("to open");
        fs::rename(&path, folder.path().join("other")).expect("to rename");
        fs::copy(folder.path().join("other"), &path).expect("to copy");
        unchanged(&path, &moved, "old").expect_err("it is another file");
        assert_eq!(read(&path).expect("to read"), "old");
        assert_eq!(names(&folder).len(), 2, "{:?}", names(&folder));
    }

    #[test]
    fn what_is_no_file_or_too_large_is_not_waited_for() {
        let folder = folder();
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a pipe");
        for path in [pipe.as_path(), folder.path(), Path::new("/dev/zero")] {
            for refused in [read(path).map(drop), replace(path, "", "new")] {
                assert!(refused.is_err_and(|e| e.to_string() == "it is not a file"));
            }
        }
        // It became one between the look and the opening.
        assert!(open(&pipe, true).is_err_and(|e| e.to_string() == "it is not a file"));
        let large = file(&folder, 0o600);
        let hollow = File::options().write(true).open(&large).expect("to open");
        hollow.set_len(LARGEST + 1).expect("to grow");
        for refused in [read(&large).map(drop), replace(&large, "", "new")] {
            assert!(refused.is_err_and(|e| e.to_string().contains("64 MB")));
        }
    }
}
