//! The generated files of this repository: how much they are, and that none stands twice.

use crate::folders::rcgen;
use expect_test::expect_file;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
/// The folders that have components.
const PLACES: [&str; 3] = ["components", "deploy/tests/programs", "xtask/bench"];
/// The most lines of generated files. What every component needs belongs into a library.
const MOST_LINES: usize = 33_900;
/// Files of so few lines may be alike: manifests, marks of packages, lists of names.
const FEW_LINES: usize = 33;

struct Generated {
    path: PathBuf,
    /// The component, without the language in its name.
    component: String,
    lines: usize,
    /// The text, in which names of the component are replaced.
    nameless: String,
}

fn collect(folder: &Path, component: Option<&str>, found: &mut Vec<Generated>) {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.expect("a name in UTF-8");
        match component {
            // Other tests build these files meanwhile; they are not committed.
            _ if name.starts_with('.') || matches!(name, "target" | "build" | "__pycache__") => {}
            None if path.is_dir() => {
                let owner = folder.file_name().and_then(|owner| owner.to_str());
                let owner = (name == "generated").then(|| owner.expect("a name in UTF-8"));
                collect(&path, owner, found);
            }
            Some(owner) if path.is_dir() => collect(&path, Some(owner), found),
            Some(owner) => {
                let text = std::fs::read_to_string(&path).expect("a text");
                found.push(Generated {
                    path,
                    component: without_language(owner).to_owned(),
                    lines: text.lines().count(),
                    nameless: without_names(text, owner),
                });
            }
            None => {}
        }
    }
}

fn without_language(component: &str) -> &str {
    let mut endings = ["_python", "_cpp"].iter();
    endings
        .find_map(|ending| component.strip_suffix(ending))
        .unwrap_or(component)
}

/// `joint_controller`, `JointController`, `JOINT_CONTROLLER`, `joint controller`.
fn without_names(text: String, component: &str) -> String {
    let words = component.split('_');
    let camel: String = words
        .map(|word| {
            let (first, rest) = word.split_at_checked(1).unwrap_or_default();
            first.to_uppercase() + rest
        })
        .collect();
    let shout = component.to_uppercase();
    let spaced = component.replace('_', " ");
    let names = [component, &camel, &shout, &spaced];
    names
        .iter()
        .fold(text, |text, name| text.replace(name, "NAME"))
}

/// A component that cargo does not build has its own code of each module of the IDSL, as a package
/// of pip or a project of cmake needs it.
fn is_module_of_a_package(path: &Path) -> bool {
    let foreign = ["py", "h"]
        .iter()
        .any(|of| path.extension().is_some_and(|e| e == *of));
    let parent = path.parent().and_then(Path::file_name);
    foreign && parent.is_some_and(|folder| folder == "types" || folder == "interfaces")
}

fn all() -> Vec<Generated> {
    let mut found = Vec::new();
    for place in PLACES {
        collect(&Path::new(ROOT).join(place), None, &mut found);
    }
    assert!(found.len() > 500, "{} generated files", found.len());
    found
}

#[test]
fn generated_files_are_few() {
    let all = all();
    let lines: usize = all.iter().map(|file| file.lines).sum();
    assert!(
        lines <= MOST_LINES,
        "{lines} generated lines are committed, at most {MOST_LINES} are allowed: let generated code call a library"
    );
}

/// One component in several languages says the same of itself.
#[test]
fn no_generated_file_differs_from_another_one_in_names_only() {
    let mut alike: BTreeMap<String, Vec<(String, PathBuf)>> = BTreeMap::new();
    for file in all() {
        if file.lines > FEW_LINES && !is_module_of_a_package(&file.path) {
            let known = alike.entry(file.nameless).or_default();
            if known
                .iter()
                .all(|(component, _)| *component != file.component)
            {
                known.push((file.component, file.path));
            }
        }
    }
    let twice: Vec<_> = alike.values().filter(|files| files.len() > 1).collect();
    assert!(
        twice.is_empty(),
        "these files differ in names only: {twice:#?}"
    );
}

/// The library has the types of `geometry.gdsl` as `rcgen` prints them for a copy of the file.
#[test]
fn the_types_of_geometry_are_those_of_the_library() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let domains = graph_language::DOMAINS;
    let (_, geometry) = domains
        .iter()
        .find(|(name, _)| *name == "geometry.gdsl")
        .expect("it");
    std::fs::write(path("places.gdsl"), geometry).expect("a file");
    let cdsl = "Component land { Communications { }; language rust; world \"places.gdsl\" as g { reads Frame; }; };";
    std::fs::write(path("land.cdsl"), cdsl).expect("a file");
    let (code, out, err) = rcgen(folder.path(), &["land.cdsl"]);
    assert_eq!(code, 0, "{out}{err}");
    let text = std::fs::read_to_string(path("generated/src/world.rs")).expect("a text");
    // Calls of macros, the ends of which are not indented.
    let mut types = String::new();
    let mut is_inside = false;
    for line in text.lines() {
        let begins = ["typed::node!(", "typed::edge!(", "typed::reads! {"];
        is_inside |= begins.iter().any(|begin| line.starts_with(begin));
        if is_inside {
            types += line;
            types.push('\n');
        }
        is_inside &= !matches!(line, ");" | "}");
    }
    let front = "//! The types of `geometry.gdsl`, which comes with the framework. Generated code exports those of its
//! schema, and has the functions of its view and its changes for them.
//!
//! This is what `rcgen` prints for a copy of the file (`codegen/rcgen/tests/all/committed.rs`).

use crate as typed;

";
    let file = Path::new(ROOT).join("world/typed/src/geometry.rs");
    expect_file![file].assert_eq(&format!("{front}{types}"));
}

/// A file that is imported before `geometry.gdsl` may have a type that Rust calls alike.
#[test]
fn a_type_of_geometry_gets_another_name_beside_one_of_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write(
        "pictures.gdsl",
        "Domain pictures { entity frame { title string; }; };",
    );
    let both = "import \"pictures.gdsl\"; import \"geometry.gdsl\"; Domain gallery { entity room : Frame { }; };";
    write("gallery.gdsl", both);
    let cdsl = "Component guide { Communications { }; language rust; world \"gallery.gdsl\" as g { reads Frame; }; };";
    write("guide.cdsl", cdsl);
    let (code, out, err) = rcgen(folder.path(), &["guide.cdsl"]);
    assert_eq!(code, 0, "{out}{err}");
    let path = folder.path().join("generated/src/world.rs");
    let text = std::fs::read_to_string(path).expect("a text");
    for line in [
        "pub use typed::geometry::{Frame as Frame_, GeometricRelation,",
        "pub type FrameChange_ = typed::Change<Frame_<'static>>;",
        "typed::node_by_name!(Frame_, \"Frame\", frame_);",
        "    Frame, \"frame\"",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}
