//! Changes the code in small ways, one at a time, and counts the changes that no test notices.
//!
//! `cargo-mutants` makes the changes. It is installed below the target folder. A run takes a sample
//! of all changes, spread over all files, which the seed chooses. The tests run in a sandbox.

mod sandbox;

use crate::outcome;
use crate::tools::{installed, target};
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// The version of `cargo-mutants`.
const VERSION: &str = "27.1.0";
/// The files whose code is changed.
const FILES: [&str; 5] = [
    "middleware/src/**/*.rs",
    "runtime/management/src/**/*.rs",
    "deploy/src/supervisor/**/*.rs",
    "deploy/src/guard/**/*.rs",
    "pdsl/configuration/src/**/*.rs",
];
/// The default number of changes in a run.
const COUNT: usize = 60;
/// Tests that run whole networks or other tools: they take minutes, or need programs of other
/// packages.
const SKIPPED: [&str; 15] = [
    "every_command_runs",
    "the_page_of_commands_is_up_to_date",
    "the_picture_of_the_machine_is_up_to_date",
    "each_command_has_a_man_page_and_both_list_the_exit_codes",
    "files_equal_their_goldens",
    "network::",
    "hosts::",
    "inner_model::",
    "mixed::",
    "patrol::",
    "python_programs::",
    "python_worker::",
    "remote::",
    "time::",
    "a_mismatched_endpoint_that_joins_later",
];
/// The least share of changes that tests must notice, in percent.
const GOAL: usize = 90;

/// The results of `cargo-mutants`: one text for each change.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Score {
    /// A test failed, or ran without end.
    pub(crate) caught: usize,
    /// No test failed.
    pub(crate) survivors: Vec<String>,
    /// The change did not compile.
    pub(crate) unviable: usize,
}

impl Score {
    /// Reads the results of `cargo-mutants` in its folder.
    pub(crate) fn read(folder: &Path) -> std::io::Result<Self> {
        let lines = |name: &str| -> std::io::Result<Vec<String>> {
            match fs::read_to_string(folder.join("mutants.out").join(name)) {
                Ok(text) => Ok(text.lines().map(str::to_owned).collect()),
                Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
                Err(error) => Err(error),
            }
        };
        Ok(Self {
            caught: lines("caught.txt")?.len() + lines("timeout.txt")?.len(),
            survivors: lines("missed.txt")?,
            unviable: lines("unviable.txt")?.len(),
        })
    }

    /// The share of the viable changes that tests notice, in percent, rounded down.
    pub(crate) fn percent(&self) -> usize {
        let all = self.caught + self.survivors.len();
        (self.caught * 100).checked_div(all).unwrap_or(100)
    }
}

