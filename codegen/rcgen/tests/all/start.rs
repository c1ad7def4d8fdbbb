//! `rcgen init`, `new`, `generate` and `clean`: the first hour of a workspace.

use crate::folders::{changed, files, rcgen};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("a file")
}

fn succeeds(folder: &Path, args: &[&str]) -> String {
    let (code, out, err) = rcgen(folder, args);
    assert_eq!((code, err.as_str()), (0, ""), "{args:?}\n{out}");
    out
}

/// A workspace beside a framework in the same git repository.
fn workspace() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join(".git")).expect("a folder");
    write(&folder.path().join("rc/runtime/Cargo.toml"), "");
    succeeds(folder.path(), &["init", "my-robot", "--framework", "rc"]);
    let robot = folder.path().join("my-robot").canonicalize();
    (folder, robot.expect("a workspace"))
}

#[test]
fn a_workspace_that_can_be_given_away() {
    let (_folder, robot) = workspace();
    let manifest = read(&robot.join("Cargo.toml"));
    let framework = "rc-runtime = { path = \"../rc/runtime\" }\n";
    assert!(manifest.contains(framework), "{manifest}");
    for (file, part) in [
        ("README.md", "rcdeploy up --build deployments/my_robot.ddsl"),
        ("deployments/my_robot.ddsl", "Deployment my_robot\n"),
        (".gitignore", "/target\n"),
        ("interfaces/generated/src/lib.rs", "//! The types"),
    ] {
        let text = read(&robot.join(file));
        assert!(text.contains(part), "{file}: {text}");
    }
    succeeds(&robot, &["check", "."]);
    succeeds(&robot, &["fmt", "--check", "."]);
    let (code, _, err) = rcgen(&robot, &["init", "."]);
    assert_eq!(
        (code, err.as_str()),
        (2, "rcgen: error: . has a Cargo.toml already\n")
    );
    // Outside the repository, the dependency is a version or a URL.
    for (framework, dependency) in [
        ("0.1", "rc-runtime = \"0.1\"\n"),
        (
            "https://robots/rc?tag=v1",
            "rc-runtime = { git = \"https://robots/rc\", tag = \"v1\" }\n",
        ),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        succeeds(folder.path(), &["init", "robot", "--framework", framework]);
        let manifest = read(&folder.path().join("robot/Cargo.toml"));
        assert!(manifest.contains(dependency), "{manifest}");
    }
    // A path to a folder outside the repository is valid on this machine only.
    let folder = tempfile::tempdir().expect("a folder");
    let (code, _, err) = rcgen(folder.path(), &["init", "robot", "--framework", ROOT]);
    assert!(
        code == 0 && err.starts_with("note: the workspace builds on this machine only"),
        "{err}"
    );
}

#[test]
fn a_workspace_that_builds_into_the_target_folder_of_the_framework() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(ROOT).canonicalize().expect("this project");
    let init = |framework: &str| {
        let args = ["init", "robot", "--shared-target", "--framework", framework];
        rcgen(folder.path(), &args)
    };
    let (code, _, err) = init("0.1");
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("must be a folder with this project"), "{err}");
    let (code, _, err) = init(ROOT);
    assert_eq!(code, 0, "{err}");
    // Cargo compares the folder, the versions, and the profiles.
    let robot = folder.path().join("robot");
    let target = format!("target-dir = \"{}\"\n", root.join("target").display());
    let configuration = read(&robot.join(".cargo/config.toml"));
    assert!(configuration.contains(&target), "{configuration}");
    assert!(read(&robot.join("Cargo.lock")) == read(&root.join("Cargo.lock")));
    let profiles = |text: &str| {
        let manifest: toml_edit::DocumentMut = text.parse().expect("TOML");
        let table = manifest["profile"].as_table().expect("a table").clone();
        let mut profiles = table.into_inline_table();
        profiles.fmt();
        profiles.to_string()
    };
    let ours = profiles(&read(&root.join("Cargo.toml")));
    assert_eq!(profiles(&configuration), ours);
    assert!(ours.contains("pest"), "{ours}");
    // A package that a workspace does not have is a warning in its manifest.
    let manifest = read(&robot.join("Cargo.toml"));
    assert_eq!(manifest.matches("[profile.").count(), 1, "{manifest}");
    // Their programs are beside those of the components of the framework.
    let (code, _, err) = rcgen(&robot, &["new", "planner", "--language", "python"]);
    assert_eq!(code, 2, "{err}");
    let other = root.join("components/planner");
    let wanted = format!("cannot be called `planner`: {} has", other.display());
    assert!(err.contains(&wanted), "{err}");
    succeeds(&robot, &["new", "my_planner"]);
}

