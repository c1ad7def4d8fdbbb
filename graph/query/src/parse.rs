//! The parser: a read-only subset of openCypher.

use crate::ast::{
    Chain, Clause, Direction, EdgePattern, Expr, Item, Match, Name, NodePattern, Project,
    SchemaName,
};
use crate::lexer::{Token, tokens};
use property_graph::KnownName;
use rc_diagnostics::{Diagnostic, SourceId, Span, foreign};

/// How deeply expressions are nested at most. The parser is recursive.
const DEEPEST: usize = 64;
/// How many nodes the patterns of a query may have. Matching is recursive, and each has a column in every row.
const MOST_NODES: usize = 128;
/// How many variables a query may have: each has a column in every row.
const MOST_VARIABLES: usize = 256;
/// How many operators a query may have: each one can be a level of the tree of an expression.
const MOST_OPERATORS: usize = 512;
/// The longest path that a pattern may ask for.
pub(crate) const LONGEST: usize = 64;

/// A query whose names are slots of a row.
#[derive(Clone, Debug)]
pub(crate) struct Parsed {
    pub(crate) clauses: Vec<Clause>,
    /// All variables, with the places where they are named first; unnamed ones have no text.
    pub(crate) variables: Vec<Name>,
    /// All names of types and attributes, each once.
    pub(crate) names: Vec<KnownName>,
    /// All names of parameters, each once.
    pub(crate) parameters: Vec<String>,
}

mod expressions;

struct Parser<'a> {
    text: &'a str,
    source: SourceId,
    tokens: Vec<(Token, usize, usize)>,
    at: usize,
    depth: usize,
    nodes: usize,
    operators: usize,
    variables: Vec<Name>,
    names: Vec<KnownName>,
    parameters: Vec<String>,
    /// The variables that the present clause may name.
    scope: Vec<usize>,
}

type Result<T> = std::result::Result<T, Diagnostic>;

pub(crate) fn parse(text: &str, source: SourceId) -> Result<Parsed> {
    let mut parser = Parser {
        text,
        source,
        tokens: tokens(text, source)?,
        at: 0,
        depth: 0,
        nodes: 0,
        operators: 0,
        variables: Vec::new(),
        names: Vec::new(),
        parameters: Vec::new(),
        scope: Vec::new(),
    };
    let clauses = parser.query()?;
    if let Some(first) = parser.variables.get(MOST_VARIABLES) {
        let message = format!("a query has more than {MOST_VARIABLES} variables");
        return Err(Diagnostic::error("nested-too-deep", first.span, message));
    }
    Ok(Parsed {
        clauses,
        variables: parser.variables,
        names: parser.names,
        parameters: parser.parameters,
    })
}

/// The place of a name among others, to which it is added.
fn slot(names: &mut Vec<String>, name: &str) -> usize {
    let known = names.iter().position(|own| own == name);
    known.unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    })
}

