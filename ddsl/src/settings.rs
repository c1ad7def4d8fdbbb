//! The clauses `middleware` and `domain` of a block or a component.

use crate::ast;
use crate::duplicates::report_duplicate;
use crate::model::Setting;
use rc_cdsl::model::Middleware;
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::{Literal, LiteralKind, Name};
use rc_vocabulary::{Key, Kind, Scalar, Value, ValueError, duration, unknown_key_help};

/// The word by which connections choose their middleware themselves.
const AUTO: &str = "auto";
/// The default middleware between hosts after `auto`, without `remote`.
const REMOTE: Middleware = Middleware::BETWEEN_HOSTS;

/// The middleware and the settings of a block. Components in it inherit them.
#[derive(Clone, Debug)]
pub(crate) struct Choice {
    /// The middleware of slots that do not choose one.
    pub(crate) middleware: Middleware,
    /// For `middleware auto;`, which holds without a clause, the middleware between hosts.
    pub(crate) auto: Option<Middleware>,
    /// The settings, each key of a middleware once.
    pub(crate) settings: Vec<Setting>,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            middleware: Middleware::DEFAULT,
            auto: Some(REMOTE),
            settings: Vec::new(),
        }
    }
}

/// The meaning of the name of a middleware.
#[derive(Clone, Copy, PartialEq)]
enum Scope {
    /// The middleware of a block.
    Block,
    /// The middleware between hosts after `auto`.
    Remote,
}

/// Reads the clauses of one block. They take precedence over those of the blocks around it.
pub(crate) struct Block<'a> {
    choice: Choice,
    found: &'a mut Diagnostics,
    /// The middlewares that this block mentions.
    named: Vec<Name>,
    /// The settings of this block itself.
    set: Vec<(Middleware, &'static str, Span)>,
}

impl<'a> Block<'a> {
    pub(crate) fn new(context: &Choice, found: &'a mut Diagnostics) -> Self {
        Self {
            choice: context.clone(),
            found,
            named: Vec::new(),
            set: Vec::new(),
        }
    }

    pub(crate) fn end(self) -> Choice {
        self.choice
    }

    /// `middleware dds { … };`. The first clause of a block chooses the middleware. Further clauses
    /// contain settings for slots that choose another middleware.
    pub(crate) fn middleware(&mut self, tree: &ast::Middleware) {
        if tree.name.text.eq_ignore_ascii_case(AUTO) {
            return self.auto(tree);
        }
        let Some(backend) = self.known(&tree.name, Scope::Block) else {
            return;
        };
        if let Some(remote) = &tree.remote {
            let message = format!("`remote` goes with `middleware {AUTO}`");
            let error = Diagnostic::error("misplaced-remote", remote.span, message).help(format!(
                "write `middleware {AUTO} remote {};`, or leave `remote` out",
                remote.text
            ));
            self.found.push(error);
        }
        let same = self.named.iter().find(|n| n.text == backend.word());
        if let Some(first) = same {
            let word = Name::new("middleware", tree.name.span);
            report_duplicate(&word, "clause", first.span, self.found);
        } else if let Some(first) = self.named.first().filter(|_| tree.settings.is_none()) {
            let message = format!("`middleware {}` comes second here", tree.name.text);
            let error = Diagnostic::error("repeated-clause", tree.name.span, message)
                .label(first.span, "the middleware of this block")
                .help("a further one only sets something of it, in braces: write first what the components use");
            self.found.push(error);
        } else if self.named.is_empty() {
            self.choice.middleware = backend;
            self.choice.auto = None;
        }
        self.named.push(Name::new(backend.word(), tree.name.span));
        for (word, values) in tree.settings.iter().flatten() {
            let name = word.text.to_lowercase();
            let Some(key) = rc_vocabulary::key(backend.word(), &name) else {
                let message = format!("`{}` cannot be set of {}", word.text, backend.word());
                let error = Diagnostic::error("unknown-key", word.span, message);
                self.found
                    .push(error.help(unknown_key_help(backend.word(), &name)));
                continue;
            };
            self.set(backend, key, word, values);
        }
    }

    /// `middleware auto;` or `middleware auto remote ros2;`, the first clause of a block.
    fn auto(&mut self, tree: &ast::Middleware) {
        let remote = match &tree.remote {
            None => Some(REMOTE),
            Some(name) => self
                .known(name, Scope::Remote)
                .filter(|remote| self.joins_hosts(*remote, name)),
        };
        if let Some(first) = self.named.first() {
            let message = format!("`middleware {AUTO}` comes second here");
            let error = Diagnostic::error("repeated-clause", tree.name.span, message)
                .label(first.span, "the middleware of this block")
                .help("a block has one middleware: write one of the two");
            self.found.push(error);
        } else {
            self.choice.middleware = Middleware::DEFAULT;
            self.choice.auto = Some(remote.unwrap_or(REMOTE));
        }
        self.named.push(Name::new(AUTO, tree.name.span));
        if let Some((word, _)) = tree.settings.iter().flatten().next() {
            let message = format!("`{}` cannot be set of {AUTO}", word.text);
            let error = Diagnostic::error("unknown-key", word.span, message);
            self.found.push(error.help(format!(
                "{AUTO} has no settings: write those of a middleware in a clause of its own, `middleware {} {{ … }};`",
                remote.unwrap_or(REMOTE).word()
            )));
        }
    }

