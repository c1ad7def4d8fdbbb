//! Triangles with their appearance.

use crate::error::DrawError;
use crate::texture::{Paint, Texture};
use crate::triangles::{Canvas, Target};
use innermodel::{Point, Transform, Vector};
use innermodel_mesh::{AlphaMode, Looks, MeshError, Picture, TriangleMesh};
use std::path::Path;
use std::sync::Arc;

/// How many problems of one mesh are reported.
const MOST_PROBLEMS: usize = 16;

/// The surface of a body.
#[derive(Debug)]
pub(crate) struct Surface {
    mesh: TriangleMesh,
    looks: Looks,
    /// The pictures of the materials.
    textures: Vec<Option<Arc<Texture>>>,
    pixels: usize,
    bounds: Option<(Vector, Vector)>,
}

impl Surface {
    /// The surface of a box with its centre at the origin.
    pub(crate) fn cuboid(size: [f64; 3]) -> Self {
        let half = Vector::from(size).abs() / 2.0;
        Self {
            mesh: TriangleMesh::cuboid(size),
            looks: Looks::default(),
            textures: Vec::new(),
            pixels: 0,
            bounds: Some((-half, half)),
        }
    }

    /// Reads a mesh with its pictures, which may have `left` pixels in all.
    pub(crate) fn read(
        path: &Path,
        [sx, sy, sz]: [f64; 3],
        left: usize,
    ) -> Result<(Self, Vec<DrawError>), MeshError> {
        let (mut mesh, mut looks) = innermodel_mesh::read_with_looks(path)?;
        for [x, y, z] in &mut mesh.vertices {
            (*x, *y, *z) = (*x * sx, *y * sy, -*z * sz);
        }
        let problems = std::mem::take(&mut looks.problems);
        let mut problems: Vec<DrawError> = problems.into_iter().map(DrawError::Look).collect();
        // Materials share pictures.
        let mut known: Vec<(Picture, Option<Arc<Texture>>)> = Vec::new();
        let (mut textures, mut pixels) = (Vec::new(), 0);
        for material in &mut looks.materials {
            let Some(picture) = material.picture.take() else {
                textures.push(None);
                continue;
            };
            if let Some((_, texture)) = known.iter().find(|(other, _)| *other == picture) {
                textures.push(texture.clone());
                continue;
            }
            let texture = match Texture::of_mesh(&picture, left.saturating_sub(pixels)) {
                Ok(texture) => {
                    pixels += texture.pixels();
                    Some(Arc::new(texture))
                }
                Err(error) => {
                    problems.push(DrawError::Texture(error));
                    None
                }
            };
            textures.push(texture.clone());
            known.push((picture, texture));
        }
        problems.truncate(MOST_PROBLEMS);
        for (material, texture) in looks.materials.iter_mut().zip(&textures) {
            let is_opaque = texture.as_ref().is_none_or(|texture| texture.is_opaque());
            if material.alpha >= 1.0 && is_opaque {
                material.alpha_mode = AlphaMode::Opaque;
            }
        }
        let surface = Self {
            bounds: around(mesh.vertices.iter().map(|vertex| Vector::from(*vertex))),
            mesh,
            looks,
            textures,
            pixels,
        };
        Ok((surface, problems))
    }

    /// Whether other surfaces are seen through a part of it.
    pub(crate) fn blends(&self) -> bool {
        let materials = &self.looks.materials;
        materials.iter().any(|m| m.alpha_mode == AlphaMode::Blend)
    }

    /// The least and the most coordinates of its vertices, which are finite.
    pub(crate) fn bounds(&self) -> Option<(Vector, Vector)> {
        self.bounds
    }

    /// How many pixels its pictures have.
    pub(crate) fn pixels(&self) -> usize {
        self.pixels
    }
}

impl<'c> Canvas<'c, '_> {
    /// Draws those triangles of a surface that belong to the target. Triangles without a material
    /// have the paint of the canvas.
    pub(crate) fn surface(&mut self, surface: &'c Surface, to_camera: &Transform) {
        let vertices = &surface.mesh.vertices;
        let corner = |at: u32| to_camera.point(&Point::from(vertices[at as usize])).coords;
        let plain = self.paint;
        let is_layer = matches!(self.target, Target::Layer(_));
        for (number, triangle) in surface.mesh.triangles.iter().enumerate() {
            let look = surface.looks.triangles.get(number);
            let material = look.and_then(|look| Some((look, look.material? as usize)));
            let material = material.and_then(|(look, at)| {
                let material = surface.looks.materials.get(at)?;
                Some((look, material, surface.textures.get(at)?))
            });
            (self.alpha, self.alpha_mode) = material.map_or((1.0, AlphaMode::Opaque), |found| {
                (found.1.alpha, found.1.alpha_mode)
            });
            if (self.alpha_mode == AlphaMode::Blend) != is_layer {
                continue;
            }
            let corners = triangle.map(corner);
            self.paint = match material {
                None => plain,
                Some((look, material, Some(texture))) => Paint::Triangle {
                    texture,
                    wrap: material.wrap,
                    tint: material.colour,
                    corners,
                    places: look.corners,
                },
                Some((_, material, None)) => Paint::Colour(material.colour),
            };
            self.triangle(corners);
        }
        self.paint = plain;
        (self.alpha, self.alpha_mode) = (1.0, AlphaMode::Opaque);
    }
}

/// The least and the most of finite vectors, if there are any.
pub(crate) fn around(vectors: impl Iterator<Item = Vector>) -> Option<(Vector, Vector)> {
    let finite = vectors.filter(|vector| vector.iter().all(|part| part.is_finite()));
    finite
        .map(|vector| (vector, vector))
        .reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))
}