impl Parser<'_> {
    fn peek(&self) -> &Token {
        &self.tokens[self.at.min(self.tokens.len() - 1)].0
    }

    fn span(&self) -> Span {
        let (_, start, end) = &self.tokens[self.at.min(self.tokens.len() - 1)];
        Span::new(self.source, *start, *end)
    }

    fn error<T>(&self, code: &'static str, message: String) -> Result<T> {
        Err(Diagnostic::error(code, self.span(), message))
    }

    fn expected<T>(&self, what: &str) -> Result<T> {
        let span = self.span();
        let text = &self.text[span.start..span.end];
        let found = match self.peek() {
            Token::End => "the end of the query".to_owned(),
            _ => format!("`{}`", foreign::clean(text)),
        };
        let message = format!("expected {what}, found {found}");
        let words = what.split('`').skip(1).step_by(2);
        let near = rc_diagnostics::nearest(text, words.filter(|word| word.len() > 2));
        Err(Diagnostic::error("query-syntax", span, message).did_you_mean(text, near))
    }

    fn is_word(&self, word: &str) -> bool {
        matches!(self.peek(), Token::Word(text) if text.eq_ignore_ascii_case(word))
    }

    fn word(&mut self, word: &str) -> bool {
        let is = self.is_word(word);
        self.at += usize::from(is);
        is
    }

    fn sign(&mut self, sign: &str) -> bool {
        let is = matches!(self.peek(), Token::Sign(text) if *text == sign);
        self.at += usize::from(is);
        is
    }

    fn need(&mut self, sign: &str) -> Result<()> {
        if self.sign(sign) {
            return Ok(());
        }
        self.expected(&format!("`{sign}`"))
    }

    fn name(&mut self, what: &str) -> Result<Name> {
        let span = self.span();
        match self.peek() {
            Token::Word(text) => {
                let text = text.clone();
                self.at += 1;
                Ok(Name { text, span })
            }
            _ => self.expected(what),
        }
    }

    fn query(&mut self) -> Result<Vec<Clause>> {
        let mut clauses = Vec::new();
        loop {
            let writes = [
                "CREATE", "MERGE", "SET", "DELETE", "DETACH", "REMOVE", "CALL",
            ];
            if let Some(word) = writes.iter().find(|word| self.is_word(word)) {
                let message = format!("`{word}` is not possible: a query changes nothing");
                return self.error("query-writes", message);
            }
            if self.is_word("OPTIONAL") || self.is_word("MATCH") {
                let optional = self.word("OPTIONAL");
                if !self.word("MATCH") {
                    return self.expected("`MATCH`");
                }
                clauses.push(Clause::Match(self.pattern(optional)?));
            } else if self.word("WITH") {
                clauses.push(Clause::Project(self.project(true)?));
            } else if self.word("RETURN") {
                clauses.push(Clause::Project(self.project(false)?));
                self.sign(";");
                if *self.peek() != Token::End {
                    return self.expected("the end of the query");
                }
                return Ok(clauses);
            } else {
                return self.expected("`MATCH`, `OPTIONAL MATCH`, `WITH` or `RETURN`");
            }
        }
    }

    fn pattern(&mut self, optional: bool) -> Result<Match> {
        let mut earlier = self.scope.clone();
        let mut chains = vec![self.chain()?];
        while self.sign(",") {
            chains.push(self.chain()?);
        }
        let condition = if self.word("WHERE") {
            Some(self.condition()?)
        } else {
            None
        };
        let named = |chain: &Chain, variable: &usize| {
            let is_node = chain.nodes.iter().any(|node| node.variable == *variable);
            is_node || chain.edges.iter().any(|edge| edge.variable == *variable)
        };
        earlier.retain(|variable| chains.iter().any(|chain| named(chain, variable)));
        let mut pattern = Match {
            optional,
            chains,
            parts: Vec::new(),
            earlier,
        };
        if let Some(condition) = condition {
            pattern.require(condition);
        }
        pattern.free_properties();
        Ok(pattern)
    }

    /// A condition, in which nothing is counted or summed.
    fn condition(&mut self) -> Result<Expr> {
        let start = self.at;
        let condition = self.expr()?;
        if condition.has_aggregate() {
            self.at = start;
            return self.error(
                "query-aggregate",
                "a condition cannot count or sum".to_owned(),
            );
        }
        Ok(condition)
    }

    /// The slot of a variable. An unnamed one gets a slot of its own.
    fn declare(&mut self, name: Option<Name>) -> usize {
        if let Some(name) = &name {
            let known = self
                .scope
                .iter()
                .find(|at| self.variables[**at].text == name.text);
            if let Some(known) = known {
                return *known;
            }
        }
        let slot = self.variables.len();
        let span = self.span();
        self.variables.push(name.unwrap_or(Name {
            text: String::new(),
            span,
        }));
        self.scope.push(slot);
        slot
    }

    fn chain(&mut self) -> Result<Chain> {
        let mut chain = Chain {
            nodes: vec![self.node()?],
            edges: Vec::new(),
        };
        while matches!(self.peek(), Token::Sign("-" | "<")) {
            chain.edges.push(self.edge()?);
            chain.nodes.push(self.node()?);
        }
        Ok(chain)
    }

    fn variable(&mut self) -> Option<Name> {
        let Token::Word(text) = self.peek() else {
            return None;
        };
        let (text, span) = (text.clone(), self.span());
        self.at += 1;
        Some(Name { text, span })
    }

    fn node(&mut self) -> Result<NodePattern> {
        self.nodes += 1;
        if self.nodes > MOST_NODES {
            let message = format!("the patterns of a query have more than {MOST_NODES} nodes");
            return self.error("nested-too-deep", message);
        }
        self.need("(")?;
        let variable = self.variable();
        let variable = self.declare(variable);
        let label = if self.sign(":") {
            Some(self.schema_name("a type of nodes")?)
        } else {
            None
        };
        let properties = self.properties()?;
        self.need(")")?;
        Ok(NodePattern {
            variable,
            label,
            properties,
        })
    }

    fn schema_name(&mut self, what: &str) -> Result<SchemaName> {
        let name = self.name(what)?;
        let known = self.names.iter().position(|own| own.text() == name.text);
        let slot = known.unwrap_or_else(|| {
            self.names.push(KnownName::new(name.text.as_str()));
            self.names.len() - 1
        });
        Ok(SchemaName { name, slot })
    }

    fn properties(&mut self) -> Result<Vec<(SchemaName, Expr)>> {
        let mut all = Vec::new();
        if !self.sign("{") {
            return Ok(all);
        }
        loop {
            let name = self.schema_name("an attribute")?;
            self.need(":")?;
            all.push((name, self.condition()?));
            if !self.sign(",") {
                break;
            }
        }
        self.need("}")?;
        Ok(all)
    }

    fn edge(&mut self) -> Result<EdgePattern> {
        let back = self.sign("<");
        self.need("-")?;
        let (mut variable, mut types, mut properties, mut length) = (None, vec![], vec![], None);
        if self.sign("[") {
            variable = self.variable();
            if self.sign(":") {
                types.push(self.schema_name("a relation")?);
                while self.sign("|") {
                    self.sign(":");
                    types.push(self.schema_name("a relation")?);
                }
            }
            let star = self.span();
            if self.sign("*") {
                length = Some(self.length(star)?);
            }
            let begin = self.span();
            properties = self.properties()?;
            self.need("]")?;
            if length.is_some() && properties.iter().any(|(_, value)| value.has_variable()) {
                let message = "an attribute of the edges of a path cannot depend on a variable";
                let diagnostic = Diagnostic::error("query-syntax", begin, message);
                return Err(diagnostic.help("write a literal or a parameter"));
            }
        }
        self.need("-")?;
        let forth = self.sign(">");
        let is_read = variable.is_some();
        let variable = self.declare(variable);
        Ok(EdgePattern {
            variable,
            direction: match (back, forth) {
                (true, false) => Direction::In,
                (false, true) => Direction::Out,
                _ => Direction::Both,
            },
            types,
            properties,
            length,
            is_read,
        })
    }

    /// What follows `*`: `3`, `1..3`, `..3`.
    fn length(&mut self, star: Span) -> Result<(usize, usize)> {
        let number = |parser: &mut Self| match parser.peek() {
            Token::Int(number) => {
                let number = usize::try_from(*number).unwrap_or(usize::MAX);
                parser.at += 1;
                Some(number)
            }
            _ => None,
        };
        let least = number(self);
        let most = if self.sign("..") { number(self) } else { least };
        let Some(most) = most.filter(|most| *most <= LONGEST) else {
            let message = format!("the path has no bound, or one beyond {LONGEST}");
            let diagnostic = Diagnostic::error("unbounded-path", star, message);
            return Err(diagnostic.help("write the most edges, as in `*1..5`"));
        };
        Ok((least.unwrap_or(1), most))
    }

    fn project(&mut self, goes_on: bool) -> Result<Project> {
        let distinct = self.word("DISTINCT");
        let mut items = Vec::new();
        let outer = self.scope.clone();
        let mut named: Vec<(String, Expr)> = Vec::new();
        if self.sign("*") {
            for slot in &outer {
                let name = self.variables[*slot].text.clone();
                if !name.is_empty() {
                    named.push((name, Expr::Variable(*slot)));
                }
            }
            if named.is_empty() {
                return self.expected("a value, since there is no variable");
            }
        } else {
            loop {
                let start = self.span().start;
                let value = self.expr()?;
                let end = self.tokens[self.at - 1].2;
                let name = if self.word("AS") {
                    self.name("a name")?.text
                } else if goes_on && !matches!(value, Expr::Variable(_)) {
                    return self.expected("`AS` and a name");
                } else {
                    self.text[start..end].to_owned()
                };
                if named.iter().any(|(known, _)| *known == name) {
                    let name = foreign::clean(&name);
                    return self.error("duplicate-name", format!("two columns are named `{name}`"));
                }
                named.push((name, value));
                if !self.sign(",") {
                    break;
                }
            }
        }
        // From now on, only these names are known; `ORDER BY` and `WHERE` know the earlier ones, too,
        // unless several rows become one.
        let mut inner = Vec::new();
        for (name, value) in named {
            let slot = self.variables.len();
            let span = self.span();
            self.variables.push(Name {
                text: name.clone(),
                span,
            });
            inner.push(slot);
            items.push(Item {
                value,
                variable: slot,
                name,
            });
        }
        let is_grouped = distinct || items.iter().any(|item| item.value.has_aggregate());
        let mut order = Vec::new();
        if self.word("ORDER") {
            if !self.word("BY") {
                return self.expected("`BY`");
            }
            loop {
                let (start, at) = (self.span().start, self.at);
                // A value may be named again as it was written.
                self.scope = inner.iter().chain(&outer).copied().collect();
                let mut value = self.condition();
                let text = &self.text[start..self.tokens[self.at.max(at + 1) - 1].2];
                let same = items.iter().find(|item| item.name == text);
                if let (Ok(_), Some(item)) = (&value, same) {
                    value = Ok(Expr::Variable(item.variable));
                } else if is_grouped {
                    self.at = at;
                    self.scope.clone_from(&inner);
                    value = self.condition();
                }
                let value = value?;
                let down = self.word("DESC") || self.word("DESCENDING");
                if !down && !self.word("ASC") {
                    self.word("ASCENDING");
                }
                order.push((value, down));
                if !self.sign(",") {
                    break;
                }
            }
        }
        self.scope = Vec::new();
        let skip = if self.word("SKIP") {
            Some(self.condition()?)
        } else {
            None
        };
        let limit = if self.word("LIMIT") {
            Some(self.condition()?)
        } else {
            None
        };
        self.scope.clone_from(&inner);
        let condition = if goes_on && self.word("WHERE") {
            if !is_grouped {
                self.scope.extend(outer);
            }
            Some(self.condition()?)
        } else {
            None
        };
        self.scope = inner;
        Ok(Project {
            distinct,
            items,
            order,
            skip,
            limit,
            condition,
        })
    }
}