#[test]
fn a_component_from_any_folder_of_the_workspace() {
    let (folder, robot) = workspace();
    let inside = robot.join("deployments");
    let args = [
        "new",
        "guard",
        "--requires",
        "Laser,DifferentialRobot",
        "--publishes",
        "LaserPub",
        "--period",
        "50ms",
    ];
    let out = succeeds(&inside, &args);
    assert!(
        out.starts_with("create ../components/guard/guard.cdsl\n"),
        "{out}"
    );
    let network = "in a network: Component guard { cdsl \"../components/guard/guard.cdsl\"; };\n";
    assert!(out.ends_with(network), "{out}");
    assert_eq!(
        read(&robot.join("components/guard/guard.cdsl")),
        "import \"Laser.idsl\";\nimport \"DifferentialRobot.idsl\";\nimport \"LaserPub.idsl\";\n\n\
         Component guard\n{\n    Communications\n    {\n        requires Laser, DifferentialRobot;\n        \
         publishes LaserPub;\n    };\n    language rust;\n    parameters \"guard.pdsl\";\n    period 50ms;\n};\n"
    );
    // It is generated, formatted, and a member.
    assert!(robot.join("components/guard/src/lib.rs").exists());
    assert!(
        robot
            .join("interfaces/generated/src/robo_comp_laser.rs")
            .exists()
    );
    succeeds(&robot, &["generate", "--check"]);
    succeeds(&robot, &["fmt", "--check", "."]);
    // An interface of the workspace, in a file of another name.
    write(
        &robot.join("interfaces/Hands.idsl"),
        "module Hands { interface Gripper { void grip(); }; };\n",
    );
    succeeds(&robot, &["new", "hand", "--implements", "Gripper"]);
    let cdsl = read(&robot.join("components/hand/hand.cdsl"));
    assert!(cdsl.starts_with("import \"Hands.idsl\";\n"), "{cdsl}");
    // Refusals write nothing.
    let before = files(&robot);
    for (args, reason) in [
        (
            &["new", "match"][..],
            "a component cannot be called `match`: it is a word of Rust",
        ),
        (
            &["new", "test"],
            "a component cannot be called `test`: it is a crate of Rust",
        ),
        (
            &["new", "a-b"],
            "a component cannot be called `a-b`: it must consist of letters, digits and `_`",
        ),
        (&["new", "guard"], "components/guard exists already"),
        (
            &["new", "x", "--requires", "Lasr"],
            "unknown interface `Lasr`; did you mean `Laser`?",
        ),
        (
            &["new", "x", "--from", "../rc/runtime/Cargo.toml"],
            "../rc/runtime/Cargo.toml is not a description of a component: `rcgen check` says why",
        ),
    ] {
        let (code, out, err) = rcgen(&robot, args);
        assert_eq!(
            (code, out.as_str(), err),
            (2, "", format!("rcgen: error: {reason}\n"))
        );
    }
    let (code, _, err) = rcgen(&robot, &["new", "x", "--publishes", "Laser"]);
    assert_eq!(code, 1);
    assert!(
        err.contains("error[wrong-pattern]") && err.ends_with("components/x was removed again\n"),
        "{err}"
    );
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    // Outside a workspace, `new` is refused.
    let (code, _, err) = rcgen(folder.path(), &["new", "x"]);
    assert!(
        code == 2 && err.contains("in no workspace; make one with `rcgen init FOLDER`"),
        "{err}"
    );
}

