//! The program of a process, as it is written for cargo, and what is refused.

use crate::load::{Overrides, load};
use crate::model::Network;
use crate::profile::Profile;
use crate::workspaces::Workspaces;
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use std::path::Path;

const LIBRARY: &str = "pub struct SpecificWorker;\n";

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    folder
}

/// A component without connections, in the folder of its name; more files follow.
fn component<'f>(name: &str, more: &[(&'f str, &'f str)]) -> Vec<(String, String)> {
    let cdsl = format!("Component {name} {{ Communications {{}}; language rust; }};\n");
    let manifest = format!("[package]\nname = \"{name}\"\nversion = \"0.1.0\"\n");
    let mut files = vec![
        (format!("{name}/{name}.cdsl"), cdsl),
        (format!("{name}/Cargo.toml"), manifest),
    ];
    for (path, text) in more {
        files.push((format!("{name}/{path}"), (*text).to_owned()));
    }
    files
}

fn workspace(components: &[Vec<(String, String)>], network: &str) -> tempfile::TempDir {
    let root = "[workspace]\nmembers = [\"lidar\", \"camera\"]\n\n[workspace.dependencies]\nrc-runtime = { path = \"framework/runtime\" }\n";
    let mut files = vec![("Cargo.toml", root), ("n.ddsl", network)];
    for component in components {
        files.extend(
            component
                .iter()
                .map(|(path, text)| (path.as_str(), text.as_str())),
        );
    }
    folder(&files)
}

fn network(folder: &Path) -> (Network, SourceMap) {
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let path = folder.join("n.ddsl");
    let loaded = load(&path, &Overrides::default(), &mut sources, &loader);
    let (network, found) = loaded.expect("a file");
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    (network.expect("a network"), sources)
}

const NETWORK: &str = "Deployment robot\n{\n    \
    Component left { cdsl \"lidar/lidar.cdsl\"; process eyes; };\n    \
    Component right { cdsl \"lidar/lidar.cdsl\"; process eyes; };\n    \
    Component seen { cdsl \"camera/camera.cdsl\"; process eyes; };\n    \
    Component alone { cdsl \"camera/camera.cdsl\"; };\n};\n";

#[test]
fn a_process_is_one_program_that_links_each_component_once() {
    let library = [("src/lib.rs", LIBRARY)];
    let mut camera = component("camera", &library);
    // Its library has a name of its own.
    camera[1].1 += "\n[lib]\nname = \"eye\"\n";
    let folder = workspace(&[component("lidar", &library), camera], NETWORK);
    let (network, _) = network(folder.path());
    network.programs.ask_no_cargo();
    let workspaces = Workspaces::default();
    workspaces.unasked.set(true);
    let target = workspaces.target(folder.path()).expect("a folder").folder;
    let executable = |at| {
        network
            .programs
            .executable(at, Profile::Dev)
            .expect("a place")
    };
    let program = target.join("debug/process-robot-eyes");
    assert_eq!(executable(0), Some(program.clone()));
    assert_eq!(executable(2), Some(program));
    assert_eq!(executable(3), Some(target.join("debug/camera")));
    assert_eq!(network.programs.member_word(1).as_deref(), Some("lidar"));
    assert_eq!(network.programs.member_word(3), None);
    let build = || {
        let builds = network.programs.builds(Profile::Dev).expect("builds");
        let builds: Vec<_> = builds.map(|build| build.expect("a build")).collect();
        let args: Vec<String> = builds
            .iter()
            .map(|build| format!("{:?}: {}", build.args, build.packages.join(" ")))
            .collect();
        args
    };
    let args = build();
    assert_eq!(args.len(), 2, "{args:?}");
    assert!(
        args[0].contains("\"camera\"") && !args[0].contains("lidar"),
        "{args:?}"
    );
    assert!(
        args[1].contains("\"--bin\", \"process-robot-eyes\""),
        "{args:?}"
    );
    assert!(args[1].ends_with(": camera lidar"), "{args:?}");
    let place = target.join("rc/process/robot-eyes");
    let main = place.join("process-robot-eyes/src/main.rs");
    let text = std::fs::read_to_string(&main).expect("a file");
    for line in [
        "    ComponentType::new::<eye::SpecificWorker, camera_generated::Context>(),\n",
        "    ComponentType::new::<lidar::SpecificWorker, lidar_generated::Context>(),\n",
    ] {
        assert_eq!(text.matches(line).count(), 1, "{text}");
    }
    let manifest = std::fs::read_to_string(place.join("process-robot-eyes/Cargo.toml"));
    let manifest = manifest.expect("a file");
    let here = folder.path().canonicalize().expect("a folder");
    let here = here.display();
    for line in [
        "rc-runtime = { workspace = true }\n".to_owned(),
        format!("eye = {{ package = \"camera\", path = \"{here}/camera\" }}\n"),
        format!("camera_generated = {{ path = \"{here}/camera/generated\" }}\n"),
        format!("lidar = {{ path = \"{here}/lidar\" }}\n"),
        format!("lidar_generated = {{ path = \"{here}/lidar/generated\" }}\n"),
    ] {
        assert!(manifest.contains(&line), "{line}{manifest}");
    }
    let root = std::fs::read_to_string(place.join("Cargo.toml")).expect("a file");
    assert!(
        root.contains("members = [\"process-robot-eyes\", \"variant-features\"]"),
        "{root}"
    );
    assert!(root.contains("/framework/runtime\""), "{root}");
    // Cargo compiles nothing again if nothing has changed.
    let written = || {
        main.metadata()
            .and_then(|file| file.modified())
            .expect("a file")
    };
    let before = written();
    build();
    assert_eq!(written(), before);
}

