//! Command lines of `rcgen`: files written, files left unchanged, exit codes.

use crate::folders::{changed, files, rcgen};
use rc_codegen::note::Note;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const CDSL: &str = "import \"Laser.idsl\"; import \"Speech.idsl\";\nComponent c { Communications { requires Laser; implements Speech; }; language rust; };\n";

/// A folder with `c.cdsl`.
fn folder(cdsl: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("c.cdsl"), cdsl).expect("a file");
    folder
}

pub(crate) fn succeeds(folder: &Path, args: &[&str]) -> String {
    let (code, out, err) = rcgen(folder, args);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    out
}

#[test]
fn dds_for_all_slots_and_for_one() {
    let cdsl = "import \"Laser.idsl\"; import \"LaserPub.idsl\";\nComponent c { Communications { requires Laser(dds); \
                publishes LaserPub { deadline 100ms; lifespan 1500ms; liveliness 2s; }; }; language rust; };\n";
    let folder = folder(cdsl);
    let folder = folder.path();
    let text = |path: &str| {
        let text = std::fs::read_to_string(folder.join("generated").join(path));
        text.expect("a generated file")
    };
    succeeds(folder, &["c.cdsl", "--middleware", "dds"]);
    let manifest = text("Cargo.toml");
    assert!(manifest.contains("rc-dds.workspace = true"), "{manifest}");
    assert!(!manifest.contains("iceoryx2"), "{manifest}");
    let backend = text("src/backend.rs");
    assert!(backend.contains("&[rc_dds::LINKED]"), "{backend}");
    let description = text("src/description.rs");
    let qos = "    qos: Qos {\n        deadline: Some(Duration::new(0, 100000000)),\n        \
               lifespan: Some(Duration::new(1, 500000000)),\n        \
               liveliness: Some(Duration::new(2, 0)),\n        ..Qos::PUBLISHER\n    },\n";
    assert!(description.contains(qos), "{description}");
    succeeds(folder, &["c.cdsl"]);
    let manifest = text("Cargo.toml");
    for name in ["rc-dds", "rc-iceoryx2"] {
        assert!(
            manifest.contains(&format!("{name}.workspace")),
            "{manifest}"
        );
    }
    let backend = text("src/backend.rs");
    assert!(backend.contains("rc_dds::LINKED"), "{backend}");
    assert!(text("src/description.rs").contains("backend: \"dds\","));
}

#[test]
fn user_files_survive_a_change_of_middleware() {
    let folder = folder(CDSL);
    let folder = folder.path();
    succeeds(folder, &["c.cdsl"]);
    std::fs::write(folder.join("src/specific_worker.rs"), "// mine\r\n").expect("a file");
    std::fs::write(folder.join("Cargo.toml"), "# mine").expect("a file");
    std::fs::write(folder.join("etc/config.toml"), "").expect("a file");
    let before = files(folder);
    let noted = || {
        let note = Note::of_generated(folder).expect("generated code");
        note.map(|note| (note.component, note.middleware))
    };
    let note = |middleware: &str| Some(("c".to_owned(), middleware.to_owned()));
    assert_eq!(noted(), note("iceoryx2"));
    assert_eq!(succeeds(folder, &["c.cdsl"]), "");
    assert_eq!(changed(&before, &files(folder)), [""; 0]);
    succeeds(folder, &["c.cdsl", "--middleware", "local"]);
    assert_eq!(noted(), note("local"));
    let differing = changed(&before, &files(folder));
    assert_eq!(
        differing,
        ["generated/Cargo.toml", "generated/src/backend.rs"]
    );
    succeeds(folder, &["c.cdsl"]);
    assert_eq!(changed(&before, &files(folder)), [""; 0]);
}

