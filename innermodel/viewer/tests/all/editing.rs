//! The editor without a window: actions of a user, and the file that they make.

use innermodel::{Folders, InnerModel, Kind, Point, Snapshot, Vector};
use innermodel_viewer::innermodel;
use innermodel_viewer::{Editor, Input, Key, Modifiers, Navigator, Pixel, ViewerAction, Viewpoint};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A small picture is drawn quickly.
const SIZE: (usize, usize) = (320, 240);
pub(crate) const WORLD: &str = "\
<!-- A table, measured on Monday. -->
<innerModel>
    <transform   id='table' tx=\"100\" tz='50'  rx=\"0.2\" rz='0.5'>  <!-- tx is sure -->
        <sphere id=\"ball\" radius=\"200\" y=\"300\"/>
        <plane id=\"board\" size=\"900,20,900\"/>
    </transform>

    <include path=\"robot.xml\"/> <!-- ours -->
    <transform id=\"eye_pose\" tx=\"-600\"><camera id=\"eye\" width=\"64\" height=\"48\" focal=\"50\"/></transform>
</innerModel>
";
const ROBOT: &str = "\
<innerModel units=\"metres\">
    <transform id=\"robot\" tx=\"0.7\"><sphere id=\"head\" radius=\"0.1\"/></transform>
</innerModel>
";

/// A user of an editor, with a folder of files.
pub(crate) struct User {
    pub(crate) folder: TempDir,
    pub(crate) editor: Editor,
}

impl User {
    pub(crate) fn new(world: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("world.xml"), world).expect("a file");
        std::fs::write(folder.path().join("robot.xml"), ROBOT).expect("a file");
        let editor = Editor::open(&folder.path().join("world.xml"), Folders::default());
        let mut user = Self {
            editor: editor.expect("an editor"),
            folder,
        };
        user.draw();
        user
    }

    pub(crate) fn file(&self) -> PathBuf {
        self.folder.path().join("world.xml")
    }

    pub(crate) fn saved(&self) -> String {
        std::fs::read_to_string(self.file()).expect("the file")
    }

    pub(crate) fn draw(&mut self) {
        self.editor.draw(SIZE).expect("a picture");
    }

    pub(crate) fn press(&mut self, key: Key) -> ViewerAction {
        self.editor.input(Input::Key(key, Modifiers::default()))
    }

    pub(crate) fn key(&mut self, key: char) -> ViewerAction {
        self.press(Key::Character(key))
    }

    /// Presses keys, the last one is Return.
    pub(crate) fn write(&mut self, text: &str) {
        for key in text.chars() {
            self.key(key);
        }
        self.press(Key::Return);
    }

    pub(crate) fn select(&mut self, id: &str) {
        self.write(&format!("/{id}"));
        assert_eq!(
            self.editor.selected(),
            Some(id),
            "{}",
            self.editor.message()
        );
    }

    pub(crate) fn set(&mut self, attribute: &str) {
        self.write(&format!("e{attribute}"));
    }

    /// Drags with the left button, in ten parts.
    fn drag(&mut self, from: Pixel, to: Pixel) {
        self.hold(from, to);
        self.editor.input(Input::Released(1, to));
    }

    fn hold(&mut self, from: Pixel, to: Pixel) {
        let press = Input::Pressed(1, from, Modifiers::default());
        self.editor.input(press);
        for part in 1..=10 {
            let between = |a: i16, b: i16| a + (b - a) * part / 10;
            let at = (between(from.0, to.0), between(from.1, to.1));
            assert_eq!(self.editor.input(Input::Moved(at)), ViewerAction::Draw);
        }
    }

    pub(crate) fn tree(&self) -> std::sync::Arc<Snapshot> {
        self.editor.model().snapshot()
    }

    pub(crate) fn message(&self) -> &str {
        self.editor.message()
    }

    /// Saves, and checks that the file says what the editor shows.
    pub(crate) fn save(&mut self) {
        self.key('s');
        assert_eq!(self.message(), "world.xml is saved");
        assert!(!self.editor.is_changed());
        let read = InnerModel::load(&self.file(), &Folders::default()).expect("a right file");
        same(&read.snapshot(), &self.tree());
    }

    /// Where a handle of an axis is, in pixels.
    fn handle(&self, axis: usize, point: usize) -> Pixel {
        let handles = self.editor.handles();
        let handle = handles.iter().find(|handle| handle.axis == axis);
        pixel(handle.expect("a handle").points[point])
    }
}

