//! The syntax tree of a query.

use property_graph::schema::Factor;
use rc_diagnostics::Span;

/// A name with its place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Name {
    pub(crate) text: String,
    pub(crate) span: Span,
}

/// The name of a type or an attribute.
#[derive(Clone, Debug)]
pub(crate) struct SchemaName {
    pub(crate) name: Name,
    /// Its place among all such names in the query, which are looked up once.
    pub(crate) slot: usize,
}

#[derive(Clone, Debug)]
pub(crate) enum Clause {
    Match(Match),
    /// `WITH`, or `RETURN` at the end.
    Project(Project),
}

#[derive(Clone, Debug)]
pub(crate) struct Match {
    pub(crate) optional: bool,
    pub(crate) chains: Vec<Chain>,
    /// The parts of its condition, all of which must hold.
    pub(crate) parts: Vec<Part>,
    /// The variables of its chains that earlier clauses have.
    pub(crate) earlier: Vec<usize>,
}

/// A part of a condition.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) value: Expr,
    pub(crate) variables: Vec<usize>,
}

impl Part {
    fn new(value: Expr) -> Self {
        let mut variables = Vec::new();
        value.variables(&mut variables);
        Self { value, variables }
    }
}

impl Match {
    /// Adds a condition.
    pub(crate) fn require(&mut self, condition: Expr) {
        match condition {
            Expr::Binary(Operator::And, a, b) => {
                self.require(*a);
                self.require(*b);
            }
            part => self.parts.push(Part::new(part)),
        }
    }

    /// Turns each attribute of the pattern that depends on a variable into a condition: the order
    /// of matching may reach the pattern before the variable has a value, and a condition waits for
    /// it.
    pub(crate) fn free_properties(&mut self) {
        let parts = &mut self.parts;
        let mut free = |variable: usize, properties: &mut Vec<(SchemaName, Expr)>| {
            let before = parts.len();
            for (name, value) in properties.extract_if(.., |(_, value)| value.has_variable()) {
                let own = Expr::Property(Box::new(Expr::Variable(variable)), name);
                let (own, value) = (Box::new(own), Box::new(value));
                parts.push(Part::new(Expr::Binary(Operator::Equal, own, value)));
            }
            parts.len() > before
        };
        for chain in &mut self.chains {
            for node in &mut chain.nodes {
                free(node.variable, &mut node.properties);
            }
            for edge in chain.edges.iter_mut().filter(|edge| edge.length.is_none()) {
                edge.is_read |= free(edge.variable, &mut edge.properties);
            }
        }
    }
}

/// Nodes, and the edges between them.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub(crate) nodes: Vec<NodePattern>,
    pub(crate) edges: Vec<EdgePattern>,
}

#[derive(Clone, Debug)]
pub(crate) struct NodePattern {
    pub(crate) variable: usize,
    pub(crate) label: Option<SchemaName>,
    pub(crate) properties: Vec<(SchemaName, Expr)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Out,
    In,
    Both,
}

#[derive(Clone, Debug)]
pub(crate) struct EdgePattern {
    pub(crate) variable: usize,
    pub(crate) direction: Direction,
    /// No type is any type.
    pub(crate) types: Vec<SchemaName>,
    pub(crate) properties: Vec<(SchemaName, Expr)>,
    /// The least and the greatest number of edges. `None` is one edge, which is not a list.
    pub(crate) length: Option<(usize, usize)>,
    /// Whether the query asks for the value of its variable.
    pub(crate) is_read: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Project {
    pub(crate) distinct: bool,
    pub(crate) items: Vec<Item>,
    pub(crate) order: Vec<(Expr, bool)>,
    pub(crate) skip: Option<Expr>,
    pub(crate) limit: Option<Expr>,
    /// `WHERE` after `WITH`.
    pub(crate) condition: Option<Expr>,
}

#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) value: Expr,
    /// The variable that it becomes.
    pub(crate) variable: usize,
    pub(crate) name: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operator {
    Or,
    Xor,
    And,
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    In,
    StartsWith,
    EndsWith,
    Contains,
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Aggregate {
    Count,
    Sum,
    Average,
    Least,
    Greatest,
    Collect,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Function {
    Id,
    Type,
    Domain,
    Size,
    Absolute,
    Coalesce,
    ToText,
    StartNode,
    EndNode,
    Pose,
    Chain,
}

/// A number in a unit.
#[derive(Clone, Debug)]
pub(crate) struct InUnit {
    pub(crate) of: Expr,
    pub(crate) unit: Name,
    /// Its conversion, which the check sets.
    pub(crate) factor: Option<Factor>,
}

#[derive(Clone, Debug)]
pub(crate) enum Expr {
    Literal(crate::Cell),
    Variable(usize),
    /// With its place among all parameters of the query.
    Parameter(Name, usize),
    Property(Box<Expr>, SchemaName),
    Index(Box<Expr>, Box<Expr>),
    List(Vec<Expr>),
    Not(Box<Expr>),
    Negate(Box<Expr>),
    IsNull(Box<Expr>, bool),
    Binary(Operator, Box<Expr>, Box<Expr>),
    InUnit(Box<InUnit>),
    Call(Function, Vec<Expr>),
    /// `count(*)` has no argument.
    Aggregate(Aggregate, bool, Option<Box<Expr>>),
}

impl Expr {
    /// The variables in it.
    pub(crate) fn variables(&self, all: &mut Vec<usize>) {
        match self {
            Self::Variable(slot) => all.push(*slot),
            Self::Literal(_) | Self::Parameter(..) | Self::Aggregate(_, _, None) => {}
            Self::Property(a, _)
            | Self::Not(a)
            | Self::Negate(a)
            | Self::IsNull(a, _)
            | Self::Aggregate(_, _, Some(a)) => a.variables(all),
            Self::InUnit(own) => own.of.variables(all),
            Self::Index(a, b) | Self::Binary(_, a, b) => {
                a.variables(all);
                b.variables(all);
            }
            Self::List(items) | Self::Call(_, items) => {
                items.iter().for_each(|item| item.variables(all));
            }
        }
    }

    pub(crate) fn has_variable(&self) -> bool {
        let mut variables = Vec::new();
        self.variables(&mut variables);
        !variables.is_empty()
    }

    pub(crate) fn has_aggregate(&self) -> bool {
        match self {
            Self::Aggregate(..) => true,
            Self::Literal(_) | Self::Variable(_) | Self::Parameter(..) => false,
            Self::Property(a, _) | Self::Not(a) | Self::Negate(a) | Self::IsNull(a, _) => {
                a.has_aggregate()
            }
            Self::InUnit(own) => own.of.has_aggregate(),
            Self::Index(a, b) | Self::Binary(_, a, b) => a.has_aggregate() || b.has_aggregate(),
            Self::List(all) | Self::Call(_, all) => all.iter().any(Self::has_aggregate),
        }
    }
}
