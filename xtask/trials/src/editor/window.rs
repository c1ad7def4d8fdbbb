//! VS Code in a browser: its extension is installed into the server of `code-server`, and `window.mjs` uses it as
//! a person does.

use crate::figure::BUILD;
use crate::programs::{Failure, Program, cargo, finish, output, root, target};
use rc_test_support::{debian, folder};
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// The editor, and what moves its browser. The server of this one runs with Node.js 20.
const PACKAGES: [&str; 2] = ["code-server@4.99.4", "playwright-core@1.65.1"];
/// For a download, and for the whole use of the window.
const LIMIT: Duration = Duration::from_mins(10);
/// Until the server listens.
const START: Duration = Duration::from_mins(1);

/// Types a wrong slot into a network, takes the quick fix, and looks at the picture; stops and starts a component of
/// a running network.
///
/// # Errors
/// The editor cannot be installed, or does not do what a user expects.
pub(super) fn use_it() -> Result<(), Failure> {
    let mut build = vec!["build", "--workspace"];
    build.extend(
        ["rcgen", "rcdeploy", "simulator", "pose_monitor"]
            .iter()
            .flat_map(|program| ["--bin", program]),
    );
    finish(cargo(&build)?, BUILD)?;
    let editor = installed()?;
    let place = tempfile::tempdir()?;
    let (data, work) = (place.path().join("data"), place.path().join("work"));
    let extension = data.join("extensions/robocomp.robocomp-0.1.0");
    build_extension(&extension)?;
    let programs = target()?.join("debug");
    let settings = serde_json::json!({
        "robocomp.rcgen": programs.join("rcgen"),
        "robocomp.rcdeploy": programs.join("rcdeploy"),
    });
    fs::create_dir_all(data.join("data/Machine"))?;
    fs::write(
        data.join("data/Machine/settings.json"),
        settings.to_string(),
    )?;
    fs::create_dir(&work)?;
    for (file, text) in FILES {
        fs::write(work.join(file), text)?;
    }
    let live = work.join("live.ddsl");
    fs::write(&live, live_network())?;
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let _server = serve(&editor, &data, port)?;
    let mut up = Command::new(programs.join("rcdeploy"));
    up.args(["up", "--profile", "dev"]).arg(&live);
    of_user(&mut up, &data);
    let network = Program::spawn(up)?;
    let (chromium, libraries) = browser()?;
    let script = editor.join("window.mjs");
    fs::write(&script, include_str!("window.mjs"))?;
    let mut session = Command::new("node");
    session.arg(&script).arg(chromium).arg(port.to_string());
    session.arg(&work).env("HOME", place.path());
    if let Some(libraries) = libraries {
        session.env("LD_LIBRARY_PATH", libraries);
    }
    print!("{}", output(session, LIMIT)?);
    network.stop(START)
}

/// The folders in which `rcdeploy` finds a running network of the editor's user.
fn of_user(command: &mut Command, data: &Path) {
    for (variable, folder) in [("XDG_RUNTIME_DIR", "run"), ("XDG_STATE_HOME", "state")] {
        command.env(variable, data.join(folder));
    }
}

/// A network of two components of this project, named after this process.
fn live_network() -> String {
    let component = |name: &str, of: &str| {
        let components = root().join("components");
        let path = components.join(of).join(of).with_extension("cdsl");
        format!("    Component {name} {{ cdsl \"{}\"; }};\n", path.display())
    };
    format!(
        "Deployment window_{}\n{{\n{}{}    bind viewer.FullPoseEstimationPub -> robot.FullPoseEstimationPub;\n}};\n",
        std::process::id(),
        component("robot", "simulator"),
        component("viewer", "pose_monitor"),
    )
}

const FILES: [(&str, &str); 4] = [
    (
        "Grip.idsl",
        "module Grip\n{\n    interface Grip\n    {\n        void press(float newton);\n    };\n};\n",
    ),
    (
        "hand.cdsl",
        "import \"Grip.idsl\";\n\nComponent hand\n{\n    Communications\n    {\n        implements Grip;\n    };\n    language rust;\n};\n",
    ),
    (
        "asker.cdsl",
        "import \"Grip.idsl\";\n\nComponent asker\n{\n    Communications\n    {\n        requires Grip;\n    };\n    language rust;\n};\n",
    ),
    (
        "net.ddsl",
        "Deployment net\n{\n    Component a { cdsl \"hand.cdsl\"; };\n    Component b { cdsl \"asker.cdsl\"; };\n};\n",
    ),
];

