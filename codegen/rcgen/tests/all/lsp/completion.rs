//! Suggestions in a workspace with one file of each kind, most of them in broken texts.

use super::workspace::Session;
use expect_test::expect_file;
use serde_json::{Value, json};

/// The cursor in a text.
const CURSOR: char = '▮';

/// How many suggestions of an answer are shown.
const SHOWN: usize = 14;

impl Session {
    /// Types `new` with the cursor in place of `old`, asks what may stand there, and takes the text back.
    fn completes(&mut self, file: &str, old: &str, new: &str) {
        let text = self.text(file);
        assert!(text.contains(old), "{old}");
        let typed = text.replacen(old, new, 1);
        let at = typed.find(CURSOR).expect("a cursor");
        let start = typed[..at].rfind('\n').map_or(0, |feed| feed + 1);
        self.editor.change(file, &typed.replace(CURSOR, ""));
        let parameters = json!({
            "textDocument": { "uri": self.editor.uri(file) },
            "position": { "line": typed[..at].matches('\n').count(), "character": at - start },
        });
        let answer = self.editor.ask("textDocument/completion", &parameters);
        let shown = new.split_whitespace().collect::<Vec<_>>().join(" ");
        self.log.push_str(&format!("{file} {shown}\n"));
        let all = answer.as_array().cloned().unwrap_or_default();
        for item in all.iter().take(SHOWN) {
            self.log.push_str(&format!("    {}\n", line(item)));
        }
        if all.len() > SHOWN {
            self.log
                .push_str(&format!("    and {} more\n", all.len() - SHOWN));
        }
        self.log.push('\n');
        self.editor.change(file, &text);
    }
}

/// A suggestion in one line.
fn line(item: &Value) -> String {
    let text = |value: &Value| value.as_str().unwrap_or_default().replace('\n', " ");
    let mut out = text(&item["label"]);
    for (before, value) in [
        (" | ", &item["detail"]),
        (" | ", &item["documentation"]["value"]),
        (" + ", &item["additionalTextEdits"][0]["newText"]),
    ] {
        if !text(value).is_empty() {
            out.push_str(&format!("{before}{}", text(value)));
        }
    }
    assert_eq!(item["textEdit"]["newText"], item["label"]);
    out.trim_end().to_owned()
}

