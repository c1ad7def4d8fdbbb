//! Errors of bodies that are not drawn as their nodes say.

use crate::texture::TextureError;
use innermodel_mesh::MeshError;
use thiserror::Error;

/// Error of a body that is not drawn as its node says.
#[derive(Debug, Error)]
pub enum DrawError {
    /// No picture is drawn.
    #[error("its mesh: {0}")]
    Mesh(MeshError),
    /// The body is grey, or a part of a mesh has no picture.
    #[error("its texture: {0}")]
    Texture(TextureError),
    /// Parts of a mesh have no colour.
    #[error("{0}")]
    Look(String),
}
