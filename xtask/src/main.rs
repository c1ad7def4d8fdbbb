//! `cargo xtask`: the project's own commands. `test` is the whole test run, `install` installs the
//! tools, `fuzz` searches for texts that harm a parser, `mutants` for code that no test checks.
//! Benchmarks and long tests are in `trials`, so that this program is built in a second.

mod install;
mod mutants;
mod timings;

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use timings::Timings;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let outcome = match args[..] {
        ["test", ref rest @ ..] => test(rest),
        ["install", ref rest @ ..] => install::install(rest),
        ["uninstall", ref rest @ ..] => install::uninstall(rest),
        ["mutants", ref rest @ ..] => mutants::run(rest),
        ["fuzz", seconds] if seconds.parse::<u32>().is_ok() => fuzz(seconds),
        ["bench" | "soak" | "chaos" | "deny" | "experiment", ..] => return trials(&args),
        _ => {
            eprintln!(
                "usage: cargo xtask test [--timings] [ARGUMENTS OF cargo test] | install [--root DIR] [--with rcview | --with rcfoxglove] | uninstall [--root DIR] | bench … | soak … | chaos … | deny [--smoke] | experiment [--smoke] | fuzz SECONDS | mutants [--count N] [--seed S] [--file GLOB]…"
            );
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: error: {message}");
            ExitCode::from(3)
        }
    }
}

/// Runs the program of benchmarks and long tests, which links the framework. It takes the place of
/// this process, so that a signal reaches it.
fn trials(args: &[&str]) -> ExitCode {
    let run = ["run", "--quiet", "--bin", "trials", "--"];
    let mut command = cargo_command(&[&run, args].concat(), &[]);
    let error = command.exec();
    eprintln!("xtask: error: cargo cannot be started: {error}");
    ExitCode::from(3)
}

/// Builds all programs, of which tests start many, then runs every test of the workspace. Both
/// select the whole workspace: dependencies have the same features then, and are compiled once.
fn test(rest: &[&str]) -> Result<(), String> {
    cargo(&["build", "--workspace", "--bins"])?;
    cargo(&["run", "--quiet", "--bin", "trials", "--", "variants"])?;
    let timed = rest.contains(&"--timings");
    let rest: Vec<&str> = rest.iter().copied().filter(|a| *a != "--timings").collect();
    let mut test = vec!["test", "--workspace", "--no-fail-fast"];
    test.extend(&rest);
    let threads = threads().to_string();
    let list = std::env::temp_dir().join(format!("rc-skipped-{}", std::process::id()));
    let environment = [
        ("RC_TEST_SKIPPED", &*list.to_string_lossy()),
        ("RUST_TEST_THREADS", &threads),
    ];
    let mut tested = if timed {
        cargo_timed(&test, &environment)
    } else {
        cargo_with(&test, &environment)
    };
    let mut skipped = String::new();
    if rest.is_empty() {
        match miri() {
            Ok(outcome) => tested = tested.and(outcome),
            Err(why) => skipped = format!("skipped: values in place under Miri: {why}\n"),
        }
    }
    // The end of the output is the place where a skipped test is noticed.
    print!(
        "{}{skipped}",
        std::fs::read_to_string(&list).unwrap_or_default()
    );
    let _ = std::fs::remove_file(&list);
    tested
}

/// How many tests of a program run at a time: two a processor, because most of the time they wait
/// for processes that they have started.
fn threads() -> usize {
    let chosen = std::env::var("RUST_TEST_THREADS").ok();
    let chosen = chosen.and_then(|count| count.parse().ok());
    chosen.unwrap_or_else(|| 2 * std::thread::available_parallelism().map_or(1, usize::from))
}

/// Reads hostile images under Miri, which detects undefined behaviour. The outer error is the
/// reason why Miri cannot be installed.
fn miri() -> Result<Result<(), String>, String> {
    let run = |program: &str, args: &[&str]| {
        println!("+ {program} {}", args.join(" "));
        let status = Command::new(program).args(args).status();
        status.map_err(|e| format!("{program} cannot be started: {e}"))
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
    let test = "+nightly miri test -q -p rc-runtime --test in_place";
    let status = run("cargo", &test.split(' ').collect::<Vec<_>>())?;
    Ok(if status.success() {
        Ok(())
    } else {
        Err(format!("cargo {test} failed"))
    })
}

/// Reads random texts of every language for `seconds`. The clock seeds each run.
fn fuzz(seconds: &str) -> Result<(), String> {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = now.map_or(0, |since| since.as_secs() * 1_000_000);
    println!("+ RC_FUZZ_SEED={seed} RC_FUZZ_SECONDS={seconds}");
    let test =
        "test --release -p rc-codegen --test languages no_text_causes_a_panic -- --nocapture";
    let words: Vec<&str> = test.split(' ').collect();
    let seed = seed.to_string();
    cargo_with(
        &words,
        &[("RC_FUZZ_SEED", &seed), ("RC_FUZZ_SECONDS", seconds)],
    )
}

fn cargo(args: &[&str]) -> Result<(), String> {
    cargo_with(args, &[])
}

fn cargo_with(args: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    let status = cargo_command(args, environment).status();
    outcome(args, status)
}

/// Runs tests with cargo, and prints the twenty slowest ones at the end.
fn cargo_timed(args: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    let mut timings = Timings::new(threads());
    let child = cargo_command(args, environment)
        .stdout(Stdio::piped())
        .spawn();
    let status = child.and_then(|mut child| {
        if let Some(output) = child.stdout.take() {
            timings.follow(output);
        }
        child.wait()
    });
    println!("the slowest tests:");
    for timing in timings.slowest(20) {
        println!("{:8.1} s  {}", timing.took.as_secs_f64(), timing.name);
    }
    outcome(args, status)
}

fn cargo_command(args: &[&str], environment: &[(&str, &str)]) -> Command {
    println!("+ cargo {}", args.join(" "));
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(args).envs(environment.iter().copied());
    cargo.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."));
    cargo
}

fn outcome(args: &[&str], status: std::io::Result<ExitStatus>) -> Result<(), String> {
    let status = status.map_err(|e| format!("cargo cannot be started: {e}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("cargo {} failed", args.join(" ")))
    }
}
