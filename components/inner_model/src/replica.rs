//! Instances that follow each other: which of two changes of a node wins, and what is published.
//!
//! Each change has a stamp: a count that is greater than all that the instance has seen, and the
//! name of the instance. The greatest stamp of a node wins, in whatever order samples arrive, and a
//! sample that arrives twice changes nothing. So instances get equal trees, unless changes at the
//! same moment exclude each other: one moves `a` below `b`, another one `b` below `a`. Then each
//! refuses the change of the other one, and reports it.

use crate::wire::node_out;
use inner_model_generated::{ChangedNode, Changes, Node, RemovedNode, Stamp};
use inner_model_manager::Refusal;
use innermodel::{Change, Edit, Folders, InnerModel, Kind, NewNode, Snapshot, Time};
use rc_diagnostics::foreign::clean;
use std::collections::{BTreeSet, HashMap, VecDeque};
use std::path::Path;

/// How many removed nodes are remembered. An older one can come back from an instance that has not
/// heard of its removal.
const REMOVED: usize = 4096;
/// The greatest count of a stamp that is taken. It leaves room for more changes.
const GREATEST: i64 = 1 << 62;
/// Every so many samples has the whole tree.
const WHOLE: i64 = 10;

/// The order of changes.
fn rank(stamp: &Stamp) -> (i64, &str) {
    (stamp.count, &stamp.writer)
}

/// State of an instance: the changes of its tree that it knows.
#[derive(Debug)]
pub(crate) struct Replica {
    /// The instance.
    writer: String,
    /// The greatest count of all changes.
    count: i64,
    /// The last change of each node that changed since it was read from the file.
    changed: HashMap<String, Stamp>,
    /// Nodes that are no more, and the order in which they were removed.
    removed: HashMap<String, Stamp>,
    order: VecDeque<(String, Stamp)>,
    /// The last change of each node that was reported because it could not be applied.
    reported: HashMap<String, Stamp>,
    /// Ids of which the last sample does not tell.
    unsent: BTreeSet<String>,
    /// How many samples were made, and how many since the last whole one.
    number: i64,
    since_whole: i64,
}

impl Replica {
    pub(crate) fn new(writer: &str) -> Self {
        Self {
            writer: writer.to_owned(),
            count: 0,
            changed: HashMap::new(),
            removed: HashMap::new(),
            order: VecDeque::new(),
            reported: HashMap::new(),
            unsent: BTreeSet::new(),
            number: 0,
            since_whole: WHOLE,
        }
    }

    /// The stamp of a node that is there.
    fn stamp(&self, id: &str) -> Stamp {
        let known = self.changed.get(id).cloned();
        known.unwrap_or_else(|| Stamp {
            count: 0,
            writer: self.writer.clone(),
        })
    }

    fn set_changed(&mut self, id: &str, stamp: Stamp) {
        self.removed.remove(id);
        self.changed.insert(id.to_owned(), stamp);
        self.unsent.insert(id.to_owned());
    }

    fn set_removed(&mut self, id: &str, stamp: Stamp) {
        self.changed.remove(id);
        self.order.push_back((id.to_owned(), stamp.clone()));
        self.removed.insert(id.to_owned(), stamp);
        while self.order.len() > REMOVED {
            // A node that came back, or was removed again, has another stamp, or none.
            if let Some((oldest, stamp)) = self.order.pop_front()
                && self.removed.get(&oldest) == Some(&stamp)
            {
                self.removed.remove(&oldest);
            }
        }
        self.unsent.insert(id.to_owned());
    }

