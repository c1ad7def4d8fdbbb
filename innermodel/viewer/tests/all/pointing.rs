//! Objects of a world that the pointer moves and pushes, without a window.

use innermodel::{InnerModel, Point, Time, Vector};
use innermodel_viewer::innermodel;
use innermodel_viewer::{
    Action, Actions, Input, Key, Marks, Modifiers, Navigator, Options, Pixel, TreeView,
    ViewerAction,
};
use std::sync::Arc;

const SIZE: (usize, usize) = (320, 240);
const CONTROL: Modifiers = Modifiers {
    shift: false,
    control: true,
};
const SHIFT: Modifiers = Modifiers {
    shift: true,
    control: false,
};
const WORLD: &str = r#"<innerModel><transform id="world">
    <plane id="floor" ny="1" py="-5" size="4000,4000,10"/>
    <differentialrobot id="robot" tx="-600" ry="0.5">
        <rotation id="wheels" rz="1.5"><sphere id="wheel" radius="200"/></rotation>
    </differentialrobot>
    <transform id="ball" tx="600" ty="200" rx="0.3" engine="bullet" mass="2"><sphere id="ball_body" radius="200"/></transform>
    <transform id="arm" tz="900"><joint id="shoulder" axis="y">
        <transform id="link" ty="150"><sphere id="link_body" radius="150"/></transform>
    </joint></transform>
    </transform></innerModel>"#;

/// A user of a view whose changes wait in a queue.
struct User<'s> {
    model: Arc<InnerModel>,
    view: TreeView<'s>,
    actions: Actions,
}

fn user(say: &dyn Fn(&str)) -> User<'_> {
    let model = Arc::new(InnerModel::parse(WORLD).expect("a model"));
    let options = Options {
        title: String::new(),
        size: (SIZE.0 as u16, SIZE.1 as u16),
        navigator: None,
        marks: Marks::default(),
    };
    let actions = Actions::new();
    let view = TreeView::new(Arc::clone(&model), &options, say).with_actions(actions.clone());
    let mut user = User {
        model,
        view,
        actions,
    };
    user.draw();
    user
}

impl User<'_> {
    fn draw(&mut self) -> Vec<[u8; 3]> {
        self.view.draw(SIZE).expect("a picture").colours
    }

    /// The pixel of the middle of a sphere.
    fn pixel(&self, id: &str) -> Pixel {
        let tree = self.model.snapshot();
        let place = tree.transform("root", Point::origin(), id);
        self.pixel_of(&place.expect("a node"))
    }

    /// The pixel of a point of the root.
    fn pixel_of(&self, place: &Point) -> Pixel {
        let view = Navigator::of(&self.model, SIZE).view(SIZE.0, SIZE.1);
        let (x, y) = view.pixel(place).expect("in front");
        (x.floor() as i16, y.floor() as i16)
    }

    /// The line of sight at the centre of a pixel.
    fn sight(&self, (x, y): Pixel) -> (Point, Vector) {
        let view = Navigator::of(&self.model, SIZE).view(SIZE.0, SIZE.1);
        let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let way = innermodel::sensors::ray(&view.camera, u, v);
        (view.place.translation.into(), view.place.vector(&way))
    }

    /// Where a line of sight meets a sphere first.
    fn surface(&self, at: Pixel, id: &str, radius: f64) -> Point {
        let (from, way) = self.sight(at);
        let tree = self.model.snapshot();
        let middle = tree.transform("root", Point::origin(), id).expect("a node");
        let (way, back) = (way.normalize(), from - middle);
        let half = back.dot(&way);
        let depth = -half - (half * half - back.norm_squared() + radius * radius).sqrt();
        from + way * depth
    }

    /// Where a line of sight meets the horizontal plane through a point.
    fn at_height(&self, at: Pixel, height: f64) -> Point {
        let (from, way) = self.sight(at);
        from + way * ((height - from.y) / way.y)
    }

    /// A notch of the wheel, while another button is down.
    fn wheel(&mut self, at: Pixel) {
        self.view.input(Input::Pressed(4, at, Modifiers::default()));
        self.view.input(Input::Released(4, at));
    }

    fn drag(&mut self, button: u8, with: Modifiers, from: Pixel, to: Pixel) {
        self.view.input(Input::Pressed(button, from, with));
        self.view.input(Input::Moved(to));
        self.view.input(Input::Released(button, to));
    }
}

