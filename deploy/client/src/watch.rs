//! Waits for writes in folders.

use rustix::fs::inotify;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::path::Path;

/// Notices when a file in some folders is made or written (inotify(7)).
#[derive(Debug)]
pub struct DirectoryWatch(OwnedFd);

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
        for directory in directories {
            inotify::add_watch(&watch, directory, events)?;
        }
        Ok(Self(watch))
    }

    /// Becomes readable when a file in a folder is made or written.
    pub fn descriptor(&self) -> &OwnedFd {
        &self.0
    }

    /// Takes all notifications that have come.
    pub fn drain(&self) {
        let mut buffer = [MaybeUninit::uninit(); 4096];
        while let Ok(filled) = rustix::io::read(&self.0, &mut buffer) {
            if filled.0.is_empty() {
                return;
            }
        }
    }
}
