//! Expressions.

use crate::ast::{Expr, Function, Operator, SchemaName};
use crate::budget::{Error, Result};
use crate::cell::Cell;
use property_graph::schema::Factor;
use property_graph::{Id, NodeId, Snapshot, Symbol};
use std::cmp::Ordering;

/// The context of expressions.
pub(crate) struct Scope<'a> {
    pub(crate) graph: &'a Snapshot,
    /// The values of the parameters in the query, as far as they have some.
    pub(crate) parameters: Vec<Option<&'a Cell>>,
    /// The names of types and attributes in the query, as far as the graph knows them.
    pub(crate) symbols: Vec<Option<Symbol>>,
    /// How many steps functions that walk over the graph may take.
    pub(crate) walk: std::cell::Cell<u64>,
}

/// An id as a query shows it: the count alone for files of DSR, which have no writer.
fn id_cell(id: Id) -> Cell {
    match (id.writer(), i64::try_from(id.count())) {
        (0, Ok(count)) => Cell::Int(count),
        (writer, _) => Cell::Text(format!("{writer}:{}", id.count()).into()),
    }
}

#[cold]
fn wrong(what: &str, value: &Cell) -> Error {
    let kind = match value {
        Cell::Null => "null",
        Cell::Bool(_) => "a truth value",
        Cell::Int(_) => "an integer",
        Cell::Float(_) => "a number",
        Cell::Text(_) => "a text",
        Cell::List(_) => "a list",
        Cell::Bytes(_) => "bytes",
        Cell::Node(_) => "a node",
        Cell::Edge(_) => "an edge",
    };
    Error::Type(format!("expected {what}, found {kind}"))
}

/// A truth value, or nothing.
pub(crate) fn truth(value: &Cell) -> Result<Option<bool>> {
    match value {
        Cell::Null => Ok(None),
        Cell::Bool(yes) => Ok(Some(*yes)),
        other => Err(wrong("a truth value", other).into()),
    }
}

fn cell(truth: Option<bool>) -> Cell {
    truth.map_or(Cell::Null, Cell::Bool)
}

/// A number in another unit, or a list of numbers.
fn converted(value: &Cell, factor: &Factor) -> Result<Cell> {
    match value {
        Cell::Null => Ok(Cell::Null),
        Cell::List(all) => {
            let all = all.iter().map(|cell| converted(cell, factor));
            Ok(Cell::List(all.collect::<Result<_>>()?))
        }
        other => {
            let number = other.number().ok_or_else(|| wrong("a number", other))?;
            Ok(Cell::Float(factor.apply(number)))
        }
    }
}

