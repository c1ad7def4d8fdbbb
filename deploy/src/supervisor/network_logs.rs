//! The logs of a network: shown while they grow, cut into parts, and kept away from a full disk.

use crate::log::relay::Relay;
use crate::log::reporter::Reporter;
use crate::log::rotation::{self, Rotation};
use crate::supervisor::options::Options;
use rc_deploy_client::error::{Error, ErrorContext};
use rc_files::{Disk, DiskChange};
use std::collections::BTreeMap;
use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The logs of one network, in one folder.
pub(super) struct NetworkLogs {
    /// Shows what components print, if somebody looks.
    relay: Option<Relay>,
    rotation: Rotation,
    /// The disk of the recordings next to the logs, if there are some.
    pub(super) recordings: Option<Disk>,
}

impl NetworkLogs {
    /// The logs of the components by their names, and others, which are not shown.
    pub(super) fn new(
        directory: &Path,
        components: &BTreeMap<&str, &Path>,
        others: impl IntoIterator<Item = PathBuf>,
        recordings: Option<Disk>,
        options: &Options,
    ) -> Result<Self, Error> {
        let named = components.iter();
        let named = named.map(|(name, log)| ((*name).to_owned(), (*log).to_owned()));
        let relay = options.relay.then(|| Relay::new(directory, named));
        let relay = relay.transpose().context("follow the logs")?;
        let limit = options.log_limit.unwrap_or(rotation::LIMIT);
        let all = components.values().map(|log| (*log).to_owned());
        let all = all.chain(others).collect();
        Ok(Self {
            relay,
            rotation: Rotation::new(directory, all, limit).context("watch the logs")?,
            recordings,
        })
    }

    pub(super) fn directory(&self) -> &Path {
        self.rotation.directory()
    }

    /// Becomes readable when a log has grown that is shown.
    pub(super) fn shown(&self) -> Option<&OwnedFd> {
        self.relay.as_ref().and_then(Relay::descriptor)
    }

    /// Becomes readable when a log has grown.
    pub(super) fn grown(&self) -> Option<&OwnedFd> {
        self.rotation.descriptor()
    }

    pub(super) fn wake_shown(&mut self) {
        if let Some(relay) = &mut self.relay {
            relay.wake();
        }
    }

    pub(super) fn wake_grown(&mut self) {
        self.rotation.wake();
    }

    pub(super) fn deadline(&self) -> Option<Instant> {
        let relay = self.relay.as_ref().and_then(Relay::deadline);
        relay.into_iter().chain(self.rotation.deadline()).min()
    }

    /// Shows what components have printed.
    pub(super) fn show(&mut self, now: Instant, report: &Reporter) {
        if let Some(relay) = &mut self.relay {
            relay.show(now, report);
        }
    }

    /// Cuts logs that are too long. Returns whether their disk has become full, or has room again.
    pub(super) fn check(&mut self, now: Instant, report: &Reporter) -> Option<DiskChange> {
        self.rotation.check(now, report)
    }

    /// Whether the disk of the logs has become full, or has room again.
    pub(super) fn check_disk(&mut self) -> Option<DiskChange> {
        self.rotation.check_disk()
    }

    /// Whether recordings end because their disk becomes full, or may begin again; and how many
    /// bytes they keep free.
    pub(super) fn check_recordings(&mut self) -> Option<(DiskChange, u64)> {
        let disk = self.recordings.as_mut()?;
        let change = disk.look(Disk::free(self.rotation.directory()).ok()?)?;
        Some((change, disk.floor()))
    }

    /// Makes the folder again where somebody has removed it. Returns whether it was removed.
    pub(super) fn restore(&mut self) -> io::Result<bool> {
        let is_new = self.rotation.restore()?;
        if let Some(relay) = &mut self.relay {
            relay.restore(self.rotation.directory())?;
        }
        Ok(is_new)
    }

    /// Shows the rest.
    pub(super) fn finish(&mut self, report: &Reporter) {
        if let Some(relay) = &mut self.relay {
            relay.finish(report);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn logs(directory: &Path, recordings: Option<Disk>) -> NetworkLogs {
        let log = directory.join("a.log");
        let components = BTreeMap::from([("a", &*log)]);
        let others = [directory.join("guard.log")];
        let options = Options::default();
        NetworkLogs::new(directory, &components, others, recordings, &options).expect("logs")
    }

    #[test]
    fn recordings_end_once_when_their_disk_has_too_little_room() {
        let directory = tempfile::tempdir().expect("a folder");
        let mut logs = logs(directory.path(), Some(Disk::new(u64::MAX)));
        let change = logs.check_recordings();
        assert!(
            matches!(change, Some((DiskChange::Full { .. }, u64::MAX))),
            "{change:?}"
        );
        assert_eq!(logs.check_recordings().map(|(_, floor)| floor), None);
        logs.recordings = None;
        assert!(logs.check_recordings().is_none(), "nothing is recorded");
    }

    #[test]
    fn a_folder_that_was_removed_is_made_again() {
        let parent = tempfile::tempdir().expect("a folder");
        let directory = parent.path().join("logs");
        std::fs::create_dir(&directory).expect("a folder");
        let mut logs = logs(&directory, None);
        assert!(!logs.restore().expect("it is there"));
        std::fs::remove_dir_all(&directory).expect("removed");
        assert!(logs.restore().expect("a folder"));
        assert!(directory.is_dir() && !logs.restore().expect("it is there"));
    }
}
