//! The fields of a component as typed values, and checks of one component alone.

use crate::ast::{self, Field};
use crate::duplicates::{check_unique, report_duplicate};
use crate::members;
use crate::model::{HUNG, Instance, Parameter, READY, Restart, RestartPolicy, STOP};
use crate::settings::{Block, Choice};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::{Literal, LiteralKind, Name, home_in_path};
use std::collections::HashMap;
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::path::Path;
use std::time::Duration;

/// The maximum duration of a field: one day.
const MAX_DURATION: Duration = Duration::from_hours(24);
/// The processor numbers of a Linux CPU set.
const PROCESSORS: RangeInclusive<i64> = 0..=1023;
/// The real-time priorities of Linux.
const PRIORITIES: RangeInclusive<i64> = 1..=99;
/// The valid values of `restart max`.
const RESTARTS: RangeInclusive<i64> = 1..=1000;

/// The context of a declaration.
#[derive(Clone, Debug)]
pub(crate) struct BlockContext<'a> {
    /// The folder of the file.
    pub(crate) folder: &'a Path,
    /// The enclosing groups, each followed by a dot.
    pub(crate) prefix: String,
    /// The innermost enclosing group.
    pub(crate) group: Option<usize>,
    /// The process whose block this is.
    pub(crate) process: Option<Name>,
    /// The values of `middleware` and `domain`.
    pub(crate) choice: Choice,
}

/// The unresolved names in a component.
#[derive(Debug, Default)]
pub(crate) struct References {
    /// Name of the host.
    pub(crate) host: Option<Name>,
    /// Name of the process.
    pub(crate) process: Option<Name>,
    /// The location of `restart`.
    pub(crate) restart: Option<Span>,
    /// The names after `after`.
    pub(crate) after: Vec<Name>,
}

/// An instance without fields.
fn blank(name: &Name, doc: &[String], context: &BlockContext<'_>) -> Instance {
    Instance {
        name: name.clone(),
        path: format!("{}{}", context.prefix, name.text),
        doc: doc.to_vec(),
        group: context.group,
        proxy: None,
        process: None,
        folder: context.folder.to_path_buf(),
        cdsl: None,
        executable: None,
        config: None,
        host: None,
        endpoint: None,
        middleware: context.choice.middleware,
        auto: context.choice.auto,
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
        system_time: None,
        exact: None,
        parameters: Vec::new(),
        arrays: Vec::new(),
        all_members: None,
        adaptor: None,
    }
}

/// The proxy of a group: it has the name of the group, and runs in the block around it.
pub(crate) fn proxy(
    tree: &ast::Group,
    clause: Option<&ast::Middleware>,
    context: &BlockContext<'_>,
    found: &mut Diagnostics,
) -> Instance {
    let mut block = Block::new(&context.choice, found);
    if let Some(clause) = clause {
        block.middleware(clause);
    }
    let choice = block.end();
    Instance {
        middleware: choice.middleware,
        auto: choice.auto,
        settings: choice.settings,
        restart: Restart {
            policy: RestartPolicy::OnFailure,
            ..Restart::default()
        },
        ..blank(&tree.name, &tree.doc, context)
    }
}