fn pixel((x, y): (f64, f64)) -> Pixel {
    (x.floor() as i16, y.floor() as i16)
}

/// Both trees have equal nodes at equal places, within 1e-9.
fn same(a: &Snapshot, b: &Snapshot) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.nodes().zip(b.nodes()) {
        assert_eq!((a.id(), a.kind()), (b.id(), b.kind()));
        let difference = a.to_root().matrix() - b.to_root().matrix();
        assert!(difference.amax() < 1e-9, "{}: {difference}", a.id());
    }
}

fn place(tree: &Snapshot, id: &str) -> Point {
    tree.transform("root", Point::origin(), id).expect("a node")
}

#[test]
fn a_handle_moves_a_node_and_only_its_attribute() {
    let mut user = User::new(WORLD);
    let before = user.tree();
    user.select("table");
    let tip = user.handle(0, 1);
    // Where the tip of the handle is when the node has moved by 250 mm. A line has 80 pixels where
    // the node is.
    let view = Navigator::of(user.editor.model(), Viewpoint::SIZE).view(SIZE.0, SIZE.1);
    let origin = Point::new(100.0, 0.0, 50.0);
    let depth = view.place.inverse().point(&origin).z;
    let length = 80.0 * depth / view.camera.focal;
    let there = |x: f64| view.pixel(&(origin + Vector::x() * x)).expect("in front");
    assert_eq!(tip, pixel(there(length)));
    let target = pixel(there(length + 250.0));
    user.drag(tip, target);
    let moved = place(&user.tree(), "table") - place(&before, "table");
    let of_a_pixel = depth / view.camera.focal;
    assert!((moved.x - 250.0).abs() < 3.0 * of_a_pixel, "{moved}");
    assert_eq!((moved.y, moved.z), (0.0, 0.0));
    // The handle is where the pointer left it.
    let now = user.handle(0, 1);
    let apart = f64::from(now.0 - target.0).hypot(f64::from(now.1 - target.1));
    assert!(apart < 12.0, "{now:?} {target:?}");
    assert_eq!(user.saved(), WORLD, "nothing is written before it is saved");
    user.save();
    let x = place(&user.tree(), "table").x;
    assert_eq!(x, x.round());
    let expected = WORLD.replace("tx=\"100\"", &format!("tx=\"{x}\""));
    assert_eq!(user.saved(), expected);
}

#[test]
fn rings_turn_about_the_axis_of_their_attribute() {
    for (axis, id, written) in [
        (0, "table", "rx=\"0.2\""),
        (1, "table", ""),
        (2, "table", "rz='0.5'"),
    ] {
        let mut user = User::new(WORLD);
        user.select(id);
        user.key('t');
        let old = user.tree().node(id).expect("a node").pose().rotation[axis];
        // Rings meet at multiples of a right angle: the turn begins between them.
        let points: Vec<Pixel> = (6..=18).map(|point| user.handle(axis, point)).collect();
        user.editor
            .input(Input::Pressed(1, points[0], Modifiers::default()));
        for point in &points {
            user.editor.input(Input::Moved(*point));
        }
        user.editor.input(Input::Released(1, points[12]));
        let pose = user.tree().node(id).expect("a node").pose();
        let turned = pose.rotation[axis] - old;
        assert!((turned - FRAC_PI_2).abs() < 0.04, "{axis}: {turned}");
        let degrees = turned * 180.0 / PI;
        assert!((degrees - degrees.round()).abs() < 1e-9, "{degrees}");
        for other in (0..3).filter(|other| *other != axis) {
            assert_eq!(pose.rotation[other], [0.2, 0.0, 0.5][other]);
        }
        user.save();
        if !written.is_empty() {
            assert!(!user.saved().contains(written));
        }
        let lines = user.saved();
        let changed = lines.lines().zip(WORLD.lines()).filter(|(a, b)| a != b);
        assert_eq!(changed.count(), 1);
    }
}