#[test]
fn files_of_a_removed_interface_are_removed() {
    let folder = folder(CDSL);
    let folder = folder.path();
    succeeds(folder, &["c.cdsl"]);
    assert!(folder.join("generated/src/slots.rs").exists());
    let less = CDSL
        .replace("implements Speech;", "")
        .replace("import \"Speech.idsl\";", "");
    std::fs::write(folder.join("c.cdsl"), less).expect("a file");
    let (code, out, err) = rcgen(folder, &["c.cdsl"]);
    assert_eq!(code, 0);
    assert!(
        err.starts_with("note[stale-handler]: no slot `Speech` receives anything any more\n"),
        "{err}"
    );
    assert!(
        out.contains("remove interfaces/generated/src/robo_comp_speech.rs"),
        "{out}"
    );
    let left = files(folder);
    let left: Vec<&PathBuf> = left
        .keys()
        .filter(|p| p.to_string_lossy().contains("speech"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    assert!(!folder.join("generated/src/slots.rs").exists());
}

#[test]
fn generation_is_deterministic() {
    let (one, two) = (folder(CDSL), folder(CDSL));
    succeeds(one.path(), &["c.cdsl"]);
    succeeds(two.path(), &["c.cdsl"]);
    assert_eq!(changed(&files(one.path()), &files(two.path())), [""; 0]);
}

#[test]
fn dry_runs_and_checks_write_nothing() {
    let folder = folder(CDSL);
    let folder = folder.path();
    let out = succeeds(folder, &["c.cdsl", "--dry-run"]);
    assert!(
        out.contains("specific create src/specific_worker.rs\n"),
        "{out}"
    );
    assert!(
        out.contains("generic  create generated/src/lib.rs\n"),
        "{out}"
    );
    let (code, _, err) = rcgen(folder, &["c.cdsl", "--check"]);
    assert_eq!(code, 1);
    assert!(
        err.contains("c.cdsl is not up to date: create generated/Cargo.toml\n"),
        "{err}"
    );
    assert_eq!(files(folder).len(), 1);
    succeeds(folder, &["c.cdsl"]);
    succeeds(folder, &["c.cdsl", "--check"]);
    std::fs::write(folder.join("generated/src/lib.rs"), "").expect("a file");
    let (code, _, err) = rcgen(folder, &["c.cdsl", "--check"]);
    assert_eq!(
        (code, err.lines().next()),
        (
            1,
            Some("c.cdsl is not up to date: update generated/src/lib.rs")
        )
    );
    assert_eq!(
        std::fs::read(folder.join("generated/src/lib.rs")).expect("a file"),
        b""
    );
}

#[test]
fn an_error_is_reported_with_its_location_and_writes_nothing() {
    let folder = folder(&CDSL.replace("requires Laser", "requires Lasre"));
    let (code, out, err) = rcgen(folder.path(), &["c.cdsl", "--format", "short"]);
    assert_eq!((code, out.as_str()), (1, ""));
    let wanted = "c.cdsl:2:41: error[unknown-interface]: unknown interface `Lasre` (did you mean `Laser`?)\n";
    assert_eq!(err, wanted);
    assert_eq!(files(folder.path()).len(), 1);
    let (_, _, err) = rcgen(folder.path(), &["c.cdsl", "--format", "json"]);
    for line in err.lines() {
        let value: serde_json::Value = serde_json::from_str(line).expect("one JSON object a line");
        assert_eq!(value["start"]["line"], 2);
    }
    assert_eq!(err.lines().count(), 1);
}

#[test]
fn usage_errors_and_system_errors_have_exit_codes() {
    let folder = folder(CDSL);
    let folder = folder.path();
    assert_eq!(rcgen(folder, &["c.cdsl", "--nonsense"]).0, 2);
    assert_eq!(rcgen(folder, &["c.idsl"]).0, 2);
    assert_eq!(rcgen(folder, &[]).0, 2);
    let (code, _, err) = rcgen(folder, &["c.cdsl", "--middleware", "ros"]);
    assert_eq!(code, 2);
    assert!(err.contains("ros2"), "{err}");
    let (code, _, err) = rcgen(folder, &["missing.cdsl"]);
    assert_eq!(code, 3);
    assert_eq!(
        err,
        "rcgen: error: missing.cdsl: No such file or directory\n"
    );
    assert_eq!(files(folder).len(), 1);
}

/// Files that are named by two paths are checked, formatted and reported once.
#[test]
fn files_that_are_named_twice_count_once() {
    let folder = folder(&CDSL.replace("Laser;", "Lasr;"));
    let name = folder.path().file_name().expect("a name").to_string_lossy();
    let again = format!("../{name}/c.cdsl");
    let args = ["check", ".", "c.cdsl", &again, ".", "--format", "short"];
    let (code, _, err) = rcgen(folder.path(), &args);
    assert_eq!(code, 1, "{err}");
    assert_eq!(err.matches("error[unknown-interface]").count(), 1, "{err}");
    let args = ["fmt", "--check", ".", "c.cdsl", &again];
    let (code, out, err) = rcgen(folder.path(), &args);
    assert_eq!((code, out.lines().count()), (1, 1), "{out}{err}");
}

/// A mesh that is there, but cannot be read, is a finding of the file that names it.
#[test]
fn meshes_are_read_when_a_scene_is_checked() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |file: &str, text: &str| {
        std::fs::write(folder.path().join(file), text).expect("a file");
    };
    write("cut.stl", "solid x\nfacet normal 0 0 1\n outer loop\n");
    write("right.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write(
        "w.xml",
        "<innerModel>\n<mesh id=\"a\" file=\"cut.stl\"/>\n<mesh id=\"b\" file=\"right.obj\"/>\n\
         <mesh id=\"c\" file=\"cut.stl\"/>\n</innerModel>\n",
    );
    let (code, _, err) = rcgen(folder.path(), &["check", "w.xml", "--format", "short"]);
    assert_eq!(code, 0, "{err}");
    let found: Vec<&str> = err.lines().collect();
    for (line, id) in [(2, "a"), (4, "c")] {
        let wanted = format!(
            "w.xml:{line}:2: warning[unreadable-mesh]: `{id}` has no body: `cut.stl`: line 2: \
             the file is cut"
        );
        assert!(found.iter().any(|l| l.starts_with(&wanted)), "{err}");
    }
    assert_eq!(found.len(), 2, "{err}");
}

/// A generation that was killed may leave files under other names, also beside those of the user.
#[test]
fn what_a_killed_generation_left_is_removed() {
    let folder = folder(CDSL);
    assert_eq!(rcgen(folder.path(), &["c.cdsl"]).0, 0);
    let left = folder.path().join("src/main.rs.rcgen-new");
    let own = folder.path().join("src/own.rs.rcgen-new");
    for path in [&left, &own] {
        std::fs::write(path, "half").expect("a file");
    }
    let (code, out, err) = rcgen(folder.path(), &["c.cdsl"]);
    assert_eq!(
        (code, out.trim()),
        (0, "remove ./src/main.rs.rcgen-new"),
        "{err}"
    );
    assert!(!left.exists() && own.exists());
}

#[test]
fn names_that_collide_in_rust_are_reported() {
    let folder = folder(
        "import \"a.idsl\";\nComponent c { Communications { requires I; }; language rust; };",
    );
    let idsl = "module M { interface I {\nvoid getData();\nvoid get_data(); }; };";
    std::fs::write(folder.path().join("a.idsl"), idsl).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["c.cdsl", "--format", "short"]);
    assert_eq!(code, 1);
    assert_eq!(
        err,
        "a.idsl:3:6: error[name-collision]: operations `getData` and `get_data` are both `get_data` in Rust; the other one at a.idsl:2:6\n"
    );
}

