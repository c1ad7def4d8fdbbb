//! One user code over two middlewares: generated for `local` in one process and for iceoryx2
//! in several, the patrol gives the same trace from the same seed. `src/` is used in place, byte
//! for byte.

use rc_cdsl::model::Middleware;
use rc_codegen::{FileLoader, Project, generation};
use rc_test_site::site::{PATROL, Site};
use rc_test_support::share_builds;
use std::path::{Path, PathBuf};
use std::process::Command;

const POSES: usize = 200;
const COMPONENTS: [(&str, &str); 3] = [
    ("simulator", "simulator"),
    ("pose_monitor", "monitor"),
    ("avoider", "avoider"),
];

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the repository")
        .to_path_buf()
}

/// The configurations of a deterministic run.
fn configure(site: &Site, trace: &Path) -> [PathBuf; 3] {
    let map = repository().join("components/maps/house.map");
    let simulator = format!(
        "[component]\nperiod = \"5ms\"\n[parameters]\nmap = \"{}\"\nlockstep = true\nseed = 7\n",
        map.display()
    );
    let monitor = format!(
        "[parameters]\nmap = \"{}\"\nsvg = \"\"\ntrace = \"{}\"\nsamples = {POSES}\n",
        map.display(),
        trace.display()
    );
    let avoider = "[component]\nperiod = \"5ms\"\n[parameters]\nlockstep = true\n".to_owned();
    [
        site.write("simulator.toml", &simulator),
        site.write("monitor.toml", &monitor),
        site.write("avoider.toml", &avoider),
    ]
}