/// In a file in metres, and at a plane, whose place has attributes of its own.
#[test]
fn handles_know_units_and_planes() {
    let world = "<innerModel units='metres'><transform id='t'><plane id='p' size='0.5'/></transform></innerModel>";
    let mut user = User::new(world);
    user.select("p");
    let from = user.handle(1, 1);
    user.drag(from, (from.0, from.1 - 60));
    let tree = user.tree();
    let Kind::Plane(plane) = tree.node("p").expect("a node").kind() else {
        panic!("no plane");
    };
    let height = plane.point[1];
    assert_eq!(user.message(), format!("py of `p` is {height:.3} mm"));
    assert!(
        height > 20.0 && plane.point == [0.0, height, 0.0],
        "{:?}",
        plane.point
    );
    user.save();
    let expected = world.replace(
        "size='0.5'",
        &format!("size='0.5' py=\"{}\"", height / 1000.0),
    );
    assert_eq!(user.saved(), expected);
    user.key('t');
    assert!(
        user.message().contains("nx, ny and nz turn it"),
        "{}",
        user.message()
    );
    assert!(user.editor.handles().is_empty());
}

#[test]
fn a_drag_is_undone_redone_and_cancelled() {
    let mut user = User::new(WORLD);
    let before = user.tree();
    user.select("table");
    let from = user.handle(1, 1);
    user.drag(from, (from.0, from.1 - 50));
    let moved = user.tree();
    assert!(place(&moved, "table").y > 10.0);
    user.key('u');
    same(&user.tree(), &before);
    assert!(!user.editor.is_changed());
    user.key('u');
    assert_eq!(user.message(), "nothing to undo");
    user.key('y');
    same(&user.tree(), &moved);
    user.key('y');
    assert_eq!(user.message(), "nothing to redo");
    let control = Modifiers {
        control: true,
        ..Modifiers::default()
    };
    user.editor.input(Input::Key(Key::Character('z'), control));
    same(&user.tree(), &before);
    user.hold(from, (from.0, from.1 - 50));
    assert!(
        place(&user.tree(), "table").y > 10.0,
        "the picture shows it at once"
    );
    user.press(Key::Escape);
    same(&user.tree(), &before);
    assert!(!user.editor.is_changed());
    // Nothing is read for that: an included file may be wrong at this moment.
    user.hold(from, (from.0, from.1 - 50));
    std::fs::write(user.folder.path().join("robot.xml"), "<").expect("to write");
    user.press(Key::Escape);
    assert_eq!(user.message(), "the node stays where it was");
    same(&user.tree(), &before);
    user.hold(from, (from.0, from.1 - 50));
    user.editor.input(Input::Released(1, from));
    assert!(
        user.message().contains("malformed XML"),
        "{}",
        user.message()
    );
    same(&user.tree(), &before);
    std::fs::write(user.folder.path().join("robot.xml"), ROBOT).expect("to write");
    // A handle that comes back to where it was has changed nothing.
    user.hold(from, (from.0, from.1 - 50));
    user.editor.input(Input::Moved(from));
    user.editor.input(Input::Released(1, from));
    assert!(!user.editor.is_changed());
}

