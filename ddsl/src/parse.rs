//! From text to model. Never stops: what could not be read is a diagnostic, and the rest is read.

use crate::model::{Bind, Deployment, Instance, READY, STOP, SlotPath};
use pest::Parser;
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{
    Literal, Name, Trivia, explain, missing_semicolon, nesting, unclosed_comment, unescape,
};
use std::collections::HashMap;
use std::time::Duration;

#[derive(pest_derive::Parser)]
#[grammar = "../../syntax/src/common.pest"]
#[grammar = "grammar.pest"]
struct Grammar;

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
    let text = sources.text(source);
    let mut reader = Reader {
        source,
        text,
        trivia: Trivia::new(text),
        found: Diagnostics::new(),
    };
    let deployment = reader.file();
    if let Some(deployment) = &deployment {
        check(deployment, &mut reader.found);
    }
    (deployment, reader.found)
}

struct Reader<'a> {
    source: SourceId,
    text: &'a str,
    trivia: Trivia<'a>,
    found: Diagnostics,
}

impl<'a> Reader<'a> {
    fn file(&mut self) -> Option<Deployment> {
        if let Some(unclosed) = unclosed_comment(&self.trivia, self.source) {
            self.found.push(unclosed);
            return None;
        }
        if self.trivia.significant().is_empty() {
            let message = "this file is empty; it should hold `Deployment NAME { … };`";
            self.found.push(Diagnostic::error(
                "empty-file",
                Span::new(self.source, 0, 0),
                message,
            ));
            return None;
        }
        if let Some(deep) = nesting(self.text, self.source) {
            self.found.push(deep);
            return None;
        }
        let Ok(mut pairs) = Grammar::parse(Rule::file, self.text) else {
            self.found.extend(explain::<Grammar, Rule>(
                Rule::file,
                self.text,
                self.source,
                0,
                word,
            ));
            return None;
        };
        let mut deployment = None;
        for pair in pairs.next().into_iter().flat_map(Pair::into_inner) {
            match pair.as_rule() {
                Rule::import => self.later(&pair, "`import`"),
                Rule::deployment => deployment = Some(self.deployment(pair)),
                Rule::trailing => {
                    let message = "there is text after the end of the deployment; a file holds one";
                    let start = pair.as_span().start();
                    let first = pair
                        .as_str()
                        .lines()
                        .next()
                        .unwrap_or_default()
                        .trim_end()
                        .len();
                    let span = Span::new(self.source, start, start + first);
                    self.found
                        .push(Diagnostic::error("text-after-end", span, message));
                }
                _ => {}
            }
        }
        deployment
    }

    fn span(&self, pair: &Pair<'a, Rule>) -> Span {
        Span::new(self.source, pair.as_span().start(), pair.as_span().end())
    }

    fn name(&self, pair: &Pair<'a, Rule>) -> Name {
        match pair.as_rule() {
            Rule::string => Name::new(unescape(pair.as_str()), self.span(pair)),
            _ => Name::new(pair.as_str(), self.span(pair)),
        }
    }

