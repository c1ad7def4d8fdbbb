//! `rcview`: shows or edits an InnerModel file in a window, or draws it into a file.

mod command_line;
mod live;
mod members;
mod points;
mod shared;

use command_line::{Command, Failure, Request};
use innermodel::{Folders, InnerModel, Snapshot, Time};
use innermodel_render::{Extent, Image, Scene, View, id_colours};
use innermodel_viewer::{Editor, Navigator, OpenError, Options, Viewpoint, draw, edit, run, scene};
use rc_diagnostics::foreign::clean;
use rc_diagnostics::print;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() -> ExitCode {
    let words = lexopt::Parser::from_iter(rc_files::words_of_command_line());
    let outcome = command_line::parse(words).and_then(|command| match command {
        Command::View(request) => view(&request),
        Command::Edit(request) => edit_file(&request),
        Command::Live(picture) => live::show(&picture),
        Command::World(network, request) => shared::show(network.as_deref(), &request),
        Command::Print(text) => {
            print::data(text);
            Ok(())
        }
    });
    let (code, message) = match outcome {
        Ok(()) => (0, None),
        Err(failure) => (failure.code(), Some(failure.text().to_owned())),
    };
    let (code, message) = print::exit_code(code, message, 3);
    if let Some(message) = message {
        print::error(format_args!("rcview: error: {message}"));
    }
    ExitCode::from(code)
}

fn view(request: &Request) -> Result<(), Failure> {
    let model = Arc::new(load(request)?);
    if request.slots {
        print::data(&members::clause(&model.snapshot())?);
        return Ok(());
    }
    show(&model, request, &request.file.display().to_string())
}

/// Draws a tree into the file that the command line names, or shows it in a window.
fn show(model: &Arc<InnerModel>, request: &Request, title: &str) -> Result<(), Failure> {
    if let Some(path) = &request.png {
        return to_file(model, request, path);
    }
    let options = Options {
        title: format!("{title} – rcview"),
        size: window_size(request.size),
        navigator: first_navigator(model, request)?,
        marks: request.marks,
    };
    let say = |line: &str| print::line(format_args!("{line}"));
    let shown = run(model, &options, None, &|| true, &say);
    shown.map_err(|error| Failure::System(format!("{error}; `--png FILE` needs no window")))
}

/// The camera that the command line asks for. `None`: one that sees the whole tree.
fn first_navigator(model: &InnerModel, request: &Request) -> Result<Option<Navigator>, Failure> {
    if request.camera == Viewpoint::Whole {
        return Ok(None);
    }
    let tree = model.snapshot();
    let extents = scene_of(model).extents(&tree);
    let view = first_view(&tree, &extents, request)?;
    Ok(Some(Navigator::at(&view, scene(&extents).1)))
}

/// The state for pictures of a tree: its meshes are read with the first one.
fn scene_of(model: &InnerModel) -> Scene {
    let mut scene = Scene::new();
    scene.set_clouds(model.clouds());
    scene
}

/// The view that the command line asks for.
fn first_view(tree: &Snapshot, extents: &[Extent], request: &Request) -> Result<View, Failure> {
    let view = request.camera.view(tree, extents, request.size);
    view.map_err(|error| Failure::Input(error.to_string()))
}

/// The size of a window, in pixels.
fn window_size(wanted: Option<(usize, usize)>) -> (u16, u16) {
    let (width, height) = wanted.unwrap_or(Viewpoint::SIZE);
    (pixels(width), pixels(height))
}

fn edit_file(request: &Request) -> Result<(), Failure> {
    not_of_others(&request.file)?;
    let folders = Folders::new(request.include.iter().cloned());
    let mut editor = Editor::open(&request.file, folders).map_err(|error| {
        let text = error.to_string().trim_end().to_owned();
        match error {
            OpenError::Unreadable { .. } => Failure::System(text),
            _ => Failure::Input(text),
        }
    })?;
    for line in editor.warnings().lines() {
        print::error(format_args!("{line}"));
    }
    if let Some(navigator) = first_navigator(editor.model(), request)? {
        editor = editor.seen_from(navigator);
    }
    editor = editor.with_marks(request.marks);
    // A signal ends the window, not the process: changes that are not saved would be lost.
    let stop = Arc::new(AtomicBool::new(false));
    let system = |error: std::io::Error| Failure::System(error.to_string());
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        // The window may wait for a display that hangs: the same signal again ends the process.
        // Closing a terminal may send SIGHUP twice.
        if signal != SIGHUP {
            let again = Arc::new(AtomicBool::new(false));
            signal_hook::flag::register_conditional_default(signal, Arc::clone(&again))
                .map_err(system)?;
            signal_hook::flag::register(signal, again).map_err(system)?;
        }
        signal_hook::flag::register(signal, Arc::clone(&stop)).map_err(system)?;
    }
    let title = format!("{} – rcview", request.file.display());
    let size = window_size(request.size);
    edit(&mut editor, &title, size, &stop).map_err(|error| Failure::System(error.to_string()))
}

/// A length that a window can have.
fn pixels(length: usize) -> u16 {
    u16::try_from(length).unwrap_or(u16::MAX).clamp(1, 4096)
}

/// Refuses a robot of URDF, which is not an InnerModel file but becomes one, and a mesh, which a
/// file shows.
fn not_of_others(file: &Path) -> Result<(), Failure> {
    let ending = file.extension().unwrap_or_default().to_ascii_lowercase();
    let (path, xml) = (file.display(), file.with_extension("xml"));
    let xml = xml.display();
    let how = match ending.to_str() {
        Some("urdf") => {
            format!("make one: rcgen import {path} --out {xml}, then: rcview {xml}")
        }
        Some("stl" | "obj" | "gltf" | "glb") => {
            let mesh = file.file_name().unwrap_or_default().to_string_lossy();
            format!(
                "write `<innerModel><mesh id=\"mesh\" file=\"{mesh}\"/></innerModel>` into {xml}, \
                 then: rcview {xml}"
            )
        }
        _ => return Ok(()),
    };
    Err(Failure::Usage(format!(
        "{path} is not an InnerModel file; {how}"
    )))
}

fn load(request: &Request) -> Result<InnerModel, Failure> {
    let wrong = |error: innermodel::Error| Failure::Input(error.to_string());
    not_of_others(&request.file)?;
    let folders = Folders::new(request.include.iter().cloned());
    let (document, warnings) = innermodel::read(&request.file, &folders).map_err(|error| {
        let text = error.to_string();
        match error {
            innermodel::LoadError::Unreadable { .. } => Failure::System(text),
            _ => Failure::Input(text.trim_end().to_owned()),
        }
    })?;
    for line in warnings.lines() {
        print::error(format_args!("{line}"));
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

fn to_file(model: &InnerModel, request: &Request, path: &Path) -> Result<(), Failure> {
    let tree = &*model.snapshot();
    let mut drawing = scene_of(model);
    let extents = drawing.extents(tree);
    let view = &first_view(tree, &extents, request)?;
    let drawn = drawing.draw(tree, view);
    let mut image: Image = drawn.map_err(|error| Failure::Input(error.to_string()))?;
    for problem in drawing.problems() {
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
        print::data(&list);
        image.id_png(tree)
    } else {
        draw(
            &mut image,
            tree,
            view,
            request.marks,
            scene(&extents).1 * 0.08,
        );
        image.png()
    };
    let written = encoded.and_then(|bytes| rc_files::write(path, bytes));
    written.map_err(|error| Failure::System(format!("{}: {error}", path.display())))
}
