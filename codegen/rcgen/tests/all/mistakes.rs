//! Diagnostics for common mistakes of users of C++, RoboComp or other versions.

use crate::folders::rcgen;
use std::path::Path;

/// `rcgen check` of a file, one line for each finding.
fn check(folder: &Path, file: &str, text: &str) -> Vec<String> {
    std::fs::write(folder.join(file), text).expect("a file");
    let (_, _, err) = rcgen(folder, &["check", file, "--format", "short"]);
    err.lines().map(str::to_owned).collect()
}

#[test]
fn types_of_other_languages() {
    let folder = tempfile::tempdir().expect("a folder");
    let member = |ty: &str| {
        let text = format!("module M {{ struct S {{\n{ty} x;\n}}; }};\n");
        check(folder.path(), "m.idsl", &text)
    };
    for (written, message) in [
        (
            "vector<int>",
            "unknown type `vector<int>` (write `sequence<int>`)",
        ),
        (
            "std::vector<float>",
            "unknown type `std::vector<float>` (write `sequence<float>`)",
        ),
        (
            "list< string >",
            "unknown type `list<string>` (write `sequence<string>`)",
        ),
        (
            "array<int, 3>",
            "unknown type `array<int,3>` (write `sequence<int, 3>` for at most 3 elements)",
        ),
        (
            "map<string, int>",
            "unknown type `map<string,int>` (declare `dictionary<string, int> NAME;` in the module, and write its name here)",
        ),
        (
            "std::string",
            "unknown type `std::string` (did you mean `string`?)",
        ),
        ("int32_t", "unknown type `int32_t` (did you mean `int32`?)"),
        ("size_t", "unknown type `size_t` (did you mean `uint64`?)"),
    ] {
        assert_eq!(
            member(written),
            [format!("m.idsl:2:1: error[unknown-type]: {message}")]
        );
    }
    // An element that is unknown itself is a second mistake.
    let found = member("vector<vector<int64_t>>");
    assert_eq!(found.len(), 3, "{found:?}");
    // In an operation, too.
    let text = "module M { interface I {\nvoid f(vector<int> x);\n}; };\n";
    let found = check(folder.path(), "m.idsl", text);
    assert_eq!(
        found,
        ["m.idsl:2:8: error[unknown-type]: unknown type `vector<int>` (write `sequence<int>`)"]
    );
}

#[test]
fn a_mistyped_import_is_one_mistake() {
    let folder = tempfile::tempdir().expect("a folder");
    let cdsl = |import: &str, interface: &str| {
        let text = format!(
            "import \"{import}\";\nComponent c {{ Communications {{ requires {interface}; }}; language rust; }};\n"
        );
        check(folder.path(), "c.cdsl", &text)
    };
    for import in ["Lasr.idsl", "Sensors.idsl"] {
        let interface = if import == "Lasr.idsl" {
            "Laser"
        } else {
            "Sonar"
        };
        let found = cdsl(import, interface);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("c.cdsl:1:8: error[import-not-found]"),
            "{found:?}"
        );
    }
    // Another file has it.
    let found = cdsl("Sensors.idsl", "Laser");
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found[1].contains("add `import \"Laser.idsl\";`"),
        "{found:?}"
    );
}

#[test]
fn calls_under_subscribes_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let text = "module M { interface Tags { int count(); void seen(int tag); }; };\n";
    std::fs::write(folder.join("Tags.idsl"), text).expect("a file");
    let cdsl = "import \"Tags.idsl\";\nComponent c { Communications { subscribesTo Tags; }; language rust; };\n";
    let found = check(folder, "c.cdsl", cdsl);
    let help = "(topics are one-way: use `Tags` under `requires`, or move its topics into an interface `TagsPub`)";
    assert!(found[0].ends_with(help), "{found:?}");
    let text = "module P { interface TagsPub { void seen(int tag); }; };\n";
    std::fs::write(folder.join("TagsPub.idsl"), text).expect("a file");
    let found = check(folder, "c.cdsl", cdsl);
    let help = "(use the topics of `TagsPub`, or use `Tags` under `requires`)";
    assert!(found[0].ends_with(help), "{found:?}");
}

#[test]
fn a_time_without_a_unit() {
    let folder = tempfile::tempdir().expect("a folder");
    let network = |ready: &str| {
        let text =
            format!("Deployment d {{ Component c {{ cdsl \"c.cdsl\";\nready {ready};\n}}; }};\n");
        check(folder.path(), "d.ddsl", &text)
    };
    assert_eq!(
        network("10"),
        [
            "d.ddsl:2:7: warning[short-ready]: `ready` is 10ms, in which few components start \
          (a number without a unit is in milliseconds; write `ready 10s;` for seconds)"
        ]
    );
    assert_eq!(network("10s"), [""; 0]);
}