impl Scope<'_> {
    pub(crate) fn eval(&self, expr: &Expr, row: &[Cell]) -> Result<Cell> {
        match expr {
            Expr::Literal(value) => Ok(value.clone()),
            Expr::Variable(slot) => Ok(row.get(*slot).cloned().unwrap_or(Cell::Null)),
            Expr::Parameter(name, slot) => {
                let value = self.parameters.get(*slot).copied().flatten();
                value.cloned().ok_or_else(|| {
                    Error::Parameter(rc_diagnostics::foreign::clean(&name.text)).into()
                })
            }
            Expr::Property(of, name) => match &**of {
                Expr::Variable(slot) => self.property(row.get(*slot).unwrap_or(&Cell::Null), name),
                of => self.property(&self.eval(of, row)?, name),
            },
            Expr::Index(of, index) => match (self.eval(of, row)?, self.eval(index, row)?) {
                (Cell::Null, _) | (_, Cell::Null) => Ok(Cell::Null),
                (Cell::List(all), Cell::Int(at)) => {
                    let at = if at < 0 { at + all.len() as i64 } else { at };
                    let item = usize::try_from(at).ok().and_then(|at| all.get(at));
                    Ok(item.cloned().unwrap_or(Cell::Null))
                }
                (Cell::List(_), other) => Err(wrong("an integer", &other).into()),
                (other, _) => Err(wrong("a list", &other).into()),
            },
            Expr::List(all) => {
                let all: Result<Vec<Cell>> = all.iter().map(|item| self.eval(item, row)).collect();
                list(all?)
            }
            Expr::Not(of) => Ok(cell(truth(&self.eval(of, row)?)?.map(|yes| !yes))),
            Expr::Negate(of) => match self.eval(of, row)? {
                Cell::Null => Ok(Cell::Null),
                Cell::Int(number) => Ok(Cell::Int(number.checked_neg().ok_or(Error::Overflow)?)),
                Cell::Float(number) => Ok(Cell::Float(-number)),
                other => Err(wrong("a number", &other).into()),
            },
            Expr::IsNull(of, wanted) => {
                let is = self.eval(of, row)? == Cell::Null;
                Ok(Cell::Bool(is == *wanted))
            }
            Expr::InUnit(own) => {
                let value = self.eval(&own.of, row)?;
                match &own.factor {
                    Some(factor) => converted(&value, factor),
                    None => Ok(value),
                }
            }
            Expr::Binary(operator, a, b) => self.binary(*operator, a, b, row),
            Expr::Call(function, arguments) => self.call(*function, arguments, row),
            Expr::Aggregate(..) => Err(Error::Type("a sum is not possible here".to_owned()).into()),
        }
    }

    /// The domain that declares a type. A type that none declares belongs to that of the schema.
    fn domain(&self, kind: &str) -> Cell {
        let schema = self.graph.schema();
        match schema.domain(kind) {
            "" => Cell::Null,
            domain => domain.into(),
        }
    }

    fn property(&self, of: &Cell, name: &SchemaName) -> Result<Cell> {
        match of {
            Cell::Null => Ok(Cell::Null),
            Cell::Node(node) => Ok(self.attribute((*node).into(), name)),
            Cell::Edge(edge) => Ok(self.attribute((*edge).into(), name)),
            other => Err(wrong("a node or an edge", other).into()),
        }
    }

    /// The number of a type or an attribute, if the graph has the name.
    #[inline]
    pub(crate) fn symbol(&self, name: &SchemaName) -> Option<Symbol> {
        self.symbols.get(name.slot).copied().flatten()
    }

    #[inline]
    pub(crate) fn attribute(&self, element: property_graph::Element, name: &SchemaName) -> Cell {
        let symbol = self.symbol(name);
        let value = symbol.and_then(|symbol| self.graph.get(element, symbol));
        value.map_or(Cell::Null, Cell::from)
    }

    fn binary(&self, operator: Operator, a: &Expr, b: &Expr, row: &[Cell]) -> Result<Cell> {
        let left = self.eval(a, row)?;
        if matches!(operator, Operator::And | Operator::Or | Operator::Xor) {
            let left = truth(&left)?;
            match (operator, left) {
                (Operator::And, Some(false)) => return Ok(Cell::Bool(false)),
                (Operator::Or, Some(true)) => return Ok(Cell::Bool(true)),
                _ => {}
            }
            let right = truth(&self.eval(b, row)?)?;
            return Ok(cell(match operator {
                Operator::And => match (left, right) {
                    (_, Some(false)) => Some(false),
                    (Some(true), Some(true)) => Some(true),
                    _ => None,
                },
                Operator::Or => match (left, right) {
                    (_, Some(true)) => Some(true),
                    (Some(false), Some(false)) => Some(false),
                    _ => None,
                },
                _ => left.zip(right).map(|(a, b)| a != b),
            }));
        }
        let right = self.eval(b, row)?;
        let is_nan = |side: &Cell| side.number().is_some_and(f64::is_nan);
        let both = left.number().is_some() && right.number().is_some();
        let ordered = |wanted: fn(Ordering) -> bool| {
            // NaN is neither less nor greater than a number.
            if both && (is_nan(&left) || is_nan(&right)) {
                return Cell::Bool(false);
            }
            cell(left.compared(&right).map(wanted))
        };
        match operator {
            Operator::Equal => Ok(cell(left.equals(&right))),
            Operator::NotEqual => Ok(cell(left.equals(&right).map(|yes| !yes))),
            Operator::Less => Ok(ordered(Ordering::is_lt)),
            Operator::LessOrEqual => Ok(ordered(Ordering::is_le)),
            Operator::Greater => Ok(ordered(Ordering::is_gt)),
            Operator::GreaterOrEqual => Ok(ordered(Ordering::is_ge)),
            Operator::In => match &right {
                Cell::Null => Ok(Cell::Null),
                Cell::List(all) => {
                    let mut known = true;
                    for item in all.iter() {
                        match left.equals(item) {
                            Some(true) => return Ok(Cell::Bool(true)),
                            Some(false) => {}
                            None => known = false,
                        }
                    }
                    Ok(if known { Cell::Bool(false) } else { Cell::Null })
                }
                other => Err(wrong("a list", other).into()),
            },
            Operator::StartsWith | Operator::EndsWith | Operator::Contains => {
                let (Cell::Text(text), Cell::Text(part)) = (&left, &right) else {
                    return Ok(Cell::Null);
                };
                Ok(Cell::Bool(match operator {
                    Operator::StartsWith => text.starts_with(&**part),
                    Operator::EndsWith => text.ends_with(&**part),
                    _ => text.contains(&**part),
                }))
            }
            _ => arithmetic(operator, &left, &right),
        }
    }

    fn call(&self, function: Function, arguments: &[Expr], row: &[Cell]) -> Result<Cell> {
        if function == Function::Coalesce {
            for argument in arguments {
                let value = self.eval(argument, row)?;
                if value != Cell::Null {
                    return Ok(value);
                }
            }
            return Ok(Cell::Null);
        }
        let value = match arguments.first() {
            Some(argument) => self.eval(argument, row)?,
            None => Cell::Null,
        };
        if value == Cell::Null {
            return Ok(Cell::Null);
        }
        if matches!(function, Function::Pose | Function::Chain) {
            return match (value, self.eval(&arguments[1], row)?) {
                (_, Cell::Null) => Ok(Cell::Null),
                (Cell::Node(to), Cell::Node(from)) => self.chain(function, to, from),
                (Cell::Node(_), other) | (other, _) => Err(wrong("a node", &other).into()),
            };
        }
        let removed = |_| Error::Type("the element was removed".to_owned());
        match (function, &value) {
            (Function::Id, Cell::Node(node)) => {
                Ok(id_cell(self.graph.node(*node).map_err(removed)?.id()))
            }
            (Function::Id, Cell::Edge(edge)) => {
                Ok(id_cell(self.graph.edge(*edge).map_err(removed)?.id()))
            }
            (Function::Type, Cell::Node(node)) => {
                let node = self.graph.node(*node).map_err(removed)?;
                Ok(Cell::Text(node.type_name().into()))
            }
            (Function::Type, Cell::Edge(edge)) => {
                let edge = self.graph.edge(*edge).map_err(removed)?;
                Ok(Cell::Text(edge.type_name().into()))
            }
            (Function::Domain, Cell::Node(node)) => {
                let node = self.graph.node(*node).map_err(removed)?;
                Ok(self.domain(node.type_name()))
            }
            (Function::Domain, Cell::Edge(edge)) => {
                let edge = self.graph.edge(*edge).map_err(removed)?;
                Ok(self.domain(edge.type_name()))
            }
            (Function::StartNode, Cell::Edge(edge)) => {
                let from = self.graph.edge(*edge).map_err(removed)?.from();
                Ok(Cell::of_node(self.graph, from))
            }
            (Function::EndNode, Cell::Edge(edge)) => {
                let to = self.graph.edge(*edge).map_err(removed)?.to();
                Ok(Cell::of_node(self.graph, to))
            }
            (Function::Size, Cell::List(all)) => Ok(Cell::Int(all.len() as i64)),
            (Function::Size, Cell::Text(text)) => Ok(Cell::Int(text.chars().count() as i64)),
            (Function::Absolute, Cell::Int(number)) => {
                Ok(Cell::Int(number.checked_abs().ok_or(Error::Overflow)?))
            }
            (Function::Absolute, Cell::Float(number)) => Ok(Cell::Float(number.abs())),
            (Function::ToText, Cell::Text(_)) => Ok(value),
            (Function::ToText, Cell::Bool(_) | Cell::Int(_) | Cell::Float(_)) => {
                Ok(Cell::Text(value.shown(self.graph).into()))
            }
            (Function::Id | Function::Type | Function::Domain, other) => {
                Err(wrong("a node or an edge", other).into())
            }
            (Function::StartNode | Function::EndNode, other) => Err(wrong("an edge", other).into()),
            (Function::Size, other) => Err(wrong("a list or a text", other).into()),
            (_, other) => Err(wrong("a number", other).into()),
        }
    }
}