    /// Stamps the changes of a request of this instance.
    pub(crate) fn note(&mut self, before: &Snapshot, now: &Snapshot) {
        let changes = now.since(before);
        if changes.is_empty() {
            return;
        }
        self.count = self.count.saturating_add(1);
        let stamp = Stamp {
            count: self.count,
            writer: self.writer.clone(),
        };
        for change in changes {
            match change {
                Change::Removed { id, .. } => self.set_removed(&id, stamp.clone()),
                Change::Added(node)
                | Change::Parent(node)
                | Change::Moved(node)
                | Change::Data(node) => {
                    if let Ok(node) = now.node(node) {
                        self.set_changed(node.id(), stamp.clone());
                    }
                }
            }
        }
    }

    /// Whether there is something to publish. The first sample has the tree of the file.
    pub(crate) fn is_unsent(&self) -> bool {
        self.number == 0 || !self.unsent.is_empty()
    }

    /// Whether the last sample has not the whole tree.
    pub(crate) fn lacks_whole(&self) -> bool {
        self.since_whole > 0
    }

    /// The next sample. With `whole` it has everything.
    pub(crate) fn sample(&self, now: &Snapshot, whole: bool) -> Changes {
        let whole = whole || self.since_whole + 1 >= WHOLE;
        let changed = |node: innermodel::NodeRef<'_>| ChangedNode {
            node: node_out(&node),
            stamp: self.stamp(node.id()),
        };
        let (mut nodes, mut removed) = (Vec::new(), Vec::new());
        if whole {
            nodes.extend(now.nodes().skip(1).map(changed));
            removed.extend(self.removed.iter());
        } else {
            let there = self.unsent.iter().filter_map(|id| now.node(id).ok());
            let mut there: Vec<_> = there.collect();
            there.sort_by_key(innermodel::NodeRef::depth);
            nodes.extend(there.into_iter().map(changed));
            removed.extend(
                self.unsent
                    .iter()
                    .filter_map(|id| self.removed.get_key_value(id)),
            );
        }
        let removed = removed.into_iter().map(|(id, stamp)| RemovedNode {
            id: id.clone(),
            stamp: stamp.clone(),
        });
        Changes {
            writer: self.writer.clone(),
            number: self.number + 1,
            whole,
            nodes,
            removed: removed.collect(),
        }
    }

    /// Notes that a sample was sent.
    pub(crate) fn sent(&mut self, sample: &Changes) {
        self.number = sample.number;
        self.since_whole = if sample.whole {
            0
        } else {
            self.since_whole + 1
        };
        self.unsent.clear();
    }

    /// Applies a sample of another instance. Returns what could not be applied.
    pub(crate) fn apply(
        &mut self,
        model: &InnerModel,
        time: Time,
        sample: &Changes,
        place: &Path,
        folders: &Folders,
    ) -> Vec<String> {
        let mut problems = Vec::new();
        let tree = model.snapshot();
        let is_news = |replica: &Self, id: &str, stamp: &Stamp| {
            let is_there = tree.node(id).is_ok();
            let own = is_there.then(|| replica.stamp(id));
            let own = own.or_else(|| replica.removed.get(id).cloned());
            own.is_none_or(|own| rank(&own) < rank(stamp))
        };
        let nodes = sample.nodes.iter();
        let nodes = nodes.filter(|changed| is_news(self, &changed.node.id, &changed.stamp));
        let mut nodes: Vec<&ChangedNode> = nodes.collect();
        let gone = sample.removed.iter();
        let gone = gone.filter(|gone| is_news(self, &gone.id, &gone.stamp));
        let mut gone: Vec<&RemovedNode> = gone.collect();
        let mut is_allowed = |id: &str, stamp: &Stamp| {
            let is_allowed = (0..=GREATEST).contains(&stamp.count);
            if !is_allowed {
                let text = format!("the count {} of its stamp is not allowed", stamp.count);
                problems.push((id.to_owned(), stamp.clone(), text));
            }
            is_allowed
        };
        nodes.retain(|changed| is_allowed(&changed.node.id, &changed.stamp));
        gone.retain(|gone| is_allowed(&gone.id, &gone.stamp));
        if nodes.is_empty() && gone.is_empty() {
            return self.report(problems);
        }
        let applied = model.change(time, |edit| {
            let mut applied = Vec::new();
            for changed in nodes {
                match edit.attempt(|edit| put(edit, &changed.node, place, folders)) {
                    Ok(()) => applied.push((&changed.node.id, &changed.stamp, true)),
                    Err(refusal) => {
                        let (id, stamp) = (changed.node.id.clone(), changed.stamp.clone());
                        problems.push((id, stamp, refusal.text()));
                    }
                }
            }
            for gone in gone {
                if edit.snapshot().node(&gone.id).is_ok()
                    && let Err(error) = edit.remove(&gone.id)
                {
                    problems.push((gone.id.clone(), gone.stamp.clone(), error.to_string()));
                    continue;
                }
                applied.push((&gone.id, &gone.stamp, false));
            }
            Ok::<_, std::convert::Infallible>(applied)
        });
        let Ok(applied) = applied;
        for (id, stamp, is_there) in applied {
            self.count = self.count.max(stamp.count);
            if is_there {
                self.set_changed(id, stamp.clone());
            } else {
                self.set_removed(id, stamp.clone());
            }
        }
        self.report(problems)
    }

    /// The texts of the problems that were not reported before: whole samples repeat a change.
    fn report(&mut self, problems: Vec<(String, Stamp, String)>) -> Vec<String> {
        let mut texts = Vec::new();
        for (id, stamp, text) in problems {
            if self.reported.len() >= REMOVED {
                self.reported.clear();
            }
            if self.reported.get(&id) != Some(&stamp) {
                texts.push(format!("`{}`: {}", clean(&id), clean(text.trim_end())));
                self.reported.insert(id, stamp);
            }
        }
        texts
    }
}

