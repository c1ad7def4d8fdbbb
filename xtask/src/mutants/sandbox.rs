//! Sandbox of the tests of changed code. A changed supervisor may start processes without end, fill
//! the disk, or signal the wrong process.
//!
//! Each test program has a PID namespace of its own: it sees no other process of the machine, and
//! the kernel ends everything in the namespace with its first process. Temporary files, run
//! directories, logs and shared memory are in one file system of limited size, which ends with the
//! namespace, too.

use std::process::Command;

/// Exit code of a program that was stopped because it exceeded a limit.
#[cfg(test)]
const STOPPED: i32 = 125;

/// The options of `unshare`, with the privileges of root and without.
const WAYS: [&[&str]; 2] = [
    &["--mount", "--pid", "--kill-child", "--mount-proc"],
    &[
        "--map-root-user",
        "--mount",
        "--pid",
        "--kill-child",
        "--mount-proc",
    ],
];

/// Runs its arguments as a child of the first process, with limits. The limits of the kernel for
/// the number of processes do not hold for root, so they are counted. `unshare` passes on no
/// SIGTERM, with which cargo-mutants stops tests that run too long.
const SCRIPT: &str = r#"
mount -t tmpfs -o size=1g,nr_inodes=200k,mode=1777 tmpfs /dev/shm || exit 125
export TMPDIR=/dev/shm/tmp XDG_RUNTIME_DIR=/dev/shm/run XDG_STATE_HOME=/dev/shm/state
mkdir -m 700 "$TMPDIR" "$XDG_RUNTIME_DIR" "$XDG_STATE_HOME" || exit 125
ulimit -c 0 && ulimit -f 1048576 && ulimit -v 16777216 || exit 125
trap "exit 125" TERM
"$@" &
program=$!
while sleep 1; do
    set -- /proc/[0-9]*
    if [ $# -gt 400 ]; then
        echo "the tests are stopped: they have more than 400 processes" >&2
        kill -TERM $$
    fi
done &
wait $program
"#;

/// The words before a command that runs it there. The error says why that is not possible.
pub(super) fn words() -> Result<Vec<String>, String> {
    let mut why = String::new();
    for way in WAYS {
        let words: Vec<String> = [&["unshare"], way, &["sh", "-c", SCRIPT, "sh"]]
            .concat()
            .into_iter()
            .map(str::to_owned)
            .collect();
        match Command::new(&words[0])
            .args(&words[1..])
            .arg("true")
            .output()
        {
            Ok(output) if output.status.success() => return Ok(words),
            Ok(output) => why = String::from_utf8_lossy(&output.stderr).trim().into(),
            Err(error) => why = format!("unshare cannot be started: {error}"),
        }
    }
    Err(why)
}

/// The setting of cargo that makes it run test programs there.
pub(super) fn setting(words: &[String]) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("'''{word}'''")).collect();
    format!("target.'cfg(unix)'.runner=[{}]", words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use std::process::Output;
    use std::time::{Duration, Instant};

    /// Runs a script in the sandbox. `None` if the system has no sandbox.
    fn run(script: &str) -> Option<Output> {
        let words = match words() {
            Ok(words) => words,
            Err(why) => {
                eprintln!("skipped: the sandbox of mutants: {why}");
                return None;
            }
        };
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).args(["sh", "-c", script]);
        Some(command.output().expect("it runs"))
    }

    #[test]
    fn nothing_is_left_of_a_program() {
        let begun = Instant::now();
        let script = "setsid sleep 600 & touch $TMPDIR/left; echo $TMPDIR/left; exit 7";
        // The output ends with the last process that holds it.
        let Some(output) = run(script) else { return };
        assert!(begun.elapsed() < Duration::from_mins(5));
        assert_eq!(output.status.code(), Some(7));
        let left = String::from_utf8(output.stdout).expect("text");
        assert!(left.ends_with("/left\n") && !Path::new(left.trim()).exists());
    }

    #[test]
    fn a_program_with_too_many_processes_is_stopped() {
        let script = "for i in $(seq 500); do sleep 600 & done; wait";
        let Some(output) = run(script) else { return };
        assert_eq!(output.status.code(), Some(STOPPED), "{output:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("more than 400 processes"));
    }

    #[test]
    fn a_program_can_fill_its_own_files_only() {
        let script = "head -c 600M /dev/zero > $TMPDIR/large";
        let Some(output) = run(script) else { return };
        assert!(!output.status.success(), "a file exceeds its limit");
        let script = "for i in 1 2 3; do head -c 400M /dev/zero > $TMPDIR/$i || exit 9; done";
        let Some(output) = run(script) else { return };
        assert_eq!(output.status.code(), Some(9), "{output:?}");
    }

    #[test]
    fn cargo_reads_the_setting() {
        let words = ["a b".to_owned(), "c \"$@\"\n".to_owned()];
        assert_eq!(
            setting(&words),
            "target.'cfg(unix)'.runner=['''a b''', '''c \"$@\"\n''']"
        );
    }
}
