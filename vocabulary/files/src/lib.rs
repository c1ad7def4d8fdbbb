//! Reads and replaces users' files without blocking on pipes and without partial writes, and
//! knows when a disk is full.
//!
#![doc = include_str!("example.md")]

mod disk;
mod missing;
mod output;

pub use disk::{Disk, DiskChange};
pub use missing::nearest_path;
pub use output::{write, write_with};
pub mod unsaved;

use rustix::fs::{FlockOperation, Gid, OFlags, Uid, fchown, flock};
use rustix::io::retry_on_intr;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// The largest file that [`read`] and [`replace`] accept, in bytes.
pub const LARGEST: u64 = 64 << 20;

/// A word of a command line, with `~` expanded where shells do not: after `=` of an option, or in
/// quotes. Nobody means a folder of this name.
pub fn home_expanded(word: OsString, home: Option<&OsStr>) -> OsString {
    let (Some(text), Some(home)) = (word.to_str(), home) else {
        return word;
    };
    let option = text
        .split_once('=')
        .filter(|(name, _)| name.starts_with("--"));
    let path = option.map_or(text, |(_, path)| path);
    if path != "~" && !path.starts_with("~/") {
        return word;
    }
    let mut out = OsString::from(&text[..text.len() - path.len()]);
    out.push(home);
    out.push(&path[1..]);
    out
}

/// The words of the command line of this process, each [`home_expanded`].
pub fn words_of_command_line() -> impl Iterator<Item = OsString> {
    let home = std::env::var_os("HOME").filter(|home| !home.is_empty());
    std::env::args_os().map(move |word| home_expanded(word, home.as_deref()))
}

/// Reads a regular file as UTF-8.
///
/// # Errors
/// `InvalidInput` for pipes, devices, folders and files larger than [`LARGEST`]; `InvalidData` for
/// text that is not UTF-8; otherwise the error of the system.
pub fn read(path: &Path) -> io::Result<String> {
    if let Some(text) = unsaved::get(path) {
        return Ok(text);
    }
    // Check before opening: opening a device can have side effects.
    check(&metadata(path)?)?;
    text(&nonblocking(false).open(path)?)
}

/// Reads the bytes of a regular file.
///
/// # Errors
/// As [`read`], but for text that is not UTF-8.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    check(&metadata(path)?)?;
    bytes(&nonblocking(false).open(path)?)
}

/// Opens a regular file of any size for reading.
///
/// # Errors
/// `InvalidInput` for pipes, devices and folders; otherwise the error of the system.
pub fn open_regular(path: &Path) -> io::Result<File> {
    check_kind(&metadata(path)?)?;
    let file = nonblocking(false).open(path)?;
    check_kind(&file.metadata()?)?;
    Ok(file)
}

fn metadata(path: &Path) -> io::Result<fs::Metadata> {
    fs::metadata(path).map_err(|error| missing::explained(path, error))
}

/// Replaces the content `old` of the file at `path` by `new`, atomically.
///
/// The new text is on disk before it takes the file's name. Symbolic links, owner, group and
/// permissions are preserved. If several processes replace a file at the same time, one succeeds.
///
/// A file that is mounted as one file, as containers do, cannot be renamed, and its folder may be
/// read-only. It is written in place, not atomically.
///
/// # Errors
/// The file is unchanged if it is read-only, larger than [`LARGEST`], does not contain `old`, is
/// locked by another process, or the system refuses an operation.
pub fn replace(path: &Path, old: &str, new: &str) -> io::Result<()> {
    replace_keeping(path, old, new, 0o7777)
}

/// [`replace`] for a new text with secrets: other users lose their permissions.
///
/// # Errors
/// As [`replace`].
pub fn replace_hidden(path: &Path, old: &str, new: &str) -> io::Result<()> {
    replace_keeping(path, old, new, 0o7700)
}

/// Replaces the content; of the permissions, the new file has those in `kept`.
fn replace_keeping(path: &Path, old: &str, new: &str, kept: u32) -> io::Result<()> {
    if new.len() as u64 > LARGEST {
        return Err(too_large());
    }
    let path = path.canonicalize()?;
    let before = fs::metadata(&path)?;
    check(&before)?;
    if before.permissions().readonly() {
        return Err(io::Error::new(
            ErrorKind::PermissionDenied,
            "the file is read-only",
        ));
    }
    // The system releases the lock when a process ends. So if this process holds the lock, a file
    // at `temporary` is left over from a process that was killed.
    let file = open(&path)?;
    flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|error| {
        if error == rustix::io::Errno::WOULDBLOCK {
            being_edited()
        } else {
            error.into()
        }
    })?;
    let temporary = temporary_path(&path);
    check_unchanged(&path, &file, old)?;
    match fs::remove_file(&temporary) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut options = OpenOptions::new();
    // Other users cannot read the file before it has its final owner and permissions.
    let out = options.write(true).create_new(true).mode(0o600);
    let out = match out.open(&temporary) {
        Err(error) if error.kind() == ErrorKind::ReadOnlyFilesystem => {
            return write_in_place(&file, new, kept);
        }
        out => out?,
    };
    let staged = stage(out, &file, new, kept)
        .and_then(|()| check_unchanged(&path, &file, old))
        .and_then(|()| match fs::rename(&temporary, &path) {
            Err(error) if is_mount(&error) => {
                write_in_place(&file, new, kept)?;
                fs::remove_file(&temporary)
            }
            renamed => renamed,
        });
    if let Err(error) = staged {
        let _ = fs::remove_file(&temporary);
        return Err(error);
    }
    match path.parent() {
        Some(folder) => File::open(folder)?.sync_all(),
        None => Ok(()),
    }
}

