//! Images in files, without a window.

use crate::{rcview, scene};
use innermodel::{Folders, InnerModel, Point, sensors};
use innermodel_render::camera;
use innermodel_viewer::innermodel;
use std::collections::HashMap;
use std::path::Path;
use std::process::Output;

fn run(file: &str, arguments: &[&str]) -> Output {
    let mut command = rcview();
    command.arg(scene(file)).args(arguments);
    command.env_remove("DISPLAY").output().expect("to run it")
}

/// The pixels of a file, with their width.
fn pixels(path: &Path) -> (Vec<[u8; 3]>, usize) {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("a file"));
    let mut reader = png::Decoder::new(file).read_info().expect("an image");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let about = reader.next_frame(&mut bytes).expect("pixels");
    (bytes.as_chunks().0.to_vec(), about.width as usize)
}

fn success(output: &Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The middle of a body on the image is its projected centre, and the colours are those listed.
#[test]
fn ids_are_colours_at_their_projected_pixels() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ids.png");
    let name = path.display().to_string();
    let output = run(
        "house.xml",
        &["--camera", "watch_camera", "--png", &name, "--ids"],
    );
    let list = success(&output);
    let colours: HashMap<&str, [u8; 3]> = list
        .lines()
        .map(|line| {
            let (colour, id) = line.split_once(' ').expect("two words");
            let number = u32::from_str_radix(&colour[1..], 16).expect("a colour");
            let [_, red, green, blue] = number.to_be_bytes();
            (id, [red, green, blue])
        })
        .collect();
    let model = InnerModel::load(&scene("house.xml"), &Folders::default()).expect("a model");
    let tree = model.snapshot();
    assert_eq!(colours.len(), tree.len());
    let view = camera(&tree, "watch_camera")
        .expect("a node")
        .expect("a camera");
    let (pixels, width) = pixels(&path);
    assert_eq!((width, pixels.len()), (640, 640 * 480));
    // Nothing is before the ball in the bowl.
    let centre = tree
        .transform("watch_camera", Point::origin(), "bowl_body")
        .expect("a point");
    let (u, v) = sensors::project(&view.camera, &centre).expect("a pixel");
    let seen = pixels
        .iter()
        .enumerate()
        .filter(|(_, pixel)| **pixel == colours["bowl_body"]);
    let places: Vec<(f64, f64)> = seen
        .map(|(at, _)| ((at % width) as f64 + 0.5, (at / width) as f64 + 0.5))
        .collect();
    assert!(places.len() > 100, "{}", places.len());
    let count = places.len() as f64;
    let x = places.iter().map(|place| place.0).sum::<f64>() / count;
    let y = places.iter().map(|place| place.1).sum::<f64>() / count;
    assert!(
        (x - u).abs() < 1.0 && (y - v).abs() < 1.0,
        "{x} {y}, not {u} {v}"
    );
}

#[test]
fn frames_names_and_joints_change_the_image() {
    let folder = tempfile::tempdir().expect("a folder");
    let draw = |name: &str, more: &[&str]| {
        let path = folder.path().join(name);
        let text = path.display().to_string();
        let all = [
            "--png",
            &text,
            "--size",
            "160x120",
            "--camera",
            "900,1500,900,0,1000,0",
        ];
        success(&run("arm.xml", &[&all, more].concat()));
        pixels(&path).0
    };
    let plain = draw("plain.png", &[]);
    assert_eq!(plain.len(), 160 * 120);
    assert_eq!(plain, draw("again.png", &[]));
    for more in [&["--frames"][..], &["--names"], &["--joint", "joint_2=1.2"]] {
        let other = draw("other.png", more);
        let count = plain.iter().zip(&other).filter(|(a, b)| a != b).count();
        assert!(count > 20, "{more:?}: {count}");
    }
    let white = draw("names.png", &["--names"])
        .iter()
        .filter(|p| **p == [255; 3])
        .count();
    assert!(white > 500, "{white}");
}

