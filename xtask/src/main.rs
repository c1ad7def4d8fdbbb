//! `cargo xtask`: the project's own commands. `test` is the whole test run, `bench` measures.

mod bench;
mod pair;
mod programs;

use std::process::{Command, ExitCode};

const COMPONENTS: [&str; 5] = [
    "simulator",
    "avoider",
    "pose_monitor",
    "speech_server",
    "speech_client",
];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test", ref rest @ ..] => test(rest),
        ["bench"] => bench::run(false).map_err(|e| e.to_string()),
        ["bench", "--smoke"] => bench::run(true).map_err(|e| e.to_string()),
        _ => {
            eprintln!("usage: cargo xtask test [ARGUMENTS OF cargo test] | bench [--smoke]");
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

fn cargo(args: &[&str]) -> Result<(), String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    println!("+ cargo {}", args.join(" "));
    let status = Command::new(cargo)
        .args(args)
        .status()
        .map_err(|e| format!("cargo cannot be started: {e}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("cargo {} failed", args.join(" ")))
    }
}