/// Builds an instance from its syntax tree. The caller resolves the references.
pub(crate) fn instance(
    tree: &ast::Component,
    context: &BlockContext<'_>,
    found: &mut Diagnostics,
) -> (Instance, References) {
    let mut instance = blank(&tree.name, &tree.doc, context);
    let mut references = References {
        process: context.process.clone(),
        ..References::default()
    };
    // `middleware` may occur several times.
    let words = tree
        .fields
        .iter()
        .filter(|(_, field)| !matches!(field, Field::Middleware(_)));
    check_unique(words.map(|(word, _)| word), "field", found);
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
    instance.auto = choice.auto;
    instance.settings = choice.settings;
    for (word, field) in &tree.fields {
        if let Field::Cdsl(path) | Field::Executable(path) | Field::Config(path) = field {
            found.extend(home_in_path(&path.text, path.span));
        }
        match field {
            Field::Cdsl(text) => instance.cdsl = Some(text.clone()),
            Field::Executable(text) => instance.executable = Some(text.clone()),
            Field::Config(text) => instance.config = Some(text.clone()),
            Field::Endpoint(text) => instance.endpoint = endpoint(text, found),
            Field::Host(name) => references.host = Some(name.clone()),
            Field::Process(name) => match &context.process {
                Some(around) => report_duplicate(word, "clause", around.span, found),
                None => references.process = Some(name.clone()),
            },
            Field::After(names) => references.after.clone_from(names),
            Field::Restart(tree) => {
                instance.restart = restart(tree, found);
                references.restart = Some(word.span);
            }
            Field::Ready(literal) => {
                let ready = duration(literal, word, found);
                instance.ready = ready.unwrap_or(READY);
                if let Some(short) = ready.filter(|ready| *ready < SHORT_READY) {
                    found.push(short_ready(literal, short));
                }
            }
            Field::Stop(literal) => instance.stop = duration(literal, word, found).unwrap_or(STOP),
            Field::Env(variables) => {
                // Unlike keywords, variables are case-sensitive.
                let mut seen: HashMap<&str, Span> = HashMap::new();
                for (name, _) in variables {
                    if let Some(first) = seen.insert(&name.text, name.span) {
                        report_duplicate(name, "variable", first, found);
                    }
                }
                instance.env.clone_from(variables);
            }
            Field::Args(texts) => {
                texts.iter().for_each(|text| check_argument(text, found));
                instance.args.clone_from(texts);
            }
            Field::Cpu(literals) => {
                instance.cpu = processors(literals, found);
                instance.cpu_span = Some(word.span);
            }
            Field::Priority(literal) => {
                instance.priority = priority(literal, found).map(|n| (n, word.span));
            }
            Field::SystemTime => instance.system_time = Some(word.span),
            Field::Record(words) => {
                check_unique(words.iter(), "field", found);
                instance.exact = words.first().map(|word| word.span);
            }
            Field::Parameters(parameters) => {
                let mut seen: HashMap<&str, Span> = HashMap::new();
                for Parameter { path, .. } in parameters {
                    if let Some(first) = seen.insert(&path.text, path.span) {
                        report_duplicate(path, "parameter", first, found);
                    }
                }
                instance.parameters.clone_from(parameters);
            }
            Field::Slots(slots) => {
                instance.arrays = members::listed(&slots.lists, found);
                instance.all_members = slots.all;
                if let (Some(all), Some(array)) = (slots.all, instance.arrays.first()) {
                    let name = &array.name;
                    let message = format!("`all` has the members of `{}` as well", name.text);
                    let error = Diagnostic::error("duplicate-name", name.span, message);
                    let error = error.label(all, "all arrays are listed here");
                    found.push(error.help("remove one of both"));
                }
            }
            Field::Middleware(_) | Field::Domain(_) => {}
        }
    }
    // A field that could not be parsed is not missing.
    if instance.cdsl.is_none() && !tree.incomplete {
        let message = format!("component `{}` has no field `cdsl`", tree.name.text);
        let help = "add `cdsl \"PATH/NAME.cdsl\";`, relative to this file";
        found.push(Diagnostic::error("missing-clause", tree.name.span, message).help(help));
    }
    (instance, references)
}

/// The numbers after `cpu`.
pub(crate) fn processors(literals: &[Literal], found: &mut Diagnostics) -> Vec<u16> {
    let numbers = literals
        .iter()
        .filter_map(|literal| whole_number(literal, "a processor number", &PROCESSORS, found));
    numbers.map(|number| number as u16).collect()
}

/// The number after `priority`.
pub(crate) fn priority(literal: &Literal, found: &mut Diagnostics) -> Option<u8> {
    let number = whole_number(literal, "a priority", &PRIORITIES, found)?;
    Some(number as u8)
}

/// The integer value of a literal. Reports an error if it is not in `allowed`.
pub(crate) fn whole_number(
    literal: &Literal,
    what: &str,
    allowed: &RangeInclusive<i64>,
    found: &mut Diagnostics,
) -> Option<i64> {
    let number = literal.as_i64().filter(|number| allowed.contains(number));
    if number.is_none() {
        let (from, to) = (allowed.start(), allowed.end());
        let message = format!(
            "expected {what} from {from} to {to}, found {}",
            literal.described()
        );
        found.push(Diagnostic::error("out-of-range", literal.span, message));
    }
    number
}

pub(crate) fn duration(
    literal: &Literal,
    word: &Name,
    found: &mut Diagnostics,
) -> Option<Duration> {
    let time = literal.as_nanoseconds().map(Duration::from_nanos);
    let time = time.filter(|time| !time.is_zero() && *time <= MAX_DURATION);
    if time.is_none() {
        let message = format!(
            "`{}` takes a duration such as `5s`, at most one day",
            word.text.to_lowercase()
        );
        found.push(Diagnostic::error("bad-time", literal.span, message));
    }
    time
}

/// Few components start this fast. `ready 10;` most likely means seconds.
const SHORT_READY: Duration = Duration::from_millis(100);

fn short_ready(literal: &Literal, ready: Duration) -> Diagnostic {
    let text = rc_vocabulary::duration::text_of(ready);
    let message = format!("`ready` is {text}, in which few components start");
    let help = match literal.kind {
        LiteralKind::Int(number) => {
            format!(
                "a number without a unit is in milliseconds; write `ready {number}s;` for seconds"
            )
        }
        LiteralKind::Float(_)
        | LiteralKind::String(_)
        | LiteralKind::Bool(_)
        | LiteralKind::Duration(_)
        | LiteralKind::Name(_) => "give it a second or more".to_owned(),
    };
    Diagnostic::warning("short-ready", literal.span, message).help(help)
}

