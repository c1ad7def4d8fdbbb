//! From bytes of CDR to bytes of CDR, with the checks of decoding and without a value between them.

use crate::budget::Budget;
use crate::checks::{check_bound, check_range};
use crate::decode;
use crate::error::ValueError;
use crate::types::{Member, Named, Primitive, Struct, Type};
use rc_middleware::{Reader, Writer};

/// Copies the structure that follows in `reader`. The result is that of [`decode_from`](crate::decode_from) and
/// [`encode`](crate::encode): numbers are aligned for the place of `writer`.
///
/// # Errors
/// Those of [`decode_from`](crate::decode_from). `writer` has a part of the structure then.
pub fn copy(
    ty: &Struct,
    reader: &mut Reader<'_>,
    writer: &mut Writer<'_>,
) -> Result<(), ValueError> {
    if let Some(bytes) = whole(ty, reader, writer.len()) {
        writer.raw(bytes);
        return Ok(());
    }
    let budget = Budget::of(reader.rest().len());
    let mut copy = Copy {
        reader,
        writer,
        budget,
    };
    copy.structure(ty)
}

/// The bytes of the structure that follows in `reader`, if they are those of a body of their own.
pub fn borrow<'r>(ty: &Struct, reader: &mut Reader<'r>) -> Option<&'r [u8]> {
    whole(ty, reader, 0)
}

/// The bytes of the structure that follows in `reader`, if they are the same at the byte `to` of another message.
/// Otherwise, nothing is read.
fn whole<'r>(ty: &Struct, reader: &mut Reader<'r>, to: usize) -> Option<&'r [u8]> {
    let quick = ty.quick()?;
    let length = quick.length(reader.rest(), reader.position(), to)?;
    // Fails for an image.
    reader.raw(length).ok()
}

struct Copy<'c, 'r, 'w> {
    reader: &'c mut Reader<'r>,
    writer: &'c mut Writer<'w>,
    /// The receiver makes a value of the copy.
    budget: Budget,
}

