//! A copy of bytes has the verdict, the error and the bytes of a decoded and encoded value, for random types and damaged
//! bodies. The seed is fixed.

use fastrand::Rng;
use rc_middleware::{Reader, Writer};
use rc_values::description::Module;
use rc_values::{
    Catalog, Member, Named, Primitive, Struct, Type, ValueError, borrow, copy, decode_from, encode,
};
use serde_json::{Value as Json, json};
use std::sync::Arc;

const NUMBERS: [&str; 10] = [
    "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64",
];

/// The text of a type. One that is `simple` has neither ranges and the like, nor arrays of anything but numbers.
fn any_type(rng: &mut Rng, simple: bool, named: &[&str], level: u32) -> String {
    let kinds = if level < 3 { 13 } else { 7 };
    match rng.u32(0..kinds) {
        0..3 => NUMBERS[rng.usize(0..NUMBERS.len())].to_owned(),
        3 => "bool".to_owned(),
        4 => "string".to_owned(),
        5 => format!("string<{}>", rng.u32(1..6)),
        6 => named[rng.usize(0..named.len())].to_owned(),
        kind @ 7..10 => {
            let element = match any_type(rng, simple, named, level + 1) {
                flags if simple && flags == "bool" => "uint8".to_owned(),
                element => element,
            };
            match kind {
                7 => format!("sequence<{element},{}>", rng.u32(1..4)),
                _ => format!("sequence<{element}>"),
            }
        }
        10 if !simple => {
            let keys = ["string", "int8", "uint64", "bool", "M::E"];
            let key = keys[rng.usize(0..keys.len())];
            let value = any_type(rng, simple, named, level + 1);
            format!("dictionary<{key},{value}>")
        }
        11 if !simple => {
            let element = any_type(rng, simple, named, level + 1);
            format!("{element}[{}]", rng.u32(1..4))
        }
        _ => {
            let element = NUMBERS[rng.usize(0..NUMBERS.len())];
            format!("{element}[{}]", rng.u32(1..4))
        }
    }
}

fn any_members(rng: &mut Rng, simple: bool, named: &[&str]) -> Json {
    let members = (0..rng.u32(1..6)).map(|at| {
        let ty = any_type(rng, simple, named, 0);
        let mut member = json!({"name": format!("m{at}"), "type": ty});
        if !simple && NUMBERS.contains(&&*ty) && rng.u8(0..3) == 0 {
            member["range"] = json!([-1.0, 7.0]);
        }
        if !simple && rng.u8(0..4) == 0 {
            member["optional"] = json!(true);
        }
        member
    });
    members.collect()
}

fn catalog(types: &Json) -> Catalog {
    let module = json!({"module": "M", "types": types});
    let module: Module = serde_json::from_value(module).expect("a module");
    Catalog::new(&[module]).expect("a catalog")
}

fn structure(catalog: &Catalog, name: &str) -> Arc<Struct> {
    match catalog.named(name) {
        Some(Type::Named(Named::Struct(found))) => Arc::clone(found),
        other => panic!("{name}: {other:?}"),
    }
}

fn any_structure(rng: &mut Rng, simple: bool) -> Arc<Struct> {
    let mut named = vec!["M::E", "M::Empty"];
    let inner = any_members(rng, simple, &named);
    named.push("M::Inner");
    let middle = any_members(rng, simple, &named);
    named.push("M::Middle");
    let outer = any_members(rng, simple, &named);
    let catalog = catalog(&json!([
        {"name": "E", "enum": [["a", 0], ["b", 7], ["c", -3]]},
        {"name": "Empty", "struct": []},
        {"name": "Inner", "struct": inner},
        {"name": "Middle", "struct": middle},
        {"name": "Outer", "struct": outer},
    ]));
    structure(&catalog, "M::Outer")
}

/// Writes a structure that belongs to its type, but for few ranges.
fn put_structure(of: &Struct, rng: &mut Rng, writer: &mut Writer<'_>) {
    if of.members.is_empty() {
        writer.put(&0_u8);
    }
    for Member { ty, optional, .. } in &of.members {
        if *optional {
            let is_there = rng.bool();
            writer.length(is_there.into());
            if !is_there {
                continue;
            }
        }
        put(ty, rng, writer);
    }
}

