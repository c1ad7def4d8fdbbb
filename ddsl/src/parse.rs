//! From text to model. Never stops: what could not be read is a diagnostic, and the rest is read.

use crate::model::{Bind, Deployment, Instance, READY, STOP, SlotPath};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Language, Leaf, Literal, Name, Reader};
use std::collections::HashMap;
use std::time::Duration;

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "../../syntax/src/common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

const DECLS: [&str; 6] = ["Component", "Host", "Group", "bind", "middleware", "domain"];
const FIELDS: [&str; 13] = [
    "cdsl",
    "executable",
    "config",
    "host",
    "endpoint",
    "after",
    "restart",
    "ready",
    "stop",
    "env",
    "args",
    "cpu",
    "priority",
];

/// Reads one `.ddsl` text and checks it in itself.
pub fn parse(sources: &SourceMap, source: SourceId) -> (Option<Deployment>, Diagnostics) {
    let mut reader = Reader::new(sources, source);
    let deployment = file(&mut reader);
    if let Some(deployment) = &deployment {
        check(deployment, &mut reader.found);
    }
    (deployment, reader.found)
}

fn file(r: &mut Reader<'_>) -> Option<Deployment> {
    let mut found = None;
    for pair in r.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::import => later(r, &pair, "`import`"),
            Rule::deployment => found = Some(deployment(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    found
}

fn later(r: &mut Reader<'_>, pair: &Pair<'_, Rule>, what: &str) {
    let span = r.first_word(pair).span;
    let message =
        format!("{what} is read, but this version does not support it yet; it has no effect");
    r.found
        .push(Diagnostic::warning("not-supported-yet", span, message));
}

fn unknown(
    r: &mut Reader<'_>,
    pair: &Pair<'_, Rule>,
    rules: &[(&str, Rule)],
    allowed: &[&'static str],
    what: &str,
) {
    let first = r.first_word(pair);
    let rule = rules
        .iter()
        .find(|(word, _)| word.eq_ignore_ascii_case(&first.text));
    if let Some((_, rule)) = rule {
        return r.unread(pair, *rule);
    }
    let message = format!("`{}` does not begin {what}", first.text);
    let diagnostic = Diagnostic::error("unknown-field", first.span, message);
    r.found
        .push(diagnostic.suggest(&first.text, allowed.iter().copied()));
}

fn deployment(r: &mut Reader<'_>, pair: Pair<'_, Rule>) -> Deployment {
    let mut deployment = Deployment {
        name: Name::new("", r.span(&pair)),
        middleware: None,
        components: Vec::new(),
        binds: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => deployment.name = r.name(&part),
            Rule::decl => part.into_inner().for_each(|p| decl(r, p, &mut deployment)),
            _ => {}
        }
    }
    deployment
}

fn decl(r: &mut Reader<'_>, pair: Pair<'_, Rule>, deployment: &mut Deployment) {
    match pair.as_rule() {
        Rule::component => {
            let instance = instance(r, pair);
            deployment.components.push(instance);
        }
        Rule::bind => {
            let paths: Vec<Pair<'_, Rule>> = pair
                .clone()
                .into_inner()
                .filter(|p| p.as_rule() == Rule::slot_path)
                .collect();
            r.texts(pair);
            let mut paths = paths.into_iter().map(|p| slot_path(r, p));
            if let (Some(Some(consumer)), Some(Some(provider))) = (paths.next(), paths.next()) {
                deployment.binds.push(Bind { consumer, provider });
            }
        }
        Rule::middleware => {
            let name = r.texts(pair).into_iter().next();
            if let (Some(name), Some(first)) = (&name, &deployment.middleware) {
                let diagnostic = Diagnostic::error(
                    "repeated-clause",
                    name.span,
                    "the middleware is named twice",
                );
                r.found.push(diagnostic.label(first.span, "the first one"));
            }
            deployment.middleware = name;
        }
        Rule::host => later(r, &pair, "`Host`"),
        Rule::group => {
            let span = r.first_word(&pair).span;
            let message =
                "`Group` is not supported yet; put its components directly into the deployment";
            r.found
                .push(Diagnostic::error("not-supported-yet", span, message));
        }
        Rule::domain => later(r, &pair, "`domain`"),
        _ => {
            let rules = [
                ("component", Rule::component),
                ("host", Rule::host),
                ("group", Rule::group),
                ("bind", Rule::bind),
                ("middleware", Rule::middleware),
                ("domain", Rule::domain),
            ];
            unknown(r, &pair, &rules, &DECLS, "a declaration of a deployment");
        }
    }
}

/// `instance.slot`; groups, which would make it longer, are not supported yet.
fn slot_path(r: &mut Reader<'_>, pair: Pair<'_, Rule>) -> Option<SlotPath> {
    let span = r.span(&pair);
    let names = pair.into_inner().filter(|p| p.as_rule() == Rule::name);
    let names: Vec<Name> = names.map(|p| r.name(&p)).collect();
    if let Ok([instance, slot]) = <[Name; 2]>::try_from(names) {
        Some(SlotPath { instance, slot })
    } else {
        let message = "a slot is `instance.slot`; paths through groups are not supported yet";
        r.found
            .push(Diagnostic::error("not-supported-yet", span, message));
        None
    }
}

fn instance(r: &mut Reader<'_>, pair: Pair<'_, Rule>) -> Instance {
    let mut instance = Instance {
        name: Name::new("", r.span(&pair)),
        cdsl: None,
        executable: None,
        config: None,
        after: Vec::new(),
        ready: READY,
        stop: STOP,
        env: Vec::new(),
        args: Vec::new(),
    };
    let mut seen: HashMap<String, Span> = HashMap::new();
    let mut unread = false;
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => instance.name = r.name(&part),
            Rule::field => {
                let first = r.first_word(&part);
                if let Some(before) = seen.insert(first.text.to_lowercase(), first.span) {
                    let message = format!("`{}` is repeated; each field stands once", first.text);
                    let diagnostic = Diagnostic::error("repeated-clause", first.span, message);
                    r.found.push(diagnostic.label(before, "the first one"));
                }
                part.into_inner()
                    .for_each(|p| field(r, p, &first, &mut instance));
            }
            Rule::unread => {
                unread = true;
                let rules = [
                    ("cdsl", Rule::text_field),
                    ("executable", Rule::text_field),
                    ("config", Rule::text_field),
                    ("endpoint", Rule::text_field),
                    ("host", Rule::host_ref),
                    ("after", Rule::after),
                    ("restart", Rule::restart),
                    ("ready", Rule::time_field),
                    ("stop", Rule::time_field),
                    ("env", Rule::env),
                    ("args", Rule::args),
                    ("cpu", Rule::cpu),
                    ("priority", Rule::priority),
                ];
                unknown(r, &part, &rules, &FIELDS, "a field of a component");
            }
            _ => {}
        }
    }
    // A field that is there, but could not be read, has been reported.
    if instance.cdsl.is_none() && !unread {
        let message = format!("component `{}` does not say what it is", instance.name.text);
        let help = "add `cdsl \"PATH/NAME.cdsl\";`, relative to this file";
        r.found
            .push(Diagnostic::error("missing-clause", instance.name.span, message).help(help));
    }
    instance
}

