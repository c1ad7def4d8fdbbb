//! glTF 2.0, as `.gltf` with its buffers and as `.glb`: the triangles of the scene, with the
//! transforms of their nodes, and with `Looks` their base colours. The buffers are files beside it,
//! or inside as base64.

mod materials;

use crate::looks::Looks;
use crate::{MeshError, TriangleMesh};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;
use std::borrow::Cow;
use std::path::Path;

/// Values of `mode`: how the corners of a primitive form triangles.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;
/// How deep nodes may be nested.
const MAX_DEPTH: usize = 64;
/// How many triangles a scene may have, with all that it repeats.
const MAX_TRIANGLES: usize = 50_000_000;
/// How many nodes a scene may have; one that is the child of several counts for each.
const MAX_NODES: usize = 1_000_000;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
struct Root {
    scene: usize,
    scenes: Vec<Scene>,
    nodes: Vec<Node>,
    meshes: Vec<Mesh>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    buffers: Vec<Buffer>,
    #[serde(flatten)]
    look: materials::Tables,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Scene {
    nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Node {
    children: Vec<usize>,
    mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: Option<usize>,
    material: Option<usize>,
    mode: Option<u32>,
}

#[derive(Deserialize)]
struct Attributes {
    #[serde(rename = "POSITION")]
    position: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    first_places: Option<usize>,
    #[serde(rename = "TEXCOORD_1")]
    second_places: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    #[serde(default)]
    normalized: bool,
    count: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

/// The first three rows of a matrix.
type Matrix = [[f64; 4]; 3];

/// Reads the triangles. `looks` gets how they look.
pub(crate) fn read(
    bytes: &[u8],
    folder: &Path,
    looks: Option<&mut Looks>,
) -> Result<TriangleMesh, MeshError> {
    let (json, binary) = parts(bytes)?;
    let root: Root = serde_json::from_slice(json).map_err(|e| wrong(&e.to_string()))?;
    let mut buffers = Vec::new();
    let mut left = crate::LARGEST;
    for buffer in &root.buffers {
        let bytes = match &buffer.uri {
            None => Cow::Borrowed(binary.ok_or_else(|| wrong("a buffer has no file"))?),
            Some(uri) => Cow::Owned(match base64(uri)? {
                Some(bytes) => bytes,
                None => crate::bytes_up_to(&folder.join(decoded(uri)), left).map_err(total)?,
            }),
        };
        // A file may be named many times: all together are as large as one may be.
        if matches!(bytes, Cow::Owned(_)) {
            let size = bytes.len() as u64;
            left = left
                .checked_sub(size)
                .ok_or(MeshError::TooLarge(crate::LARGEST >> 20))?;
        }
        buffers.push(bytes);
    }
    let mut reader = Reader {
        root: &root,
        buffers,
        mesh: TriangleMesh::default(),
        looks,
        visited: 0,
    };
    reader.materials(folder);
    let identity = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];
    let scene = root
        .scenes
        .get(root.scene)
        .ok_or_else(|| wrong("there is no scene"))?;
    for node in &scene.nodes {
        reader.node(*node, &identity, 0)?;
    }
    Ok(reader.mesh)
}

/// A limit of what is left is one of all files.
fn total(error: MeshError) -> MeshError {
    match error {
        MeshError::TooLarge(_) => MeshError::TooLarge(crate::LARGEST >> 20),
        other => other,
    }
}

/// The bytes that a URI contains. `None` if it names a file.
fn base64(uri: &str) -> Result<Option<Vec<u8>>, MeshError> {
    let text = uri
        .strip_prefix("data:")
        .and_then(|rest| rest.split_once(";base64,"));
    let bytes = text.map(|(_, text)| STANDARD.decode(text));
    bytes.transpose().map_err(|e| wrong(&e.to_string()))
}

/// The name of a file in a URI, in which `%20` is a blank.
fn decoded(uri: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let digits = after.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        let code = digits.filter(|_| *first == b'%');
        let code = code.and_then(|two| u8::from_str_radix(two, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn wrong(what: &str) -> MeshError {
    MeshError::Wrong(what.to_owned())
}

/// The JSON of a file, and the bytes that follow it in a `.glb`.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), MeshError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let cut = || wrong("the file is cut");
    let chunk = |at: usize| {
        let length = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        let length = u32::from_le_bytes(length?) as usize;
        bytes.get(at + 8..at + 8 + length)
    };
    let json = chunk(12).ok_or_else(cut)?;
    Ok((json, chunk(20 + json.len().next_multiple_of(4))))
}

struct Reader<'r> {
    root: &'r Root,
    buffers: Vec<Cow<'r, [u8]>>,
    mesh: TriangleMesh,
    looks: Option<&'r mut Looks>,
    visited: usize,
}

impl Reader<'_> {
    fn node(&mut self, at: usize, above: &Matrix, depth: usize) -> Result<(), MeshError> {
        let node = self
            .root
            .nodes
            .get(at)
            .ok_or_else(|| wrong("a node is missing"))?;
        if depth == MAX_DEPTH {
            return Err(wrong("nodes are nested more than 64 deep"));
        }
        self.visited += 1;
        if self.visited > MAX_NODES {
            return Err(wrong("the scene has more than a million nodes"));
        }
        let here = product(above, &local(node));
        if let Some(mesh) = node.mesh {
            let mesh = self
                .root
                .meshes
                .get(mesh)
                .ok_or_else(|| wrong("a mesh is missing"))?;
            self.visited += mesh.primitives.len();
            if self.visited > MAX_NODES {
                return Err(wrong(
                    "the scene has more than a million nodes and primitives",
                ));
            }
            for primitive in &mesh.primitives {
                self.primitive(primitive, &here)?;
            }
        }
        for child in &node.children {
            self.node(*child, &here, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, to: &Matrix) -> Result<(), MeshError> {
        let Some(position) = primitive.attributes.position else {
            return Ok(());
        };
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if !(TRIANGLES..=FAN).contains(&mode) {
            return Ok(());
        }
        // Before anything is read: strips and fans have three times as many corners as indices.
        let elements = self
            .root
            .accessors
            .get(primitive.indices.unwrap_or(position));
        let elements = elements.ok_or_else(|| wrong("data of a mesh are missing"))?;
        let count = match mode {
            TRIANGLES => elements.count / 3,
            _ => elements.count.saturating_sub(2),
        };
        if self.mesh.triangles.len().saturating_add(count) > MAX_TRIANGLES {
            return Err(wrong("the scene has more than 50 million triangles"));
        }
        let first = self.mesh.vertices.len() as u32;
        let numbers = self.numbers(position, 3)?;
        let vertices = numbers.chunks_exact(3).map(|p| {
            [0, 1, 2]
                .map(|row| to[row][0] * p[0] + to[row][1] * p[1] + to[row][2] * p[2] + to[row][3])
        });
        self.mesh.vertices.extend(vertices);
        if self.mesh.vertices.len() > 3 * MAX_TRIANGLES {
            return Err(wrong("the scene has more than 150 million vertices"));
        }
        let count = self.mesh.vertices.len() as u32 - first;
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => self
                .numbers(indices, 1)?
                .iter()
                .map(|n| *n as u32)
                .collect(),
            None => (0..count).collect(),
        };
        if corners.iter().any(|corner| *corner >= count) {
            return Err(wrong("a triangle has a corner that is not there"));
        }
        let corners = triangles(corners, mode);
        let triangles = corners.chunks_exact(3);
        let triangles = triangles.map(|three| [0, 1, 2].map(|n| first + three[n]));
        self.mesh.triangles.extend(triangles);
        self.paint(primitive, &corners)
    }

    /// The numbers of an accessor, `width` in each element.
    fn numbers(&self, at: usize, width: usize) -> Result<Vec<f64>, MeshError> {
        let missing = || wrong("data of a mesh are missing");
        let accessor = self.root.accessors.get(at).ok_or_else(missing)?;
        if accessor.count > 3 * MAX_TRIANGLES {
            return Err(wrong("an accessor has more than 150 million elements"));
        }
        let view = accessor
            .buffer_view
            .and_then(|view| self.root.buffer_views.get(view));
        let view = view.ok_or_else(missing)?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(missing)?;
        let end = view
            .byte_offset
            .checked_add(view.byte_length)
            .ok_or_else(missing)?;
        let bytes = buffer.get(view.byte_offset..end).ok_or_else(missing)?;
        let size = match accessor.component_type {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            5125 | 5126 => 4,
            other => return Err(wrong(&format!("{other} is no type of numbers"))),
        };
        let stride = view.byte_stride.unwrap_or(size * width).max(1);
        let mut numbers = Vec::new();
        for element in 0..accessor.count {
            for number in 0..width {
                let place = element
                    .checked_mul(stride)
                    .and_then(|at| at.checked_add(accessor.byte_offset))
                    .and_then(|at| at.checked_add(number * size))
                    .ok_or_else(missing)?;
                let end = place.checked_add(size).ok_or_else(missing)?;
                let bytes = bytes.get(place..end).ok_or_else(missing)?;
                let number = value(bytes, accessor.component_type);
                numbers.push(if accessor.normalized {
                    number / greatest(accessor.component_type)
                } else {
                    number
                });
            }
        }
        Ok(numbers)
    }
}

/// The corners of triangles, three for each one. In a strip, each corner makes a triangle with the
/// two before it, of which every second one is turned; in a fan, with the one before and the first.
fn triangles(corners: Vec<u32>, mode: u32) -> Vec<u32> {
    let of_last = |number: usize, three: &[u32]| match mode {
        STRIP if number % 2 == 1 => [three[0], three[2], three[1]],
        FAN => [corners[0], three[1], three[2]],
        _ => [three[0], three[1], three[2]],
    };
    if mode == TRIANGLES {
        return corners;
    }
    let windows = corners.windows(3).enumerate();
    windows
        .flat_map(|(number, three)| of_last(number, three))
        .collect()
}

fn value(bytes: &[u8], form: u32) -> f64 {
    let mut four = [0; 4];
    four[..bytes.len()].copy_from_slice(bytes);
    let whole = u32::from_le_bytes(four);
    match form {
        5126 => f64::from(f32::from_bits(whole)),
        5120 => f64::from(bytes[0] as i8),
        5122 => f64::from(whole as u16 as i16),
        _ => f64::from(whole),
    }
}

/// The number that means 1 in a normalized accessor.
fn greatest(form: u32) -> f64 {
    match form {
        5120 => f64::from(i8::MAX),
        5121 => f64::from(u8::MAX),
        5122 => f64::from(i16::MAX),
        5123 => f64::from(u16::MAX),
        5125 => f64::from(u32::MAX),
        _ => 1.0,
    }
}

fn local(node: &Node) -> Matrix {
    if let Some(columns) = node.matrix {
        return [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| columns[column * 4 + row]));
    }
    let moved = node.translation.unwrap_or_default();
    let scale = node.scale.unwrap_or([1.0; 3]);
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let turn = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    [0, 1, 2].map(|row| {
        let [right, up, back] = turn[row];
        [right * scale[0], up * scale[1], back * scale[2], moved[row]]
    })
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|row| {
        [0, 1, 2, 3].map(|column| {
            let inner: f64 = (0..3).map(|n| a[row][n] * b[n][column]).sum();
            inner + if column == 3 { a[row][3] } else { 0.0 }
        })
    })
}
