//! Checks the configuration of one instance, a TOML file, against the model of the parameters.

use crate::checker::Checker;
use crate::document::{self, Locator};
use crate::middleware::Settings;
use crate::model::{ConversionError, Parameters, Type, Value};
use crate::parameters::Reader;
use crate::rules;
use crate::untyped_value::UntypedValue;
use crate::values::Values;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span, stray_character};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::ops::Range;
use std::time::Duration;
use toml_edit::{Document, TableLike, TomlError};

const TABLES: [&str; 4] = ["component", "bindings", "middleware", "parameters"];
pub(crate) const COMPONENT: [&str; 2] = ["period", "log"];
/// The shortest period in nanoseconds, as in a `.cdsl`.
pub(crate) const SHORTEST_PERIOD: u64 = 100_000;
/// The allowed values of `log`.
pub(crate) const LEVELS: [&str; 5] = ["error", "warn", "info", "debug", "trace"];

/// The contents of a configuration file, with the defaults of parameters that it does not set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Configuration {
    /// `period` of `[component]`: the time between two calls of `compute()`.
    pub period: Option<Duration>,
    /// `log` of `[component]`: `error`, `warn`, `info`, `debug` or `trace`.
    pub log: Option<String>,
    /// `[bindings]`, by slot.
    pub bindings: BTreeMap<String, Binding>,
    /// `[middleware.NAME]`.
    pub middleware: Settings,
    /// `[parameters]`.
    pub parameters: Values,
    /// Where the file has secret values.
    pub secrets: Vec<Span>,
}

/// Reports secrets in a file that other users of the machine can read. `mode` is that of the file,
/// as in stat(2).
pub fn check_readable(configuration: &Configuration, mode: u32, found: &mut Diagnostics) {
    if let Some(first) = configuration.secrets.first()
        && mode & 0o044 != 0
    {
        let message = "other users of this machine can read the secrets of this file";
        let own = Diagnostic::warning("readable-secret", *first, message);
        let mut more = Diagnostics::new();
        more.push(own.help("take their rights away with `chmod go= FILE`"));
        more.redact(&configuration.secrets);
        found.extend(more);
    }
}

/// An address under `[bindings]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The address.
    pub address: String,
    /// The location of the slot's name.
    pub span: Span,
}

/// Checks one configuration and reports all errors at once. `parameters` is the model of the
/// component's parameters, if it has any. The result leaves out the values that have errors.
pub fn check(
    sources: &SourceMap,
    source: SourceId,
    parameters: Option<&Parameters>,
) -> (Configuration, Diagnostics) {
    check_with(sources, source, parameters, &BTreeMap::new())
}

/// As [`check`], with values for parameters that have no default and that the file does not set,
/// by their paths.
pub fn check_with(
    sources: &SourceMap,
    source: SourceId,
    parameters: Option<&Parameters>,
    given: &BTreeMap<String, UntypedValue>,
) -> (Configuration, Diagnostics) {
    let (configuration, found, _) = read(sources, source, parameters, given);
    (configuration, found)
}

/// The configuration of a component without a file. The error lists the paths of parameters that
/// have no default.
pub fn defaults(parameters: Option<&Parameters>) -> Result<Configuration, Vec<String>> {
    defaults_with(parameters, &BTreeMap::new())
}

/// As [`defaults`], with values for parameters that have no default, by their paths.
pub fn defaults_with(
    parameters: Option<&Parameters>,
    given: &BTreeMap<String, UntypedValue>,
) -> Result<Configuration, Vec<String>> {
    let mut sources = SourceMap::new();
    let source = sources.add("", "");
    let (configuration, _, missing) = read(&sources, source, parameters, given);
    if missing.is_empty() {
        Ok(configuration)
    } else {
        Err(missing)
    }
}