/// Several processes on shared memory.
fn over_iceoryx2(trace: &Path) {
    let site = Site::new("swap");
    let configs = configure(&site, trace);
    let mut text = PATROL.to_owned();
    for ((component, _), config) in COMPONENTS.iter().zip(&configs) {
        let cdsl = format!("cdsl \"../{component}/{component}.cdsl\";");
        assert!(text.contains(&cdsl));
        text = text.replace(&cdsl, &format!("{cdsl} config \"{}\";", config.display()));
    }
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// One process, generated with `--middleware local` into a workspace of this test.
fn in_one_process(trace: &Path) {
    let site = Site::new("swap_local");
    let configs = configure(&site, trace);
    let workspace = site.path("workspace");
    // The components share the crate of interfaces of this workspace.
    write(&workspace.join("Cargo.toml"), "[workspace]\n");
    let mut dependencies = String::new();
    let mut starts = String::new();
    for ((component, instance), config) in COMPONENTS.iter().zip(&configs) {
        stage(&workspace, component);
        dependencies.push_str(&format!("{component} = {{ path = \"../{component}\" }}\n"));
        starts.push_str(&format!(
            "    let {instance} = {component}::embed(&[\"--network\", {:?}, \"--name\", {instance:?}, \"--config\", {:?}]).expect({instance:?});\n",
            site.network,
            config.display().to_string(),
        ));
    }
    let main = format!(
        "fn main() {{\n{starts}    let start = std::time::Instant::now();\n    \
         while !monitor.has_ended() {{\n        assert!(start.elapsed().as_secs() < 60, \"no {POSES} poses\");\n        \
         std::thread::sleep(std::time::Duration::from_millis(5));\n    }}\n    \
         avoider.stop();\n    simulator.stop();\n    for part in [monitor, avoider, simulator] {{\n        \
         part.join().expect(\"an orderly end\");\n    }}\n}}\n"
    );
    write(&workspace.join("together/src/main.rs"), &main);
    write(
        &workspace.join("together/Cargo.toml"),
        &manifest("together", &dependencies),
    );
    let root = repository();
    let local = |name: &str, folder: &str| {
        format!(
            "{name} = {{ path = \"{}\" }}\n",
            root.join(folder).display()
        )
    };
    let crates: String = COMPONENTS
        .iter()
        .map(|(component, _)| format!("\"{component}\", "))
        .collect();
    let members = format!(
        "[workspace]\nresolver = \"3\"\nmembers = [{crates}\"together\", \"features\", \"*/generated\"]\n\n[workspace.dependencies]\n{}{}\n",
        local("rc-runtime", "runtime") + &local("rc-middleware", "middleware"),
        local("rc-local", "middleware/local"),
    );
    write(&workspace.join("Cargo.toml"), &members);
    share_builds(&workspace, Path::new("features"));
    let target = Path::new(env!("CARGO_BIN_EXE_rcdeploy"))
        .ancestors()
        .nth(2)
        .expect("the target folder");
    let run = |command: &mut Command| {
        let output = command.output().expect("a program that starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command:?}\n{said}");
    };
    let build = "build --workspace --quiet --offline --bin together";
    run(Command::new(env!("CARGO"))
        .args(build.split(' '))
        .current_dir(&workspace)
        .env("CARGO_TARGET_DIR", target));
    run(Command::new(target.join("debug/together")).env("XDG_RUNTIME_DIR", site.path("run")));
    site.assert_nothing_left();
}

/// Generates a component for `local`; its modules are those of the repository's `src/`, in place.
fn stage(workspace: &Path, component: &str) {
    let folder = repository().join("components").join(component);
    let mut sources = rc_diagnostics::SourceMap::new();
    let cdsl = folder.join(format!("{component}.cdsl"));
    let (project, found) =
        Project::load(&cdsl, &mut sources, &FileLoader::default()).expect("the component's files");
    let project = project
        .filter(|_| !found.has_errors())
        .expect("a component");
    let target = workspace.join(component);
    let found = generation::generate(&project, target.clone(), Middleware::Local, &mut sources);
    assert!(!found.expect("to write").has_errors());
    let own = std::fs::read_to_string(folder.join("src/lib.rs")).expect("lib.rs");
    let mut lib = String::new();
    let mut test_only = false;
    for line in own.lines() {
        let declared = line.strip_prefix("pub ").unwrap_or(line);
        if let Some(module) = declared
            .strip_prefix("mod ")
            .and_then(|rest| rest.strip_suffix(';'))
            && !test_only
        {
            let path = folder.join("src").join(format!("{module}.rs"));
            // The worker as it is must compile against another generated layer.
            lib.push_str(&format!(
                "#[path = {:?}]\nmod {module};\n",
                path.display().to_string()
            ));
        }
        test_only = line == "#[cfg(test)]";
    }
    lib.push_str(&format!(
        "pub fn embed(args: &[&str]) -> Result<{component}_generated::Embedded, impl std::fmt::Debug> {{\n    \
         {component}_generated::embed::<specific_worker::SpecificWorker>(args)\n}}\n"
    ));
    write(&target.join("src/lib.rs"), &lib);
    let map = repository().join("components/planar_map");
    let dependencies = format!(
        "planar_map = {{ path = {:?} }}\n{component}_generated = {{ path = \"generated\" }}\n",
        map.display().to_string()
    );
    write(
        &target.join("Cargo.toml"),
        &manifest(component, &dependencies),
    );
}

fn manifest(name: &str, dependencies: &str) -> String {
    format!(
        "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\n{dependencies}"
    )
}

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("to write");
}

#[test]
fn equal_seeds_give_equal_traces_over_every_middleware() {
    let folder = tempfile::tempdir().expect("a folder");
    let traces = [
        folder.path().join("local.csv"),
        folder.path().join("iceoryx2.csv"),
    ];
    in_one_process(&traces[0]);
    over_iceoryx2(&traces[1]);
    let [local, iceoryx2] = traces.map(|path| std::fs::read_to_string(path).expect("a trace"));
    let parted = local.lines().zip(iceoryx2.lines()).find(|(a, b)| a != b);
    assert_eq!(parted, None, "the first pose that differs");
    assert_eq!([&local, &iceoryx2].map(|t| t.lines().count()), [POSES; 2]);
    let last = |trace: &str| trace.lines().last().map(str::to_owned);
    assert_ne!(
        local.lines().next().map(str::to_owned),
        last(&local),
        "the robot never moved"
    );
}