#[test]
fn a_component_of_robocomp() {
    let (folder, robot) = workspace();
    let old = folder.path().join("old");
    write(
        &old.join("Tags.idsl"),
        "module Tags { interface Tags { int count(); }; };\n",
    );
    write(&old.join("old.pdsl"), "ComponentParams old { x int 3; };\n");
    write(
        &old.join("old.cdsl"),
        "import \"Tags.idsl\";\n// Finds tags.\nComponent OldOne\n{\n    Communications { requires Tags; };\n    \
         language Cpp11;\n    parameters \"old.pdsl\";\n};\n",
    );
    // Its comments are in Latin-1.
    std::fs::create_dir(old.join("src")).expect("a folder");
    std::fs::write(
        old.join("src/specificworker.cpp"),
        b"// QTimer f\xfcr\nvoid SpecificWorker::initialize()\n{\n    connect(&timer, SIGNAL(timeout()), this, SLOT(compute()));\n    timer.start(Period);\n    \
          InnerModel tree;\n}\n",
    )
    .expect("to write");
    let cdsl = |name: &str, language: &str| {
        assert_eq!(
            read(&robot.join(format!("components/{name}/{name}.cdsl"))),
            format!(
                "import \"Tags.idsl\";\n// Finds tags.\nComponent {name}\n{{\n    Communications {{ requires Tags; }};\n    \
                 language {language};\n    parameters \"old.pdsl\";\n}};\n"
            )
        );
    };
    let words = [
        "new",
        "tags",
        "--from",
        "../old/old.cdsl",
        "--language",
        "rust",
    ];
    let (code, out, err) = rcgen(&robot, &words);
    assert_eq!(code, 0, "{out}{err}");
    assert!(!err.contains("SIGNAL"), "{err}");
    cdsl("tags", "rust");
    assert!(robot.join("components/tags/generated/src/lib.rs").exists());
    // Without an option, it keeps its language.
    let (code, out, err) = rcgen(&robot, &["new", "marks", "--from", "../old/old.cdsl"]);
    assert_eq!(code, 0, "{out}{err}");
    cdsl("marks", "cpp");
    let lines = [
        "4: `SIGNAL(`: no signals of Qt",
        "4: `SLOT(`: no slots of Qt",
        "5: `timer.start`: the runtime runs compute() once a period",
        "6: `InnerModel`: no tree of InnerModel in C++",
    ];
    for line in lines {
        assert!(
            err.contains(&format!("src/specificworker.cpp:{line}")),
            "{err}"
        );
    }
    assert!(!err.contains("QTimer"), "{err}");
    for file in ["generated/testing.h", "tests/worker_test.cpp"] {
        assert!(robot.join("components/marks").join(file).exists());
    }
    // A worker without a test has none: the file for cmake names no test.
    for file in ["tests/worker_test.cpp", "CMakeLists.txt"] {
        std::fs::remove_file(robot.join("components/marks").join(file)).expect("to remove");
    }
    succeeds(&robot, &["generate", "components/marks/marks.cdsl"]);
    let cmake = read(&robot.join("components/marks/CMakeLists.txt"));
    assert!(cmake.contains("target_sources") && !cmake.contains("robocomp_test"));
    let path = robot.join("components/marks/marks.cdsl");
    let parts = "dependencies { Eigen3 \"3.4\"; OpenCV { components \"core\", \"imgproc\"; }; };\n    parameters";
    write(&path, &read(&path).replace("parameters", parts));
    succeeds(&robot, &["generate", "components/marks/marks.cdsl"]);
    let cmake = read(&robot.join("components/marks/generated/component.cmake"));
    let found = "find_package(Eigen3 3.4 REQUIRED)\nfind_package(OpenCV REQUIRED COMPONENTS core imgproc)\n";
    assert!(cmake.contains(found), "{cmake}");
    // A window keeps its signals and its form.
    let with_window =
        "Component Pane { Communications { }; language Cpp11; gui Qt(QMainWindow); };\n";
    write(&old.join("pane.cdsl"), with_window);
    write(&old.join("src/mainUI.ui"), "<ui/>\n");
    let (code, out, err) = rcgen(&robot, &["new", "pane", "--from", "../old/pane.cdsl"]);
    assert_eq!(code, 0, "{out}{err}");
    assert!(!err.contains("SIGNAL"), "{err}");
    let pane = robot.join("components/pane");
    assert_eq!(read(&pane.join("src/mainUI.ui")), "<ui/>\n");
    let worker = read(&pane.join("generated/genericworker.h"));
    let base = "class GenericWorker : public rc::Window<QMainWindow>, public Ui::guiDlg {\n";
    assert!(worker.contains(base), "{worker}");
    assert!(read(&pane.join("src/specificworker.h")).contains("Q_OBJECT"));
}

