//! `cargo xtask test`: all tests of the workspace. Failed tests run once more, alone, and so do all
//! tests of a program that ended without a word.

use crate::checkout;
use crate::programs::{self, lines};
use crate::report::{Block, ENDED, Report};
use crate::timings::Timings;
use crate::{cargo, cargo_command, outcome, semver};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, ExitStatus};
use std::time::Instant;

/// If more tests fail, none is repeated: that is not noise of a busy machine.
const REPEATED: usize = 10;

/// Builds all programs, of which tests start many, then runs every test of the workspace. Both
/// select the whole workspace: dependencies have the same features then, and are compiled once.
pub(crate) fn run(rest: &[&str]) -> Result<(), String> {
    checkout::own_target()?;
    cargo(&["build", "--workspace", "--bins"])?;
    cargo(&["run", "--quiet", "--bin", "trials", "--", "variants"])?;
    let timed = rest.contains(&"--timings");
    let rest: Vec<&str> = rest.iter().copied().filter(|a| *a != "--timings").collect();
    let threads = threads();
    let list = std::env::temp_dir().join(format!("rc-skipped-{}", std::process::id()));
    let skipped_list = ("RC_TEST_SKIPPED", &*list.to_string_lossy());
    let mut timings = Timings::new(threads);
    let environment = [skipped_list, ("RUST_TEST_THREADS", &threads.to_string())];
    let mut beside = None;
    let (mut tested, report) = if rest.is_empty() {
        all(&environment, &mut timings, || {
            beside = Some((examples(), miri()));
        })?
    } else {
        let mut test = vec!["test", "--workspace", "--no-fail-fast"];
        test.extend(&rest);
        let (status, report) = follow(&test, &environment, &mut timings);
        (outcome(&test, status), report)
    };
    if timed {
        println!("the slowest tests:");
        for timing in timings.slowest(20) {
            println!("{:8.1} s  {}", timing.took.as_secs_f64(), timing.name);
        }
    }
    let mut unsteady = Vec::new();
    if tested.is_err() {
        let environment = [skipped_list, ("RUST_TEST_THREADS", "1")];
        let passed = repeat(&report, |block| {
            follow(&again(block, &rest), &environment, &mut Timings::new(1)).1
        });
        match passed {
            Ok(passed) => (unsteady, tested) = (passed, Ok(())),
            Err(lines) => unsteady = lines,
        }
    }
    let mut skipped = String::new();
    if let Some((examples, under_miri)) = beside {
        tested = tested.and(examples);
        match under_miri {
            Ok(outcome) => tested = tested.and(outcome),
            Err(why) => skipped = format!("skipped: values in place and pages under Miri: {why}\n"),
        }
    }
    // The end of the output is the place where a skipped or an unsteady test is noticed.
    print!(
        "{}{skipped}",
        std::fs::read_to_string(&list).unwrap_or_default()
    );
    let _ = std::fs::remove_file(&list);
    for line in unsteady {
        println!("{line}");
    }
    tested
}

/// Runs all test programs, as many at a time as there are processors, and one more when `beside` has run:
/// tests wait for about half of the time, and `beside` computes for all of it.
fn all(
    environment: &[(&str, &str)],
    timings: &mut Timings,
    beside: impl FnOnce() + Send,
) -> Result<(Result<(), String>, Report), String> {
    let programs = programs::build(&["test", "--workspace"])?;
    let mut report = Report::default();
    let mut failed = Vec::new();
    programs::run(
        &programs,
        processors(),
        &[],
        environment,
        beside,
        |program, output| {
            // A program that hangs is the one that began and did not end.
            let Some(output) = output else {
                println!("+ {}", program.title());
                return;
            };
            for (line, at) in &output.lines {
                println!("{line}");
                timings.note(line, *at);
                report.note(line);
            }
            timings.finish();
            if !output.succeeded {
                failed.push(program.selection().to_owned());
            }
        },
    );
    if failed.is_empty() {
        return Ok((Ok(()), report));
    }
    // As at the end of cargo's output.
    let count = format!("error: {} targets failed:", failed.len());
    let targets = failed.iter().map(|target| format!("    `{target}`"));
    for line in [count].into_iter().chain(targets) {
        println!("{line}");
        report.note(&line);
    }
    Ok((Err("tests failed".to_owned()), report))
}

/// Repeats the failed tests of a run with `run_again`, which runs those of one target. Each test
/// gets a line. If all of them pass now and nothing else failed, the run passes.
fn repeat(
    report: &Report,
    mut run_again: impl FnMut(&Block) -> Report,
) -> Result<Vec<String>, Vec<String>> {
    let failed = report.failed();
    let failed = failed.map_err(|why| vec![format!("not repeated: {why}")])?;
    let count: usize = failed.iter().map(|block| block.failed.len()).sum();
    if count > REPEATED {
        let line = format!("not repeated: {count} tests failed, more than {REPEATED}");
        return Err(vec![line]);
    }
    let mut lines = Vec::new();
    let mut all_passed = true;
    for block in failed {
        let target = block.rerun.as_deref().unwrap_or_default();
        if block.doubt == Some(ENDED) {
            // A panic while another one unwinds aborts the program: all of its tests are in doubt.
            let passed = run_again(block).passes_whole(block);
            let what = if passed { "unsteady" } else { "failed twice" };
            lines.push(format!("{what}: {target}: {ENDED}"));
            lines.extend(block.tail.iter().map(|line| format!("    {line}")));
            all_passed &= passed;
            continue;
        }
        if let Some(doubt) = block.doubt {
            lines.push(format!("not repeated: {target}: {doubt}"));
            all_passed = false;
            continue;
        }
        let second = run_again(block);
        for test in &block.failed {
            let passed = second.passes_again(block, test);
            let what = if passed { "unsteady" } else { "failed twice" };
            lines.push(format!("{what}: {target} {test}"));
            all_passed &= passed;
        }
    }
    if all_passed { Ok(lines) } else { Err(lines) }
}

