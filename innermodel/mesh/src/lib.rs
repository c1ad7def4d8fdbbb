//! Meshes of files: Wavefront OBJ, STL and glTF 2.0.
//!
//! [`read`] gives the triangles of a file in its own frame and unit. `InnerModel` mirrors z and
//! scales: see `innermodel::kinds::Mesh`. [`read_with_looks`] also gives colours and pictures.
//!
#![doc = include_str!("example.md")]

mod clipping;
mod gltf;
mod looks;
mod obj;
mod stl;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use thiserror::Error;

pub use looks::{AlphaMode, Look, Looks, Material, Picture, Wrap};

/// The largest file that is read, in bytes.
const LARGEST: u64 = 512 << 20;

/// Triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// The corners.
    pub vertices: Vec<[f64; 3]>,
    /// Three corners each, by their places in `vertices`. Each place exists.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// A box around the origin with these lengths. Its triangles turn to the left, seen from
    /// outside, in a frame with x to the right, y up and z to the front.
    pub fn cuboid(size: [f64; 3]) -> Self {
        let vertices = (0..8).map(|corner| {
            [0, 1, 2].map(|axis| {
                let side = if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
                size[axis].abs() * side
            })
        });
        let sides = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = sides.into_iter();
        let triangles = triangles.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Self {
            vertices: vertices.collect(),
            triangles: triangles.collect(),
        }
    }
}

/// Error of a file that gives no mesh.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The system cannot read the file.
    #[error("{0}")]
    Unreadable(#[from] io::Error),
    /// The format is not one of those that are read.
    #[error("expected a mesh in .obj, .stl, .gltf or .glb, found .{0}")]
    UnknownFormat(String),
    /// The formats of 3D Studio and of `OpenSceneGraph` are not read.
    #[error("cannot read .{0}; convert it to .obj first{1}")]
    NeedsConversion(String, &'static str),
    /// The file, or all files of its data, are larger than this limit, in MiB.
    #[error("expected at most {0} MiB")]
    TooLarge(u64),
    /// The content is wrong.
    #[error("{0}")]
    Wrong(String),
    /// The file has no triangle.
    #[error("the file has no triangle")]
    Empty,
}

/// Reads a mesh. Its extension tells its format.
pub fn read(path: &Path) -> Result<TriangleMesh, MeshError> {
    read_file(path, None)
}

/// Reads a mesh with its colours, and finds its pictures: `.obj` names them in files of materials
/// (`Kd`, `map_Kd`, `d` and `Tr`), glTF as base colours with `alphaMode`. STL has neither. Pictures
/// are not read. An error in a material is a problem in [`Looks`]; the mesh is read without it.
pub fn read_with_looks(path: &Path) -> Result<(TriangleMesh, Looks), MeshError> {
    let mut looks = Looks::default();
    let mesh = read_file(path, Some(&mut looks))?;
    Ok((mesh, looks))
}

fn read_file(path: &Path, looks: Option<&mut Looks>) -> Result<TriangleMesh, MeshError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let ending = ending.to_lowercase();
    let folder = path.parent().unwrap_or(Path::new(""));
    let looks = looks.map(|looks| (folder, looks));
    let mesh = match ending.as_str() {
        "obj" => obj::read(&bytes(path)?, looks)?,
        "stl" => stl::read(&bytes(path)?)?,
        "gltf" | "glb" => gltf::read(&bytes(path)?, folder, looks.map(|(_, looks)| looks))?,
        "osg" | "ive" | "osgt" | "osgb" => {
            let how = ": `osgconv FILE FILE.obj` of OpenSceneGraph does it";
            return Err(MeshError::NeedsConversion(ending, how));
        }
        "3ds" | "dae" | "ply" | "blend" | "fbx" => {
            let how = ": Blender imports and exports it, or `assimp export FILE FILE.obj`";
            return Err(MeshError::NeedsConversion(ending, how));
        }
        _ => return Err(MeshError::UnknownFormat(ending)),
    };
    checked(mesh)
}

/// The content of a regular file.
fn bytes(path: &Path) -> Result<Vec<u8>, MeshError> {
    bytes_up_to(path, LARGEST)
}

/// The content of a regular file that has at most `most` bytes.
fn bytes_up_to(path: &Path, most: u64) -> Result<Vec<u8>, MeshError> {
    // Check before opening: opening a device can have side effects.
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return Err(io::Error::other("this is not a regular file").into());
    }
    if about.len() > most {
        return Err(MeshError::TooLarge(most >> 20));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// A mesh whose numbers are finite and whose triangles have corners.
fn checked(mesh: TriangleMesh) -> Result<TriangleMesh, MeshError> {
    let count = mesh.vertices.len();
    if mesh.vertices.iter().flatten().any(|n| !n.is_finite()) {
        return Err(MeshError::Wrong("a coordinate is not finite".to_owned()));
    }
    if mesh
        .triangles
        .iter()
        .flatten()
        .any(|at| *at as usize >= count)
    {
        return Err(MeshError::Wrong(
            "a triangle has a corner that does not exist".to_owned(),
        ));
    }
    if mesh.triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests;
