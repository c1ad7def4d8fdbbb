//! Reactions of the model to keys and messages.

#![allow(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::*;

#[test]
fn folded_groups_summarise_their_components() {
    let mut model = model(Host::Top);
    for _ in 0..2 {
        press(&mut model, Key::Down);
    }
    assert_eq!(model.selected, "left");
    press(&mut model, Key::Enter);
    shows(
        &mut model,
        60,
        12,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed            8.5% 25M
            COMPONENT         STATE       CPU   MEM  IN/s RESTARTS  LOST
            simulator         running    0.3%  3.0M     0        0     0
            avoider  cruisin… running    1.0%  4.0M     0        0     0
            ▸ left            emergency  4.1%   11M  3.0k        0     0
            ▾ right           1/1        3.1%  7.0M  1.5k        1    12
              eye             running    3.1%  7.0M  1.5k        1    12
            monitor           failed        -     -     -        1     0
            ── events ──────────────────────────────────────────────────
                         no map
            13:56:03 left.eye: says that it cannot do its work
            r restart  x stop  s start  e emergency  ? help  q leave
        "#]],
    );
    // A command for a group affects all its components.
    assert_eq!(keys(&mut model, "r"), None);
    assert_eq!(keys(&mut model, "y"), Some(control(Verb::Restart, "left")));
    press(&mut model, Key::Right);
    press(&mut model, Key::Down);
    assert_eq!(model.selected, "left.arm");
    press(&mut model, Key::Left);
    press(&mut model, Key::Left);
    assert_eq!(model.selected, "left");
    // A group has no log.
    keys(&mut model, "l");
    assert_eq!(model.page, Page::Table);
}

#[test]
fn the_key_that_opens_the_help_closes_it() {
    let mut model = model(Host::Top);
    keys(&mut model, "?");
    assert_eq!(model.page, Page::Help);
    keys(&mut model, "?");
    assert_eq!(model.page, Page::Table);
}

#[test]
fn stop_asks_for_confirmation_and_emergency_does_not() {
    let mut model = model(Host::Up);
    assert_eq!(keys(&mut model, "x"), None);
    let asked = screen(&mut model, 40, 10);
    assert!(asked.ends_with("y/n stop simulator?\n"), "{asked}");
    assert_eq!(keys(&mut model, "n"), None);
    assert_eq!(model.prompt, None);
    let names = |names: &[&str]| names.iter().map(|&n| n.to_owned()).collect::<Vec<String>>();
    assert_eq!(
        keys(&mut model, "xy"),
        Some(control(Verb::Stop, "simulator"))
    );
    assert_eq!(
        keys(&mut model, "s"),
        Some(control(Verb::Start, "simulator"))
    );
    let enter = Command::Emergency {
        names: names(&["simulator"]),
        active: true,
    };
    assert_eq!(keys(&mut model, "e"), Some(enter));
    let all = Command::Emergency {
        names: names(&NAMES[..5]),
        active: true,
    };
    assert_eq!(keys(&mut model, "E"), Some(all));
    model.selected = "left.eye".to_owned();
    let leave = Command::Emergency {
        names: names(&["left.eye"]),
        active: false,
    };
    assert_eq!(keys(&mut model, "e"), None);
    assert_eq!(keys(&mut model, "y"), Some(leave));
    model.selected = "monitor".to_owned();
    assert_eq!(keys(&mut model, "e"), None);
    assert_eq!(model.notice.as_ref().map(|n| n.failed), Some(true));
    // `q` works in every state.
    keys(&mut model, "r");
    let control_c = Key::Control('c');
    assert_eq!(
        model.key(control_c),
        Some(Command::Quit { interrupt: true })
    );
    // `q` ends the network, so it asks; without the network, the view only.
    assert_eq!(keys(&mut model, "q"), None);
    let asked = screen(&mut model, 60, 10);
    assert!(asked.ends_with("y/n stop the network patrol?\n"), "{asked}");
    let quit = Some(Command::Quit { interrupt: false });
    assert_eq!(keys(&mut model, "ny"), None);
    assert_eq!(keys(&mut model, "qy"), quit);
    let mut model = self::model(Host::Top);
    assert_eq!(keys(&mut model, "q"), quit);
}

