//! The primitive types of the IDSL: booleans and numbers.

use crate::word::words;

/// A boolean or a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Primitive {
    /// `bool`
    Bool,
    /// `int8`
    I8,
    /// `byte`, `uint8`
    U8,
    /// `short`, `int16`
    I16,
    /// `uint16`
    U16,
    /// `int`, `int32`
    I32,
    /// `uint32`
    U32,
    /// `long`, `int64`
    I64,
    /// `uint64`
    U64,
    /// `float`, `float32`
    F32,
    /// `double`, `float64`
    F64,
}

/// The interpretation of the bits of a primitive type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// `true` or `false`.
    Bool,
    /// An integer in two's complement.
    Signed,
    /// An integer without a sign.
    Unsigned,
    /// A number of IEEE 754.
    Float,
}

/// The properties of one type that other layers use.
struct Row {
    /// The word with its size, which canonical texts and ROS 2 have.
    word: &'static str,
    /// The other words of the IDSL.
    aliases: &'static [&'static str],
    class: Class,
    /// In bytes.
    size: u32,
    rust: &'static str,
    /// The type of C, which is in C++'s namespace `std` if it ends in `_t`.
    c: &'static str,
    /// The type of OMG IDL. `long` is not used: it has 64 bits in IDSL and 32 in OMG IDL.
    idl: &'static str,
    /// The letter in the texts of plans, which types with the same bits share.
    letter: char,
}

words!(Primitive);

