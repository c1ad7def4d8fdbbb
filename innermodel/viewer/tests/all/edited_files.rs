//! The editor and the files on the disk: included ones, and those that change meanwhile.

use crate::editing::{User, WORLD};
use innermodel::Folders;
use innermodel_viewer::innermodel;
use innermodel_viewer::{Editor, Input, Key, Modifiers, ViewerAction};

#[test]
fn nodes_of_included_files_are_not_changed() {
    let mut user = User::new(WORLD);
    user.select("robot");
    assert!(
        user.message().starts_with("`robot` is written in "),
        "{}",
        user.message()
    );
    assert!(
        user.message().ends_with("robot.xml: edit that file"),
        "{}",
        user.message()
    );
    assert!(user.editor.handles().is_empty());
    // Alone, the file would be in millimetres.
    let world = WORLD.replace("<innerModel>", "<innerModel units=\"metres\">");
    let mut metres = User::new(&world);
    let robot = metres.folder.path().join("robot.xml");
    std::fs::write(
        &robot,
        "<innerModel><transform id=\"robot\" tx=\"0.7\"/></innerModel>",
    )
    .expect("to write");
    metres.key('l');
    metres.select("robot");
    assert!(
        metres
            .message()
            .ends_with("with `units` first: alone, its lengths are millimetres"),
        "{}",
        metres.message()
    );
    for keys in ["etx=1", "d"] {
        user.write(keys);
        assert!(
            user.message().ends_with("edit that file"),
            "{}",
            user.message()
        );
    }
    user.key('t');
    assert!(user.editor.handles().is_empty());
    user.select("eye");
    assert!(
        user.message().contains("`eye` is a camera"),
        "{}",
        user.message()
    );
    assert!(!user.editor.is_changed());
    // Nodes that can be changed have handles again.
    user.select("table");
    assert_eq!(user.editor.handles().len(), 3);
}

#[test]
fn a_file_that_another_program_changed_is_not_overwritten() {
    let mut user = User::new(WORLD);
    user.select("ball");
    user.set("radius=111");
    let theirs = WORLD.replace("Monday", "Tuesday");
    std::fs::write(user.file(), &theirs).expect("to write");
    user.key('s');
    assert!(
        user.message()
            .contains("another program changed it; l loads it"),
        "{}",
        user.message()
    );
    assert_eq!(user.saved(), theirs);
    assert!(user.editor.is_changed());
    // The text that they wrote is loaded, and no edit of either is lost.
    user.key('l');
    assert!(!user.editor.is_changed());
    user.key('u');
    assert!(user.editor.is_changed());
    user.save();
    assert_eq!(user.saved(), WORLD.replace("\"200\"", "\"111\""));
    // Broken texts are refused; the editor goes on with what it has.
    std::fs::write(user.file(), "<innerModel>").expect("to write");
    user.key('l');
    assert!(
        user.message()
            .starts_with("world.xml is not loaded: malformed XML"),
        "{}",
        user.message()
    );
    assert!(user.tree().node("ball").is_ok());
    std::fs::remove_file(user.file()).expect("to remove");
    user.key('l');
    assert!(
        user.message()
            .starts_with("world.xml is not loaded: No such file"),
        "{}",
        user.message()
    );
    user.set("radius=112");
    user.save();
    let link = user.folder.path().join("other.xml");
    std::fs::rename(user.file(), &link).expect("to rename");
    std::os::unix::fs::symlink(&link, user.file()).expect("a link");
    user.set("radius=113");
    user.save();
    assert!(user.file().is_symlink());
}

#[test]
fn changes_are_not_lost_silently() {
    let mut user = User::new(WORLD);
    assert_eq!(user.key('q'), ViewerAction::End, "nothing is lost");
    user.select("ball");
    user.set("radius=111");
    for end in [
        Input::Close,
        Input::Key(Key::Character('q'), Modifiers::default()),
    ] {
        assert_eq!(user.editor.input(end), ViewerAction::Draw);
        assert!(
            user.message().contains("q again ends without them"),
            "{}",
            user.message()
        );
        user.key('n');
        assert_eq!(
            user.editor.input(end),
            ViewerAction::Draw,
            "something else was done"
        );
        assert_eq!(
            user.editor.input(Input::Moved((1, 1))),
            ViewerAction::Nothing
        );
        assert_eq!(user.editor.input(end), ViewerAction::End);
        user.key('n');
    }
    // A question does not hide the warning.
    for question in ["e", "a", "/"] {
        user.write("/ball");
        user.key(question.chars().next().expect("a key"));
        let asked = user.editor.draw((320, 240)).expect("a picture").colours;
        assert_eq!(user.editor.input(Input::Close), ViewerAction::Draw);
        let warned = user.editor.draw((320, 240)).expect("a picture").colours;
        assert!(asked != warned, "{question} hides the warning");
        user.key('n');
    }
    user.save();
    assert_eq!(user.editor.input(Input::Close), ViewerAction::End);
}

/// A mesh that was wrong when it was drawn first is read again.
#[test]
fn a_file_that_is_loaded_again_has_its_meshes_anew() {
    let world = "<innerModel><mesh id=\"mast\" file=\"mast.obj\"/></innerModel>";
    let mut user = User::new(world);
    let mesh = user.folder.path().join("mast.obj");
    std::fs::write(&mesh, "f 1 2 3\n").expect("a mesh");
    user.key('l');
    user.draw();
    assert!(
        user.message().contains("is not drawn as the file says"),
        "{}",
        user.message()
    );
    let right = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/mast.obj");
    std::fs::copy(right, &mesh).expect("a mesh");
    user.key('l');
    user.draw();
    assert_eq!(user.message(), "world.xml is loaded again; u returns");
}

/// A mark at the start, line feeds of Windows, and a file that is wrong from the start.
#[test]
fn texts_stay_as_they_are_written() {
    let world = format!("\u{feff}{}", WORLD.replace('\n', "\r\n"));
    let mut user = User::new(&world);
    user.select("table");
    user.set("tx=-7");
    user.key('a');
    user.key('s');
    user.save();
    let saved = user.saved();
    assert!(
        saved.starts_with('\u{feff}')
            && saved.matches('\n').count() == saved.matches("\r\n").count()
    );
    assert!(saved.contains("tx=\"-7\" tz='50'"), "{saved}");
    user.key('u');
    user.key('u');
    user.save();
    assert_eq!(user.saved(), world);
    std::fs::write(
        user.file(),
        "<innerModel><transform id='a' tx='x'/></innerModel>",
    )
    .expect("to write");
    let refused = Editor::open(&user.file(), Folders::default()).map(drop);
    let text = refused.expect_err("a wrong file").to_string();
    assert!(
        text.contains("world.xml:1:") && text.contains("expected a number"),
        "{text}"
    );
    let none = user.folder.path().join("none.xml");
    let refused = Editor::open(&none, Folders::default()).map(drop);
    assert!(
        refused
            .expect_err("no file")
            .to_string()
            .contains("none.xml: No such file")
    );
}
