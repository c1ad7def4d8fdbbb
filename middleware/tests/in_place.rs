//! Bodies received in place may contain any bytes, at any length and address. The structures are
//! generated from the interface of the camera. `cargo +nightly miri test -p rc-middleware --test
//! in_place` also detects undefined behaviour; under Miri, the sequences are read partly.

use interfaces::robo_comp_camera::{CloudInPlace, CloudPoint, Image, ImageInPlace, PixelFormat};
use rc_middleware::{Cdr, DecodeError, Encoding, InPlace, Reader, Writer, in_place};

/// The offset of the length of `data`, after the numbers and `frame`.
const LENGTH_OF_DATA: usize = 64;

/// Decodes a body as a handler does.
fn read(body: &[u8]) -> Result<(), DecodeError> {
    let mut reader = Reader::of(body, Encoding::Image);
    let image = reader.in_place::<ImageInPlace>()?;
    read_all_members(&image);
    Ok(())
}

/// Reads every member.
fn read_all_members(image: &ImageInPlace) {
    assert!(image.data().len() <= 2_100_000);
    assert!((0..=4096).contains(&image.width) && (0..=4096).contains(&image.height));
    let ends = [image.data().first(), image.data().last()];
    std::hint::black_box(ends);
    if let Ok(frame) = image.frame() {
        assert!(frame.len() <= 32 && !frame.contains('\0'));
    }
    match image.format.get() {
        Ok(PixelFormat::Grey | PixelFormat::Rgb) => {}
        Err(error) => assert!(matches!(error, DecodeError::NoSuchValue { .. })),
    }
    if !cfg!(miri) {
        let _ = image.value();
    }
}

/// The bytes of a valid image, in memory with the alignment of a message.
fn valid_image() -> Box<ImageInPlace> {
    let mut image = in_place::boxed::<ImageInPlace>().expect("memory");
    image.width = 4;
    image.height = 2;
    image.set_frame("left").expect("to fit");
    image.resize_data(8).expect("to fit").fill(9);
    image
}

#[test]
fn any_bytes_are_decoded_or_rejected() {
    use in_place::IntoBytes;
    for pattern in 0..=u8::MAX {
        let mut image = valid_image();
        image.as_mut_bytes()[..128].fill(pattern);
        let _ = read(image.as_bytes());
        // Each byte before `data` on its own.
        if pattern % 15 == 0 {
            for at in (0..128).step_by(if cfg!(miri) { 8 } else { 1 }) {
                let mut image = valid_image();
                image.as_mut_bytes()[at] = pattern;
                let _ = read(image.as_bytes());
            }
        }
    }
}

#[test]
fn invalid_lengths_are_limited() {
    use in_place::IntoBytes;
    for length in [
        0_u32,
        1,
        2_099_999,
        2_100_000,
        2_100_001,
        u32::MAX / 2,
        u32::MAX,
    ] {
        let mut image = valid_image();
        let bytes = image.as_mut_bytes();
        let place = LENGTH_OF_DATA..LENGTH_OF_DATA + 4;
        assert_eq!(bytes[place.clone()], 8_u32.to_le_bytes());
        bytes[place].copy_from_slice(&length.to_le_bytes());
        assert_eq!(image.data().len(), 2_100_000.min(length as usize));
        assert_eq!(read(image.as_bytes()), Ok(()));
    }
}

#[test]
fn bodies_of_another_size_are_rejected() {
    use in_place::IntoBytes;
    let image = valid_image();
    let bytes = image.as_bytes();
    for length in [0, 1, 7, 8, 100, bytes.len() - 8, bytes.len() - 1] {
        let refused = read(&bytes[..length]);
        assert!(
            matches!(refused, Err(DecodeError::NotAnImage { .. })),
            "{length}: {refused:?}"
        );
    }
    let longer = vec![0_u64; bytes.len() / 8 + 2];
    assert!(matches!(
        read(longer.as_bytes()),
        Err(DecodeError::NotAnImage { .. })
    ));
    // A type with another size.
    let mut reader = Reader::of(bytes, Encoding::Image);
    assert!(reader.in_place::<CloudInPlace>().is_err());
}

#[test]
fn an_unaligned_body_is_copied() {
    use in_place::IntoBytes;
    let image = valid_image();
    for shift in 1..8 {
        let mut room = vec![0_u64; image.as_bytes().len() / 8 + 2];
        let room = &mut room.as_mut_bytes()[shift..shift + image.as_bytes().len()];
        room.copy_from_slice(image.as_bytes());
        let mut reader = Reader::of(room, Encoding::Image);
        let read = reader.in_place::<ImageInPlace>().expect("an image");
        assert!(matches!(read, in_place::Placed::Copied(_)));
        assert_eq!((read.data(), read.frame()), ([9; 8].as_slice(), Ok("left")));
        if cfg!(miri) && shift > 1 {
            break;
        }
    }
}

#[test]
fn ranges_are_checked_and_the_encodings_are_distinguished() {
    use in_place::IntoBytes;
    let mut image = valid_image();
    image.width = -1;
    let refused = read(image.as_bytes());
    assert!(
        matches!(
            refused,
            Err(DecodeError::OutOfRange {
                what: "Image.width",
                ..
            })
        ),
        "{refused:?}"
    );
    // An operation without in-place values receives one.
    let mut reader = Reader::of(image.as_bytes(), Encoding::Image);
    assert_eq!(reader.get::<i32>(), Err(DecodeError::Image));
    // CDR can be read in place, and an image can be read as a value.
    let value = Image {
        width: 4,
        height: 2,
        frame: "left".to_owned(),
        data: vec![9; 8],
        ..Image::default()
    };
    assert_eq!(
        Reader::of(valid_image().as_bytes(), Encoding::Image)
            .value::<ImageInPlace>()
            .as_ref(),
        Ok(&value)
    );
    let mut writer = Writer::default();
    writer.put(&value);
    let bytes = writer.into_bytes();
    let read = Reader::new(&bytes)
        .in_place::<ImageInPlace>()
        .expect("an image");
    assert_eq!(read.value().as_ref(), Ok(&value));
    assert_eq!(Image::decode(&mut Reader::new(&bytes)).as_ref(), Ok(&value));
}

#[test]
fn sequences_of_structures_are_converted_to_values() {
    let mut cloud = in_place::boxed::<CloudInPlace>().expect("memory");
    let points = cloud.resize_points(3).expect("to fit");
    for (point, x) in points.iter_mut().zip([1.0, 2.0, 3.0]) {
        (point.x, point.y, point.z) = (x, -x, 0.5);
    }
    let value = cloud.value().expect("a value");
    assert_eq!(
        value.points[1],
        CloudPoint {
            x: 2.0,
            y: -2.0,
            z: 0.5
        }
    );
    assert!(cloud.resize_points(100_001).is_err());
    assert_eq!(cloud.points().len(), 3, "what does not fit changes nothing");
}
