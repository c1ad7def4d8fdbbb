//! The window of a component.

use crate::actions::Actions;
use crate::overlay::Marks;
use crate::tree_view::{self, Options};
use crate::window::{self, WindowError};
use innermodel::{Folders, InnerModel};
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{TrySendError, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// The size of the window at first, in pixels.
const SIZE: (u16, u16) = (640, 480);
/// How long a display may take before the component goes on without its reply.
const PATIENCE: Duration = Duration::from_secs(1);

/// Shows the tree of a component in a window, while it is switched on. A thread of its own draws,
/// so the component waits for nothing. The user may close the window; the component goes on.
pub struct Viewer {
    model: Arc<InnerModel>,
    title: String,
    /// Gets a line if there is no window, and for each picked node.
    say: Arc<dyn Fn(&str) + Send + Sync>,
    /// Where changes of its user go.
    actions: Option<Actions>,
    open: Option<(Arc<AtomicBool>, JoinHandle<()>)>,
}

/// The tree of the file that the parameter `inner_model` of a component names; without a file it is
/// empty. `warn` gets the warnings about it.
///
/// # Errors
/// The file cannot be read, or is not a tree: the text says why.
pub fn parameter_tree(file: &Path, warn: impl Fn(&str)) -> Result<Arc<InnerModel>, String> {
    if file.as_os_str().is_empty() {
        return Ok(Arc::default());
    }
    let read = innermodel::read(file, &Folders::default());
    let (document, warnings) = read.map_err(|error| error.to_string())?;
    warnings.lines().for_each(warn);
    let tree = InnerModel::from_document(&document);
    tree.map(Arc::new).map_err(|error| error.to_string())
}

impl fmt::Debug for Viewer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_shown = self.open.is_some();
        f.debug_struct("Viewer")
            .field("title", &self.title)
            .field("is_shown", &is_shown)
            .finish_non_exhaustive()
    }
}

/// Whether the display of the environment takes connections.
///
/// # Errors
/// There is no display, or it refuses the connection. One that does not reply within a second is
/// not an error.
pub fn reach() -> Result<(), WindowError> {
    let (tell, told) = sync_channel(1);
    let started = thread::Builder::new()
        .name("viewer".to_owned())
        .spawn(move || drop(tell.try_send(window::reach())));
    started.map_err(|error| WindowError::Connect(error.into()))?;
    told.recv_timeout(PATIENCE).unwrap_or(Ok(()))
}

impl Viewer {
    /// A viewer that is switched off. `say` gets a line if there is no window, and for each node
    /// that the user picks.
    pub fn new(
        title: impl Into<String>,
        model: Arc<InnerModel>,
        say: impl Fn(&str) + Send + Sync + 'static,
    ) -> Self {
        Self {
            model,
            title: title.into(),
            say: Arc::new(say),
            actions: None,
            open: None,
        }
    }

    /// Lets the user of the window, when it is opened next, move and push objects. The viewer
    /// does not change the tree: its owner takes the requests from the queue in each period.
    pub fn actions(&mut self) -> Actions {
        self.actions.get_or_insert_default().clone()
    }

    /// Opens the window, or closes it. A window that its user closed is opened again.
    ///
    /// # Errors
    /// There is no display, or it refuses the connection. One that does not reply within a second
    /// is not an error: the window opens when it does.
    pub fn show(&mut self, wanted: bool) -> Result<(), WindowError> {
        let is_shown = self.open.as_ref().is_some_and(|(_, t)| !t.is_finished());
        if wanted == is_shown {
            return Ok(());
        }
        self.close();
        if !wanted {
            return Ok(());
        }
        let on = Arc::new(AtomicBool::new(true));
        let (model, say, is_on) = (self.model.clone(), self.say.clone(), on.clone());
        let actions = self.actions.clone();
        let options = Options {
            title: self.title.clone(),
            size: SIZE,
            navigator: None,
            marks: Marks::default(),
        };
        let (tell, told) = sync_channel(1);
        let started = thread::Builder::new()
            .name("viewer".to_owned())
            .spawn(move || {
                let reached = window::reach();
                let is_reached = reached.is_ok();
                // A late reply is no longer needed.
                if let Err(TrySendError::Disconnected(Err(error))) = tell.try_send(reached) {
                    say(&error.to_string());
                }
                if !is_reached {
                    return;
                }
                let is_on = || is_on.load(Ordering::Relaxed);
                if let Err(error) = tree_view::run(&model, &options, actions, &is_on, &*say) {
                    say(&error.to_string());
                }
            });
        let thread = started.map_err(|error| WindowError::Connect(error.into()))?;
        if let Ok(Err(error)) = told.recv_timeout(PATIENCE) {
            return Err(error);
        }
        self.open = Some((on, thread));
        Ok(())
    }

    fn close(&mut self) {
        // The thread looks at the switch every 30 ms. It is not waited for: a display may hang.
        if let Some((on, _)) = self.open.take() {
            on.store(false, Ordering::Relaxed);
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.close();
    }
}
