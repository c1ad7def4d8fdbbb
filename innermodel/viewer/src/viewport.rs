//! The picture of a tree in a window, and the camera that its user moves.

use crate::input::{Input, Key, Pixel, ViewerAction};
use crate::navigator::{Navigator, scene};
use crate::overlay::{self, Marks};
use crate::sight::Sight;
use innermodel::{Clouds, NodeId, Point, Snapshot};
use innermodel_render::{Image, Scene, TooLarge, View};
use rc_diagnostics::foreign::clean;

/// The most pixels of a side of the picture. A window may be larger; the image has a bound.
const LARGEST: usize = 4096;

/// The picture of a tree in a window, and the camera that its user moves.
pub(crate) struct Viewport {
    scene: Scene,
    pub(crate) navigator: Navigator,
    first: Navigator,
    pub(crate) marks: Marks,
    /// The button that is down, and where it was pressed and last seen.
    drag: Option<Drag>,
    /// What the user sees.
    seen: Option<Seen>,
}

struct Drag {
    button: u8,
    start: Pixel,
    last: Pixel,
}

struct Seen {
    view: View,
    width: usize,
    height: usize,
    nodes: Vec<Option<NodeId>>,
    depths: Vec<f64>,
}

/// Meaning of an action for the camera.
pub(crate) enum Gesture {
    /// None.
    None,
    /// The camera moved.
    Camera,
    /// The user clicked at a place without moving the camera.
    Click(Pixel),
}

impl Viewport {
    pub(crate) fn new(navigator: Navigator, marks: Marks) -> Self {
        Self {
            scene: Scene::new(),
            first: navigator.clone(),
            navigator,
            marks,
            drag: None,
            seen: None,
        }
    }

    /// Draws a tree with its marks. `say` gets a line for each file that cannot be drawn.
    pub(crate) fn draw(
        &mut self,
        tree: &Snapshot,
        clouds: &Clouds,
        (width, height): (usize, usize),
        say: &dyn Fn(&str),
    ) -> Result<Image, TooLarge> {
        let (width, height) = (width.clamp(1, LARGEST), height.clamp(1, LARGEST));
        let view = self.navigator.view(width, height);
        self.scene.set_clouds(clouds.clone());
        let drawn = self.scene.draw(tree, &view);
        for problem in self.scene.problems() {
            say(&format!(
                "`{}` is not drawn as the file says: {}",
                clean(&problem.id),
                clean(&problem.error.to_string())
            ));
        }
        let mut image = drawn?;
        let length = scene(tree, clouds).1 * 0.08;
        overlay::draw(&mut image, tree, &view, self.marks, length);
        self.seen = Some(Seen {
            view,
            width,
            height,
            // A window shows the colours only.
            nodes: std::mem::take(&mut image.nodes),
            depths: std::mem::take(&mut image.depths),
        });
        Ok(image)
    }

    /// Reads meshes and textures again for the next picture.
    pub(crate) fn forget_files(&mut self) {
        self.scene = Scene::new();
    }

    /// The view that the user sees.
    pub(crate) fn view(&self) -> Option<&View> {
        self.seen.as_ref().map(|seen| &seen.view)
    }

    /// The node at a pixel.
    pub(crate) fn node(&self, at: Pixel) -> Option<NodeId> {
        let (seen, place) = self.place(at)?;
        *seen.nodes.get(place)?
    }

    /// The point of the root at a pixel, on the surface that is seen there.
    pub(crate) fn point(&self, at: Pixel) -> Option<Point> {
        let (seen, place) = self.place(at)?;
        let depth = *seen.depths.get(place)?;
        let sight = self.sight(at)?;
        depth
            .is_finite()
            .then(|| sight.from + sight.direction * depth)
    }

    fn place(&self, (x, y): Pixel) -> Option<(&Seen, usize)> {
        let seen = self.seen.as_ref()?;
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < seen.width && y < seen.height).then_some((seen, y * seen.width + x))
    }

    /// The line of sight at the centre of a pixel.
    pub(crate) fn sight(&self, (x, y): Pixel) -> Option<Sight> {
        let View { place, camera } = self.view()?;
        let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        Some(Sight {
            from: Point::from(place.translation),
            direction: place.vector(&innermodel::sensors::ray(camera, u, v)),
        })
    }

    /// Moves the camera: the left button turns it, the others move it, the wheel zooms.
    pub(crate) fn input(&mut self, input: Input) -> Gesture {
        match input {
            Input::Pressed(button @ (4 | 5), ..) => {
                self.navigator.zoom(if button == 4 { 1 } else { -1 });
                Gesture::Camera
            }
            Input::Pressed(button, at, _) => {
                let (start, last) = (at, at);
                self.drag = Some(Drag {
                    button,
                    start,
                    last,
                });
                Gesture::None
            }
            Input::Moved(at) => {
                let (Some(drag), Some(seen)) = (&mut self.drag, &self.seen) else {
                    return Gesture::None;
                };
                let size = seen.width.max(seen.height) as f64;
                let part = |now: i16, last: i16| (f64::from(now) - f64::from(last)) / size;
                let (right, down) = (part(at.0, drag.last.0), part(at.1, drag.last.1));
                drag.last = at;
                if drag.button == 1 {
                    self.navigator.orbit(right, down);
                } else {
                    self.navigator.pan(right, down);
                }
                Gesture::Camera
            }
            Input::Released(button, at) => {
                // A notch of the wheel is a press and a release of another button.
                let drag = self.drag.take_if(|drag| drag.button == button);
                let is_click = drag.is_some_and(|drag| drag.start == at && drag.button == 1);
                if button == 1 && is_click {
                    Gesture::Click(at)
                } else {
                    Gesture::None
                }
            }
            Input::Redraw | Input::Key(..) | Input::Close => Gesture::None,
        }
    }

    /// Keys of every window: `f` switches frames, `n` names, `r` returns to the first view.
    pub(crate) fn key(&mut self, key: Key) -> ViewerAction {
        match key {
            Key::Character('f') => self.marks.frames = !self.marks.frames,
            Key::Character('n') => self.marks.names = !self.marks.names,
            Key::Character('r') => self.navigator = self.first.clone(),
            _ => return ViewerAction::Nothing,
        }
        ViewerAction::Draw
    }
}
