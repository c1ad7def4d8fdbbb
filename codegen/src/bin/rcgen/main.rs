//! `rcgen`: from description files to a component.
//!
//! Exit codes: 0 done; 1 the input is wrong, or generated code is not up to date; 2 wrong usage; 3
//! the system refused.

mod checks;
mod clean;
mod command_line;
mod component;
mod configuration;
mod export;
mod generation;
mod reports;
mod start;

use clap::Parser;
use command_line::{Cli, Command};
use reports::{Failure, tell};
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match cli.command {
        Some(Command::Init { dir, framework }) => start::init(&dir, &framework),
        Some(Command::New(args)) => start::new(args),
        Some(Command::Generate(args)) => generation::generate(args),
        Some(Command::Clean { paths, dry_run }) => clean::clean(paths, dry_run),
        Some(Command::Check { files, common }) => checks::check(&files, &common),
        Some(Command::Fmt {
            files,
            check,
            format,
        }) => checks::fmt(&files, check, format),
        Some(Command::Config {
            update: _,
            file,
            common,
            dry_run,
            check,
        }) => configuration::update(&file, &common, dry_run, check),
        Some(Command::Explain { code }) => checks::explain(code.as_deref()),
        Some(Command::Export {
            file,
            to,
            out,
            common,
            dry_run,
        }) => export::export(to, &file, &out, &common, dry_run),
        Some(Command::Stubs { file, common, out }) => component::print_stubs(&file, &common, out),
        Some(Command::View {
            file,
            common,
            middleware,
        }) => component::print_view(&file, &common, middleware),
        None => generation::run(&cli.generate),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Input) => ExitCode::from(1),
        Err(Failure::Usage(message)) => {
            tell(format_args!("rcgen: error: {message}\n"));
            ExitCode::from(2)
        }
        Err(Failure::System(message)) => {
            tell(format_args!("rcgen: error: {message}\n"));
            ExitCode::from(3)
        }
    }
}
