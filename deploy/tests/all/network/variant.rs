//! A user's network on another middleware than its component was generated for.

use super::host_builds::script;
use rc_cdsl::model::Middleware;
use rc_codegen::workspace::{self, Framework};
use rc_codegen::{FileLoader, Project, generation};
use rc_diagnostics::SourceMap;
use rc_test_site::site::Site;
use rc_test_support::share_builds;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const CDSL: &str = "import \"LaserPub.idsl\";\nComponent hello { Communications { publishes LaserPub, LaserPub[] as scans; }; language rust; period 20ms; };\n";

/// A workspace of `rcgen init` with a component for DDS that has dependencies and files of its own.
fn user(site: &Site) -> PathBuf {
    let folder = site.path("robot");
    let framework = Framework::parse(ROOT).expect("this project");
    let files = workspace::init("robot", &framework).expect("templates that fit");
    files.write(&folder).expect("a workspace");
    share_builds(&folder, Path::new("components/features"));
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
    let found = generation::generate(&project, hello.clone(), Middleware::Dds, &mut sources);
    assert!(!found.expect("to write").has_errors());
    edit(&hello.join("Cargo.toml"), |text| {
        let own = "[dependencies]\nlibm.workspace = true\nshared = { path = \"../../shared\" }\n";
        text.replacen("[dependencies]\n", own, 1)
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

/// Every file with its content.
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
fn a_network_runs_on_another_middleware_without_changing_user_files() {
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
    // An earlier test run may have left the program of a variant with this name.
    let check = || rcdeploy(&["check", "--middleware", "iceoryx2", "--format", "short"]);
    let program = Site::target().join("debug/hello-iceoryx2");
    let _ = std::fs::remove_file(&program);
    let ran = check();
    assert_eq!(ran.code, 1, "{ran:?}");
    let hint = format!(
        "rcdeploy up --build --profile dev --middleware iceoryx2 {}",
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

    // An existing variant is used again. The user's own build makes another program.
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

    // An older workspace does not have the crate.
    edit(&robot.join("Cargo.toml"), |text| {
        let lines = text.lines().filter(|line| !line.starts_with("rc-iceoryx2"));
        lines.map(|line| format!("{line}\n")).collect()
    });
    let ran = rcdeploy(&["up", "--build", "--middleware", "iceoryx2"]);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.contains("rc-iceoryx2 = { path = "), "{ran:?}");
    assert!(ran.stderr.contains("/middleware/iceoryx2\""), "{ran:?}");
}

/// Two instances of one component, one of them over ROS 2. `NAMED` is replaced by the program
/// clause of a third one.
const TWO: &str = r#"
Deployment patrol
{
    Component voice { cdsl "../speech_server/speech_server.cdsl"; };
    Component near { cdsl "../pose_listener/pose_listener.cdsl"; };
    Group far
    {
        middleware ros2;
        Component listener { cdsl "../pose_listener/pose_listener.cdsl"; };
        Component named { cdsl "../pose_listener/pose_listener.cdsl"; executable "NAMED"; };
    };
};
"#;

/// Runs rcdeploy with the network of a site, for an empty target folder. Returns its output.
fn unbuilt(site: &Site, args: &[&str]) -> (String, Vec<Value>) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(args).arg(site.ddsl());
    site.place(&mut command);
    command.env("CARGO_TARGET_DIR", site.path("target"));
    let output = command.output().expect("rcdeploy");
    let findings = String::from_utf8_lossy(&output.stderr);
    let findings = findings
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    let findings = findings.collect();
    (String::from_utf8_lossy(&output.stdout).into(), findings)
}

/// The errors: code, end of the message, help.
fn errors(site: &Site, args: &[&str]) -> Vec<[String; 3]> {
    let args = [&["check", "--format", "json"], args].concat();
    let (_, findings) = unbuilt(site, &args);
    let errors = findings
        .into_iter()
        .filter(|f| f["severity"] == "error")
        .map(|f| ["code", "message", "help"].map(|key| f[key].as_str().unwrap_or_default().into()));
    errors.collect()
}

#[test]
fn the_plan_lists_components_that_are_variants() {
    let site = Site::new("chosen");
    let named = Site::executable("pose_listener");
    site.write_ddsl(&TWO.replace("NAMED", &named.to_string_lossy()));
    let missing = |name: &str, program: &str, command: &str| {
        let program = site.path("target").join(program);
        let program = program.display();
        [
            "missing-executable".to_owned(),
            format!("the executable of `{name}`, {program}, does not exist"),
            format!(
                "build it: `rcdeploy up --build{command} {}`",
                site.ddsl().display()
            ),
        ]
    };
    let mismatch = |middleware: &str, command: &str| {
        [
            "middleware-mismatch".to_owned(),
            format!("the executable of `far.named` uses iceoryx2, the network {middleware}"),
            format!(
                "leave `executable` out, so that `rcdeploy up --build{command} {}` builds it, or let it name a program that was generated for {middleware}",
                site.ddsl().display()
            ),
        ]
    };
    let found = errors(&site, &[]);
    let expected = [
        missing("voice", "release/speech_server", ""),
        missing("near", "release/pose_listener", ""),
        missing("far.listener", "release/pose_listener-ros2", ""),
        mismatch("ros2", ""),
    ];
    assert_eq!(found, expected);
    // The command line applies to all components, even if it names the generated middleware.
    let found = errors(&site, &["--profile", "dev", "--middleware", "dds"]);
    let command = " --profile dev --middleware dds";
    let expected = [
        missing("voice", "debug/speech_server-dds", command),
        missing("near", "debug/pose_listener-dds", command),
        missing("far.listener", "debug/pose_listener-dds", command),
        mismatch("dds", command),
    ];
    assert_eq!(found, expected);
    let found = errors(&site, &["--middleware", "iceoryx2"]);
    let command = " --middleware iceoryx2";
    let expected = [
        missing("voice", "release/speech_server-iceoryx2", command),
        missing("near", "release/pose_listener-iceoryx2", command),
        missing("far.listener", "release/pose_listener-iceoryx2", command),
    ];
    assert_eq!(found, expected);

    let (plan, _) = unbuilt(&site, &["plan", "--unbuilt", "--format", "json"]);
    let plan: Value = serde_json::from_str(&plan).expect("one document");
    let components = plan["components"].as_array().expect("a list").iter();
    let parts = components.map(|component| {
        ["name", "middleware", "executable"].map(|key| component[key].as_str().unwrap_or_default())
    });
    let target = site.path("target/release");
    let program = |name: &str| target.join(name).display().to_string();
    let expected = [
        ["voice", "iceoryx2", &program("speech_server")],
        ["near", "ros2", &program("pose_listener")],
        ["far.listener", "ros2", &program("pose_listener-ros2")],
        ["far.named", "ros2", &named.to_string_lossy()],
    ];
    assert_eq!(parts.collect::<Vec<_>>(), expected);
}

#[test]
fn with_build_the_sources_determine_the_model() {
    let site = Site::new("folder");
    site.copy_component("pose_listener");
    let network = |middleware: &str| {
        site.write_ddsl(&format!(
            "Deployment patrol {{ middleware {middleware}; Component listener {{ cdsl \"pose_listener/pose_listener.cdsl\"; }}; }};"
        ));
        let found = errors(&site, &[]);
        let codes = found.into_iter().map(|[code, ..]| code);
        // The copy is not in a workspace.
        let mut codes: Vec<_> = codes.filter(|code| code != "missing-executable").collect();
        codes.sort();
        codes
    };
    // Nothing was generated.
    assert_eq!(network("iceoryx2"), ["missing-generated"]);
    assert_eq!(network("ros2"), ["missing-generated"]);
    let source = "pose_listener/generated/src/backend.rs";
    let generated = std::fs::read_to_string(Site::components().join(source)).expect("a file");
    write(&site.path("networks").join(source), &generated);
    assert_eq!(network("iceoryx2"), [""; 0]);
    assert_eq!(network("ros2"), [""; 0]);
    // Generated code of an older model cannot be built, and is ignored for a variant.
    site.edit("pose_listener/pose_listener.cdsl", |text| {
        text.replace("period 1s", "period 2s")
    });
    assert_eq!(network("iceoryx2"), ["stale-generated"]);
    assert_eq!(network("ros2"), [""; 0]);
    // Generated code without a readable note counts as stale.
    site.edit(source, |text| text.replace("rc-note", "note"));
    assert_eq!(network("ros2"), ["stale-generated"]);
}

#[test]
fn what_is_stale_is_generated_before_it_is_built() {
    let site = Site::new("stale");
    let robot = user(&site);
    let hello = robot.join("components/hello");
    edit(&hello.join("hello.cdsl"), |text| {
        text.replace("20ms", "30ms")
    });
    let before = files(&robot);
    // This cargo says where it would build, and builds nothing.
    let cargo = site.path("cargo");
    let text = format!(
        "[ \"$1\" = metadata ] && exec '{}' \"$@\"\nexit 1\n",
        env!("CARGO")
    );
    script(&cargo, &text);
    let up = |more: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command
            .args(["up", "--build", "--profile", "dev"])
            .args(more);
        command.arg(robot.join("deployments/hello.ddsl"));
        command.env("CARGO", &cargo);
        site.run(command)
    };
    let refused = up(&["--no-generate"]);
    assert_eq!(refused.code, 1, "{refused:?}");
    assert!(
        refused.stderr.contains("error[stale-generated]"),
        "{refused:?}"
    );
    assert!(before == files(&robot), "something has changed");
    let built = up(&[]);
    assert_eq!(built.code, 3, "{built:?}");
    assert!(
        built.stderr.contains("cargo could not build hello"),
        "{built:?}"
    );
    let report = format!("note: generated {}", hello.join("hello.cdsl").display());
    assert!(built.stderr.contains(&report), "{built:?}");
    let description = std::fs::read_to_string(hello.join("generated/src/description.rs"));
    assert!(
        description.expect("a file").contains("30000000"),
        "{built:?}"
    );
    let worker = hello.join("src/specific_worker.rs");
    assert!(before[&worker] == std::fs::read(&worker).expect("a file"));
    // It is up to date now.
    let after = files(&robot);
    let again = up(&[]);
    assert!(!again.stderr.contains("generated "), "{again:?}");
    assert!(after == files(&robot), "something has changed");
    // The middleware of the folder stays.
    let backend = std::fs::read_to_string(hello.join("generated/src/backend.rs"));
    assert!(backend.expect("a file").contains("\"dds\""));
    // A component that was never generated gets all its files.
    std::fs::remove_dir_all(hello.join("generated")).expect("to remove");
    std::fs::remove_dir_all(hello.join("src")).expect("to remove");
    let new = up(&[]);
    assert!(new.stderr.contains(&report), "{new:?}");
    assert!(worker.exists() && hello.join("generated/src/description.rs").exists());
}
