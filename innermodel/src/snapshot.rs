//! One version of the tree. It never changes, so its readers need no lock.

use crate::cache::Cache;
use crate::error::Error;
use crate::link::{Data, Link, NONE, NodeId, TOP};
use crate::transform::Transform;
use crate::{Point, Time, Vector};
use graph_pages::{Ids, Pages};
use innermodel_language::model::{self, Kind, Pose};
use nalgebra::Matrix4;
use std::collections::BTreeMap;
use std::sync::Arc;

/// One version of the tree.
///
/// No transform allocates memory or takes a lock. Results are kept, so the second transform of a
/// node in one version costs as much as one product of matrices.
#[derive(Clone, Debug)]
pub struct Snapshot {
    pub(crate) version: u64,
    pub(crate) time: Time,
    pub(crate) links: Pages<Link>,
    pub(crate) data: Pages<Option<Arc<Data>>>,
    pub(crate) ids: Ids<Arc<str>>,
    /// The first free place.
    pub(crate) free: u32,
    pub(crate) count: usize,
    pub(crate) cache: Arc<Cache>,
    /// Whether an edit still changes it. Then no transform is kept.
    pub(crate) open: bool,
}

mod sealed {
    pub trait Key: Copy {
        fn place(&self, snapshot: &super::Snapshot) -> Result<u32, super::Error>;
    }
}

/// Names a node: an id as text, or a [`NodeId`], which is found without a look-up.
pub trait Key: sealed::Key {}

impl<T: sealed::Key> Key for T {}

impl sealed::Key for &str {
    #[inline]
    fn place(&self, snapshot: &Snapshot) -> Result<u32, Error> {
        let place = snapshot.ids.get(*self);
        place.ok_or_else(|| Error::unknown(self, snapshot.nodes().map(|node| node.id())))
    }
}

impl sealed::Key for &String {
    #[inline]
    fn place(&self, snapshot: &Snapshot) -> Result<u32, Error> {
        self.as_str().place(snapshot)
    }
}

impl sealed::Key for NodeId {
    #[inline]
    fn place(&self, snapshot: &Snapshot) -> Result<u32, Error> {
        let link = snapshot.links.get(self.index as usize);
        let here = link.is_some_and(|link| link.generation == self.generation);
        here.then_some(self.index).ok_or(Error::Removed)
    }
}

impl Snapshot {
    pub(crate) fn empty() -> Self {
        let kind = Kind::Transform(model::Transform::default());
        let mut links = Pages::new();
        links.push(Link::new(&kind, Pose::default(), 0.0));
        let mut data = Pages::new();
        let id: Arc<str> = model::ROOT.into();
        let mut ids = Ids::new();
        ids.insert(Arc::clone(&id), TOP);
        data.push(Some(Arc::new(Data {
            id,
            kind: Arc::new(kind),
            allowed: Arc::new([]),
            attributes: BTreeMap::new(),
        })));
        Self {
            version: 1,
            time: Time::ZERO,
            links,
            data,
            ids,
            free: NONE,
            count: 1,
            cache: Arc::new(Cache::new()),
            open: false,
        }
    }

    /// The number of the version. A later version of the same model has a greater one.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// When the version was made.
    pub fn time(&self) -> Time {
        self.time
    }

    /// How many nodes there are, with the root.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether the root is the only node.
    pub fn is_empty(&self) -> bool {
        self.count == 1
    }

    pub(crate) fn place(&self, key: impl Key) -> Result<u32, Error> {
        sealed::Key::place(&key, self)
    }

    #[inline]
    pub(crate) fn link(&self, place: u32) -> Option<&Link> {
        self.links.get(place as usize)
    }

    #[inline]
    pub(crate) fn data(&self, place: u32) -> Option<&Arc<Data>> {
        self.data.get(place as usize)?.as_ref()
    }

