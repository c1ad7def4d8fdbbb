//! `cargo xtask`: the project's own commands. `test` is the whole test run, `install` installs the
//! tools, `figures` writes the tables of BENCHMARKS.md, `semver` compares the public API with an earlier one, `fuzz` searches for texts that harm a parser, `mutants` for code that no test checks.
//! Benchmarks and long tests are in `trials`, packages and the book in `dist`, so that this program is built in a second.

mod checkout;
mod figures;
mod install;
mod mutants;
mod programs;
mod report;
mod semver;
mod testing;
mod timings;
mod tools;

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, ExitCode, ExitStatus, Stdio};

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let outcome = match args[..] {
        ["test", ref rest @ ..] => testing::run(rest),
        ["install", ref rest @ ..] => install::install(rest),
        ["uninstall", ref rest @ ..] => install::uninstall(rest),
        ["mutants", ref rest @ ..] => mutants::run(rest),
        ["fuzz", seconds] if seconds.parse::<u32>().is_ok() => fuzz(seconds),
        ["figures"] => figures::render(),
        ["semver", ref rest @ ..] => semver::run(rest),
        ["soak", "packages", ref rest @ ..] => {
            return run_instead("dist", &[&["--soak"], rest].concat());
        }
        [
            "bench" | "soak" | "chaos" | "experiment",
            ref rest @ ..,
            "--save",
        ] if !rest.contains(&"--smoke") => saved(&args[..args.len() - 1]),
        ["bench" | "soak" | "chaos" | "deny" | "experiment", ..] => {
            return run_instead("trials", &args);
        }
        ["dist", ref rest @ ..] => return run_instead("dist", rest),
        ["book", ..] => return run_instead("dist", &args),
        _ => {
            eprintln!(
                "usage: cargo xtask test [--timings] [ARGUMENTS OF cargo test] | install [--root DIR] [--with rcview | --with rcfoxglove | --with rcforward] | uninstall [--root DIR] | bench … | soak … | chaos … | experiment …, each with [--save] | dist [--help] | book [--help] | figures | semver [--since REVISION] [--package NAME]… | deny [--smoke] | fuzz SECONDS | mutants [--count N] [--seed S] [--file GLOB]…"
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

/// Runs the program of packages, or that of benchmarks and long tests, which links the framework.
/// It takes the place of this process, so that a signal reaches it.
fn run_instead(program: &str, args: &[&str]) -> ExitCode {
    let run = ["run", "--quiet", "--bin", program, "--"];
    let mut command = cargo_command(&[&run, args].concat(), &[]);
    let error = command.exec();
    eprintln!("xtask: error: cargo cannot be started: {error}");
    ExitCode::from(3)
}

/// Runs a benchmark or a long test, and saves the tables that it prints.
fn saved(args: &[&str]) -> Result<(), String> {
    let run = ["run", "--quiet", "--bin", "trials", "--"];
    let machine = figures::machine();
    let mut command = cargo_command(&[&run, args].concat(), &[]);
    let child = command.stdout(Stdio::piped()).spawn();
    let mut child = child.map_err(|e| format!("cargo cannot be started: {e}"))?;
    let output = child.stdout.take().ok_or("no output")?;
    let data = figures::follow(output, &machine)?;
    outcome(args, child.wait())?;
    figures::save(args, &data)
}

/// Reads random texts of every language for `seconds`. The clock seeds each run.
fn fuzz(seconds: &str) -> Result<(), String> {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = now.map_or(0, |since| since.as_secs() * 1_000_000);
    println!("+ RC_FUZZ_SEED={seed} RC_FUZZ_SECONDS={seconds}");
    let test = "test --release -p rcgen --test languages no_text_causes_a_panic -- --nocapture";
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
