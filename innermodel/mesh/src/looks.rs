//! The appearance of a mesh: its colours and pictures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How many materials a mesh may have.
pub(crate) const MOST_MATERIALS: usize = 10_000;

/// Colours and pictures of the triangles of a mesh. A triangle without a place in `triangles` has
/// no material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Looks {
    /// The materials.
    pub materials: Vec<Material>,
    /// One for each triangle of the mesh, in the same order.
    pub triangles: Vec<Look>,
    /// Materials and pictures that the mesh names and that could not be read.
    pub problems: Vec<String>,
}

/// The appearance of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// The place of its material in [`Looks::materials`].
    pub material: Option<u32>,
    /// For each corner, the place in the picture: (0, 0) is the top left corner, (1, 1) the bottom
    /// right one. [`Wrap`] defines the places beyond. Finite.
    pub corners: [[f32; 2]; 3],
}

/// A colour, and a picture that it tints.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// Where the picture is.
    pub picture: Option<Picture>,
    /// Treatment of coordinates beyond the left and right, and the upper and lower sides.
    pub wrap: [Wrap; 2],
    /// Opacity from 0 to 1, which that of the picture multiplies.
    pub alpha: f32,
    /// Effect of the opacity.
    pub alpha_mode: AlphaMode,
}

/// Effect of the opacity of a material: `alphaMode` of glTF.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Opaque.
    #[default]
    Opaque,
    /// The surface has holes where its opacity is less.
    Mask(f32),
    /// Transparent: the surfaces behind it are visible through it.
    Blend,
}

/// A picture, in any format.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// The mesh names this file. It may not exist.
    File(PathBuf),
    /// The mesh contains it.
    Bytes(Arc<[u8]>),
}

/// Treatment of coordinates beyond a side of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The picture again, mirrored each other time.
    Mirror,
    /// The colour of the side.
    Clamp,
}

impl Wrap {
    /// The place in the picture, from 0 to 1.
    pub fn place(self, at: f64) -> f64 {
        match self {
            Self::Repeat => at - at.floor(),
            Self::Mirror => {
                let twice = at - 2.0 * (at / 2.0).floor();
                1.0 - (1.0 - twice).abs()
            }
            Self::Clamp => at.clamp(0.0, 1.0),
        }
    }
}

/// The file that a mesh in `folder` names. A name of another computer is looked for in the folder.
pub(crate) fn find(folder: &Path, name: &str) -> PathBuf {
    let name = name.replace('\\', "/");
    let path = folder.join(&name);
    let base = Path::new(&name).file_name();
    match base {
        Some(base) if !path.exists() => folder.join(base),
        _ => path,
    }
}

/// A colour of numbers from 0 to 1.
pub(crate) fn colour(parts: [f64; 3]) -> [u8; 3] {
    parts.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8)
}
