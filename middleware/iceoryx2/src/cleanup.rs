//! Removes the resources of dead nodes: their places in services, their shared memory, their files.
//!
//! For each dead node iceoryx2 lists all shared memory several times; on a busy machine 40 dead
//! nodes take seconds. A process therefore cleans up after one dead node at a time and lets
//! openings run in between (see
//! [`open_lock`]). A caller with a deadline, such as a client that finds its server dead, wakes the
//! clean-up thread of its session instead.

use crate::nodes::{self, Dead};
use crate::{names, open_lock, port_tags};
use iceoryx2::node::{NodeCleanupFailure, NodeView as _};
use iceoryx2::prelude::Config;
use rc_middleware::RunDirectory;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Pause after a round that removed nothing, which limits the rate of rounds.
const PAUSE: Duration = Duration::from_millis(20);

/// The dead nodes of one network.
#[derive(Clone)]
pub(crate) struct DeadNodes {
    config: Config,
    root: PathBuf,
    prefix: String,
}

impl DeadNodes {
    pub(crate) fn of(directory: &RunDirectory, config: &Config) -> Self {
        Self {
            config: config.clone(),
            root: names::root(directory),
            prefix: names::prefix(directory),
        }
    }

    /// Cleans up after dead nodes while `goes_on` returns true. Returns how many of the nodes found
    /// are gone afterwards, whichever process removed them, and whether all are.
    pub(crate) fn clean(&self, goes_on: impl Fn() -> bool) -> (usize, bool) {
        let dead = nodes::dead(&self.config);
        let all = dead.len();
        let mut gone = 0;
        for node in dead {
            if !goes_on() {
                break;
            }
            gone += usize::from(self.remove(node));
        }
        (gone, gone == all)
    }

    /// Returns whether the node is gone afterwards.
    fn remove(&self, node: Dead) -> bool {
        let id = node.id().value();
        let monitor = format!("{}{id}.node_monitor", self.prefix);
        let monitor = self.root.join("nodes").join(monitor);
        let Some(lock) = open_lock::exclusive(&self.root, || monitor.exists()) else {
            return true;
        };
        port_tags::back_up(&self.root, &[id]);
        let removed = node.try_remove_stale_resources();
        port_tags::discard_backups(&self.root);
        lock.release();
        matches!(
            removed,
            Ok(()) | Err(NodeCleanupFailure::ResourcesAlreadyCleanedUp)
        )
    }
}

/// A thread that cleans up after each [`CleanupThread::wake`]. Ends when this value is dropped.
pub(crate) struct CleanupThread {
    wake: Option<SyncSender<()>>,
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl CleanupThread {
    pub(crate) fn start(dead_nodes: DeadNodes) -> io::Result<Self> {
        let (wake, woken) = sync_channel(1);
        let ended = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&ended);
        let thread = std::thread::Builder::new().name("iceoryx2-clean".to_owned());
        let thread = thread.spawn(move || {
            let goes_on = || !end.load(Ordering::Relaxed);
            while woken.recv().is_ok() {
                let (gone, _) = dead_nodes.clean(goes_on);
                if gone == 0 && goes_on() {
                    std::thread::sleep(PAUSE);
                }
            }
        })?;
        Ok(Self {
            wake: Some(wake),
            ended,
            thread: Some(thread),
        })
    }

    /// Requests a round. Returns at once.
    pub(crate) fn wake(&self) {
        if let Some(wake) = &self.wake {
            // If the channel is full, a round is already requested.
            let _ = wake.try_send(());
        }
    }
}

impl Drop for CleanupThread {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        self.wake = None;
        if let Some(thread) = self.thread.take() {
            // The thread finishes the node that it is cleaning up.
            let _ = thread.join();
        }
    }
}
