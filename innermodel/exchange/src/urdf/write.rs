//! From a document to URDF.

use super::METRE;
use crate::matrix::{OF_MESH, Placement, TO_URDF, Vector, apply, product, rpy};
use crate::shapes::{board, place};
use innermodel_language::model::{Document, Kind, Node, Plane, Shape};
use rc_diagnostics::xml::escaped;
use rc_diagnostics::{Diagnostic, Diagnostics};

/// Effort and velocity of a joint that moves, which URDF demands and InnerModel may lack: newtons
/// and metres a second, or newton metres and radians a second.
const EFFORT: f64 = 1000.0;
const VELOCITY: f64 = 10.0;
/// The comment in the limit of a joint without a greatest speed, whose velocity is [`VELOCITY`].
pub(super) const NO_SPEED: &str = " no maxspeed ";
/// Number in place of a missing limit where only the other one is there: radians or metres.
const FAR: f64 = 10_000.0;

/// The first lines of a file.
const BEGIN: &str = "<?xml version=\"1.0\"?>\n<!-- Exported by rcgen. -->\n";

/// Whether [`write()`] made a file.
pub fn is_exported(file: &[u8]) -> bool {
    file.starts_with(BEGIN.as_bytes())
}

/// The text of a robot in URDF. Each node that may have children, and each sensor, is a link; the
/// links have the ids of their nodes, and the joints, too. Findings tell what does not fit.
pub fn write(document: &Document, robot: &str) -> (String, Diagnostics) {
    let mut writer = Writer {
        out: BEGIN.to_owned(),
        found: Diagnostics::new(),
    };
    writer
        .out
        .push_str(&format!("<robot name=\"{}\">\n", escaped(robot)));
    writer.link(document, None, 0.0);
    for (at, node) in document.nodes.iter().enumerate() {
        if is_frame(&node.kind) {
            writer.frame(document, at, node);
        }
        if !node.allowed.is_empty() {
            writer.misses(node, "contacts that are allowed");
        }
    }
    writer.out.push_str("</robot>\n");
    (writer.out, writer.found)
}

/// Whether a node becomes a link.
fn is_frame(kind: &Kind) -> bool {
    kind.may_have_children()
        || matches!(
            kind,
            Kind::Camera(_)
                | Kind::Rgbd(_)
                | Kind::Laser(_)
                | Kind::Lidar(_)
                | Kind::Ultrasound(_)
                | Kind::Imu(_)
                | Kind::PointCloud
        )
}

fn numbers(numbers: Vector) -> String {
    // Rounding errors of the rotations are not content, and −0 is 0.
    let clean = |n: f64| if n.abs() < 1e-15 { 0.0 } else { n };
    numbers.map(|n| clean(n).to_string()).join(" ")
}

struct Writer {
    out: String,
    found: Diagnostics,
}

impl Writer {
    fn misses(&mut self, node: &Node, what: &str) {
        let message = format!("URDF has no {what}: `{}` loses them", node.id);
        self.found
            .push(Diagnostic::warning("lost-on-export", node.span, message));
    }

    fn origin(&mut self, indent: &str, place: &Placement) {
        let (xyz, rpy) = (numbers(place.translation), numbers(rpy(&place.rotation)));
        let line = format!("{indent}<origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>\n");
        self.out.push_str(&line);
    }

    /// A link with the bodies that are directly below its node.
    fn link(&mut self, document: &Document, of: Option<usize>, mass: f64) {
        let name = of.map_or(innermodel_language::model::ROOT, |at| {
            &document.nodes[at].id
        });
        self.out
            .push_str(&format!("  <link name=\"{}\">\n", escaped(name)));
        if mass > 0.0 {
            self.out
                .push_str(&format!("    <inertial>\n      <mass value=\"{mass}\"/>\n"));
            let none = "ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"";
            self.out
                .push_str(&format!("      <inertia {none}/>\n    </inertial>\n"));
        }
        let bodies = document.nodes.iter().filter(|node| node.parent == of);
        for node in bodies {
            self.body(node);
        }
        self.out.push_str("  </link>\n");
    }

