//! Removes the resources of dead nodes: their places in services, their shared memory, their files.
//!
//! For each dead node iceoryx2 lists all shared memory several times, so that the time grows with
//! the number of the dead and the size of the network. One process of a network cleans up at a time
//! ([`LeaderLock`]) for all that wait ([`crate::rounds`]). It lets openings run after every
//! [`BATCH`] (see [`open_lock`]). A caller with a deadline, such as a client that finds its server
//! dead, wakes the clean-up thread of its session instead.

use crate::leader::LeaderLock;
use crate::names::Storage;
use crate::nodes::{self, Dead};
use crate::rounds::{RoundCounter, Rounds};
use crate::{open_lock, port_tags};
use iceoryx2::node::NodeView as _;
use iceoryx2::prelude::Config;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Pause after a round that removed nothing, which limits the rate of rounds.
const PAUSE: Duration = Duration::from_millis(20);
/// Time between the start of a process and its first clean-up, so that processes that start
/// together share one.
const JOIN_PAUSE: Duration = Duration::from_millis(200);
/// How long a clean-up blocks openings at a time. One dead node takes some milliseconds.
const BATCH: Duration = Duration::from_millis(20);
/// Pauses of a process that waits for another one's round, from the first to the longest.
const WAITS: [Duration; 2] = [Duration::from_millis(2), Duration::from_millis(20)];

/// The dead nodes of one network.
#[derive(Clone)]
pub(crate) struct DeadNodes {
    config: Config,
    root: PathBuf,
}

impl DeadNodes {
    pub(crate) fn of(place: &Storage, config: &Config) -> Self {
        Self {
            config: config.clone(),
            root: place.root.clone(),
        }
    }

    /// The clean-ups so far.
    fn rounds(&self) -> Rounds {
        RoundCounter::of(&self.root).read()
    }

    /// Waits until all nodes that are dead now are cleaned up, or does it, while `goes_on` returns
    /// true. `goes_on` receives the name of each node that this process removes. Returns how many
    /// nodes were removed meanwhile, whichever process removed them, and whether the round was
    /// completed.
    pub(crate) fn clean(&self, goes_on: impl FnMut(Option<&str>) -> bool) -> (usize, bool) {
        self.clean_since(self.rounds(), goes_on, |_| false)
    }

    /// Cleans until some nodes were removed, for an opening that tries again then.
    pub(crate) fn clean_some(&self, goes_on: impl FnMut(Option<&str>) -> bool) -> (usize, bool) {
        self.clean_since(self.rounds(), goes_on, |removed| removed > 0)
    }

    /// Waits for a round that began after the counters were `before`, or until `suffices` returns
    /// true for the number of nodes removed since then.
    fn clean_since(
        &self,
        before: Rounds,
        mut goes_on: impl FnMut(Option<&str>) -> bool,
        suffices: impl Fn(u64) -> bool,
    ) -> (usize, bool) {
        let counter = RoundCounter::of(&self.root);
        let mut leader = LeaderLock::new(&self.root.join("cleaning.lock"));
        let [mut pause, longest] = WAITS;
        loop {
            let now = counter.read();
            let removed = now.removed.saturating_sub(before.removed);
            let is_complete = now.completed > before.begun;
            if is_complete || suffices(removed) || !goes_on(None) {
                return (removed as usize, is_complete);
            }
            if leader.is_leader() {
                // Another process may have completed a round since the counters were read.
                if counter.read().completed > before.begun {
                    leader.resign();
                    continue;
                }
                let removed = || counter.read().removed.saturating_sub(before.removed);
                let mut goes_on = |name: Option<&str>| goes_on(name) && !suffices(removed());
                let is_complete = self.round(&mut leader, &counter, &mut goes_on);
                leader.resign();
                if is_complete {
                    let removed = counter.read().removed.saturating_sub(before.removed);
                    return (removed as usize, true);
                }
            } else {
                std::thread::sleep(pause);
                pause = (pause * 2).min(longest);
            }
        }
    }

    /// Cleans up after all nodes that are dead now. Returns whether it was completed.
    fn round(
        &self,
        leader: &mut LeaderLock,
        counter: &RoundCounter,
        goes_on: &mut impl FnMut(Option<&str>) -> bool,
    ) -> bool {
        // Without counters, which need a writable root, each process works for itself.
        let number = counter.begin().ok();
        // Components restart in the order of their first start, so the oldest node goes first.
        let mut dead = nodes::dead(&self.config);
        dead.sort_by_key(|node| nodes::age(*node.id()));
        let mut dead = dead.into_iter().peekable();
        let mut patience = open_lock::TIMEOUT;
        while dead.peek().is_some() {
            let lock = open_lock::exclusive(&self.root, patience);
            if !lock.is_held() {
                // A process was stopped while it opened an endpoint. It was waited for once.
                patience = open_lock::OPENING_WINDOW;
            }
            let end = Instant::now() + BATCH;
            let mut removed = 0;
            let mut is_stopped = false;
            while Instant::now() < end
                && !is_stopped
                && let Some(node) = dead.next()
            {
                let name = node.details().as_ref().map(|node| node.name().to_string());
                let is_removed = self.remove(node);
                removed += u64::from(is_removed);
                leader.is_leader();
                is_stopped = !goes_on(name.as_deref().filter(|_| is_removed));
            }
            port_tags::discard_backups(&self.root);
            drop(lock);
            let _ = counter.note(removed, None);
            if dead.peek().is_some() {
                if is_stopped || !goes_on(None) {
                    return false;
                }
                std::thread::sleep(open_lock::OPENING_WINDOW);
            }
        }
        let _ = counter.note(0, number);
        true
    }

    /// Returns whether this process has removed the node. The caller holds the lock.
    fn remove(&self, node: Dead) -> bool {
        // A process can be in several networks, and iceoryx2 refuses to remove two nodes at a time
        // in one process.
        static REMOVAL: Mutex<()> = Mutex::new(());
        port_tags::back_up(&self.root, &[node.id().value()]);
        let _one_at_a_time = REMOVAL.lock().unwrap_or_else(PoisonError::into_inner);
        node.try_remove_stale_resources().is_ok()
    }
}

/// A thread that cleans up some time after its start and after each [`CleanupThread::wake`]. Ends
/// when this value is dropped.
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
            let mut since = dead_nodes.rounds();
            let mut woken_by = woken.recv_timeout(JOIN_PAUSE);
            while woken_by != Err(RecvTimeoutError::Disconnected) {
                let (gone, _) = dead_nodes.clean_since(since, |_| goes_on(), |_| false);
                if gone == 0 && goes_on() {
                    std::thread::sleep(PAUSE);
                }
                woken_by = woken.recv().map_err(|_| RecvTimeoutError::Disconnected);
                since = dead_nodes.rounds();
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
