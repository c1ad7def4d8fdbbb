//! Random queries as trees, and their texts.

use std::fmt::Write as _;

#[derive(Clone, Debug)]
pub(crate) enum Expr {
    Null,
    Bool(bool),
    Int(i64),
    Text(&'static str),
    Variable(String),
    Property(String, &'static str),
    List(Vec<Expr>),
    Not(Box<Expr>),
    /// `IS NULL`, or `IS NOT NULL`.
    IsNull(Box<Expr>, bool),
    Binary(&'static str, Box<Expr>, Box<Expr>),
    Call(&'static str, Vec<Expr>),
    /// Function, `DISTINCT`, argument: `count(*)` has none.
    Aggregate(&'static str, bool, Option<Box<Expr>>),
}

#[derive(Clone, Debug, Default)]
pub(crate) struct NodePattern {
    pub(crate) variable: Option<String>,
    pub(crate) kind: Option<&'static str>,
    pub(crate) x: Option<i64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Out,
    In,
    Both,
}

#[derive(Clone, Debug)]
pub(crate) struct EdgePattern {
    pub(crate) variable: Option<String>,
    pub(crate) types: Vec<&'static str>,
    pub(crate) direction: Direction,
    pub(crate) w: Option<i64>,
    pub(crate) length: Option<(usize, usize)>,
}

#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub(crate) first: NodePattern,
    pub(crate) rest: Vec<(EdgePattern, NodePattern)>,
}

#[derive(Clone, Debug)]
pub(crate) struct Match {
    pub(crate) optional: bool,
    pub(crate) chains: Vec<Chain>,
    pub(crate) condition: Option<Expr>,
}

#[derive(Clone, Debug)]
pub(crate) struct Project {
    pub(crate) distinct: bool,
    pub(crate) items: Vec<(Expr, String)>,
    /// Columns, and whether they are in descending order. All of them, so that equal rows alone may
    /// change places.
    pub(crate) order: Vec<(String, bool)>,
    pub(crate) skip: Option<usize>,
    pub(crate) limit: Option<usize>,
    pub(crate) condition: Option<Expr>,
}

#[derive(Clone, Debug)]
pub(crate) enum Clause {
    Match(Match),
    With(Project),
    Return(Project),
}

/// How strongly an expression holds together: it needs no parentheses beside what holds less.
fn strength(expr: &Expr) -> u8 {
    match expr {
        Expr::Binary("OR", ..) => 1,
        Expr::Binary("XOR", ..) => 2,
        Expr::Binary("AND", ..) => 3,
        Expr::Not(_) => 4,
        Expr::Binary("+" | "-", ..) => 6,
        Expr::Binary("*" | "%" | "/", ..) => 7,
        Expr::Binary(..) | Expr::IsNull(..) => 5,
        _ => 9,
    }
}

/// The text of an expression beside an operator that needs this strength.
fn part(expr: &Expr, needed: u8) -> String {
    let text = text_of(expr);
    if strength(expr) < needed {
        format!("({text})")
    } else {
        text
    }
}

pub(crate) fn text_of(expr: &Expr) -> String {
    let list = |all: &[Expr]| all.iter().map(text_of).collect::<Vec<_>>().join(", ");
    match expr {
        Expr::Null => "null".to_owned(),
        Expr::Bool(yes) => yes.to_string(),
        Expr::Int(number) => number.to_string(),
        Expr::Text(text) => format!("'{text}'"),
        Expr::Variable(name) => name.clone(),
        Expr::Property(variable, name) => format!("{variable}.{name}"),
        Expr::List(all) => format!("[{}]", list(all)),
        Expr::Not(of) => format!("NOT {}", part(of, 4)),
        Expr::IsNull(of, true) => format!("{} IS NULL", part(of, 6)),
        Expr::IsNull(of, false) => format!("{} IS NOT NULL", part(of, 6)),
        Expr::Binary(operator, left, right) => {
            let own = strength(expr);
            // Comparisons in a row are another thing.
            let left = part(left, if own == 5 { 6 } else { own });
            format!("{left} {operator} {}", part(right, own + 1))
        }
        Expr::Call(function, arguments) => format!("{function}({})", list(arguments)),
        Expr::Aggregate(function, _, None) => format!("{function}(*)"),
        Expr::Aggregate(function, distinct, Some(of)) => {
            let distinct = if *distinct { "DISTINCT " } else { "" };
            format!("{function}({distinct}{})", text_of(of))
        }
    }
}

fn node(pattern: &NodePattern) -> String {
    let mut text = format!("({}", pattern.variable.as_deref().unwrap_or_default());
    if let Some(kind) = pattern.kind {
        let _ = write!(text, ":{kind}");
    }
    if let Some(x) = pattern.x {
        let _ = write!(text, " {{x: {x}}}");
    }
    text + ")"
}

fn edge(pattern: &EdgePattern) -> String {
    let mut text = format!("[{}", pattern.variable.as_deref().unwrap_or_default());
    if !pattern.types.is_empty() {
        let _ = write!(text, ":{}", pattern.types.join("|"));
    }
    if let Some((least, most)) = pattern.length {
        let _ = write!(text, "*{least}..{most}");
    }
    if let Some(w) = pattern.w {
        let _ = write!(text, " {{w: {w}}}");
    }
    match pattern.direction {
        Direction::Out => format!("-{text}]->"),
        Direction::In => format!("<-{text}]-"),
        Direction::Both => format!("-{text}]-"),
    }
}

fn chain(chain: &Chain) -> String {
    let rest = chain.rest.iter();
    let rest: String = rest.map(|(e, n)| edge(e) + &node(n)).collect();
    node(&chain.first) + &rest
}

fn project(project: &Project) -> String {
    let mut text = String::new();
    if project.distinct {
        text += "DISTINCT ";
    }
    let items = project.items.iter().map(|(expr, name)| match expr {
        Expr::Variable(same) if same == name => name.clone(),
        _ => format!("{} AS {name}", text_of(expr)),
    });
    text += &items.collect::<Vec<_>>().join(", ");
    let order = project.order.iter().map(|(name, down)| {
        let down = if *down { " DESC" } else { "" };
        format!("{name}{down}")
    });
    let order: Vec<String> = order.collect();
    if !order.is_empty() {
        let _ = write!(text, " ORDER BY {}", order.join(", "));
    }
    if let Some(skip) = project.skip {
        let _ = write!(text, " SKIP {skip}");
    }
    if let Some(limit) = project.limit {
        let _ = write!(text, " LIMIT {limit}");
    }
    text
}

/// The text of a query.
pub(crate) fn text(clauses: &[Clause]) -> String {
    let clauses = clauses.iter().map(|clause| {
        let (mut text, condition) = match clause {
            Clause::Match(pattern) => {
                let optional = if pattern.optional { "OPTIONAL " } else { "" };
                let chains: Vec<String> = pattern.chains.iter().map(chain).collect();
                let text = format!("{optional}MATCH {}", chains.join(", "));
                (text, &pattern.condition)
            }
            Clause::With(with) => (format!("WITH {}", project(with)), &with.condition),
            Clause::Return(last) => (format!("RETURN {}", project(last)), &None),
        };
        if let Some(condition) = condition {
            let _ = write!(text, " WHERE {}", text_of(condition));
        }
        text
    });
    clauses.collect::<Vec<_>>().join(" ")
}