#[test]
fn what_may_stand_at_a_cursor_is_suggested_in_broken_texts() {
    let mut session = Session::new();
    for (file, old, new) in [
        ("interfaces/Units.idsl", "module Units", "▮ module Units"),
        ("interfaces/Units.idsl", "    enum", "    ▮\n    enum"),
        (
            "interfaces/Units.idsl",
            "float newton;",
            "float newton; Si▮",
        ),
        (
            "interfaces/Grip.idsl",
            "press(Units::Force",
            "press(Units::▮",
        ),
        (
            "interfaces/Grip.idsl",
            "press(Units::Force force)",
            "press(▮",
        ),
        ("interfaces/Grip.idsl", "throws Units::TooStrong;", "thr▮"),
        ("interfaces/Grip.idsl", "press(", "press(@unit(\"▮\") "),
        (
            "interfaces/Grip.idsl",
            "import \"Units.idsl\"",
            "import \"▮\"",
        ),
        ("hand.cdsl", "    language", "    ▮ language"),
        ("hand.cdsl", "implements Grip { available ready; };", "▮ };"),
        (
            "hand.cdsl",
            "implements Grip { available ready; };",
            "requires ▮",
        ),
        ("hand.cdsl", "available ready;", "available ▮"),
        ("hand.cdsl", "available ready; };", "▮ };"),
        (
            "hand.cdsl",
            "implements Grip { available ready; };",
            "publishes Grip { reliability ▮ };",
        ),
        (
            "hand.cdsl",
            "implements Grip { available ready; };",
            "requires Grip ▮",
        ),
        (
            "hand.cdsl",
            "implements Grip { available ready; };",
            "requires Grip(▮",
        ),
        ("hand.cdsl", "language rust", "language ▮"),
        ("hand.cdsl", "\"hand.pdsl\"", "\"▮\""),
        ("brain/brain.cdsl", "import \"Grip.idsl\";\n\n", "▮"),
        ("hand.smdsl", "ready => busy", "ready => ▮"),
        ("hand.smdsl", "    states", "    ▮\n    states"),
        ("hand.pdsl", "limit float 2.0;", "limit ▮"),
        ("hand.pdsl", "limit float 2.0;", "limit float 2.0 ▮"),
        ("hand.pdsl", "limit float 2.0;", "limit float 2.0 unit \"▮"),
        ("hand.pdsl", "require speed", "require ▮"),
        ("etc/config.toml", "[parameters]", "[▮"),
        ("etc/config.toml", "fingers = 4", "fin▮"),
        ("etc/config.toml", "fingers = 4", "mode = ▮"),
        ("etc/config.toml", "fingers = 4", "loud = ▮"),
        ("etc/config.toml", "fingers = 4", "mode = \"▮\""),
        ("etc/config.toml", "fingers = 4", "mode = \"fast\" # ▮"),
        ("etc/config.toml", "[parameters]", "[parameters] # ▮"),
        ("etc/config.toml", "speed = 0.5", "▮"),
        ("etc/config.toml", "Grip = \"a/b\"", "▮"),
        (
            "etc/config.toml",
            "[bindings]",
            "[component]\n▮\n[bindings]",
        ),
        (
            "etc/config.toml",
            "[bindings]",
            "[middleware.dds]\n▮\n[bindings]",
        ),
        ("net.ddsl", "    Host", "    ▮ Host"),
        ("net.ddsl", "host robot;", "▮"),
        ("net.ddsl", "host robot;", "host ▮"),
        ("net.ddsl", "after arm, other;", "after ▮"),
        ("net.ddsl", "\"brain/brain.cdsl\"", "\"▮\""),
        ("net.ddsl", "hands \"left\";", "▮"),
        ("net.ddsl", "motor.speed 0.2;", "▮"),
        ("net.ddsl", "host robot;", "restart ▮"),
        ("net.ddsl", "host robot;", "middleware dds { ▮"),
        ("net.ddsl", "bind brain.hands.left -> arm.Grip;", "bind ▮"),
        (
            "net.ddsl",
            "bind brain.hands.left -> arm.Grip;",
            "bind brain.▮",
        ),
        (
            "net.ddsl",
            "bind brain.hands.left -> arm.Grip;",
            "bind brain.hands.▮",
        ),
        ("net.ddsl", "-> arm.Grip;", "-> arm.▮"),
        (
            "net.ddsl",
            "bind brain.spare -> third.Grip;",
            "bind brain.spare -> third.Grip { convert { frames ▮; }; };",
        ),
        (
            "hand.cdsl",
            "language",
            "world \"home.gdsl\" as g { writes door.pose ▮ };\n    language",
        ),
        ("hand.cdsl", "language", "world ▮ as g;\n    language"),
        (
            "net.ddsl",
            "    Host",
            "    require arm.speed < third.▮\n    Host",
        ),
        (
            "net.ddsl",
            "bind brain.spare -> third.Grip;",
            "bind brain.spare -> third.Grip { convert ▮; };",
        ),
        (
            "net.ddsl",
            "bind brain.spare -> third.Grip;",
            "bind brain.spare -> third.Grip { convert via ▮; };",
        ),
        ("inner.ddsl", "export Grip;", "export ▮"),
        // No completion in a comment, and none in a string without a meaning.
        ("net.ddsl", "    Host", "    // bind ▮\n    Host"),
    ] {
        session.completes(file, old, new);
    }
    session.editor.end();
    expect_file!["completion/suggestions.txt"].assert_eq(&session.log);
}

#[test]
fn an_interface_brings_its_import_along() {
    let mut session = Session::new();
    let file = "brain/brain.cdsl";
    let text =
        "// The brain.\nComponent brain\n{\n    Communications\n    {\n        requires Gr▮\n";
    // The names of the whole text are known, which imports `Grip`.
    session.editor.ask(
        "textDocument/documentSymbol",
        &json!({ "textDocument": { "uri": session.editor.uri(file) } }),
    );
    session.editor.change(file, &text.replace(CURSOR, ""));
    let answer = session.editor.ask(
        "textDocument/completion",
        &json!({
            "textDocument": { "uri": session.editor.uri(file) },
            "position": { "line": 5, "character": 19 },
        }),
    );
    let all = answer.as_array().expect("suggestions");
    let grip = all.iter().find(|item| item["label"] == "Grip");
    let grip = grip.unwrap_or_else(|| panic!("{answer}"));
    let edit = &grip["additionalTextEdits"][0];
    assert_eq!(edit["newText"], "import \"Grip.idsl\";\n\n");
    // Before the comment, which is about the component.
    assert_eq!(edit["range"]["start"], json!({ "line": 0, "character": 0 }));
    let word = &grip["textEdit"]["range"];
    assert_eq!(word["start"], json!({ "line": 5, "character": 17 }));
    assert_eq!(word["end"], json!({ "line": 5, "character": 19 }));
    session.editor.end();
}

