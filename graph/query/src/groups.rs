//! Groups of rows, and their aggregates.

use crate::ast::{Aggregate, Expr, InUnit, Item};
use crate::budget::{Budget, Error, Result};
use crate::cell::Cell;
use crate::eval::Scope;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Cells whose order is that of `ORDER BY`, so that they group rows.
#[derive(Clone)]
pub(crate) struct Key(pub(crate) Vec<Cell>);

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

/// The state of one aggregate.
#[derive(Clone, Default)]
struct Seen {
    /// How many values there were, without nulls.
    count: i64,
    /// The sum, while all values are integers.
    whole: Option<i64>,
    total: f64,
    /// The least or the greatest value.
    best: Option<Cell>,
    all: Vec<Cell>,
    /// With `DISTINCT`, the values so far.
    distinct: BTreeSet<Key>,
}

/// The rows of a group.
struct Group {
    keys: Vec<Cell>,
    /// The first row, for values outside of the aggregates.
    first: Vec<Cell>,
    /// By the place of the aggregate in the items.
    seen: Vec<Seen>,
}

/// `count`, `sum` or another one, and what of.
struct Counted<'p> {
    what: Aggregate,
    is_distinct: bool,
    value: Option<&'p Expr>,
}

/// One group for each combination of the values of the items that sum nothing.
pub(crate) struct Groups<'p> {
    items: &'p [Item],
    /// All aggregates of the items, in their order.
    counted: Vec<Counted<'p>>,
    places: BTreeMap<Key, usize>,
    /// In the order in which they came.
    all: Vec<Group>,
    has_keys: bool,
    /// Whether values outside of the aggregates are asked for.
    is_mixed: bool,
    keys: Key,
}

/// Collects the aggregates of an expression.
fn collect<'p>(expr: &'p Expr, all: &mut Vec<Counted<'p>>) {
    match expr {
        Expr::Aggregate(what, is_distinct, value) => all.push(Counted {
            what: *what,
            is_distinct: *is_distinct,
            value: value.as_deref(),
        }),
        Expr::Literal(_) | Expr::Variable(_) | Expr::Parameter(..) => {}
        Expr::Not(a) | Expr::Negate(a) | Expr::IsNull(a, _) | Expr::Property(a, _) => {
            collect(a, all);
        }
        Expr::InUnit(own) => collect(&own.of, all),
        Expr::Index(a, b) | Expr::Binary(_, a, b) => {
            collect(a, all);
            collect(b, all);
        }
        Expr::List(items) | Expr::Call(_, items) => {
            items.iter().for_each(|item| collect(item, all));
        }
    }
}

/// An expression with the values of its aggregates in their places.
fn flat(expr: &Expr, values: &mut impl Iterator<Item = Cell>) -> Expr {
    let mut inner = |a: &Expr| Box::new(flat(a, &mut *values));
    match expr {
        Expr::Aggregate(..) => Expr::Literal(values.next().unwrap_or(Cell::Null)),
        Expr::Literal(_) | Expr::Variable(_) | Expr::Parameter(..) => expr.clone(),
        Expr::Not(a) => Expr::Not(inner(a)),
        Expr::Negate(a) => Expr::Negate(inner(a)),
        Expr::IsNull(a, wanted) => Expr::IsNull(inner(a), *wanted),
        Expr::Property(a, name) => Expr::Property(inner(a), name.clone()),
        Expr::InUnit(own) => Expr::InUnit(Box::new(InUnit {
            of: *inner(&own.of),
            unit: own.unit.clone(),
            factor: own.factor,
        })),
        Expr::Index(a, b) => Expr::Index(inner(a), inner(b)),
        Expr::Binary(operator, a, b) => Expr::Binary(*operator, inner(a), inner(b)),
        Expr::List(all) => Expr::List(all.iter().map(|item| *inner(item)).collect()),
        Expr::Call(function, all) => {
            Expr::Call(*function, all.iter().map(|item| *inner(item)).collect())
        }
    }
}

impl<'p> Groups<'p> {
    pub(crate) fn new(items: &'p [Item]) -> Self {
        let mut counted = Vec::new();
        items
            .iter()
            .for_each(|item| collect(&item.value, &mut counted));
        let sums = |item: &&Item| item.value.has_aggregate();
        let is_alone = |item: &Item| matches!(item.value, Expr::Aggregate(..));
        Self {
            items,
            counted,
            places: BTreeMap::new(),
            all: Vec::new(),
            has_keys: items.iter().any(|item| !item.value.has_aggregate()),
            is_mixed: !items.iter().filter(sums).all(is_alone),
            keys: Key(Vec::new()),
        }
    }

    /// Whether equal rows may be added at once: they are not listed one by one.
    pub(crate) fn is_weighted(&self) -> bool {
        let mut counted = self.counted.iter();
        counted.all(|counted| counted.what != Aggregate::Collect)
    }

