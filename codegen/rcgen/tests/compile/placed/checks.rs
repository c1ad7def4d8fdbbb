//! Conversions of all kinds of values to in-place form and back; run by `tests/compile.rs`.

use placed_generated::testing::{PicturesSample, TestContext, in_place};
use placed_generated::{
    CallError, Camera, Cloud, CloudInPlace, Context, Dot, InPlace, Names, NamesInPlace,
    NamesInPlace_, NamesInPlaceRowsItem, NamesInPlaceRowsItem_, NamesInPlaceRowsItem2,
    NamesRowsItem, One, Picture, PictureInPlace, PicturePub, SendError, Shade, Worker, WorkerError,
};
use rc_runtime::middleware::in_place::{IntoBytes, boxed};
use rc_runtime::middleware::{DecodeError, Encoding, Reader, Writer};

fn picture(note: Option<&str>) -> Picture {
    Picture {
        width: 3,
        valid: false,
        kind: Shade::Grey,
        name: "left".to_owned(),
        matrix: [0.5; 9],
        flags: [true, false, true],
        kinds: [Shade::Colour, Shade::Grey],
        exposure: note.map(|_| 0.25),
        note: note.map(str::to_owned),
        data: vec![1, 2, 3],
        ..Picture::default()
    }
}

fn cloud() -> Cloud {
    Cloud {
        points: vec![
            Dot {
                ring: 63,
                ..Dot::default()
            };
            3
        ],
        labels: vec!["a".to_owned(), String::new()],
        rows: vec![vec![1.0, 2.0], vec![]],
        corners: std::array::from_fn(|at| format!("corner {at}")),
        thumbnail: picture(Some("small")),
        views: [picture(None), picture(Some("big"))],
        kinds: vec![Shade::Grey, Shade::Colour],
        flags: vec![true, false],
        centre: Some(Dot::default()),
        outline: Vec::new(),
        type_: vec![0.5],
        type_length: 7,
        a_sequence_with_a_name_that_is_longer_than_most: vec![9],
    }
}

#[test]
fn every_kind_of_member_comes_back() {
    let mut place = boxed::<CloudInPlace>().expect("memory");
    for value in [cloud(), Cloud::default(), cloud()] {
        place.set(&value).expect("to fit");
        assert_eq!(place.value(), Ok(value));
    }
    place.reset();
    assert_eq!(place.value(), Ok(Cloud::default()));
}

#[test]
fn ranges_hold_wherever_the_number_stands() {
    let faults: [fn(&mut CloudInPlace); 5] = [
        |cloud| cloud.points_mut()[1].ring = 64,
        |cloud| cloud.centre_mut()[0].ring = 200,
        |cloud| cloud.thumbnail.width = 0,
        |cloud| cloud.views[1].ratio = f32::NAN,
        |cloud| cloud.views[1].exposure_mut()[0] = -1.0,
    ];
    for fault in faults {
        let mut place = boxed::<CloudInPlace>().expect("memory");
        place.set(&cloud()).expect("to fit");
        assert_eq!(place.check(), Ok(()));
        fault(&mut place);
        assert!(matches!(place.check(), Err(DecodeError::OutOfRange { .. })));
    }
}

/// As `f64`, 2^53 + 1 would be 2^53.
#[test]
fn integers_of_64_bits_are_compared_exactly() {
    const MOST: i64 = 1 << 53;
    let mut place = boxed::<CloudInPlace>().expect("memory");
    for (captured, fits) in [
        (MOST, true),
        (MOST + 1, false),
        (-MOST, true),
        (-MOST - 1, false),
    ] {
        let mut value = cloud();
        value.thumbnail.captured = captured;
        place.set(&cloud()).expect("to fit");
        place.thumbnail.captured = captured;
        let mut writer = Writer::default();
        writer.put(&value);
        let written = writer.finish().map(<[u8]>::to_vec);
        if fits {
            assert_eq!(place.check(), Ok(()));
            assert!(written.is_ok());
            continue;
        }
        let text =
            format!("is {captured}, outside its range -9007199254740992 to 9007199254740992");
        let found = place.check().expect_err("too far").to_string();
        assert!(found.ends_with(&text), "{found}");
        let refused = written.expect_err("too far").to_string();
        assert!(refused.ends_with(&text), "{refused}");
    }
}

#[test]
fn what_was_there_before_does_not_shine_through() {
    let mut place = boxed::<CloudInPlace>().expect("memory");
    place.set(&cloud()).expect("to fit");
    place.reset();
    assert!(
        place
            .resize_labels(2)
            .expect("to fit")
            .iter()
            .all(|label| label.items() == Ok(""))
    );
    assert!(
        place
            .resize_rows(2)
            .expect("to fit")
            .iter()
            .all(|row| row.items().is_empty())
    );
    assert!(
        place
            .views
            .iter()
            .all(|view| view.note().is_empty() && view.data().is_empty())
    );
}