/// The path of the new text until it is renamed to `path`.
fn temporary_path(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".rc-new");
    path.with_file_name(name)
}

/// Whether a file could not be renamed because its new name is a mounted file.
fn is_mount(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::ResourceBusy | ErrorKind::CrossesDevices
    )
}

/// Writes `new` over the content of `file`, which keeps its owner.
fn write_in_place(mut file: &File, new: &str, kept: u32) -> io::Result<()> {
    let mode = file.metadata()?.mode();
    if mode & 0o7777 & !kept != 0 {
        file.set_permissions(Permissions::from_mode(mode & kept))?;
    }
    file.rewind()?;
    file.write_all(new.as_bytes())?;
    file.set_len(new.len() as u64)?;
    file.sync_all()
}

/// Writes `new` to `out`, which takes the name of `file`, with the owner, group and permissions of `file`, as far as `kept`
/// has them.
fn stage(mut out: File, file: &File, new: &str, kept: u32) -> io::Result<()> {
    let wanted = file.metadata()?;
    let have = out.metadata()?;
    if (have.uid(), have.gid()) != (wanted.uid(), wanted.gid()) {
        let owner = Some(Uid::from_raw(wanted.uid())).filter(|_| have.uid() != wanted.uid());
        fchown(&out, owner, Some(Gid::from_raw(wanted.gid()))).map_err(|error| {
            let why = format!(
                "cannot keep its owner ({}:{}): {error}",
                wanted.uid(),
                wanted.gid()
            );
            io::Error::new(ErrorKind::PermissionDenied, why)
        })?;
    }
    out.set_permissions(Permissions::from_mode(wanted.mode() & kept))?;
    out.write_all(new.as_bytes())?;
    out.sync_all()
}

/// Checks that `path` still names `file` and that its content is still `old`.
fn check_unchanged(path: &Path, file: &File, old: &str) -> io::Result<()> {
    let (now, then) = (fs::metadata(path)?, file.metadata()?);
    if (now.dev(), now.ino()) == (then.dev(), then.ino())
        && text(&nonblocking(false).open(path)?)? == old
    {
        Ok(())
    } else {
        Err(being_edited())
    }
}

/// Opens a regular file for reading and writing. Does not block if `path` is a pipe.
fn open(path: &Path) -> io::Result<File> {
    let file = nonblocking(true).open(path)?;
    check(&file.metadata()?)?;
    Ok(file)
}

fn nonblocking(write: bool) -> OpenOptions {
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let mut options = OpenOptions::new();
    options.read(true).write(write);
    options.custom_flags(flags.bits() as i32);
    options
}

fn text(file: &File) -> io::Result<String> {
    let invalid = "stream did not contain valid UTF-8";
    String::from_utf8(bytes(file)?).map_err(|_| io::Error::new(ErrorKind::InvalidData, invalid))
}

fn bytes(mut file: &File) -> io::Result<Vec<u8>> {
    let metadata = file.metadata()?;
    check(&metadata)?;
    let size = usize::try_from(metadata.len()).unwrap_or_default();
    // A small file is read at once: fewer bytes than there is room for are all of it.
    let mut bytes = vec![0; size + 1];
    let read = retry_on_intr(|| rustix::io::read(file, &mut *bytes))?;
    bytes.truncate(read);
    if read != size {
        // It has grown, or the system gives it in parts.
        let rest = (LARGEST + 1).saturating_sub(read as u64);
        Read::by_ref(&mut file).take(rest).read_to_end(&mut bytes)?;
    }
    if bytes.len() as u64 > LARGEST {
        return Err(too_large());
    }
    Ok(bytes)
}

fn check_kind(metadata: &fs::Metadata) -> io::Result<()> {
    if metadata.is_file() {
        return Ok(());
    }
    Err(io::Error::new(
        ErrorKind::InvalidInput,
        "not a regular file",
    ))
}

fn check(metadata: &fs::Metadata) -> io::Result<()> {
    check_kind(metadata)?;
    if metadata.len() > LARGEST {
        return Err(too_large());
    }
    Ok(())
}

fn too_large() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "the file is larger than 64 MB")
}

