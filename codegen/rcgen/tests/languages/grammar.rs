//! Random texts of a language, derived from its grammar, so that every construct occurs.

use crate::random::Random;
use pest_meta::ast::{Expr, Rule, RuleType};
use std::collections::HashMap;

/// Beyond this depth, or this number of words, the shortest alternative is chosen.
const DEEP: usize = 40;
const LONG: usize = 400;

/// Names that are keywords of one of the languages or of Rust, or that have an unusual style.
const NAMES: [&str; 24] = [
    "Laser",
    "laser",
    "getData",
    "x",
    "T_1",
    "_a",
    "type",
    "move",
    "match",
    "self",
    "publish",
    "command",
    "query",
    "as",
    "unit",
    "min",
    "max",
    "list",
    "group",
    "None",
    "states",
    "T",
    "rust",
    "Component",
];
const STRINGS: [&str; 6] = [
    "\"a.idsl\"",
    "\"../..//x.idsl\"",
    "\"\"",
    "\"a \\\" b /* no comment */\"",
    "\"127.0.0.1:4000\"",
    "\"ü { ; } é\"",
];
const NUMBERS: [&str; 9] = [
    "0", "1", "-1", "127", "3.25", "-0.5", "1e3", "2.5e-3", "0x1F",
];
const GAPS: [&str; 13] = [
    " ",
    " ",
    " ",
    "  ",
    "\t",
    "\n",
    "\n\n\n",
    "\r\n    ",
    " /* c */ ",
    " // to the end →\n",
    "\n/// about it\n",
    "\n  /** more\n   * about it */\n",
    "\n/** one */ ",
];

/// The grammar of a language.
pub(crate) struct Grammar(HashMap<String, Rule>);

impl Grammar {
    /// Reads the grammar in `text`. Adds the part that all languages share.
    pub(crate) fn new(text: &str) -> Self {
        let common = include_str!("../../../../syntax/src/common.pest");
        let text = format!("{common}\n{text}");
        let pairs = pest_meta::parser::parse(pest_meta::parser::Rule::grammar_rules, &text)
            .expect("a valid grammar");
        let rules = pest_meta::parser::consume_rules(pairs).expect("valid rules");
        Self(rules.into_iter().map(|r| (r.name.clone(), r)).collect())
    }

    /// A rule that exists.
    pub(crate) fn named(&self, name: &str) -> &Rule {
        &self.0[name]
    }

    /// The words of a random text. Look-ahead is ignored, so a few texts are invalid.
    pub(crate) fn words(&self, random: &mut Random) -> Vec<String> {
        let mut words = Vec::new();
        self.rule("file", random, 0, &mut words);
        words
    }

    fn rule(&self, name: &str, random: &mut Random, depth: usize, out: &mut Vec<String>) {
        let chosen = match name {
            "SOI" | "EOI" | "trailing" | "skipped" => return,
            "name" => (*random.one_of(&NAMES)).to_owned(),
            "string" => (*random.one_of(&STRINGS)).to_owned(),
            "number" => (*random.one_of(&NUMBERS)).to_owned(),
            "semicolon" => ";".to_owned(),
            "close" => "}".to_owned(),
            _ => {
                let rule = &self.0[name];
                if rule.ty == RuleType::Atomic {
                    self.text(&rule.expr, random)
                } else {
                    return self.expr(&rule.expr, random, depth + 1, out);
                }
            }
        };
        out.push(chosen);
    }

    fn expr(&self, expr: &Expr, random: &mut Random, depth: usize, out: &mut Vec<String>) {
        let enough = depth > DEEP || out.len() > LONG;
        match expr {
            Expr::Str(text) | Expr::Insens(text) => out.push(text.clone()),
            Expr::Ident(name) => self.rule(name, random, depth, out),
            Expr::Seq(first, second) => {
                self.expr(first, random, depth, out);
                self.expr(second, random, depth, out);
            }
            Expr::Choice(..) => {
                let all = alternatives(expr);
                let one = if enough {
                    all[all.len() - 1]
                } else {
                    random.one_of(&all)
                };
                self.expr(one, random, depth, out);
            }
            Expr::Opt(inner) if !enough && random.chance(2) => {
                self.expr(inner, random, depth, out);
            }
            Expr::RepOnce(inner) => {
                self.expr(inner, random, depth, out);
                while !enough && out.len() <= LONG && random.chance(2) {
                    self.expr(inner, random, depth, out);
                }
            }
            Expr::Rep(inner) => {
                let most = if enough { 1 } else { 4 };
                for _ in 0..random.below(most) {
                    self.expr(inner, random, depth, out);
                }
            }
            _ => {}
        }
    }

    /// The text of an atomic rule is a single word.
    fn text(&self, expr: &Expr, random: &mut Random) -> String {
        let mut out = Vec::new();
        match expr {
            Expr::Insens(text) if random.chance(4) => out.push(text.to_uppercase()),
            Expr::Str(text) | Expr::Insens(text) => out.push(text.clone()),
            Expr::Ident(name) => match name.as_str() {
                "ASCII_ALPHA" | "ASCII_ALPHANUMERIC" | "word_char" => out.push("w".to_owned()),
                "ASCII_DIGIT" | "ASCII_HEX_DIGIT" => out.push("7".to_owned()),
                "WHITESPACE" | "COMMENT" | "gap" => {}
                "name" | "number" | "string" => self.rule(name, random, 0, &mut out),
                _ => out.push(self.text(&self.0[name].expr, random)),
            },
            Expr::Seq(first, second) => {
                out.push(self.text(first, random));
                out.push(self.text(second, random));
            }
            Expr::Choice(..) => {
                out.push(self.text(random.one_of::<&Expr>(&alternatives(expr)), random));
            }
            Expr::Opt(inner) | Expr::Rep(inner) if random.chance(2) => {
                out.push(self.text(inner, random));
            }
            Expr::RepOnce(inner) => out.push(self.text(inner, random)),
            _ => {}
        }
        out.concat()
    }
}

/// The alternatives of a choice, without those that match mistakes.
fn alternatives(expr: &Expr) -> Vec<&Expr> {
    match expr {
        Expr::Choice(first, second) => [alternatives(first), alternatives(second)].concat(),
        Expr::Ident(name) if name.starts_with("skipped") => Vec::new(),
        one => vec![one],
    }
}

/// Joins the words with random white space and comments.
pub(crate) fn lay_out(words: &[String], random: &mut Random) -> String {
    let mut text = String::new();
    let word = |c: char| c.is_alphanumeric() || c == '_';
    for next in words {
        // Two words, or two marks, would become one without a separator.
        let joins = text.ends_with(|c: char| word(c) || "-=<>!:/*.".contains(c))
            && next.starts_with(|c: char| word(c) || "-=<>!:/*.".contains(c));
        if joins || random.chance(2) {
            text.push_str(random.one_of::<&str>(&GAPS));
        }
        text.push_str(next);
    }
    text
}
