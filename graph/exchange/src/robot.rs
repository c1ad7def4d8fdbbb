//! Robots of URDF files as graphs of the domain `kinematics`.

use crate::document::{Attribute, Document, Edge, Node};
use property_graph::{Id, Value};
use rc_quantity::Transform;
use rc_quantity::rotation::{EulerOrder, IDENTITY};
use rc_robot::{Body, Joint, Motion, Robot};

/// Where a joint at 0 leaves its successor.
const STILL: Transform = Transform {
    rotation: IDENTITY,
    translation: [0.0; 3],
};

/// Numbers the elements, and keeps them.
struct Maker {
    made: Document,
    count: u64,
}

impl Maker {
    fn id(&mut self) -> Id {
        self.count += 1;
        Id::new(1, self.count)
    }

    fn node(&mut self, kind: &str, name: &str, others: Vec<Attribute>) -> Id {
        let id = self.id();
        let name = ("name".to_owned(), name.into(), None);
        self.made.nodes.push(Node {
            id,
            kind: kind.to_owned(),
            attributes: [name].into_iter().chain(others).collect(),
            path: String::new(),
        });
        id
    }

    fn edge(&mut self, kind: &str, [from, to]: [Id; 2], attributes: Vec<Attribute>) {
        let id = Some(self.id());
        self.made.edges.push(Edge {
            id,
            kind: kind.to_owned(),
            from,
            to,
            attributes,
            path: String::new(),
        });
    }

    fn pose(&mut self, ends: [Id; 2], place: &Transform) {
        let angles = EulerOrder::XYZ_MOVING.angles(&place.rotation).angles;
        let numbers = [place.translation, angles].concat();
        let pose = ("pose".to_owned(), numbers.as_slice().into(), None);
        self.edge("RT", ends, vec![pose]);
    }
}

fn attribute(name: &str, value: impl Into<Value>) -> Attribute {
    (name.to_owned(), value.into(), None)
}

/// Mass, centre of mass and inertia, where the file says them.
fn masses(body: &Body) -> Vec<Attribute> {
    let Some(inertia) = &body.inertia else {
        return Vec::new();
    };
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = inertia.tensor;
    vec![
        attribute("mass", inertia.mass),
        attribute("centre", inertia.centre),
        attribute("inertia", [xx, xy, xz, yy, yz, zz]),
    ]
}

/// The graph of a robot whose joints are at 0: for each link a body that is fixed in a frame, for
/// each joint a frame in that of its predecessor, which has the frame of its successor. A mimic
/// joint becomes a joint of its own; the graph does not keep which joint it follows.
pub fn document(robot: &Robot) -> Document {
    let mut maker = Maker {
        made: Document {
            schema: Some("kinematics.gdsl".to_owned()),
            ..Document::default()
        },
        count: 0,
    };
    let links = robot.bodies.iter().map(|body| {
        // One inside a joint of several coordinates is no link.
        if body.name.is_empty() {
            return None;
        }
        let made = maker.node("Body", &body.name, masses(body));
        let frame = maker.node("Frame", &body.name, Vec::new());
        Some((made, frame))
    });
    let links: Vec<Option<(Id, Id)>> = links.collect();
    for (body, frame) in links.iter().flatten() {
        maker.edge("fixed_in", [*body, *frame], Vec::new());
    }
    for (body, link) in robot.bodies.iter().zip(&links) {
        let (Some(joint), Some((second, after))) = (&body.joint, link) else {
            continue;
        };
        let parent = |joint: &&Joint| robot.bodies.get(joint.parent)?.joint.as_ref();
        let is_inside = |joint: &Joint| links.get(joint.parent) == Some(&None);
        let mut chain = std::iter::successors(Some(joint), parent);
        let Some(above) = chain.find(|joint| !is_inside(joint)) else {
            continue;
        };
        let Some(Some((first, before))) = links.get(above.parent) else {
            continue;
        };
        // The coordinate of the last joint of several ones has its name after theirs.
        let several = joint.name.rsplit_once('.').filter(|_| is_inside(joint));
        let name = several.map_or(joint.name.as_str(), |(name, _)| name);
        let kind = match joint.motion {
            _ if several.is_some() => "Joint",
            Motion::Fixed => "Fixed",
            Motion::Turns { .. } => "Revolute",
            Motion::Slides { .. } => "Prismatic",
        };
        let mut attributes = Vec::new();
        if kind != "Fixed" {
            attributes.push(attribute("axis", joint.axis));
        }
        if let Some(limits) = joint.limits
            && limits.lower.is_finite()
        {
            attributes.push(attribute("lower", limits.lower));
            attributes.push(attribute("upper", limits.upper));
        }
        let node = maker.node(kind, name, attributes);
        let own = maker.node("Frame", name, Vec::new());
        for (relation, end) in [
            ("body1", first),
            ("body2", second),
            ("predecessor", before),
            ("successor", after),
            ("my_frame", &own),
        ] {
            maker.edge(relation, [node, *end], Vec::new());
        }
        maker.pose([*before, own], &above.place);
        maker.pose([own, *after], &STILL);
    }
    maker.made
}
