//! Handlers that a worker in C++ lacks: the compiler names the pure virtual functions that are left.

use super::component::{self, Handler};
use crate::program::end_of;
use crate::project::Project;
use crate::stubs::Lacking;
use crate::view;
use rc_cdsl::model::Middleware;
use rc_diagnostics::{Diagnostics, SourceMap, foreign};
use serde::Deserialize;
use std::io::{self, Write as _};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The file whose flags the header of the worker gets.
const WORKER: &str = "specificworker.cpp";
/// Text for the compiler.
const PROBE: &str = "#include \"specificworker.h\"\nSpecificWorker rc_worker;\n";
/// How long the compiler may take.
const PATIENCE: Duration = Duration::from_mins(2);
/// The most lines of the compiler's messages in a report.
const LINES: usize = 12;

/// An entry of `compile_commands.json`.
#[derive(Deserialize)]
struct Entry {
    directory: String,
    command: String,
    file: String,
}

/// Compares the functions that a component needs with those of the class in `folder`/src.
///
/// # Errors
/// The component was not built, or the compiler cannot read its headers.
pub(crate) fn of(
    project: &Project,
    folder: &Path,
    _: &mut SourceMap,
) -> io::Result<(Option<Lacking>, Diagnostics)> {
    let (view, mut found) = view::component::of(project, Middleware::DEFAULT);
    super::check(&project.component, &mut found);
    if found.has_errors() {
        return Ok((None, found));
    }
    let component = component::of(&view);
    let functions = component.functions();
    let said = compile(folder)?;
    let missing = functions.iter().filter(|function| {
        let mut lines = said.iter().filter(|line| line.contains("virtual"));
        lines.any(|line| words(line).any(|word| word == function.name))
    });
    let missing: Vec<&Handler> = missing.collect();
    let wrong: Vec<&String> = said
        .iter()
        .filter(|line| line.contains("override") && line.contains("error"))
        .collect();
    if missing.is_empty() && !said.is_empty() {
        let first: Vec<&str> = said.iter().take(LINES).map(String::as_str).collect();
        return Err(io::Error::other(format!(
            "the compiler refuses the header of the worker:\n{}",
            first.join("\n")
        )));
    }
    let mut text = String::new();
    if !missing.is_empty() {
        text.push_str("// src/specificworker.h, in the class SpecificWorker:\n");
        for line in &wrong {
            text.push_str(&format!("  // {line}\n"));
        }
        for function in &missing {
            let Handler {
                result,
                name,
                parameters,
                ..
            } = function;
            text.push_str(&format!("  {result} {name}({parameters}) override;\n"));
        }
        text.push_str("\n// src/specificworker.cpp:\n");
        for function in &missing {
            let Handler {
                result,
                name,
                unused,
                body,
                ..
            } = function;
            text.push_str(&format!("{result} SpecificWorker::{name}({unused}) {{\n"));
            for line in *body {
                text.push_str(&format!("  {line}\n"));
            }
            text.push_str("}\n");
        }
    }
    let lacking = Lacking {
        text,
        hooks: String::new(),
        total: functions.len(),
    };
    Ok((Some(lacking), found))
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
}

/// The lines in which the compiler refuses the worker; none if it does not.
fn compile(folder: &Path) -> io::Result<Vec<String>> {
    let path = folder.join("build/compile_commands.json");
    let text = std::fs::read_to_string(&path).map_err(|error| {
        io::Error::other(format!(
            "build the component once, with `rcdeploy up --build` of a network that has it: \
             the flags of the compiler are in {}, which cannot be read: {error}",
            path.display()
        ))
    })?;
    let wrong = |what: &str| io::Error::other(format!("{}: {what}", path.display()));
    let entries: Vec<Entry> =
        serde_json::from_str(&text).map_err(|error| wrong(&error.to_string()))?;
    let mut entries = entries.into_iter();
    let entry = entries.find(|entry| Path::new(&entry.file).ends_with(WORKER));
    let entry = entry.ok_or_else(|| wrong(&format!("it has no file {WORKER}")))?;
    let mut arguments = split(&entry.command).into_iter();
    let compiler = arguments.next().ok_or_else(|| wrong("an empty command"))?;
    let mut flags = Vec::new();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "-o" | "-MF" | "-MT" | "-MQ" => drop(arguments.next()),
            "-c" | "-MD" | "-MMD" => {}
            file if Path::new(file).ends_with(WORKER) => {}
            _ => flags.push(argument),
        }
    }
    // The pipe holds the short text, so nothing waits for the compiler to read it.
    let (input, mut probe) = io::pipe()?;
    probe.write_all(PROBE.as_bytes())?;
    drop(probe);
    let mut command = Command::new(&compiler);
    command
        .args(flags)
        .args(["-fsyntax-only", "-x", "c++", "-"])
        .current_dir(&entry.directory)
        .env("LC_ALL", "C");
    let ended = end_of(PATIENCE, &mut command, input.into());
    let ended = ended.map_err(|why| io::Error::other(format!("`{compiler}` {why}")))?;
    if ended.is_success {
        return Ok(Vec::new());
    }
    let said = String::from_utf8_lossy(&ended.said);
    Ok(said
        .lines()
        .map(|line| foreign::clean_to(line, 2000))
        .collect())
}

/// The words of a command line as cmake writes it: with quotes and backslashes of a shell.
fn split(command: &str) -> Vec<String> {
    let (mut words, mut word, mut is_word) = (Vec::new(), String::new(), false);
    let (mut quote, mut chars) = (None, command.chars());
    while let Some(c) = chars.next() {
        match (quote, c) {
            (Some('\''), '\'') | (Some('"'), '"') => quote = None,
            (None, '\'' | '"') => (quote, is_word) = (Some(c), true),
            (None | Some('"'), '\\') => {
                word.extend(chars.next());
                is_word = true;
            }
            (None, c) if c.is_whitespace() => {
                if is_word {
                    words.push(std::mem::take(&mut word));
                }
                is_word = false;
            }
            (_, c) => {
                word.push(c);
                is_word = true;
            }
        }
    }
    if is_word {
        words.push(word);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn a_command_has_words() {
        let command = r#"/usr/bin/c++ -I"/a b" '-DX="y"' -DZ=R\"rc(p)rc\"  -c /a\ b.cpp"#;
        let words = [
            "/usr/bin/c++",
            "-I/a b",
            r#"-DX="y""#,
            r#"-DZ=R"rc(p)rc""#,
            "-c",
            "/a b.cpp",
        ];
        assert_eq!(split(command), words);
    }
}