impl Copy<'_, '_, '_> {
    fn structure(&mut self, ty: &Struct) -> Result<(), ValueError> {
        if ty.members.is_empty() {
            // An empty structure holds one octet.
            self.reader.get::<u8>()?;
            self.writer.put(&0_u8);
        }
        self.budget.take_values(ty.members.len())?;
        for member in &ty.members {
            let copied = self.member(member);
            copied.map_err(|error| error.in_member(&member.name))?;
        }
        Ok(())
    }

    fn member(&mut self, member: &Member) -> Result<(), ValueError> {
        if member.optional {
            let count = decode::count_of_optional(self.reader)?;
            self.writer.length(count);
            if count == 0 {
                return Ok(());
            }
        }
        if member.range.is_some() {
            let mut ahead = self.reader.clone();
            let found = decode::value(&member.ty, &mut ahead, &mut self.budget)?;
            check_range(member, &found)?;
        }
        self.value(&member.ty)
    }

    fn value(&mut self, ty: &Type) -> Result<(), ValueError> {
        match ty {
            Type::Primitive(primitive) => self.numbers(*primitive, 1)?,
            Type::Text { bound } => {
                let text = self.reader.text()?;
                check_bound(text.len(), *bound)?;
                self.budget.take(text.len(), 1)?;
                rc_middleware::typed::Put::put(text, self.writer);
            }
            Type::Sequence { element, bound } => {
                let length = self.reader.length()?;
                check_bound(length, *bound)?;
                self.writer.length(length);
                self.elements(element, length)?;
            }
            Type::Array { element, length } => self.elements(element, *length as usize)?,
            Type::Dictionary { key, value } => {
                let length = self.reader.length()?;
                self.writer.length(length);
                for at in 0..length {
                    self.budget.take_values(4)?;
                    let mut here = self.reader.clone();
                    self.value(key).map_err(|error| error.in_element(at))?;
                    self.value(value).map_err(|error| {
                        match decode::value(key, &mut here, &mut self.budget) {
                            Ok(key) => error.in_element(key.plain()),
                            Err(_) => error.in_element(at),
                        }
                    })?;
                }
            }
            Type::Named(Named::Enum(of)) => {
                let number = self.reader.get()?;
                decode::check_enum(of, number)?;
                self.writer.put(&number);
            }
            Type::Named(Named::Struct(of)) => self.structure(of)?,
        }
        Ok(())
    }

    fn elements(&mut self, element: &Type, count: usize) -> Result<(), ValueError> {
        if let Type::Primitive(primitive) = element {
            self.budget.take(count, primitive.size())?;
            return self.numbers(*primitive, count);
        }
        self.budget.take_values(count)?;
        for at in 0..count {
            let copied = self.value(element);
            copied.map_err(|error| error.in_element(at))?;
        }
        Ok(())
    }

    fn numbers(&mut self, of: Primitive, count: usize) -> Result<(), ValueError> {
        if of == Primitive::Bool {
            for _ in 0..count {
                let value: bool = self.reader.get()?;
                self.writer.put(&value);
            }
            return Ok(());
        }
        Ok(self.writer.copy_numbers(self.reader, count, of.size())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Catalog, decode_from, encode};
    use rc_middleware::typed::Put as _;

    /// A type with everything that a structure may hold.
    fn everything() -> std::sync::Arc<Struct> {
        let module = serde_json::json!({
            "module": "Demo",
            "types": [
                {"name": "Colour", "enum": [["red", 0], ["blue", 7]]},
                {"name": "Empty", "struct": []},
                {"name": "Point", "struct": [
                    {"name": "x", "type": "float64", "unit": "m", "range": [0.0, 9.0]},
                    {"name": "seen", "type": "bool"}]},
            ],
            "interfaces": [{"name": "DemoPub", "operations": [
                {"name": "all", "id": 1, "hash": "00000000000000aa", "pattern": "publish", "inputs": [
                    {"name": "small", "type": "uint8"},
                    {"name": "text", "type": "string<9>"},
                    {"name": "colour", "type": "Demo::Colour"},
                    {"name": "empty", "type": "Demo::Empty"},
                    {"name": "point", "type": "Demo::Point", "optional": true},
                    {"name": "numbers", "type": "sequence<int64,3>"},
                    {"name": "flags", "type": "bool[3]"},
                    {"name": "points", "type": "sequence<Demo::Point>"},
                    {"name": "map", "type": "dictionary<string,Demo::Colour>"},
                ]}]}]
        });
        let module = serde_json::from_value(module).expect("a module");
        let catalog = Catalog::new(&[module]).expect("a catalog");
        let interface = catalog.interface("Demo::DemoPub").expect("an interface");
        std::sync::Arc::clone(&interface.operation("all").expect("an operation").request)
    }

    /// A structure of [`everything`].
    fn body() -> Vec<u8> {
        let mut writer = Writer::default();
        writer.put(&3_u8);
        "tower".put(&mut writer);
        writer.put(&7_i32);
        writer.put(&0_u8);
        (&Some(4.5_f64), &true).put(&mut writer);
        (&vec![1_i64, -2], &[true, false, true]).put(&mut writer);
        writer.length(2);
        (&1.5_f64, &false, &2.5_f64, &true).put(&mut writer);
        writer.length(1);
        "roof".put(&mut writer);
        writer.put(&7_i32);
        writer.into_bytes()
    }

    /// A type of simple parts.
    fn simple() -> std::sync::Arc<Struct> {
        let module = serde_json::json!({
            "module": "Demo",
            "types": [
                {"name": "Colour", "enum": [["red", 0], ["blue", 7]]},
                {"name": "Empty", "struct": []},
                {"name": "Point", "struct": [{"name": "x", "type": "float64"}, {"name": "seen", "type": "bool"}]},
            ],
            "interfaces": [{"name": "DemoPub", "operations": [
                {"name": "all", "id": 1, "hash": "00000000000000aa", "pattern": "publish", "inputs": [
                    {"name": "small", "type": "uint8"},
                    {"name": "text", "type": "string<9>"},
                    {"name": "colour", "type": "Demo::Colour"},
                    {"name": "empty", "type": "Demo::Empty"},
                    {"name": "numbers", "type": "sequence<int64,3>"},
                    {"name": "pair", "type": "int16[2]"},
                    {"name": "points", "type": "sequence<Demo::Point,2>"},
                    {"name": "names", "type": "sequence<string>"},
                ]}]}]
        });
        let module = serde_json::from_value(module).expect("a module");
        let catalog = Catalog::new(&[module]).expect("a catalog");
        let interface = catalog.interface("Demo::DemoPub").expect("an interface");
        std::sync::Arc::clone(&interface.operation("all").expect("an operation").request)
    }

    /// A structure of [`simple`].
    fn simple_body() -> Vec<u8> {
        let mut writer = Writer::default();
        writer.put(&3_u8);
        "tower".put(&mut writer);
        writer.put(&7_i32);
        writer.put(&0_u8);
        (&vec![1_i64, -2], &[3_i16, 4]).put(&mut writer);
        writer.length(2);
        (&1.5_f64, &false, &2.5_f64, &true).put(&mut writer);
        writer.length(2);
        ("é", "roof").put(&mut writer);
        writer.into_bytes()
    }

    fn copied(ty: &Struct, body: &[u8], offset: usize) -> Result<Vec<u8>, ValueError> {
        let mut writer = Writer::over(vec![0; offset]);
        copy(ty, &mut Reader::new(body), &mut writer)?;
        Ok(writer.into_bytes())
    }

    /// By a value.
    fn again(
        ty: &std::sync::Arc<Struct>,
        body: &[u8],
        offset: usize,
    ) -> Result<Vec<u8>, ValueError> {
        let mut writer = Writer::over(vec![0; offset]);
        let value = decode_from(ty, &mut Reader::new(body))?;
        encode(&value, &mut writer)?;
        Ok(writer.into_bytes())
    }

    #[test]
    fn a_copy_equals_a_decoded_and_encoded_value_at_every_place() {
        let (ty, body) = (everything(), body());
        assert_eq!(copied(&ty, &body, 0), Ok(body.clone()));
        for offset in 0..8 {
            assert_eq!(copied(&ty, &body, offset), again(&ty, &body, offset));
        }
    }

    #[test]
    fn a_copy_of_simple_parts_equals_a_decoded_and_encoded_value_at_every_place() {
        let (ty, body) = (simple(), simple_body());
        assert!(ty.quick().is_some() && everything().quick().is_none());
        for offset in 0..16 {
            assert_eq!(copied(&ty, &body, offset), again(&ty, &body, offset));
        }
        // Behind an envelope of any length.
        for envelope in 0..16 {
            let mut writer = Writer::over(vec![0; envelope]);
            copy(&ty, &mut Reader::new(&body), &mut writer).expect("a copy");
            let message = writer.into_bytes();
            let begin = || {
                let mut reader = Reader::new(&message);
                reader.raw(envelope).expect("the envelope");
                reader
            };
            let mut back = Writer::default();
            copy(&ty, &mut begin(), &mut back).expect("a copy");
            assert_eq!(back.into_bytes(), body);
            let mut reader = begin();
            let borrowed = borrow(&ty, &mut reader);
            assert_eq!(borrowed.is_some(), envelope % 8 == 0);
            assert!(borrowed.is_none_or(|bytes| bytes == body && reader.rest().is_empty()));
        }
    }

    #[test]
    fn a_copy_fails_where_decoding_fails() {
        for (ty, whole) in [(everything(), body()), (simple(), simple_body())] {
            for end in 0..whole.len() {
                assert_eq!(copied(&ty, &whole[..end], 0), again(&ty, &whole[..end], 0));
                assert!(copied(&ty, &whole[..end], 0).is_err());
                assert_eq!(borrow(&ty, &mut Reader::new(&whole[..end])), None);
            }
            let mut refused = 0;
            for at in 0..whole.len() {
                for byte in [0, 1, 2, 9, 0x40, 0xff] {
                    let mut body = whole.clone();
                    body[at] = byte;
                    let expected = again(&ty, &body, 0);
                    refused += usize::from(expected.is_err());
                    // Bytes between numbers may stay.
                    let copied = copied(&ty, &body, 0).and_then(|copy| again(&ty, &copy, 0));
                    assert_eq!(copied, expected, "{byte} at {at}");
                }
            }
            assert!(refused > 50, "{refused} of the bodies are none");
        }
    }
}
