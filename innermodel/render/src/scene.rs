//! The bodies of a tree on the raster of a camera.

use crate::colours::{SKY, colour};
use crate::error::DrawError;
use crate::image::Image;
use crate::layers::{self, Layers};
use crate::surfaces::Surface;
use crate::texture::{self, Paint, Texture, TextureError};
use crate::triangles::{Canvas, Target};
use crate::view::{Projection, View};
use crate::{points, solids};
use innermodel::kinds::{Display, Mesh, Render, Shape};
use innermodel::shapes::{Body, bars, body};
use innermodel::{Clouds, Kind, NodeId, NodeRef, Snapshot, Transform, Vector};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// The most pixels of an image.
pub const MOST_PIXELS: f64 = 16_777_216.0;

/// A body that is not drawn as its node says.
#[derive(Debug)]
pub struct Problem {
    /// The id of the node.
    pub id: String,
    /// Why.
    pub error: DrawError,
}

/// The camera has more than 16,777,216 pixels, or no number of pixels.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("cannot draw {width} × {height} pixels; expected at most 16777216 in all")]
pub struct TooLarge {
    /// Of the camera.
    pub width: f64,
    /// Of the camera.
    pub height: f64,
}

/// The path of a mesh, and its scale bit by bit.
type MeshKey = (PathBuf, [u64; 3]);

/// The meshes and textures of a tree. Each one is read once, and forgotten when a picture does not
/// show it.
#[derive(Debug, Default)]
pub struct Scene {
    meshes: HashMap<MeshKey, Known<Surface>>,
    textures: HashMap<PathBuf, Known<Texture>>,
    pub(crate) clouds: Clouds,
    problems: Vec<Problem>,
    light: Option<Vector>,
}

/// A scene that shares the meshes and textures of the first one. [`Scene::problems`] stay there.
impl Clone for Scene {
    fn clone(&self) -> Self {
        Self {
            meshes: self.meshes.clone(),
            textures: self.textures.clone(),
            clouds: self.clouds.clone(),
            problems: Vec::new(),
            light: self.light,
        }
    }
}

/// A file that was read; without content if it cannot be read.
#[derive(Debug)]
struct Known<T> {
    content: Option<Arc<T>>,
    /// Whether the picture that is being drawn shows it.
    is_drawn: bool,
}

impl<T> Clone for Known<T> {
    fn clone(&self) -> Self {
        Self {
            content: self.content.clone(),
            is_drawn: self.is_drawn,
        }
    }
}

pub(crate) enum Part {
    Triangles(Arc<Surface>),
    Solid(Shape),
}

/// A mesh through which others are seen.
struct Blending {
    node: NodeId,
    mesh: Arc<Surface>,
    /// From the mesh to the camera.
    place: Transform,
    wireframe: bool,
}

/// Draws what others are seen through in front of an image of all others.
fn blend(image: &mut Image, projection: &Projection, light: Option<Vector>, meshes: &[Blending]) {
    let mut layers = Layers::new(image);
    for _ in 0..layers::MOST {
        for blending in meshes {
            let target = Target::Layer(&mut layers);
            let mut canvas = Canvas::new(target, projection, blending.node, light);
            canvas.wireframe = blending.wireframe;
            canvas.surface(&blending.mesh, &blending.place);
        }
        if !layers.next() {
            break;
        }
    }
    layers.finish();
}

impl Scene {
    /// No mesh is read yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the direction to the light in the root. `None`, and a direction without a length: the
    /// light is at the camera.
    pub fn set_light(&mut self, direction: Option<Vector>) {
        self.light = direction.and_then(|direction| direction.try_normalize(1e-12));
    }

    /// Sets the points of point clouds, which the next pictures show.
    pub fn set_clouds(&mut self, clouds: Clouds) {
        self.clouds = clouds;
    }

    /// Bodies that could not be drawn as their nodes say, since the last call.
    pub fn problems(&mut self) -> Vec<Problem> {
        std::mem::take(&mut self.problems)
    }

