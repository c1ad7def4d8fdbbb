//! The window of a tree and its user: orbit, pick, frames and names.

use crate::content::{self, Content};
use crate::input::{Input, Key, ViewerAction};
use crate::navigator::Navigator;
use crate::overlay::{self, Marks};
use crate::viewport::{Gesture, Viewport};
use crate::window::WindowError;
use innermodel::{Clouds, InnerModel, NodeId, Snapshot};
use innermodel_render::{Image, TooLarge};
use rc_diagnostics::foreign::clean;
use std::sync::Arc;

/// How a window begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Title of the window.
    pub title: String,
    /// Size at first, in pixels.
    pub size: (u16, u16),
    /// The camera. Otherwise the whole tree is seen.
    pub navigator: Option<Navigator>,
    /// Lines and names over the bodies.
    pub marks: Marks,
}

/// The state of an open window.
struct Show<'s> {
    model: &'s dyn Fn() -> Option<Arc<InnerModel>>,
    tree: Arc<Snapshot>,
    clouds: Clouds,
    viewport: Viewport,
    say: &'s dyn Fn(&str),
}

/// Shows the newest version of a tree and its point clouds in a window, until its user closes it or
/// `model` returns nothing. `say` gets a line for each picked node and each mesh that cannot be read.
///
/// The left button turns, the right one moves, the wheel zooms, a click picks. The key `f` switches
/// frames, `n` names, `r` returns to the first view, `q` ends.
pub fn run(
    model: &dyn Fn() -> Option<Arc<InnerModel>>,
    options: &Options,
    say: &dyn Fn(&str),
) -> Result<(), WindowError> {
    let Some(first) = model() else {
        return Ok(());
    };
    let (tree, clouds) = (first.snapshot(), first.clouds());
    let navigator = options.navigator.clone();
    let navigator = navigator.unwrap_or_else(|| Navigator::around(&tree, &clouds));
    let mut show = Show {
        model,
        tree,
        clouds,
        viewport: Viewport::new(navigator, options.marks),
        say,
    };
    content::show(&options.title, options.size, &mut show)
}

impl Content for Show<'_> {
    fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge> {
        let drawn = self.viewport.draw(&self.tree, &self.clouds, size, self.say);
        let mut image = drawn?;
        let help = "drag: turn, right: move, wheel: zoom, click: pick, f: frames, n: names, q: end";
        let bottom = image.height as f64 - 12.0;
        overlay::text(&mut image, 4.0, bottom, help);
        Ok(image)
    }

    fn input(&mut self, input: Input) -> ViewerAction {
        match input {
            Input::Redraw => return ViewerAction::Draw,
            Input::Close | Input::Key(Key::Escape | Key::Character('q'), _) => {
                return ViewerAction::End;
            }
            Input::Key(key, _) => return self.viewport.key(key),
            _ => {}
        }
        match self.viewport.input(input) {
            Gesture::None => ViewerAction::Nothing,
            Gesture::Camera => ViewerAction::Draw,
            Gesture::Click(at) => {
                self.pick(self.viewport.node(at));
                ViewerAction::Draw
            }
        }
    }

    /// Looks for a new version of the tree.
    fn poll(&mut self) -> ViewerAction {
        let Some(model) = (self.model)() else {
            return ViewerAction::End;
        };
        let (newest, points) = (model.snapshot(), model.clouds());
        if newest.version() == self.tree.version() && points.is_same(&self.clouds) {
            return ViewerAction::Nothing;
        }
        (self.tree, self.clouds) = (newest, points);
        ViewerAction::Draw
    }
}

impl Show<'_> {
    fn pick(&mut self, node: Option<NodeId>) {
        self.viewport.marks.picked = node;
        let Some(node) = node.and_then(|node| self.tree.node(node).ok()) else {
            return;
        };
        let pose = node.to_root().pose();
        let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
        let (id, tag) = (clean(node.id()), node.kind().tag());
        (self.say)(&format!(
            "{id} ({tag}): {x:.1} {y:.1} {z:.1} mm, {rx:.4} {ry:.4} {rz:.4} rad in the root"
        ));
    }
}
