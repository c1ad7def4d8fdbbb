//! Serialization: OMG CDR, version XCDR1, little endian, as DDS and ROS 2 use it.
//!
//! Numbers are aligned to their size, counted from the start of the body. A sequence is its length
//! as uint32 and then its elements. A string is a sequence of bytes with a zero at its end. An enum
//! is an int32. An optional value is a sequence of none or one. Source: OMG DDS-XTypes 1.3, 7.4.1
//! (`PLAIN_CDR`).

mod error;
mod reader;
mod writer;

pub use error::{DecodeError, EncodeError};
pub use reader::Reader;
pub use writer::Writer;
pub(crate) use writer::allocation;

use std::collections::BTreeMap;
use zerocopy::{FromBytes, FromZeros, IntoBytes};

/// A value that can be encoded and decoded, and that crosses threads as it is.
pub trait Cdr: Clone + Send + Sync + 'static {
    /// Writes the value.
    fn encode(&self, writer: &mut Writer<'_>);

    /// Reads a value.
    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError>;

    /// Writes several values without their number. Arrays of numbers are copied at once.
    fn encode_all(items: &[Self], writer: &mut Writer<'_>) {
        for item in items {
            item.encode(writer);
        }
    }

    /// Reads several values. Arrays of numbers are copied at once.
    fn decode_all(count: usize, reader: &mut Reader<'_>) -> Result<Vec<Self>, DecodeError> {
        let size = size_of::<Self>();
        reader.charge(count, size)?;
        let mut items = Vec::new();
        items
            .try_reserve_exact(count)
            .map_err(|_| EncodeError::NoMemory(count.saturating_mul(size)))?;
        for _ in 0..count {
            items.push(Self::decode(reader)?);
        }
        Ok(items)
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Cdr for $number {
            #[inline]
            fn encode(&self, writer: &mut Writer<'_>) {
                writer.align(size_of::<Self>());
                writer.raw(&self.to_le_bytes());
            }

            #[inline]
            fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                reader.align(size_of::<Self>());
                let mut bytes = [0; size_of::<Self>()];
                bytes.copy_from_slice(reader.raw(size_of::<Self>())?);
                Ok(Self::from_le_bytes(bytes))
            }

            #[cfg(target_endian = "little")]
            fn encode_all(items: &[Self], writer: &mut Writer<'_>) {
                if !items.is_empty() {
                    writer.align(size_of::<Self>());
                    writer.array(items.as_bytes());
                }
            }

            #[cfg(target_endian = "little")]
            fn decode_all(count: usize, reader: &mut Reader<'_>) -> Result<Vec<Self>, DecodeError> {
                if count == 0 {
                    return Ok(Vec::new());
                }
                reader.align(size_of::<Self>());
                let size = count.checked_mul(size_of::<Self>()).ok_or(DecodeError::Truncated(reader.at))?;
                let bytes = reader.raw(size)?;
                reader.charge(size, 1)?;
                // Aligned numbers, which are the rule, are copied without filling the memory with
                // zeros first.
                if let Ok(items) = <[Self]>::ref_from_bytes(bytes) {
                    return Ok(items.to_vec());
                }
                let mut items: Vec<Self> =
                    Self::new_vec_zeroed(count).map_err(|_| EncodeError::NoMemory(size))?;
                items.as_mut_bytes().copy_from_slice(bytes);
                Ok(items)
            }
        }
    )*};
}

numbers!(i8, u8, i16, u16, i32, u32, i64, u64, f32, f64);

impl Cdr for bool {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.raw(&[u8::from(*self)]);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match reader.raw(1)? {
            [0] => Ok(false),
            [1] => Ok(true),
            other => Err(DecodeError::NoSuchValue {
                what: "bool",
                value: other.first().copied().map_or(-1, i64::from),
            }),
        }
    }
}

impl Cdr for String {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.holds(self.len(), self.capacity());
        write_text(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let text = reader.text()?;
        reader.charge(text.len(), 1)?;
        Ok(text.to_owned())
    }
}

/// Writes a borrowed string.
pub fn text(value: &str, writer: &mut Writer<'_>) {
    writer.holds(value.len(), value.len());
    write_text(value, writer);
}

fn write_text(value: &str, writer: &mut Writer<'_>) {
    if value.as_bytes().contains(&0) {
        writer.fail(EncodeError::ZeroByte);
    }
    writer.length(value.len() + 1);
    writer.raw(value.as_bytes());
    writer.raw(&[0]);
}

/// Writes a borrowed sequence.
pub fn sequence<T: Cdr>(items: &[T], writer: &mut Writer<'_>) {
    writer.holds(size_of_val(items), size_of_val(items));
    write_sequence(items, writer);
}

fn write_sequence<T: Cdr>(items: &[T], writer: &mut Writer<'_>) {
    writer.length(items.len());
    T::encode_all(items, writer);
}

impl<T: Cdr> Cdr for Vec<T> {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.holds(size_of_val(&self[..]), self.capacity() * size_of::<T>());
        write_sequence(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let count = reader.length()?;
        T::decode_all(count, reader)
    }
}

impl<T: Cdr, const N: usize> Cdr for [T; N] {
    fn encode(&self, writer: &mut Writer<'_>) {
        T::encode_all(self, writer);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let at = reader.at;
        T::decode_all(N, reader)?
            .try_into()
            .map_err(|_| DecodeError::Truncated(at))
    }
}

