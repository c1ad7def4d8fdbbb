//! A tree in a window: its user looks around, picks nodes, and moves and pushes objects.

use crate::actions::Actions;
use crate::content::{self, Content};
use crate::grab::{self, Grab, Grip};
use crate::input::{Input, Key, Modifiers, Pixel, ViewerAction};
use crate::navigator::Navigator;
use crate::overlay::{self, Marks};
use crate::steering::Gesture;
use crate::viewport::Viewport;
use crate::window::WindowError;
use innermodel::{Clouds, InnerModel, NodeRef, Snapshot};
use innermodel_render::{Image, TooLarge};
use rc_diagnostics::foreign::clean;
use std::sync::Arc;

/// The colour of the way of the pointer.
const WAY: [u8; 3] = [255, 255, 0];

/// The initial state of a window.
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

/// The newest version of a tree as its user sees it, without the window: it takes actions and draws
/// pictures.
///
/// The left button turns the view, the right one moves it, the wheel zooms, a click picks. The key
/// `p` picks the node above, `f` switches frames, `n` names, `r` returns to the first view, `q`
/// ends.
pub struct TreeView<'s> {
    model: Arc<InnerModel>,
    tree: Arc<Snapshot>,
    clouds: Clouds,
    viewport: Viewport,
    /// Where changes go, if the tree can be changed.
    actions: Option<Actions>,
    grab: Option<Grab>,
    /// The button that holds it.
    grab_button: u8,
    /// Why an object cannot be taken, moved or pushed.
    refusal: String,
    say: &'s dyn Fn(&str),
}

/// Shows the newest version of a tree and its point clouds in a window, until its user closes it or
/// `is_on` is false. `say` gets a line for each picked node and each mesh that cannot be read.
pub fn run(
    model: &Arc<InnerModel>,
    options: &Options,
    actions: Option<Actions>,
    is_on: &dyn Fn() -> bool,
    say: &dyn Fn(&str),
) -> Result<(), WindowError> {
    let mut view = TreeView::new(Arc::clone(model), options, say);
    view.actions = actions;
    content::show(&options.title, options.size, &mut view, is_on)
}

impl<'s> TreeView<'s> {
    /// A view of a tree that cannot be changed.
    pub fn new(model: Arc<InnerModel>, options: &Options, say: &'s dyn Fn(&str)) -> Self {
        let (tree, clouds) = (model.snapshot(), model.clouds());
        let (navigator, marks) = (options.navigator.clone(), options.marks);
        let size = (options.size.0.into(), options.size.1.into());
        let viewport = Viewport::new(&tree, &clouds, navigator, size, marks);
        Self {
            model,
            tree,
            clouds,
            viewport,
            actions: None,
            grab: None,
            grab_button: 0,
            refusal: String::new(),
            say,
        }
    }

    /// Lets the user move and push objects: Ctrl and the left button move one over the floor, the
    /// right one up and down, Shift and the left button push it.
    #[must_use]
    pub fn with_actions(mut self, actions: Actions) -> Self {
        self.actions = Some(actions);
        self
    }

    /// Draws a picture of this size in pixels. Actions refer to the last one.
    pub fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge> {
        let drawn = self.viewport.draw(&self.tree, &self.clouds, size, self.say);
        let mut image = drawn?;
        let bottom = image.height as f64 - 12.0;
        let help = "drag: turn, right: move, wheel: zoom, click: pick, p: above, f: frames, n: names, q: end";
        overlay::text(&mut image, 4.0, bottom, help);
        if self.actions.is_some() {
            let help = "Ctrl+drag: move object, Ctrl+right: lift it, Shift+drag: push it";
            overlay::text(&mut image, 4.0, bottom - 10.0, help);
        }
        overlay::text(&mut image, 4.0, 4.0, &self.refusal);
        let Some(grab) = &self.grab else {
            return Ok(image);
        };
        if let Some(view) = self.viewport.view()
            && let (Some(start), Some(end)) = (view.pixel(&grab.start), view.pixel(&grab.end))
        {
            overlay::thick_line(&mut image, start, end, WAY);
            overlay::text(&mut image, end.0 + 6.0, end.1 + 6.0, &grab.label());
        }
        Ok(image)
    }