#[test]
fn a_click_selects_what_is_seen() {
    let mut user = User::new(WORLD);
    let view = Navigator::of(user.editor.model(), Viewpoint::SIZE).view(SIZE.0, SIZE.1);
    let at = pixel(view.pixel(&place(&user.tree(), "ball")).expect("in front"));
    let click = |user: &mut User, at: Pixel| {
        user.editor
            .input(Input::Pressed(1, at, Modifiers::default()));
        user.editor.input(Input::Released(1, at));
    };
    click(&mut user, at);
    assert_eq!(user.editor.selected(), Some("ball"));
    user.key('p');
    assert_eq!(user.editor.selected(), Some("table"));
    user.key('p');
    assert_eq!(
        user.editor.selected(),
        None,
        "the root is not a node of the file"
    );
    click(&mut user, at);
    click(&mut user, (1, 1));
    assert_eq!(user.editor.selected(), None);
    user.press(Key::Tab);
    user.press(Key::Tab);
    assert_eq!(user.editor.selected(), Some("ball"));
    user.write("/tabel");
    assert!(
        user.message().contains("did you mean `table`?"),
        "{}",
        user.message()
    );
    // A drag beside the handles turns the view.
    user.press(Key::Escape);
    let before = user.editor.node_at(at);
    user.drag((2, 2), (300, 2));
    user.draw();
    assert_ne!(user.editor.node_at(at), before);
    assert!(!user.editor.is_changed());
}

#[test]
fn bodies_are_added_and_removed() {
    for units in ["", " units=\"metres\""] {
        let world = WORLD.replace("<innerModel>", &format!("<innerModel{units}>"));
        let mut user = User::new(&world);
        let before = user.tree();
        user.select("table");
        let centre = Navigator::of(user.editor.model(), Viewpoint::SIZE).centre;
        for (key, tag) in [
            ('b', "plane"),
            ('s', "sphere"),
            ('c', "cylinder"),
            ('k', "cone"),
        ] {
            user.select("table");
            user.key('a');
            user.key(key);
            let id = format!("{tag}_1");
            assert_eq!(user.message(), format!("`{id}` is added below `table`"));
            assert_eq!(user.editor.selected(), Some(id.as_str()));
            let tree = user.tree();
            let node = tree.node(&id).expect("a node");
            let (body, place) = innermodel::shapes::body(node.kind()).expect("a body");
            let middle = (node.to_root() * place).point(&Point::origin());
            assert!((middle - centre).norm() < 2.0, "{id}: {middle} {centre}");
            assert!(node.kind().collides(), "{body:?}");
        }
        user.select("eye");
        user.key('a');
        user.key('t');
        // A camera has no children.
        assert_eq!(user.message(), "`transform_1` is added below `eye_pose`");
        user.select("robot");
        user.key('a');
        user.key('t');
        assert_eq!(user.message(), "`transform_2` is added");
        user.save();
        let text = user.saved();
        let without: Vec<&str> = text
            .lines()
            .filter(|line| !line.contains("_1\"") && !line.contains("_2\""))
            .collect();
        let original: Vec<&str> = world.lines().collect();
        assert_eq!(without[..6], original[..6]);
        assert!(text.contains("<!-- tx is sure -->") && text.contains("<!-- ours -->"));
        for _ in 0..6 {
            user.key('u');
        }
        same(&user.tree(), &before);
        for _ in 0..6 {
            user.key('y');
        }
        assert!(!user.editor.is_changed());
        user.select("table");
        user.press(Key::Delete);
        assert!(user.tree().node("sphere_1").is_err());
        assert_eq!(user.editor.selected(), None);
        for _ in 0..7 {
            user.key('u');
        }
        user.save();
        assert_eq!(user.saved(), world);
    }
}

/// Nodes without an id are called by their numbers, which change when one is removed.
#[test]
fn a_removed_node_leaves_no_other_one_selected() {
    let world = "<innerModel><sphere radius=\"1\"/><sphere radius=\"2\"/></innerModel>";
    let mut user = User::new(world);
    user.select("sphere#1");
    user.key('d');
    assert_eq!(user.editor.selected(), None);
    user.key('d');
    assert!(user.message().starts_with("select a node first"));
    user.save();
    assert_eq!(user.saved(), world.replace("<sphere radius=\"1\"/>", ""));
}