fn read(
    sources: &SourceMap,
    source: SourceId,
    parameters: Option<&Parameters>,
    given: &BTreeMap<String, UntypedValue>,
) -> (Configuration, Diagnostics, Vec<String>) {
    let mut checker = Checker {
        locator: Locator { source },
        // Without a model, any parameter may be secret.
        has_secrets: parameters.is_none_or(Parameters::has_secrets),
        secrets: Vec::new(),
        found: Diagnostics::new(),
        missing: Vec::new(),
    };
    let mut configuration = Configuration::default();
    let (text, errors) = readable(sources.text(source));
    for error in &errors {
        let span = checker.locator.span(error.span(), checker.locator.start());
        if checker.has_secrets {
            let text = sources.text(source);
            checker.redact(document::values_in_lines(text, span.start..span.end));
        }
        checker
            .found
            .push(toml_error(sources, span, error.message()));
    }
    if let Some(document) = text.as_ref().and_then(|text| Document::parse(&**text).ok()) {
        checker.document(document.as_table(), parameters, given, &mut configuration);
    }
    if !errors.is_empty() {
        // A line that cannot be read is not missing.
        let consequences = [
            "unset-parameter",
            "missing-parameter",
            "rule-broken",
            "wrong-length",
        ];
        let found = std::mem::take(&mut checker.found).into_iter();
        let found = found.filter(|d| !consequences.contains(&d.code));
        checker.found.extend(found);
    }
    checker.found.redact(&checker.secrets);
    configuration.secrets = checker.secrets;
    (configuration, checker.found, checker.missing)
}

/// The finding about a line that is not TOML. It omits the value, which may be a secret.
fn toml_error(sources: &SourceMap, span: Span, message: &str) -> Diagnostic {
    let text = sources.text(span.source);
    let rest = text.get(span.start..).unwrap_or_default();
    let line = rest.lines().next().unwrap_or_default();
    let outside = line.split(['"', '\'', '#']).next().unwrap_or_default();
    let stray = outside.char_indices().find_map(|(at, c)| {
        let place = Span::new(span.source, span.start + at, span.start + at + c.len_utf8());
        stray_character(c, place)
    });
    if let Some(stray) = stray {
        return stray;
    }
    let word = outside.trim_end();
    let is_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    let begins = word.starts_with(|c: char| c.is_ascii_alphabetic());
    let is_value = ["invalid boolean", "invalid float", "string values must be"]
        .iter()
        .any(|known| message.starts_with(known));
    let is_text = is_value && begins && word.chars().all(is_word);
    if let Some(help) = not_a_number(text, span.start) {
        return Diagnostic::error("toml-syntax", span, "this is not a number").help(help);
    }
    if is_value && word.is_empty() {
        return Diagnostic::error("toml-syntax", span, "expected a value");
    }
    if is_text || message.starts_with("string values must be quoted") {
        let error = Diagnostic::error("toml-syntax", span, "a text needs quotes");
        return match word.to_ascii_lowercase().as_str() {
            "true" | "false" | "yes" | "no" | "on" | "off" => {
                error.help("a bool is `true` or `false`")
            }
            _ => error,
        };
    }
    let message = message.lines().collect::<Vec<_>>().join("; ");
    Diagnostic::error("toml-syntax", span, message)
}

/// The corrected text of a value that begins as a number does and has an error at `at`.
fn not_a_number(text: &str, at: usize) -> Option<&'static str> {
    let start = text[..at].rfind('\n').map_or(0, |at| at + 1);
    let line = text[start..].lines().next()?;
    let (key, value) = line.split_once('=')?;
    let value = value.split('#').next().unwrap_or_default().trim();
    let unsigned = value.trim_start_matches(['+', '-']);
    let begins = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    if at < start + key.len() || !(begins(unsigned) || unsigned.starts_with('.')) {
        return None;
    }
    if is_address(unsigned) {
        return Some("a text, such as an address, needs quotes");
    }
    // A second entry in the line, a date, a time.
    let follows_digit = unsigned.as_bytes().windows(2);
    let mut follows_digit = follows_digit.filter(|pair| pair[0].is_ascii_digit());
    if unsigned.contains('=') || follows_digit.any(|pair| matches!(pair[1], b'-' | b':')) {
        return None;
    }
    if unsigned.starts_with('.') || unsigned.ends_with('.') {
        return Some("digits stand on both sides of the point");
    }
    // A comma ends an element of an array, and an entry of a table in one line.
    let mut parts = unsigned.split(',');
    if parts.clone().count() == 2 && parts.all(begins) {
        return Some("the decimal point is `.`");
    }
    let has_letter = unsigned.contains(|c: char| c.is_alphabetic());
    (has_letter && !unsigned.contains(']'))
        .then_some("a number has no unit here, and a text needs quotes")
}

