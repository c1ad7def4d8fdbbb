//! The camera of a window, as its user moves it with the pointer.

use crate::input::{Input, Pixel};
use crate::navigator::Navigator;

/// A camera with the drag that moves it.
pub(crate) struct Steering {
    pub(crate) navigator: Navigator,
    first: Navigator,
    /// The button that is down, and where it was pressed and last seen.
    drag: Option<Drag>,
}

struct Drag {
    button: u8,
    start: Pixel,
    last: Pixel,
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

impl Steering {
    pub(crate) fn new(navigator: Navigator) -> Self {
        Self {
            first: navigator.clone(),
            navigator,
            drag: None,
        }
    }

    /// Returns to the first view.
    pub(crate) fn reset(&mut self) {
        self.navigator = self.first.clone();
    }

    /// Moves the camera over an image of this size: the left button turns it, the others move it,
    /// the wheel zooms.
    pub(crate) fn input(&mut self, input: Input, size: Option<(usize, usize)>) -> Gesture {
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
                let (Some(drag), Some((width, height))) = (&mut self.drag, size) else {
                    return Gesture::None;
                };
                let size = width.max(height) as f64;
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
}