    /// Whether the middleware after `remote` connects hosts. Reports an error if not.
    fn joins_hosts(&mut self, remote: Middleware, name: &Name) -> bool {
        let joins = remote.can().joins_machines;
        if !joins {
            let others = Middleware::in_files().filter(|other| other.can().joins_machines);
            let others: Vec<&str> = others.map(Middleware::word).collect();
            let message = format!("`{}` does not connect hosts", remote.word());
            let error = Diagnostic::error("misplaced-remote", name.span, message);
            self.found.push(error.help(format!(
                "after `remote`, write one of: {}",
                others.join(", ")
            )));
        }
        joins
    }

    /// `domain 7;` sets the domain of every middleware that has domains.
    pub(crate) fn domain(&mut self, word: &Name, literal: &Literal) {
        for middleware in Middleware::in_files() {
            if let Some(key) = middleware.key("domain") {
                self.set(middleware, key, word, std::slice::from_ref(literal));
            }
        }
    }

    fn set(&mut self, backend: Middleware, key: &'static Key, word: &Name, literals: &[Literal]) {
        let same = |(b, name, _): &&(Middleware, &str, Span)| *b == backend && *name == key.name;
        if let Some((_, _, first)) = self.set.iter().find(same) {
            return report_duplicate(word, "setting", *first, self.found);
        }
        self.set.push((backend, key.name, word.span));
        if let [_, second, ..] = literals
            && !key.kind.is_list()
        {
            let message = format!("`{}` takes one value", key.name);
            self.found
                .push(Diagnostic::error("bad-setting", second.span, message));
            return;
        }
        let values = literals.iter().map(|literal| self.value(key, literal));
        // Each literal is checked, even if an earlier one is wrong.
        let values: Vec<Option<Value>> = values.collect();
        let values = values.into_iter().collect::<Option<Vec<Value>>>();
        let Some(value) = values.and_then(|values| key.kind.join(values)) else {
            return;
        };
        let settings = &mut self.choice.settings;
        settings.retain(|s| s.middleware != backend || s.key != key.name);
        settings.push(Setting {
            middleware: backend,
            key: key.name,
            value,
            span: word.span,
        });
    }

    fn value(&mut self, key: &Key, literal: &Literal) -> Option<Value> {
        let value = match &literal.kind {
            // No setting takes a number beyond 64 bits, so its range refuses the nearest one, too.
            LiteralKind::Int(number) => {
                Scalar::Int((*number).clamp(i64::MIN.into(), i64::MAX.into()) as i64)
            }
            LiteralKind::Duration(time) => Scalar::Duration(*time),
            LiteralKind::String(text) => Scalar::Text(text),
            LiteralKind::Bool(choice) => Scalar::Bool(*choice),
            LiteralKind::Name(word) if word.eq_ignore_ascii_case("on") => Scalar::Bool(true),
            LiteralKind::Name(word) if word.eq_ignore_ascii_case("off") => Scalar::Bool(false),
            LiteralKind::Name(_) | LiteralKind::Float(_) => Scalar::Other,
        };
        let what = match &literal.kind {
            LiteralKind::Duration(time) => format!("`{}`", duration::text(*time)),
            LiteralKind::Int(_)
            | LiteralKind::Float(_)
            | LiteralKind::String(_)
            | LiteralKind::Bool(_)
            | LiteralKind::Name(_) => literal.described(),
        };
        let message = format!("`{}` cannot be {what}", key.name);
        let error = match key.kind.convert(value) {
            Ok(value) => return Some(value),
            Err(ValueError::Range) => Diagnostic::error("out-of-range", literal.span, message),
            Err(ValueError::Type | ValueError::Format) => {
                Diagnostic::error("bad-setting", literal.span, message)
            }
        };
        let allowed = match key.kind {
            Kind::Bool => "allowed is `on` or `off`".to_owned(),
            Kind::Int(_)
            | Kind::Duration(_)
            | Kind::Interfaces
            | Kind::Peers
            | Kind::Namespace
            | Kind::Node
            | Kind::Remappings
            | Kind::Qos => format!("allowed is {}", key.kind.allowed()),
        };
        self.found.push(error.help(allowed));
        None
    }

    fn known(&mut self, name: &Name, of: Scope) -> Option<Middleware> {
        let known = Middleware::from_file(&name.text);
        if known.is_none() {
            let message = format!("unknown middleware `{}`", name.text);
            let auto = Some(AUTO).filter(|_| of == Scope::Block);
            let words = Middleware::in_files().map(Middleware::word).chain(auto);
            self.found.push(
                Diagnostic::error("unknown-middleware", name.span, message)
                    .suggest(&name.text, words),
            );
        }
        known
    }
}

/// The keys of all middlewares, each once.
pub(crate) fn words() -> impl Iterator<Item = &'static str> {
    let mut words = Vec::new();
    for key in Middleware::ALL.iter().flat_map(|one| one.can().keys) {
        if !words.contains(&key.name) {
            words.push(key.name);
        }
    }
    words.into_iter()
}
