//! Golden screens.

#![allow(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::*;

#[test]
fn a_wide_terminal_shows_all_columns() {
    shows(
        &mut model(Host::Up),
        120,
        30,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed                                                                        8.5% 25M
            COMPONENT                STATE         UP   CPU   MEM  IN/s OUT/s CALLS/s COMPUTE p50/p99 HANDLER p50/p99 RESTARTS  LOST
            simulator                running       0s  0.3%  3.0M     0  1.5k      20      55us/1.2ms      12us/340us        0     0
            avoider  cruising charg… running    1m02s  1.0%  4.0M     0     0      20      55us/1.2ms               -        0     0
            ▾ left                   emergency      -  4.1%   11M  3.0k     0       0      55us/1.2ms      12us/340us        0     0
              ▾ arm                  1/1        4m08s  1.7%  5.0M  1.5k     0       0      55us/1.2ms      12us/340us        0     0
                gripper              running    4m08s  1.7%  5.0M  1.5k     0       0      55us/1.2ms      12us/340us        0     0
              eye                    emergency  9m18s  2.4%  6.0M  1.5k     0       0      55us/1.2ms      12us/340us        0     0
            ▾ right                  1/1       16m32s  3.1%  7.0M  1.5k     0       0      55us/1.2ms      12us/340us        1    12
              eye                    running   16m32s  3.1%  7.0M  1.5k     0       0      55us/1.2ms      12us/340us        1    12
            monitor                  failed         -     -     -     -     -       -               -               -        1     0
            ── events ──────────────────────────────────────────────────────────────────────────────────────────────────────────────
            13:56:01 network patrol is up
            13:56:02 monitor: ended: signal 11 (SIGSEGV); the last lines of /robot/log:
                         reading map
                         no map
            13:56:03 left.eye: says that it cannot do its work












            r restart  x stop  s start  e emergency  enter log  p parameters  c connections  ? help  q stop the network
        "#]],
    );
}

#[test]
fn active_states_are_seen_from_72_columns_on() {
    let mut model = model(Host::Top);
    for (width, is_seen) in [(71, false), (72, true), (88, true), (100, true)] {
        let screen = screen(&mut model, width, 12);
        assert_eq!(screen.contains("avoider  cruising"), is_seen, "{screen}");
    }
}

#[test]
fn a_medium_terminal_shows_the_most_important_columns() {
    shows(
        &mut model(Host::Top),
        80,
        24,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed                                8.5% 25M
            COMPONENT               STATE       CPU   MEM  IN/s OUT/s CALLS/s RESTARTS  LOST
            simulator               running    0.3%  3.0M     0  1.5k      20        0     0
            avoider  cruising char… running    1.0%  4.0M     0     0      20        0     0
            ▾ left                  emergency  4.1%   11M  3.0k     0       0        0     0
              ▾ arm                 1/1        1.7%  5.0M  1.5k     0       0        0     0
                gripper             running    1.7%  5.0M  1.5k     0       0        0     0
              eye                   emergency  2.4%  6.0M  1.5k     0       0        0     0
            ▾ right                 1/1        3.1%  7.0M  1.5k     0       0        1    12
              eye                   running    3.1%  7.0M  1.5k     0       0        1    12
            monitor                 failed        -     -     -     -       -        1     0
            ── events ──────────────────────────────────────────────────────────────────────
            13:56:01 network patrol is up
            13:56:02 monitor: ended: signal 11 (SIGSEGV); the last lines of /robot/log:
                         reading map
                         no map
            13:56:03 left.eye: says that it cannot do its work






            r restart  x stop  s start  e emergency  enter log  ? help  q leave
        "#]],
    );
}

#[test]
fn a_small_terminal_shows_names_and_states() {
    shows(
        &mut model(Host::Up),
        40,
        10,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed
            COMPONENT          STATE       CPU   MEM
            simulator          running    0.3%  3.0M
            avoider  cruising… running    1.0%  4.0M
            ▾ left             emergency  4.1%   11M
              ▾ arm            1/1        1.7%  5.0M
                gripper        running    1.7%  5.0M
            ── events ──────────────────────────────
            13:56:03 left.eye: says that it cannot d
            r restart  ? help  q stop the network
        "#]],
    );
}

#[test]
fn every_size_is_drawn_without_a_panic() {
    for page in [
        Page::Table,
        Page::Log,
        Page::Parameters,
        Page::Connections,
        Page::Help,
    ] {
        for (width, height) in [(1, 1), (2, 2), (5, 3), (300, 1), (1, 60), (13, 7)] {
            let mut model = model(Host::Up);
            model.page = page;
            keys(&mut model, "r");
            let shown = screen(&mut model, width, height);
            assert_eq!(shown.lines().count(), usize::from(height));
        }
    }
}

#[test]
fn without_colours_no_colour_is_printed() {
    let colours = |wanted| {
        let mut model = model(Host::Up);
        model.colours = wanted;
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("a terminal");
        let drawn = terminal.draw(|frame| render::draw(&model, frame.area(), frame.buffer_mut()));
        drawn.expect("drawn");
        let cells = &terminal.backend().buffer().content;
        cells
            .iter()
            .filter(|cell| cell.fg != Color::Reset || cell.bg != Color::Reset)
            .count()
    };
    assert_eq!(colours(false), 0);
    assert!(colours(true) > 0);
}

