//! A user's network on another middleware than its component was generated for.

use crate::site::Site;
use rc_cdsl::model::Backend;
use rc_codegen::workspace::{self, Framework};
use rc_codegen::{FileLoader, Project, generate};
use rc_diagnostics::SourceMap;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const CDSL: &str = "import \"LaserPub.idsl\";\nComponent hello { Communications { publishes LaserPub; }; language rust; period 20ms; };\n";

/// A workspace as `rcgen init` makes it, with a component for DDS that has dependencies and files of its own.
fn user(site: &Site) -> PathBuf {
    let folder = site.path("robot");
    let framework = Framework::parse(ROOT).expect("this project");
    let files = workspace::init(&framework).write(&folder);
    files.expect("a workspace");
    let lock = std::fs::copy(
        Path::new(ROOT).join("Cargo.lock"),
        folder.join("Cargo.lock"),
    );
    lock.expect("the versions that are in the cache");
    let hello = folder.join("components/hello");
    write(&hello.join("hello.cdsl"), CDSL);
    let mut sources = SourceMap::new();
    let (project, _) = Project::load(
        &hello.join("hello.cdsl"),
        &mut sources,
        &FileLoader::default(),
    )
    .expect("a component");
    let project = project.expect("a component");
    let (files, _) = generate::generate(&project, Backend::Dds).expect("templates that fit");
    files.write(&hello).expect("to write");
    edit(&hello.join("Cargo.toml"), |text| {
        text + "libm.workspace = true\nshared = { path = \"../../shared\" }\n"
    });
    edit(&folder.join("Cargo.toml"), |text| {
        let crates = "[workspace.dependencies]\nlibm = \"0.2\"\n";
        text.replace("[workspace.dependencies]\n", crates)
            .replace("members = [", "members = [\"shared\", ")
    });
    write(
        &folder.join("shared/Cargo.toml"),
        "[package]\nname = \"shared\"\nversion = \"0.1.0\"\nedition = \"2024\"\n",
    );
    write(
        &folder.join("shared/src/lib.rs"),
        "pub const GREETING: &str = \"good day\";\n",
    );
    write(&hello.join("name.txt"), "robot");
    edit(&hello.join("src/specific_worker.rs"), |text| {
        let (head, body) = text.split_once("fn initialize(").expect("a worker");
        let (signature, rest) = body.split_once("{\n").expect("its body");
        let name = "include_str!(\"../name.txt\")";
        let said =
            format!("eprintln!(\"{{}}, {{}} {{}}\", shared::GREETING, {name}, libm::sqrt(49.0));");
        format!("{head}fn initialize({signature}{{\n        {said}\n{rest}")
    });
    write(
        &folder.join("deployments/hello.ddsl"),
        &format!(
            "Deployment {}\n{{\n    middleware dds;\n    Component hello {{ cdsl \"../components/hello/hello.cdsl\"; }};\n}};\n",
            site.network
        ),
    );
    folder
}

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("to write");
}

fn edit(path: &Path, change: impl FnOnce(String) -> String) {
    let text = std::fs::read_to_string(path).expect("a text");
    let changed = change(text.clone());
    assert_ne!(text, changed, "{}", path.display());
    std::fs::write(path, changed).expect("to write");
}

/// Every file with what is in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            all.extend(files(&path));
        } else {
            all.insert(path.clone(), std::fs::read(&path).expect("a file"));
        }
    }
    all
}

#[test]
fn a_network_runs_on_another_middleware_and_nothing_of_its_user_changes() {
    let site = Site::new("variant");
    let robot = user(&site);
    let ddsl = robot.join("deployments/hello.ddsl");
    let before = files(&robot);
    let rcdeploy = |args: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command.args(args).arg(&ddsl).args(["--profile", "dev"]);
        command.env("CARGO_NET_OFFLINE", "true");
        site.run(command)
    };
    // Another test run may have left the program of a variant of this name.
    let check = || rcdeploy(&["check", "--middleware", "iceoryx2", "--format", "short"]);
    let program = Site::target().join("debug/hello-iceoryx2");
    let _ = std::fs::remove_file(&program);
    let ran = check();
    assert_eq!(ran.code, 1, "{ran:?}");
    let hint = format!(
        "rcdeploy up --build --middleware iceoryx2 {}",
        ddsl.display()
    );
    assert!(ran.stderr.contains("error[missing-executable]"), "{ran:?}");
    assert!(ran.stderr.contains(&hint), "{ran:?}");

    let up = rcdeploy(&["up", "--build", "--detach", "--middleware", "iceoryx2"]);
    assert_eq!(up.code, 0, "{up:?}");
    let status = site.status();
    assert_eq!(
        status["components"][0]["middleware"], "iceoryx2",
        "{status}"
    );
    assert_eq!(site.ask("hello", "status")["middleware"], "iceoryx2");
    site.await_in_log("hello", "good day, robot 7");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    assert!(before == files(&robot), "something of the user has changed");

    // What is there is used again, and what the user's own build makes is another program.
    assert_eq!(check().code, 0);
    let again = rcdeploy(&["up", "--build", "--detach", "--middleware", "iceoryx2"]);
    assert_eq!(again.code, 0, "{again:?}");
    assert!(!again.stderr.contains("Compiling"), "{again:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    let _ = std::fs::remove_file(Site::target().join("debug/hello"));
    let own = rcdeploy(&["check", "--format", "short"]);
    assert!(own.stderr.contains("error[missing-executable]"), "{own:?}");

    // A variant of another model is not started.
    edit(&robot.join("components/hello/hello.cdsl"), |text| {
        text.replace("20ms", "30ms")
    });
    let ran = rcdeploy(&["up", "--middleware", "iceoryx2"]);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.contains("stale-executable"), "{ran:?}");
    assert!(ran.stderr.contains(&hint), "{ran:?}");

    // A workspace of before knows nothing of the crate.
    edit(&robot.join("Cargo.toml"), |text| {
        let lines = text.lines().filter(|line| !line.starts_with("rc-iceoryx2"));
        lines.map(|line| format!("{line}\n")).collect()
    });
    let ran = rcdeploy(&["up", "--build", "--middleware", "iceoryx2"]);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.contains("rc-iceoryx2 = { path = "), "{ran:?}");
    assert!(ran.stderr.contains("/middleware/iceoryx2\""), "{ran:?}");
}
