//! The words of an `up` for the process that supervises in the background: those of this one, read
//! by the definition of the command, without what concerns only this process.

use clap::parser::ValueSource;
use clap::{ArgAction, Command};
use std::ffi::OsString;

/// The arguments of the process that detaches.
const FOREGROUND: [&str; 5] = ["build", "no_generate", "detach", "plain", "format"];

/// The words after the name of the program, for `words` of `rcdeploy up`.
pub(super) fn in_background(
    mut command: Command,
    words: impl IntoIterator<Item = OsString>,
) -> Result<Vec<OsString>, clap::Error> {
    let matches = command.try_get_matches_from_mut(words)?;
    let mut again: Vec<OsString> = ["up", "--supervisor", "--format", "json"]
        .map(OsString::from)
        .into();
    let found = command.find_subcommand("up");
    let Some((up, matches)) = found.zip(matches.subcommand_matches("up")) else {
        return Ok(again);
    };
    let mut last = Vec::new();
    for argument in up.get_arguments() {
        let id = argument.get_id().as_str();
        let is_given = matches.value_source(id) == Some(ValueSource::CommandLine);
        if !is_given || FOREGROUND.contains(&id) {
            continue;
        }
        let long = argument.get_long().map(|long| format!("--{long}"));
        let short = argument.get_short().map(|short| format!("-{short}"));
        let values = matches.get_raw(id).into_iter().flatten();
        match long.or(short) {
            Some(option) if matches!(argument.get_action(), ArgAction::SetTrue) => {
                again.push(option.into());
            }
            Some(option) => {
                for value in values {
                    again.extend([option.clone().into(), value.to_owned()]);
                }
            }
            None => last.extend(values.map(ToOwned::to_owned)),
        }
    }
    // A file may be named like an option.
    again.push("--".into());
    again.extend(last);
    Ok(again)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::command::Cli;
    use clap::CommandFactory;

    fn again(words: &[&str]) -> Vec<String> {
        let words = ["rcdeploy", "up"].iter().chain(words);
        let again = in_background(Cli::command(), words.map(OsString::from)).expect("an up");
        let texts = again.into_iter().map(OsString::into_string);
        texts.map(|text| text.expect("UTF-8")).collect()
    }

    #[test]
    fn the_background_gets_what_concerns_the_network() {
        let start = ["up", "--supervisor", "--format", "json"];
        assert_eq!(
            again(&["--detach", "n.ddsl"]),
            [&start[..], &["--", "n.ddsl"]].concat()
        );
        let given = [
            "--build",
            "--no-generate",
            "--detach",
            "--plain",
            "--format",
            "human",
            "-Ia",
            "-I",
            "b",
            "--set=x.y=1",
            "--profile",
            "dev",
            "--middleware",
            "dds",
            "--log-limit",
            "3",
            "n.ddsl",
        ];
        let mut rest = again(&given).split_off(start.len());
        assert_eq!(rest.split_off(rest.len() - 2), ["--", "n.ddsl"]);
        rest.sort();
        let mut wanted = [
            "-I",
            "a",
            "-I",
            "b",
            "--set",
            "x.y=1",
            "--profile",
            "dev",
            "--middleware",
            "dds",
            "--log-limit",
            "3",
        ];
        wanted.sort_unstable();
        assert_eq!(rest, wanted);
    }

    /// A new option of `up` is one of the background unless it is named here.
    #[test]
    fn the_arguments_of_the_foreground_exist() {
        let command = Cli::command();
        let up = command.find_subcommand("up").expect("it exists");
        let all: Vec<&str> = up
            .get_arguments()
            .map(|one| one.get_id().as_str())
            .collect();
        for id in FOREGROUND {
            assert!(all.contains(&id), "{id} is none of {all:?}");
        }
    }
}
