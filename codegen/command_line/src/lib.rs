//! Shared parts of the command lines of `rcgen` and `rcdeploy`: completion, man pages, and the
//! exit codes, which the help and the man pages list.

mod completion;
mod man;

use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::CompleteEnv;
pub use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter, CompletionCandidate};
pub use completion::{Shell, earlier_word, files, words};
pub use man::Page;
use std::path::PathBuf;

/// A tool with its own command line.
#[derive(Clone, Copy, Debug)]
pub struct Tool {
    /// The name of the program.
    pub name: &'static str,
    /// The environment variable that asks the program for completions. Its value is a shell.
    pub completion_variable: &'static str,
    /// The exit codes and their meanings.
    pub exit_codes: &'static [(u8, &'static str)],
}

/// The commands that both tools have.
#[derive(Subcommand)]
pub enum Common {
    /// Prints the script that completes command lines of this tool in a shell.
    ///
    /// bash and zsh read it by `source <(…)`, fish by `… | source`. The script asks the tool, which
    /// must be in the PATH.
    Completions {
        /// The shell: bash, zsh or fish.
        #[arg(value_parser = |text: &str| text.parse::<Shell>(), add = words(&["bash", "zsh", "fish"]))]
        shell: Shell,
    },
    /// Writes the man pages, one for the tool and one for each command.
    Man {
        /// The folder of the pages, for example ~/.local/share/man/man1.
        dir: PathBuf,
    },
}

impl Tool {
    /// The command line of `C` with the exit codes in each help.
    pub fn command<C: CommandFactory>(&self) -> clap::Command {
        with_help(C::command(), &self.exit_code_help())
    }

    /// Reads the command line of this process, or answers a shell that asks for completions. Ends
    /// the process if it was a shell, and on wrong usage. Call it before any thread is started.
    pub fn parse<C: Parser>(&self) -> C {
        let factory = || self.command::<C>();
        CompleteEnv::with_factory(factory)
            .var(self.completion_variable)
            .shells(completion::SHELLS)
            .complete();
        let read = C::from_arg_matches_mut(&mut factory().get_matches());
        read.unwrap_or_else(|error| error.format(&mut factory()).exit())
    }

    /// The completion script of a shell.
    pub fn completion_script(&self, shell: Shell) -> String {
        completion::script(self, shell)
    }

    /// The man pages of the tool and of all its commands that are not hidden.
    pub fn man_pages<C: CommandFactory>(&self) -> Vec<Page> {
        man::pages(self, C::command())
    }

    fn exit_code_help(&self) -> String {
        let codes = self.exit_codes.iter();
        let codes = codes.map(|(code, meaning)| format!("\n  {code}  {meaning}"));
        format!("Exit codes:{}", codes.collect::<String>())
    }
}

fn with_help(command: clap::Command, help: &str) -> clap::Command {
    let command = command.mut_subcommands(|sub| with_help(sub, help));
    command.after_help(help.to_owned())
}
