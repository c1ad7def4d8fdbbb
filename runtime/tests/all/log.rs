//! Which lines a component logs, by level and `RUST_LOG`.

use rc_management::lines::{Line, Lines, Overlong};
use rc_management::link::ComponentMessage;
use std::fs::File;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(15);

/// Log of a component from its start to its end.
fn log(level: Option<&str>, rust_log: Option<&str>) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("log");
    let (link, theirs) = UnixStream::pair().expect("a pair");
    link.set_read_timeout(Some(LIMIT)).expect("a limit");
    let mut child = Command::new(env!("CARGO_BIN_EXE_rc-test-component"))
        .args(["--network", "n", "--name", "quiet"])
        .args(level.iter().flat_map(|level| ["--log", level]))
        .env_remove("RUST_LOG")
        .envs(rust_log.map(|text| ("RUST_LOG", text)))
        .env("RC_SUPERVISED", "1")
        .env("XDG_RUNTIME_DIR", folder.path())
        .stdin(Stdio::from(OwnedFd::from(theirs)))
        .stderr(File::create(&file).expect("a file"))
        .spawn()
        .expect("it starts");
    let mut lines = Lines::new(Overlong::Skip);
    let is_ready =
        |line: &[u8]| matches!(ComponentMessage::decode(line), Ok(ComponentMessage::Ready));
    let start = Instant::now();
    loop {
        let (read, ended) = lines.read(&link);
        assert!(!ended, "it ended before it was ready");
        assert!(start.elapsed() < LIMIT, "it does not get ready");
        if read.iter().filter_map(Line::bytes).any(is_ready) {
            break;
        }
    }
    // Without its supervisor it ends.
    drop(link);
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > LIMIT {
            let _ = child.kill();
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    std::fs::read_to_string(file).expect("a log")
}

#[test]
fn rust_log_sets_the_level_unless_the_command_line_does() {
    for (level, rust_log, logs_debug) in [
        (None, None, false),
        (None, Some(""), false),
        (None, Some("debug"), true),
        (None, Some("rc_runtime=debug,info"), true),
        (None, Some("other_module=debug,info"), false),
        (Some("info"), Some("debug"), false),
        (Some("debug"), Some("error"), true),
    ] {
        let log = log(level, rust_log);
        let debug = log.contains("DEBUG stopping");
        assert_eq!(debug, logs_debug, "{level:?} {rust_log:?}: {log}");
        assert!(!log.contains("RUST_LOG"), "{log}");
    }
    let log = log(None, Some("other=loud"));
    assert!(log.contains("warning: RUST_LOG has no effect"), "{log}");
    assert!(!log.contains("DEBUG"), "{log}");
}