impl<T: Cdr> Cdr for Option<T> {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.length(usize::from(self.is_some()));
        if let Some(value) = self {
            value.encode(writer);
        }
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let count = reader.length()?;
        reader.bound("an optional value", count, 1)?;
        if count == 0 {
            Ok(None)
        } else {
            T::decode(reader).map(Some)
        }
    }
}

/// Room of a node of a `BTreeMap`, in entries.
const NODE_ROOM: usize = 11;
/// How many entries a node has at least, unless it is the root.
const NODE_LEAST: usize = 5;
/// The bytes of a node's links to others.
const NODE_LINKS: usize = 14 * size_of::<usize>();

impl<K: Cdr + Ord, V: Cdr> Cdr for BTreeMap<K, V> {
    fn encode(&self, writer: &mut Writer<'_>) {
        let node = NODE_ROOM * size_of::<(K, V)>() + NODE_LINKS;
        let nodes = match self.len() {
            0 => 0,
            1..=NODE_ROOM => 1,
            more => 1 + more / NODE_LEAST,
        };
        for _ in 0..nodes {
            writer.holds(node, node);
        }
        writer.length(self.len());
        for (key, value) in self {
            key.encode(writer);
            value.encode(writer);
        }
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let count = reader.length()?;
        let mut map = Self::new();
        for _ in 0..count {
            // A node of the tree has room for more entries than it holds.
            reader.charge(2, size_of::<(K, V)>())?;
            map.insert(K::decode(reader)?, V::decode(reader)?);
        }
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes_of<T: Cdr>(value: &T) -> Vec<u8> {
        let mut writer = Writer::default();
        writer.put(value);
        writer.into_bytes()
    }

    #[test]
    fn encodings_equal_the_specification() {
        let mut writer = Writer::default();
        writer.put(&1_u8);
        writer.put(&2_u32);
        writer.put(&"ab".to_owned());
        writer.put(&3.0_f64);
        let expected = [
            1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0, 0, 0, 0, 0, 0, 0, 0x08, 0x40,
        ];
        assert_eq!(writer.into_bytes(), expected);
    }

    #[test]
    fn decoding_restores_every_value() {
        let map: BTreeMap<String, Vec<f32>> =
            [("a".to_owned(), vec![1.0, 2.0]), ("b".to_owned(), vec![])].into();
        let bytes = bytes_of(&map);
        assert_eq!(
            Reader::new(&bytes).get::<BTreeMap<String, Vec<f32>>>(),
            Ok(map)
        );
        let value = Some([1_i16, -2, 3]);
        assert_eq!(
            Reader::new(&bytes_of(&value)).get::<Option<[i16; 3]>>(),
            Ok(value)
        );
    }

    #[test]
    fn unaligned_numbers_are_read() {
        let items: Vec<f64> = (0..5).map(f64::from).collect();
        let mut room = [0_u64; 8];
        let bytes = bytes_of(&items);
        for shift in 0..8 {
            let place = &mut room.as_mut_bytes()[shift..shift + bytes.len()];
            place.copy_from_slice(&bytes);
            assert_eq!(Reader::new(place).get::<Vec<f64>>().as_ref(), Ok(&items));
        }
    }

    #[test]
    fn values_take_memory_in_proportion_to_their_bytes() {
        // An empty sequence takes 4 bytes in CDR and 24 in memory.
        let empty = |count: u32| {
            let mut bytes = count.to_le_bytes().to_vec();
            bytes.resize(4 + 4 * count as usize, 0);
            bytes
        };
        let few = Reader::new(&empty(100_000)).get::<Vec<Vec<u8>>>();
        assert_eq!(few.map(|values| values.len()), Ok(100_000));
        let many = empty(3_000_000);
        let inflated = DecodeError::Inflated(many.len());
        let mut reader = Reader::new(&many);
        assert_eq!(reader.get::<Vec<Vec<u8>>>(), Err(inflated.clone()));
        assert_eq!(reader.at, 4, "rejected before allocation");
        assert_eq!(
            Reader::new(&many).get::<Vec<Option<String>>>(),
            Err(inflated.clone())
        );
        // One level deeper, where no single sequence is large.
        let mut nested = 2500_u32.to_le_bytes().to_vec();
        for _ in 0..2500 {
            nested.extend(empty(1000));
        }
        let result = Reader::new(&nested).get::<Vec<Vec<Vec<u8>>>>();
        assert_eq!(result, Err(DecodeError::Inflated(nested.len())));
        let mut map = 1_000_000_u32.to_le_bytes().to_vec();
        for key in 0..1_000_000_u32 {
            map.extend(key.to_le_bytes());
            map.extend([0; 4]);
        }
        let result = Reader::new(&map).get::<BTreeMap<u32, Vec<u8>>>();
        assert_eq!(result, Err(DecodeError::Inflated(map.len())));
        // Numbers and strings take their encoded size in memory, whatever their length.
        let numbers = bytes_of(&vec![7_u8; 32 << 20]);
        let read = Reader::new(&numbers).get::<Vec<u8>>();
        assert_eq!(read.map(|values| values.len()), Ok(32 << 20));
    }

    #[test]
    fn hostile_bytes_are_rejected_without_allocation() {
        let huge = u32::MAX.to_le_bytes();
        assert!(Reader::new(&huge).get::<Vec<u64>>().is_err());
        assert!(Reader::new(&huge).get::<String>().is_err());
        assert!(Reader::new(&[2]).get::<bool>().is_err());
        for end in 0..8 {
            assert!(
                Reader::new(&bytes_of(&vec![1_u32])[..end])
                    .get::<Vec<u32>>()
                    .is_err()
            );
        }
    }
}
