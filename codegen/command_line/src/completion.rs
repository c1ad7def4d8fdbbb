//! Completion in shells. The scripts are those of `clap_complete`; they start the tool, which
//! answers from its command line and from the state of the machine.

use crate::Tool;
use clap::builder::ValueParser;
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter,
};
use clap_complete::env::{Bash, EnvCompleter, Fish, Shells, Zsh};
use std::ffi::{OsStr, OsString};
use std::str::FromStr;

pub(crate) const SHELLS: Shells<'static> = Shells(&[&Bash, &Fish, &Zsh]);

/// A shell that can complete command lines.
#[derive(Clone, Copy, Debug)]
pub enum Shell {
    /// GNU bash.
    Bash,
    /// The Z shell.
    Zsh,
    /// fish.
    Fish,
}

impl FromStr for Shell {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "bash" => Ok(Self::Bash),
            "zsh" => Ok(Self::Zsh),
            "fish" => Ok(Self::Fish),
            _ => Err("there are bash, zsh and fish".to_owned()),
        }
    }
}

pub(crate) fn script(tool: &Tool, shell: Shell) -> String {
    let completer: &dyn EnvCompleter = match shell {
        Shell::Bash => &Bash,
        Shell::Zsh => &Zsh,
        Shell::Fish => &Fish,
    };
    let mut script = Vec::new();
    let name = tool.name;
    // Writing into memory does not fail.
    let _ = completer.write_registration(tool.completion_variable, name, name, name, &mut script);
    let mut script = String::from_utf8_lossy(&script).trim().to_owned() + "\n";
    if matches!(shell, Shell::Zsh) {
        // In a folder of `fpath`, zsh reads the script at the first completion, which would stay
        // empty.
        script += &format!(
            "if [[ $funcstack[1] == _{name} ]]; then\n    _clap_dynamic_completer_{name} \"$@\"\nfi\n"
        );
    }
    script
}

/// Completes an argument that is one of some words.
pub fn words(words: impl IntoIterator<Item = impl ToString>) -> ArgValueCandidates {
    let words: Vec<String> = words.into_iter().map(|word| word.to_string()).collect();
    ArgValueCandidates::new(move || words.iter().map(CompletionCandidate::new).collect())
}

/// Completes files with one of these extensions, and folders, which may hold them.
pub fn files(extensions: &'static [&'static str]) -> ArgValueCompleter {
    ArgValueCompleter::new(PathCompleter::file().filter(|path| {
        let extension = path.extension().and_then(OsStr::to_str);
        extension.is_some_and(|extension| extensions.contains(&extension))
    }))
}

/// The value that the command line being completed has so far for the argument `name`.
///
/// A completer of `clap_complete` sees only the word under the cursor. The words of the command
/// line follow `--` in the arguments of this process.
pub fn earlier_word(command: clap::Command, name: &str) -> Option<String> {
    let words = std::env::args_os().skip_while(|word| word != "--").skip(1);
    value_of(command, words, name)
}

/// The value of the argument `name` in the words of a command line, which may be incomplete.
pub fn value_of(
    command: clap::Command,
    words: impl Iterator<Item = OsString>,
    name: &str,
) -> Option<String> {
    // The words are incomplete, and no value has to be right yet.
    let command = lenient(command).ignore_errors(true);
    let matches = command.try_get_matches_from(words).ok()?;
    let mut matches = &matches;
    while let Some((_, inner)) = matches.subcommand() {
        matches = inner;
    }
    let value = matches.try_get_one::<OsString>(name).ok()??;
    value.to_str().map(str::to_owned)
}

fn lenient(command: clap::Command) -> clap::Command {
    let command = command.mut_subcommands(lenient);
    command.mut_args(|argument| {
        if argument.get_action().takes_values() {
            argument.value_parser(ValueParser::os_string())
        } else {
            argument
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, Command};

    #[test]
    fn the_earlier_word_is_found_behind_options_and_in_nested_commands() {
        let number = Arg::new("lines")
            .short('n')
            .value_parser(clap::value_parser!(u8));
        let network = Arg::new("network").required(true);
        let names = Arg::new("names").required(true).num_args(1..);
        let get = Command::new("get").args([number, network, names]);
        let tool =
            || Command::new("tool").subcommand(Command::new("params").subcommand(get.clone()));
        let earlier = |words: &str| {
            let words = words.split(' ').map(OsString::from);
            value_of(tool(), words, "network")
        };
        assert_eq!(
            earlier("tool params get -n 5 patrol ").as_deref(),
            Some("patrol")
        );
        assert_eq!(
            earlier("tool params get patrol -n").as_deref(),
            Some("patrol")
        );
        assert_eq!(earlier("tool params").as_deref(), None);
    }
}
