//! A grammar of pest as one of tree-sitter: what looks ahead, and what matches mistakes, is left out.

use crate::grammar::Grammar;
use pest_meta::ast::{Expr, RuleType};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write as _;

const NAME: &str = "[A-Za-z_][A-Za-z0-9_]*";
const NUMBER: &str = "-?(0x[0-9A-Fa-f]+|[0-9]+(\\.[0-9]+)?([eE][+-]?[0-9]+)?)";
const STRING: &str = "\"(\\\\[^\\n\\r]|[^\"\\\\\\n\\r])*\"";
const COMMENT: &str = "\\/\\/[^\\n\\r]*|\\/\\*([^*]|\\*+[^*\\/])*\\*+\\/";
const UNITS: [&str; 5] = ["us", "ms", "min", "s", "h"];

/// The grammar of a language for tree-sitter.
pub(crate) struct TreeSitter<'g> {
    grammar: &'g Grammar,
    /// The rules in the order of their first use; one without a rule matches nothing.
    rules: Vec<(String, Option<Value>)>,
    /// The keywords, without regard to case. The lexer prefers an earlier token to a later one of the
    /// same text, so they come before names.
    keywords: Vec<(String, Value)>,
    tokens: Vec<(String, Value)>,
}

impl<'g> TreeSitter<'g> {
    pub(crate) fn of(grammar: &'g Grammar) -> Self {
        let mut all = Self {
            grammar,
            rules: Vec::new(),
            keywords: Vec::new(),
            tokens: Vec::new(),
        };
        all.symbol("name");
        all.symbol("file");
        all
    }

    /// The file `grammar.json`, one rule a line. In the ambiguous rules `conflicts`, the parser follows
    /// all ways.
    pub(crate) fn json(&self, name: &str, conflicts: &[&[&str]]) -> String {
        let mut lines = Vec::new();
        let rules = self.rules.iter();
        let rules = rules.filter_map(|(name, rule)| Some((name, rule.as_ref()?)));
        let tokens = self.tokens.iter().filter(|(token, _)| token != "name");
        let words = self.keywords.iter().chain(tokens);
        for (name, rule) in rules.chain(words.map(|(name, rule)| (name, rule))) {
            lines.push(format!("    {}: {rule}", json!(name)));
        }
        // The lexer prefers each other token to a name.
        lines.push(format!("    \"identifier\": {}", pattern(NAME)));
        lines.push(format!("    \"name\": {}", named("identifier")));
        let comment = json!({ "type": "TOKEN", "content": pattern(COMMENT) });
        lines.push(format!("    \"comment\": {comment}"));
        let extras = json!([pattern("[ \\t\\r\\n]"), named("comment")]);
        let conflicts = json!(conflicts);
        let rules = lines.join(",\n");
        format!(
            "{{\n  \"name\": \"{name}\",\n  \"word\": \"identifier\",\n  \"rules\": {{\n{rules}\n  }},\n  \"extras\": {extras},\n  \"conflicts\": {conflicts},\n  \"precedences\": [],\n  \"externals\": [],\n  \"inline\": [],\n  \"supertypes\": []\n}}\n"
        )
    }

