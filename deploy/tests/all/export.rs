//! Exports: golden texts, and acceptance by the tools they are made for.

use crate::kubernetes::{Manifest, Restart};
use expect_test::expect_file;
use rc_codegen::FileLoader;
use rc_deploy_export::{Engine, Export, export};
use rc_deploy_network::{self as network, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use rc_test_support::python;
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const NETWORKS: [&str; 7] = [
    "components/networks/camera.ddsl",
    "components/networks/joints.ddsl",
    "components/networks/patrol.ddsl",
    "components/networks/speech.ddsl",
    "deploy/tests/export/all.ddsl",
    "deploy/tests/export/process.ddsl",
    "deploy/tests/export/adapted.ddsl",
];

fn root() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    root.canonicalize().expect("the repository")
}

/// The exported files of a network, with its target folder.
fn exported(network: &str, engine: Engine) -> (Export, PathBuf) {
    let mut sources = SourceMap::new();
    let path = root().join(network);
    let loader = FileLoader::new(&[]);
    let (network, found) =
        network::load(&path, &network::Overrides::default(), &mut sources, &loader)
            .expect("a file");
    let report = render(&sources, &found, Format::Short);
    assert!(!found.has_errors(), "{report}");
    let network = network.expect("a network");
    let plan = network.plan(Profile::Release).expect("a plan");
    let program = &plan.components[0].executable;
    let target = program.ancestors().nth(2).expect("a folder").to_path_buf();
    let export = export(&network, &plan, engine, None, (1000, 100)).expect("it can be exported");
    (export, target)
}

/// All files in one text, with paths that are the same on every machine. The picture that the
/// patrol writes is data for the image where the patrol has run; its lines are left out.
fn text(export: &Export, target: &Path) -> String {
    let files = export.files.iter();
    let all = files.map(|(path, _, text)| format!("==> {} <==\n{text}\n", path.display()));
    let all: String = all.collect();
    let all = all.replace(&target.display().to_string(), "/robot/target");
    let all = all.replace(&root().display().to_string(), "/robot");
    // The program of adaptors lies beside that of the test.
    let all = all.replace("target/debug/deps/", "target/release/");
    let lines = all.split_inclusive('\n');
    lines.filter(|line| !line.contains("/patrol.svg")).collect()
}

#[test]
fn files_equal_their_goldens() {
    for network in NETWORKS {
        for (word, engine) in Engine::WORDS {
            let (export, target) = exported(network, engine);
            let name = Path::new(network).file_stem().expect("a name");
            let file = format!("../export/{}.{word}.txt", name.display());
            expect_file![file].assert_eq(&text(&export, &target));
        }
    }
}

/// A unit of systemd starts the launcher of a component in Python. A container has no interpreter.
#[test]
fn components_in_python_are_exported_to_systemd_only() {
    let folder = tempfile::tempdir().expect("a folder");
    let cdsl = root().join("deploy/tests/programs/wanderer/wanderer.cdsl");
    let text = format!(
        "Deployment python {{ Component arm {{ cdsl \"{}\"; }}; }};\n",
        cdsl.display()
    );
    let file = folder.path().join("python.ddsl");
    fs::write(&file, text).expect("a file");
    let mut sources = SourceMap::new();
    let loader = FileLoader::new(&[]);
    let overrides = network::Overrides::default();
    let (loaded, found) = network::load(&file, &overrides, &mut sources, &loader).expect("a file");
    let report = render(&sources, &found, Format::Short);
    let loaded = loaded.unwrap_or_else(|| panic!("{report}"));
    let plan = loaded.plan(Profile::Release).expect("a plan");
    let exported = |engine| export(&loaded, &plan, engine, None, (1000, 100));
    let units = exported(Engine::Systemd).expect("units");
    let service = units
        .files
        .iter()
        .find(|(path, ..)| path.to_string_lossy().ends_with("python-arm.service"));
    let (.., service) = service.expect("a service");
    let program = plan.components[0].executable.display().to_string();
    assert!(program.ends_with("/wanderer"), "{program}");
    assert!(
        service.contains(&format!("ExecStart=:{program} ")),
        "{service}"
    );
    let said = units.notes.join("\n");
    assert!(
        said.contains("`rcgen venv FILE.cdsl` makes `.venv`"),
        "{said}"
    );
    for (word, engine) in [
        ("compose", Engine::Compose),
        ("kubernetes", Engine::Kubernetes),
    ] {
        let refused = exported(engine).expect_err("no interpreter");
        assert_eq!(
            refused,
            format!(
                "`arm` is in Python, and the containers of an export to {word} have no interpreter and no packages for it; \
                 export with `--to systemd`, or start the network by `rcdeploy up`"
            )
        );
    }
}