/// Starts the server of VS Code, and waits until it listens.
fn serve(editor: &Path, data: &Path, port: u16) -> Result<Program, Failure> {
    let mut command = Command::new("node");
    command
        .current_dir(vscode(editor))
        .args(["out/server-main.js", "--host", "127.0.0.1", "--port"])
        .arg(port.to_string())
        .args([
            "--without-connection-token",
            "--accept-server-license-terms",
            "--telemetry-level",
            "off",
            "--server-data-dir",
        ])
        .arg(data)
        .arg("--extensions-dir")
        .arg(data.join("extensions"))
        .env("HOME", data)
        .stderr(Stdio::null());
    of_user(&mut command, data);
    let server = Program::spawn(command)?;
    while !server.read_line(START)?.contains("listening on") {}
    Ok(server)
}

/// The folder of VS Code in the packages.
fn vscode(editor: &Path) -> PathBuf {
    editor.join("node_modules/code-server/lib/vscode")
}

fn npm(folder: &Path, words: &[&str]) -> Result<(), Failure> {
    let mut npm = Command::new("npm");
    npm.current_dir(folder).args(words);
    // Scripts of packages would build modules that no part of the session needs: terminals, logs, passwords.
    npm.args(["--ignore-scripts", "--no-audit", "--no-fund", "--silent"]);
    finish(npm, LIMIT)?;
    Ok(())
}

/// The packages, installed once.
fn installed() -> Result<PathBuf, Failure> {
    let place = folder()?.join("vscode-window");
    let wanted = PACKAGES.join("\n");
    let done = place.join("installed");
    if fs::read_to_string(&done).is_ok_and(|known| known == wanted) {
        return Ok(place);
    }
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(&place)?;
    fs::write(place.join("package.json"), "{ \"private\": true }")?;
    npm(&place, &[&["install"][..], &PACKAGES].concat())?;
    // Its lock lacks peers whose newest versions came after it.
    npm(&vscode(&place), &["ci", "--omit=dev", "--legacy-peer-deps"])?;
    fs::write(&done, wanted)?;
    Ok(place)
}

/// Compiles the extension into a folder, with what it needs at run time.
fn build_extension(extension: &Path) -> Result<(), Failure> {
    fs::create_dir_all(extension)?;
    let mut copy = Command::new("cp");
    copy.arg("-r").arg(root().join("editors/vscode/."));
    copy.arg(extension);
    finish(copy, LIMIT)?;
    npm(extension, &["ci"])?;
    let mut compile = Command::new("node");
    compile.current_dir(extension);
    compile.args(["node_modules/typescript/bin/tsc", "-p", "."]);
    finish(compile, LIMIT)?;
    Ok(())
}

/// Chromium of the system, or of packages that are unpacked, with the folders of its libraries.
fn browser() -> Result<(PathBuf, Option<String>), Failure> {
    let of = |place: Option<&Path>| match place {
        None => (PathBuf::from("chromium"), None),
        Some(place) => {
            let libraries = place.join(format!("usr/lib/{}-linux-gnu", std::env::consts::ARCH));
            let inner = libraries.join("pulseaudio");
            (
                place.join("usr/lib/chromium/chromium"),
                Some(format!("{}:{}", libraries.display(), inner.display())),
            )
        }
    };
    let runs = |place: Option<&Path>| {
        let (program, libraries) = of(place);
        let mut command = Command::new(program);
        if let Some(libraries) = libraries {
            command.env("LD_LIBRARY_PATH", libraries);
        }
        let output = command.arg("--version").output();
        output.is_ok_and(|output| output.status.success())
    };
    let place = debian::provided("chromium --no-install-recommends", &runs)?;
    Ok(of(place.as_deref()))
}