/// Whether a text looks like an IPv4 address, maybe with a port or the length of a prefix.
fn is_address(text: &str) -> bool {
    let address = text.split([':', '/']).next().unwrap_or_default();
    address.parse::<Ipv4Addr>().is_ok()
}

/// The largest number of lines that are left out to read the rest of a file.
const MAX_LEFT_OUT: usize = 20;

/// The text with the lines that are not TOML replaced by spaces, and their errors. `None` if the
/// rest still cannot be read. Only lines that set a key, or seem to, are replaced, never the head
/// of a table.
fn readable(text: &str) -> (Option<Cow<'_, str>>, Vec<TomlError>) {
    let mut text = Cow::Borrowed(text);
    let mut errors: Vec<TomlError> = Vec::new();
    loop {
        let Err(error) = Document::parse(&*text) else {
            return (Some(text), errors);
        };
        let line = error.span().map(|span| {
            let start = text[..span.start].rfind('\n').map_or(0, |at| at + 1);
            let end = text[start..].find('\n').map_or(text.len(), |at| start + at);
            start..end
        });
        errors.push(error);
        let is_entry = |line: &Range<usize>| {
            let line = text[line.clone()].trim();
            // `key = value`, `key: value`, or a key alone.
            let key = line.split(['=', ':', '#']).next().unwrap_or_default();
            let word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
            let key = key.trim();
            !key.is_empty() && key.chars().all(word)
        };
        let Some(line) = line.filter(is_entry) else {
            return (None, errors);
        };
        if errors.len() > MAX_LEFT_OUT {
            return (None, errors);
        }
        let spaces = " ".repeat(line.len());
        text.to_mut().replace_range(line, &spaces);
    }
}

/// The rules that the defaults violate, each by its index and with an explanation. Rules inside a
/// list are evaluated for one element with defaults.
#[cfg(feature = "tools")]
pub fn violations_by_defaults(parameters: &Parameters) -> Vec<(usize, String)> {
    let mut sources = SourceMap::new();
    let source = sources.add("", "");
    let mut all: Vec<(usize, String)> = Vec::new();
    for with_sample_elements in [false, true] {
        let mut reader = Reader {
            locator: Locator { source },
            given: &BTreeMap::new(),
            found: &mut Diagnostics::new(),
            missing: Vec::new(),
            secrets: Vec::new(),
            has_secrets: false,
            with_sample_elements,
        };
        let start = reader.locator.start();
        let block = reader.block(&parameters.parameters, None, "", start);
        for (at, violation) in rules::violations(&parameters.rules, &block) {
            if all.iter().all(|(known, _)| *known != at) {
                all.push((at, violation.explanation));
            }
        }
    }
    all
}

