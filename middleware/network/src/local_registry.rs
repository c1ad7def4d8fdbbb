//! The endpoints of a network on this machine.
//!
//! Discovery over a network takes time and never reports that it is complete. A component that
//! sends at its start would lose messages. On one machine, the run directory lists all endpoints:
//! each one registers with a file that stays locked while its process lives, and that contains its
//! identity and the peers it has discovered. A component that opens an endpoint reads the other
//! registrations, rejects mismatched ones, and waits until both sides have discovered each other.
//! The last process that leaves removes the folder.

use crate::endpoint_info::{fnv, hex};
use crate::{EndpointInfo, EndpointKind, Guid, Identity};
use rc_middleware::qos::Contract;
use rustix::fs::{FlockOperation, flock};
use std::fs::{DirBuilder, File};
use std::io::{self, Read};
use std::os::unix::fs::{DirBuilderExt, FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Longest registration that is read: the owner, and as many peers as there can be.
const LONGEST: u64 = 64 * 1024;
/// Longest wait for one other component that opens endpoints.
const LOCK_LIMIT: Duration = Duration::from_secs(10);
/// Longest wait of an endpoint that leaves for a component that opens or leaves.
const LEAVE_LIMIT: Duration = Duration::from_secs(if cfg!(test) { 60 } else { 1 });
/// Longest wait for all that come first, each within its limit.
const QUEUE_LIMIT: Duration = Duration::from_mins(2);
/// Whether the last endpoint of this process that left has waited without effect: the next ones do
/// not wait.
static GAVE_UP: AtomicBool = AtomicBool::new(false);
/// The file that a component locks while it opens endpoints.
const LOCK: &str = "turn";
/// Pause between two attempts.
const LOCK_PAUSE: Duration = Duration::from_millis(2);

/// The registrations of one domain.
#[derive(Clone, Debug)]
pub struct LocalRegistry {
    directory: PathBuf,
}

/// The registration of an endpoint whose process is alive.
#[derive(Clone, Debug)]
pub struct Registration {
    /// The identity of the endpoint.
    pub guid: Guid,
    /// Announcement, equal to that in its user data.
    pub info: EndpointInfo,
    /// The quality of service that it offers or requests.
    pub contract: Contract,
    /// The endpoints that it has found.
    pub found: Vec<Guid>,
}

/// The registration of an endpoint of this process. Dropping it removes the registration.
#[derive(Debug)]
pub struct RegistrationGuard {
    guid: Guid,
    file: File,
    path: PathBuf,
    /// Where in the file the found endpoints begin, and where they end.
    begin: u64,
    end: u64,
}

/// Held while endpoints are opened: only one component of this machine opens endpoints at a time.
#[derive(Debug)]
pub struct OpenLock {
    file: File,
    directory: PathBuf,
}

/// Removes the folder if no endpoint is registered in it.
impl Drop for OpenLock {
    fn drop(&mut self) {
        remove_if_empty(&self.directory, &self.file);
    }
}

impl LocalRegistry {
    /// The registry of `domain` in the folder of this backend. The first endpoint creates it, so a
    /// component that ends before it has one leaves nothing.
    pub fn new(folder: &Path, domain: u32) -> Self {
        Self {
            directory: folder.join(domain.to_string()),
        }
    }

    fn make_directory(&self) -> io::Result<()> {
        let mut builder = DirBuilder::new();
        builder.recursive(true).mode(0o700).create(&self.directory)
    }

    /// Waits until no other component opens endpoints; fails if one does for ten seconds.
    pub fn open_lock(&self) -> io::Result<OpenLock> {
        let path = self.directory.join(LOCK);
        let end = Instant::now() + QUEUE_LIMIT;
        let mut deadline = Instant::now() + LOCK_LIMIT;
        let mut holder = None;
        loop {
            match lock(&path, true) {
                Ok(Some(file)) => {
                    // It shows those that wait that another one holds the lock.
                    file.set_modified(SystemTime::now())?;
                    let directory = self.directory.clone();
                    return Ok(OpenLock { file, directory });
                }
                Ok(None) => {}
                // There is no endpoint yet, or the last one has left.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    match self.make_directory() {
                        // The last endpoint has removed the parent folder meanwhile.
                        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                        _ => {}
                    }
                }
                Err(error) => return Err(error),
            }
            let since = std::fs::metadata(&path).and_then(|file| file.modified());
            let since = since.ok();
            if since != holder {
                holder = since;
                deadline = end.min(Instant::now() + LOCK_LIMIT);
            }
            if Instant::now() >= deadline {
                return Err(io::Error::new(
                    io::ErrorKind::TimedOut,
                    "another component has been opening a connection for too long",
                ));
            }
            std::thread::sleep(LOCK_PAUSE);
        }
    }

    /// Registers an endpoint of this process. The caller holds the [`OpenLock`].
    pub fn register(&self, guid: &Guid, endpoint: &Identity) -> io::Result<RegistrationGuard> {
        let Identity {
            topic,
            kind,
            info,
            contract,
        } = endpoint;
        let name = format!("{}.{}", file_prefix(topic, *kind), hex(guid));
        let path = self.directory.join(&name);
        let hidden = self.directory.join(format!("new.{name}"));
        let file = File::options()
            .create(true)
            .truncate(true)
            .write(true)
            .open(&hidden)?;
        let text = format!("{info}\n{contract}\n");
        let written = flock(&file, FlockOperation::NonBlockingLockExclusive)
            .map_err(io::Error::from)
            .and_then(|()| file.write_all_at(text.as_bytes(), 0))
            .and_then(|()| std::fs::rename(&hidden, &path));
        if let Err(error) = written {
            let _ = std::fs::remove_file(&hidden);
            return Err(error);
        }
        let begin = text.len() as u64;
        Ok(RegistrationGuard {
            guid: *guid,
            file,
            path,
            begin,
            end: begin,
        })
    }

    /// The endpoints that have registered, as they are now.
    pub(crate) fn listing(&self) -> Listing<'_> {
        let entries = std::fs::read_dir(&self.directory).into_iter().flatten();
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        Listing {
            registry: self,
            names: names.collect(),
        }
    }

    /// The endpoints of `kind` at `topic` whose processes are alive.
    pub fn registrations(&self, topic: &str, kind: EndpointKind) -> Vec<Registration> {
        self.listing().registrations(topic, kind)
    }
}

