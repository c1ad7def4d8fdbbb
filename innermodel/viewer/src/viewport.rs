//! The picture of a tree in a window, and the camera that its user moves.

use crate::input::{Input, Key, Pixel, ViewerAction};
use crate::navigator::{Navigator, scene};
use crate::overlay::{self, Marks};
use crate::sight::Sight;
use crate::steering::{Gesture, Steering};
use innermodel::{Clouds, NodeId, Point, Snapshot};
use innermodel_render::{Image, Scene, TooLarge, View};
use rc_diagnostics::foreign::clean;

/// The most pixels of a side of the picture. A window may be larger; the image has a bound.
const LARGEST: usize = 4096;

/// The picture of a tree in a window, and the camera that its user moves.
pub(crate) struct Viewport {
    scene: Scene,
    pub(crate) steering: Steering,
    pub(crate) marks: Marks,
    /// The visible part.
    seen: Option<Seen>,
}

struct Seen {
    view: View,
    width: usize,
    height: usize,
    nodes: Vec<Option<NodeId>>,
    depths: Vec<f64>,
}

impl Viewport {
    /// A picture of a tree. Without a `navigator`, the camera sees the whole tree on an image of
    /// this size.
    pub(crate) fn new(
        tree: &Snapshot,
        clouds: &Clouds,
        navigator: Option<Navigator>,
        size: (usize, usize),
        marks: Marks,
    ) -> Self {
        let mut scene = Scene::new();
        scene.set_clouds(clouds.clone());
        let navigator =
            navigator.unwrap_or_else(|| Navigator::around(tree, &scene.extents(tree), size));
        Self {
            scene,
            steering: Steering::new(navigator),
            marks,
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
        let view = self.steering.navigator.view(width, height);
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
        let length = if self.marks == Marks::default() {
            0.0
        } else {
            scene(&self.scene.extents(tree)).1 * 0.08
        };
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

    /// Moves the camera.
    pub(crate) fn input(&mut self, input: Input) -> Gesture {
        let size = self.seen.as_ref().map(|seen| (seen.width, seen.height));
        self.steering.input(input, size)
    }

    /// Keys of every window: `f` switches frames, `n` names, `r` returns to the first view.
    pub(crate) fn key(&mut self, key: Key) -> ViewerAction {
        match key {
            Key::Character('f') => self.marks.frames = !self.marks.frames,
            Key::Character('n') => self.marks.names = !self.marks.names,
            Key::Character('r') => self.steering.reset(),
            _ => return ViewerAction::Nothing,
        }
        ViewerAction::Draw
    }
}
