//! InnerModel files as graphs of the domain `innermodel`, and the frames of a graph as a tree of InnerModel.

use crate::document::{Document, Edge, Node};
use graph_schema::{Kind as Type, Placed, PoseOf, Schema};
use innermodel_language::Loader;
use innermodel_language::model::{self, Kind, Plane, Pose, Transform as Frame};
use property_graph::{Id, NodeRef, Snapshot, Transform, Value};
use rc_diagnostics::SourceMap;
use rc_quantity::{Axes, Unit};
use std::collections::{BTreeMap, HashMap};
use std::io;
use std::path::{Path, PathBuf};

/// Millimetres in a metre.
const METRE: f64 = 1000.0;

/// The graph of a tree: a `Frame` for each node, a `Part` for each that is more, and an `RT` for each but those at
/// the top, in metres.
pub fn document(tree: &model::Document) -> Document {
    let id = |at: usize| Id::new(1, at as u64 + 2);
    let root = Id::new(1, 1);
    let mut made = Document {
        schema: Some("innermodel.gdsl".to_owned()),
        ..Document::default()
    };
    let named = |id: Id, kind: &str, name: &str| Node {
        id,
        kind: kind.to_owned(),
        attributes: vec![("name".to_owned(), name.into(), None)],
        path: String::new(),
    };
    made.nodes.push(named(root, "Frame", model::ROOT));
    for (at, node) in tree.nodes.iter().enumerate() {
        let element = element(node);
        let kind = if element.is_some() { "Part" } else { "Frame" };
        let mut frame = named(id(at), kind, &node.id);
        let element = element.map(|text| ("element".to_owned(), text.into(), None));
        frame.attributes.extend(element);
        let (pose, position) = at_start(node);
        let position = position.map(|position| ("position".to_owned(), position.into(), None));
        frame.attributes.extend(position);
        made.nodes.push(frame);
        let [x, y, z] = pose.translation.map(|length| length / METRE);
        let [rx, ry, rz] = pose.rotation;
        let pose: Value = [x, y, z, rx, ry, rz].into();
        made.edges.push(Edge {
            id: Some(Id::new(1, (tree.nodes.len() + at) as u64 + 2)),
            kind: "RT".to_owned(),
            from: node.parent.map_or(root, id),
            to: id(at),
            attributes: vec![("pose".to_owned(), pose, None)],
            path: String::new(),
        });
    }
    made
}

/// Where a node is at the start, as in the crate `innermodel`: a joint is at 0 or at the nearest end of its limits.
/// With the position of a joint, if its element does not say it.
fn at_start(node: &model::Node) -> (Pose, Option<f64>) {
    match &node.kind {
        Kind::Joint(joint) => {
            let position = 0.0_f64.max(joint.min).min(joint.max);
            if position == 0.0 {
                return (node.pose, None);
            }
            let turned = Transform::about(joint.axis, position);
            let place = Transform::of(&node.pose).then_inner(&turned);
            (place.pose(), Some(position))
        }
        Kind::Prismatic(slide) => {
            let position = slide.position.max(slide.min).min(slide.max);
            let mut pose = Pose::default();
            pose.translation[slide.axis.index()] = position + slide.offset;
            (pose, (position != slide.position).then_some(position))
        }
        _ => (node.pose, None),
    }
}

/// The element of a node without its pose. `None` for what is only a frame.
fn element(node: &model::Node) -> Option<String> {
    if node.allowed.is_empty()
        && let Kind::Transform(Frame { engine, mass, .. }) = &node.kind
        && *engine == model::Engine::Static
        && *mass == 0.0
    {
        return None;
    }
    let mut described = node.clone();
    described.pose = Pose::default();
    Some(innermodel_language::element(&described))
}

/// No file is looked for: where meshes are, the tree's reader finds out.
struct NoFiles;

impl Loader for NoFiles {
    fn read(&self, _: &Path) -> io::Result<String> {
        Err(io::ErrorKind::NotFound.into())
    }

    fn is_file(&self, _: &Path) -> bool {
        false
    }

    fn search(&self) -> &[PathBuf] {
        &[]
    }
}

/// What an element says of its node.
fn described(element: &str) -> Option<model::Node> {
    let mut sources = SourceMap::new();
    let text = format!("<innerModel>{element}</innerModel>");
    let source = sources.add("element", text);
    let (mut read, found) = innermodel_language::load(&mut sources, &NoFiles, source);
    let is_one = read.nodes.len() == 1 && !found.has_errors();
    read.nodes.pop().filter(|_| is_one)
}

