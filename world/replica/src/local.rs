//! Changes of this replica.

use crate::check::Check;
use crate::core::{Core, MOST_ELEMENTS};
use crate::error::Error;
use crate::protocol::between;
use crate::rights::type_of;
use crate::start::attributes;
use crate::streams::Sample;
use crate::token::Token;
use graph_merge::Replica;
use property_graph::{Change, Edit, Element, Graph, Id, MOST_STEPS, Snapshot, Time, Value};
use std::collections::BTreeMap;

/// The steps of a change, in the order in which the replica notes them.
#[derive(Default)]
struct Steps {
    /// New elements by the numbers in their ids: type and ends.
    made: BTreeMap<u64, (String, Option<(Id, Id)>)>,
    removed: Vec<Id>,
    set: Vec<(Id, String, Option<Value>)>,
}

impl Core {
    /// Makes a change, shows it, and sends it.
    pub(crate) fn change<T>(
        &mut self,
        graph: &Graph,
        time: Time,
        make: impl FnOnce(&mut Edit) -> Result<T, Error>,
    ) -> Result<(T, Token), Error> {
        // Changes of others since the last turn may have a later time.
        let time = between(time, graph.snapshot().time(), time);
        if self.is_stale {
            self.show_all(graph, time);
        }
        let before = graph.snapshot();
        let first = self.replica.next_number();
        let writer = self.replica.writer();
        let numbers = first..first.saturating_add(MOST_STEPS as u64);
        let rights = &self.rights;
        let (result, changes) = graph.change(time, |edit| {
            edit.count_ids_from(first);
            let result = make(edit)?;
            let changes = edit.since(&before);
            let after = edit.snapshot();
            if after.node_count() + after.edge_count() > MOST_ELEMENTS {
                return Err(Error::TooMany(MOST_ELEMENTS));
            }
            rights.check(&before, after, &changes, |id| {
                id.writer() == writer && numbers.contains(&id.count())
            })?;
            Ok((result, changes))
        })?;
        if !changes.is_empty() {
            let after = graph.snapshot();
            let steps = Self::steps(&before, &after, &changes)?;
            self.note(graph, time, steps)?;
        }
        let token = Token {
            writer,
            sequence: self.seen(writer),
        };
        Ok((result, token))
    }

    fn steps(before: &Snapshot, after: &Snapshot, changes: &[Change]) -> Result<Steps, Error> {
        let mut steps = Steps::default();
        let mut added: Vec<Element> = Vec::new();
        let mut set = Vec::new();
        for change in changes {
            match change {
                Change::NodeRemoved(_, id) | Change::EdgeRemoved(_, id) => steps.removed.push(*id),
                Change::NodeAdded(node) => {
                    let new = after.node(*node)?;
                    let made = (new.type_name().to_owned(), None);
                    steps.made.insert(new.id().count(), made);
                    added.push(Element::Node(*node));
                }
                Change::EdgeAdded(edge) => {
                    let new = after.edge(*edge)?;
                    let ends = (after.node(new.from())?.id(), after.node(new.to())?.id());
                    let made = (new.type_name().to_owned(), Some(ends));
                    steps.made.insert(new.id().count(), made);
                    added.push(Element::Edge(*edge));
                }
                Change::Attribute(element, symbol) => {
                    let name = after.text(*symbol);
                    let new = after.set_as(*element, *symbol);
                    // Another attribute may have had the value.
                    if new == before.set_as(*element, *symbol) {
                        continue;
                    }
                    let id = id_of(after, *element)?;
                    match new {
                        Some(new) => set.push((id, name.to_owned(), Some(new.clone()))),
                        None => steps.set.push((id, name.to_owned(), None)),
                    }
                }
            }
        }
        for element in added {
            let id = id_of(after, element)?;
            let all = attributes(after, element)?;
            let all = all.map(|(name, value)| (id, name.to_owned(), Some(value.clone())));
            steps.set.extend(all);
        }
        // After removals: a removed attribute may be one value with one that is set.
        steps.set.extend(set);
        Ok(steps)
    }