impl Primitive {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 11] = [
        Self::Bool,
        Self::I8,
        Self::U8,
        Self::I16,
        Self::U16,
        Self::I32,
        Self::U32,
        Self::I64,
        Self::U64,
        Self::F32,
        Self::F64,
    ];

    /// The word for it, in files and in JSON.
    #[inline]
    pub fn word(self) -> &'static str {
        self.row().word
    }

    #[rustfmt::skip]
    const fn row(self) -> &'static Row {
        use Class::{Bool, Float, Signed, Unsigned};
        match self {
            Self::Bool => &Row { word: "bool", aliases: &[], class: Bool, size: 1, rust: "bool", c: "bool", idl: "boolean", letter: '?' },
            Self::I8 => &Row { word: "int8", aliases: &[], class: Signed, size: 1, rust: "i8", c: "int8_t", idl: "int8", letter: 'b' },
            Self::U8 => &Row { word: "uint8", aliases: &["byte"], class: Unsigned, size: 1, rust: "u8", c: "uint8_t", idl: "octet", letter: 'B' },
            Self::I16 => &Row { word: "int16", aliases: &["short"], class: Signed, size: 2, rust: "i16", c: "int16_t", idl: "int16", letter: 'h' },
            Self::U16 => &Row { word: "uint16", aliases: &[], class: Unsigned, size: 2, rust: "u16", c: "uint16_t", idl: "uint16", letter: 'H' },
            Self::I32 => &Row { word: "int32", aliases: &["int"], class: Signed, size: 4, rust: "i32", c: "int32_t", idl: "int32", letter: 'i' },
            Self::U32 => &Row { word: "uint32", aliases: &[], class: Unsigned, size: 4, rust: "u32", c: "uint32_t", idl: "uint32", letter: 'I' },
            Self::I64 => &Row { word: "int64", aliases: &["long"], class: Signed, size: 8, rust: "i64", c: "int64_t", idl: "int64", letter: 'q' },
            Self::U64 => &Row { word: "uint64", aliases: &[], class: Unsigned, size: 8, rust: "u64", c: "uint64_t", idl: "uint64", letter: 'Q' },
            Self::F32 => &Row { word: "float32", aliases: &["float"], class: Float, size: 4, rust: "f32", c: "float", idl: "float", letter: 'f' },
            Self::F64 => &Row { word: "float64", aliases: &["double"], class: Float, size: 8, rust: "f64", c: "double", idl: "double", letter: 'd' },
        }
    }

    /// The type of Rust.
    pub fn rust(self) -> &'static str {
        self.row().rust
    }

    /// The type of C, of `stdint.h` for an integer.
    pub fn c(self) -> &'static str {
        self.row().c
    }

    /// The type of OMG IDL.
    pub fn idl(self) -> &'static str {
        self.row().idl
    }

    /// The letter in the texts of plans, which types with the same bits share.
    pub fn letter(self) -> char {
        self.row().letter
    }

    /// The first type of a letter.
    pub fn from_letter(letter: char) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.letter() == letter)
    }

    /// All words of the IDSL with their types: first those without a size.
    pub fn idsl_words() -> impl Iterator<Item = (&'static str, Self)> {
        let all = || Self::ALL.into_iter();
        let short = all().flat_map(|one| one.row().aliases.iter().map(move |word| (*word, one)));
        short.chain(all().map(|one| (one.word(), one)))
    }

    /// The type that a word of the IDSL names.
    pub fn from_idsl(word: &str) -> Option<Self> {
        let mut words = Self::idsl_words();
        words.find(|(known, _)| *known == word).map(|(_, one)| one)
    }

    /// The interpretation of its bits.
    #[inline]
    pub fn class(self) -> Class {
        self.row().class
    }

    /// The size on the wire and in memory, in bytes. It is also the alignment.
    #[inline]
    pub fn size(self) -> usize {
        self.row().size as usize
    }

    /// The least and the greatest number of an integer type. `None` for other types.
    pub fn limits(self) -> Option<(i128, i128)> {
        let bits = 8 * self.row().size;
        match self.class() {
            Class::Signed => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Class::Unsigned => Some((0, (1 << bits) - 1)),
            Class::Bool | Class::Float => None,
        }
    }

    /// The first type with the same bits, for systems that have only numbers.
    #[must_use]
    pub fn plain(self) -> Self {
        let same = |one: &Self| one.class() == self.class() && one.size() == self.size();
        Self::ALL.into_iter().find(same).unwrap_or(self)
    }

    /// Itself if it is a type of numbers. `None` for `bool`.
    pub fn number(self) -> Option<Self> {
        match self.class() {
            Class::Bool => None,
            Class::Signed | Class::Unsigned | Class::Float => Some(self),
        }
    }

    /// Whether it is a floating-point type.
    #[inline]
    pub fn is_float(self) -> bool {
        self.class() == Class::Float
    }

    /// Whether it is a floating-point type with a finite number next to `value`.
    pub fn holds(self, value: f64) -> bool {
        let is_finite = match self.size() {
            4 => (value as f32).is_finite(),
            _ => value.is_finite(),
        };
        self.is_float() && is_finite
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_types_convert_both_ways() {
        for one in Primitive::ALL {
            assert_eq!(Primitive::from_idsl(one.word()), Some(one));
            assert_eq!(Primitive::from_word(one.word()), Some(one));
            assert_eq!(Primitive::from_letter(one.letter()), Some(one.plain()));
        }
        assert_eq!(Primitive::from_idsl("double"), Some(Primitive::F64));
        assert_eq!(Primitive::from_word("double"), None);
        assert_eq!(Primitive::idsl_words().count(), 17);
    }

    #[test]
    fn limits_follow_from_class_and_size() {
        let limits = |least: i128, greatest: i128| Some((least, greatest));
        assert_eq!(
            Primitive::I8.limits(),
            limits(i8::MIN.into(), i8::MAX.into())
        );
        assert_eq!(
            Primitive::I64.limits(),
            limits(i64::MIN.into(), i64::MAX.into())
        );
        assert_eq!(Primitive::U16.limits(), limits(0, u16::MAX.into()));
        assert_eq!(Primitive::U64.limits(), limits(0, u64::MAX.into()));
        assert_eq!(Primitive::F64.limits(), None);
        assert_eq!(Primitive::Bool.limits(), None);
        assert!(Primitive::F64.holds(1e300) && !Primitive::F32.holds(1e300));
        assert!(!Primitive::F64.holds(f64::INFINITY) && !Primitive::I32.holds(1.0));
    }
}
