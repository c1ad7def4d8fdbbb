//! The bodies of a link: its `visual` and `collision` elements.

use super::{Reader, pose};
use crate::matrix::{OF_MESH, Placement, TO_URDF, Vector, product, transposed};
use innermodel_language::Pose;
use innermodel_language::model::{Kind, Mesh, Node, Plane, Render, Shape, Solid, Transform};
use rc_urdf::child;
use roxmltree::Node as Xml;

/// A body of a link.
struct Body {
    name: String,
    place: Placement,
    kind: Kind,
}
impl Reader<'_> {
    /// The bodies and the mass of a link.
    pub(super) fn link(&mut self, xml: Xml<'_, '_>, name: &str, node: Option<usize>) {
        if let Some(inertial) = child(xml, "inertial") {
            let mass = child(inertial, "mass").map(|mass| self.urdf.number(mass, "value", 0.0));
            let kind = node.map(|at| &mut self.document.nodes[at].kind);
            match (kind, mass) {
                (Some(Kind::Transform(transform)), Some(mass)) => transform.mass = mass,
                (_, Some(mass)) if mass != 0.0 => {
                    let message = format!("only a transform has a mass: `{name}` loses it");
                    self.misses(self.urdf.text.tag(inertial), message);
                }
                _ => {}
            }
            let inertia = child(inertial, "inertia");
            let parts = inertia.iter().flat_map(Xml::attributes);
            if parts
                .into_iter()
                .any(|part| part.value().trim().parse() != Ok(0.0))
            {
                let message = format!("InnerModel has no moments of inertia: `{name}` loses them");
                self.misses(self.urdf.text.tag(inertial), message);
            }
        }
        let all = |tag: &str| -> Vec<Xml<'_, '_>> {
            xml.children()
                .filter(|child| child.has_tag_name(tag))
                .collect()
        };
        let mut bodies: Vec<Body> = Vec::new();
        for visual in all("visual") {
            bodies.extend(self.body(visual, name));
        }
        for collision in all("collision") {
            let Some(body) = self.body(collision, name) else {
                continue;
            };
            let is_same = |seen: &&mut Body| {
                seen.place == body.place && shape(&seen.kind) == shape(&body.kind)
            };
            if let Some(same) = bodies.iter_mut().find(is_same) {
                set_collides(&mut same.kind);
                continue;
            }
            let message = format!("a body of `{name}` that collides is drawn, too");
            self.misses(self.urdf.text.tag(collision), message);
            let mut body = body;
            set_collides(&mut body.kind);
            bodies.push(body);
        }
        for body in bodies {
            self.add_body(body, node);
        }
    }

    fn add_body(&mut self, body: Body, parent: Option<usize>) {
        let id = self.fresh(&body.name);
        let mut node = Node {
            parent,
            pose: pose(&body.place),
            ..Node::new(&id, body.kind)
        };
        if !node.kind.has_pose() && node.pose != Pose::default() {
            // A plane has no pose of its own.
            let place = self.fresh(&format!("{id}_pose"));
            let above = self.push(Node {
                parent,
                pose: node.pose,
                ..Node::new(&place, Kind::Transform(Transform::default()))
            });
            (node.parent, node.pose) = (Some(above), Pose::default());
        }
        self.push(node);
    }

    /// The body of a `visual` or a `collision`.
    fn body(&mut self, xml: Xml<'_, '_>, link: &str) -> Option<Body> {
        let here = self.origin(xml);
        let geometry = child(xml, "geometry");
        let shape = geometry.and_then(|geometry| geometry.children().find(Xml::is_element));
        let Some(geometry) = shape else {
            let tag = self.urdf.text.tag(xml);
            let message = format!("`<{}>` has no geometry", self.urdf.text.slice(tag));
            self.urdf.error("missing-attribute", tag, message);
            return None;
        };
        let material = child(xml, "material");
        let texture = material.and_then(|material| {
            let own = self.colour(material);
            let name = self.urdf.text.attribute(material, "name");
            own.or_else(|| self.colours.get(&name?.text).cloned())
        });
        let texture = texture.unwrap_or_default();
        let solid = |shape: Shape| {
            Kind::Solid(Solid {
                shape,
                texture: texture.clone(),
                collide: false,
            })
        };
        let mut there = here;
        let kind = match geometry.tag_name().name() {
            "box" => {
                let [x, y, z] = self.sizes(geometry, "size", |n| n >= 0.0, "cannot be negative")?;
                Kind::Plane(Plane {
                    texture: texture.clone(),
                    picture: None,
                    size: [y, z, x],
                    repeat: 1,
                    normal: [0.0, 0.0, -1.0],
                    point: [0.0; 3],
                    collide: false,
                })
            }
            "sphere" => solid(Shape::Sphere {
                radius: self.size(geometry, "radius")?,
            }),
            "cylinder" => solid(Shape::Cylinder {
                radius: self.size(geometry, "radius")?,
                length: self.size(geometry, "length")?,
            }),
            "mesh" => {
                let file = self.urdf.attribute(geometry, "filename")?;
                let scale = self.lengths(geometry, "scale", [1.0; 3]);
                // The file has its own axes: a rotation, since both change the hand.
                let axes = product(&transposed(&TO_URDF), &OF_MESH);
                there.rotation = product(&there.rotation, &axes);
                Kind::Mesh(Mesh {
                    file: path(&file.text).to_owned(),
                    path: None,
                    scale,
                    render: Render::Normal,
                    collide: false,
                })
            }
            other => {
                let message = format!("InnerModel has no words for the shape `<{other}>`");
                self.misses(self.urdf.text.tag(geometry), message);
                return None;
            }
        };
        let name = self.urdf.text.attribute(xml, "name").map(|name| name.text);
        let name = name.filter(|name| !name.is_empty());
        Some(Body {
            name: name.unwrap_or_else(|| format!("{link}_body")),
            place: there,
            kind,
        })
    }

    /// Lengths in millimetres, which have to be there and to meet a condition.
    fn sizes<const N: usize>(
        &mut self,
        xml: Xml<'_, '_>,
        name: &str,
        is_right: fn(f64) -> bool,
        rule: &str,
    ) -> Option<[f64; N]> {
        let value = self.urdf.attribute(xml, name)?;
        let sizes = self.lengths(xml, name, [1.0; N]);
        if sizes.iter().all(|size| is_right(*size)) {
            return Some(sizes);
        }
        let message = format!("`{name}` {rule}, found `{}`", value.text);
        self.urdf.error("bad-value", value.span, message);
        None
    }

    /// A length in millimetres, which has to be there and greater than 0.
    fn size(&mut self, xml: Xml<'_, '_>, name: &str) -> Option<f64> {
        let [size] = self.sizes(xml, name, |n| n > 0.0, "must be greater than 0")?;
        Some(size)
    }

    /// The colour of a material as `#rrggbb`.
    pub(super) fn colour(&mut self, material: Xml<'_, '_>) -> Option<String> {
        if let Some(texture) = child(material, "texture") {
            let message = "pictures on bodies of URDF are not imported".to_owned();
            self.misses(self.urdf.text.tag(texture), message);
        }
        let colour = child(material, "color")?;
        let [red, green, blue, _] = self.urdf.numbers(colour, "rgba", [0.7, 0.7, 0.7, 1.0]);
        let [red, green, blue] =
            [red, green, blue].map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
        Some(format!("#{red:02x}{green:02x}{blue:02x}"))
    }
}