#[test]
fn every_file_is_checked_and_invalid_utf8_is_reported() {
    let folder = folder(&CDSL.replace("Laser;", "Lasr;"));
    std::fs::write(folder.path().join("bytes.idsl"), [0xff, 0xfe]).expect("a file");
    let args = ["check", "bytes.idsl", "c.cdsl", "--format", "short"];
    let (code, _, err) = rcgen(folder.path(), &args);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("bytes.idsl:1:1: error[not-utf8]"), "{err}");
    assert!(err.contains("error[unknown-interface]"), "{err}");
}

/// A file in Latin-1, as robots have them, also behind a byte order mark.
#[test]
fn a_file_in_another_encoding_is_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = b"<innerModel>\n<!-- mu\xf1eca --></innerModel>\n";
    let marked = [b"\xef\xbb\xbf", &text[..]].concat();
    for (name, bytes) in [("latin.xml", &text[..]), ("marked.xml", &marked)] {
        std::fs::write(folder.path().join(name), bytes).expect("a file");
        for args in [&["check", name][..], &["fmt", name]] {
            let (code, _, err) = rcgen(folder.path(), args);
            assert_eq!(code, 1, "{err}");
            assert!(err.contains(&format!("{name}:2:8")), "{err}");
            assert!(err.contains("this file is not UTF-8"), "{err}");
        }
    }
}

