//! A graph takes over what another one holds.

use crate::edit::Edit;
use crate::element::{Element, Id, NodeId};
use crate::error::Error;
use crate::names::Symbol;
use crate::order::in_order;
use crate::snapshot::Snapshot;
use crate::stored::value;

/// Why a change is not made.
pub(crate) enum Refused {
    /// There is nothing to change.
    Equal,
    Wrong(Error),
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Self::Wrong(error)
    }
}

/// Makes the graph equal to `wanted`, by as few steps as it takes.
pub(crate) fn adopt(edit: &mut Edit, wanted: &Snapshot) -> Result<(), Refused> {
    let before = edit.snapshot().clone();
    let mut is_equal = true;
    // Removes the elements that `wanted` lacks or has with another kind. Edges are removed first,
    // so that they are not searched again with their nodes.
    for edge in before.edges() {
        let same = wanted
            .find_edge(edge.id())
            .and_then(|same| wanted.edge(same).ok());
        let stays = same.is_some_and(|same| {
            same.type_name() == edge.type_name()
                && end(wanted, same.from()) == end(&before, edge.from())
                && end(wanted, same.to()) == end(&before, edge.to())
        });
        // It may have been removed with an edge at its end.
        if !stays && edit.snapshot().edge(edge.edge_id()).is_ok() {
            edit.remove_edge(edge.edge_id())?;
            is_equal = false;
        }
    }
    for node in before.nodes() {
        let same = wanted
            .find_node(node.id())
            .and_then(|same| wanted.node(same).ok());
        if same.is_none_or(|same| same.type_name() != node.type_name()) {
            edit.remove_node(node.node_id())?;
            is_equal = false;
        }
    }
    for node in wanted.nodes() {
        let own = if let Some(own) = edit.snapshot().find_node(node.id()) {
            own
        } else {
            is_equal = false;
            edit.add_node_as(node.id(), node.type_name())?
        };
        is_equal &= attributes(edit, own.into(), wanted, node.node_id().into())?;
    }
    let edges: Vec<_> = wanted.edges().collect();
    let ends = edges.iter().map(|edge| {
        let ends = [edge.from(), edge.to()].map(|node| end(wanted, node));
        (Some(edge.id()), ends)
    });
    let ends: Vec<_> = ends.collect();
    // An edge may start or end at another one.
    let (order, _) = in_order(&ends, |id| edit.snapshot().find(id).is_some());
    for at in order {
        let edge = edges[at];
        let own = if let Some(own) = edit.snapshot().find_edge(edge.id()) {
            own
        } else {
            is_equal = false;
            let [from, to] = ends[at].1;
            let (from, to) = (edit.end(from)?, edit.end(to)?);
            edit.add_edge_as(edge.id(), edge.type_name(), from, to)?
        };
        is_equal &= attributes(edit, own.into(), wanted, edge.edge_id().into())?;
    }
    if is_equal {
        Err(Refused::Equal)
    } else {
        Ok(())
    }
}

/// The id of a node: that of the edge that it represents.
fn end(of: &Snapshot, node: NodeId) -> Id {
    of.node(node).map(|node| node.id()).unwrap_or_default()
}

/// Gives an element the attributes of another one. Returns whether they were equal.
fn attributes(
    edit: &mut Edit,
    own: Element,
    wanted: &Snapshot,
    other: Element,
) -> Result<bool, Error> {
    let present = edit.snapshot();
    let owned = present.attributes(own)?;
    let others = wanted.attributes(other)?;
    let mut is_equal = true;
    let mut gone = Vec::new();
    for (symbol, _) in owned.as_deref().unwrap_or_default() {
        let name = wanted.symbol(present.text(*symbol));
        if name.is_none_or(|name| value(others, name).is_none()) {
            gone.push(*symbol);
        }
    }
    let kind = present.kind(own)?;
    let mut set = Vec::new();
    for (symbol, stored) in others.as_deref().unwrap_or_default() {
        let name = wanted.text(*symbol);
        let own = present.symbol(name);
        let same = own.and_then(|own| present.types.group(kind, own));
        let is_said = |(other, _): &&(Symbol, usize)| {
            let there = wanted.symbol(present.text(*other));
            own != Some(*other) && there.is_some_and(|other| value(others, other).is_some())
        };
        if let Some((other, _)) = same.unwrap_or_default().iter().find(is_said) {
            return Err(Error::SaidTwice {
                kind: present.text(kind).to_owned(),
                attributes: [name, present.text(*other)].map(str::to_owned),
            });
        }
        let known = own.and_then(|own| value(owned, own));
        if known != Some(stored.value()) {
            set.push((name, stored.value().clone()));
        }
    }
    // Removals first: a removed attribute may be one value with one that is set.
    for symbol in gone {
        edit.unset(own, symbol)?;
        is_equal = false;
    }
    if !set.is_empty() {
        edit.set_all(own, set)?;
        is_equal = false;
    }
    Ok(is_equal)
}