/// How the poses of a schema are read: what millimetres a length has, and where the axes point.
struct Frames {
    scale: f64,
    /// Takes a direction of the graph to `InnerModel`.
    turn: [[f64; 3]; 3],
}

impl Frames {
    /// The axes are those of `InnerModel` with its domain, those of `RoboComp` with poses of DSR, and those of ROS
    /// (x ahead, y left, z up) otherwise.
    fn of(schema: &Schema) -> Self {
        let placed = schema.relations.iter().filter(|own| own.tree.is_some());
        let placed: Vec<(&graph_schema::Relation, Placed)> = placed
            .filter_map(|relation| Some((relation, relation.placed()?)))
            .collect();
        let of_dsr = |(_, placed): &(_, Placed)| match &placed.pose {
            PoseOf::Two(by, _) => by == "rt_translation",
            PoseOf::One(_) => false,
        };
        let axes = if schema
            .entity("Part")
            .is_some_and(|of| of.domain == "innermodel")
        {
            Axes::INNER_MODEL
        } else if placed.iter().any(of_dsr) {
            Axes::ROBOCOMP
        } else {
            Axes::ROS
        };
        let unit = placed.iter().find_map(|(relation, placed)| {
            let (PoseOf::One(name) | PoseOf::Two(name, _)) = &placed.pose;
            let attribute = relation.attribute(name)?;
            // Transforms have metres of any prototype.
            let unit = attribute.unit.as_deref();
            unit.filter(|_| !matches!(attribute.kind, Type::Block(_)))
        });
        let millimetres = |unit: &str| {
            let (own, other) = (Unit::parse(unit).ok()?, Unit::parse("mm").ok()?);
            Some(own.conversion_to(&other)?.apply(1.0))
        };
        Self {
            scale: unit.and_then(millimetres).unwrap_or(METRE),
            turn: axes.matrix_to(Axes::INNER_MODEL),
        }
    }

    fn pose(&self, pose: &Pose) -> Pose {
        let turn = &self.turn;
        if *turn == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            return Pose {
                translation: pose.translation.map(|length| length * self.scale),
                rotation: pose.rotation,
            };
        }
        let own = Transform::of(pose);
        let mut out = Transform::identity();
        for row in 0..3 {
            let mut moved = 0.0;
            for (k, towards) in turn[row].iter().enumerate() {
                moved += towards * own.translation[k];
            }
            out.translation[row] = moved * self.scale;
            for column in 0..3 {
                let mut sum = 0.0;
                for (i, left) in turn[row].iter().enumerate() {
                    for (j, right) in turn[column].iter().enumerate() {
                        sum += left * own.rotation[(i, j)] * right;
                    }
                }
                out.rotation[(row, column)] = sum;
            }
        }
        out.pose()
    }
}

/// The frames of a graph as a tree of `InnerModel`: poses in millimetres along its axes, ids that are the names of
/// nodes. A `Part` is what its element says; in a graph of DSR, meshes and boxes are drawn, too. What has a pose in no
/// tree is left out.
pub fn tree(world: &Snapshot) -> model::Document {
    let frames = Frames::of(world.schema());
    let mut nodes = HashMap::new();
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    for node in world.nodes() {
        if let Ok(frame) = world.frame(node.node_id()) {
            nodes.insert(frame.node(), node.node_id());
            *names.entry(node.name()).or_default() += 1;
        }
    }
    let mut out = Building {
        world,
        frames,
        names,
        document: model::Document::default(),
    };
    // A parent comes before its children.
    let mut rest: Vec<(_, Option<NodeRef<'_>>, Option<usize>)> = Vec::new();
    let top = world.tree().root();
    rest.push((top.node_id(), None, None));
    while let Some((key, node, parent)) = rest.pop() {
        let Ok(frame) = world.tree().node(key) else {
            continue;
        };
        let mut below: Vec<_> = frame
            .children()
            .filter_map(|child| {
                let node = world.node(*nodes.get(&child.node_id())?).ok()?;
                Some((child.node_id(), node))
            })
            .collect();
        let is_top = frame.parent().is_none_or(|above| above.parent().is_none());
        let place = match node {
            None => parent,
            // The node above all others is there already.
            Some(node) if is_top && NodeRef::name(&node) == model::ROOT => parent,
            Some(node) => Some(out.add(node, parent, &frame.pose(), !below.is_empty())),
        };
        // Siblings are in the order of their ids, which is that of a file.
        below.sort_unstable_by_key(|(_, node)| std::cmp::Reverse(node.id()));
        let below = below.into_iter();
        rest.extend(below.map(|(key, node)| (key, Some(node), place)));
    }
    out.document
}

/// Whether a file can have a character in an id.
fn is_of_xml(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')
}

/// A tree that is being made.
struct Building<'w> {
    world: &'w Snapshot,
    frames: Frames,
    /// How many frames have a name.
    names: BTreeMap<&'w str, usize>,
    document: model::Document,
}