#[test]
fn components_that_cannot_be_linked_are_refused() {
    let found = |components: &[Vec<(String, String)>]| {
        let folder = workspace(components, NETWORK);
        let (network, sources) = network(folder.path());
        let mut found = Diagnostics::new();
        network.programs.check_processes(&mut found);
        render(&sources, &found, Format::Short)
    };
    let library = [("src/lib.rs", LIBRARY)];
    let camera = || component("camera", &library);
    assert_eq!(found(&[component("lidar", &library), camera()]), "");
    let program = component("lidar", &[("src/main.rs", "fn main() {}\n")]);
    let said = found(&[program, camera()]);
    assert_eq!(
        said.matches("error[process-without-library]").count(),
        2,
        "{said}"
    );
    assert!(said.contains("n.ddsl:3:"), "{said}");
    assert!(
        said.contains("`lidar_generated::run::<lidar::SpecificWorker>()`"),
        "{said}"
    );
    let mut other = component("lidar", &library);
    other[1].1 += "\n[workspace]\n";
    let said = found(&[other, camera()]);
    assert!(said.contains("error[process-workspaces]"), "{said}");
    assert!(
        said.contains("`left` of") && said.contains("`seen` of"),
        "{said}"
    );
    // This component, generated for shared memory: `right` is a variant for DDS.
    let generated = |word: &str| {
        format!(
            "const NOTE: &[u8] = b\"\\x02rc-note\\x03\\x1e\\x1f{{\\\"component\\\":\\\"lidar\\\",\\\"model\\\":\\\"0\\\",\\\"middleware\\\":\\\"{word}\\\"}}\\0\";\n"
        )
    };
    let note = generated("iceoryx2");
    let lidar = component("lidar", &[library[0], ("generated/src/backend.rs", &note)]);
    assert_eq!(found(&[lidar.clone(), camera()]), "");
    let folder = workspace(
        &[lidar, camera()],
        &NETWORK.replacen("Component right {", "Component right { middleware dds;", 1),
    );
    let (network, sources) = network(folder.path());
    let mut all = Diagnostics::new();
    network.programs.check_processes(&mut all);
    let said = render(&sources, &all, Format::Short);
    assert_eq!(
        said.matches("error[process-middlewares]").count(),
        1,
        "{said}"
    );
    assert!(
        said.contains("iceoryx2 for `left`, dds for `right`"),
        "{said}"
    );
}