    /// The names, texts and numbers directly inside a pair, its semicolon checked.
    fn names(&mut self, pair: Pair<'a, Rule>) -> Vec<Name> {
        let mut names = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name | Rule::string | Rule::number => names.push(self.name(&part)),
                Rule::semicolon if part.as_str().is_empty() => {
                    self.found.push(missing_semicolon(
                        &self.trivia,
                        self.source,
                        part.as_span().start(),
                    ));
                }
                _ => {}
            }
        }
        names
    }

    /// The first word of a pair.
    fn first_word(&self, pair: &Pair<'a, Rule>) -> Name {
        let text = pair.as_str();
        let end = text
            .find(|c: char| !(c.is_alphanumeric() || c == '_'))
            .unwrap_or(text.len());
        let end = if end == 0 {
            text.chars().next().map_or(0, char::len_utf8)
        } else {
            end
        };
        let start = pair.as_span().start();
        Name::new(&text[..end], Span::new(self.source, start, start + end))
    }

    fn later(&mut self, pair: &Pair<'a, Rule>, what: &str) {
        let span = self.first_word(pair).span;
        let message =
            format!("{what} is read, but this version does not support it yet; it has no effect");
        self.found
            .push(Diagnostic::warning("not-supported-yet", span, message));
    }

    fn unread(
        &mut self,
        pair: &Pair<'a, Rule>,
        rules: &[(&str, Rule)],
        allowed: &[&'static str],
        what: &str,
    ) {
        let first = self.first_word(pair);
        let rule = rules
            .iter()
            .find(|(word, _)| word.eq_ignore_ascii_case(&first.text));
        if let Some((_, rule)) = rule {
            let found =
                explain::<Grammar, Rule>(*rule, pair.as_str(), self.source, first.span.start, word);
            return self.found.extend(found);
        }
        let message = format!("`{}` does not begin {what}", first.text);
        let diagnostic = Diagnostic::error("unknown-field", first.span, message);
        self.found
            .push(diagnostic.suggest(&first.text, allowed.iter().copied()));
    }

    fn deployment(&mut self, pair: Pair<'a, Rule>) -> Deployment {
        let mut deployment = Deployment {
            name: Name::new("", self.span(&pair)),
            middleware: None,
            components: Vec::new(),
            binds: Vec::new(),
        };
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => deployment.name = self.name(&part),
                Rule::decl => part
                    .into_inner()
                    .for_each(|p| self.decl(p, &mut deployment)),
                _ => {}
            }
        }
        deployment
    }

    fn decl(&mut self, pair: Pair<'a, Rule>, deployment: &mut Deployment) {
        match pair.as_rule() {
            Rule::component => {
                let instance = self.instance(pair);
                deployment.components.push(instance);
            }
            Rule::bind => {
                let paths: Vec<Pair<'a, Rule>> = pair
                    .clone()
                    .into_inner()
                    .filter(|p| p.as_rule() == Rule::slot_path)
                    .collect();
                self.names(pair);
                let mut paths = paths.into_iter().map(|p| self.slot_path(p));
                if let (Some(Some(consumer)), Some(Some(provider))) = (paths.next(), paths.next()) {
                    deployment.binds.push(Bind { consumer, provider });
                }
            }
            Rule::middleware => {
                let name = self.names(pair).into_iter().next();
                if let (Some(name), Some(first)) = (&name, &deployment.middleware) {
                    let diagnostic = Diagnostic::error(
                        "repeated-clause",
                        name.span,
                        "the middleware is named twice",
                    );
                    self.found
                        .push(diagnostic.label(first.span, "the first one"));
                }
                deployment.middleware = name;
            }
            Rule::host => self.later(&pair, "`Host`"),
            Rule::group => {
                let span = self.first_word(&pair).span;
                let message =
                    "`Group` is not supported yet; put its components directly into the deployment";
                self.found
                    .push(Diagnostic::error("not-supported-yet", span, message));
            }
            Rule::domain => self.later(&pair, "`domain`"),
            _ => {
                let rules = [
                    ("component", Rule::component),
                    ("host", Rule::host),
                    ("group", Rule::group),
                    ("bind", Rule::bind),
                    ("middleware", Rule::middleware),
                    ("domain", Rule::domain),
                ];
                self.unread(&pair, &rules, &DECLS, "a declaration of a deployment");
            }
        }
    }

    /// `instance.slot`; groups, which would make it longer, are not supported yet.
    fn slot_path(&mut self, pair: Pair<'a, Rule>) -> Option<SlotPath> {
        let span = self.span(&pair);
        let names = pair.into_inner().filter(|p| p.as_rule() == Rule::name);
        let names: Vec<Name> = names.map(|p| self.name(&p)).collect();
        if let Ok([instance, slot]) = <[Name; 2]>::try_from(names) {
            Some(SlotPath { instance, slot })
        } else {
            let message = "a slot is `instance.slot`; paths through groups are not supported yet";
            self.found
                .push(Diagnostic::error("not-supported-yet", span, message));
            None
        }
    }

    fn instance(&mut self, pair: Pair<'a, Rule>) -> Instance {
        let mut instance = Instance {
            name: Name::new("", self.span(&pair)),
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
                Rule::name => instance.name = self.name(&part),
                Rule::field => {
                    let first = self.first_word(&part);
                    if let Some(before) = seen.insert(first.text.to_lowercase(), first.span) {
                        let message =
                            format!("`{}` is repeated; each field stands once", first.text);
                        let diagnostic = Diagnostic::error("repeated-clause", first.span, message);
                        self.found.push(diagnostic.label(before, "the first one"));
                    }
                    part.into_inner()
                        .for_each(|p| self.field(p, &first, &mut instance));
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
                    self.unread(&part, &rules, &FIELDS, "a field of a component");
                }
                _ => {}
            }
        }
        // A field that is there, but could not be read, has been reported.
        if instance.cdsl.is_none() && !unread {
            let message = format!("component `{}` does not say what it is", instance.name.text);
            let help = "add `cdsl \"PATH/NAME.cdsl\";`, relative to this file";
            self.found
                .push(Diagnostic::error("missing-clause", instance.name.span, message).help(help));
        }
        instance
    }

    fn field(&mut self, pair: Pair<'a, Rule>, first: &Name, instance: &mut Instance) {
        let word = first.text.to_lowercase();
        match pair.as_rule() {
            Rule::text_field => {
                let kept = pair.clone();
                let text = self.names(pair).into_iter().next();
                match word.as_str() {
                    "cdsl" => instance.cdsl = text,
                    "executable" => instance.executable = text,
                    "config" => instance.config = text,
                    _ => self.later(&kept, "`endpoint`"),
                }
            }
            Rule::after => instance.after = self.names(pair),
            Rule::args => instance.args = self.names(pair),
            Rule::env => {
                let variables = pair.into_inner().filter(|p| p.as_rule() == Rule::variable);
                for variable in variables.collect::<Vec<_>>() {
                    if let Ok([name, value]) = <[Name; 2]>::try_from(self.names(variable)) {
                        instance.env.push((name, value));
                    }
                }
            }
            Rule::time_field => {
                let time = pair
                    .clone()
                    .into_inner()
                    .find(|p| p.as_rule() == Rule::time);
                self.names(pair);
                let Some(time) = time else { return };
                let span = self.span(&time);
                let literal = Literal::parse(time.as_str(), span);
                match literal.as_nanoseconds().filter(|ns| *ns > 0) {
                    Some(ns) if word == "ready" => instance.ready = Duration::from_nanos(ns),
                    Some(ns) => instance.stop = Duration::from_nanos(ns),
                    None => {
                        let message = format!("`{word}` takes a time such as `5s`");
                        self.found
                            .push(Diagnostic::error("bad-time", span, message));
                    }
                }
            }
            _ => {
                self.later(&pair, &format!("`{word}`"));
                self.names(pair);
            }
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

/// The words of messages for the rules that can be missing.
fn word(rule: Rule) -> Option<&'static str> {
    Some(match rule {
        Rule::EOI => "the end of the file",
        Rule::file | Rule::kw_deployment => "`Deployment`",
        Rule::name => "a name",
        Rule::slot_path => "a slot such as `simulator.Laser`",
        Rule::string => "a text in quotes",
        Rule::number => "a number",
        Rule::time | Rule::duration => "a time such as `5s`",
        Rule::field => "a field",
        Rule::decl => "a declaration",
        Rule::semicolon | Rule::begins_next => "`;`",
        Rule::open => "`{`",
        Rule::close => "`}`",
        Rule::comma => "`,`",
        Rule::arrow => "`->`",
        Rule::dot => "`.`",
        Rule::kw_within => "`within`",
        Rule::variable => "`NAME \"value\";`",
        _ => return None,
    })
}
