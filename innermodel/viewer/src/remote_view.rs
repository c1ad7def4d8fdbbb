//! A world of another process in a window: that process draws each picture.

use crate::content::{self, Content};
use crate::input::{Input, Key, ViewerAction};
use crate::navigator::Navigator;
use crate::overlay;
use crate::steering::{Gesture, Steering};
use crate::window::WindowError;
use innermodel_render::{Image, TooLarge, View};
use std::io::Cursor;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// The pause between two pictures, and the one after an error.
const PAUSE: Duration = Duration::from_millis(50);
const PAUSE_AFTER_ERROR: Duration = Duration::from_secs(1);
/// The most pixels of a side of a picture.
const LARGEST: usize = 4096;

/// The colour around a picture that is smaller than the window.
const BESIDE: [u8; 3] = [40; 3];

/// A picture as rows of colours from the top left.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Pixels of a row.
    pub width: usize,
    /// Red, green and blue of each pixel.
    pub colours: Vec<[u8; 3]>,
}

impl Picture {
    /// The colours of a PNG file. The error is a sentence.
    pub fn of_png(bytes: &[u8]) -> Result<Self, String> {
        let wrong = |error: png::DecodingError| format!("the picture cannot be read: {error}");
        let mut decoder = png::Decoder::new(Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(wrong)?;
        let (width, height) = (reader.info().width as usize, reader.info().height as usize);
        let is_rgb = reader.output_color_type().0 == png::ColorType::Rgb;
        if !is_rgb || width.max(height) > LARGEST {
            return Err(format!(
                "expected a picture of at most {LARGEST} pixels a side"
            ));
        }
        let mut colours = vec![[0; 3]; width * height];
        let read = reader.next_frame(colours.as_flattened_mut());
        read.map_err(wrong)?;
        Ok(Self { width, colours })
    }
}

/// The request for a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureRequest {
    /// Its size in pixels.
    pub size: (usize, usize),
    /// The camera of the user. Without one, the other process chooses.
    pub view: Option<View>,
}

/// A camera that the user moves.
#[derive(Clone, Debug)]
pub struct Steered {
    /// Where it begins.
    pub navigator: Navigator,
    /// Whether pictures are asked from there at once, so that the camera rests while bodies move.
    /// Otherwise, the other process chooses where it is until the user has moved it.
    pub sees_all: bool,
}

/// The state that both threads share.
struct Shared {
    wish: PictureRequest,
    newest: Result<Picture, String>,
    /// How many pictures there were.
    number: u64,
    is_over: bool,
}

/// Shows the pictures that `ask` returns, one after the other, in a window, until its user closes
/// it. `first` is the first one. The user moves the camera `steered`. A thread of its own asks, so a
/// slow answer does not hold the window; after the end, its last answer is not waited for.
pub fn watch(
    title: &str,
    size: (u16, u16),
    first: Picture,
    steered: Option<Steered>,
    ask: impl Fn(&PictureRequest) -> Result<Picture, String> + Send + 'static,
) -> Result<(), WindowError> {
    let pixels = (size.0.into(), size.1.into());
    let sees_all = steered.as_ref().is_some_and(|steered| steered.sees_all);
    let navigator = steered.map(|steered| steered.navigator);
    let begin = navigator.as_ref().filter(|_| sees_all);
    let wish = PictureRequest {
        size: pixels,
        view: begin.map(|navigator| navigator.view(pixels.0, pixels.1)),
    };
    let shared = Shared {
        wish,
        newest: Ok(first),
        number: 0,
        is_over: false,
    };
    let shared = Arc::new((Mutex::new(shared), Condvar::new()));
    let (asked, others) = (Arc::clone(&shared), Arc::clone(&shared));
    let asking = thread::Builder::new().name("pictures".to_owned());
    let asking = asking.spawn(move || keep_asking(&asked, ask));
    asking.map_err(|error| WindowError::Connect(error.into()))?;
    let mut view = RemoteView {
        shared,
        steering: navigator.map(Steering::new),
        sees_all,
        is_steered: sees_all,
        shown: 0,
        last: Picture::default(),
        size: None,
    };
    let shown = content::show(title, size, &mut view, &|| true);
    locked(&others.0).is_over = true;
    others.1.notify_all();
    shown
}