fn put(ty: &Type, rng: &mut Rng, writer: &mut Writer<'_>) {
    match ty {
        Type::Primitive(of) => put_number(*of, rng, writer),
        Type::Text { bound } => {
            let text = ["", "a", "é", "日", "tower", "a long text"][rng.usize(0..6)];
            let fits = bound.is_none_or(|bound| text.len() <= bound as usize);
            writer.put(&if fits { text } else { "" }.to_owned());
        }
        Type::Sequence { element, bound } => {
            let is_number = matches!(&**element, Type::Primitive(_));
            let count = match bound {
                // Some are longer than what is checked at once.
                None if is_number && rng.u8(0..40) == 0 => rng.u32(500..9_000),
                _ => rng.u32(0..=bound.unwrap_or(3)),
            };
            writer.length(count as usize);
            (0..count).for_each(|_| put(element, rng, writer));
        }
        Type::Array { element, length } => (0..*length).for_each(|_| put(element, rng, writer)),
        Type::Dictionary { key, value } => {
            let count = rng.usize(0..3);
            writer.length(count);
            for _ in 0..count {
                put(key, rng, writer);
                put(value, rng, writer);
            }
        }
        Type::Named(Named::Enum(of)) => writer.put(&of.values[rng.usize(0..of.values.len())].1),
        Type::Named(Named::Struct(of)) => put_structure(of, rng, writer),
    }
}

fn put_number(of: Primitive, rng: &mut Rng, writer: &mut Writer<'_>) {
    let number = rng.u8(0..9);
    match of {
        Primitive::Bool => writer.put(&(number > 4)),
        Primitive::I8 => writer.put(&number.cast_signed()),
        Primitive::U8 => writer.put(&number),
        Primitive::I16 => writer.put(&i16::from(number)),
        Primitive::U16 => writer.put(&u16::from(number)),
        Primitive::I32 => writer.put(&i32::from(number)),
        Primitive::U32 => writer.put(&u32::from(number)),
        Primitive::I64 => writer.put(&i64::from(number)),
        Primitive::U64 => writer.put(&u64::from(number)),
        Primitive::F32 => writer.put(&f32::from(number)),
        Primitive::F64 if number == 8 => writer.put(&f64::NAN),
        Primitive::F64 => writer.put(&f64::from(number)),
    }
}

/// Changes bytes from `from` on.
fn damage(message: &mut Vec<u8>, from: usize, rng: &mut Rng) {
    let at = rng.usize(from..message.len());
    match rng.u8(0..6) {
        0 => message.truncate(at),
        1 => message.insert(at, rng.u8(..)),
        2 => drop(message.remove(at)),
        3 => {
            let counts = [0, 1, 2, 4, 0x100, 0x7fff_ffff, u32::MAX];
            let count = counts[rng.usize(0..counts.len())];
            let at = at.next_multiple_of(4);
            if let Some(place) = message.get_mut(at..at + 4) {
                place.copy_from_slice(&count.to_le_bytes());
            }
        }
        4 => message.extend([0, 1, 0xff]),
        _ => {
            let bytes = [0, 1, 2, 7, 9, 0x40, 0x7f, 0x80, 0xc3, 0xff];
            message[at] = bytes[rng.usize(0..bytes.len())];
        }
    }
}

type Read = Result<(Vec<u8>, usize), ValueError>;

/// Reads from byte `from` of a message, writes to byte `to` of another one. Returns what is written, and how much is read.
fn pass(
    message: &[u8],
    (from, to): (usize, usize),
    act: impl FnOnce(&mut Reader<'_>, &mut Writer<'_>) -> Result<(), ValueError>,
) -> Read {
    let mut reader = Reader::new(message);
    reader.raw(from)?;
    let mut writer = Writer::over(vec![0; to]);
    act(&mut reader, &mut writer)?;
    writer.finish()?;
    Ok((writer.into_bytes(), reader.position()))
}

fn by_value(ty: &Arc<Struct>, message: &[u8], from: usize, to: usize) -> Read {
    pass(message, (from, to), |reader, writer| {
        encode(&decode_from(ty, reader)?, writer)
    })
}

/// The copy of a body. The bytes between its numbers are zero.
fn copied(ty: &Arc<Struct>, message: &[u8], from: usize, to: usize) -> Read {
    let (copied, read) = pass(message, (from, to), |reader, writer| {
        copy(ty, reader, writer)
    })?;
    let (zeroed, length) = by_value(ty, &copied, to, to)?;
    assert_eq!(length, copied.len(), "{ty:?}: {message:?}");
    Ok((zeroed, read))
}

