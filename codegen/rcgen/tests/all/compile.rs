//! Generated code compiles without a warning and equals the output of rustfmt.

use rc_test_support::share_builds;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const RCGEN: &str = env!("CARGO_BIN_EXE_rcgen");
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn run(command: &mut Command) -> Output {
    let output = command.output().expect("a program that starts");
    let (out, err) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    output
}

/// Runs `cargo` in a workspace with the target folder of this test run, so that nothing is built
/// twice.
fn cargo(workspace: &Path, args: &[&str]) {
    let target = Path::new(RCGEN)
        .ancestors()
        .nth(2)
        .expect("target/debug/rcgen");
    run(Command::new(env!("CARGO"))
        .args(args)
        .current_dir(workspace)
        .env("CARGO_TARGET_DIR", target));
}

/// An empty workspace beside the components of `tests/compile`.
fn workspace(folder: &Path) -> PathBuf {
    let workspace = folder.join("robot");
    run(Command::new(RCGEN)
        .args(["init", "--framework", ROOT])
        .arg(&workspace));
    share_builds(&workspace, Path::new("components/features"));
    workspace
}

/// Copies a component of `tests/compile` and generates it.
fn generate(workspace: &Path, name: &str, middleware: &str) {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compile");
    let component = workspace.join("components").join(name);
    std::fs::create_dir(&component).expect("a folder");
    for entry in std::fs::read_dir(fixtures.join(name)).expect("the fixtures") {
        let path = entry.expect("a fixture").path();
        let text = std::fs::read_to_string(&path).expect("a text");
        let root = Path::new(ROOT).canonicalize().expect("this project");
        let text = text.replace("FRAMEWORK", &root.to_string_lossy());
        std::fs::write(component.join(path.file_name().expect("a name")), text).expect("a file");
    }
    run(Command::new(RCGEN)
        .arg(component.join(format!("{name}.cdsl")))
        .args(["--middleware", middleware]));
    let configuration = component.join("config.toml");
    if configuration.exists() {
        std::fs::rename(configuration, component.join("etc/config.toml")).expect("to move");
    }
    for test in ["checks.rs", "fakes.rs"] {
        if component.join(test).exists() {
            let tests = component.join("tests").join(test);
            std::fs::rename(component.join(test), tests).expect("to move");
        }
    }
}

/// A generated component whose interface is then extended, with the output of `rcgen stubs` pasted
/// at the printed locations.
fn paste(workspace: &Path) {
    let component = workspace.join("components/pasted");
    std::fs::create_dir(&component).expect("a folder");
    let write = |file: &str, text: &str| {
        std::fs::write(component.join(file), text).expect("a file");
    };
    let cdsl = "import \"M.idsl\";\nComponent pasted { Communications { implements Voice; SLOTS }; language rust; };\n";
    write("pasted.cdsl", &cdsl.replace("SLOTS", ""));
    write("M.idsl", "module M { interface Voice { void hush(); }; };");
    let cdsl_path = component.join("pasted.cdsl");
    run(Command::new(RCGEN).arg(&cdsl_path));
    write(
        "pasted.cdsl",
        &cdsl
            .replace(
                "SLOTS",
                "subscribesTo Goal as goals; requires Voice(dds) as other;",
            )
            .replace("language rust", "statemachine \"m.smdsl\"; language rust"),
    );
    write(
        "m.smdsl",
        "defaultMachine { initial_state initialize; states compute; end_state finalize;
            transitions { initialize => compute; compute => compute, finalize; }; };",
    );
    write(
        "M.idsl",
        "module M {
            struct Point { float x; };
            exception Refused { string why; };
            interface Voice {
                /// Says it.
                bool say(string text, @range(min=0) int loudness) throws Refused;
                void hush();
                sequence<Point> path(Point from, out sequence<string> aLongName, out sequence<string> anotherLongName);
            };
            interface Goal { void reached(Point at); };
        };",
    );
    run(Command::new(RCGEN).arg(&cdsl_path));
    let output = run(Command::new(RCGEN).arg("stubs").arg(&cdsl_path));
    let stubs = String::from_utf8(output.stdout).expect("a text");
    let file = component.join("src/specific_worker.rs");
    let worker = std::fs::read_to_string(&file).expect("a text");
    let (mut lines, mut end) = (worker.lines().collect::<Vec<&str>>(), Vec::new());
    // The functions of states follow, all of which may be left out.
    let (stubs, _) = stubs
        .split_once("\n// Of `impl")
        .expect("functions of states");
    for piece in stubs.split("\n// ") {
        let (heading, code) = piece.split_once('\n').expect("a heading");
        match heading.split_once(": into this `impl ") {
            Some((place, _)) => {
                let line = place.rsplit(':').next().expect("a line");
                lines.insert(line.parse().expect("a number"), code);
            }
            None => end.extend(["", code.trim_end()]),
        }
    }
    lines.extend(end);
    std::fs::write(&file, lines.join("\n") + "\n").expect("a file");
    let output = run(Command::new(RCGEN).arg("stubs").arg(&cdsl_path));
    let left = String::from_utf8(output.stdout).expect("a text");
    assert!(left.starts_with("// Of `impl StateMachine"), "{left}");
    assert!(left.lines().all(|line| line.starts_with("//")), "{left}");
}