impl<'w> Building<'w> {
    /// Adds a node. Returns its place.
    fn add(
        &mut self,
        node: NodeRef<'w>,
        parent: Option<usize>,
        pose: &Pose,
        has_children: bool,
    ) -> usize {
        let id = self.id(node);
        let mut pose = self.frames.pose(pose);
        let body = self.body(node);
        let (mut kind, allowed) = match &body {
            Some(body) => (body.kind.clone(), body.allowed.clone()),
            None => (Kind::Transform(Frame::default()), Vec::new()),
        };
        let position = node.get("position").and_then(Value::as_f64);
        match &mut kind {
            Kind::Joint(joint) => {
                // The file has the pose at 0.
                let position = position.filter(|position| *position != 0.0);
                if let Some(position) = position {
                    let turned = Transform::about(joint.axis, position);
                    let place = Transform::of(&pose);
                    pose = place.then_inner(&turned.inverse()).pose();
                }
            }
            Kind::Prismatic(slide) => {
                slide.position = position.unwrap_or(slide.position);
                return self.push(&id, parent, kind, Pose::default(), allowed);
            }
            _ => {}
        }
        let is_at_rest = pose.translation == [0.0; 3] && pose.rotation == [0.0; 3];
        let has_place = kind.has_pose() || is_at_rest;
        if has_place && (kind.may_have_children() || !has_children) {
            return self.push(&id, parent, kind, pose, allowed);
        }
        // The body is below a frame with its pose.
        let frame = Kind::Transform(Frame::default());
        let place = self.push(&id, parent, frame, pose, Vec::new());
        let below = self.free(format!("{id}_body"));
        self.push(&below, Some(place), kind, Pose::default(), allowed);
        place
    }

    fn push(
        &mut self,
        id: &str,
        parent: Option<usize>,
        kind: Kind,
        pose: Pose,
        allowed: Vec<String>,
    ) -> usize {
        let mut node = model::Node::new(id, kind);
        (node.parent, node.pose, node.allowed) = (parent, pose, allowed);
        self.document.nodes.push(node);
        self.document.nodes.len() - 1
    }

    /// The name, if no other frame has it, and it is no word of `InnerModel`; else with the id.
    fn id(&self, node: NodeRef<'w>) -> String {
        let (name, id) = (node.name(), node.id());
        let is_alone = self.names.get(name) == Some(&1) && !name.is_empty();
        if is_alone && name != model::ROOT && name.chars().all(is_of_xml) {
            return name.to_owned();
        }
        let kind = if name.is_empty() {
            node.type_name()
        } else {
            name
        };
        let kind: String = kind.chars().filter(|c| is_of_xml(*c)).collect();
        self.free(format!("{kind}#{}:{}", id.writer(), id.count()))
    }

    /// An id that is made, and is not the name of a frame.
    fn free(&self, mut id: String) -> String {
        while self.names.contains_key(id.as_str()) {
            id.push('_');
        }
        id
    }

    /// What a node is, if it is more than a frame.
    fn body(&self, node: NodeRef<'w>) -> Option<model::Node> {
        if let Some(element) = node.get("element").and_then(Value::as_str) {
            return described(element);
        }
        let schema = self.world.schema();
        let kind = node.type_name();
        if schema.is_a(kind, "mesh") {
            let file = node.get("path").and_then(Value::as_str)?;
            let mesh = model::Mesh {
                file: file.to_owned(),
                path: None,
                scale: [1.0; 3],
                render: model::Render::Normal,
                collide: true,
            };
            return Some(model::Node::new("", Kind::Mesh(mesh)));
        }
        // Boxes of DSR have whole millimetres.
        let side = |name| {
            let length = node.get(name).and_then(Value::as_f64)?;
            (length > 0.0).then_some(length)
        };
        let (width, depth, height) = (side("width")?, side("depth")?, side("height")?);
        let texture = node.get("texture").and_then(Value::as_str);
        let is_of_dsr = schema.is_a(kind, "object");
        let plane = Plane {
            texture: texture.unwrap_or("#808080").to_owned(),
            picture: None,
            size: [width, height, depth],
            repeat: 1000,
            normal: [0.0, 0.0, -1.0],
            point: [0.0; 3],
            collide: true,
        };
        is_of_dsr.then(|| model::Node::new("", Kind::Plane(plane)))
    }
}
