//! The tree with its bodies, and the changes that requests make.

use crate::front::Front;
use crate::wire;
use inner_model_generated::{ColouredPoint, Params};
use inner_model_manager::Refusal;
use innermodel::{Edit, Folders, InnerModel, Keep, Kind, LoadError, NodeId, Pose, Snapshot, Time};
use innermodel_collision::Space;
use rc_diagnostics::foreign::clean;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// The tree that the component serves.
pub(crate) struct World {
    pub(crate) model: InnerModel,
    pub(crate) front: Front,
    /// The bodies, once a request needs them.
    space: Option<Space>,
    max_points: usize,
    refuse_collisions: bool,
    /// The file of the tree, from where meshes of elements are looked for.
    pub(crate) place: PathBuf,
    pub(crate) folders: Folders,
}

/// Two bodies that touch.
type Pair = (NodeId, NodeId);

impl World {
    /// Reads the file. Without one, the tree is empty. The text has the warnings.
    pub(crate) fn load(params: &Params) -> Result<(Self, String), LoadError> {
        let folders = Folders::new(params.search.iter().cloned());
        let (mut model, mut warnings, mut place) =
            (InnerModel::new(), String::new(), PathBuf::new());
        if !params.file.as_os_str().is_empty() {
            // Other processes, which have other working directories, get paths of meshes.
            place = std::path::absolute(&params.file).unwrap_or_else(|_| params.file.clone());
            let (document, found) = innermodel::read(&place, &folders)?;
            (model, warnings) = (InnerModel::from_document(&document)?, found);
        }
        let mut world = Self {
            front: Front::new(model.snapshot()),
            model,
            space: None,
            max_points: 0,
            refuse_collisions: false,
            place,
            folders,
        };
        world.set(params);
        Ok((world, warnings))
    }

    /// Takes parameters that may change while the component runs.
    pub(crate) fn set(&mut self, params: &Params) {
        self.max_points = usize::try_from(params.max_points).unwrap_or(0);
        self.refuse_collisions = params.refuse_collisions;
        self.model.keep(Keep {
            duration: params.history,
            versions: 100_000,
            gap: Duration::from_secs(1),
        });
    }

    /// The present version.
    pub(crate) fn tree(&self) -> Arc<Snapshot> {
        self.model.snapshot()
    }

    /// The bodies of the present version.
    pub(crate) fn space(&mut self) -> &Space {
        let tree = self.model.snapshot();
        let mut space = self.space.take().unwrap_or_else(|| Space::new(&tree));
        space.update(&tree);
        self.space.insert(space)
    }

    /// Bodies that meet nothing since the last call.
    pub(crate) fn problems(&mut self) -> Vec<String> {
        let problems = self.space.as_mut().map(Space::problems);
        let problems = problems.into_iter().flatten();
        problems
            .map(|problem| {
                let (id, error) = (clean(&problem.id), clean(&problem.error.to_string()));
                format!("the body of `{id}`: {error}")
            })
            .collect()
    }

    /// Makes a change.
    pub(crate) fn change<T>(
        &mut self,
        time: Time,
        make: impl FnOnce(&mut Edit) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        self.model.change(time, make)
    }

    /// Makes a change that moves bodies. If collisions are refused, it fails where bodies touch
    /// afterwards that did not touch before.
    pub(crate) fn move_bodies<T>(
        &mut self,
        time: Time,
        make: impl Fn(&mut Edit) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        if self.refuse_collisions {
            let trial = self.model.fork();
            trial.change(time, &make)?;
            let after = trial.snapshot();
            let before = self.touching();
            let mut space = self.space.take().unwrap_or_else(|| Space::new(&after));
            space.update(&after);
            let new = space.collisions().into_iter().find(|contact| {
                !before.contains(&(contact.a, contact.b))
                    && !before.contains(&(contact.b, contact.a))
            });
            self.space = Some(space);
            if let Some(contact) = new {
                let id = |node: NodeId| {
                    after
                        .node(node)
                        .map_or(String::new(), |node| clean(node.id()))
                };
                let text = format!("`{}` would collide with `{}`", id(contact.a), id(contact.b));
                return Err(Refusal::Collision(text));
            }
        }
        self.change(time, make)
    }