fn near(a: &Point, b: &Point) {
    assert!((a - b).norm() < 1e-6, "{a} {b}");
}

fn silent(_: &str) {}

#[test]
fn an_object_follows_the_pointer_over_the_floor() {
    let mut user = user(&silent);
    let from = user.pixel("ball_body");
    let start = user.surface(from, "ball_body", 200.0);
    let mut before = user.draw();
    assert_eq!(
        user.view.input(Input::Pressed(1, from, CONTROL)),
        ViewerAction::Draw
    );
    for to in [(from.0 - 30, from.1 + 7), (from.0 + 20, from.1 + 12)] {
        assert_eq!(user.view.input(Input::Moved(to)), ViewerAction::Draw);
        let taken = user.actions.take();
        let [Action::Move { id, place }] = &taken[..] else {
            panic!("{taken:?}");
        };
        assert_eq!(id, "ball");
        let way = user.at_height(to, start.y) - start;
        near(place, &(Point::new(600.0, 200.0, 0.0) + way));
        assert!(way.norm() > 20.0 && way.y.abs() < 1e-9, "{way}");
        // The way of the pointer is drawn.
        let now = user.draw();
        assert_ne!(before, now);
        before = now;
    }
    // A held object stays held, whatever forces do meanwhile.
    user.view.poll();
    assert_eq!(user.actions.take().len(), 1);
    user.view
        .input(Input::Released(1, (from.0 + 20, from.1 + 12)));
    user.view.poll();
    assert_eq!(user.actions.take(), []);
}

#[test]
fn the_right_button_lifts() {
    let mut user = user(&silent);
    let from = user.pixel("wheel");
    let start = user.surface(from, "wheel", 200.0);
    // Straight upwards in the world.
    let to = user.pixel_of(&(start + Vector::y() * 300.0));
    user.drag(3, CONTROL, from, to);
    let taken = user.actions.take();
    let [Action::Move { id, place }] = &taken[..] else {
        panic!("{taken:?}");
    };
    // A wheel belongs to its robot.
    assert_eq!(id, "robot");
    assert_eq!((place.x, place.z), (-600.0, 0.0));
    assert!(place.y > 50.0, "{place}");
    let lifted = start + Vector::y() * place.y;
    // The point that was taken is below the pointer.
    let (eye, way) = user.sight(to);
    let apart = (lifted - eye).cross(&way.normalize()).norm();
    assert!(apart < (start - eye).norm() / 320.0, "{apart}");
}

#[test]
fn a_push_grows_with_the_way_of_the_pointer() {
    let mut user = user(&silent);
    let from = user.pixel("ball_body");
    let start = user.surface(from, "ball_body", 200.0);
    let to = (from.0 - 40, from.1 + 10);
    user.view.input(Input::Pressed(1, from, SHIFT));
    user.view.input(Input::Moved(to));
    user.view.poll();
    assert_eq!(user.actions.take(), [], "it is pushed when it is let go");
    user.view.input(Input::Released(1, to));
    let taken = user.actions.take();
    let [Action::Push { id, impulse }] = &taken[..] else {
        panic!("{taken:?}");
    };
    assert_eq!(id, "ball");
    let expected = (user.at_height(to, start.y) - start) * 0.005;
    assert!((impulse - expected).norm() < 1e-9 && expected.norm() > 0.2);
    // Forces do not move a robot.
    let from = user.pixel("wheel");
    let before = user.draw();
    user.drag(1, SHIFT, from, (from.0 + 40, from.1));
    assert_eq!(user.actions.take(), []);
    let before = {
        let now = user.draw();
        assert_ne!(now, before, "the window says why");
        now
    };
    // And so it does if the owner of the world refuses.
    user.actions.refuse("forces are switched off");
    assert_eq!(user.view.poll(), ViewerAction::Draw);
    assert_ne!(user.draw(), before);
    assert_eq!(user.view.poll(), ViewerAction::Nothing);
}

