//! The bodies of one version of a tree.

use crate::mesh_rays::RayTree;
use innermodel::kinds::{Mesh, Shape};
use innermodel::shapes::{Body, body};
use innermodel::{Change, Kind, NodeId, NodeRef, Snapshot, Transform};
use innermodel_mesh::MeshError;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::{Mat3, Pose, Rotation, Vector};
use parry3d_f64::partitioning::Bvh;
use parry3d_f64::shape::{SharedShape, TriMesh};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// Collisions are computed in metres, for which the tolerances of the library are made.
pub(crate) const METRE: f64 = 1000.0;

/// The greatest coordinate of a body in metres. The library's algorithms fail with numbers whose
/// squares are infinite, or whose differences have no digits left.
const FARTHEST: f64 = 1e9;

/// The scale of a mesh, bit by bit.
type Scale = [u64; 3];

/// A mesh that was read: its shape, and its triangles for rays.
type Known = (SharedShape, Arc<RayTree>);

/// A body that meets nothing.
#[derive(Debug)]
pub struct Problem {
    /// The id of the node.
    pub id: String,
    /// Why.
    pub error: BodyError,
}

/// Error of a body that meets nothing.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BodyError {
    /// Its mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// It is too large, or too far from the root. It meets others again when it comes nearer.
    #[error("it reaches further than 1,000,000 km from the root")]
    TooFar,
}

/// A body, with its shape in metres.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) node: NodeId,
    pub(crate) shape: SharedShape,
    pub(crate) pose: Pose,
    /// Whether it is near enough to meet others.
    is_near: bool,
    /// The triangles of a mesh for rays.
    rays: Option<Arc<RayTree>>,
    /// From the frame of the body to that of the node.
    inner: Transform,
    kind: Arc<Kind>,
}

impl Solid {
    /// A mesh with its triangles for rays.
    pub(crate) fn triangles(&self) -> Option<(&RayTree, &TriMesh)> {
        Some((self.rays.as_ref()?, self.shape.as_trimesh()?))
    }

    /// Kind of the node.
    pub(crate) fn kind(&self) -> &Kind {
        &self.kind
    }

    /// The box around the body at a pose.
    pub(crate) fn bounds(&self, at: &Pose) -> Aabb {
        let Some(cylinder) = self.shape.as_cylinder() else {
            return self.shape.compute_aabb(at);
        };
        // The general algorithm for convex bodies takes ten times as long. Along an axis, a
        // cylinder whose own axis has the coordinate n there reaches h·|n| + r·√(1 − n²).
        let axis = at.rotation * Vector::Y;
        let across = (Vector::ONE - axis * axis).max(Vector::ZERO);
        let across = Vector::new(across.x.sqrt(), across.y.sqrt(), across.z.sqrt());
        let half = axis.abs() * cylinder.half_height + across * cylinder.radius;
        Aabb::new(at.translation - half, at.translation + half)
    }
}

/// The bodies of one version of a tree.
#[derive(Debug)]
pub struct Space {
    pub(crate) tree: Snapshot,
    /// With gaps where bodies were removed.
    pub(crate) solids: Vec<Option<Solid>>,
    free: Vec<u32>,
    pub(crate) places: HashMap<NodeId, u32>,
    pub(crate) bvh: Bvh,
    meshes: HashMap<(PathBuf, Scale), Known>,
    problems: Vec<Problem>,
}

/// Bodies of their own, which share shapes with those of the first one. [`Space::problems`] stay
/// there.
impl Clone for Space {
    fn clone(&self) -> Self {
        Self {
            tree: self.tree.clone(),
            solids: self.solids.clone(),
            free: self.free.clone(),
            places: self.places.clone(),
            bvh: self.bvh.clone(),
            meshes: self.meshes.clone(),
            problems: Vec::new(),
        }
    }
}