fn locked(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn keep_asking(
    (shared, wakes): &(Mutex<Shared>, Condvar),
    ask: impl Fn(&PictureRequest) -> Result<Picture, String>,
) {
    loop {
        let wish = locked(shared).wish.clone();
        let answer = ask(&wish);
        let pause = match answer {
            Ok(_) => PAUSE,
            Err(_) => PAUSE_AFTER_ERROR,
        };
        let mut state = locked(shared);
        state.newest = answer;
        state.number += 1;
        let waited = wakes.wait_timeout_while(state, pause, |state| !state.is_over);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if state.is_over {
            return;
        }
    }
}

struct RemoteView {
    shared: Arc<(Mutex<Shared>, Condvar)>,
    /// None if the camera is one of the scene.
    steering: Option<Steering>,
    sees_all: bool,
    /// Whether pictures are asked from where its camera is.
    is_steered: bool,
    /// The number of the picture that is shown.
    shown: u64,
    last: Picture,
    size: Option<(usize, usize)>,
}

impl RemoteView {
    /// Sets the view of the next picture.
    fn wish(&mut self, (width, height): (usize, usize)) {
        let size = (width.clamp(1, LARGEST), height.clamp(1, LARGEST));
        self.size = Some(size);
        let steering = self.steering.as_ref().filter(|_| self.is_steered);
        let view = steering.map(|steering| steering.navigator.view(size.0, size.1));
        locked(&self.shared.0).wish = PictureRequest { size, view };
    }
}

impl Content for RemoteView {
    fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge> {
        self.wish(size);
        let mut problem = String::new();
        {
            let state = locked(&self.shared.0);
            self.shown = state.number;
            match &state.newest {
                Ok(picture) => self.last = picture.clone(),
                Err(error) => problem.clone_from(error),
            }
        }
        let mut image = Image {
            width: size.0,
            height: size.1,
            colours: vec![BESIDE; size.0 * size.1],
            depths: Vec::new(),
            nodes: Vec::new(),
        };
        let rows = self.last.colours.chunks(self.last.width.max(1));
        for (to, from) in image.colours.chunks_mut(size.0.max(1)).zip(rows) {
            let width = to.len().min(from.len());
            to[..width].copy_from_slice(&from[..width]);
        }
        overlay::text(&mut image, 4.0, 4.0, &problem);
        if self.steering.is_some() {
            let help = "drag: turn, right: move, wheel: zoom, r: first view, q: end";
            overlay::text(&mut image, 4.0, size.1 as f64 - 12.0, help);
        }
        Ok(image)
    }

    fn input(&mut self, input: Input) -> ViewerAction {
        match input {
            Input::Redraw => return ViewerAction::Draw,
            Input::Close | Input::Key(Key::Escape | Key::Character('q'), _) => {
                return ViewerAction::End;
            }
            Input::Key(Key::Character('r'), _) => {
                if let Some(steering) = &mut self.steering {
                    steering.reset();
                }
                self.is_steered = self.sees_all;
            }
            _ => {
                let steering = self.steering.as_mut();
                let gesture = steering.map(|steering| steering.input(input, self.size));
                if !matches!(gesture, Some(Gesture::Camera)) {
                    return ViewerAction::Nothing;
                }
                self.is_steered = true;
            }
        }
        if let Some(size) = self.size {
            self.wish(size);
        }
        ViewerAction::Nothing
    }

    fn poll(&mut self) -> ViewerAction {
        if locked(&self.shared.0).number == self.shown {
            return ViewerAction::Nothing;
        }
        ViewerAction::Draw
    }
}
