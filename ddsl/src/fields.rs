//! What stands in a component, as typed values: what can be said of one component alone.

use crate::ast::{self, Field};
use crate::model::{BACKOFF, Instance, Policy, READY, Restart, STOP};
use crate::settings::{Block, Choice};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::{Literal, Name};
use std::collections::HashMap;
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::path::Path;
use std::time::Duration;

/// The longest time that a field may name; what is longer is a slip of the pen.
const MAX_DURATION: Duration = Duration::from_secs(24 * 60 * 60);
/// The processors that Linux can name in one set.
const PROCESSORS: RangeInclusive<i64> = 0..=1023;
/// The real-time priorities of Linux.
const PRIORITIES: RangeInclusive<i64> = 1..=99;
/// How often a component may be started again within the time that is given.
const RESTARTS: RangeInclusive<i64> = 1..=1000;

/// Where a component stands.
#[derive(Clone, Debug)]
pub(crate) struct BlockContext<'a> {
    /// The folder of its file.
    pub(crate) folder: &'a Path,
    /// The groups that it is in, with a dot after each.
    pub(crate) prefix: String,
    /// The innermost of them.
    pub(crate) group: Option<usize>,
    /// What `middleware` and `domain` say there.
    pub(crate) choice: Choice,
}

/// Names in a component that lead elsewhere.
#[derive(Debug, Default)]
pub(crate) struct References {
    /// Its host.
    pub(crate) host: Option<Name>,
    /// What it starts after.
    pub(crate) after: Vec<Name>,
}

/// Makes an instance of a tree; its references are still to be followed.
pub(crate) fn instance(
    tree: &ast::Component,
    context: &BlockContext<'_>,
    found: &mut Diagnostics,
) -> (Instance, References) {
    let mut instance = Instance {
        name: tree.name.clone(),
        path: format!("{}{}", context.prefix, tree.name.text),
        doc: tree.doc.clone(),
        group: context.group,
        folder: context.folder.to_path_buf(),
        cdsl: None,
        executable: None,
        config: None,
        host: None,
        endpoint: None,
        middleware: context.choice.middleware,
        settings: Vec::new(),
        after: Vec::new(),
        restart: Restart::default(),
        ready: READY,
        stop: STOP,
        env: Vec::new(),
        args: Vec::new(),
        cpu: Vec::new(),
        cpu_span: None,
        priority: None,
    };
    let mut references = References::default();
    // Several `middleware` may stand there.
    let words = tree
        .fields
        .iter()
        .filter(|(_, field)| !matches!(field, Field::Middleware(_)));
    once(words.map(|(word, _)| word), "field", found);
    let mut block = Block::new(&context.choice, found);
    for (word, field) in &tree.fields {
        match field {
            Field::Middleware(tree) => block.middleware(tree),
            Field::Domain(literal) => block.domain(word, literal),
            _ => {}
        }
    }
    let choice = block.end();
    instance.middleware = choice.middleware;
    instance.settings = choice.settings;
    for (word, field) in &tree.fields {
        match field {
            Field::Cdsl(text) => instance.cdsl = Some(text.clone()),
            Field::Executable(text) => instance.executable = Some(text.clone()),
            Field::Config(text) => instance.config = Some(text.clone()),
            Field::Endpoint(text) => instance.endpoint = endpoint(text, found),
            Field::Host(name) => references.host = Some(name.clone()),
            Field::After(names) => references.after.clone_from(names),
            Field::Restart(tree) => instance.restart = restart(tree, found),
            Field::Ready(literal) => {
                instance.ready = duration(literal, word, found).unwrap_or(READY)
            }
            Field::Stop(literal) => instance.stop = duration(literal, word, found).unwrap_or(STOP),
            Field::Env(variables) => {
                // Unlike the words of the language, variables differ by case.
                let mut seen: HashMap<&str, Span> = HashMap::new();
                for (name, _) in variables {
                    if let Some(first) = seen.insert(&name.text, name.span) {
                        repeated(name, "variable", first, found);
                    }
                }
                instance.env.clone_from(variables);
            }
            Field::Args(texts) => instance.args.clone_from(texts),
            Field::Cpu(literals) => {
                let numbers = literals
                    .iter()
                    .filter_map(|literal| whole_number(literal, "a processor", &PROCESSORS, found));
                instance.cpu = numbers.map(|n| n as u16).collect();
                instance.cpu_span = Some(word.span);
            }
            Field::Priority(literal) => {
                let number = whole_number(literal, "a priority", &PRIORITIES, found);
                instance.priority = number.map(|n| (n as u8, word.span));
            }
            Field::Middleware(_) | Field::Domain(_) => {}
        }
    }
    // A field that is there, but could not be read, has been reported.
    if instance.cdsl.is_none() && !tree.incomplete {
        let message = format!("component `{}` does not say what it is", tree.name.text);
        let help = "add `cdsl \"PATH/NAME.cdsl\";`, relative to this file";
        found.push(Diagnostic::error("missing-clause", tree.name.span, message).help(help));
    }
    (instance, references)
}