#[test]
fn schemas_prototypes_and_solvers_are_completed() {
    let mut session = Session::new();
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let urdf = std::fs::read_to_string(format!("{root}/kinematics/examples/arm.urdf"));
    let files = [
        ("arm.urdf", urdf.expect("a file")),
        ("home.gdsl", "import \"at.dproto\";\n\nDomain home\n{\n    entity Room { name string; };\n    relation within { inner Room; };\n};\n".to_owned()),
        ("at.dproto", "import \"cartesian.dproto\";\n\naxes room :: right, ahead, up\n\ndproto at :: geometry\n{\n    semantic = Position\n    coord = cartesian\n}\n".to_owned()),
        ("arm.kdsl", "import \"arm.urdf\";\n\nKinematics arm\n{\n    posture home { };\n    solver fk { pose wrist in base; };\n};\n".to_owned()),
        ("fk.ilk", "return {\n    joints = { turn = { kind = 'revolute', coordinate = 0 } },\n    poses = { joint = { a__b = { joint = 'turn', dir = 'a_x_b' } } },\n    ops = {},\n}\n".to_owned()),
    ];
    for (file, text) in &files {
        std::fs::write(session.editor.folder.join(file), text).expect("a file");
        session.editor.open(file, text);
    }
    for (file, old, new) in [
        ("home.gdsl", "    entity Room", "    ▮ entity Room"),
        ("home.gdsl", "name string;", "▮"),
        ("home.gdsl", "name string;", "name ▮"),
        ("home.gdsl", "name string;", "name string ▮"),
        ("home.gdsl", "name string;", "width float unit \"▮"),
        ("home.gdsl", "name string;", "place dproto ▮"),
        ("home.gdsl", "inner Room;", "tree of ▮"),
        ("home.gdsl", "\"at.dproto\"", "\"▮\""),
        ("at.dproto", "axes room", "▮ axes room"),
        ("at.dproto", "dproto at ::", "dproto at :: ▮"),
        ("at.dproto", "coord = cartesian", "▮"),
        ("at.dproto", "coord = cartesian", "coord = ▮"),
        ("at.dproto", "coord = cartesian", "axes = ▮"),
        ("arm.kdsl", "    posture", "    ▮ posture"),
        ("arm.kdsl", "home { }", "home { ▮ }"),
        ("arm.kdsl", "pose wrist in base;", "▮"),
        ("arm.kdsl", "pose wrist in base;", "pose ▮"),
        ("arm.kdsl", "pose wrist in base;", "pose wrist in ▮"),
        ("arm.kdsl", "pose wrist in base;", "null posture ▮"),
        ("fk.ilk", "    ops", "    ▮"),
        ("fk.ilk", "ops = {}", "ops = { { op = '▮"),
        (
            "fk.ilk",
            "ops = {}",
            "ops = { { op = 'pose-compose', arg1 = 'a▮",
        ),
        ("fk.ilk", "joint = 'turn'", "joint = '▮'"),
    ] {
        session.completes(file, old, new);
    }
    session.editor.end();
    expect_file!["completion/data.txt"].assert_eq(&session.log);
}

