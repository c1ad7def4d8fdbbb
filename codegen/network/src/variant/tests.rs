//! Manifests of variants.

use super::*;

fn folder(manifest: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("Cargo.toml"), manifest).expect("to write");
    folder
}

#[test]
fn a_program_has_the_name_of_its_middleware_and_the_dependencies_of_its_user() {
    let folder = folder(
        "[package]\nname = \"lidar\"\ndefault-run = \"lidar\"\nworkspace = \"../..\"\n\n[dependencies]\n\
             lidar_generated.workspace = true\nnear = { path = \"../near\" }\nfar = \"1\"\n\n\
             [dev-dependencies]\nlidar_generated = { path = \"generated\", features = [\"testing\"] }\n\n\
             [target.'cfg(unix)'.dependencies]\nunix = { path = \"../unix\" }\n\n\
             [target.'cfg(unix)'.dev-dependencies]\nlidar_generated = { path = \"generated\" }\n\n\
             [[bin]]\nname = \"tool\"\npath = \"src/tool.rs\"\n\n[[bin]]\nname = \"lidar\"\npath = \"src/lidar.rs\"\n",
    );
    let path = folder.path();
    let manifest =
        user_manifest(path, "lidar", rc_vocabulary::Middleware::Dds.into()).expect("a manifest");
    let here = path.display();
    let wanted = format!(
        "[package]\nname = \"lidar\"\nautobins = false\n\n[dependencies]\n\
             lidar_generated = {{ path = \"generated\" }}\nnear = {{ path = \"{here}/../near\" }}\nfar = \"1\"\n\n\
             [target.'cfg(unix)'.dependencies]\nunix = {{ path = \"{here}/../unix\" }}\n\n\
             [[bin]]\nname = \"tool\"\npath = \"src/tool.rs\"\n\n[[bin]]\nname = \"lidar-dds\"\npath = \"{here}/src/lidar.rs\"\n"
    );
    assert_eq!(manifest.to_string(), wanted);
}

#[test]
fn paths_of_a_workspace_stay_valid_in_a_variant() {
    let folder = folder(
        "[package]\nname = \"root\"\nedition = \"2024\"\n\n[workspace]\nmembers = [\"a\"]\nexclude = [\"b\"]\n\n\
             [workspace.dependencies]\nnear = { path = \"near\" }\nfar = \"1\"\n\n[patch.crates-io]\n\
             old = { path = \"new\" }\n\n[profile.dev]\ndebug = 1\n\n[dependencies]\nfar = \"1\"\n",
    );
    let manifest = shared(folder.path()).expect("a manifest").to_string();
    let here = folder.path().display();
    for part in [
        format!("near = {{ path = \"{here}/near\" }}"),
        format!("old = {{ path = \"{here}/new\" }}"),
        "resolver = \"3\"".to_owned(),
        "debug = 1".to_owned(),
    ] {
        assert!(manifest.contains(&part), "{part}\n{manifest}");
    }
    for part in ["[package]", "exclude", "\n[dependencies]"] {
        assert!(!manifest.contains(part), "{part}\n{manifest}");
    }
}

#[test]
fn a_member_asks_for_the_features_of_the_users_workspace() {
    let dependency = |name: &str, changes: serde_json::Value| {
        let mut json = serde_json::json!({
            "name": name, "source": "registry+https://github.com/rust-lang/crates.io-index", "req": "^1",
            "kind": null, "optional": false, "uses_default_features": false, "features": ["std"], "target": null,
        });
        for (key, value) in changes.as_object().into_iter().flatten() {
            json[key] = value.clone();
        }
        serde_json::from_value::<Dependency>(json).expect("a dependency")
    };
    let manifest = features(&[
        dependency("near", serde_json::json!({"source": null})),
        dependency("far", serde_json::json!({})),
        dependency("far", serde_json::json!({})),
        dependency("far", serde_json::json!({"features": []})),
        dependency("tested", serde_json::json!({"kind": "dev"})),
        dependency("chosen", serde_json::json!({"optional": true})),
        dependency("built", serde_json::json!({"kind": "build"})),
        dependency("unix", serde_json::json!({"target": "cfg(unix)"})),
    ]);
    let wanted = "[package]\nname = \"variant-features\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
            [dependencies]\na1 = { package = \"far\", version = \"^1\", default-features = false, features = [\"std\"] }\n\
            a2 = { package = \"far\", version = \"^1\", default-features = false, features = [] }\n\n\
            [build-dependencies]\na3 = { package = \"built\", version = \"^1\", default-features = false, features = [\"std\"] }\n\n\
            [target]\n\n[target.\"cfg(unix)\"]\n\n[target.\"cfg(unix)\".dependencies]\n\
            a4 = { package = \"unix\", version = \"^1\", default-features = false, features = [\"std\"] }\n";
    assert_eq!(manifest.to_string(), wanted);
}

#[test]
fn a_folder_is_locked_during_a_build() {
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("dds");
    let lock = |patience| lock_folder(&folder, patience);
    let first = lock(Duration::ZERO).expect("a free folder");
    let busy = lock(Duration::from_millis(1)).expect_err("another one has it");
    assert!(busy.to_string().contains("another build"), "{busy}");
    let next = std::thread::scope(|scope| {
        let next = scope.spawn(|| lock(PATIENCE));
        drop(first);
        next.join().expect("a thread")
    });
    assert!(next.is_ok());
}

#[test]
fn links_follow_the_files_of_the_user() {
    let user = folder("");
    let staged = tempfile::tempdir().expect("a folder");
    let names = || {
        let entries = std::fs::read_dir(staged.path())
            .expect("a folder")
            .flatten();
        let mut names: Vec<_> = entries.map(|e| e.file_name()).collect();
        names.sort();
        names
    };
    std::fs::create_dir(user.path().join("src")).expect("a folder");
    std::fs::create_dir(user.path().join(GENERATED)).expect("a folder");
    std::fs::write(user.path().join("build.rs"), "").expect("a file");
    link(user.path(), staged.path()).expect("links");
    assert_eq!(names(), ["build.rs", "src"]);
    std::fs::remove_file(user.path().join("build.rs")).expect("it was there");
    std::fs::write(user.path().join("data"), "").expect("a file");
    link(user.path(), staged.path()).expect("links");
    assert_eq!(names(), ["data", "src"]);
}