/// `cargo xtask mutants [--count N] [--seed S] [--file GLOB]…`
pub(crate) fn run(args: &[&str]) -> Result<(), String> {
    let number = |name: &str, default: usize| match args.iter().position(|arg| *arg == name) {
        None => Ok(default),
        Some(at) => {
            let number = args.get(at + 1).and_then(|text| text.parse().ok());
            number.ok_or_else(|| format!("expected a number after `{name}`"))
        }
    };
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let count = number("--count", COUNT)?.max(1);
    let seed = number("--seed", now.map_or(0, |since| since.as_secs() as usize))?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (sandbox, program) = match (sandbox::words(), installed("cargo-mutants", VERSION)) {
        (Ok(sandbox), Ok(program)) => (sandbox, program),
        (Err(why), _) => {
            println!("skipped: mutants: changed code could harm this machine: {why}");
            return Ok(());
        }
        (_, Err(why)) => {
            println!("skipped: mutants: {why}");
            return Ok(());
        }
    };
    if args.last() == Some(&"--file") {
        return Err("expected a glob after `--file`".into());
    }
    let chosen: Vec<&str> = args
        .windows(2)
        .filter(|pair| pair[0] == "--file")
        .map(|pair| pair[1])
        .collect();
    let files = if chosen.is_empty() {
        &FILES[..]
    } else {
        &chosen
    };
    let files: Vec<&str> = files.iter().flat_map(|file| ["--file", *file]).collect();
    let all = Command::new(&program)
        .args(["mutants", "--list"])
        .args(&files)
        .current_dir(&root)
        .output()
        .map_err(|error| format!("{} cannot be started: {error}", program.display()))?;
    let all = String::from_utf8_lossy(&all.stdout).lines().count();
    let shards = all.div_ceil(count).max(1);
    let shard = format!("{}/{shards}", seed % shards);
    println!("{all} changes; --count {count} --seed {seed} is the shard {shard}");
    let target = target();
    let output = target.join("mutants");
    let mut command = Command::new(&program);
    command
        .args(["mutants", "--shard", &shard, "--sharding", "round-robin"])
        // Some tests need a feature, which they have in the test run by other crates.
        .args([
            "--no-shuffle",
            "--all-features",
            "--minimum-test-timeout",
            "60",
        ])
        .args(["--cargo-arg=--config", "--cargo-arg"])
        .arg(sandbox::setting(&sandbox))
        .arg("--output")
        .arg(&output)
        .args(&files)
        .args(["--", "--"])
        .args(SKIPPED.iter().flat_map(|name| ["--skip", name]))
        // The libraries of others are compiled once for all runs.
        .env("CARGO_TARGET_DIR", output.join("target"))
        .current_dir(&root);
    let status = command
        .status()
        .map_err(|error| format!("{} cannot be started: {error}", program.display()))?;
    // 0: all were caught; 2: some were missed; 3: some ran too long.
    if !matches!(status.code(), Some(0 | 2 | 3)) {
        return outcome(&["mutants"], Ok(status));
    }
    let score = Score::read(&output).map_err(|error| error.to_string())?;
    for survivor in &score.survivors {
        println!("survived: {survivor}");
    }
    let (percent, viable) = (score.percent(), score.caught + score.survivors.len());
    println!(
        "{percent} % of {viable} viable changes were noticed; {} could not be compiled",
        score.unviable
    );
    if percent < GOAL {
        return Err(format!("fewer than {GOAL} % of the changes were noticed"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files of `mutants.out` as version 27.1.0 of cargo-mutants wrote them, for a crate with a
    /// function that has a test and one that has none.
    const RECORDED: [(&str, &str); 4] = [
        (
            "caught.txt",
            "src/lib.rs:1:33: replace tested -> bool with true\n\
             src/lib.rs:1:33: replace tested -> bool with false\n\
             src/lib.rs:1:35: replace > with == in tested\n\
             src/lib.rs:1:35: replace > with < in tested\n\
             src/lib.rs:1:35: replace > with >= in tested\n",
        ),
        (
            "missed.txt",
            "src/lib.rs:2:35: replace untested -> bool with true\n\
             src/lib.rs:2:35: replace untested -> bool with false\n",
        ),
        (
            "timeout.txt",
            "src/lib.rs:3:20: replace next -> u32 with 0\n",
        ),
        ("unviable.txt", ""),
    ];

    #[test]
    fn undetected_mutants_are_listed() {
        let folder = std::env::temp_dir().join(format!("rc-mutants-{}", std::process::id()));
        let out = folder.join("mutants.out");
        fs::create_dir_all(&out).expect("a folder");
        for (name, text) in RECORDED {
            fs::write(out.join(name), text).expect("written");
        }
        let score = Score::read(&folder).expect("the results");
        // A change with which a test runs without end is noticed.
        assert_eq!((score.caught, score.unviable), (6, 0));
        assert_eq!(
            score.survivors,
            [
                "src/lib.rs:2:35: replace untested -> bool with true",
                "src/lib.rs:2:35: replace untested -> bool with false"
            ]
        );
        assert_eq!(score.percent(), 75);
        fs::remove_dir_all(folder).expect("it is ours");
    }

    #[test]
    fn a_run_without_results_has_the_full_score() {
        let score = Score::read(Path::new("/nowhere")).expect("no results");
        assert_eq!((score.percent(), score), (100, Score::default()));
    }
}
