//! Definitions and references in a workspace with one file of each kind.

use super::workspace::Session;
use expect_test::expect_file;

#[test]
fn definitions_lead_to_the_file_that_declares_a_name() {
    let mut session = Session::new();
    for (file, before) in [
        ("interfaces/Grip.idsl", "import \"Un"),
        ("interfaces/Grip.idsl", "sequence<Units::Fo"),
        ("interfaces/Grip.idsl", "throws Un"),
        ("interfaces/Grip.idsl", "        For"),
        ("interfaces/Units.idsl", "side = le"),
        ("hand.cdsl", "implements Gr"),
        ("hand.cdsl", "available re"),
        ("hand.cdsl", "parameters \"ha"),
        ("hand.smdsl", "=> bu"),
        ("hand.pdsl", "import \"co"),
        ("hand.pdsl", "require sp"),
        ("etc/config.toml", "Gr"),
        ("etc/config.toml", "fin"),
        ("etc/config.toml", "\nspe"),
        ("net.ddsl", "import \"in"),
        ("net.ddsl", "cdsl \"br"),
        ("net.ddsl", "host ro"),
        ("net.ddsl", "after ar"),
        ("net.ddsl", "arm, ot"),
        ("net.ddsl", "process he"),
        ("net.ddsl", "slots { ha"),
        ("net.ddsl", "motor.sp"),
        ("net.ddsl", "; fing"),
        ("net.ddsl", "bind br"),
        ("net.ddsl", "bind brain.ha"),
        ("net.ddsl", "hands.le"),
        ("net.ddsl", "-> arm.Gr"),
        ("net.ddsl", "third.Gr"),
        ("inner.ddsl", "export Gr"),
        ("interfaces/Grip.idsl", "Forces pre"),
        ("hand.smdsl", "states bu"),
        ("src/specific_worker.rs", "fn pre"),
        ("src/specific_worker.rs", "impl Gr"),
        ("src/specific_worker.rs", "fn during_b"),
        ("net.ddsl", "{\n  "),
    ] {
        session.asks("definition", file, before);
    }
    session.asks("implementation", "hand.cdsl", "implements Gr");
    session.editor.end();
    expect_file!["navigation/definitions.txt"].assert_eq(&session.log);
}

#[test]
fn references_are_found_in_all_languages() {
    let mut session = Session::new();
    for (file, before) in [
        ("interfaces/Units.idsl", "struct Fo"),
        ("interfaces/Grip.idsl", "interface Gr"),
        ("interfaces/Grip.idsl", "void op"),
        ("hand.cdsl", "implements Gr"),
        ("brain/brain.cdsl", "as ha"),
        ("hand.cdsl", "Component ha"),
        ("hand.pdsl", "        spe"),
        ("common.pdsl", "    fin"),
        ("hand.smdsl", "initial_state re"),
        ("inner.ddsl", "Group ar"),
        ("net.ddsl", "Component br"),
        ("net.ddsl", "Host ro"),
        ("net.ddsl", "hands \"le"),
    ] {
        session.asks("references", file, before);
    }
    session.editor.end();
    expect_file!["navigation/references.txt"].assert_eq(&session.log);
}

#[test]
fn a_worker_in_python_has_its_functions_in_both_directions() {
    let mut session = Session::new();
    let folder = session.editor.folder.join("claw");
    std::fs::create_dir_all(folder.join("src")).expect("a folder");
    let cdsl = "import \"Grip.idsl\";\n\nComponent claw\n{\n    Communications\n    {\n        implements Grip;\n    };\n    language python;\n    statemachine \"../hand.smdsl\";\n};\n";
    std::fs::write(folder.join("claw.cdsl"), cdsl).expect("a file");
    let worker = "class SpecificWorker(Worker):\n    def grip_press(self, ctx: Context, force: Force) -> list[Force]:\n        return []\n\n    def grip_open(self, ctx: Context) -> None:\n        pass\n\n    def during_busy(self, ctx: Context) -> None:\n        pass\n";
    let file = "claw/src/specific_worker.py";
    std::fs::write(session.editor.folder.join(file), worker).expect("a file");
    session.editor.open("claw/claw.cdsl", cdsl);
    session.editor.open(file, worker);
    session.asks("implementation", "claw/claw.cdsl", "implements Gr");
    session.asks("implementation", "interfaces/Grip.idsl", "Forces pre");
    session.asks("implementation", "hand.smdsl", "states bu");
    session.asks("definition", file, "def grip_op");
    session.asks("definition", file, "def during_b");
    session.editor.end();
    expect_file!["navigation/python.txt"].assert_eq(&session.log);
}