impl Scope<'_> {
    /// The pose of `from` in `to`, or the operations that lead there. Nothing if they are not
    /// connected.
    fn chain(&self, function: Function, to: NodeId, from: NodeId) -> Result<Cell> {
        // A chain may lead over all nodes.
        let left = self.walk.get();
        let left = left.checked_sub(self.graph.node_count() as u64);
        self.walk.set(left.ok_or(Error::Walks)?);
        if function == Function::Pose {
            let Ok(pose) = self.graph.pose(to, from) else {
                return Ok(Cell::Null);
            };
            let numbers = pose.translation.into_iter().chain(pose.rotation);
            return list(numbers.map(Cell::Float).collect());
        }
        let Ok(chain) = self.graph.chain(to, from) else {
            return Ok(Cell::Null);
        };
        let operations = chain.operations(self.graph).into_iter();
        list(operations.map(|text| Cell::Text(text.into())).collect())
    }
}

/// A list, with a bound on all that lists in it hold: a list of one list twice is small in memory, but
/// not for those that compare or print it.
fn list(cells: Vec<Cell>) -> Result<Cell> {
    let mut left = crate::budget::LONGEST_LIST;
    if !fits(&cells, &mut left) {
        return Err(Error::Overflow.into());
    }
    Ok(Cell::List(cells.into()))
}

