//! `rcdeploy`: checks a network, starts it, watches it, stops it.

use std::process::ExitCode;

fn main() -> ExitCode {
    rc_deploy::cli::main()
}
