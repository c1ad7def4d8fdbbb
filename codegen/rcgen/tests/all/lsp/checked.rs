//! The editor reports the findings of `rcdeploy check` about a network.

use super::{Editor, GRIP, HAND};
use rc_codegen::FileLoader;
use rc_deploy_network::{Overrides, load};
use rc_diagnostics::SourceMap;
use std::path::Path;

const PARAMETERS: &str = "ComponentParams hand\n{\n    speed float 1.0 0:2;\n    limit float 2.0;\n    mode string \"fast\" {fast, slow};\n    map path \"\" reads \"file\";\n    require speed <= limit \"too fast\";\n};\n";
const WORLD: &str = "graph home\n{\n    node Door { is_open bool = false; };\n};\n";

/// The lines of `network.ddsl` with their codes and messages, as `rcdeploy check` has them.
fn told(path: &Path) -> Vec<(u64, String, String)> {
    let mut sources = SourceMap::new();
    let loader = FileLoader::new(&[]);
    let (_, found) = load(path, &Overrides::default(), &mut sources, &loader).expect("a file");
    let own = found
        .sorted()
        .into_iter()
        .filter(|one| sources.path(one.span.source) == path);
    let mut all: Vec<_> = own
        .map(|one| {
            let line = sources.position(one.span.source, one.span.start).line;
            let message = match &one.help {
                Some(help) => format!("{}\nhelp: {help}", one.message),
                None => one.message.clone(),
            };
            (line as u64 - 1, one.code.to_owned(), message)
        })
        .collect();
    all.sort_by_key(|(line, ..)| *line);
    all
}

#[test]
fn what_an_editor_says_of_a_network_is_what_rcdeploy_check_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    std::fs::create_dir(folder.path().join("etc")).expect("a folder");
    let hand = HAND.replace("rust;", "rust;\n    parameters \"hand.pdsl\";");
    for (name, text) in [
        ("Grip.idsl", GRIP),
        ("hand.cdsl", &hand),
        ("hand.pdsl", PARAMETERS),
        ("home.gdsl", WORLD),
        ("etc/config.toml", "[parameters]\nspeed = 0.5\n"),
        ("slow.toml", "[parameters]\nspeed = 7.0\n"),
        (
            "asker.cdsl",
            &HAND
                .replace("hand", "asker")
                .replace("implements", "requires"),
        ),
    ] {
        write(name, text);
    }
    let one = |more: &str| format!("    Component a {{ cdsl \"hand.cdsl\"; {more} }};\n");
    let cases: [(String, &[&str]); 12] = [
        (one(""), &[]),
        // Parameters: their names, their values, and the rules of the component.
        (one("parameters { sped 1; };"), &["unknown-parameter"]),
        (one("parameters { speed 9; };"), &["out-of-range"]),
        (one("parameters { mode \"idle\"; };"), &["invalid-choice"]),
        (one("parameters { speed 1.5; limit 1; };"), &["rule-broken"]),
        // Files.
        (one("parameters { map \"no.map\"; };"), &["bad-file"]),
        (one("config \"no.toml\";"), &["missing-configuration"]),
        // Rules between components.
        (
            one("") + "    require a.speed > 1 \"too slow\";\n",
            &["rule-broken"],
        ),
        // The world.
        (
            one("") + "    World g { schema \"no.gdsl\"; };\n",
            &["unused-world", "import-not-found"],
        ),
        // The time of the network, and an option without effect.
        (
            one("endpoint \"127.0.0.1:7000\";") + "    time simulated by a;\n",
            &["not-supported-yet", "not-a-time-source"],
        ),
        // An error of the text alone hides no other one.
        (
            one("host nowhere;")
                + "    Component b { cdsl \"asker.cdsl\"; config \"no.toml\"; };\n    Component c { cdsl \"no.cdsl\"; };\n",
            &[
                "unknown-host",
                "missing-configuration",
                "component-not-found",
            ],
        ),
        (one("parameters { limit 3.5; };"), &[]),
    ];
    let mut editor = Editor::open_folder(folder.path());
    let path = folder.path().join("network.ddsl");
    let text = |body: &str| format!("Deployment n\n{{\n{body}}};\n");
    editor.open("network.ddsl", &text(&one("")));
    for (body, codes) in &cases {
        write("network.ddsl", &text(body));
        let told = told(&path);
        let found: Vec<&str> = told.iter().map(|(_, code, _)| code.as_str()).collect();
        assert_eq!(found, *codes, "{told:#?}");
        editor.change("network.ddsl", &text(body));
        let wanted = told.iter().map(|(line, code, _)| (code.as_str(), *line));
        let shown = editor.wait_for("network.ddsl", &wanted.collect::<Vec<_>>());
        let shown = shown.as_array().expect("a list").iter();
        let shown = shown.map(|one| one["message"].as_str().unwrap_or_default());
        let messages = told.iter().map(|(.., message)| message.as_str());
        assert_eq!(shown.collect::<Vec<_>>(), messages.collect::<Vec<_>>());
    }
    // A configuration that is edited, and a file that a parameter names, change what is said of the network.
    let body = text(&one("config \"slow.toml\";"));
    editor.change("network.ddsl", &body);
    editor.wait_for("network.ddsl", &[]);
    editor.open("slow.toml", "[parameters]\nspeed = 7.0\n");
    editor.wait_for("slow.toml", &[("out-of-range", 1)]);
    editor.change("slow.toml", "[parameters]\nspeed = 1.0\n");
    editor.wait_for("slow.toml", &[]);
    editor.end();
}
