//! The network of a process, and the folder in which the processes of a network find each other.

use crate::{Settings, WakeEvent};
use rc_vocabulary::shell;
use std::fs::Permissions;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// Environment of a backend: names, run directory and settings of its process.
#[derive(Clone, Debug)]
pub struct Environment {
    /// The name of the network; `default` if nothing else is configured.
    pub network: String,
    /// The name of this component in its network.
    pub instance: String,
    /// The folder of the network's sockets and service files.
    pub directory: RunDirectory,
    /// Ends calls that wait when the component stops.
    pub wake_event: WakeEvent,
    /// The settings of the middlewares.
    pub settings: Settings,
}

/// The run directory of one network: private to its user, in memory where the system has such a
/// place.
///
/// It is `robocomp/NETWORK` in `$XDG_RUNTIME_DIR`, else `robocomp-UID/NETWORK` in `/dev/shm`, else
/// in the folder for temporary files.
///
/// ```
/// use rc_middleware::RunDirectory;
/// use std::path::Path;
///
/// let directory = RunDirectory::below(Path::new("/run/user/1000/robocomp"), "patrol");
/// let socket = Path::new("/run/user/1000/robocomp/patrol/lidar.sock");
/// assert_eq!(directory.socket("lidar"), socket);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunDirectory(PathBuf);

impl RunDirectory {
    /// Opens the directory of `network`, and creates it if necessary. It fails where other users
    /// may write to the parent folder.
    pub fn open(network: &str) -> io::Result<Self> {
        Self::open_below(&base(), network, rustix::process::getuid().as_raw())
    }

    /// Opens the run directory in `base`, for a user.
    fn open_below(base: &Path, network: &str, uid: u32) -> io::Result<Self> {
        let path = base.join(network);
        let created = make_private(base).and_then(|()| make_private(&path));
        // Checked first: the folder of another user is also the reason why it cannot be created.
        if let Ok(found) = std::fs::symlink_metadata(base)
            && let Some(wrong) = not_private(&found, uid)
        {
            let Refused { reason, command } = wrong;
            let message = format!(
                "{} {reason}; write `{command} {}`, or set XDG_RUNTIME_DIR to a private folder",
                base.display(),
                shell::word(&base.to_string_lossy())
            );
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
        }
        created?;
        Ok(Self(path))
    }

    /// The directory that `open` would open.
    pub fn of(network: &str) -> Self {
        Self::below(&base(), network)
    }

    /// The directory of `network` in `base`, instead of the folder that `open` chooses.
    pub fn below(base: &Path, network: &str) -> Self {
        Self(base.join(network))
    }

