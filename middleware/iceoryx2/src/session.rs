//! The state that all ports of one component share: the node, its configuration, and undelivered
//! messages.

use crate::bounded;
use crate::cleanup::{CleanupThread, DeadNodes};
use crate::configuration::configuration;
use crate::incomplete_files::IncompleteFileRemover;
use crate::membership::{Membership, private};
use crate::mutex::lock;
use crate::names::Storage;
use crate::ports::{Node, PendingResponse, Service};
use iceoryx2::prelude::{
    Config, LogLevel, NodeBuilder, NodeName, SignalHandlingMode, set_log_level,
};
use rc_middleware::{Environment, OpenError, now};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

/// Attempts to create the node, which incomplete files may obstruct.
const ATTEMPTS: u32 = 4;
/// Time that a sample needs to reach the subscribers. A subscriber maps a new segment of shared
/// memory when it receives the first sample in it, and fails if the publisher has ended. 1 ms was
/// enough in 30 of 30 runs on an idle machine.
const SETTLE: Duration = Duration::from_millis(100);

/// Longest wait for a clean-up before an opening is tried again.
const ROUND: Duration = Duration::from_secs(2);

/// The last command of a client, until the server has handled it.
pub(crate) type PendingCommand = Arc<Mutex<Option<PendingResponse>>>;

/// The shared state of the ports of one component.
pub(crate) struct Session {
    pub(crate) environment: Environment,
    pub(crate) place: Storage,
    pub(crate) config: Config,
    pub(crate) node: Node,
    /// Time of the last publication in nanoseconds of the monotonic clock; 0 for none.
    published: AtomicU64,
    commands: Mutex<Vec<Weak<Mutex<Option<PendingResponse>>>>>,
    dead_nodes: DeadNodes,
    /// Dropped before the remover of incomplete files: a clean-up can wait for an incomplete file.
    cleaner: CleanupThread,
    /// Dropped after everything above.
    _incomplete_files: IncompleteFileRemover,
    /// Dropped after everything above.
    _membership: Arc<Membership>,
}

impl Session {
    /// Joins the network and creates the node.
    pub(crate) fn open(environment: &Environment) -> Result<Arc<Self>, OpenError> {
        set_log_level(LogLevel::Fatal);
        let owned = environment.clone();
        bounded::run(&environment.directory, &environment.network, move || {
            let refused = |reason: String| OpenError::Backend {
                address: owned.network.clone(),
                reason,
            };
            let (membership, place) = Membership::join(&owned.directory).map_err(|e| {
                refused(format!(
                    "the network cannot be joined: {e}; remove by hand what is in the way"
                ))
            })?;
            let config = configuration(&place).map_err(refused)?;
            let root = &place.root;
            private(root).map_err(|e| refused(format!("{}: {e}", root.display())))?;
            let incomplete_files = IncompleteFileRemover::start(&place)
                .map_err(|e| refused(format!("no thread for incomplete files: {e}")))?;
            let dead_nodes = DeadNodes::of(&place, &config);
            let cleaner = CleanupThread::start(dead_nodes.clone())
                .map_err(|e| refused(format!("no thread for clean-ups: {e}")))?;
            let node = node(&owned, &config).map_err(refused)?;
            let session = Self {
                environment: owned,
                place,
                config,
                node,
                published: AtomicU64::new(0),
                commands: Mutex::default(),
                dead_nodes,
                cleaner,
                _incomplete_files: incomplete_files,
                _membership: membership,
            };
            Ok(Arc::new(session))
        })
    }

    /// Waits until all dead processes are cleaned up: it may take some seconds. Returns the number
    /// of nodes removed.
    pub(crate) fn clean(&self) -> usize {
        let end = Instant::now() + ROUND;
        let (gone, all) = self.dead_nodes.clean(|_| Instant::now() < end);
        if !all {
            self.cleaner.wake();
        }
        gone
    }

    /// Waits until all dead processes are cleaned up, while `goes_on` returns true.
    pub(crate) fn clean_while(&self, goes_on: &mut dyn FnMut(Option<&str>) -> bool) {
        self.dead_nodes.clean(goes_on);
    }

    /// Waits until some dead processes are cleaned up, for an opening that failed and can then try
    /// again. Returns the number of nodes removed; 0: there are none left, or it takes too long.
    pub(crate) fn clean_some(&self) -> usize {
        let end = Instant::now() + ROUND;
        let (gone, all) = self.dead_nodes.clean_some(|_| Instant::now() < end);
        if !all {
            self.cleaner.wake();
        }
        gone
    }

    /// Requests a clean-up and returns at once.
    pub(crate) fn request_cleanup(&self) {
        self.cleaner.wake();
    }

    /// Notes the time of a publication, for `linger`: `sent` of its header, or now if that is 0.
    pub(crate) fn note_published(&self, sent: u64) {
        let time = if sent == 0 { now() } else { sent };
        self.published.store(time, Ordering::Relaxed);
    }

    /// A place for the last command of a client, which `linger` awaits.
    pub(crate) fn command(&self) -> PendingCommand {
        let slot = PendingCommand::default();
        let mut commands = lock(&self.commands);
        commands.retain(|slot| slot.strong_count() > 0);
        commands.push(Arc::downgrade(&slot));
        slot
    }

    /// Waits until published samples have settled and all commands are handled, at most for
    /// `limit`.
    pub(crate) fn linger(&self, limit: Duration) {
        let end = Instant::now() + limit;
        let since = now().saturating_sub(self.published.load(Ordering::Relaxed));
        let settled = Instant::now() + SETTLE.saturating_sub(Duration::from_nanos(since));
        loop {
            let now = Instant::now();
            if now >= end || (now >= settled && !self.commands_waiting()) {
                return;
            }
            std::thread::sleep(Duration::from_millis(1).min(end - now));
        }
    }

    fn commands_waiting(&self) -> bool {
        lock(&self.commands).iter().any(|slot| {
            slot.upgrade().is_some_and(|slot| {
                lock(&slot)
                    .as_ref()
                    .is_some_and(PendingResponse::is_connected)
            })
        })
    }
}

fn node(environment: &Environment, config: &Config) -> Result<Node, String> {
    let name = NodeName::new(&environment.instance)
        .map_err(|error| format!("`{}` as its name: {error:?}", environment.instance))?;
    let mut attempt = 1;
    loop {
        let made = NodeBuilder::new()
            .config(config)
            .name(&name)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>();
        match made {
            Ok(node) => return Ok(node),
            // iceoryx2 has waited for incomplete files.
            Err(_) if attempt < ATTEMPTS => attempt += 1,
            Err(error) => {
                return Err(format!(
                    "iceoryx2 cannot create a node: {error:?}; {}",
                    bounded::recovery_hint(&environment.directory)
                ));
            }
        }
    }
}
