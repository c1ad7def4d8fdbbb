//! From a document to a scene of glTF 2.0, as one file (`.glb`).

use crate::matrix::{Matrix, OF_MESH, Place, TO_GLTF, apply, product};
use crate::shapes::{board, cuboid, place, solid};
use innermodel_language::model::{Camera, Document, Kind, Node};
use innermodel_mesh::TriangleMesh;
use rc_diagnostics::{Diagnostic, Diagnostics};
use serde_json::{Value, json};

/// Takes millimetres to metres.
const METRE: f64 = 0.001;
/// Numbers of `accessor.componentType` and `bufferView.target`.
const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The program, as the files name it.
const GENERATOR: &str = "rcgen";

/// Whether [`write`] made a file.
pub fn is_exported(file: &[u8]) -> bool {
    let read = || {
        let length: [u8; 4] = file.get(12..16)?.try_into().ok()?;
        let end = 20_usize.checked_add(u32::from_le_bytes(length) as usize)?;
        let root: Value = serde_json::from_slice(file.get(20..end)?).ok()?;
        Some(root["asset"]["generator"] == GENERATOR)
    };
    file.starts_with(b"glTF") && read().unwrap_or(false)
}

/// The scene of a document: a node for each of its nodes, with its name. Findings tell what does
/// not fit, and which meshes cannot be read.
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

    /// Adds a node with what it shows.
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
        if there != Place::HERE {
            let (r, t) = (there.rotation, there.translation);
            // Column by column.
            out["matrix"] = json!([
                r[0][0], r[1][0], r[2][0], 0.0, r[0][1], r[1][1], r[2][1], 0.0, r[0][2], r[1][2],
                r[2][2], 0.0, t[0], t[1], t[2], 1.0
            ]);
        }
        self.nodes.push(out);
    }

    fn camera(&mut self, node: &Node, camera: &Camera, here: &mut Place, out: &mut Value) {
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
        let (mesh, inner, texture) = match &node.kind {
            Kind::Plane(plane) => (cuboid(plane.size), board(plane), plane.texture.as_str()),
            Kind::Display(display) => {
                let plane = &display.plane;
                (cuboid(plane.size), board(plane), plane.texture.as_str())
            }
            Kind::Solid(body) => (solid(body.shape), Place::HERE, body.texture.as_str()),
            Kind::Mesh(mesh) => {
                // A file that was not found has a warning already.
                let path = mesh.path.as_ref()?;
                match innermodel_mesh::read(path) {
                    Ok(mut read) => {
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
                        (read, Place::HERE, "")
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
        Some(self.mesh(&mesh, &inner, texture))
    }

    /// Adds a mesh of which each triangle turns to the left, seen from outside, in `InnerModel`.
    fn mesh(&mut self, mesh: &TriangleMesh, inner: &Place, texture: &str) -> usize {
        let axes = TO_GLTF;
        let vertices = mesh.vertices.iter().map(|vertex| {
            let turned = apply(&inner.rotation, vertex);
            let moved = [0, 1, 2].map(|n| (turned[n] + inner.translation[n]) * METRE);
            apply(&axes, &moved).map(|n| n as f32)
        });
        let vertices: Vec<[f32; 3]> = vertices.collect();
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
        let middle = self.bytes.len();
        for [a, b, c] in &mesh.triangles {
            // The axes of glTF have the other hand.
            for corner in [a, c, b] {
                self.bytes.extend(corner.to_le_bytes());
            }
        }
        let view = self.views.len();
        for (from, to, target) in [
            (start, middle, VERTICES),
            (middle, self.bytes.len(), INDICES),
        ] {
            let (offset, length) = (from, to - from);
            self.views.push(json!({
                "buffer": 0, "byteOffset": offset, "byteLength": length, "target": target,
            }));
        }
        let accessor = self.accessors.len();
        self.accessors.push(json!({
            "bufferView": view, "componentType": FLOAT, "count": vertices.len(), "type": "VEC3",
            "min": min, "max": max,
        }));
        self.accessors.push(json!({
            "bufferView": view + 1, "componentType": UNSIGNED, "count": 3 * mesh.triangles.len(),
            "type": "SCALAR",
        }));
        let material = self.material(texture);
        self.meshes.push(json!({"primitives": [{
            "attributes": {"POSITION": accessor}, "indices": accessor + 1, "material": material,
        }]}));
        self.meshes.len() - 1
    }

    fn material(&mut self, texture: &str) -> usize {
        if let Some(known) = self.colours.iter().position(|known| known == texture) {
            return known;
        }
        let digits = texture.strip_prefix('#').filter(|digits| digits.len() == 6);
        let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let [_, red, green, blue] = number.unwrap_or(0x00b4_b4b4).to_be_bytes();
        // Colours of glTF are linear.
        let [red, green, blue] = [red, green, blue].map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        });
        self.materials.push(json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.0,
            },
            "doubleSided": true,
        }));
        self.colours.push(texture.to_owned());
        self.colours.len() - 1
    }
}