#[test]
fn a_state_machine_is_checked_with_its_component() {
    let folder = folder(&CDSL.replace("language", "statemachine \"c.smdsl\"; language"));
    let folder = folder.path();
    let check = |files: &[&str]| {
        let (code, _, err) = rcgen(folder, &[&["check", "--format", "short"], files].concat());
        (code, err)
    };
    let missing =
        "c.cdsl:2:83: error[statemachine-not-found]: cannot find `c.smdsl`; searched in .";
    let help = "(the path is relative to the .cdsl file)";
    assert_eq!(check(&["c.cdsl"]), (1, format!("{missing} {help}\n")));
    std::fs::write(folder.join("d.smdsl"), "d { initial_state a; }").expect("a file");
    let help = "(did you mean `d.smdsl`?)";
    assert_eq!(check(&["c.cdsl"]), (1, format!("{missing} {help}\n")));

    std::fs::write(folder.join("c.smdsl"), "c { states a; }").expect("a file");
    let wrong = "c.smdsl:1:1: error[no-initial-state]: the machine has no initial state (add `initial_state NAME;`)\n";
    assert_eq!(check(&["c.cdsl"]), (1, wrong.to_owned()));
    assert_eq!(check(&["c.smdsl"]), (1, wrong.to_owned()));
    assert_eq!(check(&["c.cdsl", "c.smdsl"]), (1, wrong.to_owned()));

    let right = "c { initial_state a; states b; transitions { a => b; }; };";
    std::fs::write(folder.join("c.smdsl"), right).expect("a file");
    assert_eq!(check(&["c.cdsl"]), (0, String::new()));
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    let machine = folder.join("generated/src/machine.rs");
    let machine = std::fs::read_to_string(machine).expect("it was generated");
    assert!(machine.contains("AToB"), "{machine}");
    std::fs::write(folder.join("c.smdsl"), right.replace('b', "c")).expect("a file");
    assert_eq!(rcgen(folder, &["c.cdsl", "--check"]).0, 1);
}

