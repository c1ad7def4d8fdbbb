//! A bound for what the library may never end.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Longest that ends may take to be made; it is a matter of milliseconds.
const LIMIT: Duration = Duration::from_secs(20);

/// Makes ends with the library.
///
/// Where that takes too long, the process ends with exit code 3, as one that has lost its
/// middleware: two threads of the library and the one that makes an end may wait for each other for
/// ever (`rustdds` 0.15.1: `Discovery::add_local_writer` sends to a full channel while it reads
/// what was discovered, its receiver wants to read that, and both are behind who wants to write). A
/// goodbye would wait for the same threads.
pub(crate) fn bounded<T>(make: impl FnOnce() -> T) -> Result<T, String> {
    within(LIMIT, make)
}

fn within<T>(limit: Duration, make: impl FnOnce() -> T) -> Result<T, String> {
    let (done, end) = channel::<()>();
    let guard = std::thread::Builder::new()
        .name("rc-ros2-bound".to_owned())
        .spawn(move || {
            if end.recv_timeout(limit) == Err(RecvTimeoutError::Timeout) {
                tracing::error!(
                    "ROS 2 cannot be joined: rustdds has waited for itself for {limit:?}, as it may where very many components are found at once. Start this component anew"
                );
                std::process::exit(3);
            }
        })
        .map_err(|error| format!("a thread cannot be started: {error}"))?;
    let made = make();
    drop(done);
    let _ = guard.join();
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// Says to a process of this program that it is the one that hangs.
    const HANGS: &str = "RC_ROS2_TEST_HANGS";

    #[test]
    fn what_is_made_in_time_is_given() {
        assert_eq!(within(LIMIT, || 7), Ok(7));
    }

    #[test]
    fn what_never_ends_ends_the_process() {
        if std::env::var_os(HANGS).is_some() {
            let _ = within(Duration::from_millis(10), || std::thread::sleep(LIMIT));
            return;
        }
        let program = std::env::current_exe().expect("this program");
        let status = Command::new(program)
            .args(["--exact", "bound::tests::what_never_ends_ends_the_process"])
            .env(HANGS, "")
            .status()
            .expect("a process");
        assert_eq!(status.code(), Some(3));
    }
}