/// Each difference is reported to the user and noted in the files.
#[test]
fn every_note_is_in_a_file() {
    for (_, engine) in Engine::WORDS {
        let (export, _) = exported(NETWORKS[4], engine);
        assert!(export.notes.len() > 3, "{:?}", export.notes);
        for note in &export.notes {
            let mut files = export.files.iter();
            assert!(
                files.any(|(.., text)| text.contains(note.as_str())),
                "{note}"
            );
        }
    }
}

/// Writes the units into a folder, with stub programs.
fn units(network: &str, folder: &Path) -> Vec<PathBuf> {
    let (export, target) = exported(network, Engine::Systemd);
    let programs = folder.join("programs");
    fs::create_dir_all(programs.join("release")).expect("a folder");
    let mut written = Vec::new();
    for (path, _, text) in export.files.iter() {
        let from = target.display().to_string();
        let text = text.replace(&from, &programs.display().to_string());
        for line in text.lines() {
            if let Some(program) = line
                .strip_prefix("ExecStart=:")
                .and_then(|l| l.split_whitespace().next())
            {
                let within = Path::new(program).parent().expect("a folder");
                fs::create_dir_all(within).expect("a folder");
                fs::write(program, "#!/bin/sh\n").expect("a program");
                fs::set_permissions(program, fs::Permissions::from_mode(0o755))
                    .expect("its rights");
            }
        }
        let path = folder.join(path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, text).expect("a unit");
        written.push(path);
    }
    written
}

/// The output of `systemd-analyze verify` for the units of one folder, without keys that older
/// versions do not know.
fn verify(units: &[PathBuf]) -> Result<String, std::io::Error> {
    let folder = units[0].parent().expect("a folder");
    let output = Command::new("systemd-analyze")
        .args(["verify", "--man=no", "--generators=no"])
        .args(units)
        .env("SYSTEMD_UNIT_PATH", format!("{}:", folder.display()))
        .output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let newer = ["RestartSteps", "RestartMaxDelaySec"];
    let lines = said.lines().filter(|line| {
        let unknown = line.contains("Unknown key") && newer.iter().any(|key| line.contains(key));
        // Ignore units of the machine that runs the tests.
        !unknown && line.contains("robocomp-")
    });
    let mut said: String = lines.map(|line| format!("{line}\n")).collect();
    if !output.status.success() && said.is_empty() {
        said = String::from_utf8_lossy(&output.stderr).into_owned();
    }
    Ok(said)
}

#[test]
fn systemd_accepts_the_units() {
    for network in NETWORKS {
        let folder = tempfile::tempdir().expect("a folder");
        let units = units(network, folder.path());
        let mut folders: Vec<&Path> = units.iter().filter_map(|unit| unit.parent()).collect();
        folders.sort_unstable();
        folders.dedup();
        for folder in folders {
            let here: Vec<PathBuf> = units
                .iter()
                .filter(|unit| unit.parent() == Some(folder))
                .cloned()
                .collect();
            match verify(&here) {
                Ok(said) => assert_eq!(said, "", "{network}"),
                Err(error) => {
                    return python::skipped(
                        "systemd_accepts_the_units",
                        &format!("systemd-analyze: {error}"),
                    );
                }
            }
        }
    }
}

/// The check detects faults.
#[test]
fn systemd_detects_faults() {
    let folder = tempfile::tempdir().expect("a folder");
    let units = units(NETWORKS[2], folder.path());
    for unit in &units {
        let text = fs::read_to_string(unit)
            .expect("a unit")
            .replace("KillMode=mixed", "KillMode=mixd");
        fs::write(unit, text).expect("a unit");
    }
    match verify(&units) {
        Ok(said) => assert!(said.contains("kill mode"), "{said}"),
        Err(error) => python::skipped(
            "systemd_detects_faults",
            &format!("systemd-analyze: {error}"),
        ),
    }
}

fn documents(export: &Export) -> Vec<Value> {
    let mut all = Vec::new();
    let yaml = |path: &Path| path.extension().is_some_and(|e| e == "yaml");
    for (.., text) in export.files.iter().filter(|(path, ..)| yaml(path)) {
        for document in serde_norway::Deserializer::from_str(text) {
            let value = serde::Deserialize::deserialize(document).expect("YAML");
            all.push(value);
        }
    }
    all
}