#[test]
fn wrong_requests_are_refused_with_what_is_allowed() {
    for (arguments, code, text) in [
        (
            &["--png", "x.png", "--camera", "cup"][..],
            1,
            "`cup` is not a camera; there is none",
        ),
        (
            &["--png", "x.png", "--camera", "cupp"],
            1,
            "did you mean `cup`?",
        ),
        (
            &["--png", "x.png", "--joint", "cup=1"],
            1,
            "`cup` is a transform, not a joint",
        ),
        (
            &["--png", "x.png", "--joint", "cup"],
            2,
            "expected an id and a number",
        ),
        (
            &["--png", "x.png", "--size", "640"],
            2,
            "expected a width and a height",
        ),
        (
            &["--png", "x.png", "--size", "99999x99999"],
            1,
            "at most 16777216",
        ),
        (&["--ids"], 2, "`--ids` needs `--png FILE`"),
        (&["--pngg"], 2, "--pngg"),
        (
            &["--edit", "--png", "x.png"],
            2,
            "`--edit` cannot be used with `--png`",
        ),
        (&["--edit"], 3, "cannot open a window"),
        (
            &["--png", "/no/such/folder/x.png"],
            3,
            "/no/such/folder/x.png",
        ),
        (&[], 3, "cannot open a window"),
    ] {
        let output = run("arm.xml", arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(text), "{arguments:?}: {error}");
    }
    for (arguments, text) in [
        (
            &["--simulator", "seen", "x.xml"][..],
            "`--simulator` needs `--live`",
        ),
        (
            &["--live", "house", "--png", "x.png", "x.xml"],
            "`--live` cannot be used with a file",
        ),
        (
            &["--live", "--png", "x.png", "x.xml"],
            "`--live` cannot be used with a file",
        ),
        (&["x.xml", "y.xml"], "unexpected argument"),
        (
            &["--world", "home", "x.xml"],
            "`--world` cannot be used with a file",
        ),
        (
            &["--world", "--live", "home"],
            "`--live` cannot be used with `--world`",
        ),
        (
            &["--world", "home", "--joint", "a=1"],
            "`--world` cannot be used with `--joint`",
        ),
        (
            &["--live", "house", "--png", "x.png", "--joint", "a=1"],
            "`--live` cannot be used with `--joint`",
        ),
    ] {
        let output = rcview().args(arguments).output().expect("to run it");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(error.contains(text), "{arguments:?}: {error}");
    }
    let none = run("none.xml", &[]);
    assert_eq!(none.status.code(), Some(3));
    let help = run("arm.xml", &["--help"]);
    assert!(success(&help).contains("--camera <CAMERA>"));
}

/// The members that a simulator of the scene opens, as a network lists them.
#[test]
fn members_of_slot_arrays_are_printed_as_a_network_lists_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |body: &str| {
        let path = folder.path().join("scene.xml");
        let text = format!("<innerModel><transform id=\"world\">{body}</transform></innerModel>");
        std::fs::write(&path, text).expect("a file");
        let mut command = rcview();
        command.arg(path).arg("--slots").env_remove("DISPLAY");
        command.output().expect("to run it")
    };
    let laser = |id: &str| {
        format!("<laser id=\"{id}\" min=\"100\" max=\"9000\" angle=\"3\" measures=\"90\"/>")
    };
    let scene = format!(
        "<differentialrobot id=\"robot\">{}<touchsensor id=\"left\"/><touchsensor id=\"right\"/></differentialrobot>\
         <transform id=\"arm\"><joint id=\"elbow\"><joint id=\"wrist\"/></joint></transform>\
         <rgbd id=\"top\" focal=\"500\" width=\"640\" height=\"480\"/>{}",
        laser("front"),
        laser("door")
    );
    let printed = success(&file(&scene));
    let expected = r#"slots
{
    lasers         "front", "door"; // Laser
    touch_sensors  "robot"; // TouchSensor
    bumpers        "robot"; // Bumper
    cameras        "top"; // Camera
    simple_cameras "top"; // CameraSimple
    rgbd_cameras   "top"; // CameraRGBDSimple
    rgbds          "top"; // RGBD
    poses          "robot"; // FullPoseEstimation
    bases          "robot"; // DifferentialRobot
    generic_bases  "robot"; // GenericBase
    motors         "world"; // JointMotor
    pose_topics    "robot"; // FullPoseEstimationPub
};
"#;
    assert_eq!(printed, expected);
    let refused = |body: &str| {
        let output = file(body);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert_eq!(
        refused(&laser("front-left")),
        "rcview: error: `front-left` cannot be a member of `lasers`: the name of a member has a letter, then letters, \
         digits and single `_`, none at the end\n"
    );
    assert_eq!(
        refused(&(laser("front") + &laser("Front"))),
        "rcview: error: `front` and `Front` of `lasers` differ only in case\n"
    );
}