/// The file of a mesh, without the scheme and the package: it is looked for by its base name.
fn path(written: &str) -> &str {
    if let Some(path) = written.strip_prefix("file://") {
        return path;
    }
    let package = written.strip_prefix("package://");
    package.map_or(written, |rest| {
        rest.split_once('/').map_or(rest, |(_, path)| path)
    })
}

/// Shape and size of a body, whatever its colour.
fn shape(kind: &Kind) -> Option<(String, Vector)> {
    match kind {
        Kind::Plane(plane) => Some((String::new(), plane.size)),
        Kind::Mesh(mesh) => Some((mesh.file.clone(), mesh.scale)),
        Kind::Solid(solid) => Some(match solid.shape {
            Shape::Sphere { radius } => ("sphere".to_owned(), [radius, 0.0, 0.0]),
            Shape::Cylinder { radius, length } => ("cylinder".to_owned(), [radius, length, 0.0]),
            Shape::Cone { radius, length } => ("cone".to_owned(), [radius, length, 0.0]),
        }),
        _ => None,
    }
}

fn set_collides(kind: &mut Kind) {
    match kind {
        Kind::Plane(plane) => plane.collide = true,
        Kind::Mesh(mesh) => mesh.collide = true,
        Kind::Solid(solid) => solid.collide = true,
        _ => {}
    }
}
