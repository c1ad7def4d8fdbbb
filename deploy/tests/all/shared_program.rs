//! The programs of processes of several components, as `cargo xtask test` has built them before the
//! tests from `programs/shared.ddsl`.

use rc_codegen::FileLoader;
use rc_codegen::note::Note;
use rc_deploy_network::{Network, Overrides, Profile, load};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(30);

fn network() -> (Network, SourceMap) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/shared.ddsl");
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let loaded = load(&path, &Overrides::default(), &mut sources, &loader);
    let (network, found) = loaded.expect("a file");
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    (network.expect("a network"), sources)
}

/// The program of a component's process.
fn program(network: &Network, component: &str) -> PathBuf {
    let mut instances = network.deployment.instances.iter();
    let at = instances.position(|instance| instance.path == component);
    let at = at.expect("a component");
    let program = network
        .programs
        .executable(at, Profile::Dev)
        .expect("a place");
    let program = program.expect("a place");
    assert!(
        program.exists(),
        "{} is missing; `cargo xtask test` builds it",
        program.display()
    );
    program
}

#[test]
fn the_program_of_a_process_has_the_notes_of_all_its_components() {
    let (network, sources) = network();
    let notes = |component: &str| {
        let notes = Note::read(&program(&network, component)).expect("a program");
        let notes = notes.iter();
        let mut texts: Vec<String> = notes
            .map(|note| format!("{} {}", note.component, note.middleware))
            .collect();
        texts.sort_unstable();
        texts.dedup();
        texts
    };
    let eyes = [
        "avoider iceoryx2",
        "neighbour iceoryx2",
        "simulator iceoryx2",
    ];
    assert_eq!(notes("left"), eyes);
    assert_eq!(notes("east"), ["neighbour dds"]);
    let mut found = Diagnostics::new();
    network.programs.check_executables(Profile::Dev, &mut found);
    network.programs.check_processes(&mut found);
    assert_eq!(render(&sources, &found, Format::Short), "");
}

#[test]
fn the_program_of_a_process_runs_its_components_with_the_arguments_of_the_plan() {
    let (network, _) = network();
    let folder = tempfile::tempdir().expect("a folder");
    let plan = network.plan(Profile::Dev).expect("a plan");
    let mut command = Command::new(program(&network, "left"));
    let name = format!("shared-{}", std::process::id());
    let ours = |component: &rc_deploy::Component| component.executable == program(&network, "left");
    let mut probe = Command::new(program(&network, "left"));
    let mut components = plan.components.iter().enumerate();
    while let Some((at, component)) = components.find(|(_, component)| ours(component)) {
        let word = network
            .programs
            .member_word(at)
            .expect("a component of a process");
        let args = component.thread_arguments(&word, &[]);
        // The network of this test alone.
        let args = args
            .iter()
            .map(|arg| if arg == "shared" { &name } else { arg });
        command.args(args);
        probe.args(["--member", &word, "--probe", "--network", &name]);
        probe.args(["--name", &component.name]);
    }
    // As the exports of a network do it.
    probe.env("XDG_RUNTIME_DIR", folder.path());
    let mut is_ready = || probe.output().expect("it starts").status.success();
    assert!(!is_ready());
    let log = folder.path().join("log");
    let mut child = command
        .env("XDG_RUNTIME_DIR", folder.path())
        .env_remove("RUST_LOG")
        .stderr(File::create(&log).expect("a log"))
        .spawn()
        .expect("it starts");
    let printed = || std::fs::read_to_string(&log).expect("a log");
    let start = Instant::now();
    // The avoider drives once it has a scan of the world.
    let lines = ["left | ", "right | ", "avoider | "];
    while !lines.iter().all(|line| printed().contains(line)) {
        let ended = child.try_wait().expect("a child");
        let is_well = ended.is_none() && start.elapsed() < LIMIT;
        if !is_well {
            let _ = child.kill();
            panic!("{ended:?}: {}", printed());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    while !is_ready() {
        assert!(start.elapsed() < LIMIT, "{}", printed());
        std::thread::sleep(Duration::from_millis(10));
    }
    kill_process(Pid::from_child(&child), Signal::TERM).expect("it runs");
    let status = child.wait().expect("a child");
    assert!(status.success(), "{status}: {}", printed());
    assert!(!is_ready());
}

#[test]
fn an_exact_recording_of_a_component_is_repeated_by_the_program_of_its_process() {
    let (network, _) = network();
    let program = program(&network, "left");
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("left.exact.mcap");
    let name = format!("replayed-{}", std::process::id());
    let ran = Command::new(&program)
        .args([
            "--member",
            "neighbour",
            "--network",
            &name,
            "--name",
            "left",
        ])
        .args(["--set", "does=stop", "--record"])
        .arg(&recording)
        .env("XDG_RUNTIME_DIR", folder.path())
        .output()
        .expect("it runs");
    let printed = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{printed}");
    assert!(printed.contains("left | "), "{printed}");
    let replayed = Command::new(env!("CARGO_BIN_EXE_rcdeploy"))
        .args(["replay", "--format", "json"])
        .arg(&recording)
        .arg("--program")
        .arg(&program)
        .output()
        .expect("it runs");
    let errors = String::from_utf8_lossy(&replayed.stderr);
    assert!(replayed.status.success(), "{errors}");
    let report: serde_json::Value = serde_json::from_slice(&replayed.stdout).expect("JSON");
    assert_eq!(report["equal"], true, "{report}");
}
