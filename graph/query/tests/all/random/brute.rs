//! An evaluator that tries all assignments. It knows nothing of plans, indices and budgets.

use super::ast::{Chain, Clause, Direction, EdgePattern, Expr, Match, NodePattern, Project};
use super::world::World;
use graph_query::Cell;
use std::cmp::Ordering;
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Null,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
    List(Vec<Value>),
    Node(usize),
    Edge(usize),
}

type Row = BTreeMap<String, Value>;

impl Value {
    fn some<T>(value: Option<T>, make: impl FnOnce(T) -> Self) -> Self {
        value.map_or(Self::Null, make)
    }

    fn rank(&self) -> u8 {
        match self {
            Self::Node(_) => 0,
            Self::Edge(_) => 1,
            Self::List(_) => 2,
            Self::Text(_) => 3,
            Self::Bool(_) => 4,
            Self::Int(_) | Self::Float(_) => 5,
            // Nothing is the greatest.
            Self::Null => 6,
        }
    }

    pub(crate) fn order(&self, other: &Self) -> Ordering {
        match (self, other) {
            (Self::Bool(a), Self::Bool(b)) => a.cmp(b),
            (Self::Int(a), Self::Int(b)) => a.cmp(b),
            (Self::Text(a), Self::Text(b)) => a.cmp(b),
            (Self::Node(a), Self::Node(b)) | (Self::Edge(a), Self::Edge(b)) => a.cmp(b),
            (Self::Float(a), Self::Float(b)) => a.total_cmp(b),
            (Self::List(a), Self::List(b)) => rows(a, b),
            _ => self.rank().cmp(&other.rank()),
        }
    }
}

/// The order of rows, cell by cell.
pub(crate) fn rows(a: &[Value], b: &[Value]) -> Ordering {
    let pairs = a.iter().zip(b).map(|(a, b)| a.order(b));
    let first = pairs.into_iter().find(|order| order.is_ne());
    first.unwrap_or(a.len().cmp(&b.len()))
}

impl From<&Cell> for Value {
    fn from(cell: &Cell) -> Self {
        match cell {
            Cell::Null => Self::Null,
            Cell::Bool(yes) => Self::Bool(*yes),
            Cell::Int(number) => Self::Int(*number),
            Cell::Float(number) => Self::Float(*number),
            Cell::Text(text) => Self::Text(text.to_string()),
            Cell::List(all) => Self::List(all.iter().map(Self::from).collect()),
            other => panic!("{other:?}"),
        }
    }
}

fn truth(value: &Value) -> Option<bool> {
    match value {
        Value::Bool(yes) => Some(*yes),
        Value::Null => None,
        other => panic!("{other:?}"),
    }
}

fn equal(a: &Value, b: &Value) -> Option<bool> {
    match (a, b) {
        (Value::Null, _) | (_, Value::Null) => None,
        _ => Some(a == b),
    }
}

fn eval(world: &World, expr: &Expr, row: &Row) -> Value {
    let each = |list: &[Expr]| list.iter().map(|e| eval(world, e, row)).collect::<Vec<_>>();
    match expr {
        Expr::Null => Value::Null,
        Expr::Bool(yes) => Value::Bool(*yes),
        Expr::Int(number) => Value::Int(*number),
        Expr::Text(text) => Value::Text((*text).to_owned()),
        Expr::Variable(name) => row[name].clone(),
        Expr::Property(variable, name) => match &row[variable] {
            Value::Node(at) => {
                let node = &world.nodes[*at];
                match *name {
                    "k" => Value::Int(node.k),
                    "x" => Value::some(node.x, Value::Int),
                    "name" => Value::some(node.name, |name| Value::Text(name.to_owned())),
                    _ => Value::Null,
                }
            }
            Value::Edge(at) if *name == "w" => Value::some(world.edges[*at].w, Value::Int),
            _ => Value::Null,
        },
        Expr::List(list) => Value::List(each(list)),
        Expr::Not(of) => Value::some(truth(&eval(world, of, row)), |yes| Value::Bool(!yes)),
        Expr::IsNull(of, wanted) => Value::Bool((eval(world, of, row) == Value::Null) == *wanted),
        Expr::Binary(operator, left, right) => {
            binary(operator, &eval(world, left, row), &eval(world, right, row))
        }
        Expr::Call(function, arguments) => {
            let arguments = each(arguments);
            match (*function, &arguments[0]) {
                ("coalesce", _) => {
                    let first = arguments.iter().find(|value| **value != Value::Null);
                    first.cloned().unwrap_or(Value::Null)
                }
                (_, Value::Null) => Value::Null,
                ("size", Value::Text(text)) => Value::Int(text.len() as i64),
                ("size", Value::List(list)) => Value::Int(list.len() as i64),
                ("abs", Value::Int(number)) => Value::Int(number.abs()),
                ("type", Value::Edge(at)) => Value::Text(world.edges[*at].kind.to_owned()),
                ("toString", Value::Int(number)) => Value::Text(number.to_string()),
                (_, other) => panic!("{function} of {other:?}"),
            }
        }
        Expr::Aggregate(..) => panic!("an aggregate outside of a projection"),
    }
}

