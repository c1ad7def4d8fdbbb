//! How the command-line tools print.
//!
//! Text for people ([`line()`], [`error`]) shows control characters instead of sending them to the
//! terminal, and is ASCII where the locale is not UTF-8. Data ([`data`], [`Output`]) are written as
//! they are. A failure of standard output is remembered for the exit code ([`exit_code`]).

use crate::foreign::{clean_lines, without_number};
use crate::{Diagnostics, Format, SourceMap, render_for};
use std::borrow::Cow;
use std::fmt::{Arguments, Display};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::{Mutex, OnceLock, PoisonError};

/// When diagnostics have colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorChoice {
    /// On a terminal, unless `NO_COLOR` is set.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

impl ColorChoice {
    /// The words of a command line.
    pub const WORDS: [&'static str; 3] = ["auto", "always", "never"];
}

impl std::str::FromStr for ColorChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "always" => Ok(Self::Always),
            "never" => Ok(Self::Never),
            other => Err(format!(
                "unknown choice `{other}`: expected `auto`, `always` or `never`"
            )),
        }
    }
}

static COLOR: OnceLock<ColorChoice> = OnceLock::new();
static REFUSED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Sets the options of the command line. Only the first call has an effect.
pub fn choose_color(choice: ColorChoice) {
    let _ = COLOR.set(choice);
}

/// Whether text on standard error has colours.
pub fn has_colors() -> bool {
    match COLOR.get().copied().unwrap_or_default() {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            let set = |name| std::env::var_os(name).filter(|value| !value.is_empty());
            let dumb = set("TERM").is_none_or(|term| term == "dumb");
            set("NO_COLOR").is_none() && !dumb && io::stderr().is_terminal()
        }
    }
}

/// Prints a line, or several, for people.
pub fn line(text: Arguments<'_>) {
    let text = clean_lines(&text.to_string(), usize::MAX);
    write(format!("{}\n", in_locale(&text)).as_bytes());
}

/// Prints data as they are.
pub fn data(text: &str) {
    write(text.as_bytes());
}

/// Prints a line, or several, on standard error. A failure is ignored: there is no other place
/// where it could be reported.
pub fn error(text: Arguments<'_>) {
    let text = text.to_string();
    let text = clean_lines(&without_number(&text), usize::MAX);
    let _ = io::stderr().write_all(format!("{}\n", in_locale(&text)).as_bytes());
}

/// Prints diagnostics on standard error.
pub fn findings(sources: &SourceMap, found: &Diagnostics, format: Format) {
    // They are clean.
    let text = render_for(sources, found, format, has_colors());
    let text = match format {
        Format::Json => Cow::Borrowed(text.as_str()),
        Format::Human | Format::Short => in_locale(&text),
    };
    let _ = io::stderr().write_all(text.as_bytes());
}

/// Standard output for data. An error is remembered for the exit code; after it, more is useless.
#[derive(Debug, Default)]
pub struct Output(());

/// Standard output for data.
pub fn output() -> Output {
    Output(())
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        io::stdout().write(bytes).map_err(remember)
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stdout().flush().map_err(remember)
    }
}

fn write(bytes: &[u8]) {
    // The flush reports an error of the last line.
    let _ = output().write_all(bytes).and_then(|()| output().flush());
}

fn remember(error: io::Error) -> io::Error {
    let copy = match error.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code),
        None => error.kind().into(),
    };
    let mut refused = REFUSED.lock().unwrap_or_else(PoisonError::into_inner);
    refused.get_or_insert(copy);
    error
}

/// How a command ends with `code`, and with `message` if there is one that is not printed yet.
///
/// If standard output is a closed pipe, the reader has read enough: a failure that results from it
/// (`refused`, the code for what the system refuses) is not an error. If standard output cannot be
/// written otherwise, the exit code is `refused`, and the message says so.
pub fn exit_code(code: u8, message: Option<String>, refused: u8) -> (u8, Option<String>) {
    let _ = output().flush();
    let lock = REFUSED.lock().unwrap_or_else(PoisonError::into_inner);
    match lock.as_ref() {
        None => (code, message),
        Some(error) if error.kind() == ErrorKind::BrokenPipe => {
            if code == refused {
                (0, None)
            } else {
                (code, message)
            }
        }
        Some(error) => (refused, Some(unwritten(error))),
    }
}

fn unwritten(error: &dyn Display) -> String {
    format!("cannot write to standard output: {error}")
}

/// The text, in ASCII where the locale says so.
fn in_locale(text: &str) -> Cow<'_, str> {
    static ASCII: OnceLock<bool> = OnceLock::new();
    let is_ascii = ASCII.get_or_init(|| {
        let value = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
        is_ascii_locale(["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(value))
    });
    if *is_ascii {
        ascii(text)
    } else {
        Cow::Borrowed(text)
    }
}

/// Whether a locale is not UTF-8. Without one, the terminal most likely is.
fn is_ascii_locale(locale: Option<String>) -> bool {
    locale.is_some_and(|locale| {
        let locale = locale.to_ascii_lowercase();
        !locale.contains("utf-8") && !locale.contains("utf8")
    })
}

/// The text with signs that look alike in ASCII; other characters as escapes.
fn ascii(text: &str) -> Cow<'_, str> {
    if text.is_ascii() {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            c if c.is_ascii() => out.push(c),
            '…' => out.push_str("..."),
            '→' => out.push_str("->"),
            '←' => out.push_str("<-"),
            '↔' => out.push_str("<->"),
            '–' | '—' | '−' | '─' | '━' => out.push('-'),
            '│' | '┃' => out.push('|'),
            '┌' | '┐' | '└' | '┘' | '├' | '┤' | '┬' | '┴' | '┼' | '╭' | '╮' | '╰' | '╯' =>
            {
                out.push('+');
            }
            '‘' | '’' => out.push('\''),
            '“' | '”' => out.push('"'),
            '×' => out.push('x'),
            '·' | '•' | '●' => out.push('*'),
            '≤' => out.push_str("<="),
            '≥' => out.push_str(">="),
            'µ' | 'μ' => out.push('u'),
            c => out.extend(c.escape_unicode()),
        }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_locale_without_utf_8_gets_ascii() {
        for (locale, is_ascii) in [
            (None, false),
            (Some("C"), true),
            (Some("POSIX"), true),
            (Some("C.UTF-8"), false),
            (Some("de_DE.utf8"), false),
            (Some("de_DE.ISO-8859-1"), true),
        ] {
            assert_eq!(is_ascii_locale(locale.map(str::to_owned)), is_ascii);
        }
        assert_eq!(ascii("a → b … “é”"), "a -> b ... \"\\u{e9}\"");
        assert_eq!(ascii("plain"), "plain");
    }
}
