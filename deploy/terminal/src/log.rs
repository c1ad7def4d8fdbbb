//! The log that is shown, as it grows.

use super::model::{LOG, Page};
use super::session::{FRAME, Pending, Session};
use rc_deploy_client::DirectoryWatch;
use rc_deploy_client::Follower;
use std::path::PathBuf;
use std::time::Instant;

/// The log that is shown.
pub(super) struct Log {
    name: String,
    path: PathBuf,
    pub(super) watch: Option<DirectoryWatch>,
    follower: Option<Follower>,
    /// When to look again, where something was written.
    pub(super) due: Option<Instant>,
}

impl Session<'_> {
    /// Opens the log that is to be shown, and reads what has come.
    pub(super) fn follow_log(&mut self, now: Instant) {
        let selected = self.model.component();
        let wanted = selected.filter(|_| self.model.page == Page::Log);
        let Some((name, path)) = wanted.map(|c| (c.status.name.clone(), c.status.log.clone()))
        else {
            self.log = None;
            if self.model.page == Page::Parameters && self.model.parameters.is_none() {
                let name = self.model.selected.clone();
                let asked = self.components.get(&name);
                if asked.is_some_and(|p| !p.pending().any(|a| matches!(a, Pending::Parameters))) {
                    self.show_parameters(&name);
                }
            }
            return;
        };
        if self.log.as_ref().is_none_or(|log| log.name != name) {
            let watch = path
                .parent()
                .and_then(|folder| DirectoryWatch::new(folder).ok());
            let (name, due) = (name, Some(now));
            self.model.log.clear();
            self.log = Some(Log {
                name,
                path,
                watch,
                follower: None,
                due,
            });
        }
        let Some(log) = self
            .log
            .as_mut()
            .filter(|log| log.due.is_some_and(|due| now >= due))
        else {
            return;
        };
        log.due = None;
        let lines = match &mut log.follower {
            Some(follower) => {
                let (lines, more) = follower.read();
                log.due = more.then(|| now + FRAME);
                lines
            }
            None => match Follower::at_last_lines(&log.path, LOG) {
                Ok((lines, follower)) => {
                    log.follower = Some(follower);
                    lines
                }
                Err(error) => vec![format!("{}: {error}", log.path.display())],
            },
        };
        if !lines.is_empty() {
            self.model.log_lines(lines);
            self.changed = true;
        }
    }
}
