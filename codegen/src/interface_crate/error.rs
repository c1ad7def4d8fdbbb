//! Why the crate could not be generated.

use crate::templates::TemplateError;
use std::io;

/// Why the crate could not be generated.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The system refused a file.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A fault of this program.
    #[error(transparent)]
    Template(#[from] TemplateError),
}