    fn touching(&mut self) -> BTreeSet<Pair> {
        let contacts = self.space().collisions();
        contacts
            .iter()
            .map(|contact| (contact.a, contact.b))
            .collect()
    }

    /// Reads elements of a file, in the form of the contents of its outermost element.
    pub(crate) fn read(&self, elements: &str) -> Result<innermodel::language::Document, Refusal> {
        let text = format!("<innerModel>{elements}</innerModel>");
        let read = innermodel::read_text(&text, &self.place, &self.folders);
        let (document, _) = read.map_err(|error| Refusal::Text(error.to_string()))?;
        if document.nodes.is_empty() {
            return Err(Refusal::Text("expected an element".to_owned()));
        }
        Ok(document)
    }

    /// Adds elements below a node.
    pub(crate) fn add(&mut self, time: Time, parent: &str, elements: &str) -> Result<(), Refusal> {
        let document = self.read(elements)?;
        self.change(time, |edit| {
            edit.add_document(parent, &document)?;
            Ok(())
        })
    }

    /// Replaces kind and pose of the node with the id of an element.
    pub(crate) fn replace(&mut self, time: Time, element: &str) -> Result<(), Refusal> {
        let document = self.read(element)?;
        let [described] = &document.nodes[..] else {
            return Err(Refusal::Text(
                "expected one element without children".to_owned(),
            ));
        };
        self.move_bodies(time, |edit| Ok(replace(edit, described)?))
    }

    pub(crate) fn set_pose(&mut self, time: Time, id: &str, pose: Pose) -> Result<(), Refusal> {
        self.move_bodies(time, |edit| Ok(edit.set_pose(id, pose)?))
    }

    pub(crate) fn set_pose_in(
        &mut self,
        time: Time,
        id: &str,
        base: &str,
        pose: Pose,
    ) -> Result<(), Refusal> {
        self.move_bodies(time, |edit| Ok(edit.set_pose_in(id, base, pose)?))
    }

    /// Removes a node with all below it, and its clouds.
    pub(crate) fn remove(&mut self, time: Time, id: &str) -> Result<(), Refusal> {
        self.change(time, |edit| Ok(edit.remove(id).map(drop)?))?;
        self.model.forget_points();
        Ok(())
    }

    /// The points of a node.
    pub(crate) fn cloud(&self, id: &str) -> Result<Vec<ColouredPoint>, Refusal> {
        let node = cloud_node(&self.model.snapshot(), id)?;
        Ok(self
            .model
            .clouds()
            .of(node)
            .iter()
            .map(wire::coloured_out)
            .collect())
    }

    /// Replaces the points of a node.
    pub(crate) fn set_cloud(&mut self, id: &str, cloud: &[ColouredPoint]) -> Result<(), Refusal> {
        let node = cloud_node(&self.model.snapshot(), id)?;
        self.model.forget_points();
        let clouds = self.model.clouds();
        let others = clouds.iter().filter(|(other, _)| *other != node);
        let count = others.map(|(_, cloud)| cloud.len()).sum::<usize>() + cloud.len();
        if count > self.max_points {
            let most = self.max_points;
            let text =
                format!("there would be {count} points in all clouds; at most {most} are kept");
            return Err(Refusal::Value(text));
        }
        let points = cloud.iter().map(wire::coloured_in).collect();
        Ok(self.model.set_points(node, points)?)
    }
}

fn cloud_node(tree: &Snapshot, id: &str) -> Result<NodeId, Refusal> {
    let node = tree.node(id)?;
    if *node.kind() == Kind::PointCloud {
        return Ok(node.node_id());
    }
    let (id, tag) = (clean(node.id()), node.kind().tag());
    Err(Refusal::Kind(format!(
        "`{id}` is a {tag}, not a pointcloud"
    )))
}

/// Gives a node the kind, the pose and the allowed contacts of an element.
fn replace(
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