impl Space {
    /// The bodies of a version. Meshes are read from their files.
    pub fn new(tree: &Snapshot) -> Self {
        let mut space = Self {
            tree: tree.clone(),
            solids: Vec::new(),
            free: Vec::new(),
            places: HashMap::new(),
            bvh: Bvh::new(),
            meshes: HashMap::new(),
            problems: Vec::new(),
        };
        for node in tree.nodes() {
            space.add(&node);
        }
        space
    }

    /// The version whose bodies these are.
    pub fn tree(&self) -> &Snapshot {
        &self.tree
    }

    /// How many bodies there are.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no body.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The shape of a node's body and its pose in the root, in metres, as parry has them.
    pub fn shape_of(&self, node: NodeId) -> Option<(&SharedShape, &Pose)> {
        let solid = self.solid(node)?;
        Some((&solid.shape, &solid.pose))
    }

    /// Problems of bodies that were found since the last call.
    pub fn problems(&mut self) -> Vec<Problem> {
        std::mem::take(&mut self.problems)
    }

    /// Moves the bodies to where they are in another version of the same model. Returns how many
    /// bodies were touched.
    pub fn update(&mut self, tree: &Snapshot) -> usize {
        let changes = tree.since(&self.tree);
        self.tree = tree.clone();
        let mut touched = 0;
        for change in changes {
            match change {
                Change::Removed { node, .. } => touched += usize::from(self.remove(node)),
                Change::Added(node) => {
                    if let Ok(node) = tree.node(node) {
                        touched += usize::from(self.add(&node));
                    }
                }
                Change::Moved(node) | Change::Parent(node) => {
                    let top = tree.node(node).ok();
                    for node in top.iter().flat_map(NodeRef::subtree) {
                        touched += usize::from(self.place(&node));
                    }
                }
                Change::Data(node) => {
                    let Ok(node) = tree.node(node) else {
                        continue;
                    };
                    // Also a body that is too far to meet others.
                    let known = self.places.get(&node.node_id());
                    let known = known.and_then(|at| self.solids.get(*at as usize)?.as_ref());
                    if known.is_none_or(|solid| !Arc::ptr_eq(&solid.kind, node.shared_kind())) {
                        self.remove(node.node_id());
                        touched += usize::from(self.add(&node));
                    }
                }
            }
        }
        touched
    }

    pub(crate) fn solid(&self, node: NodeId) -> Option<&Solid> {
        let place = self.places.get(&node)?;
        self.near(*place)
    }

    /// The body at a place, if it is near enough to meet others.
    pub(crate) fn near(&self, place: u32) -> Option<&Solid> {
        let solid = self.solids.get(place as usize)?.as_ref();
        solid.filter(|solid| solid.is_near)
    }

    /// Adds the body of a node, if it has one.
    fn add(&mut self, node: &NodeRef<'_>) -> bool {
        let kind = Arc::clone(node.shared_kind());
        let Some((body, inner)) = body(&kind) else {
            return false;
        };
        let (shape, rays) = match self.shape(&body) {
            Ok(found) => found,
            Err(error) => {
                let (id, error) = (node.id().to_owned(), BodyError::Mesh(error));
                self.problems.push(Problem { id, error });
                return false;
            }
        };
        let solid = Solid {
            node: node.node_id(),
            shape,
            rays,
            pose: Pose::identity(),
            is_near: true,
            inner,
            kind: Arc::clone(&kind),
        };
        let place = self.free.pop().unwrap_or_else(|| {
            self.solids.push(None);
            self.solids.len() as u32 - 1
        });
        self.solids[place as usize] = Some(solid);
        self.places.insert(node.node_id(), place);
        self.place(node)
    }

    fn remove(&mut self, node: NodeId) -> bool {
        let Some(place) = self.places.remove(&node) else {
            return false;
        };
        self.solids[place as usize] = None;
        self.free.push(place);
        self.bvh.remove(place);
        true
    }

