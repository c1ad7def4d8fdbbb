//! `rcview`: shows or edits an InnerModel file in a window, or draws it into a file.

mod command_line;
mod members;
mod points;

use command_line::{Camera, Command, Failure, Request};
use innermodel::kinds::Camera as Pixels;
use innermodel::{Clouds, Folders, InnerModel, Point, Snapshot, Time};
use innermodel_render::{Image, Scene, View, camera, id_colours, look_at};
use innermodel_viewer::{Editor, Navigator, OpenError, Options, draw, edit, run, scene};
use rc_diagnostics::foreign::clean;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() -> ExitCode {
    let outcome =
        command_line::parse(lexopt::Parser::from_env()).and_then(|command| match command {
            Command::View(request) => view(&request),
            Command::Edit(request) => edit_file(&request),
            Command::Print(text) => print(text),
        });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // Nothing is left to do if this fails, too.
            let _ = writeln!(std::io::stderr(), "rcview: error: {}", failure.text());
            ExitCode::from(failure.code())
        }
    }
}

fn print(text: &str) -> Result<(), Failure> {
    let written = std::io::stdout().write_all(text.as_bytes());
    written.map_err(|error| Failure::System(error.to_string()))
}

fn view(request: &Request) -> Result<(), Failure> {
    let model = Arc::new(load(request)?);
    let tree = model.snapshot();
    if request.slots {
        return print(&members::clause(&tree)?);
    }
    let clouds = model.clouds();
    let (_, radius) = scene(&tree, &clouds);
    let view = first_view(&tree, &clouds, request)?;
    let (width, height) = request.size;
    if let Some(path) = &request.png {
        return to_file(&model, &view, radius, request, path);
    }
    let from = request.camera.as_ref();
    let options = Options {
        title: format!("{} – rcview", request.file.display()),
        size: (pixels(width), pixels(height)),
        navigator: from.map(|_| Navigator::at(&view, radius)),
        marks: request.marks,
    };
    let say = |line: &str| {
        let _ = writeln!(std::io::stdout(), "{line}");
    };
    let shown = run(&model, &options, None, &|| true, &say);
    shown.map_err(|error| Failure::System(format!("{error}; `--png FILE` needs no window")))
}

/// The view that the command line asks for.
fn first_view(tree: &Snapshot, clouds: &Clouds, request: &Request) -> Result<View, Failure> {
    let (width, height) = request.size;
    let around = Navigator::around(tree, clouds).view(width, height);
    match &request.camera {
        None => Ok(around),
        Some(Camera::Node(id)) => node_view(tree, id, request),
        Some(Camera::Point(from, to)) => {
            let to = to.map_or(scene(tree, clouds).0, Point::from);
            Ok(look_at(Point::from(*from), to, around.camera))
        }
    }
}

fn edit_file(request: &Request) -> Result<(), Failure> {
    let folders = Folders::new(request.include.iter().cloned());
    let mut editor = Editor::open(&request.file, folders).map_err(|error| {
        let text = error.to_string().trim_end().to_owned();
        match error {
            OpenError::Unreadable { .. } => Failure::System(text),
            _ => Failure::Input(text),
        }
    })?;
    for line in editor.warnings().lines() {
        let _ = writeln!(std::io::stderr(), "{line}");
    }
    let (tree, clouds) = (editor.model().snapshot(), editor.model().clouds());
    if request.camera.is_some() {
        let view = first_view(&tree, &clouds, request)?;
        let navigator = Navigator::at(&view, scene(&tree, &clouds).1);
        editor = editor.seen_from(navigator);
    }
    editor = editor.with_marks(request.marks);
    // A signal ends the window, not the process: changes that are not saved would be lost.
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        let registered = signal_hook::flag::register(signal, Arc::clone(&stop));
        registered.map_err(|error| Failure::System(error.to_string()))?;
    }
    let title = format!("{} – rcview", request.file.display());
    let size = (pixels(request.size.0), pixels(request.size.1));
    edit(&mut editor, &title, size, &stop).map_err(|error| Failure::System(error.to_string()))
}

/// A length that a window can have.
fn pixels(length: usize) -> u16 {
    u16::try_from(length).unwrap_or(u16::MAX).clamp(1, 4096)
}

fn load(request: &Request) -> Result<InnerModel, Failure> {
    let wrong = |error: innermodel::Error| Failure::Input(error.to_string());
    let folders = Folders::new(request.include.iter().cloned());
    let (document, warnings) = innermodel::read(&request.file, &folders).map_err(|error| {
        let text = error.to_string();
        match error {
            innermodel::LoadError::Unreadable { .. } => Failure::System(text),
            _ => Failure::Input(text.trim_end().to_owned()),
        }
    })?;
    for line in warnings.lines() {
        let _ = writeln!(std::io::stderr(), "{line}");
    }
    let model = InnerModel::from_document(&document).map_err(wrong)?;
    let moved = model.change(Time::ZERO, |edit| {
        for (joint, position) in &request.joints {
            edit.set_joint(joint, *position)?;
        }
        Ok(())
    });
    moved.map_err(wrong)?;
    for (id, path) in &request.points {
        let points = points::read(path)?;
        model.set_points(id, points).map_err(wrong)?;
    }
    Ok(model)
}

fn node_view(tree: &Snapshot, id: &str, request: &Request) -> Result<View, Failure> {
    let found = camera(tree, id).map_err(|error| Failure::Input(error.to_string()))?;
    let mut view = found.ok_or_else(|| {
        let cameras = tree
            .nodes()
            .filter(|node| matches!(node.kind().tag(), "camera" | "rgbd"));
        let cameras: Vec<String> = cameras.map(|node| clean(node.id())).collect();
        let known = if cameras.is_empty() {
            "the file has none".to_owned()
        } else {
            format!("there are {}", cameras.join(", "))
        };
        Failure::Input(format!("`{id}` is no camera; {known}"))
    })?;
    if request.has_size {
        // The image shows the same part of the world, with other pixels.
        let (width, height) = (request.size.0 as f64, request.size.1 as f64);
        let focal = view.camera.focal * width / view.camera.width;
        view.camera = Pixels {
            width,
            height,
            focal,
        };
    }
    Ok(view)
}

fn to_file(
    model: &InnerModel,
    view: &View,
    radius: f64,
    request: &Request,
    path: &Path,
) -> Result<(), Failure> {
    let tree = &*model.snapshot();
    let mut scene = Scene::new();
    scene.set_clouds(model.clouds());
    let drawn = scene.draw(tree, view);
    let mut image: Image = drawn.map_err(|error| Failure::Input(error.to_string()))?;
    for problem in scene.problems() {
        let _ = writeln!(
            std::io::stderr(),
            "warning: `{}` is not drawn as the file says: {}",
            clean(&problem.id),
            clean(&problem.error.to_string())
        );
    }
    let encoded = if request.ids {
        let mut list = String::new();
        for (_, id, [red, green, blue]) in id_colours(tree) {
            let id = clean(id);
            list.push_str(&format!("#{red:02x}{green:02x}{blue:02x} {id}\n"));
        }
        print(&list)?;
        image.id_png(tree)
    } else {
        draw(&mut image, tree, view, request.marks, radius * 0.08);
        image.png()
    };
    let written = encoded.and_then(|bytes| rc_files::write(path, bytes));
    written.map_err(|error| Failure::System(format!("{}: {error}", path.display())))
}