    /// Notes a change in the replica, and its streamed values.
    fn note(&mut self, graph: &Graph, time: Time, mut steps: Steps) -> Result<(), Error> {
        let kinds = steps.made.values().map(|(kind, _)| kind.as_str());
        let set = steps.set.iter();
        let set = set.map(|(id, name, value)| (*id, name.as_str(), value.as_ref()));
        if let Err(refused) = self.replica.check_own(kinds, set) {
            // The graph has shown something that the replica cannot take.
            self.show_all(graph, time);
            return Err(refused.into());
        }
        let now = graph.snapshot();
        let mut streamed = Vec::new();
        steps.set.retain(|(id, name, value)| {
            let (Some(value), Some(element)) = (value, now.find(*id)) else {
                return true;
            };
            // The first value is a change, so that a replica that joins later has one.
            let each = type_of(&now, element)
                .ok()
                .and_then(|kind| self.rights.stream(&self.schema, kind, name))
                .filter(|_| self.replica.get(*id, name).is_some());
            if let Some(each) = each {
                self.replica
                    .count_from(self.replica.count().saturating_add(1));
                let sample = Sample {
                    of: *id,
                    name: name.clone(),
                    count: self.replica.count(),
                    writer: self.replica.writer(),
                    value: value.clone(),
                };
                streamed.push((sample, each));
            }
            each.is_none()
        });
        // While a fault keeps the newest changes from being shown, an end may be missing. Then
        // nothing is noted.
        let ends = steps.made.values().filter_map(|(_, ends)| *ends);
        let mut ends = ends.flat_map(|(from, to)| [from, to]);
        if let Some(end) = ends.find(|end| self.replica.is_removed(*end)) {
            self.show_all(graph, time);
            return Err(graph_merge::Error::EndRemoved(end).into());
        }
        for (sample, each) in streamed {
            self.streams.put_own(sample, each);
        }
        let is_change =
            !(steps.made.is_empty() && steps.removed.is_empty() && steps.set.is_empty());
        if is_change {
            let change = self.replica.recorded(|replica| record(replica, steps));
            self.protocol.digests.clear();
            let change = match change {
                Ok(change) => change,
                Err(error) => {
                    // The graph has shown something that the replica cannot take.
                    self.show_all(graph, time);
                    return Err(error);
                }
            };
            if !self.is_whole || self.is_stale {
                self.show_all(graph, time);
            }
            self.protocol.send_change(time, change);
        }
        self.protocol.stream_time = time;
        Ok(())
    }

    /// Adds the contents of a graph as the start of the world: changes of the writer [`START`],
    /// which are equal in every replica.
    pub(crate) fn start_with(
        &mut self,
        graph: &Graph,
        time: Time,
        start: &Snapshot,
    ) -> Result<(), Error> {
        let mut replica = Replica::new(START, []);
        let change = replica.recorded(|replica| crate::start::record(replica, start))?;
        let checked = Check::of(self).records(&change.records);
        checked.map_err(Error::Start)?;
        self.replica.merge_change(&change)?;
        let touched = change.records.iter().map(graph_merge::Record::of).collect();
        // It is not a replica for which removals wait.
        self.replica.forget(START);
        self.protocol.digests.clear();
        self.show(graph, time, &touched);
        if self.is_stale {
            self.show_all(graph, time);
        }
        match &self.fault {
            Some(fault) => Err(Error::Start(fault.clone())),
            None => Ok(()),
        }
    }
}

/// The writer of the initial contents of a world.
pub(crate) const START: u64 = 1;

fn record(replica: &mut Replica, steps: Steps) -> Result<(), Error> {
    for (number, (kind, ends)) in steps.made {
        replica.skip_to(number);
        match ends {
            None => replica.add_node(&kind)?,
            Some((from, to)) => replica.add_edge(&kind, from, to)?,
        };
    }
    for id in steps.removed {
        replica.remove(id)?;
    }
    for (id, name, value) in steps.set {
        replica.set(id, &name, value)?;
    }
    Ok(())
}

/// The id of an element.
pub(crate) fn id_of(of: &Snapshot, element: Element) -> Result<Id, property_graph::Error> {
    match element {
        Element::Node(node) => Ok(of.node(node)?.id()),
        Element::Edge(edge) => Ok(of.edge(edge)?.id()),
    }
}
