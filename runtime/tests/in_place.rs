//! What arrives in place may be anything: every pattern of bytes, any length, at any address. The structures are those
//! that rcgen wrote for the camera. `cargo +nightly miri test -p rc-runtime --test in_place` looks for undefined
//! behaviour, too; there the sequences are read only in part.

use interfaces::robo_comp_camera::{CloudInPlace, CloudPoint, Image, ImageInPlace, PixelFormat};
use rc_runtime::middleware::{Cdr, DecodeError, Encoding, InPlace, Reader, Writer, in_place};

/// Behind the numbers and the frame of the camera.
const LENGTH_OF_DATA: usize = 64;

/// Reads a body as a handler would.
fn read(body: &[u8]) -> Result<(), DecodeError> {
    let mut reader = Reader::of(body, Encoding::Image);
    let image = reader.in_place::<ImageInPlace>()?;
    touch(&image);
    Ok(())
}

/// Asks for everything that there is.
fn touch(image: &ImageInPlace) {
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

/// The bytes of an image that is right, in memory that is aligned as a message is.
fn right() -> Box<ImageInPlace> {
    let mut image = in_place::boxed::<ImageInPlace>().expect("memory");
    image.width = 4;
    image.height = 2;
    image.set_frame("left").expect("to fit");
    image.resize_data(8).expect("to fit").fill(9);
    image
}

#[test]
fn every_pattern_of_bytes_is_read_or_refused() {
    use in_place::IntoBytes;
    for pattern in 0..=u8::MAX {
        let mut image = right();
        image.as_mut_bytes()[..128].fill(pattern);
        let _ = read(image.as_bytes());
        // Each byte of what is not data for itself.
        if pattern % 15 == 0 {
            for at in (0..128).step_by(if cfg!(miri) { 8 } else { 1 }) {
                let mut image = right();
                image.as_mut_bytes()[at] = pattern;
                let _ = read(image.as_bytes());
            }
        }
    }
}

#[test]
fn lengths_are_never_believed() {
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
        let mut image = right();
        let bytes = image.as_mut_bytes();
        let place = LENGTH_OF_DATA..LENGTH_OF_DATA + 4;
        assert_eq!(bytes[place.clone()], 8_u32.to_le_bytes());
        bytes[place].copy_from_slice(&length.to_le_bytes());
        assert_eq!(image.data().len(), 2_100_000.min(length as usize));
        assert_eq!(read(image.as_bytes()), Ok(()));
    }
}

#[test]
fn sizes_other_than_that_of_the_type_are_refused() {
    use in_place::IntoBytes;
    let image = right();
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
    // One of another type is of another size.
    let mut reader = Reader::of(bytes, Encoding::Image);
    assert!(reader.in_place::<CloudInPlace>().is_err());
}

#[test]
fn what_lies_askew_is_copied() {
    use in_place::IntoBytes;
    let image = right();
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
fn ranges_hold_and_the_two_encodings_are_not_taken_for_each_other() {
    use in_place::IntoBytes;
    let mut image = right();
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
    // An operation without values in place gets one.
    let mut reader = Reader::of(image.as_bytes(), Encoding::Image);
    assert_eq!(reader.get::<i32>(), Err(DecodeError::Image));
    // CDR is read in place as well as an image is read as a value.
    let value = Image {
        width: 4,
        height: 2,
        frame: "left".to_owned(),
        data: vec![9; 8],
        ..Image::default()
    };
    assert_eq!(
        Reader::of(right().as_bytes(), Encoding::Image)
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
fn a_cloud_comes_back() {
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
