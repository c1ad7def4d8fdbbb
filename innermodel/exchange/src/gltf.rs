//! From a document to a scene of glTF 2.0, as one file (`.glb`).

use crate::matrix::{Matrix, OF_MESH, Placement, TO_GLTF, apply, product};
use crate::shapes::{board, place, solid};
use innermodel_language::model::{Camera, Document, Kind, Node};
use innermodel_mesh::{AlphaMode, Looks, TriangleMesh};
use rc_diagnostics::{Diagnostic, Diagnostics};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Triangles by their textures: files, or colours as `#rrggbb`, followed by the opacity for
/// transparent bodies.
type Parts = BTreeMap<String, Vec<[u32; 3]>>;

/// Takes millimetres to metres.
const METRE: f64 = 0.001;
/// Numbers of `accessor.componentType` and `bufferView.target`.
const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The program, as the files name it.
const GENERATOR: &str = "rcgen";

/// Whether [`write()`] made a file.
pub fn is_exported(file: &[u8]) -> bool {
    let read = || {
        let length: [u8; 4] = file.get(12..16)?.try_into().ok()?;
        let end = 20_usize.checked_add(u32::from_le_bytes(length) as usize)?;
        let root: Value = serde_json::from_slice(file.get(20..end)?).ok()?;
        Some(root["asset"]["generator"] == GENERATOR)
    };
    file.starts_with(b"glTF") && read().unwrap_or(false)
}

/// The scene of a document: a node for each of its nodes, with its name. Findings list what does
/// not fit, and unreadable meshes.
pub fn write(document: &Document) -> (Vec<u8>, Diagnostics) {
    let mut writer = Writer::default();
    for node in &document.nodes {
        writer.node(node);
    }
    let mut tops = Vec::new();
    for (at, node) in document.nodes.iter().enumerate() {
        match node.parent {
            None => tops.push(at),
            Some(parent) => {
                let above = &mut writer.nodes[parent];
                if above["children"].is_null() {
                    above["children"] = json!([]);
                }
                if let Value::Array(children) = &mut above["children"] {
                    children.push(json!(at));
                }
            }
        }
    }
    let mut root = json!({
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": tops}],
        "nodes": writer.nodes,
    });
    let lists = [
        ("meshes", writer.meshes),
        ("materials", writer.materials),
        ("cameras", writer.cameras),
        ("accessors", writer.accessors),
        ("bufferViews", writer.views),
    ];
    // An empty list is not allowed.
    for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
        root[name] = Value::Array(list);
    }
    if !writer.bytes.is_empty() {
        root["buffers"] = json!([{"byteLength": writer.bytes.len()}]);
    }
    (binary(&root, writer.bytes), writer.found)
}

/// The header and the two chunks of a `.glb`.
fn binary(root: &Value, mut bytes: Vec<u8>) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut chunks = vec![(b"JSON", text)];
    if !bytes.is_empty() {
        chunks.push((b"BIN\0", bytes));
    }
    let length = 12
        + chunks
            .iter()
            .map(|(_, bytes)| 8 + bytes.len())
            .sum::<usize>();
    let mut file = b"glTF".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend((length as u32).to_le_bytes());
    for (form, bytes) in chunks {
        file.extend((bytes.len() as u32).to_le_bytes());
        file.extend(form);
        file.extend(bytes);
    }
    file
}

#[derive(Default)]
struct Writer {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    /// The texts of the materials.
    colours: Vec<String>,
    cameras: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    bytes: Vec<u8>,
    found: Diagnostics,
}

impl Writer {
    fn misses(&mut self, node: &Node, what: &str) {
        let message = format!("glTF has no {what}: `{}` loses them", node.id);
        self.found
            .push(Diagnostic::warning("lost-on-export", node.span, message));
    }