/// Says which of these words stand there more than once.
pub(crate) fn once<'a>(
    words: impl IntoIterator<Item = &'a Name>,
    what: &str,
    found: &mut Diagnostics,
) {
    let mut seen: HashMap<String, Span> = HashMap::new();
    for word in words {
        if let Some(first) = seen.insert(word.text.to_lowercase(), word.span) {
            repeated(word, what, first, found);
        }
    }
}

pub(crate) fn repeated(word: &Name, what: &str, first: Span, found: &mut Diagnostics) {
    let message = format!("{what} `{}` is repeated; each stands once", word.text);
    let diagnostic = Diagnostic::error("repeated-clause", word.span, message);
    found.push(diagnostic.label(first, "the first one"));
}

/// The whole number that a literal holds, if it is one of `allowed`.
fn whole_number(
    literal: &Literal,
    what: &str,
    allowed: &RangeInclusive<i64>,
    found: &mut Diagnostics,
) -> Option<i64> {
    let number = literal.as_i64().filter(|number| allowed.contains(number));
    if number.is_none() {
        let (from, to) = (allowed.start(), allowed.end());
        let message = format!(
            "{} is not {what}; allowed are whole numbers from {from} to {to}",
            literal.described()
        );
        found.push(Diagnostic::error("out-of-range", literal.span, message));
    }
    number
}

fn duration(literal: &Literal, word: &Name, found: &mut Diagnostics) -> Option<Duration> {
    let time = literal.as_nanoseconds().map(Duration::from_nanos);
    let time = time.filter(|time| !time.is_zero() && *time <= MAX_DURATION);
    if time.is_none() {
        let message = format!(
            "`{}` takes a time such as `5s`, at most a day",
            word.text.to_lowercase()
        );
        found.push(Diagnostic::error("bad-time", literal.span, message));
    }
    time
}

fn restart(tree: &ast::Restart, found: &mut Diagnostics) -> Restart {
    let word = |text: &str| Name::new(text, tree.policy.span);
    let known = Policy::WORDS
        .iter()
        .find(|(word, _)| word.eq_ignore_ascii_case(&tree.policy.text));
    if known.is_none() {
        let message = format!("unknown restart policy `{}`", tree.policy.text);
        let words = Policy::WORDS.map(|(word, _)| word);
        found.push(
            Diagnostic::error("unknown-restart", tree.policy.span, message)
                .suggest(&tree.policy.text, words),
        );
    }
    let limit = tree.limit.as_ref().and_then(|(count, within)| {
        let count = whole_number(count, "a number of restarts", &RESTARTS, found);
        let within = duration(within, &word("within"), found);
        Some((count? as u32, within?))
    });
    let backoff = tree.backoff.as_ref();
    let backoff = backoff.and_then(|time_| duration(time_, &word("backoff"), found));
    let policy = known.map_or(Policy::Never, |(_, policy)| *policy);
    if known.is_some()
        && policy == Policy::Never
        && (tree.limit.is_some() || tree.backoff.is_some())
    {
        let message = "a component that is never started again needs no `max` and no `backoff`";
        found.push(Diagnostic::warning(
            "restart-without-effect",
            tree.policy.span,
            message,
        ));
    }
    Restart {
        policy,
        limit,
        backoff: backoff.unwrap_or(BACKOFF),
    }
}

fn endpoint(text: &Name, found: &mut Diagnostics) -> Option<(SocketAddr, Span)> {
    let address = text.text.parse().ok();
    let address = address.filter(|address: &SocketAddr| address.port() != 0);
    if address.is_none() {
        let message = format!("`{}` is not an endpoint", text.text);
        let help = "an endpoint is an IP address and a port from 1 to 65535, as in `10.0.0.2:7000` or `[::1]:7000`";
        found.push(Diagnostic::error("bad-endpoint", text.span, message).help(help));
    }
    Some((address?, text.span))
}