#[test]
fn parameters_are_shown_and_edited() {
    let mut model = model(Host::Up);
    keys(&mut model, "p");
    model.parameters("avoider", Err("of another component".to_owned()));
    assert_eq!(model.parameters, None);
    model.parameters("simulator", Ok(parameters()));
    shows(
        &mut model,
        80,
        12,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed                                8.5% 25M
            simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
            iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2ms  overruns 2  error
             log   parameters   connections
            speed  400.0*       float, from 0 to 1500, in mm/s
            map    "house.map"  path
            name   "left"       string
            token  ***          string

            float, from 0 to 1500, in mm/s; changes at once, is not saved. How fast it may
            be.
            enter change  w save  tab connections  r restart  esc back  q stop the network
        "#]],
    );
    press(&mut model, Key::Enter);
    press(&mut model, Key::Backspace);
    press(&mut model, Key::Backspace);
    keys(&mut model, "5");
    let shown = screen(&mut model, 80, 12);
    assert!(shown.ends_with("speed = 4005\n"), "{shown}");
    let set = |path: &str, value: Value| {
        let (name, path) = ("simulator".to_owned(), path.to_owned());
        Some(Command::Set { name, path, value })
    };
    assert_eq!(press(&mut model, Key::Enter), set("speed", json!(4005)));
    keys(&mut model, "j");
    assert_eq!(press(&mut model, Key::Enter), None);
    assert_eq!(model.prompt, None, "it is fixed");
    keys(&mut model, "j");
    press(&mut model, Key::Enter);
    keys(&mut model, "12");
    // Typed text replaces the old value, and a string stays a string.
    assert_eq!(press(&mut model, Key::Enter), set("name", json!("12")));
    press(&mut model, Key::Enter);
    press(&mut model, Key::End);
    keys(&mut model, "12");
    assert_eq!(press(&mut model, Key::Enter), set("name", json!("left12")));
    keys(&mut model, "j");
    press(&mut model, Key::Enter);
    keys(&mut model, "qx");
    let shown = screen(&mut model, 80, 12);
    assert!(shown.ends_with("token = **\n"), "{shown}");
    assert_eq!(press(&mut model, Key::Esc), None);
    assert_eq!(
        keys(&mut model, "w"),
        Some(Command::Save {
            name: "simulator".to_owned()
        })
    );
}

#[test]
fn a_log_is_followed_until_the_user_scrolls() {
    let mut model = model(Host::Top);
    press(&mut model, Key::Enter);
    model.log_lines((1..=50).map(|i| format!("line {i}")).collect());
    shows(
        &mut model,
        60,
        9,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed            8.5% 25M
        simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
        iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2m
         log   parameters   connections
        line 47
        line 48
        line 49
        line 50
        tab parameters  r restart  x stop  esc back  q leave
    "#]],
    );
    press(&mut model, Key::PageUp);
    model.log_lines(vec!["line 51".to_owned()]);
    shows(
        &mut model,
        60,
        9,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed            8.5% 25M
        simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
        iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2m
         log   parameters   connections  5 lines up
        line 43
        line 44
        line 45
        line 46
        tab parameters  r restart  x stop  esc back  q leave
    "#]],
    );
    press(&mut model, Key::Home);
    assert!(screen(&mut model, 60, 9).contains("\nline 1\nline 2\n"));
    press(&mut model, Key::End);
    assert!(screen(&mut model, 60, 9).contains("\nline 51\n"));
}

/// The row of a component in the table.
fn row<'a>(screen: &'a str, name: &str) -> &'a str {
    let mut rows = screen.lines().filter(|line| line.starts_with(name));
    rows.next().unwrap_or_default()
}

#[test]
fn conditions_of_a_component_are_marked_and_shown() {
    let mut model = model(Host::Top);
    let mut status = status();
    status.components[1].troubles.push(Trouble {
        code: "overrun".to_owned(),
        message: "needs longer than its period".to_owned(),
        since: "2026-11-21T13:56:02.000Z".to_owned(),
    });
    model.status(status);
    assert!(row(&screen(&mut model, 40, 10), "avoider").contains(" running !"));
    keys(&mut model, "jc");
    let page = screen(&mut model, 60, 10);
    assert!(
        page.contains("\noverrun: needs longer than its period\n"),
        "{page}"
    );
}

#[test]
fn a_restarted_component_has_no_old_report() {
    let mut model = model(Host::Up);
    assert!(model.components[0].report.is_some());
    let mut status = status();
    status.components[0].pid = Some(4711);
    model.status(status.clone());
    assert!(model.components[0].report.is_none() && model.components[0].rates.is_empty());
    assert!(model.components[1].report.is_some());
    // Without a report for a long time.
    model.tick(Duration::from_mins(1));
    assert!(row(&screen(&mut model, 80, 24), "avoider").contains(" silent"));
    // A removed component is no longer selected.
    model.selected = "monitor".to_owned();
    status.components.pop();
    model.status(status);
    assert_eq!(model.selected, "simulator");
}
