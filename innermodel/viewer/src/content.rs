//! The content of a window, and the loop between both.

use crate::input::{Input, ViewerAction};
use crate::window::{Window, WindowError};
use innermodel_render::{Image, TooLarge};
use std::time::Duration;

/// How often a content is asked whether it has changed.
const PAUSE: Duration = Duration::from_millis(30);

/// The content of a window.
pub(crate) trait Content {
    /// The picture for a window of this size in pixels.
    fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge>;
    /// An action of the user.
    fn input(&mut self, input: Input) -> ViewerAction;
    /// Whether something else is to be shown.
    fn poll(&mut self) -> ViewerAction;
}

/// Shows a content in a window, until it ends or `is_on` is false.
pub(crate) fn show(
    title: &str,
    size: (u16, u16),
    content: &mut dyn Content,
    is_on: &dyn Fn() -> bool,
) -> Result<(), WindowError> {
    let mut window = Window::open(title, size)?;
    loop {
        window.show(&content.draw(window.size())?)?;
        let mut action = ViewerAction::Nothing;
        while action == ViewerAction::Nothing {
            for input in window.inputs(PAUSE)? {
                action = action.max(content.input(input));
            }
            action = action.max(content.poll());
            if !is_on() {
                return Ok(());
            }
        }
        if action == ViewerAction::End {
            return Ok(());
        }
    }
}