fn binary(operator: &str, left: &Value, right: &Value) -> Value {
    let known = |truth: Option<bool>| Value::some(truth, Value::Bool);
    match operator {
        "AND" | "OR" => {
            // One of them decides alone.
            let decides = operator == "OR";
            let (a, b) = (truth(left), truth(right));
            return if a == Some(decides) || b == Some(decides) {
                Value::Bool(decides)
            } else {
                known(a.zip(b).map(|_| !decides))
            };
        }
        "XOR" => return known(truth(left).zip(truth(right)).map(|(a, b)| a != b)),
        "IN" => {
            let Value::List(list) = right else {
                return Value::Null;
            };
            let found: Vec<_> = list.iter().map(|item| equal(left, item)).collect();
            return if found.contains(&Some(true)) {
                Value::Bool(true)
            } else {
                known((!found.contains(&None)).then_some(false))
            };
        }
        _ => {}
    }
    if *left == Value::Null || *right == Value::Null {
        return Value::Null;
    }
    match (left, right) {
        (Value::Text(a), Value::Text(b)) => match operator {
            "STARTS WITH" => return Value::Bool(a.starts_with(b.as_str())),
            "ENDS WITH" => return Value::Bool(a.ends_with(b.as_str())),
            "CONTAINS" => return Value::Bool(a.contains(b.as_str())),
            "+" => return Value::Text(format!("{a}{b}")),
            _ => {}
        },
        (Value::Int(a), Value::Int(b)) => match operator {
            "+" => return Value::Int(a + b),
            "-" => return Value::Int(a - b),
            "*" => return Value::Int(a * b),
            "/" => return Value::Int(a / b),
            "%" => return Value::Int(a % b),
            _ => {}
        },
        _ => {}
    }
    let order = left.order(right);
    Value::Bool(match operator {
        "=" => left == right,
        "<>" => left != right,
        "<" => order.is_lt(),
        "<=" => order.is_le(),
        ">" => order.is_gt(),
        ">=" => order.is_ge(),
        other => panic!("{other}"),
    })
}

/// A row on the way, with the edges that the clause has used.
type Way = (Row, Vec<usize>);

fn bind_node(world: &World, pattern: &NodePattern, at: usize, row: &Row) -> Option<Row> {
    let node = &world.nodes[at];
    let fits = pattern.kind.is_none_or(|kind| kind == node.kind)
        && pattern.x.is_none_or(|x| node.x == Some(x));
    if !fits {
        return None;
    }
    let mut row = row.clone();
    if let Some(variable) = &pattern.variable {
        let known = row.insert(variable.clone(), Value::Node(at));
        if known.is_some_and(|known| known != Value::Node(at)) {
            return None;
        }
    }
    Some(row)
}

/// All ways along one edge of a pattern: the node there, and the edges used.
fn along(
    world: &World,
    pattern: &EdgePattern,
    from: usize,
    used: &[usize],
) -> Vec<(usize, Vec<usize>)> {
    let mut found = Vec::new();
    for (at, edge) in world.edges.iter().enumerate() {
        if used.contains(&at)
            || (!pattern.types.is_empty() && !pattern.types.contains(&edge.kind))
            || pattern.w.is_some_and(|w| edge.w != Some(w))
        {
            continue;
        }
        for to in 0..world.nodes.len() {
            let forth = edge.from == from && edge.to == to;
            let back = edge.to == from && edge.from == to;
            let fits = match pattern.direction {
                Direction::Out => forth,
                Direction::In => back,
                Direction::Both => forth || back,
            };
            if fits {
                found.push((to, vec![at]));
            }
        }
    }
    found
}