/// The names of the registrations of one moment: reading them takes more time than all else where
/// many components wait for each other.
#[derive(Debug)]
pub(crate) struct Listing<'a> {
    registry: &'a LocalRegistry,
    names: Vec<String>,
}

impl Listing<'_> {
    /// The endpoints of `kind` at `topic` whose processes are alive. It removes the registrations
    /// of dead processes.
    pub(crate) fn registrations(&self, topic: &str, kind: EndpointKind) -> Vec<Registration> {
        let prefix = file_prefix(topic, kind);
        let mut registrations = Vec::new();
        for name in &self.names {
            let rest = name.strip_prefix(&prefix);
            if let Some(guid) = rest.and_then(|rest| parse_guid(rest.strip_prefix('.')?)) {
                registrations.extend(read(&self.registry.directory.join(name), guid));
            }
        }
        registrations
    }
}

impl RegistrationGuard {
    /// The identity of the endpoint.
    pub fn guid(&self) -> Guid {
        self.guid
    }

    /// Adds a peer that this endpoint has found. `here`: all peers that are there now, which
    /// replace the list when it gets too long.
    pub fn add_found<'a>(
        &mut self,
        other: &Guid,
        here: impl Iterator<Item = &'a Guid>,
    ) -> io::Result<()> {
        let line = |guid: &Guid| format!("{}\n", hex(guid));
        let mut text = line(other);
        if self.end + text.len() as u64 > LONGEST {
            text = here.map(line).collect();
            self.file.set_len(self.begin)?;
            self.end = self.begin;
        }
        self.file.write_all_at(text.as_bytes(), self.end)?;
        self.end += text.len() as u64;
        Ok(())
    }
}

