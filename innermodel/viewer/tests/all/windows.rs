//! The window, on a display without a monitor.

use crate::{rcview, scene};
use innermodel::{ColouredPoint, Folders, InnerModel, Point, Pose, Time};
use innermodel_render::Image;
use innermodel_viewer::{
    Action, Actions, Editor, Input, Key, Marks, Modifiers, Navigator, Options, TreeView, Viewer,
    ViewerAction, innermodel,
};
use rc_test_support::python::skipped;
use rc_test_support::screen::Screen;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ButtonPressEvent, ConnectionExt, EventMask,
    ImageFormat, KEY_PRESS_EVENT, KeyButMask, MOTION_NOTIFY_EVENT, Window,
};
use x11rb::rust_connection::RustConnection;

const LIMIT: Duration = Duration::from_mins(5);

/// The tree of the component.
const TREE: &str = r##"<innerModel><transform id="t"><sphere id="s" radius="100" texture="#ff0000"/>
    </transform><sphere id="u" tx="300" radius="50"/><pointcloud id="seen"/></innerModel>"##;

/// A process that a test starts. Dropping it ends it.
struct Process(Child);

impl Process {
    fn start(command: &mut Command) -> Self {
        Self(command.spawn().expect("to start it"))
    }

    /// Its next line.
    fn line(&mut self) -> String {
        let output = self.0.stdout.take().expect("its output");
        let (send, lines) = mpsc::channel();
        std::thread::spawn(move || {
            let mut line = String::new();
            let read = BufReader::new(output).read_line(&mut line);
            send.send(read.map(|_| line))
        });
        let line = lines.recv_timeout(LIMIT).expect("a line in time");
        line.expect("a line")
    }