#[test]
fn escape_puts_an_object_back() {
    let mut user = user(&silent);
    let from = user.pixel("ball_body");
    let escape = Input::Key(Key::Escape, Modifiers::default());
    for (with, expected) in [(CONTROL, 1), (SHIFT, 0)] {
        user.view.input(Input::Pressed(1, from, with));
        user.view.input(Input::Moved((from.0 + 30, from.1)));
        user.actions.take();
        assert_eq!(user.view.input(escape), ViewerAction::Draw);
        let taken = user.actions.take();
        assert_eq!(taken.len(), expected);
        for action in taken {
            let place = Point::new(600.0, 200.0, 0.0);
            let id = "ball".to_owned();
            assert_eq!(action, Action::Move { id, place });
        }
        user.view.input(Input::Released(1, from));
    }
    assert_eq!(user.view.input(escape), ViewerAction::End);
}

#[test]
fn what_is_moved_is_the_object_or_what_was_picked() {
    let lines = std::cell::RefCell::new(Vec::new());
    let say = |line: &str| lines.borrow_mut().push(line.to_owned());
    let mut user = user(&say);
    let moved = |user: &mut User<'_>, from: Pixel| {
        user.drag(1, CONTROL, from, (from.0 + 10, from.1 + 10));
        let taken = user.actions.take();
        taken.first().map(|action| match action {
            Action::Move { id, .. } | Action::Push { id, .. } => id.clone(),
        })
    };
    let link = user.pixel("link_body");
    assert_eq!(moved(&mut user, link).as_deref(), Some("arm"));
    let click = |user: &mut User<'_>, at: Pixel| {
        user.drag(1, Modifiers::default(), at, at);
    };
    click(&mut user, link);
    assert!(lines.borrow()[0].starts_with("link_body (sphere): "));
    assert_eq!(moved(&mut user, link).as_deref(), Some("arm"));
    user.view
        .input(Input::Key(Key::Character('p'), Modifiers::default()));
    assert!(lines.borrow()[1].starts_with("link (transform): "));
    assert_eq!(moved(&mut user, link).as_deref(), Some("link"));
    // A node that was picked elsewhere does not count.
    let wheel = user.pixel("wheel");
    assert_eq!(moved(&mut user, wheel).as_deref(), Some("robot"));
    // The floor belongs to the world, with all that stands on it.
    let floor = user.pixel_of(&Point::new(1700.0, 0.0, -1700.0));
    click(&mut user, floor);
    assert!(lines.borrow()[2].starts_with("floor (plane): "));
    let before = user.draw();
    assert_eq!(moved(&mut user, floor), None);
    assert_ne!(user.draw(), before, "the window says why");
    user.view
        .input(Input::Key(Key::Character('p'), Modifiers::default()));
    assert_eq!(moved(&mut user, floor).as_deref(), Some("world"));
    // There is nothing in the background.
    assert_eq!(moved(&mut user, (1, 100)), None);
}

#[test]
fn a_tree_without_an_owner_is_not_changed() {
    let mut user = user(&silent);
    let options = Options {
        title: String::new(),
        size: (SIZE.0 as u16, SIZE.1 as u16),
        navigator: None,
        marks: Marks::default(),
    };
    user.view = TreeView::new(Arc::clone(&user.model), &options, &silent);
    let before = user.draw();
    let at = user.pixel("ball_body");
    user.drag(1, CONTROL, at, (at.0 + 30, at.1));
    assert_eq!(user.actions.take(), []);
    assert_ne!(user.draw(), before, "the view turns");
    assert_eq!(user.view.poll(), ViewerAction::Nothing);
    let changed = user.model.change(Time::ZERO, |edit| edit.remove("arm"));
    assert_eq!(changed.expect("a change"), 4);
    assert_eq!(user.view.poll(), ViewerAction::Draw);
}

#[test]
fn the_wheel_lets_go_nothing() {
    let mut user = user(&|_| {});
    let from = user.pixel("ball_body");
    let to = (from.0 + 10, from.1 + 3);
    user.view.input(Input::Pressed(1, from, SHIFT));
    user.view.input(Input::Moved(to));
    user.wheel(to);
    assert_eq!(user.actions.take(), [], "the push is not made yet");
    user.view.input(Input::Released(1, to));
    assert!(matches!(user.actions.take()[..], [Action::Push { .. }]));
    // Nor does it end a turn of the view.
    user.view
        .input(Input::Pressed(1, (2, 2), Modifiers::default()));
    user.wheel((2, 2));
    assert_eq!(user.view.input(Input::Moved((30, 2))), ViewerAction::Draw);
}
