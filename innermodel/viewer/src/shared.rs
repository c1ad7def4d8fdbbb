//! The world that the components of a running network share. `rcdeploy` has a replica of it, so this program needs no
//! middleware.

use crate::command_line::{Failure, Request};
use innermodel::{Folders, InnerModel, Snapshot, Time};
use rc_diagnostics::foreign::clean;
use rc_diagnostics::print;
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Lines};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The program that tells trees, which ends with this one.
struct TreeProcess(Child);

impl Drop for TreeProcess {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The trees of a network's world, one for each time that something has moved.
struct Trees {
    lines: Lines<BufReader<ChildStdout>>,
    folders: Folders,
}

impl Trees {
    /// The next tree. `None` if the network has ended.
    fn next(&mut self) -> Option<Result<Arc<Snapshot>, Failure>> {
        let line = self.lines.next()?;
        let wrong = |error: String| Failure::Input(clean(error.trim_end()));
        let text = line.map_err(|error| Failure::System(error.to_string()));
        Some(text.and_then(|line| {
            let text: String =
                serde_json::from_str(&line).map_err(|error| wrong(error.to_string()))?;
            let read = innermodel::read_text(&text, Path::new("world.xml"), &self.folders);
            let (document, _) = read.map_err(|error| wrong(error.to_string()))?;
            let model = InnerModel::from_document(&document);
            Ok(model.map_err(|error| wrong(error.to_string()))?.snapshot())
        }))
    }
}

/// Shows the world in a window, or draws it into a file.
pub(crate) fn show(network: Option<&OsStr>, request: &Request) -> Result<(), Failure> {
    let mut command = Command::new(crate::live::rcdeploy());
    command.args(["world", "tree", "--follow"]);
    if let Some(network) = network {
        command.arg("--").arg(network);
    }
    // What `rcdeploy` says about errors is for the user.
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    let child = command.spawn().map_err(|error| {
        Failure::System(format!(
            "cannot run `rcdeploy`, which knows the world: {error}"
        ))
    })?;
    let mut teller = TreeProcess(child);
    let output = teller.0.stdout.take();
    let output = output.ok_or_else(|| Failure::System("`rcdeploy` has no output".to_owned()))?;
    let mut trees = Trees {
        lines: BufReader::new(output).lines(),
        folders: Folders::new(request.include.iter().cloned()),
    };
    let Some(first) = trees.next() else {
        let text = "there is no world to show".to_owned();
        let code = teller.0.wait().ok().and_then(|status| status.code());
        return Err(match code {
            Some(1 | 2) => Failure::Input(text),
            _ => Failure::System(text),
        });
    };
    let model = Arc::new(InnerModel::new());
    model.restore(Time::ZERO, first?.as_ref());
    let followed = Arc::clone(&model);
    let is_closed = Arc::new(AtomicBool::new(false));
    let closed = Arc::clone(&is_closed);
    if request.png.is_none() {
        // It ends with the teller.
        std::thread::spawn(move || {
            while let Some(tree) = trees.next() {
                match tree {
                    Ok(tree) => followed.restore(Time::ZERO, &tree),
                    Err(failure) => print::error(format_args!("rcview: {}", failure.text())),
                }
            }
            if !closed.load(Ordering::Relaxed) {
                print::error(format_args!("rcview: the world is followed no more"));
            }
        });
    }
    let title = network.map_or_else(|| "world".into(), |name| clean(&name.to_string_lossy()));
    let shown = crate::show(&model, request, &title);
    is_closed.store(true, Ordering::Relaxed);
    shown
}
