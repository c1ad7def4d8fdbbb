//! Actions of the user of a window.

/// A place in a window, in pixels to the right of and below its corner at the top left.
pub type Pixel = (i16, i16);

/// Keys that are held down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modifiers {
    /// Shift.
    pub shift: bool,
    /// Control.
    pub control: bool,
}

/// A key. Other ones do nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A letter, digit or sign, with the effect of Shift.
    Character(char),
    /// Escape.
    Escape,
    /// Return or Enter.
    Return,
    /// Removes the character before the cursor.
    Backspace,
    /// Delete.
    Delete,
    /// Tab.
    Tab,
    /// F1.
    F1,
}

impl Key {
    /// The key of a command. Commands are lower case, also with Caps Lock or Shift.
    pub(crate) fn lower(self) -> Self {
        match self {
            Self::Character(letter) => Self::Character(letter.to_ascii_lowercase()),
            other => other,
        }
    }
}

/// Action of the user of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The window has another size, or has to be drawn again.
    Redraw,
    /// A button of the pointer went down (1 left, 2 middle, 3 right, 4 and 5 the wheel).
    Pressed(u8, Pixel, Modifiers),
    /// A button went up.
    Released(u8, Pixel),
    /// The pointer moved with a button down.
    Moved(Pixel),
    /// A key went down.
    Key(Key, Modifiers),
    /// The user wants to close the window.
    Close,
}

/// Effect of an action. Of several, the greatest counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ViewerAction {
    /// The window shows the right picture.
    Nothing,
    /// The picture has to be drawn again.
    Draw,
    /// The window closes.
    End,
}

impl Key {
    /// The key of a symbol of X11.
    pub(crate) fn of_symbol(symbol: u32) -> Option<Self> {
        match symbol {
            0xff1b => Some(Self::Escape),
            0xff0d | 0xff8d => Some(Self::Return),
            0xff08 => Some(Self::Backspace),
            0xffff => Some(Self::Delete),
            // With Shift, Tab has a symbol of its own.
            0xff09 | 0xfe20 => Some(Self::Tab),
            0xffbe => Some(Self::F1),
            // Latin 1 has its own numbers, all other characters those of Unicode.
            0x20..=0x7e | 0xa0..=0xff => char::from_u32(symbol).map(Self::Character),
            0x0100_0100..=0x0110_ffff => char::from_u32(symbol - 0x0100_0000).map(Self::Character),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_of_x11_are_keys() {
        for (symbol, key) in [
            (0x61, Some(Key::Character('a'))),
            (0xe9, Some(Key::Character('é'))),
            (0x0100_03b1, Some(Key::Character('α'))),
            (0xff8d, Some(Key::Return)),
            (0xfe20, Some(Key::Tab)),
            (0xffe1, None),
            (0x0100_d800, None),
        ] {
            assert_eq!(Key::of_symbol(symbol), key, "{symbol:x}");
        }
    }
}
