//! Another user of the machine: what it can see, and what it puts in the way.

use crate::processes::{Network, ask};
use rc_conformance::network::endpoint;
use rc_middleware::RunDirectory;
use std::ffi::OsStr;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::Command;

/// A user that owns nothing here, by number: `nobody` of most systems.
const OTHER: u32 = 65534;

/// Runs a program as the other user. Returns false where this user must not.
fn as_other(test: &str, program: &str, arguments: &[&OsStr]) -> bool {
    if !rustix::process::getuid().is_root() {
        let line = format!("skipped: {test}: only root can run a process of another user\n");
        print!("{line}");
        if let Some(list) = std::env::var_os("RC_TEST_SKIPPED") {
            let mut options = std::fs::File::options();
            let list = options.append(true).create(true).open(list);
            std::io::Write::write_all(&mut list.expect("a list"), line.as_bytes())
                .expect("written");
        }
        return false;
    }
    let mut command = Command::new(program);
    let output = command.args(arguments).uid(OTHER).gid(OTHER).output();
    let output = output.expect("to run");
    assert!(
        output.status.success(),
        "{program} {arguments:?}: {output:?}"
    );
    true
}

/// Prints each of its arguments that it can read, write, list or connect to, and then fails.
const TRY_TO_OPEN: &str = r#"for path in "$@"; do
    if head -c 1 "$path" || true >>"$path" || ls "$path/" || test -w "$path"; then
        echo "$path is open"
        exit 1
    fi 2>/dev/null
done"#;

/// Every file and every shared memory of a network at work.
#[test]
fn nothing_is_open_to_others() {
    let network = Network::new("op");
    let backend = network.join("client");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    let _server = network.start("server");
    let _idle = network.start("idle");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    let directory = RunDirectory::of(&network.0);
    let files = rc_iceoryx2::leftovers(&directory);
    for path in &files {
        let mode = path.metadata().expect("a file").mode() & 0o777;
        assert_eq!(mode & 0o077, 0, "{} has mode {mode:o}", path.display());
    }
    // The root, and the segments of server, clients and subscribers.
    assert!(files.len() > 5, "{files:?}");
    let script = ["-c", TRY_TO_OPEN, "sh"].map(OsStr::new);
    let paths = files.iter().map(|path| path.as_os_str());
    let paths = paths.chain([directory.path().as_os_str()]);
    let arguments: Vec<&OsStr> = script.into_iter().chain(paths).collect();
    as_other("nothing_is_open_to_others", "sh", &arguments);
}

/// Another user may know the prefix of a run that is over; the next run has another one.
#[test]
fn files_in_the_way_of_one_run_are_not_in_that_of_the_next() {
    let network = Network::new("ow");
    let directory = RunDirectory::of(&network.0);
    let (first, seen) = {
        let _backend = network.join("first");
        let server = network.start("server");
        let prefix = rc_iceoryx2::prefix(&directory).expect("a prefix");
        let seen = rc_iceoryx2::leftovers(&directory);
        drop(server);
        (prefix, seen)
    };
    // The files of the next run, if it had the same names.
    let segments = seen
        .iter()
        .filter(|path| path.parent() == Some(Path::new("/dev/shm")) && !path.exists());
    let management = format!("/dev/shm/{first}node.node_mgmt");
    let segments = segments.cloned().chain([management.into()]);
    let foreign: Vec<_> = segments.collect();
    for path in &foreign {
        if !as_other("files_in_the_way_of_one_run", "touch", &[path.as_os_str()]) {
            return;
        }
    }
    let backend = network.join("second");
    assert_ne!(rc_iceoryx2::prefix(&directory).expect("a prefix"), first);
    let _server = network.start("server");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    // They are none of its files, so it leaves them.
    let own = rc_iceoryx2::leftovers(&directory);
    assert!(foreign.iter().all(|path| !own.contains(path)), "{own:?}");
    for path in foreign {
        std::fs::remove_file(path).expect("root may");
    }
}

/// These names cannot be guessed; the test takes those that the first opening has made.
#[test]
fn a_foreign_file_that_makes_an_opening_fail_is_named_with_its_owner() {
    let network = Network::new("of");
    let backend = network.join("first");
    let motor = endpoint("default/Motor");
    let _server = backend.server(&motor).expect("a server");
    let foreign: Vec<_> = rc_iceoryx2::leftovers(&RunDirectory::of(&network.0))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|end| end == "dynamic"))
        .collect();
    assert!(!foreign.is_empty());
    for path in &foreign {
        std::fs::remove_file(path).expect("it is ours");
        let test = "a_foreign_file_that_makes_an_opening_fail";
        if !as_other(test, "touch", &[path.as_os_str()]) {
            return;
        }
    }
    let refused = network.join("second").client(&motor).err();
    let said = refused.expect("something is in its way").to_string();
    let owner = rc_middleware::user_name(OTHER);
    for path in foreign {
        let named = format!("{} belongs to user {owner}", path.display());
        assert!(said.contains(&named), "{said}");
        std::fs::remove_file(path).expect("root may");
    }
    assert!(said.contains("the network then gets other names"), "{said}");
}

#[test]
fn a_run_directory_of_another_user_is_refused_by_the_name_of_its_owner() {
    let base = tempfile::tempdir_in("/dev/shm").expect("a folder");
    // Another test of this process may have changed its umask for a moment.
    let open = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(base.path(), open).expect("to open it");
    std::os::unix::fs::chown(base.path(), Some(OTHER), Some(OTHER)).unwrap_or(());
    let robocomp = base.path().join("robocomp");
    let test = "a_run_directory_of_another_user";
    if !as_other(test, "mkdir", &[robocomp.as_os_str()]) {
        return;
    }
    let output = Command::new(std::env::current_exe().expect("this binary"))
        .args(["role", "--exact", "--nocapture", "--test-threads=1"])
        .envs([("RC_TEST_ROLE", "idle"), ("RC_TEST_NETWORK", "foreign")])
        .env("XDG_RUNTIME_DIR", base.path())
        .output()
        .expect("a process");
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    let owner = format!("belongs to user {}", rc_middleware::user_name(OTHER));
    assert!(said.contains(&owner), "{said}");
}
