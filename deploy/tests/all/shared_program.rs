//! The programs of processes of several components, as `cargo xtask test` has built them before the
//! tests from `programs/shared.ddsl`.

use rc_codegen::FileLoader;
use rc_codegen::note::Note;
use rc_deploy_network::{Network, Overrides, Profile, load};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
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

/// The program of a component's process with the arguments of the plan, in a network of its own.
struct Process {
    folder: tempfile::TempDir,
    child: Child,
    /// Asks whether all of its components are ready.
    probe: Command,
}

impl Process {
    /// Starts it, with further arguments of its components.
    fn start(network: &Network, component: &str, more: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let plan = network.plan(Profile::Dev).expect("a plan");
        let program = program(network, component);
        let (mut command, mut probe) = (Command::new(&program), Command::new(&program));
        let name = component.replace('.', "-");
        let name = format!("shared-{name}-{}", std::process::id());
        let components = plan.components.iter().enumerate();
        for (at, component) in components.filter(|(_, one)| one.executable == program) {
            let word = network.programs.member_word(at);
            let word = word.expect("a component of a process");
            let args = component.thread_arguments(&word, &[]);
            // The network of this test alone.
            let args = args
                .iter()
                .map(|arg| if arg == "shared" { &name } else { arg });
            command.args(args);
            for (_, value) in more.iter().filter(|(of, _)| *of == component.name) {
                command.args(["--set", value]);
            }
            probe.args(["--member", &word, "--probe", "--network", &name]);
            probe.args(["--name", &component.name]);
        }
        // As the exports of a network do it.
        probe.env("XDG_RUNTIME_DIR", folder.path());
        let log = File::create(folder.path().join("log")).expect("a log");
        let child = command
            .env("XDG_RUNTIME_DIR", folder.path())
            .env_remove("RUST_LOG")
            .stderr(log)
            .spawn()
            .expect("it starts");
        Self {
            folder,
            child,
            probe,
        }
    }

    fn is_ready(&mut self) -> bool {
        self.probe.output().expect("it starts").status.success()
    }

    fn printed(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log")).expect("a log")
    }

    /// Waits until it has printed all of these texts.
    fn await_lines(&mut self, texts: &[&str]) {
        let start = Instant::now();
        while !texts.iter().all(|text| self.printed().contains(text)) {
            let ended = self.child.try_wait().expect("a child");
            let is_well = ended.is_none() && start.elapsed() < LIMIT;
            assert!(is_well, "{ended:?}: {}", self.printed());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Ends it in order.
    fn end(&mut self) {
        kill_process(Pid::from_child(&self.child), Signal::TERM).expect("it runs");
        let status = self.child.wait().expect("a child");
        assert!(status.success(), "{status}: {}", self.printed());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_program_of_a_process_runs_its_components_with_the_arguments_of_the_plan() {
    let (network, _) = network();
    let mut process = Process::start(&network, "left", &[]);
    // The avoider drives once it has a scan of the world.
    process.await_lines(&["left | ", "right | ", "avoider | "]);
    let start = Instant::now();
    while !process.is_ready() {
        assert!(start.elapsed() < LIMIT, "{}", process.printed());
        std::thread::sleep(Duration::from_millis(10));
    }
    process.end();
    assert!(!process.is_ready());
}

/// Inside a process as elsewhere: who waits for a component that waits for it ends at its timeout.
#[test]
fn two_components_that_call_each_other_inside_their_process_time_out() {
    let (network, _) = network();
    let notes = Note::read(&program(&network, "inner.up")).expect("a program");
    assert!(
        notes.iter().all(|note| note.middleware == "local"),
        "{notes:?}"
    );
    let calls = [("inner.up", "does=call"), ("inner.down", "does=call back")];
    let mut process = Process::start(&network, "inner.up", &calls);
    // The first one waits for the second one, whose handler waits for the first one.
    process.await_lines(&["no answer to its own call", "within 300ms"]);
    process.end();
    // As soon as it does not call back, it answers.
    let mut process = Process::start(&network, "inner.up", &calls[..1]);
    process.await_lines(&["the other has 50"]);
    process.end();
    // Both call each other at once: each of them gets an answer, or an error, and goes on.
    let both = [("inner.up", "does=call"), ("inner.down", "does=call")];
    let mut process = Process::start(&network, "inner.up", &both);
    process.await_lines(&["inner-up | ", "inner-down | "]);
    process.end();
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
