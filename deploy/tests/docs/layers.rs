//! ARCHITECTURE.md is true: a crate depends on no crate of a later layer, top-level folders depend in
//! no circle, and `unsafe` is where the page lists it.

use crate::markdown::ROOT;
use rc_vocabulary::Middleware;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The paths of the table of layers, each with the number of its layer.
fn layers(architecture: &str) -> BTreeMap<String, usize> {
    let rows = architecture
        .lines()
        .skip_while(|line| *line != "| layer | crates |")
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    let paths = rows.enumerate().flat_map(|(layer, row)| {
        let crates = row.split('|').nth(2).unwrap_or_default();
        let paths = crates.split('`').skip(1).step_by(2);
        paths.map(move |path| (path.to_owned(), layer))
    });
    paths.collect()
}

/// The folders of all crates of the workspace, by their names, and their dependencies that are not
/// for tests.
fn crates() -> BTreeMap<String, (String, Vec<String>)> {
    let root = Path::new(ROOT).canonicalize().expect("the workspace");
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--no-deps",
            "--offline",
            "--format-version",
            "1",
        ])
        .current_dir(&root)
        .output()
        .expect("cargo");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("metadata");
    let packages = metadata["packages"].as_array().expect("packages");
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let described = packages.iter().map(|package| {
        let manifest = text(&package["manifest_path"]);
        let folder = Path::new(&manifest).parent().expect("a folder");
        let folder = folder.strip_prefix(&root).expect("inside");
        let dependencies = package["dependencies"].as_array().expect("dependencies");
        let linked = dependencies.iter().filter(|d| d["kind"] != "dev");
        (
            text(&package["name"]),
            (
                folder.to_string_lossy().into_owned(),
                linked.map(|d| text(&d["name"])).collect(),
            ),
        )
    });
    described.collect()
}