    /// The rule of a name, where it is used. `None` if it matches nothing.
    fn symbol(&mut self, name: &str) -> Option<Value> {
        match name {
            "SOI" | "EOI" | "trailing" | "at_end" => return None,
            name if name.starts_with("skipped") => return None,
            "semicolon" => return Some(json!({ "type": "REPEAT1", "content": text(";") })),
            "end_of_block" => return Some(json!({ "type": "REPEAT", "content": text(";") })),
            "close" => return Some(text("}")),
            "name" => return Some(self.token(name, NAME)),
            "number" => return Some(self.token(name, NUMBER)),
            "string" => return Some(self.token(name, STRING)),
            "duration" => return Some(self.duration()),
            _ => {}
        }
        let grammar = self.grammar;
        let rule = grammar.named(name);
        if let Some(words) = words(&rule.expr) {
            let mut all: Vec<Value> = words.into_iter().map(|word| self.word(word)).collect();
            return Some(match all.len() {
                1 => all.remove(0),
                _ => json!({ "type": "CHOICE", "members": all }),
            });
        }
        if rule.ty == RuleType::Atomic {
            if let Expr::Ident(other) = &rule.expr {
                return self.symbol(other);
            }
            // `-5ms` as a limit is a duration, and its unit a word.
            if has(&rule.expr, "time_unit") {
                let all = [self.duration(), self.token("number", NUMBER)];
                return Some(json!({ "type": "CHOICE", "members": all }));
            }
            let regex = self.regex(&rule.expr);
            return (!regex.is_empty()).then(|| self.token(name, &regex));
        }
        let shown = match rule.ty {
            RuleType::Silent => format!("_{name}"),
            _ => name.to_owned(),
        };
        let known = self.rules.iter().position(|(one, _)| *one == shown);
        let at = known.unwrap_or_else(|| {
            // The rule may name itself.
            self.rules.push((shown.clone(), Some(Value::Null)));
            let at = self.rules.len() - 1;
            let made = self.made(&rule.expr);
            self.rules[at].1 = made;
            at
        });
        self.rules[at].1.as_ref().map(|_| named(&shown))
    }

    fn token(&mut self, name: &str, regex: &str) -> Value {
        if !self.tokens.iter().any(|(one, _)| one == name) {
            self.tokens.push((name.to_owned(), pattern(regex)));
        }
        named(name)
    }

    /// `5ms`, or a number before a word: `5 ms`, and not `5 s` of `5 secret`.
    fn duration(&mut self) -> Value {
        let number = self.token("number", NUMBER);
        if !self.rules.iter().any(|(name, _)| name == "duration") {
            let units: Vec<Value> = UNITS.iter().map(|unit| text(unit)).collect();
            let joint = pattern(&format!("{NUMBER}({})", UNITS.join("|")));
            let unit = json!({ "type": "CHOICE", "members": units });
            let apart = json!({ "type": "SEQ", "members": [number, unit] });
            let rule = json!({ "type": "CHOICE", "members": [joint, apart] });
            self.rules.push(("duration".to_owned(), Some(rule)));
        }
        named("duration")
    }

    /// A keyword, which queries name in small letters.
    fn word(&mut self, word: &Expr) -> Value {
        let Expr::Insens(word) = word else {
            return match word {
                Expr::Str(word) => text(word),
                _ => Value::Null,
            };
        };
        let small = word.to_ascii_lowercase();
        let token = format!("_kw_{small}");
        if !self.keywords.iter().any(|(one, _)| *one == token) {
            self.keywords
                .push((token.clone(), pattern(&either_case(word))));
        }
        json!({ "type": "ALIAS", "content": named(&token), "named": false, "value": small })
    }

    fn made(&mut self, expr: &Expr) -> Option<Value> {
        let several = |kind: &str, mut all: Vec<Value>| match all.len() {
            0 => None,
            1 => Some(all.remove(0)),
            _ => Some(json!({ "type": kind, "members": all })),
        };
        let of = |kind: &str, inner: Value| json!({ "type": kind, "content": inner });
        match expr {
            Expr::Str(word) | Expr::Insens(word) => Some(text(word)),
            Expr::Ident(name) => self.symbol(name),
            Expr::Seq(..) => {
                let parts = flat(expr, true);
                let all = parts.into_iter().filter_map(|part| self.made(part));
                several("SEQ", all.collect())
            }
            Expr::Choice(..) => {
                let parts = flat(expr, false);
                let all = parts.into_iter().filter_map(|part| self.made(part));
                several("CHOICE", all.collect())
            }
            Expr::Opt(inner) => {
                let inner = self.made(inner)?;
                Some(json!({ "type": "CHOICE", "members": [inner, { "type": "BLANK" }] }))
            }
            Expr::Rep(inner) => Some(of("REPEAT", self.made(inner)?)),
            Expr::RepOnce(inner) => Some(of("REPEAT1", self.made(inner)?)),
            _ => None,
        }
    }

