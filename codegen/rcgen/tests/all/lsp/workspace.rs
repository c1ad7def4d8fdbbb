//! A workspace with one file of each kind, and a session in it.

use super::Editor;
use serde_json::{Value, json};
use std::path::Path;

const FILES: [(&str, &str); 10] = [
    (
        "Units.idsl",
        "module Units\n{\n    enum Side { left, right };\n    struct Force\n    {\n        float newton;\n        Side side = left;\n    };\n    exception TooStrong { string why; };\n};\n",
    ),
    (
        "Grip.idsl",
        "import \"Units.idsl\";\n\nmodule Grip\n{\n    sequence<Units::Force> Forces;\n    interface Grip\n    {\n        Forces press(Units::Force force) throws Units::TooStrong;\n        void open();\n    };\n};\n",
    ),
    (
        "hand.cdsl",
        "import \"Grip.idsl\";\n\nComponent hand\n{\n    Communications\n    {\n        implements Grip { available ready; };\n    };\n    language rust;\n    statemachine \"hand.smdsl\";\n    parameters \"hand.pdsl\";\n};\n",
    ),
    (
        "hand.smdsl",
        "hand\n{\n    initial_state ready;\n    states busy;\n    transitions\n    {\n        ready => busy;\n        busy => ready;\n    };\n};\n",
    ),
    (
        "common.pdsl",
        "ComponentParams common\n{\n    fingers int 3 1:9;\n    mode string \"fast\" {fast, slow};\n    /// Whether it speaks.\n    loud bool true T;\n};\n",
    ),
    (
        "hand.pdsl",
        "import \"common.pdsl\";\n\nComponentParams hand\n{\n    group motor\n    {\n        speed float 1.0 0:2 unit \"m/s\";\n        limit float 2.0;\n        require speed <= limit \"too fast\";\n    };\n};\n",
    ),
    (
        "etc/config.toml",
        "[bindings]\nGrip = \"a/b\"\n\n[parameters]\nfingers = 4\n\n[parameters.motor]\nspeed = 0.5\n",
    ),
    (
        "brain/brain.cdsl",
        "import \"Grip.idsl\";\n\nComponent brain\n{\n    Communications\n    {\n        requires Grip[] as hands, Grip as spare optional;\n    };\n    language rust;\n};\n",
    ),
    (
        "inner.ddsl",
        "Deployment inner\n{\n    Group arm\n    {\n        Component hand { cdsl \"hand.cdsl\"; };\n        export Grip;\n    };\n};\n",
    ),
    (
        "net.ddsl",
        "import \"inner.ddsl\";\n\nDeployment net\n{\n    Host robot { address \"127.0.0.1\"; };\n    Process eyes { Component other { cdsl \"hand.cdsl\"; }; };\n    Component brain\n    {\n        cdsl \"brain/brain.cdsl\";\n        host robot;\n        after arm, other;\n        process head;\n        slots { hands \"left\"; };\n    };\n    Component third { cdsl \"hand.cdsl\"; parameters { motor.speed 0.2; fingers 2; }; };\n    bind brain.hands.left -> arm.Grip;\n    bind brain.spare -> third.Grip;\n};\n",
    ),
];

const WORKER: &str = "use hand_generated::{Context, Grip, StateMachine, Worker};\n\npub struct SpecificWorker;\n\nimpl Grip<Context> for SpecificWorker {\n    fn press(&mut self) {}\n    fn open(&mut self) {}\n}\n\nimpl StateMachine for SpecificWorker {\n    fn during_busy(&mut self) {}\n}\n\nfn far(parameters: &Parameters) -> f32 {\n    parameters.motor.speed\n}\n";

/// A session in the workspace, with all of its files open.
pub(super) struct Session {
    pub(super) editor: Editor,
    /// The requests, with the answers.
    pub(super) log: String,
    _folder: tempfile::TempDir,
}

impl Session {
    pub(super) fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |file: &str| folder.path().join(file);
        for inner in ["etc", "brain", "src"] {
            std::fs::create_dir(path(inner)).expect("a folder");
        }
        std::fs::write(path("Cargo.toml"), "[workspace]\n").expect("a file");
        std::fs::create_dir(path("interfaces")).expect("a folder");
        for (file, text) in FILES {
            std::fs::write(path(file), text).expect("a file");
        }

        for file in ["Grip.idsl", "Units.idsl"] {
            std::fs::rename(path(file), path("interfaces").join(file)).expect("a file");
        }
        std::fs::write(path("src/specific_worker.rs"), WORKER).expect("a file");
        let mut editor = Editor::open_folder(folder.path());
        for file in files() {
            let text = std::fs::read_to_string(path(&file)).expect("a file");
            editor.open(&file, &text);
        }
        Self {
            editor,
            log: String::new(),
            _folder: folder,
        }
    }

    pub(super) fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.editor.folder.join(file)).expect("a file")
    }

    /// Asks about the place behind `before`, and notes the answer as lines `file:line:column text`.
    pub(super) fn asks(&mut self, request: &str, file: &str, before: &str) {
        let text = self.text(file);
        let at = text.find(before).expect("a place") + before.len();
        let start = text[..at].rfind('\n').map_or(0, |feed| feed + 1);
        let line = text[..at].matches('\n').count();
        let parameters = json!({
            "textDocument": { "uri": self.editor.uri(file) },
            "position": { "line": line, "character": at - start },
            "context": { "includeDeclaration": true },
        });
        let answer = self
            .editor
            .ask(&format!("textDocument/{request}"), &parameters);
        let shown = self.shown(&answer);
        let before = before.trim_start();
        self.log
            .push_str(&format!("{request} {file} {before}▮\n{shown}\n"));
    }

    fn shown(&self, answer: &Value) -> String {
        let mut out = String::new();
        let hover = answer["contents"]["value"].as_str();
        let root = super::uri(&self.editor.folder);
        for line in hover.into_iter().flat_map(str::lines) {
            let line = line.replace(&root, "ROOT");
            out.push_str(format!("    {line}").trim_end());
            out.push('\n');
        }
        for location in answer.as_array().into_iter().flatten() {
            let root = super::uri(&self.editor.folder);
            let uri = location["uri"].as_str().expect("an address");
            let file = uri
                .strip_prefix(&format!("{root}/"))
                .expect("a file inside");
            let text = self.text(file);
            let (start, end) = (&location["range"]["start"], &location["range"]["end"]);
            let number = |value: &Value| value.as_u64().expect("a number") as usize;
            let (line, from) = (number(&start["line"]), number(&start["character"]));
            let lines: Vec<&str> = text.lines().collect();
            let named = &lines[line][from..number(&end["character"])];
            out.push_str(&format!("    {file}:{}:{} {named}\n", line + 1, from + 1));
        }
        out
    }
}

/// The files of the workspace.
pub(super) fn files() -> Vec<String> {
    let at = |(file, _): &(&str, &str)| match Path::new(file).extension() {
        Some(ending) if ending == "idsl" => format!("interfaces/{file}"),
        _ => (*file).to_owned(),
    };
    let mut all: Vec<String> = FILES.iter().map(at).collect();
    all.push("src/specific_worker.rs".to_owned());
    all
}
