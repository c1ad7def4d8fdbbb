//! Generation never changes files of the user: a fixed sequence of random edits of the
//! descriptions.

mod model;

use crate::folders::{changed, files, rcgen};
use model::{Model, Random, Spoiled};
use rc_codegen::{FileLoader, Project, generation, stubs};
use rc_diagnostics::SourceMap;
use rc_test_support::share_builds;
use std::fs;
use std::path::Path;
use std::process::Command;

const EDITS: usize = 200;
const SEED: u64 = 0x5EED;

/// Like `rcgen edited.cdsl`, in this process. Returns whether files were written.
fn run(folder: &Path) -> bool {
    let mut sources = SourceMap::new();
    let loader = FileLoader::new(&[]);
    let Ok((project, found)) = Project::load(&folder.join("edited.cdsl"), &mut sources, &loader)
    else {
        return false;
    };
    let Some(project) = project.filter(|_| !found.has_errors()) else {
        return false;
    };
    let middleware = rc_cdsl::model::Middleware::Iceoryx2;
    let found = generation::generate(&project, folder.to_path_buf(), middleware, &mut sources);
    if found.expect("a folder that can be written").has_errors() {
        return false;
    }
    let (missing, found) = stubs::of(&project, folder, &mut sources).expect("sources");
    assert!(!found.has_errors());
    missing.expect("an answer");
    true
}

/// Changes the user's files of a component.
fn edit_worker(folder: &Path) {
    let write = |file: &str, text: &[u8]| {
        let path = folder.join(file);
        fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        fs::write(path, text).expect("a file");
    };
    let worker = fs::read_to_string(folder.join("src/specific_worker.rs")).expect("a worker");
    let worker = worker.replace('\n', "\r\n") + "// mine, without a line feed at its end";
    write("src/specific_worker.rs", worker.as_bytes());
    write(
        "src/main.rs",
        b"//! Mine.\nmod specific_worker;\nfn main() {}\n",
    );
    write("src/generated/slots.rs", b"pub struct NotGenerated;\n");
    write(
        "src/parts/voice.rs.rcgen-new",
        b"a name that rcgen uses, too",
    );
    write("Cargo.toml", b"# mine\n[package]\n");
    write("etc/config.toml", b"[component]\nperiod = \"1s\"\n");
    write("etc/other.toml", &[0xff, 0x00]);
    write("build.rs", b"");
    write("generated.md", b"notes");
    write(".hidden/notes", b"notes");
}

fn write_model(model: &Model, random: &mut Random, folder: &Path) {
    for (file, text) in model.print("edited", random) {
        fs::write(folder.join(file), text).expect("a file");
    }
}

#[test]
fn random_edits_do_not_change_user_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let mut random = Random::new(SEED);
    let mut model = Model::new();
    write_model(&model, &mut random, folder);
    assert!(run(folder));
    edit_worker(folder);
    let (mut written, mut refused) = (0, 0);
    for step in 0..EDITS {
        model.edit(&mut random);
        write_model(&model, &mut random, folder);
        let spoiled = random.one_in(3).then(|| Spoiled::new(&mut random));
        if let Some(spoiled) = &spoiled {
            spoiled.apply(folder, &model, &mut random);
        }
        if random.one_in(20) {
            fs::remove_dir_all(folder.join("generated")).expect("it is there");
        }
        let before = files(folder);
        let describe = || {
            let text = String::from_utf8_lossy(&before[Path::new("edited.cdsl")]).into_owned();
            format!("edit {step}, {spoiled:?}:\n{text}")
        };
        let valid = if step % 20 == 0 {
            let (code, _, err) = rcgen(folder, &["edited.cdsl"]);
            assert!(code < 2, "{}\n{err}", describe());
            code == 0
        } else {
            run(folder)
        };
        let differing = changed(&before, &files(folder));
        let expected = spoiled.map_or(Some(true), Spoiled::validity);
        assert!(expected.is_none_or(|e| e == valid), "{}", describe());
        if valid {
            written += 1;
            let foreign: Vec<&String> = differing
                .iter()
                .filter(|path| {
                    let path = path.strip_prefix("interfaces/").unwrap_or(path);
                    !path.starts_with("generated/")
                })
                .collect();
            assert!(foreign.is_empty(), "{foreign:?} changed at {}", describe());
        } else {
            refused += 1;
            assert!(
                differing.is_empty(),
                "{differing:?} changed at {}",
                describe()
            );
        }
        if !folder.join("generated").exists() {
            write_model(&model, &mut random, folder);
            assert!(run(folder), "{}", describe());
        }
    }
    assert!(written > 100 && refused > 40, "{written} {refused}");
}

/// New workers of ten components of the same sequence compile without a warning.
#[test]
fn workers_of_ten_random_components_compile() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(
        rcgen(folder.path(), &["init", "robot", "--framework", root]).0,
        0
    );
    let workspace = folder.path().join("robot");
    share_builds(&workspace, Path::new("components/features"));
    let mut random = Random::new(SEED);
    let mut model = Model::new();
    for number in 0..10 {
        for _ in 0..EDITS / 10 {
            model.edit(&mut random);
        }
        let name = format!("edited_{number}");
        let component = workspace.join("components").join(&name);
        fs::create_dir(&component).expect("a folder");
        // A workspace allows one definition per module.
        let own = format!("Own{number}");
        for (file, text) in model.print(&name, &mut random) {
            let text = text.replace("module Own", &format!("module {own}"));
            let text = text.replace("Own::", &format!("{own}::"));
            fs::write(component.join(file), text).expect("a file");
        }
        let file = component.join("edited.cdsl");
        let (code, _, err) = rcgen(&component, &["edited.cdsl"]);
        assert_eq!(code, 0, "{}\n{err}", file.display());
    }
    // The target folder of this test run, so that nothing is built twice.
    let program = Path::new(env!("CARGO_BIN_EXE_rcgen"));
    let target = program.ancestors().nth(2).expect("target/debug/rcgen");
    let cargo = |args: &[&str]| {
        let output = Command::new(env!("CARGO"))
            .args(args)
            .current_dir(&workspace)
            .env("CARGO_TARGET_DIR", target)
            .output()
            .expect("cargo starts");
        let [out, err] =
            [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
        assert!(output.status.success() && err.is_empty(), "{out}\n{err}");
    };
    let mut check = vec!["check", "--workspace", "--offline", "-q", "-j1", "--lib"];
    let programs: Vec<String> = (0..10).map(|n| format!("--bin=edited_{n}")).collect();
    check.extend(programs.iter().map(String::as_str));
    cargo(&check);
    let packages =
        (0..10).flat_map(|n| [format!("-pedited_{n}"), format!("-pedited_{n}_generated")]);
    let packages: Vec<String> = packages.collect();
    let mut fmt = vec!["fmt", "--check"];
    fmt.extend(packages.iter().map(String::as_str));
    cargo(&fmt);
}
