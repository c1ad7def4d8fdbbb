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

/// What the bits of a primitive type mean.
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
    pub fn word(self) -> &'static str {
        self.row().0
    }

    /// The word with its size, which canonical texts and ROS 2 have; the other words of the IDSL;
    /// the meaning, and the size in bytes.
    const fn row(self) -> (&'static str, &'static [&'static str], Class, u32) {
        match self {
            Self::Bool => ("bool", &[], Class::Bool, 1),
            Self::I8 => ("int8", &[], Class::Signed, 1),
            Self::U8 => ("uint8", &["byte"], Class::Unsigned, 1),
            Self::I16 => ("int16", &["short"], Class::Signed, 2),
            Self::U16 => ("uint16", &[], Class::Unsigned, 2),
            Self::I32 => ("int32", &["int"], Class::Signed, 4),
            Self::U32 => ("uint32", &[], Class::Unsigned, 4),
            Self::I64 => ("int64", &["long"], Class::Signed, 8),
            Self::U64 => ("uint64", &[], Class::Unsigned, 8),
            Self::F32 => ("float32", &["float"], Class::Float, 4),
            Self::F64 => ("float64", &["double"], Class::Float, 8),
        }
    }

    /// All words of the IDSL with their types: first those without a size.
    pub fn idsl_words() -> impl Iterator<Item = (&'static str, Self)> {
        let all = || Self::ALL.into_iter();
        let short = all().flat_map(|one| one.row().1.iter().map(move |word| (*word, one)));
        short.chain(all().map(|one| (one.word(), one)))
    }

    /// The type that a word of the IDSL names.
    pub fn from_idsl(word: &str) -> Option<Self> {
        let mut words = Self::idsl_words();
        words.find(|(known, _)| *known == word).map(|(_, one)| one)
    }

    /// What its bits mean.
    pub fn class(self) -> Class {
        self.row().2
    }

    /// The size on the wire and in memory, in bytes. It is also the alignment.
    pub fn size(self) -> usize {
        self.row().3 as usize
    }

    /// The least and the greatest number of an integer type. `None` for other types.
    pub fn limits(self) -> Option<(i128, i128)> {
        let bits = 8 * self.row().3;
        match self.class() {
            Class::Signed => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Class::Unsigned => Some((0, (1 << bits) - 1)),
            Class::Bool | Class::Float => None,
        }
    }

    /// Whether it is a floating-point type.
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
