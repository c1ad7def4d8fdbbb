//! Poses of edges, and transforms over the tree.

use super::{DsrGraph, Edge, Node, RT, TRANSLATION};
use crate::error::Error;
use crate::view::End;
use property_graph::{NodeId, Point, Pose, Time, Transform, Value};
use rc_world_member::Member;

/// A homogeneous matrix, row by row.
pub type Matrix = [[f64; 4]; 4];

/// Poses of edges.
pub struct RtApi<'w> {
    world: &'w mut Member,
}

impl<'w> RtApi<'w> {
    pub(super) fn new(world: &'w mut Member) -> Self {
        Self { world }
    }

    /// As [`DsrGraph::insert_or_assign_edge_RT`].
    ///
    /// # Errors
    /// Those of [`DsrGraph::insert_node`].
    #[allow(non_snake_case, reason = "DSR's name")]
    pub fn insert_or_assign_edge_RT(
        &mut self,
        parent: &Node,
        child: impl End,
        trans: [f64; 3],
        rot: [f64; 3],
    ) -> Result<bool, Error> {
        let mut graph = DsrGraph::new(self.world);
        graph.insert_or_assign_edge_RT(parent, child, trans, rot)
    }

    /// The edge `RT` to a node.
    #[allow(non_snake_case, reason = "DSR's name")]
    pub fn get_edge_RT(&mut self, parent: &Node, child: impl End) -> Option<Edge> {
        DsrGraph::new(self.world).get_edge(parent.id?, child, RT)
    }

    /// The translation of an edge `RT`.
    pub fn get_translation(&mut self, parent: NodeId, child: NodeId) -> Option<[f64; 3]> {
        let edge = DsrGraph::new(self.world).get_edge(parent, child, RT)?;
        let numbers = edge.attrs.get(TRANSLATION).and_then(Value::numbers)?;
        numbers.as_ref().try_into().ok()
    }

    /// The homogeneous matrix from a node to the one above it.
    #[allow(non_snake_case, reason = "DSR's name")]
    pub fn get_RT_pose_from_parent(&mut self, node: &Node) -> Option<Matrix> {
        let graph = DsrGraph::new(self.world);
        let (parent, own) = (graph.get_parent_id(node)?, node.id?);
        graph
            .get_inner_eigen_api()
            .get_transformation_matrix(parent, own, None)
    }
}

/// Transforms over the tree, at a time of the network's clock; without one, of the present. `None` if the nodes are
/// not connected, or nothing is known of the time.
pub struct InnerApi<'w> {
    world: &'w Member,
}

impl<'w> InnerApi<'w> {
    pub(super) fn new(world: &'w Member) -> Self {
        Self { world }
    }

    fn between(&self, to: impl End, from: impl End, timestamp: Option<Time>) -> Option<Transform> {
        if let Some(time) = timestamp {
            return crate::world::between(self.world, to, from, time).ok();
        }
        let now = self.world.snapshot();
        let frame = |node: NodeId| now.frame(node).ok();
        let (to, from) = (to.node(&now).ok()?, from.node(&now).ok()?);
        now.between(frame(to)?, frame(from)?).ok()
    }

    /// The homogeneous matrix from a frame to another one.
    pub fn get_transformation_matrix(
        &self,
        to: impl End,
        from: impl End,
        timestamp: Option<Time>,
    ) -> Option<Matrix> {
        let rows = self.between(to, from, timestamp)?.matrix();
        Some(std::array::from_fn(|row| {
            std::array::from_fn(|column| rows[(row, column)])
        }))
    }

    /// The coordinates in `to` of a point with these coordinates in `from`.
    pub fn transform(
        &self,
        to: impl End,
        point: [f64; 3],
        from: impl End,
        timestamp: Option<Time>,
    ) -> Option<[f64; 3]> {
        let moved = self
            .between(to, from, timestamp)?
            .point(&Point::from(point));
        Some([moved.x, moved.y, moved.z])
    }

    /// The pose in `to` of what has this pose in `from`: the point, and the angles about x, y, z.
    pub fn transform_axis(
        &self,
        to: impl End,
        pose: [f64; 6],
        from: impl End,
        timestamp: Option<Time>,
    ) -> Option<[f64; 6]> {
        let [x, y, z, rx, ry, rz] = pose;
        let inner = Transform::of(&Pose::new(x, y, z, rx, ry, rz));
        let outer = self.between(to, from, timestamp)?;
        let Pose {
            translation: [x, y, z],
            rotation: [rx, ry, rz],
        } = outer.then_inner(&inner).pose();
        Some([x, y, z, rx, ry, rz])
    }

    /// Where the origin of a frame is in another one.
    pub fn get_translation_vector(
        &self,
        to: impl End,
        from: impl End,
        timestamp: Option<Time>,
    ) -> Option<[f64; 3]> {
        self.transform(to, [0.0; 3], from, timestamp)
    }

    /// The rotation from a frame to another one, row by row.
    pub fn get_rotation_matrix(
        &self,
        to: impl End,
        from: impl End,
        timestamp: Option<Time>,
    ) -> Option<[[f64; 3]; 3]> {
        let rotation = self.between(to, from, timestamp)?.rotation;
        Some(std::array::from_fn(|row| {
            std::array::from_fn(|column| rotation[(row, column)])
        }))
    }

    /// The angles about x, y, z of this rotation: Rx·Ry·Rz.
    pub fn get_euler_xyz_angles(
        &self,
        to: impl End,
        from: impl End,
        timestamp: Option<Time>,
    ) -> Option<[f64; 3]> {
        Some(self.between(to, from, timestamp)?.pose().rotation)
    }
}
