//! The project's own tasks: `cargo xtask TASK`.

mod bench;
mod pair;
mod programs;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["bench"] => bench::run(false),
        ["bench", "--smoke"] => bench::run(true),
        _ => {
            eprintln!("usage: cargo xtask bench [--smoke]");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: error: {error}");
            ExitCode::from(3)
        }
    }
}