fn field(r: &mut Reader<'_>, pair: Pair<'_, Rule>, first: &Name, instance: &mut Instance) {
    let word = first.text.to_lowercase();
    match pair.as_rule() {
        Rule::text_field => {
            let kept = pair.clone();
            let text = r.texts(pair).into_iter().next();
            match word.as_str() {
                "cdsl" => instance.cdsl = text,
                "executable" => instance.executable = text,
                "config" => instance.config = text,
                _ => later(r, &kept, "`endpoint`"),
            }
        }
        Rule::after => instance.after = r.texts(pair),
        Rule::args => instance.args = r.texts(pair),
        Rule::env => {
            let variables = pair.into_inner().filter(|p| p.as_rule() == Rule::variable);
            for variable in variables.collect::<Vec<_>>() {
                if let Ok([name, value]) = <[Name; 2]>::try_from(r.texts(variable)) {
                    instance.env.push((name, value));
                }
            }
        }
        Rule::time_field => {
            let time = pair
                .clone()
                .into_inner()
                .find(|p| p.as_rule() == Rule::time);
            r.texts(pair);
            let Some(time) = time else { return };
            let span = r.span(&time);
            let literal = Literal::parse(time.as_str(), span);
            match literal.as_nanoseconds().filter(|ns| *ns > 0) {
                Some(ns) if word == "ready" => instance.ready = Duration::from_nanos(ns),
                Some(ns) => instance.stop = Duration::from_nanos(ns),
                None => {
                    let message = format!("`{word}` takes a time such as `5s`");
                    r.found.push(Diagnostic::error("bad-time", span, message));
                }
            }
        }
        _ => {
            later(r, &pair, &format!("`{word}`"));
            r.texts(pair);
        }
    }
}