#[test]
fn a_workspace_that_names_its_members() {
    let (_folder, robot) = workspace();
    let manifest = read(&robot.join("Cargo.toml"));
    let listed = manifest.replace("\"components/*\", \"components/*/generated\", ", "");
    write(&robot.join("Cargo.toml"), &listed);
    let out = succeeds(&robot, &["new", "guard"]);
    assert!(out.contains("\nupdate Cargo.toml\nin a network: "), "{out}");
    let wanted = "members = [\"interfaces/generated\", \"components/guard\"]\n";
    assert!(read(&robot.join("Cargo.toml")).contains(wanted));
    // Folders in which imports are looked for, too.
    let more = "\n[workspace.metadata.robocomp]\ninclude = [\"../shared\"]\n";
    write(
        &robot.join("Cargo.toml"),
        &(read(&robot.join("Cargo.toml")) + more),
    );
    write(
        &robot.join("../shared/Arm.idsl"),
        "module Arm { interface Arm { void rest(); }; };\n",
    );
    succeeds(&robot, &["new", "arm", "--requires", "Arm"]);
    succeeds(&robot, &["generate", "--check"]);
}

#[test]
fn many_at_once() {
    let (_folder, robot) = workspace();
    for (name, interface) in [("a", "Laser"), ("b", "Speech"), ("c", "Camera")] {
        succeeds(&robot, &["new", name, "--requires", interface]);
    }
    let before = files(&robot);
    let out = succeeds(&robot.join("components/a"), &["generate"]);
    assert!(
        out.starts_with("generated 3 components; files: ") && out.ends_with(" unchanged\n"),
        "{out}"
    );
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    // One component has errors; the others are generated.
    let cdsl = robot.join("components/b/b.cdsl");
    let right = read(&cdsl);
    write(&cdsl, &right.replace("requires Speech", "requires Speach"));
    std::fs::remove_file(robot.join("components/c/generated/src/lib.rs")).expect("it was there");
    let (code, out, err) = rcgen(&robot, &["generate"]);
    assert_eq!(code, 1, "{err}");
    assert!(
        out.contains("create ./components/c/generated/src/lib.rs\n"),
        "{out}"
    );
    assert!(
        out.contains("generated 2 components, skipped 1 with errors; files: 1 created"),
        "{out}"
    );
    write(&cdsl, &right);
    // `clean` removes all files of rcgen, and generation restores them.
    let out = succeeds(&robot, &["clean", "--dry-run"]);
    assert_eq!(out.lines().count(), 4, "{out}");
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    std::fs::create_dir_all(robot.join("components/mine/generated")).expect("a folder");
    write(&robot.join("components/mine/mine.cdsl"), "");
    write(&robot.join("components/mine/generated/file"), "mine");
    let (code, _, err) = rcgen(&robot, &["clean"]);
    assert_eq!(
        (code, err.as_str()),
        (
            0,
            "./components/mine/generated was not written by rcgen, and stays\n"
        )
    );
    let left = files(&robot);
    let generated = left
        .keys()
        .filter(|path| path.to_string_lossy().contains("generated"));
    assert_eq!(generated.count(), 1);
    std::fs::remove_dir_all(robot.join("components/mine")).expect("it was there");
    succeeds(&robot, &["generate"]);
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    let (code, _, err) = rcgen(Path::new("/"), &["generate"]);
    assert!(
        code == 2 && err.contains("this folder is in no workspace"),
        "{err}"
    );
}