fn being_edited() -> io::Error {
    io::Error::other("the file is being edited; try again")
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
    fn permissions_owner_and_symbolic_link_are_preserved() {
        let folder = folder();
        let path = file(&folder, 0o640);
        // Only root can change the owner of a file.
        let owner = if rustix::process::geteuid().is_root() {
            std::os::unix::fs::chown(&path, Some(1000), Some(1001)).expect("to give away");
            (1000, 1001)
        } else {
            let own = fs::metadata(&path).expect("a file");
            (own.uid(), own.gid())
        };
        let link = folder.path().join("link.toml");
        std::os::unix::fs::symlink(&path, &link).expect("a link");
        // A temporary file left over from a killed process does not prevent the replacement.
        fs::write(temporary_path(&path), "half").expect("to write");
        replace(&link, "old", "new").expect("to replace");
        assert_eq!(read(&path).expect("to read"), "new");
        let now = fs::metadata(&path).expect("a file");
        assert_eq!((now.uid(), now.gid()), owner);
        assert_eq!(now.mode() & 0o7777, 0o640);
        replace_hidden(&link, "new", "secret").expect("to replace");
        let now = fs::metadata(&path).expect("a file");
        assert_eq!(now.mode() & 0o7777, 0o600);
        assert!(fs::symlink_metadata(&link).expect("a link").is_symlink());
        assert_eq!(names(&folder).len(), 2, "{:?}", names(&folder));
    }

    /// Runs in a mount namespace of its own, where the file is mounted over itself.
    #[test]
    fn a_file_that_is_mounted_is_written_in_place() {
        const INSIDE: &str = "RC_FILES_MOUNTED";
        if let Some(path) = std::env::var_os(INSIDE).map(PathBuf::from) {
            replace(&path, "old", "newer").expect("to replace");
            replace_hidden(&path, "newer", "new").expect("to replace");
            write(&path, "made").expect("to write");
            return;
        }
        let folder = folder();
        let path = file(&folder, 0o644);
        let before = fs::metadata(&path).expect("a file").ino();
        let name = "tests::a_file_that_is_mounted_is_written_in_place";
        let script = "mount --bind \"$1\" \"$1\" || exit 77\n\"$0\" --exact \"$2\" || exit 1";
        let mut command = std::process::Command::new("unshare");
        command
            .args(["-r", "-m", "sh", "-c", script])
            .arg(std::env::current_exe().expect("this program"))
            .arg(&path)
            .arg(name)
            .env(INSIDE, &path);
        let output = command.output();
        match output.as_ref().map(|output| output.status.code()) {
            Ok(Some(0)) => {}
            Ok(Some(1)) if !is_refused(&output) => panic!("{output:?}"),
            _ => {
                println!("skipped: {name}: this user may not mount (`unshare -m`)");
                return;
            }
        }
        assert_eq!(read(&path).expect("to read"), "made");
        let now = fs::metadata(&path).expect("a file");
        assert_eq!((now.ino(), now.mode() & 0o7777), (before, 0o600));
        assert_eq!(names(&folder), ["config.toml"]);
    }

    /// Whether `unshare` itself failed.
    fn is_refused(output: &io::Result<std::process::Output>) -> bool {
        let output = output.as_ref().map(|output| &output.stderr);
        output.is_ok_and(|text| text.starts_with(b"unshare:"))
    }

    #[test]
    fn a_read_only_locked_or_changed_file_is_not_replaced() {
        let folder = folder();
        let path = file(&folder, 0o444);
        let refused = replace(&path, "old", "new").expect_err("it is read-only");
        assert_eq!(refused.kind(), ErrorKind::PermissionDenied);
        fs::set_permissions(&path, Permissions::from_mode(0o600)).expect("to set");
        let refused = replace(&path, "older", "new").expect_err("it has another text");
        assert!(refused.to_string().contains("being edited"), "{refused}");
        let held = open(&path).expect("to open");
        flock(&held, FlockOperation::LockExclusive).expect("to lock");
        let refused = replace(&path, "old", "new").expect_err("another one replaces it");
        assert!(refused.to_string().contains("being edited"), "{refused}");
        drop(held);
        // Another file with the same text took its place; it may have another owner.
        let moved = open(&path).expect("to open");
        fs::rename(&path, folder.path().join("other")).expect("to rename");
        fs::copy(folder.path().join("other"), &path).expect("to copy");
        check_unchanged(&path, &moved, "old").expect_err("another file");
        assert_eq!(read(&path).expect("to read"), "old");
        assert_eq!(names(&folder).len(), 2, "{:?}", names(&folder));
    }

    #[test]
    fn pipes_devices_folders_and_large_files_are_rejected_without_blocking() {
        let folder = folder();
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a pipe");
        for path in [pipe.as_path(), folder.path(), Path::new("/dev/zero")] {
            for refused in [read(path).map(drop), replace(path, "", "new")] {
                assert!(refused.is_err_and(|e| e.to_string() == "not a regular file"));
            }
        }
        // The file became a pipe between the check and the opening.
        assert!(open(&pipe).is_err_and(|e| e.to_string() == "not a regular file"));
        let large = file(&folder, 0o600);
        let hollow = File::options().write(true).open(&large).expect("to open");
        hollow.set_len(LARGEST + 1).expect("to grow");
        for refused in [read(&large).map(drop), replace(&large, "", "new")] {
            assert!(refused.is_err_and(|e| e.to_string().contains("64 MB")));
        }
    }
}
