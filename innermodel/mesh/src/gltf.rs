//! glTF 2.0, as `.gltf` with its buffers and as `.glb`: the triangles of the scene, with the
//! transforms of their nodes, and with `Looks` their base colours. Morph targets have the weights
//! of the file, skins the pose of their joints. The buffers are files next to it, or inside as
//! base64.

mod accessors;
mod materials;
mod skins;

use crate::looks::Looks;
use crate::{MeshError, TriangleMesh};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rc_diagnostics::foreign::clean;
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

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
    accessors: Vec<accessors::Accessor>,
    buffer_views: Vec<accessors::View>,
    buffers: Vec<Buffer>,
    skins: Vec<skins::Skin>,
    extensions_required: Vec<String>,
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
    skin: Option<usize>,
    weights: Option<Vec<f64>>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
    #[serde(default)]
    weights: Vec<f64>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: Option<usize>,
    material: Option<usize>,
    mode: Option<u32>,
    #[serde(default)]
    targets: Vec<Attributes>,
    #[serde(default)]
    extensions: HashMap<String, serde_json::Value>,
}

impl Primitive {
    /// Names the compression of data that are missing without it.
    fn missing(&self, error: MeshError) -> MeshError {
        let names = self.extensions.keys();
        let mut names = names.filter(|name| name.ends_with("_compression"));
        match names.next() {
            Some(name) => not_read(name),
            None => error,
        }
    }
}

/// The error of an extension without which a shape is another one.
fn not_read(extension: &str) -> MeshError {
    MeshError::Wrong(format!(
        "the shape needs the extension `{}`, which is not read; export the file without it",
        clean(extension)
    ))
}