/// All ways along a pattern with a length.
fn paths(
    world: &World,
    pattern: &EdgePattern,
    from: usize,
    used: &[usize],
    (least, most): (usize, usize),
) -> Vec<(usize, Vec<usize>)> {
    let mut all = vec![(from, Vec::new())];
    let mut ends = all.clone();
    for _ in 0..most {
        let mut next = Vec::new();
        for (node, way) in &ends {
            let mut taken = used.to_vec();
            taken.extend(way);
            for (to, edge) in along(world, pattern, *node, &taken) {
                next.push((to, [way.as_slice(), &edge].concat()));
            }
        }
        all.extend(next.iter().cloned());
        ends = next;
    }
    all.retain(|(_, way)| way.len() >= least);
    all
}

fn chain(world: &World, chain: &Chain, (row, used): &Way) -> Vec<Way> {
    let starts = (0..world.nodes.len()).filter_map(|at| {
        let row = bind_node(world, &chain.first, at, row)?;
        Some((at, row, used.clone()))
    });
    let mut ways: Vec<(usize, Row, Vec<usize>)> = starts.collect();
    for (edge, node) in &chain.rest {
        let mut next = Vec::new();
        for (at, row, used) in ways {
            let steps = match edge.length {
                Some(length) => paths(world, edge, at, &used, length),
                None => along(world, edge, at, &used),
            };
            for (to, taken) in steps {
                let Some(mut row) = bind_node(world, node, to, &row) else {
                    continue;
                };
                if let Some(variable) = &edge.variable {
                    let value = match edge.length {
                        Some(_) => Value::List(taken.iter().map(|e| Value::Edge(*e)).collect()),
                        None => Value::Edge(taken[0]),
                    };
                    row.insert(variable.clone(), value);
                }
                next.push((to, row, [used.as_slice(), &taken].concat()));
            }
        }
        ways = next;
    }
    ways.into_iter().map(|(_, row, used)| (row, used)).collect()
}

fn variables(pattern: &Match) -> impl Iterator<Item = &String> {
    pattern.chains.iter().flat_map(|chain| {
        let rest = chain.rest.iter();
        let rest = rest.flat_map(|(edge, node)| [&edge.variable, &node.variable]);
        rest.chain([&chain.first.variable]).flatten()
    })
}

/// The limit of rows in between.
const MOST_ROWS: usize = 2000;

/// All that a function finds for each of some; nothing if that is too much.
fn all<T, U>(some: &[T], find: impl Fn(&T) -> Option<Vec<U>>) -> Option<Vec<U>> {
    let mut found = Vec::new();
    for one in some {
        found.extend(find(one)?);
        if found.len() > MOST_ROWS {
            return None;
        }
    }
    Some(found)
}

fn matched(world: &World, pattern: &Match, row: &Row) -> Option<Vec<Row>> {
    let mut ways: Vec<Way> = vec![(row.clone(), Vec::new())];
    for part in &pattern.chains {
        ways = all(&ways, |way| Some(chain(world, part, way)))?;
    }
    let mut found: Vec<Row> = ways.into_iter().map(|(row, _)| row).collect();
    if let Some(condition) = &pattern.condition {
        found.retain(|row| truth(&eval(world, condition, row)) == Some(true));
    }
    if found.is_empty() && pattern.optional {
        let mut row = row.clone();
        for variable in variables(pattern) {
            row.entry(variable.clone()).or_insert(Value::Null);
        }
        found.push(row);
    }
    Some(found)
}

