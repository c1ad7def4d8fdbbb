//! `cargo xtask`: the project's own commands. `test` is the whole test run, `bench` measures, `fuzz` searches for
//! texts that do harm.

mod bench;
mod languages;
mod pair;
mod programs;

use std::process::{Command, ExitCode};

const COMPONENTS: [&str; 9] = [
    "simulator",
    "avoider",
    "pose_monitor",
    "camera",
    "image_monitor",
    "speech_server",
    "speech_client",
    "motor_bus",
    "joint_controller",
];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test", ref rest @ ..] => test(rest),
        ["bench"] => bench::run(false).map_err(|e| e.to_string()),
        ["bench", "--smoke"] => bench::run(true).map_err(|e| e.to_string()),
        ["bench", "languages"] => bench::languages().map_err(|e| e.to_string()),
        ["fuzz", seconds] if seconds.parse::<u32>().is_ok() => fuzz(seconds),
        _ => {
            eprintln!(
                "usage: cargo xtask test [ARGUMENTS OF cargo test] | bench [languages | --smoke] | fuzz SECONDS"
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

/// Builds what the tests start, then runs every test of the workspace.
fn test(rest: &[&str]) -> Result<(), String> {
    let mut build = vec!["build", "--bins"];
    for component in COMPONENTS {
        build.extend(["--package", component]);
    }
    cargo(&build)?;
    let mut test = vec!["test", "--workspace", "--no-fail-fast"];
    test.extend(rest);
    cargo(&test)
}

/// Reads random texts of every language for so long; each run begins where the clock says.
fn fuzz(seconds: &str) -> Result<(), String> {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = now.map_or(0, |since| since.as_secs() * 1_000_000);
    println!("+ RC_FUZZ_SEED={seed} RC_FUZZ_SECONDS={seconds}");
    let test = "test --release -p rc-codegen --test languages no_text_does_harm -- --nocapture";
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
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    println!("+ cargo {}", args.join(" "));
    let status = Command::new(cargo)
        .args(args)
        .envs(environment.iter().copied())
        .status()
        .map_err(|e| format!("cargo cannot be started: {e}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("cargo {} failed", args.join(" ")))
    }
}
