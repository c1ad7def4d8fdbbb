//! Findings of networks about their components.

use super::Editor;
use super::workspace::Session;

/// A port that no component has is told before anything is saved, as `rcdeploy check` tells it.
#[test]
fn a_wrong_connection_is_told_while_it_is_typed() {
    let mut session = Session::new();
    let right = session.text("net.ddsl");
    let line = |text: &str| {
        let at = right.lines().position(|line| line.contains(text));
        at.expect("a line") as u64
    };
    let bind = line("bind brain.spare");
    let wrong = right.replace("brain.spare ->", "brain.spar ->");
    session.editor.change("net.ddsl", &wrong);
    let found = session.editor.wait_for(
        "net.ddsl",
        &[
            ("several-providers", line("Component brain")),
            ("unknown-slot", bind),
        ],
    );
    let message = found[1]["message"].as_str().expect("a text");
    assert!(message.contains("did you mean `spare`?"), "{message}");
    session.editor.change("net.ddsl", &right);
    session.editor.wait_for("net.ddsl", &[]);
    // Another interface of a component is noticed in the network, which is not touched.
    let brain = session.text("brain/brain.cdsl");
    let renamed = brain.replace("Grip as spare", "Grip as other");
    session.editor.change("brain/brain.cdsl", &renamed);
    session.editor.wait_for(
        "net.ddsl",
        &[
            ("several-providers", line("Component brain")),
            ("unknown-slot", bind),
        ],
    );
    session.editor.change("brain/brain.cdsl", &brain);
    session.editor.wait_for("net.ddsl", &[]);
    session.editor.end();
}

/// A network that is a part of another one may lack peers, which the other one has.
#[test]
fn a_part_of_a_network_needs_no_peers_of_its_own() {
    let mut session = Session::new();
    let text = "import \"Grip.idsl\";\n\nComponent asker\n{\n    Communications\n    {\n        requires Grip;\n    };\n    language rust;\n};\n";
    session.editor.open("asker.cdsl", text);
    let part = "Deployment part\n{\n    Component asker { cdsl \"asker.cdsl\"; };\n};\n";
    session.editor.open("part.ddsl", part);
    session.editor.wait_for("part.ddsl", &[("no-provider", 2)]);
    let whole = "import \"part.ddsl\";\nDeployment whole\n{\n    Component hand { cdsl \"hand.cdsl\"; };\n};\n";
    session.editor.open("whole.ddsl", whole);
    session.editor.wait_for("part.ddsl", &[]);
    let alone = whole.replace("import \"part.ddsl\";", "");
    session.editor.change("whole.ddsl", &alone);
    session.editor.wait_for("part.ddsl", &[("no-provider", 2)]);
    session.editor.end();
}

#[test]
fn a_slot_of_a_group_is_that_of_the_component_that_provides_it() {
    let mut session = Session::new();
    // The first component with a slot of this name requires the interface.
    let inner = session.text("inner.ddsl").replace(
        "        Component hand",
        "        Component asker { cdsl \"asker.cdsl\"; };\n        Component hand",
    );
    let asker = "import \"Grip.idsl\";\n\nComponent asker\n{\n    Communications\n    {\n        requires Grip;\n    };\n    language rust;\n};\n";
    session.editor.open("asker.cdsl", asker);
    session.editor.change("inner.ddsl", &inner);
    session.asks("definition", "net.ddsl", "-> arm.Gr");
    session.editor.end();
    assert_eq!(
        session.log,
        "definition net.ddsl -> arm.Gr▮\n    hand.cdsl:7:20 Grip\n\n"
    );
}

/// A path names each of its steps with all earlier ones: memory does not grow with the square of its length.
#[test]
fn a_path_without_end_takes_bounded_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    let path = vec!["a"; 20_000].join(".");
    let text = format!("ComponentParams p\n{{\n    a int 1;\n    require {path} < 2 \"m\";\n}};\n");
    editor.open("p.pdsl", &text);
    editor.wait_for("p.pdsl", &[("unknown-parameter", 3)]);
    let status = std::fs::read_to_string(format!("/proc/{}/status", editor.server.id()));
    let status = status.expect("the state of a process");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.expect("memory").trim().trim_end_matches(" kB");
    let peak: u64 = peak.parse().expect("a number");
    editor.end();
    // Without a bound, the names alone have 400 MB.
    assert!(peak < 200_000, "{peak} kB");
}