    /// The regular expression of an atomic rule.
    fn regex(&self, expr: &Expr) -> String {
        match expr {
            Expr::Str(text) => escaped(text),
            Expr::Insens(text) => either_case(text),
            Expr::Seq(..) => {
                let parts = flat(expr, true).into_iter();
                parts.map(|part| self.regex(part)).collect()
            }
            Expr::Choice(..) => {
                let parts = flat(expr, false).into_iter();
                let parts: Vec<String> = parts.map(|part| self.regex(part)).collect();
                format!("({})", parts.join("|"))
            }
            Expr::Opt(inner) => format!("({})?", self.regex(inner)),
            Expr::Rep(inner) => format!("({})*", self.regex(inner)),
            Expr::RepOnce(inner) => format!("({})+", self.regex(inner)),
            Expr::Ident(name) => match name.as_str() {
                "ASCII_ALPHA" => "[A-Za-z]".to_owned(),
                "ASCII_DIGIT" => "[0-9]".to_owned(),
                "ASCII_HEX_DIGIT" => "[0-9A-Fa-f]".to_owned(),
                "ASCII_ALPHANUMERIC" => "[A-Za-z0-9]".to_owned(),
                "word_char" => "[A-Za-z0-9_]".to_owned(),
                "gap" => String::new(),
                "name" => NAME.to_owned(),
                "number" => format!("({NUMBER})"),
                "string" => STRING.to_owned(),
                name => format!("({})", self.regex(&self.grammar.named(name).expr)),
            },
            _ => String::new(),
        }
    }

    /// The rules with a block in braces.
    fn blocks(&self) -> Vec<&str> {
        let rules = self.rules.iter().filter(|(name, rule)| {
            let parts = rule.as_ref().and_then(|rule| rule["members"].as_array());
            let opens = |part: &Value| *part == text("{");
            !name.starts_with('_') && parts.is_some_and(|parts| parts.iter().any(opens))
        });
        rules.map(|(name, _)| name.as_str()).collect()
    }

    /// The file `highlights.scm`.
    pub(crate) fn highlights(&self) -> String {
        let mut words = BTreeSet::new();
        let mut names = String::new();
        for (name, rule) in &self.rules {
            let Some(rule) = rule else { continue };
            texts(rule, &mut words);
            let parts = rule["members"].as_array().map_or(&[][..], Vec::as_slice);
            for two in parts.windows(2) {
                let is_word = two[0]["type"] == "ALIAS" || two[0]["type"] == "STRING";
                let word = two[0]["value"].as_str().filter(|word| is_keyword(word));
                if let (true, Some(word), true) = (is_word, word, two[1]["name"] == "name")
                    && !name.starts_with('_')
                {
                    let _ = writeln!(names, "({name} \"{word}\" . (name) @type)");
                }
            }
        }
        let list = |all: Vec<&String>| {
            let all: Vec<String> = all.iter().map(|word| json!(word).to_string()).collect();
            format!("[{}]", all.join(" "))
        };
        let (words, marks): (Vec<&String>, Vec<&String>) =
            words.iter().partition(|word| is_keyword(word));
        let brackets: Vec<&String> = marks
            .iter()
            .copied()
            .filter(|mark| "{}()[]".contains(mark.as_str()))
            .collect();
        let other: Vec<&String> = marks
            .into_iter()
            .filter(|mark| !"{}()[]".contains(mark.as_str()))
            .collect();
        let mut out = format!("(comment) @comment\n{} @keyword\n{names}", list(words));
        for (token, colour) in [
            ("string", "string"),
            ("number", "number"),
            ("duration", "number"),
        ] {
            let all = self.tokens.iter().chain(&self.keywords);
            let mut known = all.map(|(name, _)| name);
            let is_rule = self.rules.iter().any(|(name, _)| name == token);
            if is_rule || known.any(|name| name == token) {
                let _ = writeln!(out, "({token}) @{colour}");
            }
        }
        let _ = writeln!(out, "{} @punctuation.bracket", list(brackets));
        let _ = writeln!(out, "{} @punctuation.delimiter", list(other));
        out
    }

