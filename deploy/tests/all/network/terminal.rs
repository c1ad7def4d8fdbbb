//! `rcdeploy up` and `rcdeploy top` on a real terminal: screens, keys, and the restored terminal.

use crate::pty::{SETSID, Terminal};
use rc_test_site::site::Site;
use rustix::process::{Signal, kill_process};
use serde_json::Value;
use std::path::Path;

fn start(site: &Site, size: (u16, u16), args: &[&str]) -> Terminal {
    let [setsid, argument] = SETSID;
    let mut command = site.command(Path::new(setsid));
    command
        .args([argument, env!("CARGO_BIN_EXE_rcdeploy")])
        .args(args);
    Terminal::start(command, size)
}

fn up<'a>(ddsl: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["up", "--profile", "dev", ddsl], more].concat()
}

fn pid_of(site: &Site, component: &str) -> i64 {
    let status = site.status();
    let components = status["components"].as_array().expect("components");
    let found = components.iter().find(|c| c["name"] == component);
    found.expect("the component")["pid"].as_i64().unwrap_or(0)
}

#[test]
fn a_network_is_shown_and_restarted_and_stopped_by_keys() {
    let site = Site::new("screen");
    let ddsl = site.ddsl().display().to_string();
    let mut terminal = start(&site, (120, 30), &up(&ddsl, &[]));
    terminal.until_text("3 running");
    terminal.until_text("network screen");
    assert!(terminal.screen().alternate_screen() && terminal.is_raw());
    // The simulator serves at least twenty calls per second.
    terminal.until("rates", |screen| {
        let contents = screen.contents();
        let row = contents.lines().find(|l| l.starts_with("simulator"));
        row.is_some_and(|row| row.contains("running") && !row.contains(" - "))
    });

    let before = pid_of(&site, "simulator");
    terminal.press("r");
    terminal.until_text("y/n restart simulator?");
    assert_eq!(pid_of(&site, "simulator"), before);
    terminal.press("y");
    terminal.until_text("restart simulator: done");
    let after = pid_of(&site, "simulator");
    assert!(after != before && after != 0, "{before} {after}");

    terminal.press("c");
    terminal.until_text("avoider.Laser");
    terminal.press("p");
    terminal.until_text("robot.max_speed");
    terminal.press("\u{1b}");
    terminal.until_text("COMPONENT");
    // The monitor prints the received poses.
    terminal.press("j\r");
    terminal.until_text("poses=");
    terminal.press("\u{1b}");
    terminal.until_text("COMPONENT");

    // Another size.
    terminal.resize(40, 10);
    terminal.until("a narrow table", |screen| {
        let contents = screen.contents();
        contents.contains("COMPONENT") && !contents.contains("RESTARTS")
    });

    terminal.press("\u{3}");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen}");
    for output in ["stopping: interrupted", "is down"] {
        assert!(screen.contains(output), "{screen}");
    }
    site.assert_nothing_left();
}

#[test]
fn top_shows_a_background_network_without_affecting_it() {
    let site = Site::new("top");
    let started = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(started.code, 0, "{started:?}");
    let mut terminal = start(&site, (80, 24), &["top", &site.network]);
    terminal.until_text("3 running");
    // Earlier events are shown, too.
    terminal.until_text("network top");
    // The rates count published poses and requested scans.
    for (component, slot) in [("simulator", "FullPoseEstimationPub"), ("avoider", "Laser")] {
        Site::until("something that was sent", || {
            let slots = site.ask(component, "status")["slots"].clone();
            let slots = slots.as_array().cloned().unwrap_or_default();
            let sent = |s: &Value| s["name"] == slot && s["sent"].as_u64() > Some(1);
            slots.iter().any(sent)
        });
    }
    terminal.press("q");
    assert_eq!(terminal.end().0, Some(0));
    assert_ne!(pid_of(&site, "avoider"), 0);

    // A view that is ended by a signal restores the terminal, too.
    let mut terminal = start(&site, (80, 24), &["top", &site.network]);
    terminal.until_text("3 running");
    kill_process(terminal.pid(), Signal::TERM).expect("to end it");
    assert_eq!(terminal.end().0, Some(0));

    // So does a view whose network goes down.
    let mut terminal = start(&site, (80, 24), &["top", &site.network]);
    terminal.until_text("3 running");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0));
    assert!(screen.contains("is down"), "{screen}");
    site.assert_nothing_left();
    let nobody = start(&site, (80, 24), &["top", &site.network]);
    let (code, screen) = nobody.end();
    assert_eq!(code, Some(3));
    assert!(screen.contains("is not up"), "{screen}");
    let nowhere = site.rcdeploy(&["top", &site.network], false);
    assert_eq!(nowhere.code, 2, "{nowhere:?}");
}

#[test]
fn closing_the_terminal_stops_its_network() {
    let site = Site::new("gone");
    let ddsl = site.ddsl().display().to_string();
    let mut terminal = start(&site, (80, 24), &up(&ddsl, &[]));
    terminal.until_text("3 running");
    terminal.hang_up();
    site.assert_nothing_left();
}

#[test]
fn without_the_view_up_prints_lines() {
    let site = Site::new("plain");
    let ddsl = site.ddsl().display().to_string();
    let mut terminal = start(&site, (120, 60), &up(&ddsl, &["--plain"]));
    terminal.until_text("is up");
    assert!(!terminal.screen().alternate_screen() && !terminal.is_raw());
    terminal.press("\u{3}");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("is down"), "{screen}");
    site.assert_nothing_left();
}

#[test]
fn components_that_were_started_by_hand_are_shown_without_a_supervisor() {
    let site = Site::new("handmade");
    let simulator = site.start("simulator", &[]);
    let mut terminal = start(&site, (80, 24), &["top", &site.network]);
    let by_hand = |name: &str, screen: &vt100::Screen| {
        let contents = screen.contents();
        let mut rows = contents.lines().filter(|line| line.starts_with(name));
        rows.any(|row| row.contains(" by hand "))
    };
    terminal.until("the simulator", |screen| by_hand("simulator", screen));
    // Another one comes.
    let mut avoider = site.start("avoider", &[]);
    terminal.until("the avoider", |screen| by_hand("avoider", screen));
    terminal.press("x");
    terminal.until_text("y/n stop");
    terminal.press("y");
    terminal.until_text("it was started by hand");
    avoider.kill();
    terminal.until("one component", |screen| {
        !screen.contents().contains("avoider")
    });
    kill_process(simulator.pid(), Signal::TERM).expect("to end it");
    assert_eq!(simulator.end(), Some(0));
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen}");
    assert!(screen.contains("is down"), "{screen}");
}
