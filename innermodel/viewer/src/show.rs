//! The window and its user: orbit, pick, frames and names.

use crate::navigator::{Navigator, scene};
use crate::overlay::{self, Marks};
use crate::window::{Input, Window, WindowError};
use innermodel::{Clouds, InnerModel, NodeId, Snapshot};
use innermodel_render::{Image, Scene};
use rc_diagnostics::foreign::clean;
use std::sync::Arc;
use std::time::Duration;

/// How often a new version of the tree is looked for.
const PAUSE: Duration = Duration::from_millis(30);
/// The keys, by their numbers in X11.
const ESCAPE: u32 = 0xff1b;

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
    scene: Scene,
    navigator: Navigator,
    marks: Marks,
    /// The button that is down, and where it was pressed and last seen.
    drag: Option<Drag>,
    say: &'s dyn Fn(&str),
}

struct Drag {
    button: u8,
    start: (i16, i16),
    last: (i16, i16),
}

/// Effect of a key or a button; of several, the greatest counts.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum ViewerAction {
    Nothing,
    Draw,
    End,
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
    let seen = || model().map(|model| (model.snapshot(), model.clouds()));
    let Some((mut now, mut clouds)) = seen() else {
        return Ok(());
    };
    let mut window = Window::open(&options.title, options.size)?;
    let first = options.navigator.clone();
    let first = first.unwrap_or_else(|| Navigator::around(&now, &clouds));
    let mut show = Show {
        scene: Scene::new(),
        navigator: first.clone(),
        marks: options.marks,
        drag: None,
        say,
    };
    let mut image = show.draw(&window, &now, &clouds)?;
    loop {
        window.show(&image)?;
        let mut action = ViewerAction::Nothing;
        while action == ViewerAction::Nothing {
            let inputs = window.inputs(PAUSE)?;
            for input in inputs {
                let new = show.input(input, &window, &image, &now, &first);
                action = action.max(new);
            }
            let Some((newest, points)) = seen() else {
                return Ok(());
            };
            if newest.version() != now.version() || !points.is_same(&clouds) {
                (now, clouds) = (newest, points);
                action = action.max(ViewerAction::Draw);
            }
        }
        if action == ViewerAction::End {
            return Ok(());
        }
        image = show.draw(&window, &now, &clouds)?;
    }
}

impl Show<'_> {
    fn draw(
        &mut self,
        window: &Window,
        tree: &Snapshot,
        clouds: &Clouds,
    ) -> Result<Image, WindowError> {
        let (width, height) = window.size();
        // A window has at most 65,535 pixels in a row; the image has a bound.
        let (width, height) = (width.clamp(1, 4096), height.clamp(1, 4096));
        let view = self.navigator.view(width, height);
        self.scene.set_clouds(clouds.clone());
        let drawn = self.scene.draw(tree, &view);
        for problem in self.scene.problems() {
            (self.say)(&format!(
                "`{}` is not drawn as the file says: {}",
                clean(&problem.id),
                clean(&problem.error.to_string())
            ));
        }
        let mut image = drawn?;
        let length = scene(tree, clouds).1 * 0.08;
        overlay::draw(&mut image, tree, &view, self.marks, length);
        let help = "drag: turn, right: move, wheel: zoom, click: pick, f: frames, n: names, q: end";
        overlay::text(&mut image, 4.0, height as f64 - 12.0, help);
        Ok(image)
    }

    fn input(
        &mut self,
        input: Input,
        window: &Window,
        image: &Image,
        tree: &Snapshot,
        first: &Navigator,
    ) -> ViewerAction {
        match input {
            Input::Redraw => ViewerAction::Draw,
            Input::Close => ViewerAction::End,
            Input::Key(key) => self.key(key, first),
            Input::Pressed(button @ (4 | 5), ..) => {
                self.navigator.zoom(if button == 4 { 1 } else { -1 });
                ViewerAction::Draw
            }
            Input::Pressed(button, x, y) => {
                let (start, last) = ((x, y), (x, y));
                self.drag = Some(Drag {
                    button,
                    start,
                    last,
                });
                ViewerAction::Nothing
            }
            Input::Moved(x, y) => {
                let Some(drag) = &mut self.drag else {
                    return ViewerAction::Nothing;
                };
                let part = |now: i16, last: i16| {
                    (f64::from(now) - f64::from(last)) / window.size().0.max(window.size().1) as f64
                };
                let (right, down) = (part(x, drag.last.0), part(y, drag.last.1));
                drag.last = (x, y);
                if drag.button == 1 {
                    self.navigator.orbit(right, down);
                } else {
                    self.navigator.pan(right, down);
                }
                ViewerAction::Draw
            }
            Input::Released(button, x, y) => {
                let drag = self.drag.take();
                let is_click = drag.is_some_and(|drag| drag.start == (x, y) && drag.button == 1);
                if button != 1 || !is_click {
                    return ViewerAction::Nothing;
                }
                let place = usize::try_from(x).ok().zip(usize::try_from(y).ok());
                self.pick(place.and_then(|(x, y)| image.node(x, y)), tree);
                ViewerAction::Draw
            }
        }
    }

    fn key(&mut self, key: u32, first: &Navigator) -> ViewerAction {
        match char::from_u32(key) {
            Some('f') => self.marks.frames = !self.marks.frames,
            Some('n') => self.marks.names = !self.marks.names,
            Some('r') => self.navigator = first.clone(),
            Some('q') => return ViewerAction::End,
            _ if key == ESCAPE => return ViewerAction::End,
            _ => return ViewerAction::Nothing,
        }
        ViewerAction::Draw
    }

    fn pick(&mut self, node: Option<NodeId>, tree: &Snapshot) {
        self.marks.picked = node;
        let Some(node) = node.and_then(|node| tree.node(node).ok()) else {
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