#[test]
fn every_manifest_fits_the_types_of_kubernetes() {
    for network in NETWORKS {
        let (export, _) = exported(network, Engine::Kubernetes);
        let documents = documents(&export);
        assert!(documents.len() >= 2);
        for document in documents {
            let manifest: Manifest = serde_json::from_value(document.clone())
                .unwrap_or_else(|error| panic!("{error}: {document:#}"));
            let pod = manifest.pod();
            let [container] = &pod.containers[..] else {
                panic!("{document:#}")
            };
            let command = &container.readiness_probe.exec.command;
            let probed = command.iter().filter(|word| *word == "--probe").count();
            assert!(probed > 0);
            let wanted = pod.restart_policy != Restart::Never;
            assert_eq!(container.liveness_probe.is_some(), wanted);
        }
    }
}

#[test]
fn the_types_of_kubernetes_reject_faults() {
    let (export, _) = exported("components/networks/patrol.ddsl", Engine::Kubernetes);
    let right = documents(&export).remove(0);
    let read = |manifest: &Value| serde_json::from_value::<Manifest>(manifest.clone());
    assert!(read(&right).is_ok());
    let pod = "/spec/template/spec";
    for (object, key, value) in [
        (pod.to_owned(), "restartPolicy", Value::from("Sometimes")),
        (pod.to_owned(), "hostPid", Value::from(true)),
        (
            pod.to_owned(),
            "terminationGracePeriodSeconds",
            Value::from("3s"),
        ),
        (format!("{pod}/containers/0"), "readynessProbe", Value::Null),
        (
            format!("{pod}/containers/0"),
            "args",
            Value::from("--active"),
        ),
        (String::new(), "kind", Value::from("Pod")),
    ] {
        let mut wrong = right.clone();
        let object = wrong.pointer_mut(&object).expect("an object");
        object[key] = value;
        assert!(read(&wrong).is_err(), "{key}");
    }
}

