//! The notice board of a network on this machine.
//!
//! Discovery over a network takes its time, and nobody can say when it has found all: a component that publishes or
//! calls as soon as it runs would not be heard. On one machine the run directory knows who is there. Each end hangs out
//! a notice, a file that is locked as long as its owner lives: who it is, and whom it has found. Who opens an end reads
//! the notices of the others, refuses what does not fit, and waits until both have found each other.

use crate::Guid;
use crate::endpoint_info::{EndpointInfo, QosContract, fnv, hex};
use rustix::fs::{FlockOperation, flock};
use std::fs::{DirBuilder, File};
use std::io::{self, Read};
use std::os::unix::fs::{DirBuilderExt, FileExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest notice that is read: the owner, and as many peers as there can be.
const LONGEST: u64 = 64 * 1024;
/// How long another opening of the same topic is waited for.
const LOCK_LIMIT: Duration = Duration::from_secs(10);
const LOCK_PAUSE: Duration = Duration::from_millis(2);

/// The notices of one domain.
#[derive(Clone, Debug)]
pub struct LocalRegistry {
    directory: PathBuf,
}

/// A notice of somebody who is alive.
#[derive(Clone, Debug)]
pub struct Registration {
    /// The end.
    pub guid: Guid,
    /// Who it is.
    pub info: EndpointInfo,
    /// What it offers or asks for.
    pub contract: QosContract,
    /// Whom it has found.
    pub found: Vec<Guid>,
}

/// An own notice; it goes when this does.
#[derive(Debug)]
pub struct RegistrationGuard {
    file: File,
    path: PathBuf,
    /// Where those begin that it has found, and where they end.
    begin: u64,
    end: u64,
}

/// Held while an end is opened, so that of two servers one is first.
#[derive(Debug)]
pub struct OpenLock {
    _file: File,
}

impl LocalRegistry {
    /// The board of `domain` in the folder of this backend.
    pub fn open(folder: &Path, domain: u32) -> io::Result<Self> {
        let directory = folder.join(domain.to_string());
        DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&directory)?;
        Ok(Self { directory })
    }

    /// Waits for its turn to open an end.
    pub fn open_lock(&self) -> io::Result<OpenLock> {
        let path = self.directory.join("turn");
        let file = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(path)?;
        let deadline = Instant::now() + LOCK_LIMIT;
        while flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
            if Instant::now() >= deadline {
                return Err(io::Error::new(
                    io::ErrorKind::TimedOut,
                    "another component has been opening a connection for too long",
                ));
            }
            std::thread::sleep(LOCK_PAUSE);
        }
        Ok(OpenLock { _file: file })
    }

    /// Hangs out the notice of an end. `key` names the topic; `OpenLock` has to be held.
    pub fn post(
        &self,
        key: &str,
        guid: &Guid,
        sends: bool,
        info: &EndpointInfo,
        contract: &QosContract,
    ) -> io::Result<RegistrationGuard> {
        let name = format!("{}.{}", file_prefix(key, sends), hex(guid));
        let path = self.directory.join(&name);
        let hidden = self.directory.join(format!("new.{name}"));
        let file = File::options()
            .create(true)
            .truncate(true)
            .write(true)
            .open(&hidden)?;
        let text = format!("{info}\n{contract}\n");
        let posted = flock(&file, FlockOperation::NonBlockingLockExclusive)
            .map_err(io::Error::from)
            .and_then(|()| file.write_all_at(text.as_bytes(), 0))
            .and_then(|()| std::fs::rename(&hidden, &path));
        if let Err(error) = posted {
            let _ = std::fs::remove_file(&hidden);
            return Err(error);
        }
        let begin = text.len() as u64;
        Ok(RegistrationGuard {
            file,
            path,
            begin,
            end: begin,
        })
    }

    /// The notices at a topic of those who are alive: of those who send, and of those who receive. What the dead left is
    /// taken down.
    pub fn registrations(&self, key: &str, sending: bool, receiving: bool) -> Vec<Registration> {
        let entries = std::fs::read_dir(&self.directory)
            .into_iter()
            .flatten()
            .flatten();
        let mut prefixes = vec![(true, sending), (false, receiving)];
        prefixes.retain(|(_, wanted)| *wanted);
        let prefixes: Vec<_> = prefixes
            .iter()
            .map(|(sends, _)| file_prefix(key, *sends))
            .collect();
        let mut registrations = Vec::new();
        for entry in entries {
            let name = entry.file_name();
            let Some(name) = name.to_str() else { continue };
            for prefix in &prefixes {
                let rest = name.strip_prefix(prefix);
                if let Some(guid) = rest.and_then(|rest| parse_guid(rest.strip_prefix('.')?)) {
                    registrations.extend(read(&entry.path(), guid));
                }
            }
        }
        registrations
    }
}

impl RegistrationGuard {
    /// Notes that this end has found another one. `here` are all that are there: a notice does not grow for ever.
    pub fn found<'a>(
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

impl Drop for RegistrationGuard {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// A topic can be longer than the name of a file.
fn file_prefix(key: &str, sends: bool) -> String {
    format!("{:016x}.{}", fnv(key), if sends { 'w' } else { 'r' })
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
    let contract = QosContract::parse(lines.next()?)?;
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
    use crate::endpoint_info::Role;
    use rc_middleware::TypeIdentity;

    #[test]
    fn a_notice_hangs_as_long_as_its_owner_lives() {
        let folder = std::env::temp_dir().join(format!("rc-registry-{}", std::process::id()));
        let registry = LocalRegistry::open(&folder, 7).expect("a registry");
        let info = EndpointInfo {
            role: Role::Publisher,
            types: TypeIdentity {
                name: "A::B".to_owned(),
                hash: 1,
            },
            instance: "one".to_owned(),
            pid: 2,
            host: "here".to_owned(),
        };
        let contract = QosContract {
            reliable: true,
            deadline: Some(Duration::from_millis(20)),
            ..QosContract::default()
        };
        let open_lock = registry.open_lock().expect("the open lock");
        let posted = registry.post("a/b", &[1; 16], true, &info, &contract);
        let mut posted = posted.expect("to post");
        drop(open_lock);
        posted.found(&[2; 16], std::iter::empty()).expect("to note");
        let registrations = registry.registrations("a/b", true, true);
        assert_eq!(registrations.len(), 1);
        assert_eq!(registrations[0].info, info);
        assert_eq!(registrations[0].guid, [1; 16]);
        assert_eq!(registrations[0].contract, contract);
        assert_eq!(registrations[0].found, [[2; 16]]);
        assert!(registry.registrations("a/c", true, true).is_empty());
        // Thousands come and go, and who is there now is always on it.
        for number in 0..5000_u128 {
            let newest = number.to_be_bytes();
            posted
                .found(&newest, [[2; 16], newest].iter())
                .expect("to note");
            if number % 100 == 0 || number > 4900 {
                let found = &registry.registrations("a/b", true, true)[0].found;
                assert!(found.contains(&[2; 16]) && found.contains(&newest));
            }
        }
        // As a process that was killed leaves it.
        let left = posted
            .path
            .with_extension("00000000000000000000000000000009");
        std::fs::copy(&posted.path, &left).expect("to copy");
        assert_eq!(registry.registrations("a/b", true, true).len(), 1);
        assert!(!left.exists());
        drop(posted);
        assert!(registry.registrations("a/b", true, true).is_empty());
        std::fs::remove_dir_all(&folder).expect("to remove");
    }
}
