//! Components with a window of Qt, on a display without a monitor: in C++ `components/panel`, and one in
//! Python. A user sees values, clicks, and closes the window.

use crate::cpp_worker::{its_own_test_passes, tool};
use crate::python_site;
use rc_test_site::site::Site;
use rc_test_support::cable::{install, run};
use rc_test_support::python::skipped;
use rc_test_support::screen::Screen;
use rc_test_support::{cmake, python};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use std::path::Path;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, CLIENT_MESSAGE_EVENT, ClientMessageEvent,
    ConnectionExt as _, EventMask, ImageFormat, MOTION_NOTIFY_EVENT, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// The packages of Debian that components with windows need: those of Qt for C++ have the libraries that
/// `PySide6` needs, too.
const PACKAGES: [&str; 2] = ["qt6-base-dev", "libxcb-cursor0"];
const PYSIDE: &str = "numpy==2.3.4\nPySide6-Essentials==6.8.3\n";

/// The network of the panel, which is that of the repository.
const PANEL: &str = include_str!("../../../components/networks/panel.ddsl");
const SCRIPT: &str = "Deployment NAME\n{\n    middleware iceoryx2;\n    \
                      Component script { cdsl \"window_script/window_script.cdsl\"; };\n};\n";

/// The colour of the scan in the panel, as pixels have it: blue, green, red.
const SCAN: [u8; 3] = [70, 110, 40];