/// Adds a node, or makes the one that is there equal to it.
fn put(edit: &mut Edit, node: &Node, place: &Path, folders: &Folders) -> Result<(), Refusal> {
    let text = format!("<innerModel>{}</innerModel>", node.element);
    let read = innermodel::read_text(&text, place, folders);
    let (mut document, _) = read.map_err(|error| Refusal::Text(error.to_string()))?;
    let described = match (document.nodes.pop(), document.nodes.is_empty()) {
        (Some(described), true) if described.id == node.id => described,
        _ => {
            let what = format!("expected one element with the id `{}`", node.id);
            return Err(Refusal::Text(what));
        }
    };
    let is_there = edit.snapshot().node(&node.id).is_ok();
    if is_there {
        let parent = edit.snapshot().node(&node.id)?.parent();
        if parent.is_none_or(|parent| parent.id() != node.parent) {
            edit.move_to(&node.id, &node.parent)?;
        }
        replace(edit, &described)?;
    } else {
        edit.add(
            &node.parent,
            NewNode {
                id: described.id,
                kind: described.kind,
                pose: described.pose,
                allowed: described.allowed,
            },
        )?;
    }
    let here = edit.snapshot().node(&node.id)?;
    let moves = matches!(here.kind(), Kind::Joint(_) | Kind::Prismatic(_));
    let old = here.attributes().map(|(name, ..)| name.to_owned());
    for name in old.collect::<Vec<_>>() {
        edit.remove_attribute(&node.id, &name)?;
    }
    for attribute in &node.attributes {
        edit.add_attribute(
            &node.id,
            &attribute.name,
            &attribute.type_,
            &attribute.value,
        )?;
    }
    if moves {
        edit.set_joint(&node.id, node.position)?;
    }
    Ok(())
}

/// Gives a node the kind, the pose and the allowed contacts of an element.
pub(crate) fn replace(
    edit: &mut Edit,
    described: &innermodel::language::Node,
) -> Result<(), innermodel::Error> {
    let id = &described.id;
    edit.set_kind(id, described.kind.clone())?;
    if described.kind.has_pose() {
        edit.set_pose(id, described.pose)?;
    }
    edit.set_allowed(id, described.allowed.clone())
}
