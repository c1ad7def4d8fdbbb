//! A window of X11: shows images, and returns what its user does.

use crate::input::{Input, Key, Modifiers};
use innermodel_render::{Image, TooLarge};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::time::Duration;
use thiserror::Error;
use x11rb::connection::{Connection, RequestConnection as _};
use x11rb::errors::{ConnectError, ConnectionError, ReplyError, ReplyOrIdError};
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ConnectionExt, CreateGCAux, CreateWindowAux, EventMask, Gcontext, ImageFormat,
    ImageOrder, KeyButMask, PropMode, Screen, Window as WindowId, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// Error of a window that cannot be opened.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WindowError {
    /// There is no display, or it refuses the connection.
    #[error("cannot open a window: {0}")]
    Connect(#[from] ConnectError),
    /// The display was closed.
    #[error("the display has gone: {0}")]
    Lost(String),
    /// Another program has destroyed it.
    #[error("another program has destroyed the window")]
    Destroyed,
    /// The display has colours that are not supported.
    #[error("the display has no colours of 24 bits")]
    Colours,
    /// The window is too large.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}

impl From<ConnectionError> for WindowError {
    fn from(error: ConnectionError) -> Self {
        Self::Lost(error.to_string())
    }
}

impl From<ReplyError> for WindowError {
    fn from(error: ReplyError) -> Self {
        Self::Lost(error.to_string())
    }
}

impl From<ReplyOrIdError> for WindowError {
    fn from(error: ReplyOrIdError) -> Self {
        Self::Lost(error.to_string())
    }
}

fn modifiers(state: KeyButMask) -> Modifiers {
    Modifiers {
        shift: state.contains(KeyButMask::SHIFT),
        control: state.contains(KeyButMask::CONTROL),
    }
}

/// Where a colour has its eight bits in a pixel.
#[derive(Clone, Copy, Debug)]
struct Shifts([u32; 3]);

/// An open window. Dropping it closes it.
pub(crate) struct Window {
    connection: RustConnection,
    id: WindowId,
    context: Gcontext,
    depth: u8,
    shifts: Shifts,
    size: (u16, u16),
    delete: u32,
    least_key: u8,
    keys_each: usize,
    keys: Vec<u32>,
}

fn shifts(screen: &Screen) -> Option<Shifts> {
    let depths = screen.allowed_depths.iter();
    let mut visuals = depths.flat_map(|depth| &depth.visuals);
    let visual = visuals.find(|visual| visual.visual_id == screen.root_visual)?;
    let masks = [visual.red_mask, visual.green_mask, visual.blue_mask];
    let is_byte = |mask: &u32| mask.count_ones() == 8;
    let known = matches!(screen.root_depth, 24 | 32) && masks.iter().all(is_byte);
    known.then(|| Shifts(masks.map(u32::trailing_zeros)))
}

/// Whether the display of the environment takes connections.
pub(crate) fn reach() -> Result<(), WindowError> {
    x11rb::connect(None)?;
    Ok(())
}

impl Window {
    /// Opens a window on the display of the environment.
    pub(crate) fn open(title: &str, size: (u16, u16)) -> Result<Self, WindowError> {
        let (connection, number) = x11rb::connect(None)?;
        let setup = connection.setup();
        let screen = setup.roots.get(number).ok_or(WindowError::Colours)?;
        let shifts = shifts(screen).ok_or(WindowError::Colours)?;
        let (root, visual, depth) = (screen.root, screen.root_visual, screen.root_depth);
        let (least_key, most_key) = (setup.min_keycode, setup.max_keycode);
        let (id, context) = (connection.generate_id()?, connection.generate_id()?);
        let events = EventMask::EXPOSURE
            | EventMask::STRUCTURE_NOTIFY
            | EventMask::KEY_PRESS
            | EventMask::BUTTON_PRESS
            | EventMask::BUTTON_RELEASE
            | EventMask::BUTTON_MOTION;
        let (width, height) = size;
        let values = CreateWindowAux::new().event_mask(events);
        let class = WindowClass::INPUT_OUTPUT;
        connection.create_window(
            depth, id, root, 0, 0, width, height, 0, class, visual, &values,
        )?;
        let values = CreateGCAux::new().graphics_exposures(0);
        connection.create_gc(context, id, &values)?;
        let atom = |name: &str| -> Result<u32, WindowError> {
            Ok(connection
                .intern_atom(false, name.as_bytes())?
                .reply()?
                .atom)
        };
        let (protocols, delete) = (atom("WM_PROTOCOLS")?, atom("WM_DELETE_WINDOW")?);
        let (long_name, utf8) = (atom("_NET_WM_NAME")?, atom("UTF8_STRING")?);
        let replace = PropMode::REPLACE;
        connection.change_property32(replace, id, protocols, AtomEnum::ATOM, &[delete])?;
        let (name, text) = (AtomEnum::WM_NAME, AtomEnum::STRING);
        connection.change_property8(replace, id, name, text, title.as_bytes())?;
        connection.change_property8(replace, id, long_name, utf8, title.as_bytes())?;
        connection.map_window(id)?;
        let keys = connection.get_keyboard_mapping(least_key, most_key - least_key + 1)?;
        let keys = keys.reply()?;
        connection.flush()?;
        Ok(Self {
            id,
            context,
            depth,
            shifts,
            size,
            delete,
            least_key,
            keys_each: usize::from(keys.keysyms_per_keycode).max(1),
            keys: keys.keysyms,
            connection,
        })
    }

    /// In pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.size.0.into(), self.size.1.into())
    }

    /// The actions of the user, after at most `limit`.
    pub(crate) fn inputs(&mut self, limit: Duration) -> Result<Vec<Input>, WindowError> {
        let mut inputs = self.waiting()?;
        if inputs.is_empty() {
            let stream = self.connection.stream();
            let limit = Timespec::try_from(limit).unwrap_or_default();
            let mut ready = [PollFd::new(stream, PollFlags::IN)];
            match poll(&mut ready, Some(&limit)) {
                Ok(_) | Err(rustix::io::Errno::INTR) => {}
                Err(error) => return Err(WindowError::Lost(error.to_string())),
            }
            inputs = self.waiting()?;
        }
        Ok(inputs)
    }

    fn waiting(&mut self) -> Result<Vec<Input>, WindowError> {
        let mut inputs = Vec::new();
        while let Some(event) = self.connection.poll_for_event()? {
            inputs.extend(self.input(&event)?);
        }
        Ok(inputs)
    }

    fn input(&mut self, event: &Event) -> Result<Option<Input>, WindowError> {
        Ok(match event {
            Event::Expose(_) => Some(Input::Redraw),
            Event::ConfigureNotify(change) => {
                let size = (change.width, change.height);
                let is_new = self.size != size;
                self.size = size;
                is_new.then_some(Input::Redraw)
            }
            Event::ButtonPress(b) => {
                let at = (b.event_x, b.event_y);
                Some(Input::Pressed(b.detail, at, modifiers(b.state)))
            }
            Event::ButtonRelease(b) => Some(Input::Released(b.detail, (b.event_x, b.event_y))),
            Event::MotionNotify(m) => Some(Input::Moved((m.event_x, m.event_y))),
            Event::KeyPress(key) => {
                let key_of = self.key(key.detail, key.state);
                key_of.map(|key_of| Input::Key(key_of, modifiers(key.state)))
            }
            Event::ClientMessage(message) if message.data.as_data32()[0] == self.delete => {
                Some(Input::Close)
            }
            Event::DestroyNotify(_) => return Err(WindowError::Destroyed),
            _ => None,
        })
    }

    /// The key with a code. The first column of the table has the symbols without Shift, the second
    /// one those with it; letters that differ in case only may be in the first one alone.
    fn key(&self, code: u8, state: KeyButMask) -> Option<Key> {
        let row = usize::from(code.checked_sub(self.least_key)?) * self.keys_each;
        let plain = Key::of_symbol(*self.keys.get(row)?)?;
        let shifted = (self.keys_each > 1).then(|| self.keys.get(row + 1));
        let shifted = shifted.flatten().and_then(|symbol| Key::of_symbol(*symbol));
        let Key::Character(letter) = plain else {
            return Some(plain);
        };
        let is_letter = letter.is_alphabetic();
        let shift = state.contains(KeyButMask::SHIFT);
        let capital = is_letter && state.contains(KeyButMask::LOCK);
        if shift == capital {
            return Some(plain);
        }
        Some(match shifted {
            Some(key) => key,
            None if is_letter => Key::Character(letter.to_uppercase().next().unwrap_or(letter)),
            None => plain,
        })
    }

    /// Shows an image, from the top left.
    pub(crate) fn show(&self, image: &Image) -> Result<(), WindowError> {
        let setup = self.connection.setup();
        let is_little = setup.image_byte_order == ImageOrder::LSB_FIRST;
        let Shifts(shifts) = self.shifts;
        let row_bytes = image.width * 4;
        // A request has a greatest size, so an image may need several.
        let rows = (self.connection.maximum_request_bytes().saturating_sub(64)) / row_bytes.max(1);
        let rows = rows.clamp(1, 4096);
        for (at, part) in image.colours.chunks(rows * image.width.max(1)).enumerate() {
            let mut bytes = Vec::with_capacity(part.len() * 4);
            for colour in part {
                let parts = colour.iter().zip(shifts);
                let pixel = parts.fold(0, |pixel, (part, shift)| pixel | u32::from(*part) << shift);
                bytes.extend(if is_little {
                    pixel.to_le_bytes()
                } else {
                    pixel.to_be_bytes()
                });
            }
            let (width, height) = (image.width as u16, (part.len() / image.width) as u16);
            let top = (at * rows) as i16;
            let form = ImageFormat::Z_PIXMAP;
            let depth = self.depth;
            self.connection.put_image(
                form,
                self.id,
                self.context,
                width,
                height,
                0,
                top,
                0,
                depth,
                &bytes,
            )?;
        }
        self.connection.flush()?;
        Ok(())
    }
}