    fn frame(&mut self, document: &Document, at: usize, node: &Node) {
        let mass = match &node.kind {
            Kind::Transform(transform) => transform.mass,
            _ => 0.0,
        };
        self.link(document, Some(at), mass);
        let mut here = place(&node.pose);
        let mut max_speed = 0.0;
        let (form, axis, limits) = match &node.kind {
            Kind::Joint(joint) => {
                let mut axis = [0.0; 3];
                axis[joint.axis.index()] = 1.0;
                // A rotation changes its sense where the hand changes.
                let axis = apply(&TO_URDF, &axis).map(|n| -n);
                max_speed = joint.max_speed;
                if joint.home != 0.0 {
                    self.misses(node, "positions of rest");
                }
                let form = match (joint.min.is_finite(), joint.max.is_finite()) {
                    (false, false) => "continuous",
                    _ => "revolute",
                };
                (form, Some(axis), (joint.min, joint.max))
            }
            Kind::Prismatic(joint) => {
                let mut axis = [0.0; 3];
                axis[joint.axis.index()] = 1.0;
                here.translation[joint.axis.index()] += joint.offset;
                max_speed = joint.max_speed / METRE;
                if joint.home != 0.0 || joint.position != 0.0 {
                    self.misses(node, "positions at the start or of rest");
                }
                let limits = (joint.min / METRE, joint.max / METRE);
                ("prismatic", Some(apply(&TO_URDF, &axis)), limits)
            }
            Kind::Transform(_) => ("fixed", None, (0.0, 0.0)),
            Kind::TouchSensor(_) | Kind::Robot(_) => {
                self.misses(node, &format!("words for a {}", node.kind.tag()));
                ("fixed", None, (0.0, 0.0))
            }
            _ => {
                self.misses(
                    node,
                    &format!("words for the values of a {}", node.kind.tag()),
                );
                ("fixed", None, (0.0, 0.0))
            }
        };
        let id = escaped(&node.id);
        let parent = node.parent.map(|at| document.nodes[at].id.as_str());
        let parent = escaped(parent.unwrap_or(innermodel_language::model::ROOT));
        self.out
            .push_str(&format!("  <joint name=\"{id}\" type=\"{form}\">\n"));
        self.out.push_str(&format!(
            "    <parent link=\"{parent}\"/>\n    <child link=\"{id}\"/>\n"
        ));
        self.origin("    ", &here.changed(&TO_URDF, METRE.recip()));
        if let Some(axis) = axis {
            self.out
                .push_str(&format!("    <axis xyz=\"{}\"/>\n", numbers(axis)));
            let has_speed = max_speed > 0.0;
            let velocity = if has_speed { max_speed } else { VELOCITY };
            let mut limit = format!("effort=\"{EFFORT}\" velocity=\"{velocity}\"");
            if form != "continuous" {
                if !(limits.0.is_finite() && limits.1.is_finite()) {
                    self.misses(
                        node,
                        "joints with one limit or without limits along an axis",
                    );
                }
                let (lower, upper) = (limits.0.max(-FAR), limits.1.min(FAR));
                limit = format!("lower=\"{lower}\" upper=\"{upper}\" {limit}");
            }
            self.out.push_str(&if has_speed {
                format!("    <limit {limit}/>\n")
            } else {
                format!("    <limit {limit}><!--{NO_SPEED}--></limit>\n")
            });
        }
        self.out.push_str("  </joint>\n");
    }

    fn body(&mut self, node: &Node) {
        let here = place(&node.pose);
        let (geometry, there, texture) = match &node.kind {
            Kind::Plane(plane) => (
                cuboid(plane),
                here.then_inner(&board(plane)),
                &plane.texture,
            ),
            Kind::Display(display) => {
                self.misses(node, "displays");
                let plane = &display.plane;
                (
                    cuboid(plane),
                    here.then_inner(&board(plane)),
                    &plane.texture,
                )
            }
            Kind::Solid(solid) => {
                let geometry = match solid.shape {
                    Shape::Sphere { radius } => format!("<sphere radius=\"{}\"/>", radius / METRE),
                    Shape::Cylinder { radius, length } => {
                        let (radius, length) = (radius / METRE, length / METRE);
                        format!("<cylinder radius=\"{radius}\" length=\"{length}\"/>")
                    }
                    Shape::Cone { .. } => return self.misses(node, "cones"),
                };
                (geometry, here, &solid.texture)
            }
            Kind::Mesh(mesh) => {
                let path = mesh.path.as_deref().map(|path| path.display().to_string());
                let file = path.map_or_else(|| mesh.file.clone(), |path| format!("file://{path}"));
                let (file, scale) = (escaped(&file), numbers(mesh.scale.map(|n| n / METRE)));
                let geometry = format!("<mesh filename=\"{file}\" scale=\"{scale}\"/>");
                let there = here.changed(&TO_URDF, METRE.recip());
                // The file has its own axes: a rotation, since both change the hand.
                let axes = product(&TO_URDF, &OF_MESH);
                let there = Placement {
                    rotation: product(&there.rotation, &axes),
                    ..there
                };
                return self.visual(node, &geometry, &there, "", mesh.collide);
            }
            Kind::Axes(_) => return self.misses(node, "axes"),
            _ => return,
        };
        let there = there.changed(&TO_URDF, METRE.recip());
        self.visual(node, &geometry, &there, texture, node.kind.collides());
    }

    fn visual(
        &mut self,
        node: &Node,
        geometry: &str,
        there: &Placement,
        texture: &str,
        collides: bool,
    ) {
        let id = escaped(&node.id);
        let tags = [("visual", true), ("collision", collides)];
        for (tag, _) in tags.into_iter().filter(|(_, wanted)| *wanted) {
            self.out.push_str(&format!("    <{tag} name=\"{id}\">\n"));
            self.origin("      ", there);
            self.out
                .push_str(&format!("      <geometry>{geometry}</geometry>\n"));
            if tag == "visual"
                && let Some([red, green, blue]) = colour(texture)
            {
                let rgba = format!("<color rgba=\"{red} {green} {blue} 1\"/>");
                self.out.push_str(&format!(
                    "      <material name=\"{id}\">{rgba}</material>\n"
                ));
            }
            self.out.push_str(&format!("    </{tag}>\n"));
        }
        if !texture.is_empty() && colour(texture).is_none() {
            self.misses(node, "pictures on bodies");
        }
    }
}

fn cuboid(plane: &Plane) -> String {
    // Width, height and depth lie along y, z and x.
    let [x, y, z] = plane.size.map(|n| n.abs() / METRE);
    format!("<box size=\"{z} {x} {y}\"/>")
}

/// The parts of a colour `#rrggbb`, from 0 to 1.
fn colour(texture: &str) -> Option<[f64; 3]> {
    let digits = texture
        .strip_prefix('#')
        .filter(|digits| digits.len() == 6)?;
    let [_, red, green, blue] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
    Some([red, green, blue].map(|part| f64::from(part) / 255.0))
}
