//! Clauses: from rows to rows, within a budget.

use crate::ast::{Aggregate, Clause, Expr, Item, Project};
use crate::cell::Cell;
use crate::eval::{Scope, truth};
use crate::matching;
use crate::parse::Parsed;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use thiserror::Error;

/// How many cells a list holds at most that an expression makes, with those of lists in it.
pub(crate) const LONGEST_LIST: usize = 1 << 16;
/// The longest text that an expression makes, in bytes.
pub(crate) const LONGEST_TEXT: usize = 1 << 20;

/// How many bytes the values hold at most that a query computes, in all its rows.
const MOST_BYTES: usize = 256 << 20;

/// Why a query did not end.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The query takes more steps than its budget.
    #[error("the query takes more than {0} steps")]
    Steps(u64),
    /// The query makes more rows than its budget.
    #[error("the query makes more than {0} rows")]
    Rows(usize),
    /// The values of all rows hold more bytes than a query may have.
    #[error("the values of the query hold more than {0} MiB")]
    Bytes(usize),
    /// A value has a type with which an operation is not possible.
    #[error("{0}")]
    Type(String),
    /// `pose` and `chain` walk over more nodes than the budget of steps allows.
    #[error("`pose` and `chain` walk over too many nodes")]
    Walks,
    /// A number, a text or a list is too large.
    #[error("a number, a text or a list is too large")]
    Overflow,
    /// A parameter has no value.
    #[error("the parameter `${0}` has no value")]
    Parameter(String),
    /// The schema has no query of this name. The second text has the names that it has.
    #[error("the schema has no query `{0}`{1}")]
    UnknownQuery(String, String),
    /// The text of a query of the schema has this fault.
    #[error("{0}")]
    Text(String),
    /// A query of the schema has no such parameter.
    #[error("the query `{query}` has no parameter `{parameter}`{hint}")]
    UnknownParameter {
        /// The query.
        query: String,
        /// The parameter.
        parameter: String,
        /// The names that it has.
        hint: String,
    },
    /// A parameter of a query of the schema has a value of another type.
    #[error("the parameter `${parameter}` is `{found}`, expected {expected}")]
    Argument {
        /// The parameter.
        parameter: String,
        /// What its type accepts.
        expected: String,
        /// The value.
        found: String,
    },
    /// The name of a node, as the value of a parameter, is that of no node or of several ones.
    #[error("expected one node of type `{entity}` with the name `{name}`, found {count}")]
    Named {
        /// The entity.
        entity: String,
        /// The name.
        name: String,
        /// How many nodes have it.
        count: usize,
    },
}

/// How much a query may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Steps that are left.
    pub steps: u64,
    /// Rows that are left; also those between two clauses count.
    pub rows: usize,
    bytes: usize,
    all: (u64, usize),
}

impl Default for Budget {
    fn default() -> Self {
        Self::new(10_000_000, 100_000)
    }
}

impl Budget {
    /// A budget of steps and of rows.
    pub fn new(steps: u64, rows: usize) -> Self {
        Self {
            steps,
            rows,
            bytes: MOST_BYTES,
            all: (steps, rows),
        }
    }

    pub(crate) fn step(&mut self) -> Result<(), Error> {
        self.steps = self.steps.checked_sub(1).ok_or(Error::Steps(self.all.0))?;
        Ok(())
    }

    pub(crate) fn row(&mut self) -> Result<(), Error> {
        self.rows = self.rows.checked_sub(1).ok_or(Error::Rows(self.all.1))?;
        Ok(())
    }
}

impl Budget {
    /// Counts what a computed value holds.
    fn hold(&mut self, cell: Cell) -> Result<Cell, Error> {
        let left = self.bytes.checked_sub(cell.bytes());
        self.bytes = left.ok_or(Error::Bytes(MOST_BYTES >> 20))?;
        Ok(cell)
    }
}

/// A cell whose order is that of `ORDER BY`, so that it groups rows.
struct Key(Vec<Cell>);

impl Ord for Key {
    fn cmp(&self, other: &Self) -> Ordering {
        let pairs = self.0.iter().zip(&other.0);
        let mut orders = pairs.map(|(a, b)| a.sorted(b));
        orders
            .find(|order| order.is_ne())
            .unwrap_or(Ordering::Equal)
    }
}

