//! `rcgen index`: what folders hold, and what has changed.

use crate::folders::rcgen;
use std::fmt::Write;
use std::path::Path;

fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

fn component(name: &str, slots: &str, language: &str) -> String {
    format!(
        "import \"Grip.idsl\";\nComponent {name}\n{{\n    Communications {{ {slots} }};\n    language {language};\n}};\n"
    )
}

const IDSL: &str = "module Grip { interface Gripper { void open(); }; interface GripPub { void held(float x); }; };\n";

/// A hand, a mind that needs it, and a component whose interface is missing.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    write(path, "interfaces/Grip.idsl", IDSL);
    write(
        path,
        "Cargo.toml",
        "[workspace.package]\nlicense = \"MIT\"\n",
    );
    let manifest = "[package]\nname = \"hand\"\nlicense.workspace = true\n";
    write(path, "hand/Cargo.toml", manifest);
    let hand = component("hand", "implements Gripper; publishes GripPub;", "rust");
    write(path, "hand/hand.cdsl", &hand);
    let mind = component(
        "mind",
        "requires Gripper as left; subscribesTo GripPub;",
        "python",
    );
    write(path, "mind/mind.cdsl", &mind);
    let pyproject = "[project]\nname = \"mind\"\nlicense = \"BSD-3-Clause\"\n";
    write(path, "mind/pyproject.toml", pyproject);
    let torn = component("torn", "requires Gripper;", "rust").replace("Grip.idsl", "Grop.idsl");
    write(path, "torn/torn.cdsl", &torn);
    folder
}

#[test]
fn an_index_says_who_offers_and_needs_what() {
    let folder = folder();
    let (code, out, err) = rcgen(folder.path(), &["index", ".", "-I", "interfaces"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    expect_test::expect![[r"
        hand (rust, MIT): ./hand/hand.cdsl
            implements Gripper
            publishes GripPub
        mind (python, BSD-3-Clause): ./mind/mind.cdsl
            requires Gripper
            subscribesTo GripPub
        torn (rust, broken): ./torn/torn.cdsl

        Grip::GripPub
            publishes: hand
            subscribesTo: mind
        Grip::Gripper
            implements: hand
            requires: mind

        broken:
            ./torn/torn.cdsl:1:8: error[import-not-found]: cannot find `Grop.idsl`; searched in ./torn, interfaces, the interfaces that come with rcgen (did you mean `Grip.idsl`?)

        3 components, 2 interfaces, 1 fault
    "]].assert_eq(&out);
    let html = ["index", ".", "-I", "interfaces", "-o", "index.html"];
    let (code, out, err) = rcgen(folder.path(), &html);
    assert_eq!((code, out.as_str(), err.as_str()), (0, "", ""));
    let page = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
    assert!(
        page.contains("<td>hand</td><td>rust</td><td>MIT</td><td>Gripper</td>"),
        "{page}"
    );
    assert!(
        page.contains("<td>Grip::Gripper</td><td>hand</td><td>mind"),
        "{page}"
    );
    let (code, _, err) = rcgen(folder.path(), &["index", ".", "-o", "index.txt"]);
    assert_eq!(code, 2, "{err}");
    let (code, _, err) = rcgen(folder.path(), &["index", "nowhere"]);
    assert_eq!(code, 3, "{err}");
}

#[test]
fn what_has_changed_is_told_and_what_breaks_fails() {
    let folder = folder();
    let path = folder.path();
    let save = ["index", ".", "-I", "interfaces", "-o", "before.json"];
    assert_eq!(rcgen(path, &save).0, 0);
    let since = ["index", ".", "-I", "interfaces", "--since", "before.json"];
    assert_eq!(rcgen(path, &since), (0, String::new(), String::new()));
    let more = component("eye", "subscribesTo GripPub;", "rust");
    write(path, "eye/eye.cdsl", &more);
    let (code, out, _) = rcgen(path, &since);
    assert_eq!((code, out.as_str()), (0, "  component `eye` is new\n"));
    write(
        path,
        "interfaces/Grip.idsl",
        &IDSL.replace("float x", "double x"),
    );
    let hand = component("hand", "implements Gripper;", "rust");
    write(path, "hand/hand.cdsl", &hand);
    std::fs::remove_dir_all(path.join("mind")).expect("to remove");
    let (code, out, _) = rcgen(path, &since);
    assert_eq!(code, 1);
    expect_test::expect![[r"
        ! component `hand` no longer publishes `Grip::GripPub`
        ! component `mind` is gone
          component `eye` is new
        ! interface `Grip::GripPub` has other operations or types: the ends of the two states do not understand each other
    "]].assert_eq(&out);
    write(path, "before.json", "{}");
    let (code, _, err) = rcgen(path, &since);
    assert_eq!(code, 2);
    assert!(err.contains("before.json is not an index"), "{err}");
}

#[test]
fn files_that_are_moved_change_nothing() {
    let folder = folder();
    let path = folder.path();
    // Two definitions of one interface, the one of which moves behind the other.
    let other = IDSL.replace("float x", "double x");
    write(path, "a/Grip.idsl", &other);
    write(path, "b/Grip.idsl", IDSL);
    assert_eq!(rcgen(path, &["index", "a", "b", "-o", "before.json"]).0, 0);
    std::fs::rename(path.join("a"), path.join("c")).expect("to move");
    let since = ["index", "b", "c", "--since", "before.json"];
    assert_eq!(rcgen(path, &since), (0, String::new(), String::new()));
}

#[test]
fn a_thousand_components_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    write(path, "interfaces/Grip.idsl", IDSL);
    for at in 0..1000 {
        let role = if at % 2 == 0 {
            "implements"
        } else {
            "requires"
        };
        let text = component(&format!("part{at}"), &format!("{role} Gripper;"), "rust");
        write(path, &format!("part{at}/part{at}.cdsl"), &text);
    }
    let (code, out, err) = rcgen(path, &["index", ".", "-I", "interfaces"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(
        out.ends_with("\n1000 components, 2 interfaces, 0 faults\n"),
        "{out}"
    );
    let mut expected = String::new();
    write!(expected, "    implements: part0, part10, part100").expect("a text");
    assert!(out.contains(&expected), "{out}");
}
