//! The free space of a disk, and when it is too little.

use rustix::fs::{FallocateFlags, StatVfs, fallocate, fstatvfs, statvfs};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};
use std::io;
use std::os::fd::AsFd;
use std::path::Path;

/// The most bytes that [`Disk::usual_floor`] keeps free.
const USUAL_FLOOR: u64 = 2 << 30;

/// Whether a disk is full: less than a floor is free, and since then there was not enough again.
#[derive(Clone, Debug)]
pub struct Disk {
    floor: u64,
    enough: u64,
    is_full: bool,
}

/// A change of a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiskChange {
    /// It has become full: so many bytes are free.
    Full {
        /// Free bytes.
        free: u64,
    },
    /// It has room again.
    Free {
        /// Free bytes.
        free: u64,
    },
}

impl Disk {
    /// A disk that is full if less than `floor` bytes are free, until twice as many are.
    pub fn new(floor: u64) -> Self {
        Self::with(floor, floor.saturating_mul(2))
    }

    /// A disk that is full if less than `floor` bytes are free, until `enough` are.
    pub fn with(floor: u64, enough: u64) -> Self {
        Self {
            floor,
            enough: enough.max(floor),
            is_full: false,
        }
    }

    /// The free bytes of the disk with this file or folder, as an ordinary user may use them.
    ///
    /// # Errors
    /// The error of the system.
    pub fn free(path: &Path) -> io::Result<u64> {
        Ok(available(&statvfs(path)?))
    }

    /// The free bytes of the disk with this open file. A disk that cannot be asked is not full.
    pub fn free_of(file: impl AsFd) -> u64 {
        fstatvfs(file).map_or(u64::MAX, |disk| available(&disk))
    }

    /// The bytes that a recorder at `path`, a file that need not exist, keeps free unless others
    /// are named: a twentieth of the disk, at most 2 GiB.
    pub fn usual_floor(path: &Path) -> u64 {
        let folder = path.parent();
        let folder = folder.filter(|folder| !folder.as_os_str().is_empty());
        let disk = statvfs(folder.unwrap_or(Path::new(".")));
        // A disk that cannot be asked is not full.
        disk.map_or(0, |disk| {
            (disk.f_blocks.saturating_mul(disk.f_frsize) / 20).min(USUAL_FLOOR)
        })
    }

    /// Reserves room on the disk for the bytes `at..at + length` of a file before they are written.
    /// The size of the file stays. If the file system cannot reserve, this does nothing.
    ///
    /// # Errors
    /// The disk or the user's share of it is full, or a file of this process must not have this
    /// size (`ulimit -f`); writing it would end the process by SIGXFSZ.
    pub fn reserve(file: impl AsFd, at: u64, length: u64) -> io::Result<()> {
        if at.saturating_add(length) > Self::largest_file() {
            return Err(Errno::FBIG.into());
        }
        match fallocate(file, FallocateFlags::KEEP_SIZE, at, length) {
            Err(error @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// The largest file that this process may write, in bytes (`ulimit -f`).
    pub fn largest_file() -> u64 {
        getrlimit(Resource::Fsize).current.unwrap_or(u64::MAX)
    }

    /// Takes the present number of free bytes. Returns whether that changes something.
    pub fn look(&mut self, free: u64) -> Option<DiskChange> {
        if !self.is_full && free < self.floor {
            self.is_full = true;
            Some(DiskChange::Full { free })
        } else if self.is_full && free >= self.enough {
            self.is_full = false;
            Some(DiskChange::Free { free })
        } else {
            None
        }
    }

    /// Whether it is full.
    pub fn is_full(&self) -> bool {
        self.is_full
    }

    /// The bytes that stay free.
    pub fn floor(&self) -> u64 {
        self.floor
    }
}

fn available(disk: &StatVfs) -> u64 {
    disk.f_bavail.saturating_mul(disk.f_frsize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_needs_more_room_to_be_free() {
        let mut disk = Disk::new(100);
        assert_eq!(disk.look(100), None);
        assert_eq!(disk.look(99), Some(DiskChange::Full { free: 99 }));
        assert_eq!(disk.look(0), None);
        assert_eq!(disk.look(199), None);
        assert!(disk.is_full());
        assert_eq!(disk.look(200), Some(DiskChange::Free { free: 200 }));
        assert!(!disk.is_full());
        assert_eq!(Disk::new(0).look(0), None, "nothing is kept free");
    }

    #[test]
    fn the_room_of_a_disk_is_in_bytes() {
        let folder = tempfile::tempdir().expect("a folder");
        let free = Disk::free(folder.path()).expect("a disk");
        let file = std::fs::File::open(folder.path()).expect("a folder");
        // Others write meanwhile.
        assert!(free.abs_diff(Disk::free_of(&file)) < free / 2);
        assert!(Disk::usual_floor(&folder.path().join("new.mcap")) <= USUAL_FLOOR);
        assert_eq!(Disk::usual_floor(Path::new("/nowhere/at all/x")), 0);
    }
}
