//! Settings, run directories, members, bounds of numbers and lengths, values in place, and a backend
//! without what only some middlewares have.

use interfaces::rc_types::types::{read_ranged, result_ranged};
use rc_middleware::in_place::{Bool, FromBytes, Immutable, IntoBytes, KnownLayout, boxed, resize};
use rc_middleware::shared_value::{HeldValue, SharedValue};
use rc_middleware::{
    Backend, Client, DecodeError, EncodeError, Encoding, Endpoint, InPlace, LogQueue, Member,
    OpenError, Publisher, Reader, RunDirectory, Server, Settings, Subscriber, Writer,
};
use rc_vocabulary::Value;
use std::sync::Arc;
use std::time::Duration;

#[test]
fn a_setting_is_read_as_what_it_is() {
    let mut settings = Settings::default();
    settings.set("a", "int", Value::Int(-7));
    settings.set("a", "bool", Value::Bool(false));
    settings.set("a", "text", Value::Text("word".to_owned()));
    let names = vec!["x".to_owned(), "y".to_owned()];
    settings.set("a", "texts", Value::Texts(names.clone()));
    settings.set("a", "duration", Value::Duration(Duration::from_millis(5)));
    assert_eq!(settings.int("a", "int"), Some(-7));
    assert_eq!(settings.bool("a", "bool"), Some(false));
    assert_eq!(settings.text("a", "text"), Some("word"));
    assert_eq!(settings.texts("a", "texts"), names);
    assert_eq!(
        settings.duration("a", "duration"),
        Some(Duration::from_millis(5))
    );
    // With another value, or if it is not set, it has no effect.
    for key in ["bool", "nothing"] {
        assert_eq!(settings.int("a", key), None);
        assert_eq!(settings.text("a", key), None);
        assert_eq!(settings.duration("a", key), None);
        assert!(settings.texts("a", key).is_empty());
        assert!(settings.qos("a", key).is_empty());
    }
    assert_eq!(settings.bool("a", "int"), None);
    // Later settings replace those of the same keys, and leave the others.
    let mut later = Settings::default();
    later.set("a", "int", Value::Int(8));
    later.set("b", "int", Value::Int(9));
    settings.extend(&later);
    let ints = [("a", "int"), ("b", "int")].map(|(middleware, key)| settings.int(middleware, key));
    assert_eq!(ints, [Some(8), Some(9)]);
    assert_eq!(settings.bool("a", "bool"), Some(false));
}

#[test]
fn a_run_directory_is_removed_with_its_content_and_may_be_gone() {
    let base = tempfile::tempdir().expect("a folder");
    let base = base.path();
    let directory = RunDirectory::below(base, "net");
    directory.remove().expect("it is not there");
    let below = directory.middleware("iceoryx2");
    std::fs::create_dir_all(&below).expect("a folder");
    std::fs::write(below.join("file"), "").expect("a file");
    directory.remove().expect("it is ours");
    assert!(!directory.path().exists() && base.exists());
    // A folder that cannot be removed is an error.
    std::fs::write(directory.path(), "").expect("a file");
    directory.remove().expect_err("it is not a folder");
}

#[test]
fn a_member_has_a_number_in_its_array_and_one_in_its_component() {
    let member = Member::new(2, 7, "front");
    assert_eq!((member.index(), member.slot()), (2, 7));
    assert_eq!(member.name(), "front");
}

/// A middleware that has no more than each must have.
struct Bare;

impl Backend for Bare {
    fn name(&self) -> &'static str {
        "bare"
    }

    fn publisher(&self, _: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        unreachable!("no port is opened")
    }

    fn subscriber(&self, _: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        unreachable!("no port is opened")
    }

    fn client(&self, _: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        unreachable!("no port is opened")
    }

    fn server(&self, _: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        unreachable!("no port is opened")
    }

    fn linger(&self, _: Duration) {}
}

#[test]
fn a_middleware_without_a_log_publishes_none_and_reports_no_mismatch() {
    assert!(matches!(Bare.log(&Arc::<LogQueue>::default()), Ok(false)));
    assert!(Bare.mismatches().is_empty());
}

#[test]
fn a_length_is_its_bound_at_most() {
    let (what, bound) = ("name", 3);
    for (length, is_within) in [(0, true), (3, true), (4, false)] {
        let mut writer = Writer::default();
        writer.bound(what, length, bound);
        let written = writer.finish().map(drop);
        let too_long = EncodeError::TooLong {
            what,
            length,
            bound,
        };
        assert_eq!(written, if is_within { Ok(()) } else { Err(too_long) });
        let read = Reader::new(&[]).bound(what, length, bound);
        let too_long = DecodeError::TooLong {
            what,
            length,
            bound,
        };
        assert_eq!(read, if is_within { Ok(()) } else { Err(too_long) });
    }
}