#[test]
fn connections_show_their_peers() {
    let mut model = model(Host::Up);
    keys(&mut model, "c");
    shows(
        &mut model,
        80,
        12,
        &expect![[r#"
            patrol  4 running  1 emergency  1 failed                                8.5% 25M
            simulator  running  up 0s  cpu 0.3%  mem 3.0M  pid 100
            iceoryx2  restarts 0  lost 0  period 50ms  compute 55us/1.2ms  overruns 2  error
             log   parameters   connections
            laser  implements  1 peer  20/s  12us/340us  0 errors
              ← avoider.laser  over iceoryx2 (15), local (5), Laser
            pose  publishes  1 peer  1.5k/s
              → left.arm.gripper.pose, left.eye.pose, right.eye.pose  over iceoryx2, Laser



            tab log  r restart  x stop  s start  e emergency  esc back  q stop the network
        "#]],
    );
}

#[test]
fn the_help_fits_a_medium_terminal() {
    let mut model = model(Host::Top);
    keys(&mut model, "?");
    shows(
        &mut model,
        80,
        24,
        &expect![[r#"
        patrol  4 running  1 emergency  1 failed                                8.5% 25M
        up down       another component
        enter         its log; folds and unfolds a group
        l p c         its log, parameters, connections
        tab           the next of these pages
        esc           back to all components
        left right    folds, unfolds
        page up/down  scrolls events, log, lists
        home end      the first, the last
        r             restarts the component or the group
        x             stops it
        s             starts it
        e             emergency, at once; again to leave it
        E             emergency of all components, at once
        enter, w      parameters: changes one, saves all
        ctrl+l        redraws the screen
        q, ctrl+c     leaves; the network goes on






        esc back  q leave
    "#]],
    );
    press(&mut model, Key::Esc);
    assert_eq!(model.page, Page::Table);
}

#[test]
fn components_that_were_started_by_hand_are_marked() {
    let mut model = model(Host::Top);
    let mut by_hand = status().components.remove(0);
    by_hand.name = "joystick".to_owned();
    by_hand.by_hand = true;
    by_hand.log = std::path::PathBuf::new();
    model.by_hand(by_hand);
    // The supervisor, which does not know it, changes nothing.
    model.status(status());
    let shown = screen(&mut model, 80, 24);
    let row = shown.lines().find(|line| line.contains("joystick"));
    assert!(
        row.is_some_and(|row| row.starts_with("joystick ") && row.contains(" by hand ")),
        "{shown}"
    );
    press(&mut model, Key::End);
    keys(&mut model, "l");
    let shown = screen(&mut model, 80, 24);
    assert!(shown.contains("pid 100  by hand"), "{shown}");
    assert!(
        shown.contains("It prints to a terminal or a pipe"),
        "{shown}"
    );
    model.remove("joystick");
    assert!(!screen(&mut model, 80, 24).contains("joystick"));
}

#[test]
fn what_is_allowed_for_a_parameter_is_never_cut() {
    let mut model = model(Host::Top);
    keys(&mut model, "p");
    let selected = model.selected.clone();
    model.parameters(&selected, Ok(parameters()));
    for width in [24, 30, 40, 80] {
        let shown = screen(&mut model, width, 24);
        let words: Vec<&str> = shown.split_whitespace().collect();
        let allowed = ["float,", "from", "0", "to", "1500,", "in", "mm/s;"];
        assert!(
            words.windows(allowed.len()).any(|words| words == allowed),
            "{shown}"
        );
    }
}

/// A network with two chains, one of them late; each line has the colour of its state.
#[test]
fn chains_are_lines_between_components_and_events() {
    let mut model = model(Host::Top);
    model.colours = true;
    let times = |p50: f64| json!({"p50_ms": p50, "p99_ms": 2.0 * p50, "worst_ms": 3.0 * p50});
    let chain = |name: &str, within: f64, conditions: Value| {
        json!({
            "name": name, "from": "simulator.pose.newPose", "to": "monitor.pose.newPose", "within_ms": within,
            "begun": 9, "complete": 9, "late": 1, "old": 0, "coverage": 1.0, "uncertainty_ms": 0.0,
            "times": times(27.1), "conditions": conditions,
            "hops": [
                {"component": "avoider", "receives": "pose.newPose", "times": times(26.5), "lost": 0, "replaced": 0,
                 "ended": 0, "swapped": 0, "restarts": 0},
                {"component": "monitor", "receives": "pose.newPose", "times": times(0.6), "lost": 0, "replaced": 0,
                 "ended": 0, "swapped": 0, "restarts": 0},
            ],
        })
    };
    let chains = json!([
        chain("calm", 80.0, json!([])),
        chain("brake", 50.0, json!(["chain-late"]))
    ]);
    model.chains = serde_json::from_value(chains).expect("chains");
    let shown = screen(&mut model, 100, 24);
    let lines: Vec<&str> = shown.lines().collect();
    let title = lines
        .iter()
        .position(|line| line.starts_with("── chains ─"));
    let title = title.expect("the chains");
    expect![[r#"
        calm   simulator ━ avoider 26.5 ━ monitor 0.6  27.1 ms, p99 54.2, worst 81.3 of 80
        brake  simulator ━ avoider 26.5 ━ monitor 0.6  27.1 ms, p99 54.2, worst 81.3 of 50, chain-late"#]]
    .assert_eq(&lines[title + 1..title + 3].join("\n"));
    assert!(lines[title + 3].starts_with("── events ─"), "{shown}");
    let mut terminal = Terminal::new(TestBackend::new(100, 24)).expect("a terminal");
    let drawn = terminal.draw(|frame| render::draw(&model, frame.area(), frame.buffer_mut()));
    drawn.expect("drawn");
    let colour = |line: usize| terminal.backend().buffer()[(10, line as u16)].fg;
    assert_eq!(
        [title + 1, title + 2].map(colour),
        [Color::Green, Color::Red]
    );
    // Without room for both, the late one is shown.
    let shown = screen(&mut model, 100, 20);
    assert!(shown.contains("── chains, 1 more ─"), "{shown}");
    assert!(
        shown.contains("brake ") && !shown.contains("calm "),
        "{shown}"
    );
}
