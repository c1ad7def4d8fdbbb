//! The editor of InnerModel files.

mod commands;
mod editor;
mod handles;
mod history;
mod prompt;
mod source;

pub use editor::{Editor, KEYS as EDITOR_KEYS};
pub use handles::Handle;
pub use source::OpenError;

use crate::content::{self, Content};
use crate::input::{Input, ViewerAction};
use crate::window::WindowError;
use innermodel_render::{Image, TooLarge};
use rc_diagnostics::foreign::clean;
use std::sync::atomic::{AtomicBool, Ordering};
use thiserror::Error;

impl Content for Editor {
    fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge> {
        Self::draw(self, size)
    }

    fn input(&mut self, input: Input) -> ViewerAction {
        Self::input(self, input)
    }

    /// Only its user changes the content.
    fn poll(&mut self) -> ViewerAction {
        ViewerAction::Nothing
    }
}

/// Error of a window in which a file is edited.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EditError {
    /// There is no window. Nothing was changed, or everything was saved.
    #[error(transparent)]
    Window(#[from] WindowError),
    /// It ended before changes were saved.
    #[error("{cause}; the changes are not saved, but in {path}")]
    Unsaved {
        /// Why it ended.
        cause: String,
        /// Where the text with the changes is.
        path: String,
    },
    /// It ended before changes were saved, and they cannot be written next to the file.
    #[error("{cause}; the changes are lost: {error}")]
    Lost {
        /// Why it ended.
        cause: String,
        /// Why the changes cannot be written.
        error: std::io::Error,
    },
}

/// Lets a user edit a file in a window, until it is closed or `stop` is set. If `stop` is set or
/// the display goes away while there are changes, they are written into a new file next to it.
pub fn edit(
    editor: &mut Editor,
    title: &str,
    size: (u16, u16),
    stop: &AtomicBool,
) -> Result<(), EditError> {
    let shown = content::show(title, size, editor, &|| !stop.load(Ordering::Relaxed));
    let cause = match shown {
        Ok(()) if stop.load(Ordering::Relaxed) => "ended by a signal".to_owned(),
        Ok(()) => return Ok(()),
        Err(error) if !editor.is_changed() => return Err(error.into()),
        Err(error) => error.to_string(),
    };
    match editor.rescue() {
        None => Ok(()),
        Some(Ok(path)) => {
            let path = clean(&path.display().to_string());
            Err(EditError::Unsaved { cause, path })
        }
        Some(Err(error)) => Err(EditError::Lost { cause, error }),
    }
}