    /// Adds a node with its body.
    fn node(&mut self, node: &Node) {
        let mut here = place(&node.pose);
        if let Kind::Prismatic(joint) = &node.kind {
            here.translation[joint.axis.index()] += joint.position + joint.offset;
        }
        let mut out = json!({"name": node.id});
        if let Kind::Camera(camera) = &node.kind {
            self.camera(node, &camera.camera, &mut here, &mut out);
        } else if let Kind::Rgbd(rgbd) = &node.kind {
            self.camera(node, &rgbd.camera, &mut here, &mut out);
        } else {
            let mesh = self.body(node);
            if let Some(mesh) = mesh {
                out["mesh"] = json!(mesh);
            }
        }
        let there = here.changed(&TO_GLTF, METRE);
        if there != Placement::HERE {
            let (r, t) = (there.rotation, there.translation);
            // Column by column.
            out["matrix"] = json!([
                r[0][0], r[1][0], r[2][0], 0.0, r[0][1], r[1][1], r[2][1], 0.0, r[0][2], r[1][2],
                r[2][2], 0.0, t[0], t[1], t[2], 1.0
            ]);
        }
        self.nodes.push(out);
    }

    fn camera(&mut self, node: &Node, camera: &Camera, here: &mut Placement, out: &mut Value) {
        let (width, height, focal) = (camera.width, camera.height, camera.focal);
        if !(width > 0.0 && height > 0.0 && focal > 0.0) {
            return self.misses(node, "cameras without pixels");
        }
        // A camera of glTF looks along −z: half a turn about y.
        let turn: Matrix = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
        here.rotation = product(&here.rotation, &turn);
        out["camera"] = json!(self.cameras.len());
        let angle = 2.0 * (height / 2.0 / focal).atan();
        self.cameras.push(json!({
            "type": "perspective",
            "perspective": {"yfov": angle, "aspectRatio": width / height, "znear": 0.01},
        }));
    }

    /// The mesh of a node, if it has a body.
    fn body(&mut self, node: &Node) -> Option<usize> {
        let of_one = |mesh: TriangleMesh, inner: Placement, texture: &str| {
            let parts = BTreeMap::from([(texture.to_owned(), mesh.triangles)]);
            (mesh.vertices, inner, parts)
        };
        let (vertices, inner, parts) = match &node.kind {
            Kind::Plane(plane) => of_one(
                TriangleMesh::cuboid(plane.size),
                board(plane),
                &plane.texture,
            ),
            Kind::Display(display) => {
                let plane = &display.plane;
                of_one(
                    TriangleMesh::cuboid(plane.size),
                    board(plane),
                    &plane.texture,
                )
            }
            Kind::Solid(body) => of_one(solid(body.shape), Placement::HERE, &body.texture),
            Kind::Mesh(mesh) => {
                // A file that was not found has a warning already.
                let path = mesh.path.as_ref()?;
                match innermodel_mesh::read_with_looks(path) {
                    Ok((mut read, looks)) => {
                        for vertex in &mut read.vertices {
                            let scaled = [0, 1, 2].map(|n| vertex[n] * mesh.scale[n]);
                            *vertex = apply(&OF_MESH, &scaled);
                        }
                        let is_mirrored = mesh.scale.iter().product::<f64>() < 0.0;
                        if !is_mirrored {
                            // The axes of the file have the other hand.
                            read.triangles
                                .iter_mut()
                                .for_each(|corners| corners.swap(1, 2));
                        }
                        (
                            read.vertices,
                            Placement::HERE,
                            by_colour(read.triangles, &looks),
                        )
                    }
                    Err(error) => {
                        let message = format!("{}: {error}", path.display());
                        self.found
                            .push(Diagnostic::warning("missing-mesh", node.span, message));
                        return None;
                    }
                }
            }
            Kind::Axes(_) => {
                self.misses(node, "axes");
                return None;
            }
            Kind::Laser(_)
            | Kind::Lidar(_)
            | Kind::Ultrasound(_)
            | Kind::Imu(_)
            | Kind::TouchSensor(_) => {
                self.misses(node, "words for the values of sensors");
                return None;
            }
            Kind::Joint(_) | Kind::Prismatic(_) => {
                self.misses(node, "joints");
                return None;
            }
            _ => return None,
        };
        let mesh = self.mesh(&vertices, &inner, &parts);
        if mesh.is_none() {
            let message = format!(
                "glTF cannot hold such large coordinates: `{}` has no body in the file",
                node.id
            );
            let finding = Diagnostic::warning("lost-on-export", node.span, message);
            self.found.push(finding);
        }
        mesh
    }

