//! Members and tables of workspaces of cargo.

use super::*;

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

#[test]
fn a_package_belongs_to_the_nearest_workspace_that_includes_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    write(
        &root.join("Cargo.toml"),
        "[workspace] # note\nmembers = [\"parts/*\", \"lone/a\"]\nexclude = [\"lone\"]\n",
    );
    write(
        &root.join("own/Cargo.toml"),
        "workspace = {}\n[package]\nname = \"own\"\n",
    );
    write(
        &root.join("lone/named/Cargo.toml"),
        "[package]\nworkspace = \"../..\"\n",
    );
    let of = |path: &str| {
        let found = Workspace::of(&root.join(path)).expect("manifests");
        found.map(|workspace| relative(&root, workspace.root()).display().to_string())
    };
    for (folder, workspace) in [
        ("parts/new", Some("")),
        ("", Some("")),
        ("own", Some("own")),
        ("own/inside/deep", Some("own")),
        ("lone/b", None),
        ("lone/a", Some("")),
        ("lone/named", Some("")),
    ] {
        assert_eq!(of(folder).as_deref(), workspace, "{folder}");
    }
    write(&root.join("own/Cargo.toml"), "[workspace\n");
    let error = Workspace::of(&root.join("own")).expect_err("no TOML");
    assert!(error.to_string().contains("own/Cargo.toml: "), "{error}");
}

#[test]
fn components_are_found_in_packages_and_in_members() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    write(
        &root.join("Cargo.toml"),
        "[workspace]\nmembers = [\"components/*\", \"bench/p?ng\"]\n",
    );
    // A component in another language is a package of its own, also inside one.
    let python = "Component guide { Communications {}; language python; };\n";
    for (folder, has_manifest) in [("old/guide", true), ("old/tests", false)] {
        write(&root.join(folder).join("guide.cdsl"), python);
        if has_manifest {
            write(&root.join(folder).join("pyproject.toml"), "");
        }
    }
    for file in [
        "components/new/new.cdsl",
        "bench/ping/ping.cdsl",
        "bench/other/other.cdsl",
        "old/old.cdsl",
        "old/Cargo.toml",
        "components/own/own.cdsl",
        "tests/fixture.cdsl",
        "target/built/built.cdsl",
    ] {
        write(&root.join(file), "");
    }
    write(&root.join("components/own/Cargo.toml"), "[workspace]\n");
    let workspace = Workspace::of(&root).expect("manifests").expect("a root");
    let (components, unlisted) = workspace.components(&root).expect("folders");
    let components = components.iter().map(|path| relative(&root, path));
    let components: Vec<String> = components.map(|p| p.display().to_string()).collect();
    assert_eq!(
        components,
        [
            "bench/ping/ping.cdsl",
            "components/new/new.cdsl",
            "old/guide/guide.cdsl",
            "old/old.cdsl"
        ]
    );
    let unlisted = unlisted.iter().map(|path| relative(&root, path));
    let unlisted: Vec<String> = unlisted.map(|p| p.display().to_string()).collect();
    assert_eq!(unlisted, ["bench/other/other.cdsl", "tests/fixture.cdsl"]);
}

#[test]
fn a_new_member_has_the_layout_of_the_last_one() {
    let with = |manifest: &str, member: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        write(&folder.path().join("Cargo.toml"), manifest);
        let workspace = Workspace::of(folder.path()).expect("TOML").expect("a root");
        let edited = workspace.with_member(Path::new(member)).expect("TOML");
        edited.map(|(_, new)| new)
    };
    let named = "[workspace]\nmembers = [\"components/*\"]\n";
    assert_eq!(with(named, "components/a"), None);
    assert_eq!(
        with(
            "[workspace]\n# mine\nmembers = [\n    \"x\",\n    \"y\",\n]\n",
            "components/a"
        )
        .as_deref(),
        Some(
            "[workspace]\n# mine\nmembers = [\n    \"x\",\n    \"y\",\n    \"components/a\",\n]\n"
        )
    );
    assert_eq!(
        with("[workspace]\nmembers = [\"x\"]\n", "components/a").as_deref(),
        Some("[workspace]\nmembers = [\"x\", \"components/a\"]\n")
    );
    assert_eq!(
        with("[workspace]\nmembers = [\n  \"x\"\n]\n", "components/a").as_deref(),
        Some("[workspace]\nmembers = [\n  \"x\",\n  \"components/a\"\n]\n")
    );
    assert_eq!(
        with("[workspace]\n", "components/a").as_deref(),
        Some("[workspace]\nmembers = [\"components/a\"]\n")
    );
}

#[test]
fn an_older_workspace_gets_the_dependency_on_the_middleware() {
    let manifest = |dependency: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let text = format!("[workspace]\n# mine\n[workspace.dependencies]\n{dependency}\n");
        write(&folder.path().join("Cargo.toml"), &text);
        let workspace = Workspace::of(folder.path()).expect("TOML").expect("a root");
        let edited = workspace.as_needed(&[]).expect("TOML");
        edited.map(|(_, new)| new.replace(&text, ""))
    };
    let path = "rc-runtime = { path = \"/opt/rc/runtime\" }";
    assert_eq!(
        manifest(path).as_deref(),
        Some(
            "rc-middleware = { path = \"/opt/rc/middleware\" }\ninterfaces = { path = \"interfaces/generated\" }\n"
        )
    );
    let git = "rc-runtime = { git = \"https://robots\", features = [\"x\"] } # mine";
    assert_eq!(
        manifest(git).as_deref(),
        Some(
            "rc-middleware = { git = \"https://robots\" }\ninterfaces = { path = \"interfaces/generated\" }\n"
        )
    );
    let both = format!("{path}\nrc-middleware = {{ path = \"/mine\" }}");
    assert_eq!(manifest(&both), None);
    assert_eq!(manifest("serde = \"1\""), None);
}

#[test]
fn members_are_the_folders_that_patterns_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    write(
        &root.join("Cargo.toml"),
        "[workspace]\nmembers = [\"parts/*\", \"parts/arm\", \"deep/*/p?ng\", \"nowhere/*\", \"gone\", \"parts/*/generated\"]\n\
         exclude = [\"parts/old\"]\n\
         [workspace.dependencies]\nlibm = \"0.2\"\nan-arm = { path = \"parts/arm\", package = \"arm\" }\n",
    );
    for folder in [
        "parts/arm",
        "parts/old",
        "parts/.hidden",
        "parts/arm/generated",
        "parts/arm/inner",
        "deep/one/ping",
        "deep/one/pong2",
        "deep/target/ping",
        "other",
    ] {
        let name = folder.rsplit('/').next().unwrap_or_default();
        let manifest = format!("[package]\nname = \"{name}\" # x\n");
        write(&root.join(folder).join("Cargo.toml"), &manifest);
    }
    let workspace = Workspace::of(&root).expect("manifests").expect("a root");
    let members = workspace.members().expect("folders");
    let members = members.iter().map(|(folder, package)| {
        let name = match package {
            Package::Named(name) => format!("named {name}"),
            Package::Manifest(text) => package_name(text).unwrap_or_default(),
        };
        format!("{} {name}", relative(&root, folder).display())
    });
    let members: Vec<String> = members.collect();
    assert_eq!(members, ["deep/one/ping ping", "parts/arm named arm"]);
}
