//! Pictures of running networks, which their simulators draw. `rcdeploy` asks them, so this program
//! needs no middleware.

use crate::command_line::{Failure, Live};
use innermodel::Point;
use innermodel_viewer::Viewpoint;
use rc_diagnostics::foreign::clean;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::process::{Command, Stdio};

/// The operation of the simulator.
const OPERATION: &str = "Simulation.draw";
/// How long the picture may take, in seconds.
const LIMIT: &str = "30";

/// Draws the world of a running network into a file.
pub(crate) fn draw(live: &Live) -> Result<(), Failure> {
    let mut command = Command::new(rcdeploy());
    command.arg("call").arg(&live.network);
    command.args([OPERATION, &parameters(live).to_string()]);
    command.args(["--format", "json", "--timeout", LIMIT]);
    // What `rcdeploy` says about errors is for the user.
    let ran = command.stdin(Stdio::null()).stderr(Stdio::inherit());
    let ran = ran.output().map_err(|error| {
        Failure::System(format!(
            "cannot run `rcdeploy`, which asks the simulator: {error}"
        ))
    })?;
    let reply: Value = serde_json::from_slice(&ran.stdout).unwrap_or_default();
    if let Some(reason) = reply["value"]["what"].as_str() {
        return Err(Failure::Input(clean(reason)));
    }
    let bytes = png(&reply["result"]).ok_or_else(|| {
        let network = clean(&live.network.to_string_lossy());
        let text = format!("`{network}` has given no picture");
        match ran.status.code() {
            Some(1 | 2) => Failure::Input(text),
            _ => Failure::System(text),
        }
    })?;
    let written = rc_files::write(&live.png, bytes);
    written.map_err(|error| Failure::System(format!("{}: {error}", live.png.display())))
}

/// The program beside this one, else the one in the path.
fn rcdeploy() -> OsString {
    let own = std::env::current_exe().ok();
    let beside = own.map(|own| own.with_file_name("rcdeploy"));
    let beside = beside.filter(|path| path.is_file());
    beside.map_or_else(|| "rcdeploy".into(), Into::into)
}

fn parameters(live: &Live) -> Value {
    let point = |point: &Point| json!({"x": point.x, "y": point.y, "z": point.z});
    let mut view = match &live.camera {
        Viewpoint::Whole => json!({}),
        Viewpoint::Camera(id) => json!({ "camera": id }),
        Viewpoint::Point(eye, None) => json!({ "eye": point(eye) }),
        Viewpoint::Point(eye, Some(target)) => {
            json!({ "eye": point(eye), "target": point(target) })
        }
    };
    if let Some((width, height)) = live.size {
        view["width"] = width.into();
        view["height"] = height.into();
    }
    json!({ "view": view })
}

/// The bytes of the picture in a reply.
fn png(result: &Value) -> Option<Vec<u8>> {
    let bytes = result["return"].as_array()?.iter();
    let bytes = bytes.map(|byte| byte.as_u64().and_then(|byte| u8::try_from(byte).ok()));
    let bytes: Vec<u8> = bytes.collect::<Option<_>>()?;
    bytes.starts_with(b"\x89PNG").then_some(bytes)
}