impl PartialOrd for Key {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Key {}

/// The rows of a query.
pub(crate) fn run(
    parsed: &Parsed,
    scope: &Scope<'_>,
    budget: &mut Budget,
) -> Result<Vec<Vec<Cell>>, Error> {
    let width = parsed.variables.len();
    let mut rows = vec![vec![Cell::Null; width]];
    for clause in &parsed.clauses {
        match clause {
            Clause::Match(pattern) => {
                let mut next = Vec::new();
                for row in &rows {
                    let found = matching::rows(scope, pattern, row, budget)?;
                    if found.is_empty() && pattern.optional {
                        budget.row()?;
                        next.push(row.clone());
                    }
                    next.extend(found);
                }
                rows = next;
            }
            Clause::Project(project) => rows = self::project(project, scope, rows, width, budget)?,
        }
    }
    let Some(Clause::Project(last)) = parsed.clauses.last() else {
        return Ok(Vec::new());
    };
    let columns: Vec<usize> = last.items.iter().map(|item| item.variable).collect();
    let cut = rows.into_iter().map(|row| {
        let cells = columns.iter().map(|slot| row[*slot].clone());
        cells.collect()
    });
    Ok(cut.collect())
}

fn project(
    project: &Project,
    scope: &Scope<'_>,
    rows: Vec<Vec<Cell>>,
    width: usize,
    budget: &mut Budget,
) -> Result<Vec<Vec<Cell>>, Error> {
    let mut made = if project.items.iter().any(|item| item.value.has_aggregate()) {
        grouped(&project.items, scope, &rows, width, budget)?
    } else {
        let mut made = Vec::with_capacity(rows.len());
        for mut row in rows {
            budget.step()?;
            for item in &project.items {
                row[item.variable] = budget.hold(scope.eval(&item.value, &row)?)?;
            }
            made.push(row);
        }
        made
    };
    if project.distinct {
        let mut seen = std::collections::BTreeSet::new();
        made.retain(|row| {
            let cells = project.items.iter().map(|item| row[item.variable].clone());
            seen.insert(Key(cells.collect()))
        });
    }
    if !project.order.is_empty() {
        let mut keyed = Vec::with_capacity(made.len());
        for row in made {
            budget.step()?;
            let keys = project.order.iter();
            let keys = keys.map(|(value, _)| budget.hold(scope.eval(value, &row)?));
            keyed.push((keys.collect::<Result<Vec<Cell>, Error>>()?, row));
        }
        keyed.sort_by(|(a, _), (b, _)| {
            let keys = a.iter().zip(b).zip(&project.order);
            let mut orders = keys.map(|((a, b), (_, down))| {
                let order = a.sorted(b);
                if *down { order.reverse() } else { order }
            });
            orders
                .find(|order| order.is_ne())
                .unwrap_or(Ordering::Equal)
        });
        made = keyed.into_iter().map(|(_, row)| row).collect();
    }
    let empty = vec![Cell::Null; width];
    let count = |value: &Option<Expr>| -> Result<Option<usize>, Error> {
        let Some(value) = value else { return Ok(None) };
        match scope.eval(value, &empty)? {
            Cell::Int(number) if number >= 0 => Ok(Some(number as usize)),
            _ => Err(Error::Type(
                "expected a count that is not negative".to_owned(),
            )),
        }
    };
    if let Some(skip) = count(&project.skip)? {
        made.drain(..skip.min(made.len()));
    }
    if let Some(limit) = count(&project.limit)? {
        made.truncate(limit);
    }
    if let Some(condition) = &project.condition {
        let mut kept = Vec::new();
        for row in made {
            budget.step()?;
            if truth(&scope.eval(condition, &row)?)? == Some(true) {
                kept.push(row);
            }
        }
        made = kept;
    }
    // Nothing but the new names is known from now on.
    for row in &mut made {
        let kept: Vec<(usize, Cell)> = project
            .items
            .iter()
            .map(|item| (item.variable, row[item.variable].clone()))
            .collect();
        row.fill(Cell::Null);
        for (slot, cell) in kept {
            row[slot] = cell;
        }
    }
    Ok(made)
}

/// One row for each group of equal values of the items that sum nothing.
fn grouped(
    items: &[Item],
    scope: &Scope<'_>,
    rows: &[Vec<Cell>],
    width: usize,
    budget: &mut Budget,
) -> Result<Vec<Vec<Cell>>, Error> {
    let is_key = |item: &&Item| !item.value.has_aggregate();
    let mut groups: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
    let mut order = Vec::new();
    for (at, row) in rows.iter().enumerate() {
        budget.step()?;
        let keys = items.iter().filter(is_key);
        let keys = keys.map(|item| budget.hold(scope.eval(&item.value, row)?));
        let keys: Result<Vec<Cell>, Error> = keys.collect();
        let group = groups.entry(Key(keys?)).or_default();
        if group.is_empty() {
            order.push(at);
        }
        group.push(at);
    }
    if groups.is_empty() && items.iter().all(|item| item.value.has_aggregate()) {
        // Nothing counts to one row of zeros.
        groups.insert(Key(Vec::new()), Vec::new());
    }
    let mut sorted: Vec<(Key, Vec<usize>)> = groups.into_iter().collect();
    sorted.sort_by_key(|(_, members)| members.first().copied());
    let mut made = Vec::new();
    for (key, members) in sorted {
        budget.row()?;
        let mut row = vec![Cell::Null; width];
        let mut keys = key.0.into_iter();
        for item in items {
            row[item.variable] = if item.value.has_aggregate() {
                let members: Vec<&Vec<Cell>> = members.iter().map(|at| &rows[*at]).collect();
                aggregated(&item.value, scope, &members, budget)?
            } else {
                keys.next().unwrap_or(Cell::Null)
            };
        }
        made.push(row);
    }
    Ok(made)
}

/// An expression with sums in it.
fn aggregated(
    expr: &Expr,
    scope: &Scope<'_>,
    rows: &[&Vec<Cell>],
    budget: &mut Budget,
) -> Result<Cell, Error> {
    let inner = |a: &Expr, budget: &mut Budget| -> Result<Box<Expr>, Error> {
        Ok(Box::new(Expr::Literal(aggregated(a, scope, rows, budget)?)))
    };
    let empty = Vec::new();
    let first = rows.first().copied().unwrap_or(&empty);
    let flat = match expr {
        Expr::Aggregate(what, distinct, value) => {
            return aggregate(*what, *distinct, value.as_deref(), scope, rows, budget);
        }
        _ if !expr.has_aggregate() => return scope.eval(expr, first),
        Expr::Not(a) => Expr::Not(inner(a, budget)?),
        Expr::Negate(a) => Expr::Negate(inner(a, budget)?),
        Expr::IsNull(a, wanted) => Expr::IsNull(inner(a, budget)?, *wanted),
        Expr::Property(a, name) => Expr::Property(inner(a, budget)?, name.clone()),
        Expr::Index(a, b) => Expr::Index(inner(a, budget)?, inner(b, budget)?),
        Expr::Binary(operator, a, b) => {
            Expr::Binary(*operator, inner(a, budget)?, inner(b, budget)?)
        }
        Expr::List(all) | Expr::Call(_, all) => {
            let mut flat = Vec::new();
            for item in all {
                flat.push(*inner(item, budget)?);
            }
            match expr {
                Expr::Call(function, _) => Expr::Call(*function, flat),
                _ => Expr::List(flat),
            }
        }
        Expr::Literal(_) | Expr::Variable(_) | Expr::Parameter(_) => expr.clone(),
    };
    scope.eval(&flat, first)
}

fn aggregate(
    what: Aggregate,
    distinct: bool,
    value: Option<&Expr>,
    scope: &Scope<'_>,
    rows: &[&Vec<Cell>],
    budget: &mut Budget,
) -> Result<Cell, Error> {
    let Some(value) = value else {
        return Ok(Cell::Int(rows.len() as i64));
    };
    let mut cells = Vec::new();
    for row in rows {
        budget.step()?;
        let cell = scope.eval(value, row)?;
        // Nothing is not counted.
        if cell != Cell::Null {
            cells.push(cell);
        }
    }
    if distinct {
        let mut seen = std::collections::BTreeSet::new();
        cells.retain(|cell| seen.insert(Key(vec![cell.clone()])));
    }
    let sum = |cells: &[Cell]| -> Result<Cell, Error> {
        let mut whole: Option<i64> = Some(0);
        let mut total = 0.0;
        for cell in cells {
            whole = match (whole, cell) {
                (Some(sum), Cell::Int(number)) => {
                    Some(sum.checked_add(*number).ok_or(Error::Overflow)?)
                }
                _ => None,
            };
            let number = cell.number();
            total += number.ok_or_else(|| Error::Type("a sum is of numbers".to_owned()))?;
        }
        Ok(whole.map_or(Cell::Float(total), Cell::Int))
    };
    Ok(match what {
        Aggregate::Count => Cell::Int(cells.len() as i64),
        Aggregate::Collect => Cell::List(cells.into()),
        Aggregate::Sum => sum(&cells)?,
        Aggregate::Average if cells.is_empty() => Cell::Null,
        Aggregate::Average => {
            let total = sum(&cells)?.number().unwrap_or_default();
            Cell::Float(total / cells.len() as f64)
        }
        Aggregate::Least => cells.into_iter().min_by(Cell::sorted).unwrap_or(Cell::Null),
        Aggregate::Greatest => cells.into_iter().max_by(Cell::sorted).unwrap_or(Cell::Null),
    })
}