/// Names that nobody has, names that two have, and circles of `after`.
fn check(deployment: &Deployment, found: &mut Diagnostics) {
    let names: Vec<&str> = deployment
        .components
        .iter()
        .map(|c| c.name.text.as_str())
        .collect();
    for (at, instance) in deployment.components.iter().enumerate() {
        let earlier = deployment.components[..at]
            .iter()
            .find(|c| c.name.text.eq_ignore_ascii_case(&instance.name.text));
        if let Some(first) = earlier {
            let message = format!("component `{}` is there twice", instance.name.text);
            let diagnostic = Diagnostic::error("duplicate-name", instance.name.span, message);
            found.push(diagnostic.label(first.name.span, "first declared here"));
        }
        if instance.name.text.eq_ignore_ascii_case("rcdeploy") {
            let message = "`rcdeploy` is the deployer's own name in every network";
            found.push(Diagnostic::error(
                "reserved-name",
                instance.name.span,
                message,
            ));
        }
        for after in instance
            .after
            .iter()
            .filter(|a| !names.contains(&a.text.as_str()))
        {
            found.push(unknown_instance(after, &names));
        }
    }
    for bind in &deployment.binds {
        for end in [&bind.consumer, &bind.provider] {
            if !names.contains(&end.instance.text.as_str()) {
                found.push(unknown_instance(&end.instance, &names));
            }
        }
    }
    if let Some(middleware) = &deployment.middleware {
        let words = rc_cdsl::model::Backend::WORDS.map(|(word, _)| word);
        if !words
            .iter()
            .any(|w| w.eq_ignore_ascii_case(&middleware.text))
        {
            let message = format!("unknown middleware `{}`", middleware.text);
            let known = ["iceoryx2", "dds", "ros2"];
            found.push(
                Diagnostic::error("unknown-middleware", middleware.span, message)
                    .suggest(&middleware.text, known),
            );
        }
    }
    cycles(deployment, found);
}

fn unknown_instance(name: &Name, names: &[&str]) -> Diagnostic {
    let message = format!("there is no component `{}` in this deployment", name.text);
    Diagnostic::error("unknown-instance", name.span, message)
        .suggest(&name.text, names.iter().copied())
}

fn cycles(deployment: &Deployment, found: &mut Diagnostics) {
    let index = |name: &str| {
        deployment
            .components
            .iter()
            .position(|c| c.name.text == name)
    };
    let mut done = vec![false; deployment.components.len()];
    for start in 0..deployment.components.len() {
        let mut path = vec![start];
        walk(deployment, &index, &mut path, &mut done, found);
    }
}

fn walk(
    deployment: &Deployment,
    index: &dyn Fn(&str) -> Option<usize>,
    path: &mut Vec<usize>,
    done: &mut [bool],
    found: &mut Diagnostics,
) {
    let Some(&last) = path.last() else { return };
    if done[last] {
        return;
    }
    for after in &deployment.components[last].after {
        let Some(next) = index(&after.text) else {
            continue;
        };
        if let Some(at) = path.iter().position(|p| *p == next) {
            let names: Vec<&str> = path[at..]
                .iter()
                .chain([&next])
                .map(|p| deployment.components[*p].name.text.as_str())
                .collect();
            let message = format!(
                "these components wait for each other: {}",
                names.join(" after ")
            );
            found.push(Diagnostic::error("after-cycle", after.span, message));
        } else {
            path.push(next);
            walk(deployment, index, path, done, found);
            path.pop();
        }
    }
    done[last] = true;
}

impl Language for Rule {
    type Grammar = Grammar;
    const FILE: Self = Self::file;
    const HOLDS: &'static str = "`Deployment NAME { … };`";

    fn leaf(self) -> Option<Leaf> {
        match self {
            Self::name | Self::number => Some(Leaf::Word),
            Self::string => Some(Leaf::Quoted),
            Self::semicolon => Some(Leaf::Semicolon),
            _ => None,
        }
    }

    fn word(self) -> Option<&'static str> {
        Some(match self {
            Self::EOI => "the end of the file",
            Self::file | Self::kw_deployment => "`Deployment`",
            Self::name => "a name",
            Self::slot_path => "a slot such as `simulator.Laser`",
            Self::string => "a text in quotes",
            Self::number => "a number",
            Self::time | Self::duration => "a time such as `5s`",
            Self::field => "a field",
            Self::decl => "a declaration",
            Self::semicolon | Self::begins_next => "`;`",
            Self::open => "`{`",
            Self::close => "`}`",
            Self::comma => "`,`",
            Self::arrow => "`->`",
            Self::dot => "`.`",
            Self::kw_within => "`within`",
            Self::variable => "`NAME \"value\";`",
            _ => return None,
        })
    }
}
