//! Chains of edges with poses, and the loops that they close.

use crate::element::{EdgeId, Half, NodeId};
use crate::error::Error;
use crate::snapshot::Snapshot;
use crate::tree::pose;
use innermodel::{Pose, Transform};
use rc_diagnostics::foreign;
use std::collections::{HashMap, HashSet, VecDeque};

/// One edge of a [`Chain`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The edge.
    pub edge: EdgeId,
    /// The node that is nearer to the beginning of the chain.
    pub to: NodeId,
    /// The node that is nearer to its end.
    pub from: NodeId,
    /// The pose that the edge has.
    pub pose: Pose,
    /// Whether the pose is that of `to` in `from`, so that its inverse counts.
    pub is_inverse: bool,
}

impl Link {
    /// Takes coordinates in `from` to those in `to`.
    pub fn transform(&self) -> Transform {
        let transform = Transform::of(&self.pose);
        if self.is_inverse {
            transform.inverse()
        } else {
            transform
        }
    }
}

/// Edges with poses that lead from one node to another one, without a node twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chain {
    /// The edges, in their order.
    pub links: Vec<Link>,
}

/// The difference between two transforms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disagreement {
    /// Between the origins, in the unit of the translations.
    pub distance: f64,
    /// Of the rotation from one to the other, in radians.
    pub angle: f64,
}

impl Disagreement {
    /// Compares two transforms between the same nodes.
    pub fn of(one: &Transform, other: &Transform) -> Self {
        let between = one.rotation.transpose() * other.rotation;
        let turn = [(2, 1), (0, 2), (1, 0)].map(|(a, b)| between[(a, b)] - between[(b, a)]);
        let sine = turn.iter().map(|part| part * part).sum::<f64>().sqrt();
        Self {
            distance: (one.translation - other.translation).norm(),
            // For small angles, the sine is exact, and the cosine is not.
            angle: sine.atan2(between.trace() - 1.0),
        }
    }
}

impl Chain {
    /// Takes coordinates in the last node to those in the first one.
    pub fn transform(&self) -> Transform {
        let links = self.links.iter();
        links.fold(Transform::identity(), |all, link| {
            all.then_inner(&link.transform())
        })
    }

    /// Says in words which transforms follow each other, the first one nearest to the first node.
    pub fn operations(&self, graph: &Snapshot) -> Vec<String> {
        let name = |node: NodeId| match graph.node(node) {
            Ok(node) if !node.name().is_empty() => foreign::clean(node.name()),
            Ok(node) => format!("{}:{}", node.id().writer(), node.id().count()),
            Err(_) => "a removed node".to_owned(),
        };
        let operations = self.links.iter().map(|link| {
            let relation = graph.edge(link.edge).map(|edge| edge.type_name());
            let relation = foreign::clean(relation.unwrap_or_default());
            let (child, parent) = if link.is_inverse {
                (link.to, link.from)
            } else {
                (link.from, link.to)
            };
            let inverse = if link.is_inverse { "inverse of " } else { "" };
            let numbers = |numbers: [f64; 3]| numbers.map(|number| number.to_string()).join(", ");
            format!(
                "{inverse}{relation} of {} in {}: translation ({}), rotation ({})",
                name(child),
                name(parent),
                numbers(link.pose.translation),
                numbers(link.pose.rotation)
            )
        });
        operations.collect()
    }
}

/// An edge with a pose whose ends are also connected without it.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// The edge.
    pub edge: EdgeId,
    /// The shortest chain from its parent to its child that does without it.
    pub chain: Chain,
    /// How far the edge and the chain are apart.
    pub disagreement: Disagreement,
}

impl Snapshot {
    /// The shortest chain of edges with poses between two nodes: of trees, and of relations with
    /// poses that form none. Of several, it is the one whose edges are older at the first nodes. The
    /// time is in proportion to the edges that it walks over.
    ///
    /// # Errors
    /// No edges with poses connect the nodes.
    pub fn chain(&self, to: NodeId, from: NodeId) -> Result<Chain, Error> {
        self.place(to)?;
        self.place(from)?;
        let way = self.ways(to, Some(from), None);
        chain_from(&way, to, from).ok_or(Error::NotConnected)
    }

