//! Pages of `rcgen explain`: each code has one page, and its examples are accurate.

use rc_cdsl::model::Middleware;
use rc_codegen::{FileLoader, Project};
use rc_deploy_network::{self as network, Profile};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rcgen::explain::{Page, pages};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Words in the sources that look like codes and are none.
const NO_CODES: [&str; 38] = [
    "a-b",
    "acc-compose",
    "arm-linux-gnueabihf",
    "build-dependencies",
    "daemon-reload",
    "default-features",
    "default-members",
    "default-run",
    "dev-dependencies",
    "enable-linger",
    "geom-jacobian",
    "get-property",
    "include-system-site-packages",
    "innermodel-viewer",
    "joint-acc-twist",
    "joint-vel",
    "joint-vel-twist",
    "marks-test",
    "my-robot",
    "on-failure",
    "optional-dependencies",
    "pose-compose",
    "rc-dds",
    "rc-iceoryx2",
    "rc-local",
    "rc-middleware",
    "rc-ros2",
    "rc-runtime",
    "rc-world-typed",
    "rcdeploy-guard",
    "requires-python",
    "robocomp-component",
    "robocomp-host",
    "robocomp-network",
    "sweep-test",
    "systemd-run",
    "target-dir",
    "vel-compose",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Collects every string in the sources that has the form of a code.
fn codes(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            codes(&path, found);
            continue;
        }
        let text = fs::read_to_string(&path).expect("a source");
        for quoted in text.split('"').skip(1).step_by(2) {
            let letters =
                |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase());
            if quoted.contains('-') && quoted.split('-').all(letters) {
                found.insert(quoted.to_owned());
            }
        }
    }
}

#[test]
fn every_code_has_a_page() {
    let mut made = BTreeSet::new();
    for part in [
        "vocabulary",
        "vocabulary/diagnostics",
        "syntax",
        "syntax/urdf",
        "idsl",
        "cdsl",
        "pdsl",
        "smdsl",
        "ddsl",
        "graph/language",
        "graph/exchange",
        "graph/query",
        "codegen",
        "deploy",
        "innermodel/language",
        "innermodel/exchange",
        "kinematics",
        "kinematics/model",
        "prototypes",
    ] {
        codes(&root().join(part).join("src"), &mut made);
    }
    let explained: BTreeSet<String> = pages().iter().map(|p| p.code.to_owned()).collect();
    let missing: Vec<&String> = made
        .difference(&explained)
        .filter(|code| !NO_CODES.contains(&code.as_str()))
        .collect();
    assert!(missing.is_empty(), "codes without a page: {missing:?}");
    assert!(made.len() > 100, "{} codes were found", made.len());
    assert_eq!(pages().len(), explained.len(), "a code has two pages");
}

/// A fenced block: its language, its name, its text.
struct Block<'a> {
    ending: &'a str,
    name: Option<&'a str>,
    text: &'a str,
}

fn blocks(text: &str) -> Vec<Block<'_>> {
    let mut blocks = Vec::new();
    let mut rest = text;
    while let Some((_, after)) = rest.split_once("```") {
        let (head, after) = after.split_once('\n').expect("a fence with its line");
        let (text, after) = after.split_once("```").expect("a fence that ends");
        let mut words = head.split_whitespace();
        blocks.push(Block {
            ending: words.next().unwrap_or_default(),
            name: words.next(),
            text,
        });
        rest = after;
    }
    blocks
}

/// Checks one example together with the other files of its page.
fn check(files: &[Block<'_>], example: &Block<'_>) -> (Vec<&'static str>, bool, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, text).expect("a file");
        path
    };
    for file in files {
        write(file.name.expect("a name"), file.text);
    }
    let name = match example.ending {
        "toml" => "etc/config.toml".to_owned(),
        ending => format!("example.{ending}"),
    };
    let path = write(&name, example.text);
    let mut sources = SourceMap::new();
    let mut found = Diagnostics::new();
    let loader = FileLoader::new(&[]);
    if example.ending == "ddsl" {
        let (network, more) =
            network::load(&path, &network::Overrides::default(), &mut sources, &loader)
                .expect("a file");
        found.extend(more);
        if let Some(network) = network {
            network.programs.check_executables(Profile::Dev, &mut found);
            network.programs.check_generated(&mut found);
        }
    } else {
        rcgen::check::file(&path, false, &mut sources, &loader, &[], &mut found).expect("a file");
    }
    if example.ending == "cdsl" && !found.has_errors() {
        let (project, _) = Project::load(&path, &mut sources, &loader).expect("a file");
        let project = project.expect("a component without errors");
        let (_, more) =
            rc_codegen::generate::component(&project, Middleware::Iceoryx2, "").expect("templates");
        found.extend(more);
    }
    let not_built = ["missing-executable", "missing-generated"];
    let wrong = found
        .iter()
        .any(|d| d.severity == rc_diagnostics::Severity::Error && !not_built.contains(&d.code));
    let output = render(&sources, &found, Format::Short);
    (found.iter().map(|d| d.code).collect(), wrong, output)
}

/// The errors of one page.
fn faults(page: &Page) -> Vec<String> {
    if page.text.contains("No example: ") {
        return Vec::new();
    }
    let (Some((before, rest)), true) =
        (page.text.split_once("Wrong:"), page.text.contains("Right:"))
    else {
        return vec!["has neither examples nor `No example: `".to_owned()];
    };
    let (wrong, right) = rest.split_once("Right:").expect("it is there");
    let files = blocks(before);
    let (wrong, right) = (blocks(wrong), blocks(right));
    let ([wrong], [right]) = (&wrong[..], &right[..]) else {
        return vec!["has not one wrong and one right example".to_owned()];
    };
    let mut faults = Vec::new();
    let (codes, _, output) = check(&files, wrong);
    if !codes.contains(&page.code) {
        faults.push(format!("the wrong example gives\n{output}"));
    }
    let (codes, errors, output) = check(&files, right);
    if errors || codes.contains(&page.code) {
        faults.push(format!("the right example gives\n{output}"));
    }
    faults
}

#[test]
fn examples_cause_exactly_the_diagnostics_they_claim() {
    let all: Vec<String> = pages()
        .iter()
        .flat_map(|page| {
            faults(page)
                .into_iter()
                .map(move |f| format!("{}: {f}", page.code))
        })
        .collect();
    assert!(all.is_empty(), "{}", all.join("\n"));
    let shown = pages().iter().filter(|p| p.text.contains("Wrong:")).count();
    assert!(shown > 100, "only {shown} pages have examples");
}
