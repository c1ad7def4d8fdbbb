//! A window that shows a tree of `innermodel`, an editor of its files, and what `rcview` draws into
//! files.
//!
//! [`Viewer`] shows the tree of a component while the component runs: a thread of its own draws
//! each new version. The window speaks the protocol of X11 itself, and the processor draws: neither
//! a library of the system nor a graphics card is needed.

mod actions;
mod content;
mod edit;
mod grab;
mod input;
mod navigator;
mod overlay;
mod remote_view;
mod sight;
mod steering;
mod tree_view;
mod viewer;
mod viewpoint;
mod viewport;
mod window;

pub use actions::{Action, Actions};
pub use edit::{EDITOR_KEYS, EditError, Editor, Handle, OpenError, edit};
pub use innermodel;
pub use input::{Input, Key, Modifiers, Pixel, ViewerAction};
pub use navigator::{Navigator, scene};
pub use overlay::{Marks, draw};
pub use remote_view::{Picture, PictureRequest, Steered, watch};
pub use tree_view::{Options, TreeView, run};
pub use viewer::{Viewer, parameter_tree, reach};
pub use viewpoint::{Viewpoint, ViewpointError};
pub use window::WindowError;