    /// The file `folds.scm`.
    pub(crate) fn folds(&self) -> String {
        format!("{}\n(comment) @fold\n", listed(&self.blocks(), "@fold"))
    }

    /// The file `indents.scm`, with the names of Neovim, then those of Helix.
    pub(crate) fn indents(&self) -> String {
        let blocks = listed(&self.blocks(), "@indent.begin @indent");
        format!("{blocks}\n\"}}\" @indent.branch @indent.end @outdent\n")
    }
}

fn listed(blocks: &[&str], captures: &str) -> String {
    let blocks: Vec<String> = blocks.iter().map(|block| format!("({block})")).collect();
    format!("[{}] {captures}", blocks.join(" "))
}

fn is_keyword(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic())
}

/// All fixed texts of a rule.
fn texts(rule: &Value, all: &mut BTreeSet<String>) {
    if matches!(rule["type"].as_str(), Some("STRING" | "ALIAS")) {
        all.extend(rule["value"].as_str().map(str::to_owned));
        return;
    }
    let members = rule["members"].as_array().into_iter().flatten();
    for inner in members.chain(rule.get("content")) {
        texts(inner, all);
    }
}

fn named(name: &str) -> Value {
    json!({ "type": "SYMBOL", "name": name })
}

fn pattern(regex: &str) -> Value {
    json!({ "type": "PATTERN", "value": regex })
}

fn text(text: &str) -> Value {
    json!({ "type": "STRING", "value": text })
}

/// The parts of a sequence, or of a choice.
fn flat(expr: &Expr, sequence: bool) -> Vec<&Expr> {
    match expr {
        Expr::Seq(first, second) if sequence => {
            [flat(first, sequence), flat(second, sequence)].concat()
        }
        Expr::Choice(first, second) if !sequence => {
            [flat(first, sequence), flat(second, sequence)].concat()
        }
        one => vec![one],
    }
}

/// The fixed texts of a rule that consists of nothing else.
fn words(expr: &Expr) -> Option<Vec<&Expr>> {
    match expr {
        Expr::Str(_) | Expr::Insens(_) => Some(vec![expr]),
        Expr::Seq(..) => {
            let looks = |part: &&Expr| matches!(part, Expr::PosPred(_) | Expr::NegPred(_));
            let parts = flat(expr, true).into_iter();
            let parts: Vec<&Expr> = parts.filter(|part| !looks(part)).collect();
            match parts[..] {
                [only] => words(only),
                _ => None,
            }
        }
        Expr::Choice(..) => {
            let parts = flat(expr, false).into_iter().map(words);
            let parts: Option<Vec<Vec<&Expr>>> = parts.collect();
            parts.map(|parts| parts.concat())
        }
        _ => None,
    }
}

/// Whether an expression names a rule.
fn has(expr: &Expr, rule: &str) -> bool {
    match expr {
        Expr::Ident(name) => name == rule,
        Expr::Seq(first, second) | Expr::Choice(first, second) => {
            has(first, rule) || has(second, rule)
        }
        Expr::Opt(inner) | Expr::Rep(inner) | Expr::RepOnce(inner) => has(inner, rule),
        _ => false,
    }
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if "\\.^$|?*+()[]{}/-".contains(c) {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

fn either_case(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if c.is_ascii_alphabetic() {
            let (small, large) = (c.to_ascii_lowercase(), c.to_ascii_uppercase());
            let _ = write!(out, "[{small}{large}]");
        } else {
            out.push_str(&escaped(&c.to_string()));
        }
    }
    out
}