#[test]
fn any_bytes_are_read_or_refused() {
    let size = size_of::<PictureInPlace>();
    let head = size - 2_100_000 - 8;
    let mut room = vec![0_u64; size / 8];
    for pattern in 0..=u8::MAX {
        for at in (0..head).step_by(7) {
            let bytes = room.as_mut_bytes();
            bytes[..head].fill(0);
            bytes[at..head.min(at + 9)].fill(pattern);
            let Ok(picture) = Reader::of(bytes, Encoding::Image).in_place::<PictureInPlace>()
            else {
                continue;
            };
            assert!(picture.name().is_err() || picture.name().is_ok_and(|name| name.len() <= 20));
            assert!(picture.exposure().len() <= 1 && picture.note().len() <= 1);
            let _ = (
                picture.kind.get(),
                picture.valid.get(),
                picture.flags[2].get(),
            );
        }
    }
}

/// Members and operations keep their names, even if generated functions would have the same.
#[test]
fn names_of_the_interface_come_first() {
    let value = Names {
        name: "a".to_owned(),
        set_name: "b".to_owned(),
        data: vec![1],
        data_mut: vec![2],
        resize_data: vec![3],
        rows: vec![vec![vec![4]]],
    };
    let mut place = boxed::<NamesInPlace>().expect("memory");
    place.set(&value).expect("to fit");
    assert_eq!((place.name(), place.set_name()), (Ok("a"), Ok("b")));
    assert_eq!(
        (place.data(), place.data_mut(), place.resize_data()),
        (&[1][..], &[2][..], &[3][..])
    );
    place.set_name_("c").expect("to fit");
    place.set_set_name("d").expect("to fit");
    place.data_mut_()[0] = 5;
    place.data_mut_mut()[0] = 6;
    place.resize_data_(2).expect("to fit")[1] = 7;
    let rows: &[NamesInPlaceRowsItem] = place.rows();
    let inner: &[NamesInPlaceRowsItem2] = rows[0].items();
    assert_eq!(inner[0].items(), &[4]);
    let read = place.value().expect("valid");
    assert_eq!((read.name.as_str(), read.set_name.as_str()), ("c", "d"));
    assert_eq!((read.data, read.data_mut), (vec![5, 7], vec![6]));
}

/// Checks at compile time that these functions exist.
#[test]
fn operations_in_place_make_room() {
    fn _all(ctx: &mut Context) -> Result<(), SendError> {
        ctx.names_pub.some(&Names::default())?;
        ctx.names_pub.loan_some(&NamesInPlace_::default())?;
        ctx.names_pub.loan_loan_some(&NamesRowsItem::default())?;
        ctx.names_pub.loan_some_()?.set(&Names::default())?;
        ctx.names_pub
            .loan_loan_some_()?
            .set(&NamesInPlace_::default())?;
        ctx.names_pub
            .loan_loan_loan_some()?
            .set(&NamesRowsItem::default())?;
        Ok(())
    }
    fn _calls(ctx: &mut Context) -> Result<(), CallError> {
        let _: Names = ctx.names.all()?;
        let _: NamesInPlaceRowsItem_ = ctx.names.all_in_place()?;
        ctx.names
            .all_in_place_(|place: &NamesInPlace| place.data().len())?;
        Ok(())
    }
}

/// Fakes have no shared memory: what is in place is copied.
#[test]
fn fakes_take_and_give_values_in_place() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let mut worker = placed::SpecificWorker::initialize(&mut test)?;
    let mut taken = in_place::<PictureInPlace>()?;
    Camera::take(&mut worker, &mut test, 1, &mut taken);
    PicturePub::new_picture(&mut worker, &mut test, &taken);
    test.other.on_take(|number| Picture {
        width: number,
        ..picture(Some("left"))
    });
    let ctx: &mut Context = &mut test;
    assert_eq!(ctx.other.take(5)?.width, 5);
    let width = ctx
        .other
        .take_in_place(6, |picture| (picture.width, picture.data().len()))?;
    assert_eq!(width, (6, 3));
    let mut sample = ctx.pictures.loan_new_picture()?;
    sample.set(&picture(None))?;
    sample.send()?;
    ctx.pictures.move_(&One { x: vec![1] })?;
    let published = [
        PicturesSample::NewPicture {
            picture: picture(None),
        },
        PicturesSample::Move {
            one: One { x: vec![1] },
        },
    ];
    assert_eq!(test.pictures.samples(), published);
    Ok(())
}
