//! Pictures that the simulator draws for those who look at it from outside.

use crate::{house, start};
use rcis::SpecificWorker;
use rcis_generated::interfaces::simulation as calls;
use rcis_generated::testing::TestContext;
use rcis_generated::types::rc_inner_model::Point;
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{Pose, Simulation, Viewpoint, WorkerError};

/// Pixels, width and height.
type Drawn = (Vec<[u8; 3]>, (u32, u32));

fn draw(
    worker: &mut SpecificWorker,
    test: &mut TestContext,
    world: &str,
    view: &Viewpoint,
) -> Result<Drawn, Reason> {
    let file = match Simulation::draw(worker, test, world.to_owned(), view.clone()) {
        Ok(file) => file,
        Err(calls::DrawError::SimulationError(error)) => {
            assert!(!error.what.is_empty());
            return Err(error.reason);
        }
        Err(other) => panic!("{other}"),
    };
    let mut reader = png::Decoder::new(std::io::Cursor::new(file));
    reader.set_transformations(png::Transformations::IDENTITY);
    let mut reader = reader.read_info().expect("an image");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let about = reader.next_frame(&mut bytes).expect("pixels");
    Ok((bytes.as_chunks().0.to_vec(), (about.width, about.height)))
}

fn camera(id: &str) -> Viewpoint {
    Viewpoint {
        camera: id.to_owned(),
        ..Viewpoint::default()
    }
}

fn point(x: f64, y: f64, z: f64) -> Option<Point> {
    Some(Point { x, y, z })
}

#[test]
fn a_world_is_drawn_as_it_is() -> Result<(), WorkerError> {
    let (mut worker, mut test) = house();
    let small = Viewpoint {
        width: 96,
        height: 64,
        ..camera("camera")
    };
    let (before, size) = draw(&mut worker, &mut test, "", &small).expect("a picture");
    assert_eq!((size, before.len()), ((96, 64), 96 * 64));
    // Its noise is that of the sensor alone.
    let again = draw(&mut worker, &mut test, "", &small).expect("a picture");
    assert_eq!(again.0, before);
    Simulation::clone(&mut worker, &mut test, String::new(), "dream".to_owned()).expect("a world");
    // The joint above the camera turns.
    let turned = Pose {
        ry: 0.5,
        ..Pose::default()
    };
    let (pan, base) = ("pan".to_owned(), "base".to_owned());
    Simulation::teleport(&mut worker, &mut test, String::new(), pan, base, turned)
        .expect("a place");
    let (now, _) = draw(&mut worker, &mut test, "", &small).expect("a picture");
    assert_ne!(now, before);
    let (dream, _) = draw(&mut worker, &mut test, "dream", &small).expect("a picture");
    assert_eq!(dream, before);
    Ok(())
}

/// A red ball before a green one, as seen from two sides.
#[test]
fn a_picture_is_taken_from_anywhere() {
    let scene = r##"<innerModel>
        <sphere id="red" tz="-500" radius="100" texture="#ff0000"/>
        <sphere id="green" tz="500" radius="100" texture="#00ff00"/>
        <camera id="eye" width="40" height="30" focal="30"/>
        <camera id="blind"/>
        </innerModel>"##;
    let (mut worker, mut test) = start(scene);
    let from = |eye, target| Viewpoint {
        eye,
        target,
        width: 60,
        height: 40,
        ..Viewpoint::default()
    };
    let middle =
        |(pixels, (width, height)): Drawn| pixels[(height / 2 * width + width / 2) as usize];
    for (view, is_red) in [
        (from(point(0.0, 0.0, -2000.0), None), true),
        (from(point(0.0, 0.0, 2000.0), None), false),
        (
            from(point(2000.0, 0.0, -500.0), point(0.0, 0.0, -500.0)),
            true,
        ),
        (camera("eye"), false),
    ] {
        let drawn = draw(&mut worker, &mut test, "", &view).expect("a picture");
        let [red, green, _] = middle(drawn);
        // The side away from the light is dark; the sky has all colours.
        let (more, less) = if is_red { (red, green) } else { (green, red) };
        assert!(more > 30 && less < 10, "{view:?}: {red} {green}");
    }
    let whole = draw(&mut worker, &mut test, "", &Viewpoint::default());
    let (pixels, size) = whole.expect("a picture");
    assert_eq!(size, (960, 640));
    for colour in [0, 1] {
        let is_seen = |p: &&[u8; 3]| p[colour] > 30 && p[1 - colour] < 10;
        assert!(pixels.iter().filter(is_seen).count() > 1000);
    }
    for (world, view, reason) in [
        ("dream", camera("eye"), Reason::UnknownName),
        ("", camera("ey"), Reason::UnknownNode),
        ("", camera("red"), Reason::WrongKind),
        ("", camera("blind"), Reason::WrongKind),
        (
            "",
            from(point(f64::NAN, 0.0, 0.0), None),
            Reason::WrongValue,
        ),
        (
            "",
            Viewpoint {
                width: -1,
                ..Viewpoint::default()
            },
            Reason::WrongValue,
        ),
        (
            "",
            Viewpoint {
                width: 4000,
                height: 4000,
                ..Viewpoint::default()
            },
            Reason::WrongValue,
        ),
    ] {
        let refused = draw(&mut worker, &mut test, world, &view);
        assert_eq!(refused.expect_err("a refusal"), reason, "{view:?}");
    }
}