/// Removes the registration, and the folder with the last one.
impl Drop for RegistrationGuard {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
        let Some(directory) = self.path.parent() else {
            return;
        };
        let patience = if GAVE_UP.load(Ordering::Relaxed) {
            Duration::ZERO
        } else {
            LEAVE_LIMIT
        };
        let deadline = Instant::now() + patience;
        // The holder of the lock may have seen this registration, and leaves the folder.
        loop {
            match lock(&directory.join(LOCK), false) {
                Ok(Some(file)) => {
                    GAVE_UP.store(false, Ordering::Relaxed);
                    return remove_if_empty(directory, &file);
                }
                Ok(None) if Instant::now() < deadline => std::thread::sleep(LOCK_PAUSE),
                // Another process is stopped while it holds the lock.
                Ok(None) => return GAVE_UP.store(true, Ordering::Relaxed),
                // Another process has removed the folder.
                Err(_) => return,
            }
        }
    }
}

/// Locks the file at `path`; `None` if another process has locked it, or has just removed it.
fn lock(path: &Path, create: bool) -> io::Result<Option<File>> {
    let mut options = File::options();
    options.create(create).truncate(false).write(true);
    let file = options.open(path)?;
    if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
        return Ok(None);
    }
    let own = file.metadata()?;
    let is_there = std::fs::metadata(path)
        .is_ok_and(|there| (there.dev(), there.ino()) == (own.dev(), own.ino()));
    Ok(is_there.then_some(file))
}

/// Removes the folder, and the one for all domains, if no process that is alive has registered.
/// The caller has locked the file.
fn remove_if_empty(directory: &Path, _lock: &File) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        if entry.file_name() == LOCK {
            continue;
        }
        let is_alive = match File::open(&path) {
            Ok(file) => flock(&file, FlockOperation::NonBlockingLockShared).is_err(),
            // A process without free descriptors cannot find out.
            Err(error) => error.kind() != io::ErrorKind::NotFound,
        };
        if is_alive {
            return;
        }
        let _ = std::fs::remove_file(path);
    }
    let _ = std::fs::remove_file(directory.join(LOCK));
    let _ = std::fs::remove_dir(directory);
    let _ = directory.parent().map(std::fs::remove_dir);
}

/// A topic can be longer than the name of a file.
fn file_prefix(topic: &str, kind: EndpointKind) -> String {
    let kind = match kind {
        EndpointKind::Writer => 'w',
        EndpointKind::Reader => 'r',
    };
    format!("{:016x}.{kind}", fnv(topic))
}

fn read(path: &Path, guid: Guid) -> Option<Registration> {
    let file = File::open(path).ok()?;
    if flock(&file, FlockOperation::NonBlockingLockShared).is_ok() {
        // Its owner has ended.
        let _ = std::fs::remove_file(path);
        return None;
    }
    let mut text = String::new();
    file.take(LONGEST).read_to_string(&mut text).ok()?;
    let mut lines = text.lines();
    let info = EndpointInfo::parse(lines.next()?.as_bytes())?;
    let contract = Contract::parse(lines.next()?)?;
    let found = lines.filter_map(parse_guid).collect();
    Some(Registration {
        guid,
        info,
        contract,
        found,
    })
}