/// The points of a file are on the image where they are projected, in their colours.
#[test]
fn points_of_a_file_fill_a_cloud() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let world = r#"<innerModel><transform id="head" ty="100"><pointcloud id="seen"/></transform></innerModel>"#;
    std::fs::write(at("world.xml"), world).expect("a file");
    std::fs::write(at("seen.xyz"), "# points\n0 0 0 255 10 20\n\n150 50 10\n").expect("a file");
    let draw = |points: &str, more: &[&str]| {
        let mut command = rcview();
        command.args([&at("world.xml"), "--camera", "0,100,-1000,0,100,0"]);
        command.args(["--size", "200x100", "--png", &at("seen.png")]);
        command.args(["--points", points]).args(more);
        command.env_remove("DISPLAY").output().expect("to run it")
    };
    let filled = format!("seen={}", at("seen.xyz"));
    success(&draw(&filled, &[]));
    let (seen, width) = pixels(Path::new(&at("seen.png")));
    // The focal length is 200 pixels, and the camera looks along z at the height of the points.
    assert_eq!(seen[50 * width + 100], [255, 10, 20]);
    let (u, v) = (100.0 + 200.0 * 150.0 / 1010.0, 50.0 - 200.0 * 50.0 / 1010.0);
    assert_eq!(seen[v as usize * width + u as usize], [255; 3]);
    let list = success(&draw(&filled, &["--ids"]));
    let line = list.lines().find(|line| line.ends_with(" seen"));
    let number = u32::from_str_radix(&line.expect("a line")[1..7], 16).expect("a colour");
    let [_, red, green, blue] = number.to_be_bytes();
    let (ids, _) = pixels(Path::new(&at("seen.png")));
    assert_eq!(ids[50 * width + 100], [red, green, blue]);

    std::fs::write(at("bad.xyz"), "0 0 0\n1 2 nan\n").expect("a file");
    for (points, code, expected) in [
        (
            format!("seen={}", at("bad.xyz")),
            1,
            "bad.xyz:2: expected three finite numbers",
        ),
        (format!("sen={}", at("seen.xyz")), 1, "`seen`"),
        (
            format!("head={}", at("seen.xyz")),
            1,
            "`head` is a transform, not a pointcloud",
        ),
        (format!("seen={}", at("none.xyz")), 3, "No such file"),
        (
            format!("seen={}", folder.path().display()),
            3,
            "not a regular file",
        ),
        ("seen".to_owned(), 2, "expected an id and a file"),
    ] {
        let output = draw(&points, &[]);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{points}: {errors}");
        assert!(errors.contains(expected), "{points}: {errors}");
    }
}

/// A robot and a mesh are not InnerModel files; the message says how they become one, which works.
#[test]
fn files_of_others_say_how_they_are_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| {
        let mut command = rcview();
        command.args(arguments).current_dir(folder.path());
        command.env_remove("DISPLAY").output().expect("to run it")
    };
    let corners = "v 0 0 0\nv 900 0 0\nv 0 900 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("part.OBJ"), corners).expect("a file");
    let output = run(&["part.OBJ"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert!(errors.contains("then: rcview part.xml"), "{errors}");
    let scene = errors.split('`').nth(1).expect("a text");
    std::fs::write(folder.path().join("part.xml"), scene).expect("a file");
    success(&run(&["part.xml", "--png", "part.png"]));
    for arguments in [&["arm.urdf"][..], &["arm.urdf", "--edit"]] {
        let errors = String::from_utf8_lossy(&run(arguments).stderr).into_owned();
        assert!(
            errors.contains("rcgen import arm.urdf --out arm.xml"),
            "{errors}"
        );
    }
}