pub(crate) fn restart(tree: &ast::Restart, found: &mut Diagnostics) -> Restart {
    let word = |text: &str| Name::new(text, tree.policy.span);
    let known = RestartPolicy::from_word(&tree.policy.text.to_ascii_lowercase());
    if known.is_none() {
        let message = format!("unknown restart policy `{}`", tree.policy.text);
        found.push(
            Diagnostic::error("unknown-restart", tree.policy.span, message)
                .suggest(&tree.policy.text, RestartPolicy::words()),
        );
    }
    let hung = tree.hung.as_ref().and_then(|literal| {
        let hung = duration(literal, &word("hung"), found)?;
        if hung < HUNG {
            let message = "`hung` takes a duration of at least two seconds: a component counts as hung after that time";
            found.push(Diagnostic::error("bad-time", literal.span, message));
        }
        Some(hung)
    });
    let limit = tree.limit.as_ref().and_then(|(count, within)| {
        let count = whole_number(count, "a number of restarts", &RESTARTS, found);
        let within = duration(within, &word("within"), found);
        Some((count? as u32, within?))
    });
    let backoff = tree.backoff.as_ref();
    let backoff = backoff.and_then(|time_| duration(time_, &word("backoff"), found));
    let policy = known.unwrap_or(RestartPolicy::Never);
    if known.is_some()
        && policy == RestartPolicy::Never
        && (tree.hung.is_some() || tree.limit.is_some() || tree.backoff.is_some())
    {
        let message = "`hung`, `max` and `backoff` have no effect with the policy `never`";
        found.push(Diagnostic::warning(
            "restart-without-effect",
            tree.policy.span,
            message,
        ));
    }
    Restart {
        policy,
        hung,
        limit,
        backoff: backoff.unwrap_or(Restart::BACKOFF),
    }
}

fn endpoint(text: &Name, found: &mut Diagnostics) -> Option<(SocketAddr, Span)> {
    let address = text.text.parse().ok();
    let address = address.filter(|address: &SocketAddr| address.port() != 0);
    if address.is_none() {
        let message = format!("invalid endpoint `{}`", text.text);
        let help =
            "write an IP address and a port from 1 to 65535: `10.0.0.2:7000` or `[::1]:7000`";
        found.push(Diagnostic::error("bad-endpoint", text.span, message).help(help));
    }
    Some((address?, text.span))
}

/// The options that `rcdeploy` gives a component from other fields. A second one in `args` would take
/// the component where the check of the network did not look.
const OWN_OPTIONS: [(&str, &str); 15] = [
    (
        "--network",
        "a component is in the network of its `Deployment`",
    ),
    ("--name", "its name is the one after `Component`"),
    ("--config", "write `config \"FILE\";`"),
    (
        "--clock",
        "write `time simulated by COMPONENT;` into the deployment",
    ),
    (
        "--followers",
        "write `time simulated by COMPONENT;` into the deployment",
    ),
    ("--members", "write `slots { … };`"),
    ("--bind", "write `bind COMPONENT.SLOT -> COMPONENT.SLOT;`"),
    (
        "--transport",
        "write `middleware NAME;`; without it, connections choose their middleware",
    ),
    (
        "--reliable",
        "write `reliability reliable;` into the slot of the .cdsl",
    ),
    ("--convert", "write `bind … { convert; };`"),
    (
        "--providers",
        "write `bind COMPONENT.SLOT -> COMPONENT.SLOT;`",
    ),
    ("--frames", "write `bind … { convert { frames SLOT; }; };`"),
    ("--set", "write `parameters { NAME VALUE; };`"),
    (
        "--set-middleware",
        "write `domain` into the deployment, or `[middleware.NAME]` into the configuration",
    ),
    ("--member", "write a `Component` with the same `process`"),
];

/// Whether `rcdeploy` gives components this option, so that no file can.
pub fn is_own_option(option: &str) -> bool {
    OWN_OPTIONS.iter().any(|(own, _)| *own == option)
}

/// The options with which a component does something else than to run.
const NO_RUN: [&str; 8] = [
    "--replay",
    "--check",
    "--probe",
    "--wait",
    "--help",
    "-h",
    "--version",
    "-V",
];

fn check_argument(text: &Name, found: &mut Diagnostics) {
    let option = text.text.split('=').next().unwrap_or_default();
    let own = OWN_OPTIONS.iter().find(|(own, _)| *own == option);
    let (reason, help) = match own {
        Some((_, help)) => ("`rcdeploy` sets it", *help),
        None if NO_RUN.contains(&option) => (
            "a network runs its components",
            "the component would not run",
        ),
        None => return,
    };
    let message = format!("`{option}` cannot be in `args`: {reason}");
    let error = Diagnostic::error("reserved-argument", text.span, message);
    found.push(error.help(help));
}