fn parse_guid(text: &str) -> Option<Guid> {
    let number = u128::from_str_radix(text, 16).ok()?;
    (text.len() == 32).then(|| number.to_be_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Role;
    use rc_middleware::TypeIdentity;
    use rc_middleware::qos::Qos;

    /// A process that leaves holds the lock, and has seen the other one; no further process follows
    /// them.
    #[test]
    fn endpoints_that_leave_together_leave_nothing() {
        let folder = std::env::temp_dir().join(format!("rc-leaving-{}", std::process::id()));
        let registry = LocalRegistry::new(&folder, 7);
        let open = registry.open_lock().expect("the lock");
        let last = registry.register(&[1; 16], &writer()).expect("to register");
        drop(open);
        let lock = lock(&registry.directory.join(LOCK), false).expect("a folder");
        let lock = lock.expect("no other process has locked it");
        let path = last.path.clone();
        let other = std::thread::spawn(move || {
            while path.exists() {
                std::thread::sleep(LOCK_PAUSE);
            }
            std::thread::sleep(10 * LOCK_PAUSE);
            drop(lock);
        });
        drop(last);
        other.join().expect("it leaves");
        assert!(!folder.exists());
    }

    fn writer() -> Identity {
        Identity {
            topic: "a/b".to_owned(),
            kind: EndpointKind::Writer,
            info: EndpointInfo {
                role: Role::Publisher,
                types: TypeIdentity {
                    name: "A::B".to_owned(),
                    hash: 1,
                },
                instance: "one".to_owned(),
                pid: 2,
                host: "here".to_owned(),
            },
            contract: Contract {
                deadline: Some(Duration::from_millis(20)),
                ..Contract::from(&Qos::PUBLISHER)
            },
        }
    }

    #[test]
    fn a_registration_exists_while_its_owner_lives() {
        let folder = std::env::temp_dir().join(format!("rc-registry-{}", std::process::id()));
        let registry = LocalRegistry::new(&folder, 7);
        let endpoint = writer();
        let lock = registry.open_lock().expect("the lock");
        let own = registry.register(&[1; 16], &endpoint);
        let mut own = own.expect("to register");
        drop(lock);
        own.add_found(&[2; 16], std::iter::empty())
            .expect("to write");
        let writers = |topic| registry.registrations(topic, EndpointKind::Writer);
        let found = writers("a/b");
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].info, endpoint.info);
        assert_eq!(found[0].guid, [1; 16]);
        assert_eq!(found[0].contract, endpoint.contract);
        assert_eq!(found[0].found, [[2; 16]]);
        assert!(writers("a/c").is_empty());
        let readers = registry.registrations("a/b", EndpointKind::Reader);
        assert!(readers.is_empty());
        // Thousands come and go; the list always holds those that are there.
        for number in 0..5000_u128 {
            let newest = number.to_be_bytes();
            own.add_found(&newest, [[2; 16], newest].iter())
                .expect("to write");
            if number % 100 == 0 || number > 4900 {
                let found = &writers("a/b")[0].found;
                assert!(found.contains(&[2; 16]) && found.contains(&newest));
            }
        }
        // A process that was killed leaves an unlocked file.
        let left = own.path.with_extension("00000000000000000000000000000009");
        std::fs::copy(&own.path, &left).expect("to copy");
        assert_eq!(writers("a/b").len(), 1);
        assert!(!left.exists());
        // One that was killed does not keep the folder; one that lives does.
        std::fs::copy(&own.path, &left).expect("to copy");
        let lock = registry.open_lock().expect("the lock");
        let second = registry.register(&[3; 16], &endpoint).expect("to register");
        drop(lock);
        drop(own);
        assert_eq!(writers("a/b").len(), 1);
        drop(second);
        assert!(!folder.exists(), "the last one removes the folder");
        // A registry that was opened before creates the folder again.
        let lock = registry.open_lock().expect("the lock");
        let third = registry.register(&[4; 16], &endpoint).expect("to register");
        drop(lock);
        assert_eq!(writers("a/b").len(), 1);
        drop(third);
        drop(registry.open_lock().expect("the lock"));
        assert!(!folder.exists(), "no endpoint is registered");
    }
}
