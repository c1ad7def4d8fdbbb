//! Waits for writes in folders.

use rustix::fs::inotify;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Notices when a file in some folders is made or written (inotify(7)).
#[derive(Debug)]
pub struct DirectoryWatch {
    watch: OwnedFd,
    /// Device and number of each folder.
    folders: Vec<(u64, u64)>,
}

impl DirectoryWatch {
    /// Watches a folder.
    pub fn new(directory: &Path) -> io::Result<Self> {
        Self::of([directory])
    }

    /// Watches several folders.
    pub fn of<'p>(directories: impl IntoIterator<Item = &'p Path>) -> io::Result<Self> {
        let flags = inotify::CreateFlags::CLOEXEC | inotify::CreateFlags::NONBLOCK;
        let watch = inotify::init(flags)?;
        let events = inotify::WatchFlags::MODIFY | inotify::WatchFlags::CREATE;
        let mut folders = Vec::new();
        for directory in directories {
            inotify::add_watch(&watch, directory, events)?;
            folders.push(number(directory)?);
        }
        Ok(Self { watch, folders })
    }

    /// Whether this folder is one of those that are watched. A folder that was removed and made again
    /// is another one.
    pub fn is_current(&self, directory: &Path) -> bool {
        number(directory).is_ok_and(|number| self.folders.contains(&number))
    }

    /// Becomes readable when a file in a folder is made or written.
    pub fn descriptor(&self) -> &OwnedFd {
        &self.watch
    }

    /// Takes all notifications that have come.
    pub fn drain(&self) {
        let mut buffer = [MaybeUninit::uninit(); 4096];
        while let Ok(filled) = rustix::io::read(&self.watch, &mut buffer) {
            if filled.0.is_empty() {
                return;
            }
        }
    }
}

/// Device and number of a folder.
fn number(directory: &Path) -> io::Result<(u64, u64)> {
    let found = std::fs::metadata(directory)?;
    Ok((found.dev(), found.ino()))
}
