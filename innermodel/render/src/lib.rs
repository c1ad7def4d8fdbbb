//! Pictures of the tree of `innermodel`, drawn by the processor: no window, no graphics card.
//!
//! [`Scene`] holds the meshes; [`Scene::draw`] gives colour, depth and node of each pixel. The
//! depth of a pixel is that of the surface at its centre.
//!
//! ```
//! use innermodel::{InnerModel, Point, kinds::Camera};
//! use innermodel_render::{Scene, look_at};
//!
//! let text = r##"<innerModel><sphere id="ball" radius="100" texture="#ff0000"/></innerModel>"##;
//! let tree = InnerModel::parse(text)?.snapshot();
//! let camera = Camera { width: 64.0, height: 48.0, focal: 60.0 };
//! let view = look_at(Point::new(0.0, 0.0, -500.0), Point::origin(), camera);
//! let image = Scene::new().draw(&tree, &view)?;
//! assert_eq!(image.node(32, 24), Some(tree.node("ball")?.node_id()));
//! assert!((image.depths[24 * 64 + 32] - 400.0).abs() < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod colours;
mod error;
mod extent;
mod image;
mod layers;
mod points;
mod scene;
mod solids;
mod surfaces;
mod texture;
mod triangles;
mod view;

pub use error::DrawError;
pub use extent::Extent;
pub use image::{Image, id_colours};
pub use scene::{MOST_PIXELS, Problem, Scene, TooLarge};
pub use texture::TextureError;
pub use view::{View, camera, look_at};