/// The bodies so far.
#[derive(Debug, Default)]
struct Seen {
    valid: usize,
    refused: usize,
    borrowed: usize,
}

fn compare(ty: &Arc<Struct>, message: &[u8], from: usize, to: usize, seen: &mut Seen) {
    let expected = by_value(ty, message, from, to);
    let found = copied(ty, message, from, to);
    assert_eq!(
        found, expected,
        "{from} to {to} of {ty:?}\nin {message:02x?}"
    );
    let mut reader = Reader::new(message);
    reader.raw(from).expect("the envelope");
    let borrowed = borrow(ty, &mut reader);
    seen.valid += usize::from(expected.is_ok());
    seen.refused += usize::from(expected.is_err());
    seen.borrowed += usize::from(borrowed.is_some());
    let Some(body) = borrowed else {
        assert_eq!(reader.position(), from);
        return;
    };
    let expected = by_value(ty, message, from, 0).expect("a value");
    assert_eq!(reader.position(), expected.1);
    let (zeroed, length) = by_value(ty, body, 0, 0).expect("a value");
    assert_eq!(
        (zeroed, length),
        (expected.0, body.len()),
        "{ty:?}\nin {message:02x?}"
    );
}

#[test]
fn a_copy_has_the_verdict_of_a_value_for_every_type_and_any_bytes() {
    const SEED: u64 = 7;
    const TYPES: usize = 400;
    let mut rng = Rng::with_seed(SEED);
    let mut seen = Seen::default();
    for number in 0..TYPES {
        let ty = any_structure(&mut rng, number % 2 == 0);
        for _ in 0..8 {
            let (from, to) = (rng.usize(0..18), rng.usize(0..18));
            let mut writer = Writer::over(vec![0xaa; from]);
            put_structure(&ty, &mut rng, &mut writer);
            let message = writer.into_bytes();
            compare(&ty, &message, from, to, &mut seen);
            for _ in 0..8 {
                let mut message = message.clone();
                for _ in 0..rng.u8(1..3) {
                    if message.len() > from {
                        damage(&mut message, from, &mut rng);
                    }
                }
                compare(&ty, &message, from, to, &mut seen);
            }
        }
    }
    let Seen {
        valid,
        refused,
        borrowed,
    } = seen;
    assert!(
        valid > 5_000 && refused > 5_000 && borrowed > 1_000,
        "{seen:?}"
    );
}

fn members(count: usize, ty: &str) -> Json {
    let members = (0..count).map(|at| json!({"name": format!("m{at}"), "type": ty}));
    members.collect()
}

/// Larger types and bodies are copied part by part.
#[test]
fn a_copy_has_the_verdict_of_a_value_at_the_limits_of_what_is_checked_at_once() {
    let mut seen = Seen::default();
    let mut check = |ty: &Arc<Struct>, message: &[u8], is_borrowed: bool| {
        let before = seen.borrowed;
        compare(ty, message, 0, 0, &mut seen);
        compare(ty, message, 0, 3, &mut seen);
        assert_eq!(seen.borrowed - before, 2 * usize::from(is_borrowed));
    };
    for (count, is_borrowed) in [(256, true), (257, false)] {
        let catalog = catalog(&json!([{"name": "S", "struct": members(count, "bool")}]));
        let ty = structure(&catalog, "M::S");
        check(&ty, &vec![1; count], is_borrowed);
        check(&ty, &vec![2; count], false);
    }
    for (length, is_borrowed) in [(8 * 1024 - 4, true), (8 * 1024 - 3, false)] {
        let catalog = catalog(&json!([{"name": "S", "struct": members(1, "sequence<uint8>")}]));
        let ty = structure(&catalog, "M::S");
        let mut writer = Writer::default();
        writer.put(&vec![5_u8; length]);
        check(&ty, &writer.into_bytes(), is_borrowed);
    }
    // Two to the thirtieth parts.
    let types = (0..30).map(|level| {
        let inner = if level == 29 {
            "int8".to_owned()
        } else {
            format!("M::T{}", level + 1)
        };
        json!({"name": format!("T{level}"), "struct": members(2, &inner)})
    });
    let catalog = catalog(&types.collect());
    check(&structure(&catalog, "M::T0"), &[1; 1000], false);
    check(&structure(&catalog, "M::T23"), &[1; 128], true);
    check(&structure(&catalog, "M::T22"), &[1; 256], false);
}
