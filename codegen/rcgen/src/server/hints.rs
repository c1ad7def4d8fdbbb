//! Hints after names, and lenses above declarations.

use super::editor::Editor;
use super::findings::Place;
use super::known_files::KnownFiles;
use super::names::{Kind, Names};
use super::networks::{Networks, Wired};
use rc_codegen::{Project, stubs};
use rc_diagnostics::SourceMap;
use rc_vocabulary::Language;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// The command that prints the handlers which a worker lacks.
const MISSING: &str = "rcgen.missing";

/// The most hints of an answer.
const MOST: usize = 5_000;

/// The hints in a range of an open file: sizes and types on the wire in interfaces, the default
/// quality of service of a slot, and in networks the middleware and address of a connection.
pub(super) fn hints(
    files: &KnownFiles,
    networks: &Networks,
    editor: &Editor,
    path: &Path,
    range: &Value,
) -> Value {
    let Some(names) = files.get(path) else {
        return Value::Null;
    };
    let text = &names.text;
    let Some((start, end)) = text.bytes(editor.encoding(), range) else {
        return Value::Null;
    };
    let mut hints: Vec<(usize, String)> = names.hints.clone();
    if let Some(wired) = networks.get(path) {
        hints.extend(connections_of(names, wired));
    }
    hints.retain(|(at, _)| start <= *at && *at <= end);
    hints.sort();
    hints.truncate(MOST);
    let hints = hints.into_iter().map(|(at, label)| {
        let place = editor.range(text, at, at);
        json!({ "position": place["start"], "label": label, "paddingLeft": true })
    });
    json!(hints.collect::<Vec<_>>())
}

/// After each `bind` of a network, the middleware and the address of the connection.
fn connections_of(names: &Names, wired: &Wired) -> Vec<(usize, String)> {
    let binds = names.binds.iter();
    binds
        .filter_map(|bind| {
            let joined = wired.connections.iter().find(|joined| {
                bind.consumer.is(&joined.consumer.path) && bind.provider.is(&joined.provider.path)
            })?;
            let middleware = joined.middleware.unwrap_or_default();
            Some((bind.end, format!("{middleware} at {}", joined.address)))
        })
        .collect()
}

/// The lenses of an open file: actions, and facts about its declarations.
pub(super) fn lenses(files: &KnownFiles, editor: &Editor, path: &Path) -> Value {
    let Some(names) = files.get(path) else {
        return Value::Null;
    };
    let mut places = names.places.iter().filter(|place| place.declares);
    let whole = |kind: Kind| {
        move |place: &&super::names::Place| place.symbols.iter().any(|symbol| symbol.kind == kind)
    };
    let ending = path.extension().and_then(|ending| ending.to_str());
    let (kind, ending) = match ending {
        Some("cdsl") => (Kind::Component, "cdsl"),
        Some("ddsl") => (Kind::Network, "ddsl"),
        Some("idsl") => (Kind::Interface, "idsl"),
        _ => return json!([]),
    };
    if ending == "idsl" {
        return lenses_of_interfaces(files, editor, path);
    }
    let Some(place) = places.find(whole(kind)) else {
        return json!([]);
    };
    let range = editor.range(&names.text, place.start, place.end);
    let uri = editor.address(path);
    let lens = |title: &str, command: &str, arguments: Value| {
        let command = json!({ "title": title, "command": command, "arguments": arguments });
        json!({ "range": range, "command": command })
    };
    if ending == "ddsl" {
        return json!([
            lens("Check", "rcgen.checkNetwork", json!([uri])),
            lens("Run", "rcgen.up", json!([uri])),
            lens("Stop", "rcgen.down", json!([uri])),
        ]);
    }
    let mut lenses = vec![lens("Generate", "rcgen.generate", json!([uri]))];
    let networks = networks_with(files, editor, path);
    if !networks.is_empty() {
        let title = counted(networks.len(), "network uses", "networks use");
        let position = &range["start"];
        let arguments = json!([uri, position, networks]);
        lenses.push(lens(
            &format!("{title} this"),
            "rcgen.showPlaces",
            arguments,
        ));
    }
    let missing = missing(files, path);
    if missing > 0 {
        let title = counted(missing, "handler missing", "handlers missing");
        lenses.push(lens(&title, MISSING, json!([uri])));
    }
    json!(lenses)
}

