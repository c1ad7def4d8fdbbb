//! Names of networks and addresses in iceoryx2.

use rc_middleware::{Address, RunDirectory};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read as _, Write as _};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::PathBuf;

/// Longest root path: a listener's socket is `ROOT/PREFIX<id>.event`, and the path of a socket has
/// at most 107 bytes. The prefix has 20 bytes, the id at most 36.
const LONGEST_ROOT: usize = 107 - 20 - 36 - 7;
/// The digits of a prefix, five bits each.
const DIGITS: &[u8; 32] = b"0123456789abcdefghijklmnopqrstuv";
/// How many digits of a prefix are a hash of the run directory's path, and how many are random.
const HASHED: u32 = 9;
const RANDOM: u32 = 7;

/// Where iceoryx2 has the files of a network.
#[derive(Clone, Debug)]
pub(crate) struct Storage {
    /// Prefix of the names of all its files and shared memory.
    pub(crate) prefix: String,
    /// Folder of its files; shared memory is elsewhere.
    pub(crate) root: PathBuf,
}

impl Storage {
    /// The place that the first process of the network has chosen; `None` before.
    pub(crate) fn find(directory: &RunDirectory) -> io::Result<Option<Self>> {
        let mut prefix = String::new();
        match File::open(file(directory)) {
            Ok(file) => file.take(64).read_to_string(&mut prefix)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        let fits = prefix.starts_with(&start(directory)) && prefix.len() == length();
        Ok(fits.then(|| Self::with(directory, prefix)))
    }

    /// Chooses a place with a name that nobody can guess, so that no other user of the machine can
    /// create a file in its way. Call it only while no other process does.
    pub(crate) fn choose(directory: &RunDirectory) -> io::Result<Self> {
        let mut random = [0; 8];
        File::open("/dev/urandom")?.read_exact(&mut random)?;
        let random = digits(u64::from_le_bytes(random), RANDOM);
        let prefix = format!("{}{random}_", start(directory));
        let path = file(directory);
        let unfinished = path.with_extension("new");
        let mut options = File::options();
        let options = options.create(true).truncate(true).write(true).mode(0o600);
        options.open(&unfinished)?.write_all(prefix.as_bytes())?;
        std::fs::rename(&unfinished, &path)?;
        Ok(Self::with(directory, prefix))
    }

    fn with(directory: &RunDirectory, prefix: String) -> Self {
        let inside = directory.middleware(crate::NAME);
        let root = if inside.as_os_str().len() <= LONGEST_ROOT {
            inside
        } else {
            PathBuf::from(format!("/dev/shm/{prefix}root"))
        };
        Self { prefix, root }
    }
}

/// Prefix of the names of all shared memory of the network. If no process has joined it yet, a
/// prefix is chosen, for a program that uses iceoryx2 without this crate.
pub fn prefix(directory: &RunDirectory) -> io::Result<String> {
    let place = match Storage::find(directory)? {
        Some(place) => place,
        None => Storage::choose(directory)?,
    };
    Ok(place.prefix)
}

/// The file that holds the prefix.
pub(crate) fn file(directory: &RunDirectory) -> PathBuf {
    directory.path().join("iceoryx2.prefix")
}

/// The first part of every prefix of the network: `rc_` and a hash of the path of its run
/// directory.
pub(crate) fn start(directory: &RunDirectory) -> String {
    let hash = fnv1a(directory.path().as_os_str().as_bytes());
    format!("rc_{}", digits(hash, HASHED))
}

fn length() -> usize {
    "rc__".len() + (HASHED + RANDOM) as usize
}

/// The lower bits of a number.
fn digits(number: u64, count: u32) -> String {
    let digit = |at: u32| char::from(DIGITS[(number >> (5 * at)) as usize % DIGITS.len()]);
    (0..count).map(digit).collect()
}

/// The publish/subscribe service of volatile publishers, and the event service of the topic.
pub(crate) fn topic(address: &Address) -> String {
    address.to_string()
}

/// The publish/subscribe service of transient-local publishers.
pub(crate) fn transient_local(address: &Address) -> String {
    format!("{address}:kept")
}

/// The event service by which late joiners request history.
pub(crate) fn late_joiners(address: &Address) -> String {
    format!("{address}:late")
}

/// The request/response service.
pub(crate) fn calls(address: &Address) -> String {
    address.to_string()
}

/// The event service that notifies the server.
pub(crate) fn server(address: &Address) -> String {
    format!("{address}:server")
}

/// The event service that notifies one client.
pub(crate) fn client(address: &Address, guid: [u8; 16]) -> String {
    let mut name = format!("{address}:client:");
    for byte in guid {
        // Writing to a String cannot fail.
        let _ = write!(name, "{byte:02x}");
    }
    name
}

/// FNV-1a, 64 bits. Source: draft-eastlake-fnv.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv1a() {
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn a_place_is_found_where_it_was_chosen_and_cannot_be_guessed() {
        let folder = std::env::temp_dir().join(format!("rc-names-{}", std::process::id()));
        let directory = RunDirectory::below(&folder, &"n".repeat(60));
        std::fs::create_dir_all(directory.path()).expect("a folder");
        assert!(Storage::find(&directory).expect("a folder").is_none());
        let first = Storage::choose(&directory).expect("a place");
        let found = Storage::find(&directory).expect("a file").expect("a place");
        assert_eq!((&first.prefix, &first.root), (&found.prefix, &found.root));
        assert_eq!(first.prefix.len(), length());
        assert!(first.root.as_os_str().len() <= LONGEST_ROOT);
        let second = Storage::choose(&directory).expect("a place");
        assert_ne!(first.prefix, second.prefix);
        assert!(second.prefix.starts_with(&start(&directory)));
        std::fs::write(file(&directory), "rc_").expect("written");
        assert!(Storage::find(&directory).expect("a file").is_none());
        std::fs::remove_dir_all(&folder).expect("it is ours");
    }
}