#[test]
fn state_charts_trees_robots_and_graphs_are_completed() {
    let mut session = Session::new();
    let files = [
        (
            "rover.scxml",
            "<scxml version=\"1.0\" initial=\"idle\">\n  <state id=\"idle\">\n    <transition event=\"go\" target=\"driving\"/>\n  </state>\n  <state id=\"driving\">\n    <onexit><raise event=\"stopped\"/></onexit>\n  </state>\n</scxml>\n",
        ),
        (
            "world.xml",
            "<innerModel>\n  <transform id=\"world\">\n    <joint id=\"neck\" axis=\"z\"><!-- <camera --></joint>\n    <mesh id=\"cup\" file=\"cup.obj\"/>\n  </transform>\n</innerModel>\n",
        ),
        (
            "arm.urdf",
            "<robot name=\"arm\">\n  <link name=\"base\"><visual><geometry><box size=\"1 1 1\"/></geometry></visual></link>\n  <link name=\"hand\"/>\n  <joint name=\"wrist\" type=\"fixed\">\n    <parent link=\"base\"/>\n    <child link=\"hand\"/>\n  </joint>\n</robot>\n",
        ),
        (
            "home.gdsl",
            "Domain home\n{\n    /// A place for people.\n    entity Room { name string; floor int 0:9; light { on, off } optional; };\n    entity Cup { mass float unit \"kg\"; full bool; };\n    relation within { inner Cup; outer Room; };\n};\n",
        ),
        (
            "home.graph",
            "{\n  \"schema\": \"home.gdsl\",\n  \"nodes\": [\n    {\"id\": \"1:1\", \"type\": \"Room\", \"attributes\": {\"name\": \"hall\", \"floor\": 0}},\n    {\"id\": \"1:2\", \"type\": \"Cup\", \"attributes\": {\"mass\": 0.2, \"full\": true}}\n  ],\n  \"edges\": [\n    {\"id\": \"1:3\", \"type\": \"within\", \"from\": \"1:2\", \"to\": \"1:1\"}\n  ]\n}\n",
        ),
    ];
    std::fs::write(session.editor.folder.join("cup.obj"), "").expect("a file");
    for (file, text) in files {
        std::fs::write(session.editor.folder.join(file), text).expect("a file");
        session.editor.open(file, text);
    }
    for (file, old, new) in [
        (
            "rover.scxml",
            "<state id=\"driving\">",
            "<▮\n  <state id=\"driving\">",
        ),
        ("rover.scxml", "<transition ", "<tr▮ "),
        ("rover.scxml", "event=\"go\" ", "▮ "),
        ("rover.scxml", "\"driving\"/>", "\"▮\"/>"),
        ("rover.scxml", "\"driving\"/>", "\"idle dr▮"),
        ("rover.scxml", "\"stopped\"/>", "\"▮\"/>"),
        ("rover.scxml", "</state>\n  <state", "</▮"),
        ("rover.scxml", "</onexit>", "text ▮</onexit>"),
        ("world.xml", "<mesh", "<▮\n    <mesh"),
        ("world.xml", "<!-- <camera -->", "<camera ▮/>"),
        ("world.xml", "axis=\"z\"", "axis=\"▮\""),
        ("world.xml", "cup.obj", "▮"),
        ("world.xml", "id=\"cup\"", "allowed=\"neck ▮\""),
        ("world.xml", "<!-- <camera -->", "<!-- <▮ -->"),
        ("arm.urdf", "<link name=\"hand\"/>", "<▮"),
        ("arm.urdf", "<box size=\"1 1 1\"/>", "<▮"),
        ("arm.urdf", "<parent link=\"base\"/>", "<limit ▮/>"),
        ("arm.urdf", "fixed", "▮"),
        ("arm.urdf", "link=\"base\"/>", "link=\"▮\"/>"),
        ("home.graph", "  \"schema\"", "  ▮, \"schema\""),
        ("home.graph", "home.gdsl", "▮"),
        ("home.graph", "\"type\": \"Room\"", "▮, \"type\": \"Room\""),
        ("home.graph", "\"Room\"", "\"▮\""),
        ("home.graph", "\"Cup\"", "▮"),
        ("home.graph", ", \"floor\": 0", ", \"▮\""),
        ("home.graph", "\"floor\": 0", "\"light\": ▮"),
        ("home.graph", "\"full\": true", "\"full\": ▮"),
        (
            "home.graph",
            "\"mass\": 0.2",
            "\"mass\": {\"value\": 2, \"unit\": \"k▮\"}",
        ),
        ("home.graph", "\"within\"", "\"▮\""),
        ("home.graph", "\"from\": \"1:2\"", "\"from\": \"▮\""),
        ("home.graph", "\"1:1\"}\n", "\"▮"),
        ("home.graph", "0.2", "\"▮\""),
        // A schema does not import itself.
        ("home.gdsl", "Domain home", "import \"▮\"; Domain home"),
    ] {
        session.completes(file, old, new);
    }
    session.editor.end();
    expect_file!["completion/markup.txt"].assert_eq(&session.log);
}
