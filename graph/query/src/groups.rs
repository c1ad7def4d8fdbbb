//! Groups of rows, and what is counted and summed of each.

use crate::ast::{Aggregate, Expr, InUnit, Item};
use crate::budget::{Budget, Error};
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

/// What one aggregate has seen.
#[derive(Clone, Default)]
struct Seen {
    /// How many values there were, without those that are nothing.
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

/// One group for each combination of the values of the items that sum nothing.
pub(crate) struct Groups {
    places: BTreeMap<Key, usize>,
    /// In the order in which they came.
    all: Vec<Group>,
    has_keys: bool,
    /// Whether values outside of the aggregates are asked for.
    is_mixed: bool,
    aggregates: usize,
    keys: Key,
}

/// Calls `f` with each aggregate of an expression, in its order.
fn each<'e>(
    expr: &'e Expr,
    f: &mut dyn FnMut(Aggregate, bool, Option<&'e Expr>) -> Result<(), Error>,
) -> Result<(), Error> {
    match expr {
        Expr::Aggregate(what, distinct, value) => f(*what, *distinct, value.as_deref()),
        Expr::Literal(_) | Expr::Variable(_) | Expr::Parameter(..) => Ok(()),
        Expr::Not(a) | Expr::Negate(a) | Expr::IsNull(a, _) | Expr::Property(a, _) => each(a, f),
        Expr::InUnit(own) => each(&own.of, f),
        Expr::Index(a, b) | Expr::Binary(_, a, b) => {
            each(a, f)?;
            each(b, f)
        }
        Expr::List(all) | Expr::Call(_, all) => all.iter().try_for_each(|item| each(item, f)),
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

impl Groups {
    pub(crate) fn new(items: &[Item]) -> Self {
        let mut aggregates = 0;
        for item in items {
            let _ = each(&item.value, &mut |_, _, _| {
                aggregates += 1;
                Ok(())
            });
        }
        let sums = |item: &&Item| item.value.has_aggregate();
        let is_alone = |item: &Item| matches!(item.value, Expr::Aggregate(..));
        Self {
            places: BTreeMap::new(),
            all: Vec::new(),
            has_keys: items.iter().any(|item| !item.value.has_aggregate()),
            is_mixed: !items.iter().filter(sums).all(is_alone),
            aggregates,
            keys: Key(Vec::new()),
        }
    }

    fn group(&mut self, row: &[Cell]) -> &mut Group {
        let found = if self.has_keys {
            self.places.get(&self.keys).copied()
        } else {
            self.all.len().checked_sub(1)
        };
        let at = found.unwrap_or_else(|| {
            let keys = std::mem::take(&mut self.keys.0);
            self.all.push(Group {
                keys: keys.clone(),
                first: if self.is_mixed {
                    row.to_vec()
                } else {
                    Vec::new()
                },
                seen: vec![
                    Seen {
                        whole: Some(0),
                        ..Seen::default()
                    };
                    self.aggregates
                ],
            });
            let at = self.all.len() - 1;
            if self.has_keys {
                self.places.insert(Key(keys), at);
            }
            at
        });
        &mut self.all[at]
    }

    /// Adds a row to its group.
    pub(crate) fn add(
        &mut self,
        items: &[Item],
        row: &[Cell],
        scope: &Scope<'_>,
        budget: &mut Budget,
    ) -> Result<(), Error> {
        self.keys.0.clear();
        if self.has_keys {
            let keys = items.iter().filter(|item| !item.value.has_aggregate());
            for item in keys {
                let cell = budget.hold(scope.eval(&item.value, row)?)?;
                self.keys.0.push(cell);
            }
        }
        let group = self.group(row);
        let mut seen = group.seen.iter_mut();
        for item in items {
            each(&item.value, &mut |what, distinct, value| {
                let Some(seen) = seen.next() else {
                    return Ok(());
                };
                let Some(value) = value else {
                    seen.count += 1;
                    return Ok(());
                };
                budget.step()?;
                let cell = scope.eval(value, row)?;
                // Nothing is not counted.
                if cell == Cell::Null || distinct && !seen.distinct.insert(Key(vec![cell.clone()]))
                {
                    return Ok(());
                }
                seen.add(what, cell)
            })?;
        }
        Ok(())
    }

    /// The values of the items of each group.
    pub(crate) fn rows(
        mut self,
        items: &[Item],
        scope: &Scope<'_>,
        budget: &mut Budget,
    ) -> Result<Vec<Vec<Cell>>, Error> {
        if self.all.is_empty() && !self.has_keys {
            // Nothing counts to one row of zeros.
            self.keys.0.clear();
            self.group(&[]);
        }
        let mut rows = Vec::with_capacity(self.all.len());
        for group in self.all {
            budget.row()?;
            let mut keys = group.keys.into_iter();
            let mut seen = group.seen.into_iter();
            let mut row = Vec::with_capacity(items.len());
            for item in items {
                let mut values = Vec::new();
                each(&item.value, &mut |what, _, _| {
                    values.push(seen.next().unwrap_or_default().value(what));
                    Ok(())
                })?;
                row.push(match &item.value {
                    Expr::Aggregate(..) => values.pop().unwrap_or(Cell::Null),
                    value if value.has_aggregate() => {
                        scope.eval(&flat(value, &mut values.into_iter()), &group.first)?
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
    /// Adds a value.
    fn add(&mut self, what: Aggregate, cell: Cell) -> Result<(), Error> {
        self.count += 1;
        match what {
            Aggregate::Count => {}
            Aggregate::Collect => self.all.push(cell),
            Aggregate::Sum | Aggregate::Average => {
                self.whole = match (self.whole, &cell) {
                    (Some(sum), Cell::Int(number)) => {
                        Some(sum.checked_add(*number).ok_or(Error::Overflow)?)
                    }
                    _ => None,
                };
                let number = cell.number();
                self.total +=
                    number.ok_or_else(|| Error::Type("a sum is of numbers".to_owned()))?;
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