    fn end(&mut self) -> ExitStatus {
        until("its end", || self.0.try_wait().expect("a child"))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn until<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(start.elapsed() < LIMIT, "waited {LIMIT:?} for {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A program that looks at a display, and plays its user.
struct User {
    connection: RustConnection,
    root: Window,
}

impl User {
    fn new(screen: &Screen) -> Self {
        let (connection, number) = x11rb::connect(Some(&screen.name)).expect("the display");
        let root = connection.setup().roots[number].root;
        Self { connection, root }
    }

    /// The window whose title contains a text, once it is seen.
    fn window(&self, title: &str) -> Option<Window> {
        let tree = self.connection.query_tree(self.root).ok()?.reply().ok()?;
        tree.children.into_iter().find(|window| {
            let (name, text) = (AtomEnum::WM_NAME, AtomEnum::ANY);
            let named = self
                .connection
                .get_property(false, *window, name, text, 0, 100);
            let named = named.ok().and_then(|cookie| cookie.reply().ok());
            named.is_some_and(|named| String::from_utf8_lossy(&named.value).contains(title))
        })
    }

    /// The pixels of a window.
    fn pixels(&self, window: Window) -> Option<Vec<u8>> {
        let size = self.connection.get_geometry(window).ok()?.reply().ok()?;
        let (form, all) = (ImageFormat::Z_PIXMAP, u32::MAX);
        let (width, height) = (size.width, size.height);
        let image = self
            .connection
            .get_image(form, window, 0, 0, width, height, all);
        Some(image.ok()?.reply().ok()?.data)
    }

    /// Waits until a window shows something else.
    fn changed(&self, window: Window, before: &[u8]) -> Vec<u8> {
        until("another image", || {
            let now = self.pixels(window)?;
            (now != before).then_some(now)
        })
    }

    /// Whether a window shows an image.
    fn shows(&self, window: Window, image: &Image) -> Option<()> {
        let shown = self.pixels(window)?;
        let mut pixels = shown.chunks_exact(4).zip(&image.colours);
        let is_there =
            pixels.all(|(shown, [red, green, blue])| shown[..3] == [*blue, *green, *red]);
        is_there.then_some(())
    }

    /// Waits until a window shows an image.
    fn sees(&self, window: Window, image: &Image) {
        until("an image", || self.shows(window, image));
    }

    fn event(&self, window: Window, form: u8, detail: u8, x: i16, y: i16) {
        self.event_with(window, form, detail, (x, y), KeyButMask::default());
    }

    fn event_with(
        &self,
        window: Window,
        form: u8,
        detail: u8,
        (x, y): (i16, i16),
        state: KeyButMask,
    ) {
        let event = ButtonPressEvent {
            response_type: form,
            detail,
            sequence: 0,
            time: 0,
            root: self.root,
            event: window,
            child: 0,
            root_x: x,
            root_y: y,
            event_x: x,
            event_y: y,
            state,
            same_screen: true,
        };
        let none = EventMask::NO_EVENT;
        let sent = self.connection.send_event(false, window, none, event);
        sent.expect("to send").check().expect("to send");
    }

    fn press(&self, window: Window, key: char) {
        self.press_symbol(window, key as u32);
    }

    fn press_symbol(&self, window: Window, symbol: u32) {
        let setup = self.connection.setup();
        let (least, most) = (setup.min_keycode, setup.max_keycode);
        let keys = self
            .connection
            .get_keyboard_mapping(least, most - least + 1);
        let keys = keys.expect("keys").reply().expect("keys");
        let each = usize::from(keys.keysyms_per_keycode);
        let found = keys.keysyms.chunks(each).position(|row| row[0] == symbol);
        let code = least + found.expect("the key") as u8;
        self.event(window, KEY_PRESS_EVENT, code, 0, 0);
    }

    fn destroy(&self, window: Window) {
        self.connection.destroy_window(window).expect("a request");
        self.connection.flush().expect("the display");
    }
}

fn screen(test: &str) -> Option<Screen> {
    match Screen::new() {
        Ok(screen) => Some(screen),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

#[test]
fn the_window_shows_turns_and_picks() {
    let Some(screen) = screen("the_window_shows_turns_and_picks") else {
        return;
    };
    let mut viewer = Process::start(
        rcview()
            .arg(scene("arm.xml"))
            .args(["--camera", "0,760,2000,0,760,0", "--size", "320x200"])
            .env("DISPLAY", &screen.name)
            .stdout(Stdio::piped()),
    );
    let user = User::new(&screen);
    let window = until("the window", || user.window("arm.xml – rcview"));
    let black = user.pixels(window).map(|image| vec![0; image.len()]);
    let first = user.changed(window, &black.unwrap_or_default());
    user.press(window, 'f');
    let frames = user.changed(window, &first);
    user.press(window, 'n');
    let names = user.changed(window, &frames);
    user.event(window, BUTTON_PRESS_EVENT, 4, 160, 100);
    let nearer = user.changed(window, &names);
    user.press(window, 'r');
    user.changed(window, &nearer);
    // The middle of the first view shows the table behind the arm, or the arm: what is picked has
    // an id and a pose.
    user.event(window, BUTTON_PRESS_EVENT, 1, 160, 100);
    user.event(window, BUTTON_RELEASE_EVENT, 1, 160, 100);
    let line = viewer.line();
    assert!(
        line.contains(" mm, ") && line.contains(" rad in the root"),
        "{line}"
    );
    user.press(window, 'q');
    assert!(viewer.end().success());
}

/// The window of a component follows the tree, and is switched on and off.
#[test]
fn the_window_of_a_component_is_live() {
    let Some(screen) = screen("the_window_of_a_component_is_live") else {
        return;
    };
    // A library takes the display of the environment, which a test must not change: another process
    // is the component.
    let mut component = Process::start(
        Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "windows::component", "--nocapture", "--ignored"])
            .env("DISPLAY", &screen.name)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped()),
    );
    let user = User::new(&screen);
    let window = until("the window", || user.window("component"));
    let black = user.pixels(window).map(|image| vec![0; image.len()]);
    let first = user.changed(window, &black.unwrap_or_default());
    let mut input = component.0.stdin.take().expect("its input");
    std::io::Write::write_all(&mut input, b"move\n").expect("to ask");
    let moved = user.changed(window, &first);
    std::io::Write::write_all(&mut input, b"points\n").expect("to ask");
    user.changed(window, &moved);
    // The user drags a body; the owner of the tree moves it when it takes the request. A view without
    // a window shows what the window then shows.
    let model = Arc::new(InnerModel::parse(TREE).expect("a model"));
    let actions = Actions::new();
    let options = Options {
        title: String::new(),
        size: (640, 480),
        navigator: None,
        marks: Marks::default(),
    };
    let twin = TreeView::new(Arc::clone(&model), &options, &|_| {});
    let mut twin = twin.with_actions(actions.clone());
    obey(&model, &actions, "move");
    obey(&model, &actions, "points");
    twin.poll();
    user.sees(window, &twin.draw((640, 480)).expect("a picture"));
    let view = Navigator::of(&InnerModel::parse(TREE).expect("a model"), (640, 480));
    let at = view
        .view(640, 480)
        .pixel(&Point::new(300.0, 0.0, 0.0))
        .expect("in front");
    let at = (at.0 as i16, at.1 as i16);
    let (control, to) = (KeyButMask::CONTROL, (at.0 + 30, at.1 + 10));
    let with = Modifiers {
        control: true,
        ..Modifiers::default()
    };
    user.event_with(window, BUTTON_PRESS_EVENT, 1, at, control);
    user.event_with(window, MOTION_NOTIFY_EVENT, 0, to, control);
    user.event_with(window, BUTTON_RELEASE_EVENT, 1, to, control);
    twin.input(Input::Pressed(1, at, with));
    twin.input(Input::Moved(to));
    twin.input(Input::Released(1, to));
    obey(&model, &actions, "obey");
    assert_eq!(twin.poll(), ViewerAction::Draw, "the body is elsewhere");
    let moved = twin.draw((640, 480)).expect("a picture");
    until("the body at its new place", || {
        std::io::Write::write_all(&mut input, b"obey\n").expect("to ask");
        user.shows(window, &moved)
    });
    std::io::Write::write_all(&mut input, b"hide\n").expect("to ask");
    until("no window", || {
        user.window("component").is_none().then_some(())
    });
    std::io::Write::write_all(&mut input, b"show\n").expect("to ask");
    until("the window again", || user.window("component"));
    drop(input);
    assert!(component.end().success());
}

/// The window of a running network shows what its simulator draws now, from where the user looks,
/// and why there is no picture. A program beside `rcview` plays `rcdeploy`.
#[test]
fn the_window_of_a_network_is_live() {
    let Some(screen) = screen("the_window_of_a_network_is_live") else {
        return;
    };
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
    let [viewer, rcdeploy, asked] =
        ["rcview", "rcdeploy", "asked"].map(|name| folder.path().join(name));
    std::fs::hard_link(env!("CARGO_BIN_EXE_rcview"), &viewer).expect("the program");
    let this = std::env::current_exe().expect("this program");
    let script = format!(
        "#!/bin/sh\nprintf '%s %s\\n' \"$3\" \"$4\" >> '{asked}'\n\
         {ANSWER}='{answer}' '{this}' --exact windows::simulator --ignored > /dev/null || exit 3\n\
         cat '{answer}'\n",
        asked = asked.display(),
        answer = folder.path().join("answer").display(),
        this = this.display(),
    );
    std::fs::write(&rcdeploy, script).expect("a script");
    let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    std::fs::set_permissions(&rcdeploy, executable).expect("a script");
    let mut process = Process::start(
        Command::new(&viewer)
            .args(["--live", "window_test", "--size", "80x60"])
            .env("DISPLAY", &screen.name),
    );
    let user = User::new(&screen);
    let window = until("the window", || user.window("window_test – rcview"));
    let pixels = || user.pixels(window);
    // The colour of a pixel is the number of the picture: others come without any input.
    let number = |image: &[u8]| image[4 * (30 * 80 + 40) + 2];
    let third = until("a third picture", || {
        pixels().filter(|image| number(image) >= 3)
    });
    // The camera of the window rests although the tree moves, until its user moves it.
    let views = || std::fs::read_to_string(&asked).expect("what was asked");
    let begin = views();
    let mut asked = begin.lines().filter(|line| line.contains("draw"));
    assert!(
        asked.next().is_some_and(|first| !first.contains("eye")),
        "{begin}"
    );
    let rests = asked.next().expect("a second picture");
    assert!(
        rests.contains("\"eye\"") && asked.all(|line| line == rests),
        "{begin}"
    );
    assert!(rests.contains("\"height\":60") && rests.contains("\"width\":80"));
    user.event(window, BUTTON_PRESS_EVENT, 4, 40, 30);
    until("a picture from nearer", || {
        views()
            .lines()
            .skip(2)
            .any(|line| line != rests)
            .then_some(())
    });
    // The last picture stays, below the reason. The network may come back.
    std::fs::remove_file(&rcdeploy).expect("to remove it");
    let bright = |image: &[u8]| {
        image[..4 * 80 * 14]
            .iter()
            .filter(|byte| **byte > 200)
            .count()
    };
    until("the reason", || {
        pixels().filter(|image| bright(image) > bright(&third) + 20)
    });
    user.press(window, 'q');
    assert!(process.end().success());
}

/// Names the file into which [`simulator`] writes.
const ANSWER: &str = "RC_VIEWER_ANSWER";

/// The simulator of the test above: an answer that a tree and a picture are in.
#[test]
#[ignore = "a process of another test"]
fn simulator() {
    let path = std::env::var(ANSWER).expect("a file");
    let before = std::fs::read_to_string(&path).unwrap_or_default();
    let before: serde_json::Value = serde_json::from_str(&before).unwrap_or_default();
    let number = before["number"].as_u64().unwrap_or(0) + 1;
    let asked = Path::new(&path).with_file_name("asked");
    let asked = std::fs::read_to_string(asked).expect("what was asked");
    let answer = if asked.trim_end().ends_with("Simulation.print {}") {
        serde_json::json!(TREE)
    } else {
        let image = Image {
            width: 80,
            height: 60,
            colours: vec![[number as u8, 0, 0]; 80 * 60],
            depths: Vec::new(),
            nodes: Vec::new(),
        };
        serde_json::json!(image.png().expect("a picture"))
    };
    let answer = serde_json::json!({ "number": number, "result": { "return": answer } });
    std::fs::write(&path, answer.to_string()).expect("to write");
}

/// Keys and drags make the same file as in an editor without a window.
#[test]
fn a_file_is_edited_in_a_window() {
    const SIZE: (usize, usize) = (320, 240);
    const RETURN: u32 = 0xff0d;
    let Some(screen) = screen("a_file_is_edited_in_a_window") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("world.xml");
    let text = "<innerModel><!-- mine --><sphere id=\"ball\" radius=\"100\"/></innerModel>";
    std::fs::write(&file, text).expect("a file");
    let start = || {
        let mut command = rcview();
        command.arg("--edit").arg(&file).args(["--size", "320x240"]);
        command.env("DISPLAY", &screen.name).stderr(Stdio::piped());
        Process::start(&mut command)
    };
    let mut twin = Editor::open(&file, Folders::default()).expect("an editor");
    let mut process = start();
    let user = User::new(&screen);
    let window = until("the window", || user.window("world.xml – rcview"));
    for key in "/ball".chars() {
        twin.input(Input::Key(Key::Character(key), Modifiers::default()));
        user.press(window, key);
    }
    twin.input(Input::Key(Key::Return, Modifiers::default()));
    user.press_symbol(window, RETURN);
    user.sees(window, &twin.draw(SIZE).expect("a picture"));
    let handle = twin.handles()[1].points[1];
    let at = (handle.0 as i16, handle.1 as i16);
    let to = (at.0, at.1 - 30);
    let select = Modifiers::default();
    twin.input(Input::Pressed(1, at, select));
    twin.input(Input::Moved(to));
    twin.input(Input::Released(1, to));
    let moved = twin.model().snapshot().node("ball").expect("a node").pose();
    assert!(moved.translation[1] > 10.0, "{moved:?}");
    user.event(window, BUTTON_PRESS_EVENT, 1, at.0, at.1);
    user.event(window, MOTION_NOTIFY_EVENT, 0, to.0, to.1);
    user.event(window, BUTTON_RELEASE_EVENT, 1, to.0, to.1);
    user.press(window, 's');
    let height = moved.translation[1];
    let expected = text.replace("id=\"ball\"", &format!("id=\"ball\" ty=\"{height}\""));
    until("the saved file", || {
        let saved = std::fs::read_to_string(&file).expect("the file");
        (saved == expected).then_some(())
    });
    // A change that is not saved outlives the end of the process, as an earlier one does.
    let unsaved = folder.path().join("world.xml.unsaved");
    std::fs::write(&unsaved, "earlier").expect("a file");
    for key in ['a', 't'] {
        twin.input(Input::Key(Key::Character(key), Modifiers::default()));
        user.press(window, key);
    }
    user.sees(window, &twin.draw(SIZE).expect("a picture"));
    let id = rustix::process::Pid::from_child(&process.0);
    rustix::process::kill_process(id, rustix::process::Signal::TERM).expect("to end it");
    until("the end", || process.0.try_wait().expect("a child"));
    let mut said = String::new();
    let output = process.0.stderr.take().expect("its output");
    std::io::Read::read_to_string(&mut { output }, &mut said).expect("a text");
    assert_eq!(process.end().code(), Some(3), "{said}");
    assert!(said.contains("ended by a signal; the changes are not saved, but in "));
    let read = |path: &Path| std::fs::read_to_string(path).expect("a file");
    let rescued = |number: u8| read(&unsaved.with_extension(format!("unsaved.{number}")));
    assert!(rescued(1).contains("<transform id=\"transform_1\""));
    assert_eq!(read(&unsaved), "earlier");
    // Nor is it lost with the window.
    let mut twin = Editor::open(&file, Folders::default()).expect("an editor");
    assert!(twin.message().contains("world.xml.unsaved has changes"));
    let mut process = start();
    let window = until("the window", || user.window("world.xml – rcview"));
    for key in ['a', 's'] {
        twin.input(Input::Key(Key::Character(key), Modifiers::default()));
        user.press(window, key);
    }
    user.sees(window, &twin.draw(SIZE).expect("a picture"));
    user.destroy(window);
    until("the end", || process.0.try_wait().expect("a child"));
    assert_eq!(process.end().code(), Some(3));
    assert!(rescued(2).contains("<sphere id=\"sphere_1\""));
    assert_eq!(read(&file), expected);
}

/// The option of a `.cdsl` and two parameters show the tree of a component, without code. Without a
/// display, the component does not start.
#[test]
fn a_component_with_the_option_has_a_window() {
    let Some(screen) = screen("a_component_with_the_option_has_a_window") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let start = |network: &str, display: &str| {
        let config = folder.path().join(format!("{network}.toml"));
        let arm = scene("arm.xml");
        let text = format!(
            "[parameters]\nviewer = true\ninner_model = \"{}\"\njoints = []\n",
            arm.display()
        );
        std::fs::write(&config, text).expect("a file");
        let log = folder.path().join(format!("{network}.log"));
        let output = std::fs::File::create(&log).expect("a log");
        let program = std::path::Path::new(env!("CARGO_BIN_EXE_rcview"));
        let program = program.with_file_name("arm_monitor");
        assert!(program.exists(), "run the tests by `cargo xtask test`");
        let network = format!("{network}_{}", std::process::id());
        let mut command = Command::new(program);
        command
            .args(["--network", &network, "--name", "shown_arm", "--config"])
            .arg(config)
            .env("XDG_RUNTIME_DIR", folder.path())
            .env("DISPLAY", display)
            .stdin(Stdio::null())
            .stdout(output.try_clone().expect("a log"))
            .stderr(output);
        (Process::start(&mut command), log)
    };
    let (mut shown, _) = start("with_display", &screen.name);
    let (mut hidden, log) = start("without_display", ":nothing");
    let user = User::new(&screen);
    let window = until("the window", || user.window("shown_arm"));
    let black = user.pixels(window).map(|image| vec![0; image.len()]);
    user.changed(window, &black.unwrap_or_default());
    assert_eq!(hidden.end().code(), Some(1));
    let text = std::fs::read_to_string(&log).expect("the log");
    let reason = "error: the parameter `viewer` is true: cannot open a window: ";
    assert!(text.contains(reason), "{text}");
    assert!(text.contains("set `viewer = false`"), "{text}");
    assert_eq!(shown.0.try_wait().expect("a child"), None);
    let id = rustix::process::Pid::from_child(&shown.0);
    rustix::process::kill_process(id, rustix::process::Signal::TERM).expect("to end it");
    shown.end();
}

/// Changes a tree.
fn obey(model: &InnerModel, actions: &Actions, order: &str) {
    match order {
        "move" => model
            .change(Time::ZERO, |edit| {
                edit.set_pose("t", Pose::new(0.0, 90.0, 0.0, 0.0, 0.0, 0.0))
            })
            .expect("a change"),
        // In front of the bodies.
        "points" => model
            .set_points(
                "seen",
                vec![ColouredPoint {
                    position: [100.0, 50.0, -110.0],
                    colour: [9; 3],
                }],
            )
            .expect("points"),
        "obey" => {
            for action in actions.take() {
                let Action::Move { id, place } = action else {
                    panic!("{action:?}");
                };
                let pose = Pose::new(place.x, place.y, place.z, 0.0, 0.0, 0.0);
                let moved = model.change(Time::ZERO, |edit| edit.set_pose(&id, pose));
                moved.expect("a change");
            }
        }
        other => panic!("{other}"),
    }
}

/// Not a test: the process that the test above starts.
#[test]
#[ignore = "another test starts it"]
fn component() {
    let model = Arc::new(InnerModel::parse(TREE).expect("a model"));
    let said = Arc::new(Mutex::new(Vec::new()));
    let lines = Arc::clone(&said);
    let mut viewer = Viewer::new("component", Arc::clone(&model), move |line: &str| {
        lines.lock().expect("no panic").push(line.to_owned());
    });
    let actions = viewer.actions();
    viewer.show(true).expect("a window");
    for line in std::io::stdin().lines() {
        match line.expect("a line").as_str() {
            "hide" => viewer.show(false).expect("no window"),
            "show" => viewer.show(true).expect("a window"),
            other => obey(&model, &actions, other),
        }
    }
    assert_eq!(*said.lock().expect("no panic"), Vec::<String>::new());
}