    /// The networks that have a run directory.
    pub fn networks() -> Vec<String> {
        let entries = std::fs::read_dir(base()).into_iter().flatten().flatten();
        let mut names: Vec<String> = entries
            .filter_map(|e| e.file_name().into_string().ok())
            .collect();
        names.sort();
        names
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// The management socket of the component `name`.
    pub fn socket(&self, name: &str) -> PathBuf {
        self.0.join(format!("{name}.sock"))
    }

    /// The folder for the files of a middleware.
    pub fn middleware(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Removes the directory with its content. A missing directory is not an error.
    pub fn remove(&self) -> io::Result<()> {
        match std::fs::remove_dir_all(&self.0) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

/// Creates a folder for this user alone, unless it exists.
fn make_private(path: &Path) -> io::Result<()> {
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)?;
    }
    match std::fs::DirBuilder::new().mode(0o700).create(path) {
        // iceoryx2 sets the umask of the process for a moment while it makes a socket, on any
        // thread.
        Ok(()) => std::fs::set_permissions(path, Permissions::from_mode(0o700)),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        Err(error) => Err(error),
    }
}

/// Why a folder is not used, and the beginning of the command that fixes it.
struct Refused {
    reason: String,
    command: &'static str,
}

/// Why a folder is not private to a user; `None` if it is.
fn not_private(found: &std::fs::Metadata, uid: u32) -> Option<Refused> {
    let is_own = found.uid() == uid;
    let others_write = found.mode() & 0o022 != 0;
    let (reason, command) = if !found.is_dir() {
        let command = if is_own { "rm" } else { "sudo rm" };
        ("is not a folder".to_owned(), command)
    } else if !is_own {
        let owner = user_name(found.uid());
        (format!("belongs to user {owner}"), "sudo rm -r")
    } else if others_write {
        ("can be written by other users".to_owned(), "chmod go-w")
    } else {
        return None;
    };
    Some(Refused { reason, command })
}

/// The name and the number of a user, as in `mia (1001)`.
pub fn user_name(uid: u32) -> String {
    let users = std::fs::read_to_string("/etc/passwd").unwrap_or_default();
    // passwd(5): name, password, uid.
    let is = |line: &&str| line.split(':').nth(2).and_then(|id| id.parse().ok()) == Some(uid);
    match users
        .lines()
        .find(is)
        .and_then(|line| line.split(':').next())
    {
        Some(name) => format!("{name} ({uid})"),
        None => uid.to_string(),
    }
}

fn base() -> PathBuf {
    if let Some(runtime) =
        std::env::var_os("XDG_RUNTIME_DIR").filter(|dir| Path::new(dir).is_absolute())
    {
        return Path::new(&runtime).join("robocomp");
    }
    let name = format!("robocomp-{}", rustix::process::getuid().as_raw());
    let memory = Path::new("/dev/shm");
    if memory.is_dir() {
        memory.join(name)
    } else {
        std::env::temp_dir().join(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thread of the process may have changed the umask for a moment.
    #[test]
    fn a_run_directory_is_usable_under_any_umask() {
        let test = "a_folder_that_others_own_or_may_change_is_refused";
        let told = std::process::Command::new("sh")
            .args(["-c", "umask 177; exec \"$0\" --exact \"$1\""])
            .arg(std::env::current_exe().expect("this program"))
            .arg(format!("environment::tests::{test}"))
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&told.stdout).into_owned();
        assert!(said.contains("1 passed"), "{said}");
    }

    #[test]
    fn a_folder_that_others_own_or_may_change_is_refused() {
        let folder = std::env::temp_dir().join(format!("rc-run-{}", std::process::id()));
        let base = folder.join("robocomp");
        make_private(&folder).expect("a folder");
        let uid = rustix::process::getuid().as_raw();
        let open = |uid| RunDirectory::open_below(&base, "net", uid);
        let directory = open(uid).expect("a directory");
        assert_eq!(directory.path(), base.join("net"));
        let mode = |path: &Path| std::fs::metadata(path).expect("a folder").mode() & 0o7777;
        assert_eq!((mode(&base), mode(directory.path())), (0o700, 0o700));
        let refused = |result: io::Result<RunDirectory>, command: &str| {
            let error = result.expect_err("it is not private");
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied);
            let error = error.to_string();
            let command = format!("`{command} {}`", base.display());
            assert!(error.contains("XDG_RUNTIME_DIR"), "{error}");
            assert!(error.contains(&command), "{error}");
        };
        refused(open(uid + 1), "sudo rm -r");
        for others in [0o720, 0o702, 0o777] {
            std::fs::set_permissions(&base, Permissions::from_mode(others)).expect("its owner");
            refused(open(uid), "chmod go-w");
        }
        std::fs::set_permissions(&base, Permissions::from_mode(0o755)).expect("its owner");
        open(uid).expect("others may look");
        // A link leads wherever its owner wants.
        std::fs::rename(&base, folder.join("other")).expect("it can be moved");
        std::os::unix::fs::symlink(folder.join("other"), &base).expect("a link");
        refused(open(uid), "rm");
        std::fs::remove_dir_all(folder).expect("it is ours");
    }
}