#[test]
fn numbers_are_within_their_range_on_both_sides() {
    let wide = (-1_i128, i128::from(u64::MAX));
    for (value, is_within) in [(-2, false), (-1, true), (wide.1, true), (wide.1 + 1, false)] {
        let mut writer = Writer::default();
        writer.integer_range("n", value, wide, "-1 to much");
        let written = writer.finish().map(drop);
        let read = Reader::new(&[]).integer_range("n", value, wide, "-1 to much");
        let (what, range) = ("n", "-1 to much");
        let expected = EncodeError::IntegerOutOfRange { what, value, range };
        assert_eq!(written, if is_within { Ok(()) } else { Err(expected) });
        let expected = DecodeError::IntegerOutOfRange { what, value, range };
        assert_eq!(read, if is_within { Ok(()) } else { Err(expected) });
    }
    for (value, is_within) in [(-0.5, false), (0.0, true), (1.0, true), (f64::NAN, false)] {
        let mut writer = Writer::default();
        writer.range("x", value, (0.0, 1.0), "0 to 1");
        let read = Reader::new(&[]).range("x", value, (0.0, 1.0), "0 to 1");
        assert_eq!(
            (writer.finish().is_ok(), read.is_ok()),
            (is_within, is_within),
            "{value}"
        );
    }
}

/// `struct Pair { bool on; long numbers[2]; }`
#[derive(Debug, FromBytes, Immutable, IntoBytes, KnownLayout)]
#[zerocopy(crate = "rc_middleware::in_place::zerocopy")]
#[repr(C)]
pub(super) struct Pair {
    pub(super) on: Bool,
    padding: [u8; 3],
    pub(super) numbers: [i32; 2],
}

impl InPlace for Pair {
    type Value = Vec<i32>;

    const NAME: &'static str = "Pair";

    fn reset(&mut self) {
        self.on.reset();
        self.numbers.reset();
    }

    fn set(&mut self, value: &Vec<i32>) -> Result<(), EncodeError> {
        let mut length = 0;
        resize("numbers", &mut self.numbers, &mut length, value.len())?.copy_from_slice(value);
        self.on.set(&(length > 0))
    }

    fn value(&self) -> Result<Vec<i32>, DecodeError> {
        self.on.value()?;
        Ok(self.numbers.value()?.to_vec())
    }

    fn check(&self) -> Result<(), DecodeError> {
        let most = f64::from(self.numbers[1]);
        Reader::new(&[]).range("numbers", most, (0.0, 9.0), "0 to 9")
    }
}

#[test]
fn an_image_is_read_wherever_it_lies_if_it_has_its_size() {
    let mut pair = boxed::<Pair>().expect("memory");
    pair.numbers = [-5, 9];
    pair.on.put(true);
    let mut room = [0_u64; 4];
    let room = room.as_mut_bytes();
    let length = size_of::<Pair>();
    for shift in 0..8 {
        room[shift..shift + length].copy_from_slice(pair.as_bytes());
        for wrong in [0, length - 1, length + 1] {
            let mut reader = Reader::of(&room[shift..shift + wrong], Encoding::Image);
            let error = reader.in_place::<Pair>().err();
            assert_eq!(
                error,
                Some(DecodeError::NotAnImage {
                    what: "Pair",
                    length: wrong,
                    expected: length,
                })
            );
        }
        let image = &room[shift..shift + length];
        let read = Reader::of(image, Encoding::Image).in_place::<Pair>();
        assert_eq!(read.expect("a pair").numbers, [-5, 9]);
        let value = Reader::of(image, Encoding::Image).value::<Pair>();
        assert_eq!(value, Ok(vec![-5, 9]));
        // A number outside its range, and a byte that is not a bool.
        room[shift + 8] = 10;
        let image = &room[shift..shift + length];
        let read = Reader::of(image, Encoding::Image).in_place::<Pair>();
        assert!(matches!(read, Err(DecodeError::OutOfRange { .. })));
        room[shift] = 2;
        room[shift + 8] = 9;
        let image = &room[shift..shift + length];
        let read = Reader::of(image, Encoding::Image).in_place::<Pair>();
        let on = read.map(|pair| pair.on.get());
        assert!(matches!(
            on,
            Ok(Err(DecodeError::NoSuchValue { value: 2, .. }))
        ));
    }
    pair.reset();
    assert_eq!((pair.on.get(), pair.numbers), (Ok(false), [0, 0]));
    pair.set(&vec![1, 2, 3]).expect_err("there are two");
    pair.set(&vec![1, 2]).expect("two");
    assert_eq!((pair.on.get(), pair.value()), (Ok(true), Ok(vec![1, 2])));
}

/// A sender in this process may be of another build, with another range.
#[test]
fn a_value_is_checked_with_the_range_of_its_receiver() {
    for (number, is_sound) in [(9_i32, true), (10, false)] {
        let parameters = HeldValue::from(SharedValue::of((&number,)).expect("a value"));
        let read = read_ranged(&mut parameters.reader());
        assert_eq!(read.is_ok(), is_sound, "{read:?}");
        let result = HeldValue::from(SharedValue::of(&number).expect("a value"));
        let read = result_ranged(&mut result.reader());
        assert_eq!(read.is_ok(), is_sound, "{read:?}");
    }
}
