//! Clauses as stages: each takes one row after the other, and passes rows to the next stage as soon
//! as it can. Stages that sort or aggregate pass them on at the end.

use crate::ast::{Clause, Expr, Match, Project};
use crate::budget::{Budget, Error, Result};
use crate::cell::Cell;
use crate::eval::{Scope, truth};
use crate::groups::{Groups, Key};
use crate::matching;
use crate::parse::Parsed;
use crate::plan::Plan;
use std::cmp::Ordering;
use std::collections::BTreeSet;

/// A row of the result.
type Row = Vec<Cell>;

enum Stage<'p> {
    Match(&'p Match, Plan<'p>),
    Project(Projection<'p>),
}

/// `WITH` or `RETURN`.
struct Projection<'p> {
    project: &'p Project,
    taken: Collected<'p>,
    /// The row for the next stage: nothing but the new names is known there.
    next: Row,
    /// The rows so far, with `DISTINCT`.
    seen: BTreeSet<Key>,
    /// How many rows are enough: those of `SKIP` and `LIMIT`, if nothing sorts them.
    enough: Option<usize>,
}

/// The rows that a projection has taken.
enum Collected<'p> {
    /// They are given on at once.
    None,
    Groups(Groups<'p>),
    /// Each after the values that it is sorted by.
    Rows(Vec<(Row, Row)>),
}

/// The state that all stages share.
struct Run<'a> {
    scope: &'a Scope<'a>,
    rows: Vec<Row>,
    /// Whether a projection needs no more rows. An error then leads out of the stages before it, and is
    /// none.
    is_enough: bool,
}

/// The rows of a query.
pub(crate) fn run(parsed: &Parsed, scope: &Scope<'_>, budget: &mut Budget) -> Result<Vec<Row>> {
    let width = parsed.variables.len();
    let stages = parsed.clauses.iter().map(|clause| match clause {
        Clause::Match(pattern) => Stage::Match(pattern, Plan::new(scope, pattern)),
        Clause::Project(project) => Stage::Project(Projection::new(project, width, scope)),
    });
    let mut stages: Vec<Stage<'_>> = stages.collect();
    for at in 1..stages.len() {
        if let [Stage::Match(pattern, plan), Stage::Project(next)] = &mut stages[at - 1..=at]
            && let Collected::Groups(groups) = &next.taken
            && groups.is_weighted()
        {
            plan.share(pattern, &next.project.items);
        }
    }
    let mut run = Run {
        scope,
        rows: Vec::new(),
        is_enough: false,
    };
    let done = run.push(&mut stages, &mut vec![Cell::Null; width], 1, budget);
    run.until_enough(done)?;
    let mut rest = stages.as_mut_slice();
    while let Some((stage, next)) = rest.split_first_mut() {
        if let Stage::Project(projection) = stage {
            let done = run.finish(projection, next, budget);
            run.until_enough(done)?;
        }
        rest = next;
    }
    Ok(run.rows)
}

impl<'p> Projection<'p> {
    fn new(project: &'p Project, width: usize, scope: &Scope<'_>) -> Self {
        let sums = project.items.iter().any(|item| item.value.has_aggregate());
        let is_cut = project.skip.is_some() || project.limit.is_some();
        let taken = if sums {
            Collected::Groups(Groups::new(&project.items))
        } else if project.order.is_empty() && !is_cut {
            Collected::None
        } else {
            Collected::Rows(Vec::new())
        };
        // A count that is wrong is an error at the end.
        let skip = count(project.skip.as_ref(), scope).unwrap_or_default();
        let limit = count(project.limit.as_ref(), scope).unwrap_or_default();
        let is_sorted = !project.order.is_empty();
        let limit = limit.filter(|_| !is_sorted && matches!(taken, Collected::Rows(_)));
        Self {
            project,
            taken,
            next: vec![Cell::Null; width],
            seen: BTreeSet::new(),
            enough: limit.map(|limit| limit.saturating_add(skip.unwrap_or_default())),
        }
    }

    /// The values of the new names.
    fn cells(&self, row: &[Cell]) -> Row {
        let items = self.project.items.iter();
        items.map(|item| row[item.variable].clone()).collect()
    }

    /// Whether a row is none of those before, which matters with `DISTINCT`.
    fn is_new(&mut self, row: &[Cell]) -> bool {
        !self.project.distinct || self.seen.insert(Key(self.cells(row)))
    }

    /// A row until the end: the values that it is sorted by, and those of the new names, or all if a
    /// condition follows.
    fn kept(&self, row: &[Cell], scope: &Scope<'_>, budget: &mut Budget) -> Result<(Row, Row)> {
        let mut keys = Row::new();
        if !self.project.order.is_empty() {
            budget.step()?;
            for (value, _) in &self.project.order {
                keys.push(budget.hold(scope.eval(value, row)?)?);
            }
        }
        let kept = match self.project.condition {
            Some(_) => row.to_vec(),
            None => self.cells(row),
        };
        budget.keep(keys.len() + kept.len())?;
        Ok((keys, kept))
    }

    /// Whether the condition that follows holds.
    fn passes(&self, row: &[Cell], scope: &Scope<'_>, budget: &mut Budget) -> Result<bool> {
        let Some(condition) = &self.project.condition else {
            return Ok(true);
        };
        budget.step()?;
        Ok(truth(&scope.eval(condition, row)?)? == Some(true))
    }