    /// Takes an action of the user.
    pub fn input(&mut self, input: Input) -> ViewerAction {
        match input {
            Input::Redraw => return ViewerAction::Draw,
            Input::Key(Key::Escape, _) if self.grab.is_some() => {
                let undone = self.grab.take().and_then(|grab| grab.undo());
                if let (Some(actions), Some(undone)) = (&self.actions, undone) {
                    actions.push(undone);
                }
                return ViewerAction::Draw;
            }
            Input::Close | Input::Key(Key::Escape | Key::Character('q'), _) => {
                return ViewerAction::End;
            }
            Input::Key(Key::Character('p'), _) => {
                let tree = Arc::clone(&self.tree);
                let picked = self.picked(&tree).and_then(|node| node.parent());
                self.pick(picked);
                return ViewerAction::Draw;
            }
            Input::Key(key, _) => return self.viewport.key(key),
            _ => {}
        }
        if self.grabbed(input) {
            return ViewerAction::Draw;
        }
        match self.viewport.input(input) {
            Gesture::None => ViewerAction::Nothing,
            Gesture::Camera => ViewerAction::Draw,
            Gesture::Click(at) => {
                let tree = Arc::clone(&self.tree);
                let node = self.viewport.node(at);
                self.pick(node.and_then(|node| tree.node(node).ok()));
                ViewerAction::Draw
            }
        }
    }

    /// Takes, moves or lets go an object. Returns whether the action was for that.
    fn grabbed(&mut self, input: Input) -> bool {
        let Some(actions) = self.actions.clone() else {
            return false;
        };
        match (input, &mut self.grab) {
            (Input::Pressed(button, at, with), None) => {
                let Some(grip) = grip(button, with) else {
                    return false;
                };
                self.refusal.clear();
                self.grab_button = button;
                match self.take(at, grip) {
                    Ok(grab) => self.grab = grab,
                    Err(reason) => self.refusal = reason,
                }
                true
            }
            (Input::Moved(at), Some(grab)) => {
                if let Some(sight) = self.viewport.sight(at) {
                    grab.follow(&sight);
                }
                if grab.moves() {
                    actions.push(grab.action());
                }
                true
            }
            // A notch of the wheel is a press and a release of another button.
            (Input::Released(button, _), Some(_)) if button == self.grab_button => {
                if let Some(grab) = self.grab.take()
                    && !grab.moves()
                {
                    actions.push(grab.action());
                }
                true
            }
            (_, Some(_)) => true,
            _ => false,
        }
    }

    /// Takes the object at a pixel. There is none in the background.
    fn take(&self, at: Pixel, grip: Grip) -> Result<Option<Grab>, String> {
        let body = self.viewport.node(at);
        let body = body.and_then(|body| self.tree.node(body).ok());
        let (Some(body), Some(start), Some(sight)) =
            (body, self.viewport.point(at), self.viewport.sight(at))
        else {
            return Ok(None);
        };
        let object = match grip {
            Grip::Push => grab::pushed(body)?,
            Grip::Slide | Grip::Lift => grab::object(body, self.picked(&self.tree))?,
        };
        Ok(Some(Grab::new(&object, grip, start, &sight)))
    }

    /// Looks for a new version of the tree.
    pub fn poll(&mut self) -> ViewerAction {
        let mut action = ViewerAction::Nothing;
        if let Some(actions) = &self.actions {
            // A body that the user holds does not fall.
            if let Some(grab) = self.grab.as_ref().filter(|grab| grab.moves()) {
                actions.push(grab.action());
            }
            if let Some(reason) = actions.refusal().filter(|new| *new != self.refusal) {
                self.refusal = reason;
                action = ViewerAction::Draw;
            }
        }
        let (newest, points) = (self.model.snapshot(), self.model.clouds());
        if newest.version() == self.tree.version() && points.is_same(&self.clouds) {
            return action;
        }
        (self.tree, self.clouds) = (newest, points);
        ViewerAction::Draw
    }

    fn picked<'t>(&self, tree: &'t Snapshot) -> Option<NodeRef<'t>> {
        let picked = self.viewport.marks.picked?;
        tree.node(picked).ok()
    }

    fn pick(&mut self, node: Option<NodeRef<'_>>) {
        self.viewport.marks.picked = node.map(|node| node.node_id());
        let Some(node) = node else {
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

/// The effect of a button on an object, with the modifier keys.
fn grip(button: u8, with: Modifiers) -> Option<Grip> {
    match (button, with.control, with.shift) {
        (1, true, false) => Some(Grip::Slide),
        (3, true, false) => Some(Grip::Lift),
        (1, false, true) => Some(Grip::Push),
        _ => None,
    }
}

impl Content for TreeView<'_> {
    fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge> {
        Self::draw(self, size)
    }

    fn input(&mut self, input: Input) -> ViewerAction {
        Self::input(self, input)
    }

    fn poll(&mut self) -> ViewerAction {
        Self::poll(self)
    }
}
