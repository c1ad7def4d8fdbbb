//! Hovers in a workspace with one file of each kind.

use super::workspace::Session;
use expect_test::expect_file;

#[test]
fn a_name_says_what_it_is() {
    let mut session = Session::new();
    for (file, before) in [
        ("interfaces/Grip.idsl", "throws Units::Too"),
        ("interfaces/Grip.idsl", "press(Units::Fo"),
        ("interfaces/Grip.idsl", "        For"),
        ("interfaces/Units.idsl", "        Si"),
        ("interfaces/Grip.idsl", "void op"),
        ("hand.cdsl", "implements Gr"),
        ("brain/brain.cdsl", "as ha"),
        ("brain/brain.cdsl", "as sp"),
        ("net.ddsl", "bind brain.spa"),
        ("net.ddsl", "-> arm.Gr"),
        ("net.ddsl", "after ar"),
        ("net.ddsl", "motor.spe"),
        ("etc/config.toml", "fing"),
        ("hand.smdsl", "=> bu"),
        ("net.ddsl", "{\n  "),
    ] {
        session.asks("hover", file, before);
    }
    session.editor.end();
    expect_file!["hover/names.txt"].assert_eq(&session.log);
}