fn aggregate(world: &World, expr: &Expr, group: &[Row]) -> Value {
    let Expr::Aggregate(function, distinct, of) = expr else {
        return eval(world, expr, &group[0]);
    };
    let Some(of) = of else {
        return Value::Int(group.len() as i64);
    };
    let mut values: Vec<Value> = group.iter().map(|row| eval(world, of, row)).collect();
    values.retain(|value| *value != Value::Null);
    // Collected values have no order.
    values.sort_by(Value::order);
    if *distinct {
        values.dedup();
    }
    let sum = || -> i64 {
        let numbers = values.iter().map(|value| match value {
            Value::Int(number) => *number,
            other => panic!("{other:?}"),
        });
        numbers.sum()
    };
    match *function {
        "count" => Value::Int(values.len() as i64),
        "sum" => Value::Int(sum()),
        "avg" if values.is_empty() => Value::Null,
        "avg" => Value::Float(sum() as f64 / values.len() as f64),
        "min" => values.first().cloned().unwrap_or(Value::Null),
        "max" => values.last().cloned().unwrap_or(Value::Null),
        "collect" => Value::List(values),
        other => panic!("{other}"),
    }
}

fn projected(world: &World, project: &Project, rows_before: &[Row]) -> Vec<Row> {
    let is_sum = |(expr, _): &&(Expr, String)| matches!(expr, Expr::Aggregate(..));
    let named = |values: Vec<Value>| -> Row {
        let names = project.items.iter().map(|(_, name)| name.clone());
        names.zip(values).collect()
    };
    let cells = |row: &Row| -> Vec<Value> {
        let names = project.items.iter().map(|(_, name)| row[name].clone());
        names.collect()
    };
    let mut made: Vec<Row> = if project.items.iter().any(|item| is_sum(&item)) {
        let mut groups: Vec<(Vec<Value>, Vec<Row>)> = Vec::new();
        for row in rows_before {
            let keys = project.items.iter().filter(|item| !is_sum(item));
            let key: Vec<Value> = keys.map(|(expr, _)| eval(world, expr, row)).collect();
            match groups.iter_mut().find(|(known, _)| *known == key) {
                Some((_, group)) => group.push(row.clone()),
                None => groups.push((key, vec![row.clone()])),
            }
        }
        if groups.is_empty() && project.items.iter().all(|item| is_sum(&item)) {
            groups.push((Vec::new(), Vec::new()));
        }
        let values = groups.iter().map(|(_, group)| {
            let items = project.items.iter();
            items
                .map(|(expr, _)| aggregate(world, expr, group))
                .collect()
        });
        values.map(named).collect()
    } else {
        let values = rows_before.iter().map(|row| {
            let items = project.items.iter();
            items.map(|(expr, _)| eval(world, expr, row)).collect()
        });
        values.map(named).collect()
    };
    if project.distinct {
        let mut seen: Vec<Row> = Vec::new();
        made.retain(|row| {
            let is_new = !seen.contains(row);
            seen.push(row.clone());
            is_new
        });
    }
    if !project.order.is_empty() {
        made.sort_by(|a, b| {
            let keys = project.order.iter().map(|(name, down)| {
                let order = a[name].order(&b[name]);
                if *down { order.reverse() } else { order }
            });
            let first = keys.into_iter().find(|order| order.is_ne());
            first.unwrap_or_else(|| rows(&cells(a), &cells(b)))
        });
    }
    let skipped = made.into_iter().skip(project.skip.unwrap_or_default());
    let mut made: Vec<Row> = skipped.take(project.limit.unwrap_or(usize::MAX)).collect();
    if let Some(condition) = &project.condition {
        made.retain(|row| truth(&eval(world, condition, row)) == Some(true));
    }
    made
}

/// The rows of a query. Nothing if there are too many on the way.
pub(crate) fn run(world: &World, clauses: &[Clause]) -> Option<Vec<Vec<Value>>> {
    let mut rows = vec![Row::new()];
    for clause in clauses {
        match clause {
            Clause::Match(pattern) => rows = all(&rows, |row| matched(world, pattern, row))?,
            Clause::With(with) => rows = projected(world, with, &rows),
            Clause::Return(last) => {
                let cells = |row: &Row| -> Vec<Value> {
                    last.items
                        .iter()
                        .map(|(_, name)| row[name].clone())
                        .collect()
                };
                return Some(projected(world, last, &rows).iter().map(cells).collect());
            }
        }
    }
    panic!("a query without RETURN");
}