/// The schemas of Kubernetes also know patterns and limits of values, which the types do not.
#[test]
fn the_schemas_of_kubernetes_accept_every_manifest_and_reject_faults() {
    let test = "the_schemas_of_kubernetes_accept_every_manifest_and_reject_faults";
    let Some(python) = python::interpreter("kubernetes-validate==1.37.0", test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let validate = |text: &str| {
        let file = folder.path().join("manifests.yaml");
        fs::write(&file, text).expect("a file");
        let mut command = Command::new(python);
        let output = command
            .args(["-m", "kubernetes_validate", "--strict"])
            .arg(file)
            .output();
        let output = output.expect("it starts");
        let said =
            String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        (output.status.success(), said.into_owned())
    };
    let faults = [
        ("readinessProbe:", "readynessProbe:"),
        ("replicas: 1", "replicas: one"),
    ];
    let mut right = String::new();
    for network in NETWORKS {
        let (export, _) = exported(network, Engine::Kubernetes);
        let yaml = |path: &Path| path.extension().is_some_and(|e| e == "yaml");
        for (.., text) in export.files.iter().filter(|(path, ..)| yaml(path)) {
            let (accepted, said) = validate(text);
            assert!(accepted, "{network}: {said}");
            if faults.iter().all(|(word, _)| text.contains(word)) {
                text.clone_into(&mut right);
            }
        }
    }
    for (word, wrong) in faults {
        let spoilt = right.replace(word, wrong);
        assert_ne!(spoilt, right, "{word}");
        let (accepted, said) = validate(&spoilt);
        assert!(!accepted, "{wrong}: {said}");
    }
}

/// Docker publishes the schema with its old Python program.
const VALIDATE: &str = r#"
import glob, json, subprocess, sys, zipfile
import jsonschema
folder = sys.argv[1]
found = lambda: glob.glob(folder + "/docker_compose-1.29.2-*.whl")
if not found():
    pip = [sys.argv[2], "-m", "pip", "download", "-q", "--no-deps", "--retries", "1", "--timeout", "15", "-d", folder, "docker-compose==1.29.2"]
    if subprocess.run(pip).returncode != 0:
        sys.exit(77)
schema = json.load(zipfile.ZipFile(found()[0]).open("compose/config/compose_spec.json"))
validator = jsonschema.Draft7Validator(schema)
for number, file in enumerate(json.load(sys.stdin)):
    for error in validator.iter_errors(file):
        print(number, list(error.path), error.message)
"#;

/// The errors that the schema of Compose finds in files.
fn validate(files: &[Value], test: &str) -> Option<String> {
    let python = python::interpreter("jsonschema==4.23.0", test)?;
    let pip = match python::pip() {
        Ok(pip) => pip,
        Err(reason) => {
            python::skipped(test, &reason);
            return None;
        }
    };
    let mut child = Command::new(python)
        .args(["-c", VALIDATE, env!("CARGO_TARGET_TMPDIR")])
        .arg(pip)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    let text = serde_json::to_vec(files).expect("JSON");
    stdin.write_all(&text).expect("it reads");
    drop(stdin);
    let output = child.wait_with_output().expect("it ends");
    if output.status.code() == Some(77) {
        python::skipped(
            test,
            "there is no way to docker-compose==1.29.2, which has the schema",
        );
        return None;
    }
    assert!(output.status.success(), "{output:?}");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
fn the_schema_of_compose_accepts_every_file_and_rejects_faults() {
    let test = "the_schema_of_compose_accepts_every_file_and_rejects_faults";
    let networks = NETWORKS.iter();
    let mut files: Vec<Value> = networks
        .flat_map(|network| documents(&exported(network, Engine::Compose).0))
        .collect();
    for file in &mut files {
        // This old schema does not have the rule: lower-case letters, digits, `_` and `-`, not
        // starting with `-`.
        let name = file.as_object_mut().and_then(|file| file.remove("name"));
        let name = name.as_ref().and_then(Value::as_str).expect("a name");
        assert!(
            name.chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'),
            "{name}"
        );
    }
    let Some(said) = validate(&files, test) else {
        return;
    };
    assert_eq!(said, "");
    let spoilt = files[0]["services"]["left"]
        .as_object_mut()
        .expect("a service");
    spoilt.insert("restrat".to_owned(), "no".into());
    let said = validate(&files[..1], test).expect("it was there a moment ago");
    assert!(said.contains("restrat"), "{said}");
}

/// A service waits for the same components as its unit and its Pod.
#[test]
fn order_and_policies_are_the_same_for_all_engines() {
    let (systemd, _) = exported(NETWORKS[2], Engine::Systemd);
    let unit = Path::new("robocomp-patrol-avoider.service");
    let unit = systemd.files.text(unit).expect("a unit");
    for line in [
        "After=robocomp-patrol-monitor.service\n",
        "After=robocomp-patrol-simulator.service\n",
        "TimeoutStartSec=10s\n",
        "TimeoutStopSec=3s\n",
        "Restart=no\n",
    ] {
        assert!(unit.contains(line), "{unit}");
    }
    let compose = &documents(&exported(NETWORKS[2], Engine::Compose).0)[0]["services"]["avoider"];
    for need in ["monitor", "simulator"] {
        assert_eq!(compose["depends_on"][need]["condition"], "service_healthy");
    }
    let manifests = documents(&exported(NETWORKS[2], Engine::Kubernetes).0);
    let named = |m: &&Value| m["metadata"]["annotations"]["robocomp-component"] == "avoider";
    let pod = &manifests.iter().find(named).expect("a manifest")["spec"]["template"]["spec"];
    let waits = pod["initContainers"].as_array().expect("a list");
    let whom: Vec<&Value> = waits.iter().map(|wait| &wait["command"][5]).collect();
    assert_eq!(whom, ["simulator", "monitor"]);
    assert_eq!(pod["terminationGracePeriodSeconds"], 3);
}

/// The proxy of a group is a service of its own, behind the components inside.
#[test]
fn a_proxy_is_exported_with_the_order_of_its_group() {
    let network = "components/networks/patrol_group.ddsl";
    let (systemd, _) = exported(network, Engine::Systemd);
    let unit = systemd.files.iter().map(|(path, _, text)| (path, text));
    let named = |path: &Path| path.to_string_lossy().ends_with("-robot.service");
    let mut units = unit.filter(|(path, _)| named(path));
    let (_, unit) = units.next().expect("the unit of the proxy");
    assert!(unit.contains("/rcforward \\\n"), "{unit}");
    assert!(unit.contains("-robot-simulator.service\n"), "{unit}");
    let compose = &documents(&exported(network, Engine::Compose).0)[0]["services"]["robot"];
    let need = &compose["depends_on"]["robot-simulator"];
    assert_eq!(need["condition"], "service_healthy", "{compose}");
    let entry = compose["entrypoint"][0].as_str().expect("a program");
    assert!(entry.ends_with("/rcforward"), "{entry}");
    let manifests = documents(&exported(network, Engine::Kubernetes).0);
    let of_robot = |m: &&Value| m["metadata"]["annotations"]["robocomp-component"] == "robot";
    let manifest = manifests.iter().find(of_robot).expect("a manifest");
    let waits = &manifest["spec"]["template"]["spec"]["initContainers"];
    assert_eq!(waits[0]["command"][5], "robot-simulator", "{manifest}");
}

/// The image has all that the manifests name, and its context has all that it copies.
#[test]
fn the_image_holds_what_the_pods_need() {
    for network in NETWORKS {
        let (export, _) = exported(network, Engine::Kubernetes);
        let mut files = export.files.iter();
        let (mut copied, mut allowed, mut made) = (Vec::new(), Vec::new(), String::new());
        for (path, _, text) in files.by_ref() {
            let lines = text.lines();
            if path.ends_with("Dockerfile") {
                let copies = lines.filter(|line| line.starts_with("COPY "));
                copied.extend(copies.map(|line| {
                    let list = line.split_once('[').expect("a list").1;
                    let list: [String; 2] =
                        serde_json::from_str(&format!("[{list}")).expect("two paths");
                    list
                }));
                made += text;
            } else if path.ends_with("Dockerfile.dockerignore") {
                let kept = lines.filter_map(|line| line.strip_prefix('!'));
                allowed.extend(kept.map(str::to_owned));
            }
        }
        assert!(!copied.is_empty());
        for [from, to] in &copied {
            assert!(
                allowed.contains(from) && to.ends_with(from.as_str()),
                "{from} {to}"
            );
        }
        let holds = |path: &str| copied.iter().any(|[_, to]| to == path);
        for manifest in documents(&export) {
            let pod = &manifest["spec"]["template"]["spec"];
            let container = &pod["containers"][0];
            let words = |key: &str| container[key].as_array().cloned().unwrap_or_default();
            let words: Vec<String> = ["command", "args"]
                .into_iter()
                .flat_map(words)
                .map(|word| word.as_str().expect("a text").replace("$$", "$"))
                .collect();
            let program = words
                .iter()
                .find(|word| word.starts_with('/'))
                .expect("a program");
            assert!(holds(program), "{program} is not in\n{made}");
            if let Some(at) = words.iter().position(|word| word == "--config") {
                assert!(holds(&words[at + 1]), "{} is not in\n{made}", words[at + 1]);
            }
            let directory = container["workingDir"].as_str().expect("a folder");
            assert!(made.contains(directory), "{directory} is not in\n{made}");
        }
        let user =
            &documents(&export)[0]["spec"]["template"]["spec"]["securityContext"]["runAsUser"];
        assert!(made.ends_with(&format!("USER {user}:{user}\n")), "{made}");
    }
}

/// It asks for the version of podman before anything else, and starts nothing else to read a file.
const PODMAN: &str = "#!/bin/sh\necho podman version 5.0.0\n";

#[test]
fn podman_compose_reads_every_file_as_it_is_meant() {
    let test = "podman_compose_reads_every_file_as_it_is_meant";
    let Some(python) = python::interpreter("podman_compose==1.6.0", test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let podman = folder.path().join("podman");
    fs::write(&podman, PODMAN).expect("a program");
    fs::set_permissions(&podman, fs::Permissions::from_mode(0o755)).expect("its rights");
    for network in NETWORKS {
        let (export, _) = exported(network, Engine::Compose);
        for ((_, _, text), own) in export.files.iter().zip(documents(&export)) {
            let file = folder.path().join("compose.yaml");
            fs::write(&file, text).expect("a file");
            let output = Command::new(python)
                .args(["-m", "podman_compose", "--podman-path"])
                .arg(&podman)
                .arg("-f")
                .arg(&file)
                .arg("config")
                .env_remove("ROBOCOMP_USER")
                .env_remove("ROBOCOMP_IMAGE")
                .output()
                .expect("it starts");
            assert!(output.status.success(), "{output:?}");
            let said = String::from_utf8_lossy(&output.stdout);
            let read: Value = serde_norway::from_str(&said).expect("YAML");
            let services = own["services"].as_object().expect("services");
            assert_eq!(
                read["services"].as_object().map(serde_json::Map::len),
                Some(services.len())
            );
            for (name, service) in services {
                let read = &read["services"][name];
                assert_eq!(read["user"], "1000:100", "{said}");
                assert_eq!(read["depends_on"], service["depends_on"], "{said}");
                let text = service["command"].to_string().replace("$$", "$");
                assert_eq!(read["command"].to_string(), text, "{said}");
            }
        }
    }
}