#[test]
fn a_crate_depends_on_no_later_layer() {
    let architecture = std::fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md"));
    let layers = layers(&architecture.expect("ARCHITECTURE.md"));
    let crates = crates();
    assert!(crates.len() > 50, "only {} crates", crates.len());
    // The longest path that holds a folder decides.
    let layer = |folder: &str| {
        let paths = layers.iter().filter(|(path, _)| {
            let rest = folder.strip_prefix(path.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        });
        paths.max_by_key(|(path, _)| path.len()).map(|(_, n)| *n)
    };
    let mut wrong = Vec::new();
    for (name, (folder, dependencies)) in &crates {
        let Some(own) = layer(folder) else {
            wrong.push(format!("{name} ({folder}) is in no layer"));
            continue;
        };
        for other in dependencies {
            let Some((other_folder, _)) = crates.get(other) else {
                continue;
            };
            if layer(other_folder).is_some_and(|theirs| theirs > own) {
                wrong.push(format!(
                    "{name} depends on {other}, which is in a later layer"
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for path in layers.keys() {
        let exists = Path::new(ROOT).join(path).is_dir();
        assert!(exists, "ARCHITECTURE.md names the folder {path}");
    }
}

/// The sources below `folder` that allow `unsafe`, relative to the workspace.
fn allowing_unsafe(folder: &str, found: &mut Vec<String>) {
    let entries = std::fs::read_dir(Path::new(ROOT).join(folder)).expect("a folder");
    for entry in entries {
        let entry = entry.expect("an entry");
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = format!("{folder}/{name}");
        if entry.file_type().expect("a type").is_dir() {
            if name != "target" && !name.starts_with('.') {
                allowing_unsafe(&path, found);
            }
        } else if entry.path().extension() == Some("rs".as_ref()) {
            let text = std::fs::read_to_string(entry.path()).expect("a source");
            // In two parts, so that this file does not count.
            if text.contains(concat!("unsafe", "_code")) {
                found.push(path.trim_start_matches("./").to_owned());
            }
        }
    }
}

#[test]
fn unsafe_is_where_the_page_lists_it() {
    let page = std::fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md"));
    let page = page.expect("ARCHITECTURE.md");
    let mut found = Vec::new();
    allowing_unsafe(".", &mut found);
    assert!(!found.is_empty());
    for path in found {
        assert!(page.contains(&format!("`{path}`")), "{path} is not listed");
    }
}

#[test]
fn top_level_folders_depend_in_no_circle() {
    let crates = crates();
    let top = |folder: &str| folder.split('/').next().unwrap_or_default().to_owned();
    // For each folder the others that its crates depend on, each with one reason.
    let mut edges = BTreeMap::<String, BTreeMap<String, String>>::new();
    for (name, (folder, dependencies)) in &crates {
        let own = top(folder);
        for other in dependencies {
            let Some((theirs, _)) = crates.get(other) else {
                continue;
            };
            if top(theirs) != own {
                let reason = format!("{name} depends on {other}");
                let of = edges.entry(own.clone()).or_default();
                of.entry(top(theirs)).or_insert(reason);
            }
        }
    }
    assert!(edges.len() > 10, "{edges:?}");
    // Folders that depend on no other one are removed until none is left.
    loop {
        let done = |folder: &String| !edges.contains_key(folder);
        let free = edges.iter().find(|(_, others)| others.keys().all(done));
        let Some(folder) = free.map(|(folder, _)| folder.clone()) else {
            break;
        };
        edges.remove(&folder);
    }
    let mut circles = String::new();
    for (folder, others) in &edges {
        for (other, reason) in others {
            if edges.contains_key(other) {
                circles += &format!("{folder} -> {other}: {reason}\n");
            }
        }
    }
    assert!(
        circles.is_empty(),
        "folders in a circle, or above one:\n{circles}"
    );
}

/// The texts of the sources below `folder`, by their paths.
fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension() == Some("rs".as_ref()) {
            let text = std::fs::read_to_string(&path).expect("a source");
            found.push((path, text));
        }
    }
    found
}

/// The lines of a source, without comments and indentation.
fn lines_of_code(source: &str) -> impl Iterator<Item = &str> {
    let lines = source.lines().map(str::trim_start);
    lines.filter(|line| !line.starts_with("//"))
}

/// The lines of code below `folder` for which `is` holds.
fn code(folder: &Path, is: &dyn Fn(&str) -> bool, found: &mut Vec<String>) {
    for (path, text) in sources(folder) {
        let lines = lines_of_code(&text).filter(|line| is(line));
        found.extend(lines.map(|line| format!("{}: {line}", path.display())));
    }
}

#[test]
fn the_runtime_and_the_traits_name_no_middleware() {
    let names = Middleware::ALL.map(|middleware| {
        let literal = format!("\"{}\"", middleware.word());
        (literal, format!("{}::", middleware.module()))
    });
    let is_named = |line: &str| {
        let mut names = names.iter();
        names.any(|(literal, module)| line.contains(literal) || line.contains(module))
    };
    let mut found = Vec::new();
    for folder in ["runtime/src", "middleware/src"] {
        code(&Path::new(ROOT).join(folder), &is_named, &mut found);
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The heads of the `impl` blocks of a source, up to `{`, each in one line.
fn heads(source: &str) -> Vec<String> {
    let mut lines = lines_of_code(source);
    let mut heads = Vec::new();
    while let Some(line) = lines.next() {
        if !line.starts_with("impl ") && !line.starts_with("impl<") {
            continue;
        }
        let mut head = line.to_owned();
        while !head.contains('{') {
            let Some(line) = lines.next() else { break };
            head += " ";
            head += line;
        }
        let end = head.find('{').unwrap_or(head.len());
        heads.push(head[..end].to_owned());
    }
    heads
}

/// The text behind the generic parameters at its begin, if it has any.
fn after_parameters(text: &str) -> &str {
    let mut depth = 0;
    let mut last = ' ';
    for (at, c) in text.char_indices() {
        depth += i32::from(c == '<') - i32::from(c == '>' && last != '-');
        if depth == 0 {
            return if c == '>' { &text[at + 1..] } else { text };
        }
        last = c;
    }
    text
}

/// The name of the type in `impl<'a> path::TYPE<'a>`; none in an `impl` of a trait.
fn implemented(head: &str) -> Option<&str> {
    let rest = after_parameters(head.strip_prefix("impl")?);
    let ty = rest.split(" where ").next()?;
    if ty.contains(" for ") {
        return None;
    }
    let path = ty.split('<').next()?;
    path.rsplit("::").next().map(str::trim)
}

/// The most files of a crate in which one type has inherent methods: with more, each of them may
/// touch all of its state.
const MOST_FILES: usize = 6;

#[test]
fn no_type_has_methods_in_many_files() {
    let source = "impl<'a, T: Of<u8>> Loop<'a, T> {\n} // impl X {\n\
        impl<F: Fn(u8) -> Vec<u8>> super::Filter<F>\nwhere\n    F: for<'a> Of<'a>,\n{\n\
        impl<\n    A,\n> Cut<A> {\nimpl<A> Trait<A>\n    for Cut<A>\n{\nimpl Bare {";
    let heads_found = heads(source);
    let names: Vec<_> = heads_found.iter().map(|head| implemented(head)).collect();
    let expected = [
        Some("Loop"),
        Some("Filter"),
        Some("Cut"),
        None,
        Some("Bare"),
    ];
    assert_eq!(names, expected, "{heads_found:?}");
    let mut all: BTreeMap<(String, String), BTreeSet<PathBuf>> = BTreeMap::new();
    for (name, (folder, _)) in crates() {
        let folder = Path::new(ROOT).join(folder).join("src");
        if !folder.is_dir() {
            continue;
        }
        for (path, text) in sources(&folder) {
            for head in heads(&text) {
                if let Some(ty) = implemented(&head) {
                    let key = (name.clone(), ty.to_owned());
                    all.entry(key).or_default().insert(path.clone());
                }
            }
        }
    }
    let event_loop = &all[&("rc-runtime".to_owned(), "EventLoop".to_owned())];
    assert!(event_loop.len() >= 2, "{event_loop:?}");
    let mut many = String::new();
    for ((name, ty), files) in all {
        if files.len() > MOST_FILES {
            many += &format!("{ty} of {name}: {files:#?}\n");
        }
    }
    assert!(
        many.is_empty(),
        "types with inherent methods in more than {MOST_FILES} files: make a part with a state a \
         type of its own. Types of one name in two modules of a crate are counted together: rename \
         one.\n{many}"
    );
}

/// The crates of languages, and the languages that each knows.
const LANGUAGES: [(&str, &[&str]); 8] = [
    ("rc-idsl", &[]),
    ("rc-pdsl", &[]),
    ("rc-smdsl", &[]),
    ("rc-prototypes", &["rc-idsl"]),
    ("rc-cdsl", &["rc-idsl", "rc-prototypes"]),
    (
        "rc-ddsl",
        &["rc-cdsl", "rc-idsl", "rc-pdsl", "rc-prototypes"],
    ),
    ("graph-language", &["rc-prototypes"]),
    ("rc-kinematics", &[]),
];

#[test]
fn the_page_can_be_read_at_once() {
    let page = std::fs::metadata(Path::new(ROOT).join("ARCHITECTURE.md")).expect("a page");
    assert!(page.len() <= 12 << 10, "{} bytes", page.len());
}

#[test]
fn languages_do_no_input_or_output_and_know_others_as_the_page_says() {
    let crates = crates();
    let modules = ["fs", "env", "process", "os"];
    let reaches = modules.map(|module| format!("std::{module}"));
    let others = ["TcpStream", "UnixStream", "rc_files"];
    let does = |line: &str| {
        let names = |part: &str| line.contains(part);
        let group = line.strip_prefix("use std::{").unwrap_or_default();
        let mut words = group.split(|c: char| !c.is_alphanumeric());
        reaches.iter().any(|part| names(part))
            || others.iter().any(|part| names(part))
            || words.any(|word| modules.contains(&word))
    };
    let mut found = Vec::new();
    for (name, known) in LANGUAGES {
        let (folder, dependencies) = crates.get(name).unwrap_or_else(|| panic!("{name}"));
        code(&Path::new(ROOT).join(folder).join("src"), &does, &mut found);
        let is_language = |other: &&String| LANGUAGES.iter().any(|(name, _)| name == other);
        let mut others: Vec<&String> = dependencies.iter().filter(is_language).collect();
        others.sort();
        assert_eq!(others, known, "{name}");
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The library crates, which may be published.
fn public_crates() -> Vec<String> {
    let mut manifests = Vec::new();
    for (folder, _) in crates().into_values() {
        let text = std::fs::read_to_string(Path::new(ROOT).join(&folder).join("Cargo.toml"));
        let text = text.expect("a manifest");
        if !text.contains("\npublish.workspace = true\n") && !text.contains("\npublish = false\n") {
            manifests.push(folder);
        }
    }
    manifests
}

#[test]
fn the_front_page_of_each_library_crate_has_an_example() {
    // Its purpose is its manifest.
    const WITHOUT_CODE: &str = "runtime/shared_features";
    let compiled = std::fs::read_to_string(Path::new(ROOT).join("xtask/front_pages/src/lib.rs"));
    let compiled = compiled.expect("the examples that are compiled");
    let public = public_crates();
    assert!(public.len() > 50, "{public:?}");
    let mut without = Vec::new();
    for folder in public.iter().filter(|folder| *folder != WITHOUT_CODE) {
        let text = std::fs::read_to_string(Path::new(ROOT).join(folder).join("src/lib.rs"));
        let text = text.expect("a library");
        let page = text.lines().take_while(|line| line.starts_with("//!"));
        let has_own = page.into_iter().any(|line| line.starts_with("//! ```"));
        let shown = text.contains("#![doc = include_str!(\"example.md\")]");
        let is_compiled = compiled.contains(&format!("/{folder}/src/example.md"));
        if !(has_own || shown && is_compiled) {
            without.push(folder.clone());
        }
    }
    assert!(
        without.is_empty(),
        "no example on the front page of {without:?}"
    );
}