    /// Draws a tree as a camera sees it.
    ///
    /// # Errors
    /// The camera has too many pixels.
    pub fn draw(&mut self, tree: &Snapshot, view: &View) -> Result<Image, TooLarge> {
        let (width, height) = (view.camera.width, view.camera.height);
        let is_drawable = width >= 0.0 && height >= 0.0 && width * height <= MOST_PIXELS;
        if !is_drawable || width.max(height) > MOST_PIXELS {
            return Err(TooLarge { width, height });
        }
        let mut image = Image::new(width as usize, height as usize, SKY);
        let projection = Projection::new(&view.camera);
        let to_camera = view.place.inverse();
        for known in self.meshes.values_mut() {
            known.is_drawn = false;
        }
        for known in self.textures.values_mut() {
            known.is_drawn = false;
        }
        let light = self.light.map(|light| to_camera.vector(&light));
        // Meshes through which others are seen, drawn once all others are there.
        let mut blending = Vec::new();
        for node in tree.nodes() {
            let here = to_camera * node.to_root();
            if let Kind::Axes(axes) = node.kind() {
                for (size, place, colour) in bars(axes.lengths, axes.widths) {
                    let target = Target::Image(&mut image);
                    let mut canvas = Canvas::new(target, &projection, node.node_id(), light);
                    canvas.paint = Paint::Colour(colour);
                    canvas.surface(&Surface::cuboid(size), &(here * place));
                }
                continue;
            }
            if *node.kind() == Kind::PointCloud {
                let cloud = self.clouds.of(node.node_id());
                points::draw(&mut image, &projection, node.node_id(), cloud, &here);
                continue;
            }
            let Some((part, place)) = self.part(&node) else {
                continue;
            };
            let texture = self.texture(&node);
            let paint = match (&texture, body(node.kind())) {
                (Some(texture), Some((Body::Box(size), _))) => Paint::Box {
                    texture,
                    size,
                    to_box: (here * place).inverse(),
                },
                _ => Paint::Colour(colour(node.kind())),
            };
            let is_wire = |mesh: &Mesh| mesh.render == Render::Wireframe;
            let target = Target::Image(&mut image);
            let mut canvas = Canvas::new(target, &projection, node.node_id(), light);
            canvas.paint = paint;
            canvas.wireframe = matches!(node.kind(), Kind::Mesh(mesh) if is_wire(mesh));
            match part {
                Part::Triangles(mesh) => {
                    canvas.surface(&mesh, &(here * place));
                    if mesh.blends() {
                        blending.push(Blending {
                            node: node.node_id(),
                            wireframe: canvas.wireframe,
                            mesh,
                            place: here * place,
                        });
                    }
                }
                Part::Solid(shape) => solids::draw(&mut canvas, shape, &(here * place)),
            }
        }
        if !blending.is_empty() {
            blend(&mut image, &projection, light, &blending);
        }
        self.meshes.retain(|_, known| known.is_drawn);
        self.textures.retain(|_, known| known.is_drawn);
        Ok(image)
    }

    /// The body of a node, and its place in the node.
    pub(crate) fn part(&mut self, node: &NodeRef<'_>) -> Option<(Part, Transform)> {
        let (body, place) = body(node.kind())?;
        let part = match body {
            Body::Box(size) => Part::Triangles(Arc::new(Surface::cuboid(size))),
            Body::Solid(shape) => Part::Solid(shape),
            Body::Mesh(mesh) => Part::Triangles(self.mesh(node, mesh)?),
        };
        Some((part, place))
    }

    fn mesh(&mut self, node: &NodeRef<'_>, mesh: &Mesh) -> Option<Arc<Surface>> {
        let path = mesh.path.clone();
        let path = path.unwrap_or_else(|| mesh.file.clone().into());
        let key = (path, mesh.scale.map(f64::to_bits));
        if let Some(known) = self.meshes.get_mut(&key) {
            known.is_drawn = true;
            return known.content.clone();
        }
        let read = Surface::read(&key.0, mesh.scale, self.pixels_left());
        let mut report = |error| {
            let id = node.id().to_owned();
            self.problems.push(Problem { id, error });
        };
        let read = match read {
            Ok((surface, problems)) => {
                problems.into_iter().for_each(&mut report);
                Some(Arc::new(surface))
            }
            Err(error) => {
                report(DrawError::Mesh(error));
                None
            }
        };
        let known = Known {
            content: read.clone(),
            is_drawn: true,
        };
        self.meshes.insert(key, known);
        read
    }

    /// How many pixels further pictures may have.
    fn pixels_left(&self) -> usize {
        let textures = self
            .textures
            .values()
            .filter_map(|known| known.content.as_ref());
        let meshes = self
            .meshes
            .values()
            .filter_map(|known| known.content.as_ref());
        let pixels = textures.map(|texture| texture.pixels()).sum::<usize>()
            + meshes.map(|mesh| mesh.pixels()).sum::<usize>();
        texture::MOST_PIXELS.saturating_sub(pixels)
    }

    /// The texture of a node, if it is a picture. Only a file that the reader of the node has found
    /// is opened: a name that comes from elsewhere opens no file here.
    fn texture(&mut self, node: &NodeRef<'_>) -> Option<Arc<Texture>> {
        let (Kind::Plane(plane) | Kind::Display(Display { plane, .. })) = node.kind() else {
            return None;
        };
        if plane.texture.is_empty() || plane.texture.starts_with('#') {
            return None;
        }
        let written = PathBuf::from(&plane.texture);
        let path = plane.picture.clone().unwrap_or(written);
        if let Some(known) = self.textures.get_mut(&path) {
            known.is_drawn = true;
            return known.content.clone();
        }
        let read = match &plane.picture {
            Some(picture) => Texture::read(picture, self.pixels_left()),
            None => Err(TextureError::NotFound),
        };
        let content = read.map(Arc::new).map_err(|error| {
            let (id, error) = (node.id().to_owned(), DrawError::Texture(error));
            self.problems.push(Problem { id, error });
        });
        let content = content.ok();
        let known = Known {
            content: content.clone(),
            is_drawn: true,
        };
        self.textures.insert(path, known);
        content
    }
}