#[test]
fn an_interface_that_two_modules_declare_is_asked_about() {
    let (_folder, robot) = workspace();
    for module in ["One", "Two"] {
        let text = format!("module {module} {{ interface Drive {{ void go(); }}; }};");
        write(&robot.join(format!("interfaces/{module}.idsl")), &text);
    }
    let new = |implements: &str| rcgen(&robot, &["new", "mover", "--implements", implements]);
    let (code, _, err) = new("Drive");
    assert_eq!(code, 2, "{err}");
    let wanted =
        "which interface `Drive`? There are `One::Drive` (One.idsl) and `Two::Drive` (Two.idsl)";
    assert!(err.contains(wanted), "{err}");
    let (code, _, err) = new("Two::Drive");
    assert_eq!((code, err.as_str()), (0, ""));
    let cdsl = read(&robot.join("components/mover/mover.cdsl"));
    assert!(cdsl.contains("import \"Two.idsl\";"), "{cdsl}");
    assert!(cdsl.contains("implements Drive;"), "{cdsl}");
    let (code, _, err) = rcgen(&robot, &["new", "rcdeploy"]);
    assert_eq!(code, 2);
    assert!(
        err.contains("rcdeploy has sockets and logs of this name"),
        "{err}"
    );
    let (code, _, err) = rcgen(&robot, &["new", "rcview"]);
    assert_eq!(code, 2);
    assert!(err.contains("a program of RoboComp has this name"), "{err}");
    let (code, _, err) = rcgen(&robot, &["init", "inner"]);
    assert_eq!(code, 2);
    assert!(err.contains("would be inside the workspace"), "{err}");
}

#[test]
fn a_copied_component_needs_a_name_of_its_own() {
    let (_folder, robot) = workspace();
    succeeds(&robot, &["new", "mover"]);
    let copied = std::process::Command::new("cp")
        .args(["-r", "components/mover", "components/other"])
        .current_dir(&robot)
        .status();
    assert!(copied.is_ok_and(|status| status.success()));
    let (code, _, err) = rcgen(&robot, &[".", "--format", "short"]);
    assert_eq!(code, 1, "{err}");
    let wanted = "./components/other/mover.cdsl:3:11: error[copied-component]: component `mover` is in two folders of the workspace; first declared here at ./components/mover/mover.cdsl:3:11 (give the copy a name of its own";
    assert!(err.contains(wanted), "{err}");
    // So it is where only one of them is read.
    for (args, place, other) in [
        (["check", "."], "./components/other", None),
        (
            ["check", "components/other"],
            "components/other",
            Some("mover"),
        ),
        (
            ["check", "components/mover/mover.cdsl"],
            "components/mover",
            Some("other"),
        ),
        (
            ["view", "components/other/mover.cdsl"],
            "components/other",
            Some("mover"),
        ),
    ] {
        let (code, _, err) = rcgen(&robot, &[&args[..], &["--format", "short"]].concat());
        assert_eq!(code, 1, "{args:?}: {err}");
        let also = other.map_or("; first declared here at".to_owned(), |other| {
            format!(", also in `components/{other}` (give the copy a name of its own")
        });
        let wanted = format!(
            "{place}/mover.cdsl:3:11: error[copied-component]: component `mover` is in two folders of the workspace{also}"
        );
        assert!(err.contains(&wanted), "{args:?}: {err}");
        assert_eq!(err.matches("copied-component").count(), 1, "{err}");
    }
    // The workspace need not have it.
    let path = robot.join("Cargo.toml");
    let manifest = std::fs::read_to_string(&path).expect("a manifest");
    let excluding = manifest.replace(
        "[workspace]\n",
        "[workspace]\nexclude = [\"components/other\"]\n",
    );
    assert_ne!(manifest, excluding);
    std::fs::write(&path, excluding).expect("to write");
    succeeds(&robot, &["check", "components/mover"]);
    std::fs::write(&path, manifest).expect("to write");
    std::fs::remove_dir_all(robot.join("components/other")).expect("a folder");
    succeeds(&robot, &["check", "."]);
    // Another description of the same folder is not a copy.
    let mover = robot.join("components/mover");
    std::fs::copy(mover.join("mover.cdsl"), mover.join("old.cdsl")).expect("to copy");
    succeeds(&robot, &["check", "."]);
}

#[test]
fn a_manifest_with_a_fault_hides_no_finding() {
    let (_folder, robot) = workspace();
    succeeds(&robot, &["new", "mover"]);
    let path = robot.join("components/mover/mover.cdsl");
    let description = std::fs::read_to_string(&path).expect("a description");
    std::fs::write(&path, description.replace("period", "perriod")).expect("to write");
    let sound = robot.join("components/sound.cdsl");
    std::fs::write(&sound, "Component sound { };\n").expect("to write");
    std::fs::write(robot.join("Cargo.toml"), "[workspace\n").expect("to write");
    let (code, _, err) = rcgen(&robot, &["check", ".", "--format", "short"]);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("mover.cdsl:"), "{err}");
    assert!(err.contains("Cargo.toml"), "{err}");
}