    /// The other chains between two nodes: for each edge that the shortest one does not have, the
    /// shortest through it, each once. Without loops there are none.
    ///
    /// # Errors
    /// No edges with poses connect the nodes.
    pub fn other_chains(
        &self,
        to: NodeId,
        from: NodeId,
    ) -> Result<impl Iterator<Item = (Chain, Disagreement)>, Error> {
        let first = self.chain(to, from)?;
        let transform = first.transform();
        let before = self.ways(to, None, None);
        let behind = self.ways(from, None, None);
        let mut seen = HashSet::from([edges(&first)]);
        let mut places: Vec<NodeId> = before.keys().copied().collect();
        places.sort_unstable();
        let candidates = places.into_iter().flat_map(move |here| {
            let links: Vec<Link> = self.links(here).collect();
            links.into_iter()
        });
        let chains = candidates.filter_map(move |link| {
            let mut links = chain_from(&before, to, link.to)?.links;
            links.push(link);
            // The ways from the end, turned round.
            let rest = chain_from(&behind, from, link.from)?.links;
            links.extend(rest.into_iter().rev().map(|link| Link {
                to: link.from,
                from: link.to,
                is_inverse: !link.is_inverse,
                ..link
            }));
            let mut nodes: HashSet<NodeId> = HashSet::from([to]);
            let chain = Chain { links };
            let is_simple = chain.links.iter().all(|link| nodes.insert(link.from));
            (is_simple && seen.insert(edges(&chain))).then_some(chain)
        });
        Ok(chains.map(move |chain| {
            let disagreement = Disagreement::of(&transform, &chain.transform());
            (chain, disagreement)
        }))
    }

    /// The loops of edges with poses: one for each edge of a relation that forms no tree, and whose
    /// ends are connected without it.
    pub fn loops(&self) -> impl Iterator<Item = Loop> {
        self.edges().filter_map(|edge| {
            let relation = self.types.relation(edge.relation())?;
            let placed = relation.placed.filter(|_| relation.tree.is_none())?;
            let (id, ends) = (edge.edge_id(), [edge.from(), edge.to()]);
            let (parent, child) = (ends[1 - placed.child], ends[placed.child]);
            let own = self.links(parent).find(|link| link.edge == id)?;
            let ways = self.ways(parent, Some(child), Some(id));
            let chain = chain_from(&ways, parent, child)?;
            Some(Loop {
                edge: id,
                disagreement: Disagreement::of(&chain.transform(), &own.transform()),
                chain,
            })
        })
    }

    /// The edges with poses at a node, to other nodes.
    fn links(&self, node: NodeId) -> impl Iterator<Item = Link> {
        let out = self.outgoing(node).iter().map(|half| (half, 1));
        let into = self.incoming(node).iter().map(|half| (half, 0));
        out.chain(into)
            .filter_map(move |(half, other): (&Half, usize)| {
                let placed = self.types.relation(half.relation)?.placed?;
                let edge = self.edge_at(half.edge)?;
                (half.node != node).then_some(())?;
                Some(Link {
                    edge,
                    to: node,
                    from: half.node,
                    pose: pose(self, half, placed.pose).ok()?,
                    is_inverse: placed.child != other,
                })
            })
    }

    /// For each node that can be reached, the last link of the shortest chain to it.
    fn ways(
        &self,
        start: NodeId,
        end: Option<NodeId>,
        without: Option<EdgeId>,
    ) -> HashMap<NodeId, Option<Link>> {
        let mut ways = HashMap::from([(start, None)]);
        let mut next = VecDeque::from([start]);
        while let Some(here) = next.pop_front() {
            if end == Some(here) {
                break;
            }
            for link in self.links(here) {
                if without != Some(link.edge) && !ways.contains_key(&link.from) {
                    ways.insert(link.from, Some(link));
                    next.push_back(link.from);
                }
            }
        }
        ways
    }
}

fn chain_from(ways: &HashMap<NodeId, Option<Link>>, start: NodeId, end: NodeId) -> Option<Chain> {
    let mut links = Vec::new();
    let mut here = end;
    while here != start {
        let link = (*ways.get(&here)?)?;
        links.push(link);
        here = link.to;
    }
    links.reverse();
    Some(Chain { links })
}

fn edges(chain: &Chain) -> Vec<EdgeId> {
    chain.links.iter().map(|link| link.edge).collect()
}