#[test]
fn a_mistyped_command() {
    let folder = tempfile::tempdir().expect("a folder");
    for (typed, answer) in [
        (
            &["chekc", "c.cdsl"][..],
            "there is no command and no file `chekc`; did you mean `rcgen check`?",
        ),
        (
            &["generat"],
            "there is no command and no file `generat`; did you mean `rcgen generate`?",
        ),
        (
            &["zzz"],
            "there is no command and no file `zzz`; `rcgen help` lists the commands",
        ),
    ] {
        let (code, out, err) = rcgen(folder.path(), typed);
        assert_eq!(
            (code, out.as_str(), err),
            (2, "", format!("rcgen: error: {answer}\n"))
        );
    }
}

/// RoboComp accepts a subscribed operation that returns a value.
#[test]
fn a_subscribed_operation_with_a_result_is_a_warning_for_files_of_robocomp() {
    let folder = tempfile::tempdir().expect("a folder");
    let idsl = "module Tags { interface Tags { int newTags(int count); }; };";
    std::fs::write(folder.path().join("Tags.idsl"), idsl).expect("a file");
    let component = |clause: &str| {
        let text = format!(
            "import \"Tags.idsl\";\nComponent c {{ Communications {{ {clause} Tags; }}; language cpp; }};\n"
        );
        std::fs::write(folder.path().join("c.cdsl"), text).expect("a file");
    };
    let check = |more: &[&str]| {
        let words = [&["check", "c.cdsl", "--format", "short"], more].concat();
        let (code, _, err) = rcgen(folder.path(), &words);
        let severity = |word: &str| err.contains(&format!("{word}[wrong-pattern]"));
        (code, severity("warning"), severity("error"))
    };
    component("subscribesTo");
    assert_eq!(check(&[]), (1, false, true));
    assert_eq!(check(&["--robocomp"]), (0, true, false));
    // A publisher would have to make up the results.
    component("publishes");
    assert_eq!(check(&["--robocomp"]), (1, false, true));
}

/// Names of an interface that C++ has no way to write.
#[test]
fn names_that_cpp_cannot_have() {
    let folder = tempfile::tempdir().expect("a folder");
    for (module, types, found) in [
        (
            "std",
            "",
            "M.idsl:1:8: error[not-in-cpp]: C++ cannot have a module `std`: the word is taken (give the module another name, or \
             write the component in Rust or Python)",
        ),
        (
            "class",
            "",
            "M.idsl:1:8: error[not-in-cpp]: C++ cannot have a module `class`: the word is taken (give the module another name, or \
             write the component in Rust or Python)",
        ),
        (
            "M",
            "struct M { int x; };",
            "M.idsl:1:19: error[not-in-cpp]: C++ cannot have `M` in a module `M`",
        ),
        (
            "M",
            "struct S { int S; };",
            "M.idsl:1:27: error[not-in-cpp]: C++ cannot have a member `S` in `S`",
        ),
    ] {
        let idsl = format!("module {module} {{ {types} interface A {{ void a(int x); }}; }};\n");
        std::fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
        let text =
            "import \"M.idsl\";\nComponent c { Communications { requires A; }; language cpp; };\n";
        std::fs::write(folder.path().join("c.cdsl"), text).expect("a file");
        for words in [
            &["check", "c.cdsl", "--format", "short"][..],
            &["c.cdsl", "--dry-run", "--format", "short"],
        ] {
            let (code, _, err) = rcgen(folder.path(), words);
            assert_eq!((code, err), (1, format!("{found}\n")), "{module}");
        }
    }
}

/// A collection in C++ is a function of the worker beside those that every worker has.
#[test]
fn a_collection_in_cpp_has_a_name_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let idsl = "module M { interface A { void a(int x); }; interface B { void b(int x); }; };";
    std::fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
    let found = |name: &str| {
        let text = format!(
            "import \"M.idsl\";\nComponent c {{ Communications {{ subscribesTo A, B; }}; language cpp;\n\
             collect A.a, B.b within 10ms as {name}; }};\n"
        );
        std::fs::write(folder.path().join("c.cdsl"), text).expect("a file");
        let words = ["c.cdsl", "--dry-run", "--format", "short"];
        let (code, _, err) = rcgen(folder.path(), &words);
        (code, err)
    };
    let (code, err) = found("view");
    assert_eq!(code, 0, "{err}");
    for name in ["emergency", "ctx"] {
        let message = format!(
            "c.cdsl:3:33: error[name-collision]: the worker has `{name}` already (give the collection another name)\n"
        );
        assert_eq!(found(name), (1, message));
    }
}