#[test]
fn a_folder_is_checked_recursively() {
    let folder = folder(&CDSL.replace("Laser;", "Lasr;"));
    let folder = folder.path();
    for (path, text) in [
        ("etc/config.toml", "[parameter]\n"),
        ("Cargo.toml", "not = \"a configuration\"\n"),
        ("deeper/m.smdsl", "m { };"),
        ("deeper/m.scxml", "<scxml>\n<state/></scxml>"),
        ("target/m.smdsl", "m { };"),
        (".hidden/m.smdsl", "m { };"),
    ] {
        let path = folder.join(path);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    let (code, _, err) = rcgen(folder, &["check", ".", "--format", "short"]);
    assert_eq!(code, 1);
    let places: Vec<String> = err
        .lines()
        .filter_map(|line| Some(line.split_once(']')?.0.replace('\\', "/")))
        .collect();
    assert_eq!(
        places,
        [
            "./c.cdsl:2:41: error[unknown-interface",
            "./deeper/m.smdsl:1:1: error[no-initial-state",
            "./deeper/m.scxml:2:2: error[missing-attribute",
            "./etc/config.toml:1:2: error[unknown-key",
        ]
    );
    std::fs::create_dir(folder.join("empty")).expect("a folder");
    let (code, _, err) = rcgen(folder, &["check", "empty", "--format", "short"]);
    assert_eq!(code, 1);
    assert!(err.contains("error[nothing-to-check]"), "{err}");
}

#[test]
fn without_a_file_the_workspace_is_checked_and_formatted() {
    let outside = tempfile::tempdir().expect("a folder");
    let (code, _, err) = rcgen(outside.path(), &["check"]);
    assert_eq!(code, 2);
    assert!(err.contains("this folder is in no workspace"), "{err}");
    let workspace = outside.path().join("robot");
    let (code, _, err) = rcgen(outside.path(), &["init", "robot"]);
    assert_eq!(code, 0, "{err}");
    let file = workspace.join("interfaces/A.idsl");
    std::fs::write(&file, "module A { struct S { itn x } };").expect("a file");
    let below = workspace.join("components");
    let (code, _, err) = rcgen(&below, &["check", "--format", "short"]);
    assert_eq!(code, 1);
    assert!(
        err.contains("interfaces/A.idsl:1:23: error[unknown-type]: unknown type `itn`"),
        "{err}"
    );
    let (code, _, err) = rcgen(&below, &["fix", "--likely"]);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = rcgen(&below, &["check"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let (code, _, err) = rcgen(&below, &["fmt"]);
    assert_eq!(code, 0, "{err}");
    let text = std::fs::read_to_string(file).expect("a text");
    assert!(text.contains("        int x;\n"), "{text}");
}

/// A component with parameters in two files and a rule across both.
#[test]
fn imported_parameters_are_part_of_the_component() {
    let folder = folder(
        "Component c { Communications { }; language rust; parameters \"shared/../c.pdsl\"; };",
    );
    let folder = folder.path();
    let write = |path: &str, text: &str| std::fs::write(folder.join(path), text).expect("a file");
    std::fs::create_dir(folder.join("shared")).expect("a folder");
    write(
        "c.pdsl",
        "import \"shared/base.pdsl\";\nComponentParams c { low int 1; require low < high \"say \\\"# low\"; };",
    );
    write("shared/base.pdsl", "ComponentParams base { high int 5; };");
    succeeds(folder, &["c.cdsl"]);
    let schema = std::fs::read_to_string(folder.join("generated/src/parameters.rs"));
    let schema = schema.expect("the parameters");
    assert!(schema.contains("pub high: i32"), "{schema}");
    assert!(schema.contains(r#"say \"\u0023 low"#), "{schema}");
    write(
        "shared/base.pdsl",
        "// Words.\nComponentParams base { high int 5; };",
    );
    succeeds(folder, &["--check", "c.cdsl"]);
    write("shared/base.pdsl", "ComponentParams base { high int 6; };");
    assert_eq!(rcgen(folder, &["--check", "c.cdsl"]).0, 1);
    write("etc/config.toml", "[parameters]\nlow = 9\n");
    let short = |file: &str| rcgen(folder, &["check", file, "--format", "short"]);
    let (code, _, err) = short("etc/config.toml");
    assert_eq!(code, 1);
    assert!(
        err.ends_with("etc/config.toml:2:7: error[rule-broken]: `low` breaks a rule: say \"# low (`low < high` does not hold: `low` is 9, `high` is 6 by default)\n"),
        "{err}"
    );
    write(
        "shared/base.pdsl",
        "import \"../c.pdsl\"; ComponentParams base { high int 6; };",
    );
    for file in ["c.pdsl", "./c.pdsl", "c.cdsl"] {
        assert_eq!(
            short(file),
            (
                1,
                String::new(),
                "shared/base.pdsl:1:8: error[import-cycle]: cyclic import: c.pdsl → base.pdsl → c.pdsl\n"
                    .to_owned()
            )
        );
    }
}

#[test]
fn a_component_with_invalid_utf8_is_reported() {
    let folder = folder(CDSL);
    std::fs::write(folder.path().join("c.cdsl"), [0xff, 0xfe]).expect("a file");
    for args in [
        &["c.cdsl", "--format", "short"][..],
        &["stubs", "c.cdsl", "--format", "short"],
    ] {
        let wanted = "c.cdsl:1:1: error[not-utf8]: this file is not UTF-8\n";
        assert_eq!(
            rcgen(folder.path(), args),
            (1, String::new(), wanted.to_owned())
        );
    }
}

/// Functions that generated code adds to structures and clients avoid names of the user.
#[test]
fn generated_names_avoid_names_of_the_user() {
    let folder = folder(
        "import \"a.idsl\";\nComponent c { Communications { publishes I; }; language rust; };",
    );
    let idsl = "module M { struct S { sequence<byte, 9> data;\nstring<3> data_mut; };\ninterface I { void a(S s);\nvoid loan_a(S s); }; };";
    std::fs::write(folder.path().join("a.idsl"), idsl).expect("a file");
    succeeds(folder.path(), &["c.cdsl"]);
    let code = folder.path().join("interfaces/generated/src/m.rs");
    let code = std::fs::read_to_string(code).expect("the module");
    for function in [
        "pub fn data_mut(&self) -> Result<&str, rc_middleware::DecodeError> {",
        "pub fn data_mut_(&mut self) -> &mut [u8] {",
        "pub fn loan_a(&mut self, s: &super::S)",
        "pub fn loan_a_(",
    ] {
        assert!(code.contains(function), "{function}\n{code}");
    }
}

#[test]
fn exceptions_with_equal_names_are_rejected() {
    let folder = folder(
        "import \"a.idsl\";\nComponent c { Communications { requires I; }; language rust; };",
    );
    let b = "module B { exception Failed { int code; }; };";
    let a = "import \"b.idsl\";\nmodule A { exception Failed { };\ninterface I { void go() throws Failed, B::Failed; }; };";
    std::fs::write(folder.path().join("a.idsl"), a).expect("a file");
    std::fs::write(folder.path().join("b.idsl"), b).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["c.cdsl", "--format", "short"]);
    assert_eq!(code, 1);
    assert_eq!(
        err,
        "b.idsl:1:22: error[name-collision]: exceptions `Failed` and `Failed` are both `Failed` in Rust; the other one at a.idsl:2:22\n"
    );
}

#[test]
fn dependencies_are_the_workers_own() {
    let with = |dependencies: &str| {
        CDSL.replace(
            "language",
            &format!("dependencies {{ {dependencies} }}; language"),
        )
    };
    let folder = folder(&with(
        "libm \"0.2\"; map \"../map\"; serde { version \"1\"; features \"derive\", \"rc\"; };",
    ));
    let folder = folder.path();
    succeeds(folder, &["c.cdsl"]);
    let manifest = folder.join("Cargo.toml");
    let text = std::fs::read_to_string(&manifest).expect("a manifest");
    let lines = "c_generated = { path = \"generated\" }\nlibm = \"0.2\"\nmap = { path = \"../map\" }\n\
                 serde = { version = \"1\", features = [\"derive\", \"rc\"] }\n\n[dev-dependencies]\n";
    assert!(text.contains(lines), "{text}");
    succeeds(folder, &["check", "c.cdsl"]);
    // The manifest is written once and compared afterwards.
    std::fs::write(
        folder.join("c.cdsl"),
        with("libm \"0.3\"; map \"../map\"; hound \"3\";"),
    )
    .expect("a file");
    let (code, _, err) = rcgen(folder, &["c.cdsl", "--format", "short"]);
    let wanted = "c.cdsl:2:85: warning[dependency-differs]: ./Cargo.toml has another dependency `libm`: \"0.2\" (write `libm = \"0.3\"` there)\n\
                  c.cdsl:2:111: warning[dependency-differs]: ./Cargo.toml does not have the dependency `hound` (write `hound = \"3\"` there)\n";
    assert_eq!((code, err.as_str()), (0, wanted));
    let stubs = succeeds(folder, &["stubs", "c.cdsl"]);
    assert_eq!(
        stubs,
        "// ./Cargo.toml: into [dependencies]\nhound = \"3\"\n"
    );
    std::fs::write(
        &manifest,
        text.replace("libm = \"0.2\"", "libm = \"0.3\"\nhound.workspace = true"),
    )
    .expect("a file");
    succeeds(folder, &["c.cdsl"]);
    for wrong in [
        "rc-runtime \"1\";",
        "c \"1\";",
        "libm { };",
        "libm { verison \"1\"; };",
        "libm { version 1; };",
    ] {
        std::fs::write(folder.join("c.cdsl"), with(wrong)).expect("a file");
        let (code, _, err) = rcgen(folder, &["check", "c.cdsl", "--format", "short"]);
        assert!(
            code == 1 && err.contains("error[bad-dependency]"),
            "{wrong}: {err}"
        );
    }
}

/// The declarations of a description with errors are unknown.
#[test]
fn errors_of_a_component_cause_none_in_its_configuration() {
    for (cdsl, pdsl) in [
        ("", "ComponentParams c { x int 3; };"),
        (
            "Component c { Communications { }; language rust; parameters \"gone.pdsl\"; };",
            "",
        ),
        (
            "Component c { Communications { }; language rust; parameters \"c.pdsl\"; };",
            "ComponentParams c { x int 3; y flout 4; };",
        ),
    ] {
        let folder = folder(cdsl);
        let folder = folder.path();
        std::fs::create_dir(folder.join("etc")).expect("a folder");
        std::fs::write(folder.join("c.pdsl"), pdsl).expect("a file");
        std::fs::write(folder.join("etc/config.toml"), "[parameters]\nx = 3\n").expect("a file");
        let (code, _, err) = rcgen(folder, &["check", "--format", "short", "etc/config.toml"]);
        assert_eq!(code, 1, "{err}");
        assert!(!err.contains("unknown-parameter"), "{err}");
    }
}

#[test]
fn a_component_without_a_library_gets_none() {
    let folder = folder(CDSL);
    let folder = folder.path();
    std::fs::create_dir(folder.join("src")).expect("a folder");
    for (file, text) in [("main.rs", "mod other;\n"), ("other.rs", "")] {
        std::fs::write(folder.join("src").join(file), text).expect("a file");
    }
    let (code, _, err) = rcgen(folder, &["c.cdsl"]);
    let hint = "c.cdsl: the component has no src/lib.rs; `rcgen stubs c.cdsl` prints it\n";
    assert!(code == 0 && err.ends_with(hint), "{code} {err}");
    assert!(!folder.join("src/lib.rs").exists());
    std::fs::remove_file(folder.join("src/main.rs")).expect("it was there");
    succeeds(folder, &["c.cdsl"]);
    assert!(folder.join("src/main.rs").exists() && folder.join("src/lib.rs").exists());
}

#[test]
fn one_folder_holds_one_component() {
    let folder = folder(CDSL);
    let folder = folder.path();
    let out = succeeds(folder, &["c.cdsl", "./c.cdsl", "--dry-run"]);
    assert_eq!(out.matches("src/main.rs\n").count(), 1, "{out}");
    let other = CDSL.replace("Component c", "Component d");
    std::fs::write(folder.join("d.cdsl"), other).expect("a file");
    std::fs::create_dir(folder.join("interfaces")).expect("a folder");
    let before = files(folder);
    let (code, _, err) = rcgen(folder, &["."]);
    let wanted = "./c.cdsl and ./d.cdsl are in one folder; a folder holds one component\n";
    assert!(code == 2 && err.contains(wanted), "{code} {err}");
    assert_eq!(changed(&before, &files(folder)), [""; 0]);
}

#[test]
fn components_are_parts_of_packages_of_cmake() {
    let parts = "dependencies { libm { version \"1\"; components \"core\"; }; }; language";
    let folder = folder(&CDSL.replace("language", parts));
    let (code, _, err) = rcgen(folder.path(), &["c.cdsl", "--format", "short"]);
    let wanted = "error[bad-dependency]: `libm` cannot be a dependency: a crate has no components";
    assert!(code == 1 && err.contains(wanted), "{code} {err}");
}

#[test]
fn the_name_interfaces_is_reserved() {
    let named = folder(&CDSL.replace("Component c", "Component Interfaces"));
    let depending =
        folder(&CDSL.replace("language", "dependencies { interfaces \"1\"; }; language"));
    for (folder, wanted) in [
        (
            named,
            "error[name-collision]: a component cannot be called `Interfaces`",
        ),
        (
            depending,
            "error[bad-dependency]: `interfaces` cannot be a dependency: it is the crate of the interfaces",
        ),
    ] {
        let (code, _, err) = rcgen(folder.path(), &["c.cdsl", "--format", "short"]);
        assert!(code == 1 && err.contains(wanted), "{code} {err}");
    }
}
