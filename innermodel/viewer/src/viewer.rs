//! The window of a component.

use crate::actions::Actions;
use crate::overlay::Marks;
use crate::tree_view::{self, Options};
use innermodel::InnerModel;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// The size of the window at first, in pixels.
const SIZE: (u16, u16) = (640, 480);

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

impl fmt::Debug for Viewer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_shown = self.open.is_some();
        f.debug_struct("Viewer")
            .field("title", &self.title)
            .field("is_shown", &is_shown)
            .finish_non_exhaustive()
    }
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
    pub fn show(&mut self, wanted: bool) {
        let is_shown = self.open.as_ref().is_some_and(|(_, t)| !t.is_finished());
        if wanted == is_shown {
            return;
        }
        self.close();
        if !wanted {
            return;
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
        let started = thread::Builder::new()
            .name("viewer".to_owned())
            .spawn(move || {
                let is_on = || is_on.load(Ordering::Relaxed);
                if let Err(error) = tree_view::run(&model, &options, actions, &is_on, &*say) {
                    say(&error.to_string());
                }
            });
        match started {
            Ok(thread) => self.open = Some((on, thread)),
            Err(error) => (self.say)(&format!("cannot open a window: {error}")),
        }
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