/// The arguments of cargo that run the failed tests of a target again, after a run with `rest`.
///
/// They select the whole workspace again. Another selection has other features, so cargo would
/// compile dependencies, and replace programs. Targets of other packages with the same name run
/// tests of the same names, too, which is harmless.
fn again<'a>(block: &'a Block, rest: &[&'a str]) -> Vec<&'a str> {
    let (cargo, harness) = match rest.iter().position(|argument| *argument == "--") {
        Some(at) => (&rest[..at], &rest[at + 1..]),
        None => (rest, &rest[..0]),
    };
    let mut arguments = vec!["test", "--workspace", "--no-fail-fast"];
    arguments.extend(cargo);
    let target = block.rerun.as_deref().unwrap_or_default();
    let mut target = target.split(' ');
    // The harness refuses an option that it has already.
    if target.next() == Some("-p") {
        target.next();
    }
    arguments.extend(target);
    arguments.extend(["--", "--exact"]);
    let mut harness = harness.iter();
    while let Some(argument) = harness.next() {
        if *argument == "--test-threads" {
            harness.next();
        } else if *argument != "--exact" && !argument.starts_with("--test-threads=") {
            arguments.push(argument);
        }
    }
    arguments.extend(block.failed.iter().map(String::as_str));
    arguments
}

/// Runs tests with cargo, prints its output as it comes, and reads it.
fn follow(
    arguments: &[&str],
    environment: &[(&str, &str)],
    timings: &mut Timings,
) -> (std::io::Result<ExitStatus>, Report) {
    let mut report = Report::default();
    let start = Instant::now();
    let status = lines(cargo_command(arguments, environment), |line| {
        println!("{line}");
        timings.note(line, start.elapsed());
        report.note(line);
    });
    timings.finish();
    (status, report)
}

/// How many tests of a program run at a time. More programs run than there are processors, so there
/// are some tests a processor: most of the time they wait for processes that they have started.
fn threads() -> usize {
    let chosen = std::env::var("RUST_TEST_THREADS").ok();
    let chosen = chosen.and_then(|count| count.parse().ok());
    chosen.unwrap_or(2)
}

fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Runs a program to its end, and prints its output as a whole, because other tests print meanwhile.
fn printed(mut command: Command) -> std::io::Result<ExitStatus> {
    let output = command.output()?;
    let [said, errors] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    print!("{said}{errors}");
    Ok(output.status)
}

/// Runs the examples in documentation, crate after crate.
fn examples() -> Result<(), String> {
    let words = ["test", "--workspace", "--no-fail-fast", "--doc"];
    let metadata = semver::metadata(Path::new(semver::ROOT))?;
    let mut command = cargo_command(&words, &[]);
    for name in without_examples(&metadata) {
        command.args(["--exclude", name]);
    }
    outcome(&words, printed(command))
}

/// The packages of components, and of programs for tests and benchmarks, that have no examples. `--doc` would
/// compile them once more, with the features of their tests, and start rustdoc for each, also with
/// `doctest = false`. Other packages add features to those that have examples.
fn without_examples(metadata: &Value) -> Vec<&str> {
    let root = metadata["workspace_root"].as_str().unwrap_or_default();
    let folders = ["components", "deploy/tests", "xtask/bench"].map(|of| Path::new(root).join(of));
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let without = packages.filter(|package| {
        let manifest = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        let mut targets = package["targets"].as_array().into_iter().flatten();
        folders.iter().any(|folder| manifest.starts_with(folder))
            && !targets.any(|target| target["doctest"] == true)
    });
    without
        .filter_map(|package| package["name"].as_str())
        .collect()
}

/// Reads hostile images, and changes shared pages, under Miri, which detects undefined behaviour. The
/// outer error is the reason why Miri cannot be installed.
fn miri() -> Result<Result<(), String>, String> {
    let run = |program: &str, args: &[&str]| {
        println!("+ {program} {}", args.join(" "));
        let mut command = Command::new(program);
        command.args(args);
        printed(command).map_err(|e| format!("{program} cannot be started: {e}"))
    };
    let works =
        |program: &str, args: &[&str]| run(program, args).is_ok_and(|status| status.success());
    if !works("cargo", &["+nightly", "miri", "--version"]) {
        // A toolchain that is there stays the version that it is.
        let install = if works("cargo", &["+nightly", "--version"]) {
            "component add --toolchain nightly miri rust-src"
        } else {
            "toolchain install nightly --profile minimal --component miri,rust-src --no-self-update"
        };
        if !run("rustup", &install.split(' ').collect::<Vec<_>>())?.success() {
            return Err(format!("rustup {install} failed"));
        }
    }
    for test in ["rc-middleware --test in_place", "graph-pages"] {
        let test = format!("+nightly miri test -q -p {test}");
        let status = run("cargo", &test.split(' ').collect::<Vec<_>>())?;
        if !status.success() {
            return Ok(Err(format!("cargo {test} failed")));
        }
    }
    Ok(Ok(()))
}

#[cfg(test)]
mod tests;