/// Accessors by their names: `POSITION`, `TEXCOORD_0`.
type Attributes = HashMap<String, usize>;

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
    let root = root(json)?;
    let shape = root.extensions_required.iter();
    let mut shape = shape.filter(|name| !is_read(name) && !is_look(name));
    if let Some(name) = shape.next() {
        return Err(not_read(name));
    }
    let mut buffers = Vec::new();
    let mut left = crate::LARGEST;
    for buffer in &root.buffers {
        let bytes = match &buffer.uri {
            None => Cow::Borrowed(binary.ok_or_else(|| wrong("a buffer has no file"))?),
            Some(uri) => Cow::Owned(match inside(uri)? {
                Some(bytes) => bytes,
                None => crate::bytes_up_to(&folder.join(name_of(uri)), left).map_err(total)?,
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
        moved: 0,
        skins: HashMap::new(),
        parents: Vec::new(),
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

/// Whether a required extension is read.
fn is_read(name: &str) -> bool {
    name == "KHR_mesh_quantization"
}

/// Whether an extension only says how a mesh looks.
fn is_look(name: &str) -> bool {
    let families = [
        "KHR_materials_",
        "KHR_texture_",
        "KHR_lights_",
        "EXT_texture_",
        "EXT_lights_",
        "KHR_xmp",
    ];
    families.iter().any(|family| name.starts_with(family))
}

/// The tables of a file. Those of another version differ, so the version explains an error first.
fn root(json: &[u8]) -> Result<Root, MeshError> {
    #[derive(Deserialize)]
    struct Head {
        asset: Asset,
    }
    #[derive(Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Asset {
        version: String,
        min_version: Option<String>,
    }
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let head: Option<Head> = serde_json::from_slice(json).ok();
    let version = head.map(|head| head.asset.min_version.unwrap_or(head.asset.version));
    if let Some(version) = version.filter(|version| version.split('.').next() != Some("2")) {
        return Err(other_version(&clean(&version)));
    }
    serde_json::from_slice(json).map_err(|e| wrong(&e.to_string()))
}

fn other_version(version: &str) -> MeshError {
    MeshError::Wrong(format!("expected version 2.0 of glTF, found {version}"))
}

/// The limit of the rest is one of all files.
fn total(error: MeshError) -> MeshError {
    match error {
        MeshError::TooLarge(_) => MeshError::TooLarge(crate::LARGEST >> 20),
        other => other,
    }
}

/// The bytes that a URI contains. `None` if it names a file.
fn inside(uri: &str) -> Result<Option<Vec<u8>>, MeshError> {
    let Some((form, content)) = uri
        .strip_prefix("data:")
        .and_then(|uri| uri.split_once(','))
    else {
        return Ok(None);
    };
    if !form.ends_with(";base64") {
        return Ok(Some(decoded(content)));
    }
    let bytes = STANDARD.decode(content);
    bytes.map(Some).map_err(|e| wrong(&e.to_string()))
}

/// The name of a file in a URI.
fn name_of(uri: &str) -> String {
    String::from_utf8_lossy(&decoded(uri)).into_owned()
}

/// The bytes of a text in a URI, in which `%20` is a blank.
fn decoded(uri: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let digits = after.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        let code = digits.filter(|_| *first == b'%');
        let code = code.and_then(|two| u8::from_str_radix(two, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    bytes
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
    let number = |at: usize| {
        let four = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(four))
    };
    let version = number(4).ok_or_else(cut)?;
    if version != 2 {
        return Err(other_version(&version.to_string()));
    }
    if number(8).ok_or_else(cut)? as usize > bytes.len() {
        return Err(cut());
    }
    let chunk = |at: usize| {
        let length = number(at)? as usize;
        let form = bytes.get(at + 4..at + 8)?;
        Some((form, bytes.get(at + 8..at + 8 + length)?))
    };
    let (form, json) = chunk(12).ok_or_else(cut)?;
    if form != b"JSON" {
        return Err(wrong("the first chunk of the file is not JSON"));
    }
    let next = chunk(20 + json.len().next_multiple_of(4));
    let binary = next.filter(|(form, _)| form == b"BIN\0");
    Ok((json, binary.map(|(_, bytes)| bytes)))
}

struct Reader<'r> {
    root: &'r Root,
    buffers: Vec<Cow<'r, [u8]>>,
    mesh: TriangleMesh,
    looks: Option<&'r mut Looks>,
    visited: usize,
    /// How many vertices morph targets have moved.
    moved: usize,
    /// The matrices of the joints of skins.
    skins: HashMap<usize, Rc<[Matrix]>>,
    /// The parent of each node. Empty until a skin is read.
    parents: Vec<Option<usize>>,
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
            let weights = node.weights.as_ref().unwrap_or(&mesh.weights);
            let bones = node.skin.map(|skin| self.skin(skin)).transpose()?;
            for primitive in &mesh.primitives {
                self.primitive(primitive, &here, weights, bones.as_deref())?;
            }
        }
        for child in &node.children {
            self.node(*child, &here, depth + 1)?;
        }
        Ok(())
    }

    /// Adds a primitive at `to`, with the weights of its morph targets and the matrices of its
    /// joints.
    fn primitive(
        &mut self,
        primitive: &Primitive,
        to: &Matrix,
        weights: &[f64],
        bones: Option<&[Matrix]>,
    ) -> Result<(), MeshError> {
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return Ok(());
        };
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if !(TRIANGLES..=FAN).contains(&mode) {
            return Ok(());
        }
        // Before anything is read: strips and fans have three times as many corners as indices.
        let elements = self.count(primitive.indices.unwrap_or(position))?;
        let count = match mode {
            TRIANGLES => elements / 3,
            _ => elements.saturating_sub(2),
        };
        if self.mesh.triangles.len().saturating_add(count) > MAX_TRIANGLES {
            return Err(wrong("the scene has more than 50 million triangles"));
        }
        let first = self.mesh.vertices.len();
        if first.saturating_add(self.count(position)?) > 3 * MAX_TRIANGLES {
            return Err(wrong("the scene has more than 150 million vertices"));
        }
        let numbers = self.numbers(position, 3);
        let mut numbers = numbers.map_err(|error| primitive.missing(error))?;
        self.morph(primitive, weights, &mut numbers)?;
        let places = numbers.as_chunks::<3>().0;
        if let Some(bones) = bones.filter(|_| primitive.attributes.contains_key("JOINTS_0")) {
            let placed = self.placed(primitive, places, bones)?;
            self.mesh.vertices.extend(placed);
        } else {
            let placed = places.iter().map(|place| applied(to, place));
            self.mesh.vertices.extend(placed);
        }
        let (first, count) = (first as u32, places.len() as u32);
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => self.indices(indices)?,
            None => (0..count).collect(),
        };
        if corners.iter().any(|corner| *corner >= count) {
            return Err(wrong("a triangle has a corner that does not exist"));
        }
        let corners = triangles(corners, mode);
        let triangles = corners.chunks_exact(3);
        let triangles = triangles.map(|three| [0, 1, 2].map(|n| first + three[n]));
        self.mesh.triangles.extend(triangles);
        self.paint(primitive, &corners)
    }

    /// Adds the weighted morph targets of a primitive to its places.
    fn morph(
        &mut self,
        primitive: &Primitive,
        weights: &[f64],
        numbers: &mut [f64],
    ) -> Result<(), MeshError> {
        for (target, weight) in primitive.targets.iter().zip(weights) {
            let Some(&target) = target.get("POSITION").filter(|_| *weight != 0.0) else {
                continue;
            };
            if self.count(target)? != numbers.len() / 3 {
                return Err(wrong("a morph target has not one place for each vertex"));
            }
            self.moved += numbers.len() / 3;
            if self.moved > 3 * MAX_TRIANGLES {
                return Err(wrong("morph targets move more than 150 million vertices"));
            }
            for (number, delta) in numbers.iter_mut().zip(self.numbers(target, 3)?) {
                *number += weight * delta;
            }
        }
        Ok(())
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

fn local(node: &Node) -> Matrix {
    if let Some(columns) = node.matrix {
        return [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| columns[column * 4 + row]));
    }
    let moved = node.translation.unwrap_or_default();
    let scale = node.scale.unwrap_or([1.0; 3]);
    let rotation = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    // Files are to have unit quaternions; one of another length would scale and shear.
    let length = rotation.iter().map(|part| part * part).sum::<f64>().sqrt();
    let [x, y, z, w] = if length > 0.0 {
        rotation.map(|part| part / length)
    } else {
        [0.0, 0.0, 0.0, 1.0]
    };
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

/// Where a matrix takes a place.
fn applied(to: &Matrix, p: &[f64; 3]) -> [f64; 3] {
    to.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3])
}