impl Checker {
    fn document(
        &mut self,
        root: &dyn TableLike,
        parameters: Option<&Parameters>,
        given_values: &BTreeMap<String, UntypedValue>,
        out: &mut Configuration,
    ) {
        self.unknown_keys(root, &TABLES, "", self.locator.start());
        if let Some((table, at)) = self.table(root, "component") {
            self.unknown_keys(table, &COMPONENT, "component.", at);
            out.period = self.period(table, at);
            out.log = self.log(table, at);
        }
        if let Some((table, at)) = self.table(root, "bindings") {
            for (slot, item) in table.iter() {
                // `lasers.front = "…"` is a table to TOML.
                let Some(members) = item.as_table_like() else {
                    self.binding(table, (slot, slot.to_owned()), item, at, out);
                    continue;
                };
                for (name, item) in members.iter() {
                    let member = rc_vocabulary::member::path(slot, name);
                    self.binding(members, (name, member), item, at, out);
                }
            }
        }
        if let Some((table, at)) = self.table(root, "middleware") {
            out.middleware = self.middlewares(table, at);
        }
        let given = self.table(root, "parameters");
        if given.is_none() && root.contains_key("parameters") {
            return;
        }
        let declared = parameters.map_or(&[][..], |model| &model.parameters);
        let (table, at) = given.map_or((None, self.locator.start()), |(table, at)| {
            (Some(table), at)
        });
        let mut reader = Reader {
            locator: self.locator,
            given: given_values,
            found: &mut self.found,
            missing: Vec::new(),
            secrets: Vec::new(),
            has_secrets: self.has_secrets,
            with_sample_elements: false,
        };
        let block = reader.block(declared, table, "", at);
        self.missing = reader.missing;
        self.secrets.append(&mut reader.secrets);
        let rules = parameters.map_or(&[][..], |model| &model.rules);
        for (_, violation) in rules::violations(rules, &block) {
            self.found.push(violation.diagnostic());
        }
        out.parameters = block.values();
    }

    /// Takes the address of a slot, which `table` has under `key`.
    fn binding(
        &mut self,
        table: &dyn TableLike,
        (key, slot): (&str, String),
        item: &toml_edit::Item,
        at: Span,
        out: &mut Configuration,
    ) {
        let Some(address) = item.as_str() else {
            let path = format!("bindings.{slot}");
            return self.wrong_type(item, &path, at, "an address as a string");
        };
        if let Err(reason) = rc_vocabulary::address::check(address) {
            let span = self.locator.span(item.span(), at);
            let error = Diagnostic::error("bad-address", span, reason);
            return self.found.push(error);
        }
        let span = table.key(key).and_then(toml_edit::Key::span);
        let binding = Binding {
            address: address.to_owned(),
            span: self.locator.span(span, at),
        };
        out.bindings.insert(slot, binding);
    }

    fn period(&mut self, table: &dyn TableLike, at: Span) -> Option<Duration> {
        let item = table.get("period")?;
        match document::value(item)
            .ok_or(ConversionError::WrongType)
            .and_then(|value| Type::Duration.convert(&value))
        {
            Ok(Value::Duration(ns)) if ns >= SHORTEST_PERIOD => {
                return Some(Duration::from_nanos(ns));
            }
            Ok(_) | Err(ConversionError::OutOfRange) => {
                let message = format!(
                    "`component.period` cannot be {}",
                    document::described(item, false)
                );
                let span = self.locator.span(item.span(), at);
                let diagnostic = Diagnostic::error("out-of-range", span, message);
                self.found
                    .push(diagnostic.help("allowed is a duration of at least 100us"));
            }
            Err(ConversionError::WrongType) => {
                self.wrong_type(item, "component.period", at, Type::Duration.described());
            }
        }
        None
    }

    fn log(&mut self, table: &dyn TableLike, at: Span) -> Option<String> {
        let item = table.get("log")?;
        match item.as_str() {
            Some(level) if LEVELS.contains(&level) => return Some(level.to_owned()),
            Some(level) => {
                let message = format!(
                    "`component.log` cannot be {}",
                    document::described(item, false)
                );
                let span = self.locator.span(item.span(), at);
                self.found.push(
                    Diagnostic::error("invalid-choice", span, message).suggest(level, LEVELS),
                );
            }
            None => self.wrong_type(item, "component.log", at, "a level as a string"),
        }
        None
    }
}
