//! Shared parts of the command lines of `rcgen` and `rcdeploy`: completion, man pages, the option
//! `--color`, and the exit codes, which the help and the man pages list.

mod completion;
mod man;

use clap::{Arg, ArgMatches, CommandFactory, Parser, Subcommand};
use clap_complete::CompleteEnv;
pub use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter, CompletionCandidate};
pub use completion::{Shell, earlier_word, files, value_of, words};
pub use man::Page;
use rc_diagnostics::foreign::is_hidden;
use rc_diagnostics::print::{self, ColorChoice};
use std::ffi::OsString;
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
        let color = Arg::new(COLOR)
            .long(COLOR)
            .value_name("WHEN")
            .global(true)
            .value_parser(|text: &str| text.parse::<ColorChoice>())
            .default_value("auto")
            .help("When findings have colors: auto (on a terminal, unless NO_COLOR is set), always or never")
            .add(words(ColorChoice::WORDS));
        with_help(C::command(), &self.exit_code_help()).arg(color)
    }

    /// Reads the command line of this process, or answers a shell that asks for completions. Ends
    /// the process if it was a shell, and on wrong usage. Call it before any thread is started.
    pub fn parse<C: Parser>(&self) -> C {
        self.parse_edited(|_, words| words)
    }

    /// As [`parse`](Self::parse), after `edit` has changed the words of the command line.
    pub fn parse_edited<C: Parser>(
        &self,
        edit: impl FnOnce(&clap::Command, Vec<OsString>) -> Vec<OsString>,
    ) -> C {
        let factory = || self.command::<C>();
        CompleteEnv::with_factory(factory)
            .var(self.completion_variable)
            .shells(completion::SHELLS)
            .complete();
        let mut matches = factory()
            .try_get_matches_from(edit(&factory(), words_of_shell()))
            .unwrap_or_else(|error| self.end(&error));
        choose_color(&matches);
        let read = C::from_arg_matches_mut(&mut matches);
        read.unwrap_or_else(|error| self.end(&error.format(&mut factory())))
    }

    /// Prints help or a wrong usage, and ends the process.
    fn end(&self, error: &clap::Error) -> ! {
        if error.use_stderr() {
            let text = error.render().to_string();
            if !text.chars().any(|c| c != '\n' && is_hidden(c)) {
                error.exit();
            }
            // Words of the command line, which may be names of files.
            print::error(format_args!("{}", text.trim_end()));
            std::process::exit(error.exit_code());
        }
        print::data(&error.render().to_string());
        let (code, message) = print::exit_code(0, None, 3);
        if let Some(message) = message {
            print::error(format_args!("{}: error: {message}", self.name));
        }
        std::process::exit(code.into())
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

/// The words of the command line.
fn words_of_shell() -> Vec<OsString> {
    let mut words: Vec<OsString> = rc_files::words_of_command_line().collect();
    behind_command(&mut words);
    words
}

/// Moves `--color WHEN` from the place before a command, where `rcgen` takes the options of
/// `generate` only, to the place after its first word.
fn behind_command(words: &mut [OsString]) {
    let first = words.get(1).and_then(|word| word.to_str());
    let count = match first {
        Some("--color") => 2,
        Some(word) if word.starts_with("--color=") => 1,
        _ => return,
    };
    if words.len() > 1 + count {
        words[1..2 + count].rotate_left(count);
    }
}

const COLOR: &str = "color";

fn choose_color(matches: &ArgMatches) {
    if let Some(choice) = matches.get_one::<ColorChoice>(COLOR) {
        print::choose_color(*choice);
    }
}

fn with_help(command: clap::Command, help: &str) -> clap::Command {
    let command = command.mut_subcommands(|sub| with_help(sub, help));
    command.after_help(help.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsStr;

    #[test]
    fn the_option_for_colors_may_stand_before_the_command() {
        let moved = |words: &str| {
            let mut words: Vec<OsString> = words.split(' ').map(OsString::from).collect();
            behind_command(&mut words);
            words.join(OsStr::new(" ")).into_string().expect("text")
        };
        assert_eq!(
            moved("rcgen --color never check a"),
            "rcgen check --color never a"
        );
        assert_eq!(
            moved("rcgen --color=never check"),
            "rcgen check --color=never"
        );
        assert_eq!(moved("rcgen --color never"), "rcgen --color never");
        assert_eq!(
            moved("rcgen check --color never"),
            "rcgen check --color never"
        );
    }

    #[test]
    fn the_home_folder_is_expanded_where_a_shell_does_not() {
        let home = Some(OsStr::new("/home/ann"));
        for (word, wanted) in [
            ("~", "/home/ann"),
            ("~/robot", "/home/ann/robot"),
            ("--out=~/robot", "--out=/home/ann/robot"),
            ("--set", "--set"),
            ("a~/b", "a~/b"),
            ("arm.file=~/b", "arm.file=~/b"),
            ("~bob/x", "~bob/x"),
        ] {
            assert_eq!(
                rc_files::home_expanded(word.into(), home),
                OsString::from(wanted)
            );
        }
        assert_eq!(
            rc_files::home_expanded("~/x".into(), None),
            OsString::from("~/x")
        );
    }
}