/// A display where Qt is installed. `None`: `test` is listed as skipped.
fn screen(test: &str) -> Option<Screen> {
    let is_there = run("dpkg-query", &[&["-W"], &PACKAGES[..]].concat());
    let installed = is_there.or_else(|_| install(&PACKAGES));
    match installed.and_then(|()| Screen::new()) {
        Ok(screen) => Some(screen),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

/// A user in front of a window.
struct User {
    connection: RustConnection,
    root: Window,
    window: Window,
}

impl User {
    /// Waits until a window with this title is seen.
    fn of(screen: &Screen, title: &str) -> Self {
        let (connection, number) = x11rb::connect(Some(&screen.name)).expect("the display");
        let root = connection.setup().roots[number].root;
        let mut user = Self {
            connection,
            root,
            window: root,
        };
        Site::until(&format!("the window {title}"), || {
            user.window = user.find(title).unwrap_or(root);
            user.window != root && user.pixels().is_some()
        });
        user
    }

    fn find(&self, title: &str) -> Option<Window> {
        let tree = self.connection.query_tree(self.root).ok()?.reply().ok()?;
        tree.children.into_iter().find(|window| {
            let (name, text) = (AtomEnum::WM_NAME, AtomEnum::ANY);
            let named = self
                .connection
                .get_property(false, *window, name, text, 0, 100);
            let named = named.ok().and_then(|cookie| cookie.reply().ok());
            named.is_some_and(|named| named.value == title.as_bytes())
        })
    }

    /// The pixels of the window: four bytes each.
    fn pixels(&self) -> Option<Vec<u8>> {
        let (connection, window) = (&self.connection, self.window);
        let size = connection.get_geometry(window).ok()?.reply().ok()?;
        let (form, all) = (ImageFormat::Z_PIXMAP, u32::MAX);
        let image = connection.get_image(form, window, 0, 0, size.width, size.height, all);
        Some(image.ok()?.reply().ok()?.data)
    }

    /// The number of pixels with a colour.
    fn count(&self, colour: [u8; 3]) -> usize {
        let pixels = self.pixels().unwrap_or_default();
        let pixels = pixels.chunks_exact(4);
        pixels.filter(|pixel| pixel[..3] == colour).count()
    }

    /// Clicks at a place, from the left and, if it is negative, from below.
    fn click(&self, x: i16, y: i16) {
        let (connection, window) = (&self.connection, self.window);
        let size = connection.get_geometry(window).expect("a request");
        let size = size.reply().expect("its size");
        let y = if y < 0 { size.height as i16 + y } else { y };
        let place = connection.translate_coordinates(window, self.root, x, y);
        let place = place.expect("a request").reply().expect("its place");
        for (event, button) in [
            (MOTION_NOTIFY_EVENT, 0),
            (BUTTON_PRESS_EVENT, 1),
            (BUTTON_RELEASE_EVENT, 1),
        ] {
            let (x, y) = (place.dst_x, place.dst_y);
            let input = connection.xtest_fake_input(event, button, 0, self.root, x, y, 0);
            input.expect("a request").check().expect("to click");
        }
    }

    /// Closes the window, as the cross in its corner does.
    fn close(&self) {
        let atom = |name: &str| {
            let atom = self.connection.intern_atom(false, name.as_bytes());
            atom.expect("a request").reply().expect("an atom").atom
        };
        let event = ClientMessageEvent {
            response_type: CLIENT_MESSAGE_EVENT,
            format: 32,
            sequence: 0,
            window: self.window,
            type_: atom("WM_PROTOCOLS"),
            data: [atom("WM_DELETE_WINDOW"), 0, 0, 0, 0].into(),
        };
        let none = EventMask::NO_EVENT;
        let sent = self.connection.send_event(false, self.window, none, event);
        sent.expect("a request").check().expect("to close");
    }
}

/// What the management of a component says of its state.
fn await_state(site: &Site, component: &str, state: &str) {
    Site::until(&format!("{component} is {state}"), || {
        site.ask(component, "status")["state"] == state
    });
}

/// Waits for an event of a component with a text.
fn await_event(site: &Site, component: &str, code: &str, text: &str) {
    Site::until(&format!("the event {code} of {component}"), || {
        let events = site.events(component);
        let mut events = events.iter();
        events.any(|(of, message)| of == code && message.contains(text))
    });
}

/// The pose of the base of the simulator.
fn pose(site: &Site) -> String {
    let call = [
        "call",
        &site.network,
        "simulator.DifferentialRobot.getBasePose",
    ];
    let called = site.rcdeploy(&call, false);
    assert_eq!(called.code, 0, "{called:?}");
    called.stdout
}

/// Clicks on the picture, which shows less of the room each time: what is beyond fills it. Tools
/// show and set the same parameter.
fn a_click_changes_a_parameter(site: &Site, user: &User) {
    let before = user.count(SCAN);
    let fills = "a picture of the nearest metre";
    for range in [2000, 1000] {
        user.click(200, 100);
        Site::until("a tool shows the new value", || {
            let shown = json!({ "paths": ["range"] });
            let shown = site.tell("panel", "parameters", &shown);
            shown["parameters"][0]["value"] == range
        });
    }
    Site::until(fills, || user.count(SCAN) > before + before / 4);
    let set = ["params", "set", &site.network, "panel", "range=8000"];
    let set = site.rcdeploy(&set, false);
    assert_eq!(set.code, 0, "{set:?}");
    Site::until("a picture of the whole room", || user.count(SCAN) < before);
}

/// A worker that blocks for ever, because its display does not answer: the supervisor says that it hangs, and
/// starts it again.
fn a_window_that_blocks_is_restarted(site: &Site, screen: &Screen) {
    let send = |signal| {
        let server = Pid::from_raw(screen.process().cast_signed()).expect("a process");
        kill_process(server, signal).expect("the display");
    };
    let before = site.ask("panel", "status")["pid"].as_u64();
    assert!(before.is_some());
    send(Signal::STOP);
    await_event(site, "panel", "hung-too-long", "");
    await_event(site, "panel", "killed", "");
    send(Signal::CONT);
    site.await_component("panel", |panel| {
        panel["state"] == "running" && panel["pid"].as_u64() != before
    });
}

#[test]
fn a_click_on_the_panel_stops_the_robot_and_its_end_is_in_order() {
    let test = "a_click_on_the_panel_stops_the_robot_and_its_end_is_in_order";
    let (Some(cmake), Some(screen)) = (cmake::folder(test), screen(test)) else {
        return;
    };
    crate::built();
    let site = Site::new("window_cpp");
    let network = PANEL.replace("Deployment panel", &format!("Deployment {}", site.network));
    let restart = "after simulator;\n        restart on_failure hung 4s; stop 1s;";
    site.write_ddsl(&network.replace("after simulator;", restart));
    let mut up = tool(&site, &cmake);
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).env("DISPLAY", &screen.name);
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");

    let user = User::of(&screen, "Panel");
    Site::until("a scan in the window", || user.count(SCAN) > 500);
    let before = pose(&site);
    Site::until("the robot drives", || pose(&site) != before);

    a_click_changes_a_parameter(&site, &user);
    // The button is at the bottom.
    user.click(200, -40);
    await_state(&site, "panel", "emergency");
    let (stands, sent) = (pose(&site), |site: &Site| {
        site.ask("avoider", "status")["compute"]["count"].as_u64()
    });
    let since = sent(&site);
    Site::until("more commands of the avoider", || {
        sent(&site) > since.map(|count| count + 10)
    });
    assert_eq!(pose(&site), stands, "it moves in an emergency");

    let off = ["emergency", &site.network, "panel", "off"];
    let off = site.rcdeploy(&off, false);
    assert_eq!(off.code, 0, "{off:?}");
    await_state(&site, "panel", "running");
    Site::until("the robot drives on", || pose(&site) != stands);

    a_window_that_blocks_is_restarted(&site, &screen);
    let user = User::of(&screen, "Panel");
    Site::until("a scan in the new window", || user.count(SCAN) > 500);
    user.close();
    await_event(&site, "panel", "exited", "ended: exit status 0");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    its_own_test_passes(&site, &cmake, "panel");
}

#[test]
fn a_window_in_python_runs_fails_hangs_and_closes() {
    let test = "a_window_in_python_runs_fails_hangs_and_closes";
    let Some(screen) = screen(test) else { return };
    let Some(python) = python::packages("python-qt", PYSIDE, test) else {
        return;
    };
    let files = [
        ("window_script.cdsl", include_str!("window_script.cdsl")),
        ("src/mainUI.ui", include_str!("window_script.ui")),
        ("src/specific_worker.py", include_str!("window_script.py")),
    ];
    let site = python_site::workspace_in(python, "window_python", "window_script", &files);
    let site = site.expect("an environment");
    site.write_ddsl(&SCRIPT.replace("NAME", &site.network));
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl()).env("CARGO_NET_OFFLINE", "true");
    up.env("DISPLAY", &screen.name);
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}\n{}", site.log("script"));

    let user = User::of(&screen, "Script");
    site.await_in_log("script", "the waits have ended");
    let status = || site.ask("script", "status");
    user.click(150, 60);
    Site::until("the error of the button", || {
        let error = status()["last_error"].to_string();
        error.contains("ValueError: the button fails")
    });
    let count = status()["compute"]["count"].as_u64();
    Site::until("computes after it", || {
        status()["compute"]["count"].as_u64() > count
    });
    user.click(150, 100);
    await_state(&site, "script", "emergency");
    site.await_in_log("script", "the button was pressed");
    user.click(150, 140);
    await_event(&site, "script", "hung", "");
    await_event(&site, "script", "answers-again", "");
    user.close();
    await_event(&site, "script", "exited", "ended: exit status 0");
    site.await_in_log("script", "finalized");
    // It was the only component of its network.
    site.await_nothing_left();
}