/// Two components and a library. The library takes a value of one component for the other one.
fn share(workspace: &Path) {
    let write = |file: &str, text: &str| {
        let path = workspace.join(file);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    write(
        "scans/Cargo.toml",
        "[package]\nname = \"scans\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n\
         [dependencies]\ninterfaces.workspace = true\n",
    );
    write(
        "scans/src/lib.rs",
        "//! What components do with scans.\n\nuse interfaces::robo_comp_laser::TData;\n\n\
         /// The nearest echo.\n\
         pub fn nearest(scan: &[TData]) -> Option<&TData> {\n    \
         scan.iter().min_by(|a, b| a.dist.total_cmp(&b.dist))\n}\n",
    );
    for (name, role) in [("scanner", "implements"), ("viewer", "requires")] {
        write(
            &format!("components/{name}/{name}.cdsl"),
            &format!(
                "import \"Laser.idsl\";\nComponent {name} {{ Communications {{ {role} Laser; }}; \
                 language rust; dependencies {{ scans \"../../scans\"; }}; }};\n"
            ),
        );
        let cdsl = workspace.join(format!("components/{name}/{name}.cdsl"));
        run(Command::new(RCGEN).arg(cdsl));
    }
    // The reply of one component is an argument of the other one's library.
    write(
        "components/viewer/tests/shared.rs",
        "//! Values of another component.\n\nuse scanner as _;\nuse viewer as _;\n\n#[test]\nfn one_type() {\n    \
         let echo = scanner_generated::TData::default();\n    \
         let scan: viewer_generated::TLaserData = vec![echo];\n    \
         assert_eq!(scans::nearest(&scan), scan.first());\n}\n",
    );
    let manifest = workspace.join("components/viewer/Cargo.toml");
    let text = std::fs::read_to_string(&manifest).expect("a manifest");
    let text = text
        + "scanner = { path = \"../scanner\" }\n\
           scanner_generated = { path = \"../scanner/generated\" }\nscans = { path = \"../../scans\" }\n";
    std::fs::write(manifest, text).expect("to write");
}

/// A component as `rcgen new` alone writes it.
fn start_new(workspace: &Path) {
    let args = [
        "new",
        "fresh",
        "--requires",
        "Laser,DifferentialRobot",
        "--publishes",
        "LaserPub",
        "--period",
        "50ms",
    ];
    run(Command::new(RCGEN).args(args).current_dir(workspace));
}

/// All machines of `smdsl/tests/shapes`, generated for components of their own, as modules of one
/// crate: a crate for each would take long to compile. Its tests run each machine to its end.
fn shapes(folder: &Path, workspace: &Path) {
    let elsewhere = folder.join("shapes");
    run(Command::new(RCGEN)
        .args(["init", "--framework", ROOT])
        .arg(&elsewhere));
    let files = std::fs::read_dir(Path::new(ROOT).join("smdsl/tests/shapes"));
    let files = files
        .expect("the machines")
        .map(|entry| entry.expect("a file").path());
    let mut names: Vec<String> = files
        .map(|file| {
            let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
            let component = elsewhere.join("components").join(&name);
            std::fs::create_dir(&component).expect("a folder");
            std::fs::copy(&file, component.join("machine.smdsl")).expect("a copy");
            let cdsl = format!(
                "Component {name} {{ Communications {{ }}; language rust; statemachine \"machine.smdsl\"; }};\n"
            );
            std::fs::write(component.join(format!("{name}.cdsl")), cdsl).expect("a file");
            name
        })
        .collect();
    names.sort_unstable();
    assert_eq!(names.len(), 7);
    run(Command::new(RCGEN).arg(&elsewhere));
    let home = workspace.join("components/shapes");
    let write = |file: &str, text: &str| {
        let path = home.join(file);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    };
    let (mut modules, mut runs) = (String::new(), String::new());
    for name in &names {
        let generated = elsewhere.join("components").join(name).join("generated");
        let manifest = std::fs::read_to_string(generated.join("Cargo.toml")).expect("a manifest");
        let manifest = manifest.replace(&format!("{name}_generated"), "shapes");
        let manifest = manifest.replace("[features]", "[features]\ndefault = [\"testing\"]");
        // One folder less lies between the crate and the workspace.
        let manifest = manifest.replace("\"../../../", "\"../../");
        write("Cargo.toml", &manifest);
        for entry in std::fs::read_dir(generated.join("src")).expect("code") {
            let path = entry.expect("a file").path();
            let code = std::fs::read_to_string(&path).expect("a text");
            let code = code.replace("crate::", &format!("crate::{name}::"));
            let file = path.file_name().expect("a name").to_string_lossy();
            let file = if file == "lib.rs" { "mod.rs" } else { &*file };
            write(&format!("src/{name}/{file}"), &code);
            if let Some((_, events)) = code.split_once("pub enum MachineEvent {") {
                let events = events.split_once('}').expect("an end").0.lines();
                let events = events.map(str::trim).filter(|line| line.ends_with(','));
                let events: String = events.map(|event| format!(" {event}")).collect();
                assert!(!events.is_empty(), "{name} has no events");
                runs += &format!("    {name}:{events};\n");
            }
        }
        modules += &format!("pub mod {name};\n");
    }
    write(
        "src/lib.rs",
        &format!("//! Machines as users write them.\n\n{modules}"),
    );
    let (before, after) = include_str!("../compile/shapes.rs")
        .split_once("    // MACHINES\n")
        .expect("the place of the machines");
    assert_eq!(runs.lines().count(), names.len());
    write("tests/shapes.rs", &format!("{before}{runs}{after}"));
}

/// Every construct of the languages, names that generated code uses itself, pasted handlers, a
/// component without its optional peers, and what `rcgen init` and `rcgen new` write.
#[test]
fn every_construct_compiles() {
    let folder = tempfile::tempdir().expect("a folder");
    let workspace = workspace(folder.path());
    generate(&workspace, "everything", "iceoryx2");
    generate(&workspace, "awkward", "dds");
    generate(&workspace, "placed", "iceoryx2");
    generate(&workspace, "walker", "iceoryx2");
    generate(&workspace, "agent", "iceoryx2");
    generate(&workspace, "arm", "iceoryx2");
    generate(&workspace, "lone", "local");
    generate(&workspace, "aged", "local");
    generate(&workspace, "shelf", "local");
    start_new(&workspace);
    paste(&workspace);
    share(&workspace);
    shapes(folder.path(), &workspace);
    let mut packages = ["-p", "interfaces", "-p", "scans"]
        .map(str::to_owned)
        .to_vec();
    let mut programs = Vec::new();
    for name in [
        "everything",
        "awkward",
        "placed",
        "walker",
        "agent",
        "arm",
        "lone",
        "aged",
        "shelf",
        "fresh",
        "pasted",
        "scanner",
        "viewer",
    ] {
        packages.extend(["-p".to_owned(), name.to_owned()]);
        packages.extend(["-p".to_owned(), format!("{name}_generated")]);
        programs.extend(["--bin", name]);
    }
    let packages = packages.iter().map(String::as_str);
    let mut fmt = vec!["fmt", "--check"];
    fmt.extend(packages);
    cargo(&workspace, &fmt);
    for (name, uses) in [("placed", "rc-runtime"), ("shelf", "rc-middleware")] {
        let manifest = workspace.join(format!("components/{name}/Cargo.toml"));
        let text = std::fs::read_to_string(&manifest).expect("a manifest");
        std::fs::write(manifest, format!("{text}{uses}.workspace = true\n")).expect("to write");
    }
    let tests = ["worker", "checks", "fakes", "shared", "shapes"];
    let tests = tests.iter().flat_map(|name| ["--test", name]);
    let mut clippy = vec!["clippy", "--workspace", "--offline", "-q", "-j1", "--lib"];
    clippy.extend(programs);
    clippy.extend(tests.clone());
    clippy.extend(["--", "-D", "warnings"]);
    cargo(&workspace, &clippy);
    // Generated code is also executed.
    let mut test = vec!["test", "--workspace", "--offline", "-q"];
    test.extend(tests);
    cargo(&workspace, &test);
}

/// The committed code equals the output of a generation, including the crate of interfaces.
#[test]
fn committed_generated_code_is_fresh() {
    let output = run(Command::new(RCGEN).arg("--dry-run").arg(ROOT));
    let output = String::from_utf8(output.stdout).expect("a text");
    let components = output
        .lines()
        .filter(|line| line.ends_with("/etc/config.toml"));
    assert!(components.count() >= 16, "{output}");
    run(Command::new(RCGEN).arg("--check").arg(ROOT));
}
