//! Pictures of running networks, which their simulators draw. `rcdeploy` asks them, so this program
//! needs no middleware.

use crate::command_line::{Failure, Live};
use innermodel::{Folders, InnerModel, Point, Vector};
use innermodel_render::{Scene, View};
use innermodel_viewer::{Navigator, Picture, PictureRequest, Steered, Viewpoint, watch};
use rc_diagnostics::foreign::clean;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

/// How long an answer may take, in seconds.
const LIMIT: &str = "30";
/// The distance from the camera to the point that it looks at, in millimetres.
const IN_FRONT: f64 = 1000.0;

/// Shows the world of a running network in a window, or draws it into a file.
pub(crate) fn show(live: &Live) -> Result<(), Failure> {
    let bytes = draw(live, live.size, None, Stdio::inherit())?;
    if let Some(path) = &live.png {
        let written = rc_files::write(path, bytes);
        return written.map_err(|error| Failure::System(format!("{}: {error}", path.display())));
    }
    let first = Picture::of_png(&bytes).map_err(Failure::System)?;
    let size = crate::window_size(live.size.or_else(|| {
        let height = first.colours.len() / first.width.max(1);
        Some((first.width, height))
    }));
    let steered = match &live.camera {
        Viewpoint::Camera(_) => None,
        viewpoint => Some(steered(live, viewpoint, (size.0.into(), size.1.into()))?),
    };
    let title = match &live.network {
        Some(network) => format!("{} – rcview", clean(&network.to_string_lossy())),
        None => "rcview".to_owned(),
    };
    let asked = live.clone();
    let ask = move |wish: &PictureRequest| {
        let drawn = draw(&asked, Some(wish.size), wish.view.as_ref(), Stdio::null());
        let bytes = drawn.map_err(|failure| failure.text().to_owned())?;
        Picture::of_png(&bytes)
    };
    let shown = watch(&title, size, first, steered, ask);
    shown.map_err(|error| Failure::System(format!("{error}; `--png FILE` needs no window")))
}

/// The camera that the user moves. Bodies hidden by meshes that are not on this computer do not
/// matter, but then the simulator chooses the first view.
fn steered(live: &Live, viewpoint: &Viewpoint, size: (usize, usize)) -> Result<Steered, Failure> {
    let result = call(live, "print", &json!({}), Stdio::inherit())?;
    let text = result["return"].as_str().unwrap_or_default();
    let wrong = |error: String| Failure::Input(clean(error.trim_end()));
    let read = innermodel::read_text(text, Path::new("live.xml"), &Folders::default());
    let (document, _) = read.map_err(|error| wrong(error.to_string()))?;
    let model = InnerModel::from_document(&document).map_err(|error| wrong(error.to_string()))?;
    let tree = model.snapshot();
    let mut scene = Scene::new();
    let extents = scene.extents(&tree);
    if *viewpoint == Viewpoint::Whole {
        return Ok(Steered {
            navigator: Navigator::around(&tree, &extents, size),
            sees_all: scene.problems().is_empty(),
        });
    }
    let view = viewpoint.view(&tree, &extents, Some(size));
    let view = view.map_err(|error| wrong(error.to_string()))?;
    Ok(Steered {
        navigator: Navigator::at(&view, innermodel_viewer::scene(&extents).1),
        sees_all: false,
    })
}

/// The bytes of a picture as PNG, from a view or from where the command line says.
fn draw(
    live: &Live,
    size: Option<(usize, usize)>,
    view: Option<&View>,
    errors: Stdio,
) -> Result<Vec<u8>, Failure> {
    let mut wanted = match view {
        None => viewpoint(&live.camera),
        Some(View { place, .. }) => {
            let eye = Point::from(place.translation);
            let target = eye + place.vector(&Vector::z()) * IN_FRONT;
            viewpoint(&Viewpoint::Point(eye, Some(target)))
        }
    };
    if let Some((width, height)) = size {
        wanted["width"] = width.into();
        wanted["height"] = height.into();
    }
    let result = call(live, "draw", &json!({ "view": wanted }), errors)?;
    png(&result).ok_or_else(|| Failure::System("the simulator has given no picture".to_owned()))
}

/// The result of an operation of the simulator.
fn call(live: &Live, operation: &str, arguments: &Value, errors: Stdio) -> Result<Value, Failure> {
    let mut command = Command::new(rcdeploy());
    command.arg("call").args(&live.network);
    command.arg(match &live.simulator {
        Some(name) => format!("{name}.Simulation.{operation}"),
        None => format!("Simulation.{operation}"),
    });
    command.arg(arguments.to_string());
    command.args(["--format", "json", "--timeout", LIMIT]);
    // The error messages of `rcdeploy` are for the user.
    let ran = command.stdin(Stdio::null()).stderr(errors);
    let ran = ran.output().map_err(|error| {
        Failure::System(format!(
            "cannot run `rcdeploy`, which asks the simulator: {error}"
        ))
    })?;
    let reply: Value = serde_json::from_slice(&ran.stdout).unwrap_or_default();
    if let Some(reason) = reply["value"]["what"].as_str() {
        return Err(Failure::Input(clean(reason)));
    }
    if ran.status.success() {
        return Ok(reply["result"].clone());
    }
    let mut text = match &live.network {
        Some(network) => {
            let network = clean(&network.to_string_lossy());
            format!("the simulator of `{network}` has not answered")
        }
        None => "the simulator has not answered".to_owned(),
    };
    if live.simulator.is_none() {
        text += "; if there are several, choose one with `--simulator NAME`";
    }
    Err(match ran.status.code() {
        Some(1 | 2) => Failure::Input(text),
        _ => Failure::System(text),
    })
}

/// The program next to this one, else the one in the path.
pub(crate) fn rcdeploy() -> OsString {
    let own = std::env::current_exe().ok();
    let beside = own.map(|own| own.with_file_name("rcdeploy"));
    let beside = beside.filter(|path| path.is_file());
    beside.map_or_else(|| "rcdeploy".into(), Into::into)
}

/// A viewpoint as the simulator takes it.
fn viewpoint(from: &Viewpoint) -> Value {
    let point = |point: &Point| json!({"x": point.x, "y": point.y, "z": point.z});
    match from {
        Viewpoint::Whole => json!({}),
        Viewpoint::Camera(id) => json!({ "camera": id }),
        Viewpoint::Point(eye, None) => json!({ "eye": point(eye) }),
        Viewpoint::Point(eye, Some(target)) => {
            json!({ "eye": point(eye), "target": point(target) })
        }
    }
}

/// The bytes of the picture in a result.
fn png(result: &Value) -> Option<Vec<u8>> {
    let bytes = result["return"].as_array()?.iter();
    let bytes = bytes.map(|byte| byte.as_u64().and_then(|byte| u8::try_from(byte).ok()));
    let bytes: Vec<u8> = bytes.collect::<Option<_>>()?;
    bytes.starts_with(b"\x89PNG").then_some(bytes)
}