/// The quick fix on the name of a component whose worker lacks handlers: it prints their stubs.
pub(super) fn stubs_action(
    files: &KnownFiles,
    editor: &Editor,
    path: &Path,
    range: &Value,
) -> Option<Value> {
    let names = files.get(path)?;
    let mut places = names.places.iter().filter(|place| place.declares);
    let named = places.find(|place| {
        let mut symbols = place.symbols.iter();
        symbols.any(|symbol| symbol.kind == Kind::Component && symbol.file == path)
    })?;
    if !Place::meet(&editor.range(&names.text, named.start, named.end), range) {
        return None;
    }
    let missing = missing(files, path);
    let title = counted(missing, "missing handler", "missing handlers");
    let title = format!("Print the stubs of {title}");
    let arguments = json!([editor.address(path)]);
    (missing > 0).then(|| {
        let command = json!({ "title": title, "command": MISSING, "arguments": arguments });
        json!({ "title": title, "kind": "quickfix", "command": command })
    })
}

/// For each interface, the slots that use it.
fn lenses_of_interfaces(files: &KnownFiles, editor: &Editor, path: &Path) -> Value {
    let Some(names) = files.get(path) else {
        return Value::Null;
    };
    let places = names.places.iter().filter(|place| place.declares);
    let lenses = places.filter_map(|place| {
        let mut symbols = place.symbols.iter();
        let interface = symbols.find(|symbol| symbol.kind == Kind::Interface)?;
        let mut users = Vec::new();
        for (file, names) in files.iter() {
            let uses = names
                .places
                .iter()
                .filter(|one| one.symbols.contains(interface));
            if file != path {
                users
                    .extend(uses.map(|one| editor.location(file, &names.text, one.start, one.end)));
            }
        }
        let title = counted(users.len(), "slot", "slots");
        let range = editor.range(&names.text, place.start, place.end);
        let arguments = json!([editor.address(path), range["start"], users]);
        (!users.is_empty()).then(|| {
            let command = "rcgen.showPlaces";
            let command = json!({ "title": title, "command": command, "arguments": arguments });
            json!({ "range": range, "command": command })
        })
    });
    json!(lenses.collect::<Vec<_>>())
}

/// The places of networks that have a component, one of each network.
fn networks_with(files: &KnownFiles, editor: &Editor, cdsl: &Path) -> Vec<Value> {
    let mut seen = BTreeSet::new();
    let networks = files.iter().filter_map(|(path, names)| {
        let mut instances = names.instances.iter();
        let uses = instances.any(|(_, file)| file == cdsl);
        let is_new = uses && seen.insert(path.clone());
        let mut places = names.places.iter();
        let place = places.find(|place| {
            let mut symbols = place.symbols.iter();
            symbols.any(|symbol| symbol.kind == Kind::File && symbol.file == cdsl)
        });
        let (start, end) = place.map_or((0, 0), |place| (place.start, place.end));
        is_new.then(|| editor.location(path, &names.text, start, end))
    });
    networks.collect()
}

/// The number of handlers that the worker of a component lacks.
fn missing(files: &KnownFiles, cdsl: &Path) -> usize {
    let mut sources = SourceMap::new();
    let loader = files.loader();
    let Ok((Some(project), found)) = Project::load(cdsl, &mut sources, &loader) else {
        return 0;
    };
    // Those of Python need its interpreter.
    let is_rust = project.language() == Some(Language::Rust);
    if found.has_errors() || !is_rust || !project.code().join("src").is_dir() {
        return 0;
    }
    let folder = project.code().to_path_buf();
    let missing = stubs::of(&project, &folder, &mut sources);
    let missing = missing.ok().and_then(|(missing, _)| missing);
    missing.map_or(0, |missing| missing.count())
}

fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