    /// A node.
    pub fn node(&self, key: impl Key) -> Result<NodeRef<'_>, Error> {
        let place = self.place(key)?;
        self.at(place).ok_or(Error::Removed)
    }

    pub(crate) fn at(&self, place: u32) -> Option<NodeRef<'_>> {
        Some(NodeRef {
            snapshot: self,
            place,
            link: self.link(place)?,
            data: self.data(place)?,
        })
    }

    /// The root.
    ///
    /// # Panics
    /// Never: each version has a root.
    pub fn root(&self) -> NodeRef<'_> {
        #[expect(clippy::expect_used, reason = "no change removes the root")]
        self.at(TOP).expect("each version has a root")
    }

    /// All nodes, a parent before its children, siblings in their order.
    pub fn nodes(&self) -> impl Iterator<Item = NodeRef<'_>> {
        self.root().subtree()
    }

    #[inline]
    fn known(&self, place: u32) -> Option<Transform> {
        if self.open {
            return None;
        }
        self.cache.get(self.version, place)
    }

    /// Takes coordinates in a node to those in the root.
    #[inline]
    pub(crate) fn to_root(&self, place: u32) -> Transform {
        if let Some(known) = self.known(place) {
            return known;
        }
        let Some(link) = self.link(place) else {
            return Transform::identity();
        };
        let mut transform = link.local;
        let mut above = link.parent;
        while above != TOP && above != NONE {
            if let Some(known) = self.known(above) {
                transform = known.then_inner(&transform);
                break;
            }
            let Some(link) = self.link(above) else {
                break;
            };
            transform = link.local.then_inner(&transform);
            above = link.parent;
        }
        if !self.open {
            self.cache.put(self.version, place, &transform);
        }
        transform
    }

    /// The transform that takes coordinates in `from` to those in `to`.
    #[inline]
    pub fn between(&self, to: impl Key, from: impl Key) -> Result<Transform, Error> {
        let (to, from) = (self.place(to)?, self.place(from)?);
        Ok(self.between_places(to, from))
    }

    #[inline]
    pub(crate) fn between_places(&self, to: u32, from: u32) -> Transform {
        if to == from {
            Transform::identity()
        } else if to == TOP {
            self.to_root(from)
        } else if from == TOP {
            self.to_root(to).inverse()
        } else {
            self.to_root(to).inverse().then_inner(&self.to_root(from))
        }
    }

    /// The coordinates in `to` of a point with these coordinates in `from`.
    #[inline]
    pub fn transform(&self, to: impl Key, point: Point, from: impl Key) -> Result<Point, Error> {
        Ok(self.between(to, from)?.point(&point))
    }

    /// The coordinates in `to` of a direction with these coordinates in `from`.
    #[inline]
    pub fn transform_vector(
        &self,
        to: impl Key,
        vector: Vector,
        from: impl Key,
    ) -> Result<Vector, Error> {
        Ok(self.between(to, from)?.vector(&vector))
    }

    /// The pose in `to` of something with this pose in `from`.
    pub fn transform_pose(&self, to: impl Key, pose: &Pose, from: impl Key) -> Result<Pose, Error> {
        Ok((self.between(to, from)? * Transform::of(pose)).pose())
    }

    /// The pose of `from` in `to`.
    pub fn pose(&self, to: impl Key, from: impl Key) -> Result<Pose, Error> {
        Ok(self.between(to, from)?.pose())
    }

    /// The homogeneous matrix that takes coordinates in `from` to those in `to`.
    pub fn matrix(&self, to: impl Key, from: impl Key) -> Result<Matrix4<f64>, Error> {
        Ok(self.between(to, from)?.matrix())
    }

    /// Whether `below` is `above`, or is below it.
    pub(crate) fn is_below(&self, below: u32, above: u32) -> bool {
        let mut place = below;
        while place != above {
            match self.link(place) {
                Some(link) if link.parent != NONE => place = link.parent,
                _ => return false,
            }
        }
        true
    }
}

/// A node of a version.
#[derive(Clone, Copy, Debug)]
pub struct NodeRef<'s> {
    snapshot: &'s Snapshot,
    place: u32,
    link: &'s Link,
    data: &'s Data,
}

impl sealed::Key for NodeRef<'_> {
    fn place(&self, snapshot: &Snapshot) -> Result<u32, Error> {
        self.node_id().place(snapshot)
    }
}

impl<'s> NodeRef<'s> {
    /// Names the node in all versions.
    pub fn node_id(&self) -> NodeId {
        NodeId {
            index: self.place,
            generation: self.link.generation,
        }
    }

    /// The id.
    pub fn id(&self) -> &'s str {
        &self.data.id
    }

    /// Kind of the node.
    pub fn kind(&self) -> &'s Kind {
        &self.data.kind
    }

    /// The kind, to keep. Each change of the node makes another one.
    pub fn shared_kind(&self) -> &'s Arc<Kind> {
        &self.data.kind
    }

    /// Where the node is in its parent, before a joint moves it.
    pub fn pose(&self) -> Pose {
        self.link.pose
    }

    /// Takes coordinates in the node to those in its parent.
    pub fn local(&self) -> Transform {
        self.link.local
    }

    /// Takes coordinates in the node to those in the root.
    pub fn to_root(&self) -> Transform {
        self.snapshot.to_root(self.place)
    }

    /// The angle of a joint in radians, or the position of a prismatic one in millimetres.
    pub fn position(&self) -> Option<f64> {
        let moves = matches!(*self.data.kind, Kind::Joint(_) | Kind::Prismatic(_));
        moves.then_some(self.link.position)
    }

    /// Ids of the nodes that this one, with all below it, may touch.
    pub fn allowed(&self) -> &'s [String] {
        &self.data.allowed
    }

    /// Attributes that were added at run time: name, type, value.
    pub fn attributes(&self) -> impl Iterator<Item = (&'s str, &'s str, &'s str)> {
        let all = self.data.attributes.iter();
        all.map(|(name, (form, value))| (name.as_str(), form.as_str(), value.as_str()))
    }

    /// Type and value of an attribute that was added at run time.
    ///
    /// # Errors
    /// The node has no such attribute.
    pub fn attribute(&self, name: &str) -> Result<(&'s str, &'s str), Error> {
        let found = self.data.attributes.get(name);
        let (form, value) = found.ok_or_else(|| {
            Error::unknown_attribute(self.id(), name, self.data.attributes.keys())
        })?;
        Ok((form, value))
    }

    /// The node above. The root has none.
    pub fn parent(&self) -> Option<Self> {
        self.snapshot.at(self.link.parent)
    }

    /// How many nodes are above.
    pub fn depth(&self) -> usize {
        std::iter::successors(self.parent(), Self::parent).count()
    }

    /// The nodes directly below, in their order.
    pub fn children(&self) -> impl Iterator<Item = Self> + use<'s> {
        let snapshot = self.snapshot;
        std::iter::successors(snapshot.at(self.link.first), move |child| {
            snapshot.at(child.link.next)
        })
    }

    /// The node and all below it, a parent before its children.
    pub fn subtree(&self) -> impl Iterator<Item = Self> + use<'s> {
        let top = *self;
        std::iter::successors(Some(top), move |node| {
            if let Some(child) = node.snapshot.at(node.link.first) {
                return Some(child);
            }
            let mut node = *node;
            loop {
                if node.place == top.place {
                    return None;
                }
                if let Some(next) = node.snapshot.at(node.link.next) {
                    return Some(next);
                }
                node = node.parent()?;
            }
        })
    }
}
