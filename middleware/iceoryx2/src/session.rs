//! What the ports of one component share: the node, its configuration, and what is still on its way.

use crate::cleanup::{CleanupThread, DeadNodes};
use crate::incomplete_files::{CREATION, IncompleteFileRemover};
use crate::membership::Membership;
use crate::service::{Node, PendingResponse, Service};
use crate::{bounded, names};
use iceoryx2::prelude::{
    Config, FileName, LogLevel, NodeBuilder, NodeName, Path, SemanticString, SignalHandlingMode,
    set_log_level,
};
use rc_middleware::qos::{MAX_PUBLISHERS, MAX_READERS};
use rc_middleware::{Environment, OpenError};
use std::fmt::Debug;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

/// How often the node is tried, in which half-made files may be in the way.
const ATTEMPTS: u32 = 4;
/// How long a value that was published needs to reach those who subscribe: a subscriber maps a new piece of shared
/// memory only when it receives the first value in it, and finds it gone if the publisher is. 1 ms was enough in 30
/// of 30 tries on an idle machine.
const SETTLE: Duration = Duration::from_millis(100);

/// How long an opening cleans up at a time, before it tries again.
const ROUND: Duration = Duration::from_secs(2);

/// A request that was sent and not yet handled.
pub(crate) type PendingCommand = Arc<Mutex<Option<PendingResponse>>>;

/// What the ports of one component share.
pub(crate) struct Session {
    pub(crate) environment: Environment,
    pub(crate) config: Config,
    pub(crate) node: Node,
    published: Mutex<Option<Instant>>,
    commands: Mutex<Vec<Weak<Mutex<Option<PendingResponse>>>>>,
    dead_nodes: DeadNodes,
    /// Ended before the remover of incomplete files: a clean-up can wait for a half-made file.
    cleaner: CleanupThread,
    /// Ended after everything above.
    _incomplete_files: IncompleteFileRemover,
    /// Left after everything above.
    _membership: Membership,
}

impl Session {
    /// Makes the node.
    pub(crate) fn open(environment: &Environment) -> Result<Arc<Self>, OpenError> {
        set_log_level(LogLevel::Fatal);
        let owned = environment.clone();
        let session = bounded::run(&environment.directory, &environment.network, move || {
            let refused = |reason: String| OpenError::Backend {
                address: owned.network.clone(),
                reason,
            };
            let config = configuration(&owned).map_err(refused)?;
            let membership = Membership::join(&owned.directory, &config).map_err(|e| {
                refused(format!(
                    "the network cannot be entered: {e}; remove by hand what is in the way"
                ))
            })?;
            let root = names::root(&owned.directory);
            private(&root).map_err(|e| refused(format!("{}: {e}", root.display())))?;
            let incomplete_files = IncompleteFileRemover::start(&owned.directory)
                .map_err(|e| refused(format!("no thread for its files: {e}")))?;
            let dead_nodes = DeadNodes::of(&owned.directory, &config);
            let cleaner = CleanupThread::start(dead_nodes.clone())
                .map_err(|e| refused(format!("no thread for what the dead leave: {e}")))?;
            let node = node(&owned, &config).map_err(refused)?;
            let session = Self {
                environment: owned,
                config,
                node,
                published: Mutex::default(),
                commands: Mutex::default(),
                dead_nodes,
                cleaner,
                _incomplete_files: incomplete_files,
                _membership: membership,
            };
            Ok(Arc::new(session))
        })?;
        // Where it takes too long, it goes on beside what comes now, and is no failure.
        let own = Arc::clone(&session);
        let _ = bounded::run(&environment.directory, &environment.network, move || {
            Ok(own.clean())
        });
        Ok(session)
    }

    /// Removes what the dead left behind, for an opening: it may take some seconds. Says how many dead there were.
    pub(crate) fn clean(&self) -> usize {
        let end = Instant::now() + ROUND;
        let (gone, all) = self.dead_nodes.clean(|| Instant::now() < end);
        if !all {
            self.cleaner.wake();
        }
        gone
    }

    /// Has what the dead left behind removed, and does not wait for it.
    pub(crate) fn request_cleanup(&self) {
        self.cleaner.wake();
    }

    /// Notes that a value was published, for `linger`.
    pub(crate) fn note_published(&self) {
        *lock(&self.published) = Some(Instant::now());
    }

    /// Where a client keeps its last command until it is handled, for `linger`.
    pub(crate) fn command(&self) -> PendingCommand {
        let slot = PendingCommand::default();
        let mut commands = lock(&self.commands);
        commands.retain(|slot| slot.strong_count() > 0);
        commands.push(Arc::downgrade(&slot));
        slot
    }

    /// Waits until what was published has settled and each command was handled, at most `limit`.
    pub(crate) fn linger(&self, limit: Duration) {
        let end = Instant::now() + limit;
        let settled = lock(&self.published).map_or_else(Instant::now, |at| at + SETTLE);
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

/// Locks; what is guarded here is whole even after a panic.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads no file: without a configuration of its own a node reads `./config/iceoryx2.toml`.
fn configuration(environment: &Environment) -> Result<Config, String> {
    let root = names::root(&environment.directory);
    let says = |error: &dyn Debug| format!("{} as its root: {error:?}", root.display());
    let mut config = Config::default();
    let path = Path::new(root.as_os_str().as_bytes()).map_err(|e| says(&e))?;
    config.global.set_root_path(&path);
    config.global.prefix =
        FileName::new(names::prefix(&environment.directory).as_bytes()).map_err(|e| says(&e))?;
    config.global.creation_timeout = CREATION;
    // Who cleans does it alone, see [`open_lock`].
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    // Room for what ends that are gone have left unread, 2 to 6 kB each; the default is 128 everywhere.
    config
        .defaults
        .publish_subscribe
        .subscriber_expired_connection_buffer = 2 * MAX_PUBLISHERS;
    config
        .defaults
        .request_response
        .server_expired_connection_buffer = MAX_READERS;
    config
        .defaults
        .request_response
        .client_expired_connection_buffer = 4;
    Ok(config)
}

/// Makes the folder, for this user alone; refuses one of another user.
fn private(root: &std::path::Path) -> std::io::Result<()> {
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(root)?;
    let found = std::fs::symlink_metadata(root)?;
    if found.is_dir() && found.uid() == rustix::process::getuid().as_raw() {
        Ok(())
    } else {
        Err(std::io::Error::other("not a folder of this user"))
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
            // It has waited by itself for what is half made.
            Err(_) if attempt < ATTEMPTS => attempt += 1,
            Err(error) => {
                return Err(format!(
                    "iceoryx2 makes no node: {error:?}; {}",
                    bounded::recovery_hint(&environment.directory)
                ));
            }
        }
    }
}