#[test]
fn a_mesh_is_added_if_its_file_is_there() {
    let mut user = User::new(WORLD);
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/mast.obj");
    std::fs::copy(scenes, user.folder.path().join("mast.obj")).expect("a mesh");
    user.key('a');
    user.key('m');
    user.write("mats.obj");
    assert_eq!(
        user.message(),
        "cannot find the mesh `mats.obj`: write its path from the folder of world.xml"
    );
    assert!(!user.editor.is_changed());
    user.key('y');
    assert_eq!(user.message(), "nothing to redo");
    // An undone edit can still be redone, and the selection stays.
    user.select("ball");
    user.set("radius=111");
    user.key('u');
    user.key('a');
    user.key('m');
    user.write("mats.obj");
    assert_eq!(user.editor.selected(), Some("ball"));
    user.key('y');
    assert_eq!(user.message(), "redone");
    user.key('u');
    user.press(Key::Escape);
    user.key('a');
    user.key('m');
    user.write("mast.obj");
    assert_eq!(user.message(), "`mesh_1` is added");
    user.draw();
    assert_eq!(user.message(), "`mesh_1` is added", "the mesh is drawn");
    user.save();
    assert!(
        user.saved().contains("    <mesh id=\"mesh_1\" "),
        "{}",
        user.saved()
    );
}

/// Control and a letter are a command, so they write nothing. Caps Lock changes no command.
#[test]
fn letters_of_commands_are_no_text() {
    let mut user = User::new(WORLD);
    let control = Modifiers {
        control: true,
        ..Modifiers::default()
    };
    user.select("ball");
    for letter in "eradius=11".chars() {
        user.key(letter);
    }
    user.editor.input(Input::Key(Key::Character('s'), control));
    user.write("1");
    assert_eq!(user.message(), "radius is 111");
    user.editor.input(Input::Key(Key::Character('S'), control));
    assert_eq!(user.message(), "world.xml is saved");
    user.key('U');
    assert_eq!(user.message(), "undone");
}

#[test]
fn attributes_are_written_as_in_the_file() {
    let mut user = User::new(WORLD);
    user.key('e');
    assert!(
        user.message().starts_with("select a node first"),
        "{}",
        user.message()
    );
    user.select("ball");
    for (text, message) in [
        ("radius=0", "`radius` must be greater than 0, found `0`"),
        ("radius=1o", "expected a number for `radius`, found `1o`"),
        ("size=1", "`ball` cannot have the attribute `size`"),
        (
            "radius",
            "expected an attribute and its value, as in tx=1200",
        ),
        ("id=table", "the id `table` is used twice"),
    ] {
        user.set(text);
        assert_eq!(user.message(), message);
        assert!(!user.editor.is_changed());
    }
    user.set("radius = 250.50");
    user.set("texture=#a\"<");
    user.set("id=globe");
    assert_eq!(user.editor.selected(), Some("globe"));
    user.save();
    let old = "id=\"ball\" radius=\"200\"";
    let new = "id=\"globe\" radius=\"250.50\" texture=\"#a&quot;&lt;\"";
    assert_eq!(user.saved(), WORLD.replace(old, new));
}

#[test]
fn the_keys_are_shown_and_documented() {
    let mut user = User::new(WORLD);
    let plain = user.editor.draw(SIZE).expect("a picture");
    user.key('h');
    let helped = user.editor.draw(SIZE).expect("a picture");
    let changed = plain
        .colours
        .iter()
        .zip(&helped.colours)
        .filter(|(a, b)| a != b);
    assert!(changed.count() > 10_000);
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/innermodel.md");
    let page = std::fs::read_to_string(page).expect("the page");
    for (keys, effect) in innermodel_viewer::EDITOR_KEYS {
        assert!(
            page.contains(&format!("| {keys} | {effect} |")),
            "{keys}: {effect}"
        );
    }
    assert_eq!(user.editor.handles().len(), 0);
    user.select("table");
    assert_eq!(user.editor.handles()[0].attribute, "tx");
}