    /// The place of the group of a row.
    fn group(&mut self, row: &[Cell], budget: &mut Budget) -> Result<usize> {
        let found = if self.has_keys {
            self.places.get(&self.keys).copied()
        } else {
            self.all.len().checked_sub(1)
        };
        if let Some(found) = found {
            return Ok(found);
        }
        let keys = std::mem::take(&mut self.keys.0);
        let first = if self.is_mixed { row } else { &[] };
        budget.keep(2 * keys.len() + first.len() + 6 * self.counted.len())?;
        self.all.push(Group {
            keys: keys.clone(),
            first: first.to_vec(),
            seen: vec![
                Seen {
                    whole: Some(0),
                    ..Seen::default()
                };
                self.counted.len()
            ],
        });
        let at = self.all.len() - 1;
        if self.has_keys {
            self.places.insert(Key(keys), at);
        }
        Ok(at)
    }

    /// Adds so many equal rows to their group.
    pub(crate) fn add(
        &mut self,
        row: &[Cell],
        weight: u32,
        scope: &Scope<'_>,
        budget: &mut Budget,
    ) -> Result<()> {
        self.keys.0.clear();
        if self.has_keys {
            for item in self.items.iter().filter(|item| !item.value.has_aggregate()) {
                let cell = budget.hold(scope.eval(&item.value, row)?)?;
                self.keys.0.push(cell);
            }
        }
        let at = self.group(row, budget)?;
        for (counted, seen) in self.counted.iter().zip(&mut self.all[at].seen) {
            let Some(value) = counted.value else {
                seen.count += i64::from(weight);
                continue;
            };
            budget.step()?;
            let cell = scope.eval(value, row)?;
            // Nulls are not counted.
            if matches!(cell, Cell::Null) {
                continue;
            }
            if !counted.is_distinct {
                let cell = if counted.what == Aggregate::Collect {
                    budget.keep(1)?;
                    budget.hold(cell)?
                } else {
                    cell
                };
                seen.add(counted.what, cell, weight)?;
            } else if seen.distinct.insert(Key(vec![cell.clone()])) {
                budget.keep(1)?;
                seen.add(counted.what, budget.hold(cell)?, 1)?;
            }
        }
        Ok(())
    }

    /// The values of the items of each group.
    pub(crate) fn rows(mut self, scope: &Scope<'_>, budget: &mut Budget) -> Result<Vec<Vec<Cell>>> {
        if self.all.is_empty() && !self.has_keys {
            // No rows count as one row of zeros.
            self.keys.0.clear();
            self.group(&[], budget)?;
        }
        let mut rows = Vec::with_capacity(self.all.len());
        for group in self.all {
            budget.row()?;
            let mut keys = group.keys.into_iter();
            let seen = self.counted.iter().zip(group.seen);
            let mut values = seen.map(|(counted, seen)| seen.value(counted.what));
            let mut row = Vec::with_capacity(self.items.len());
            for item in self.items {
                row.push(match &item.value {
                    Expr::Aggregate(..) => values.next().unwrap_or(Cell::Null),
                    value if value.has_aggregate() => {
                        scope.eval(&flat(value, &mut values), &group.first)?
                    }
                    _ => keys.next().unwrap_or(Cell::Null),
                });
            }
            rows.push(row);
        }
        Ok(rows)
    }
}

impl Seen {
    /// Adds a value so many times.
    fn add(&mut self, what: Aggregate, cell: Cell, weight: u32) -> Result<()> {
        self.count += i64::from(weight);
        match what {
            Aggregate::Count => {}
            Aggregate::Collect => self.all.push(cell),
            Aggregate::Sum | Aggregate::Average => {
                self.whole = match (self.whole, &cell) {
                    (Some(sum), Cell::Int(number)) => {
                        let all = number.checked_mul(weight.into());
                        let sum = all.and_then(|all| sum.checked_add(all));
                        Some(sum.ok_or(Error::Overflow)?)
                    }
                    _ => None,
                };
                let Some(number) = cell.number() else {
                    return Err(Error::Type("a sum is of numbers".to_owned()).into());
                };
                self.total += number * f64::from(weight);
            }
            Aggregate::Least => {
                let best = self.best.as_ref();
                if best.is_none_or(|best| cell.sorted(best).is_lt()) {
                    self.best = Some(cell);
                }
            }
            Aggregate::Greatest => {
                let best = self.best.as_ref();
                if best.is_none_or(|best| cell.sorted(best).is_ge()) {
                    self.best = Some(cell);
                }
            }
        }
        Ok(())
    }

    /// The count or the sum.
    fn value(self, what: Aggregate) -> Cell {
        let sum = self.whole.map_or(Cell::Float(self.total), Cell::Int);
        match what {
            Aggregate::Count => Cell::Int(self.count),
            Aggregate::Collect => Cell::List(self.all.into()),
            Aggregate::Sum => sum,
            Aggregate::Average if self.count == 0 => Cell::Null,
            Aggregate::Average => Cell::Float(sum.number().unwrap_or_default() / self.count as f64),
            Aggregate::Least | Aggregate::Greatest => self.best.unwrap_or(Cell::Null),
        }
    }
}