    /// Adds a mesh of which each triangle turns to the left, seen from outside, in `InnerModel`.
    /// There is none if a number is too great.
    fn mesh(&mut self, vertices: &[[f64; 3]], inner: &Placement, parts: &Parts) -> Option<usize> {
        let axes = TO_GLTF;
        let vertices = vertices.iter().map(|vertex| {
            let turned = apply(&inner.rotation, vertex);
            let moved = [0, 1, 2].map(|n| (turned[n] + inner.translation[n]) * METRE);
            apply(&axes, &moved).map(|n| n as f32)
        });
        let vertices: Vec<[f32; 3]> = vertices.collect();
        if vertices.iter().flatten().any(|number| !number.is_finite()) {
            return None;
        }
        let bounds = |pick: fn(f32, f32) -> f32, start: f32| {
            [0, 1, 2].map(|n| vertices.iter().map(|v| v[n]).fold(start, pick))
        };
        let (min, max) = (
            bounds(f32::min, f32::INFINITY),
            bounds(f32::max, f32::NEG_INFINITY),
        );
        let start = self.bytes.len();
        for number in vertices.iter().flatten() {
            self.bytes.extend(number.to_le_bytes());
        }
        let positions = self.accessors.len();
        let view = self.view(start, VERTICES);
        self.accessors.push(json!({
            "bufferView": view, "componentType": FLOAT, "count": vertices.len(), "type": "VEC3",
            "min": min, "max": max,
        }));
        let mut primitives = Vec::new();
        for (texture, triangles) in parts {
            let start = self.bytes.len();
            for [a, b, c] in triangles {
                // The axes of glTF have the other hand.
                for corner in [a, c, b] {
                    self.bytes.extend(corner.to_le_bytes());
                }
            }
            let view = self.view(start, INDICES);
            let indices = self.accessors.len();
            self.accessors.push(json!({
                "bufferView": view, "componentType": UNSIGNED, "count": 3 * triangles.len(),
                "type": "SCALAR",
            }));
            let material = self.material(texture);
            primitives.push(json!({
                "attributes": {"POSITION": positions}, "indices": indices, "material": material,
            }));
        }
        self.meshes.push(json!({"primitives": primitives}));
        Some(self.meshes.len() - 1)
    }

    /// Adds a view of the bytes from `start` on.
    fn view(&mut self, start: usize, target: u32) -> usize {
        let length = self.bytes.len() - start;
        self.views.push(json!({
            "buffer": 0, "byteOffset": start, "byteLength": length, "target": target,
        }));
        self.views.len() - 1
    }

    fn material(&mut self, texture: &str) -> usize {
        if let Some(known) = self.colours.iter().position(|known| known == texture) {
            return known;
        }
        let digits = texture.strip_prefix('#').unwrap_or_default();
        let (digits, alpha) = digits.split_at_checked(6).unwrap_or_default();
        let number = u32::from_str_radix(digits, 16).ok();
        let [_, red, green, blue] = number.unwrap_or(0x00b4_b4b4).to_be_bytes();
        let alpha = u8::from_str_radix(alpha, 16).ok();
        // Colours of glTF are linear.
        let [red, green, blue] = [red, green, blue].map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        });
        let opacity = alpha.map_or(1.0, |alpha| f64::from(alpha) / 255.0);
        let mut material = json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [red, green, blue, opacity], "metallicFactor": 0.0,
            },
            "doubleSided": true,
        });
        if alpha.is_some() {
            material["alphaMode"] = json!("BLEND");
        }
        self.materials.push(material);
        self.colours.push(texture.to_owned());
        self.colours.len() - 1
    }
}

/// The triangles of a mesh by the colours of their materials.
fn by_colour(triangles: Vec<[u32; 3]>, looks: &Looks) -> Parts {
    let mut parts = Parts::new();
    for (number, triangle) in triangles.into_iter().enumerate() {
        let material = looks.triangles.get(number).and_then(|look| look.material);
        let material = material.and_then(|at| looks.materials.get(at as usize));
        let texture = material.map_or(String::new(), |material| {
            let [red, green, blue] = material.colour;
            let alpha = (material.alpha * 255.0).round() as u8;
            match material.alpha_mode {
                AlphaMode::Blend => format!("#{red:02x}{green:02x}{blue:02x}{alpha:02x}"),
                _ => format!("#{red:02x}{green:02x}{blue:02x}"),
            }
        });
        parts.entry(texture).or_default().push(triangle);
    }
    parts
}