    /// Sorts rows, and cuts them as `SKIP` and `LIMIT` say.
    fn cut(&self, rows: &mut Vec<(Row, Row)>, scope: &Scope<'_>) -> Result<()> {
        let order = &self.project.order;
        if !order.is_empty() {
            rows.sort_by(|(a, _), (b, _)| {
                let keys = a.iter().zip(b).zip(order);
                let mut orders = keys.map(|((a, b), (_, down))| {
                    let order = a.sorted(b);
                    if *down { order.reverse() } else { order }
                });
                orders
                    .find(|order| order.is_ne())
                    .unwrap_or(Ordering::Equal)
            });
        }
        if let Some(skip) = count(self.project.skip.as_ref(), scope)? {
            rows.drain(..skip.min(rows.len()));
        }
        if let Some(limit) = count(self.project.limit.as_ref(), scope)? {
            rows.truncate(limit);
        }
        Ok(())
    }
}

/// The count of `SKIP` or `LIMIT`.
fn count(value: Option<&Expr>, scope: &Scope<'_>) -> Result<Option<usize>> {
    let Some(value) = value else { return Ok(None) };
    match scope.eval(value, &[])? {
        Cell::Int(number) if number >= 0 => Ok(Some(number as usize)),
        _ => Err(Error::Type("expected a count that is not negative".to_owned()).into()),
    }
}

impl Run<'_> {
    /// The result of stages that may have ended because a later one has enough.
    fn until_enough(&mut self, done: Result<()>) -> Result<()> {
        if std::mem::take(&mut self.is_enough) {
            return Ok(());
        }
        done
    }

    /// Passes this many equal rows to a stage and the following ones: more than one only to a
    /// projection that aggregates.
    fn push(
        &mut self,
        stages: &mut [Stage<'_>],
        row: &mut [Cell],
        weight: u32,
        budget: &mut Budget,
    ) -> Result<()> {
        let Some((stage, rest)) = stages.split_first_mut() else {
            return Ok(());
        };
        match stage {
            Stage::Match(pattern, plan) => {
                let scope = self.scope;
                let mut next = |row: &mut [Cell], weight: u32, budget: &mut Budget| {
                    self.push(rest, row, weight, budget)
                };
                if !matching::rows(scope, pattern, plan, row, budget, &mut next)?
                    && pattern.optional
                {
                    budget.row()?;
                    self.push(rest, row, 1, budget)?;
                }
                Ok(())
            }
            Stage::Project(projection) => self.take(projection, rest, row, weight, budget),
        }
    }

    /// Gives a row to a projection.
    fn take(
        &mut self,
        projection: &mut Projection<'_>,
        rest: &mut [Stage<'_>],
        row: &mut [Cell],
        weight: u32,
        budget: &mut Budget,
    ) -> Result<()> {
        budget.step()?;
        let (scope, project) = (self.scope, projection.project);
        if let Collected::Groups(groups) = &mut projection.taken {
            return groups.add(row, weight, scope, budget);
        }
        let is_plain = !project.distinct && matches!(projection.taken, Collected::None);
        if rest.is_empty() && is_plain {
            budget.keep(project.items.len())?;
            let mut cells = Row::with_capacity(project.items.len());
            for item in &project.items {
                cells.push(budget.hold(scope.eval(&item.value, row)?)?);
            }
            self.rows.push(cells);
            return Ok(());
        }
        for item in &project.items {
            row[item.variable] = budget.hold(scope.eval(&item.value, row)?)?;
        }
        if !projection.is_new(row) {
            return Ok(());
        }
        if project.distinct {
            budget.keep(project.items.len())?;
        }
        if let Collected::Rows(_) = projection.taken {
            let kept = projection.kept(row, scope, budget)?;
            if let Collected::Rows(rows) = &mut projection.taken {
                rows.push(kept);
                if projection.enough.is_some_and(|enough| rows.len() >= enough) {
                    self.is_enough = true;
                    return Err(Error::Rows(rows.len()).into());
                }
            }
            return Ok(());
        }
        if projection.passes(row, scope, budget)? {
            let items = project.items.iter();
            let cells = items.map(|item| row[item.variable].clone());
            self.give(projection, rest, cells, budget)?;
        }
        Ok(())
    }

    /// Passes on the rows that a projection has taken.
    fn finish(
        &mut self,
        projection: &mut Projection<'_>,
        rest: &mut [Stage<'_>],
        budget: &mut Budget,
    ) -> Result<()> {
        let (scope, project) = (self.scope, projection.project);
        let mut rows = match std::mem::replace(&mut projection.taken, Collected::None) {
            Collected::None => return Ok(()),
            Collected::Rows(rows) => rows,
            Collected::Groups(groups) => {
                let mut rows = Vec::new();
                let mut row = vec![Cell::Null; projection.next.len()];
                for cells in groups.rows(scope, budget)? {
                    for (item, cell) in project.items.iter().zip(cells) {
                        row[item.variable] = cell;
                    }
                    if projection.is_new(&row) {
                        rows.push(projection.kept(&row, scope, budget)?);
                    }
                }
                rows
            }
        };
        projection.cut(&mut rows, scope)?;
        for (_, kept) in rows {
            if !projection.passes(&kept, scope, budget)? {
                continue;
            }
            let cells = match project.condition {
                Some(_) => projection.cells(&kept),
                None => kept,
            };
            self.give(projection, rest, cells, budget)?;
        }
        Ok(())
    }

    /// Gives the values of the new names on.
    fn give(
        &mut self,
        projection: &mut Projection<'_>,
        rest: &mut [Stage<'_>],
        cells: impl IntoIterator<Item = Cell>,
        budget: &mut Budget,
    ) -> Result<()> {
        if rest.is_empty() {
            budget.keep(projection.project.items.len())?;
            self.rows.push(cells.into_iter().collect());
            return Ok(());
        }
        for (item, cell) in projection.project.items.iter().zip(cells) {
            projection.next[item.variable] = cell;
        }
        self.push(rest, &mut projection.next, 1, budget)
    }
}