/// Whether cells and those of their lists are `left` at most. It looks at no more than that.
fn fits(cells: &[Cell], left: &mut usize) -> bool {
    let rest = left.checked_sub(cells.len());
    rest.is_some_and(|rest| {
        *left = rest;
        let mut lists = cells.iter().filter_map(|cell| match cell {
            Cell::List(cells) => Some(cells),
            _ => None,
        });
        lists.all(|cells| fits(cells, left))
    })
}

fn arithmetic(operator: Operator, left: &Cell, right: &Cell) -> Result<Cell> {
    match (operator, left, right) {
        (_, Cell::Null, _) | (_, _, Cell::Null) => Ok(Cell::Null),
        (Operator::Add, Cell::Text(a), Cell::Text(b)) => {
            if a.len() + b.len() > crate::budget::LONGEST_TEXT {
                return Err(Error::Overflow.into());
            }
            Ok(Cell::Text(format!("{a}{b}").into()))
        }
        (Operator::Add, Cell::List(a), Cell::List(b)) => {
            list(a.iter().chain(b.iter()).cloned().collect())
        }
        (Operator::Add, Cell::List(all), one) => list(all.iter().chain([one]).cloned().collect()),
        (Operator::Add, one, Cell::List(all)) => {
            list([one].into_iter().chain(all.iter()).cloned().collect())
        }
        (_, Cell::Int(a), Cell::Int(b)) => {
            let number = match operator {
                Operator::Add => a.checked_add(*b),
                Operator::Subtract => a.checked_sub(*b),
                Operator::Multiply => a.checked_mul(*b),
                Operator::Divide | Operator::Modulo if *b == 0 => {
                    return Err(Error::Type("a division by zero".to_owned()).into());
                }
                Operator::Divide => a.checked_div(*b),
                _ => a.checked_rem(*b),
            };
            Ok(Cell::Int(number.ok_or(Error::Overflow)?))
        }
        _ => {
            let a = left.number().ok_or_else(|| wrong("a number", left))?;
            let b = right.number().ok_or_else(|| wrong("a number", right))?;
            Ok(Cell::Float(match operator {
                Operator::Add => a + b,
                Operator::Subtract => a - b,
                Operator::Multiply => a * b,
                Operator::Divide => a / b,
                _ => a % b,
            }))
        }
    }
}