    /// Moves the body of a node to where the node is.
    fn place(&mut self, node: &NodeRef<'_>) -> bool {
        let Some(place) = self.places.get(&node.node_id()).copied() else {
            return false;
        };
        let Some(solid) = &mut self.solids[place as usize] else {
            return false;
        };
        solid.pose = pose(&(node.to_root() * solid.inner));
        let was_near = std::mem::replace(&mut solid.is_near, false);
        let bounds = is_near(&solid.pose).then(|| solid.bounds(&solid.pose));
        let bounds = bounds.filter(|bounds| is_within(bounds.mins) && is_within(bounds.maxs));
        // An update in place would only let the boxes around it grow, also around bodies that it
        // has left. Removing and inserting it costs the depth of the tree.
        self.bvh.remove(place);
        if let Some(bounds) = bounds {
            solid.is_near = true;
            self.bvh.insert(bounds, place);
        } else if was_near {
            let (id, error) = (node.id().to_owned(), BodyError::TooFar);
            self.problems.push(Problem { id, error });
        }
        true
    }

    /// The shape of a body, with the triangles of a mesh for rays.
    fn shape(&mut self, body: &Body<'_>) -> Result<(SharedShape, Option<Arc<RayTree>>), MeshError> {
        let shape = match body {
            Body::Box(size) => {
                let [x, y, z] = size.map(|length| length / 2.0 / METRE);
                SharedShape::cuboid(x, y, z)
            }
            Body::Solid(Shape::Sphere { radius }) => SharedShape::ball(radius / METRE),
            Body::Solid(Shape::Cylinder { radius, length }) => {
                SharedShape::cylinder(length / 2.0 / METRE, radius / METRE)
            }
            Body::Solid(Shape::Cone { radius, length }) => {
                SharedShape::cone(length / 2.0 / METRE, radius / METRE)
            }
            Body::Mesh(mesh) => {
                let (shape, rays) = self.mesh(mesh)?;
                return Ok((shape, Some(rays)));
            }
        };
        Ok((shape, None))
    }

    /// The triangles of a mesh. Equal meshes share them.
    fn mesh(&mut self, mesh: &Mesh) -> Result<Known, MeshError> {
        let path = mesh
            .path
            .clone()
            .unwrap_or_else(|| mesh.file.clone().into());
        let key = (path, mesh.scale.map(f64::to_bits));
        if let Some(known) = self.meshes.get(&key) {
            return Ok(known.clone());
        }
        let read = innermodel_mesh::read(&key.0)?;
        let [sx, sy, sz] = mesh.scale.map(|scale| scale / METRE);
        let vertices = read.vertices.iter();
        let vertices = vertices
            .map(|[x, y, z]| Vector::new(x * sx, y * sy, -z * sz))
            .collect();
        let mesh = TriMesh::new(vertices, read.triangles)
            .map_err(|error| MeshError::Wrong(error.to_string()))?;
        // Now, so that the first ray takes no longer than the others.
        let rays = Arc::new(RayTree::new(&mesh));
        // A body whose scale changes leaves a shape that nothing else has.
        self.meshes
            .retain(|_, (shape, _)| Arc::strong_count(&shape.0) > 1);
        let known = (SharedShape::new(mesh), rays);
        self.meshes.insert(key, known.clone());
        Ok(known)
    }
}

/// Whether all coordinates are numbers that the library can compute with.
fn is_within(point: Vector) -> bool {
    point.abs().cmple(Vector::splat(FARTHEST)).all()
}

/// Whether all numbers of a pose are finite and its place is within [`FARTHEST`].
fn is_near(pose: &Pose) -> bool {
    is_within(pose.translation) && pose.rotation.is_finite()
}

pub(crate) fn vector(v: &innermodel::Vector) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// The pose in metres.
pub(crate) fn pose(transform: &Transform) -> Pose {
    let r = &transform.rotation;
    let column = |at: usize| Vector::new(r[(0, at)], r[(1, at)], r[(2, at)]);
    let rotation = Mat3::from_cols(column(0), column(1), column(2));
    Pose::from_parts(
        vector(&transform.translation) / METRE,
        Rotation::from_mat3(&rotation).normalize(),
    )
}
