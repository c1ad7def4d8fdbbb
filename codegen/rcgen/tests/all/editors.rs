//! The folder `editors`: the grammars of `TextMate` are made from the words of the languages' own grammars, and
//! the extension of VS Code compiles against its types.

use expect_test::expect_file;
use rc_test_support::python::{run, skipped};
use rc_vocabulary::Primitive;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Each language with the folder of its grammar.
const LANGUAGES: [(&str, &str); 8] = [
    ("idsl", "idsl"),
    ("cdsl", "cdsl"),
    ("pdsl", "pdsl"),
    ("smdsl", "smdsl"),
    ("ddsl", "ddsl"),
    ("gdsl", "graph/language"),
    ("dproto", "prototypes"),
    ("kdsl", "kinematics"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The keywords of a grammar, as patterns: those that a file may write in either case with both letters.
fn keywords(folder: &str) -> BTreeSet<String> {
    let read = |file: &str| std::fs::read_to_string(root().join(file)).expect("a grammar");
    let mut grammar = read(&format!("{folder}/src/grammar.pest"));
    if grammar.contains("condition.pest") {
        grammar += &read("pdsl/src/condition.pest");
    }
    let mut words = BTreeSet::new();
    for line in grammar.lines().filter(|line| line.starts_with("kw_")) {
        let mut parts = line.split('"');
        let mut before = parts.next().expect("a name").to_owned();
        while let (Some(word), behind) = (parts.next(), parts.next()) {
            let is_word = word.starts_with(|c: char| c.is_ascii_alphabetic());
            if is_word && before.ends_with('^') {
                let letters = word.chars().map(|c| match c {
                    '_' => "_".to_owned(),
                    c => format!("[{}{}]", c.to_ascii_uppercase(), c.to_ascii_lowercase()),
                });
                words.insert(letters.collect());
            } else if is_word {
                words.insert(word.to_owned());
            }
            behind.unwrap_or_default().clone_into(&mut before);
        }
    }
    assert!(!words.is_empty(), "{folder}");
    words
}

fn pattern(name: &str, language: &str, pattern: &str) -> Value {
    json!({ "name": format!("{name}.{language}"), "match": pattern })
}

fn grammar(language: &str, folder: &str) -> Value {
    let words: Vec<String> = keywords(folder).into_iter().collect();
    let mut patterns = vec![
        pattern("comment.line.documentation", language, "///.*$"),
        pattern("comment.line.double-slash", language, "//.*$"),
        json!({ "name": format!("comment.block.{language}"), "begin": "/\\*", "end": "\\*/" }),
        json!({
            "name": format!("string.quoted.double.{language}"),
            "begin": "\"",
            "end": "\"|$",
            "patterns": [{ "name": format!("constant.character.escape.{language}"), "match": "\\\\." }],
        }),
        pattern(
            "entity.name.function.decorator",
            language,
            "@\\s*[A-Za-z_][A-Za-z0-9_]*",
        ),
        pattern(
            "constant.numeric",
            language,
            "\\b[0-9]+(\\.[0-9]+)?([eE][+-]?[0-9]+)?(ns|us|ms|s|min|h)?\\b",
        ),
        pattern("constant.language", language, "\\b(true|false)\\b"),
        pattern(
            "keyword.control",
            language,
            &format!("\\b({})\\b", words.join("|")),
        ),
    ];
    if language == "idsl" {
        let types = Primitive::idsl_words()
            .map(|(word, _)| word)
            .chain(["void"]);
        let types: BTreeSet<&str> = types.collect();
        let types: Vec<&str> = types.into_iter().collect();
        patterns.push(pattern(
            "storage.type",
            language,
            &format!("\\b({})\\b", types.join("|")),
        ));
    }
    json!({
        "name": language.to_uppercase(),
        "scopeName": format!("source.{language}"),
        "fileTypes": [language],
        "patterns": patterns,
    })
}

/// The grammar of `.graph`, which is JSON: the members of nodes and edges are keywords.
fn graphs() -> Value {
    let string = json!({
        "name": "string.quoted.double.graph",
        "begin": "\"",
        "end": "\"|$",
        "patterns": [{ "name": "constant.character.escape.graph", "match": "\\\\." }],
    });
    let members = "schema|nodes|edges|id|type|from|to|attributes|value|unit|bytes|ints|strings|topic|sequence";
    json!({
        "name": "Graph",
        "scopeName": "source.graph",
        "fileTypes": ["graph"],
        "patterns": [
            pattern("keyword.control", "graph", &format!("\"({members})\"(?=\\s*:)")),
            pattern("variable.other.member", "graph", "\"([^\"\\\\]|\\\\.)*\"(?=\\s*:)"),
            pattern("constant.other.reference", "graph", "\"[0-9]+:[0-9]+\""),
            string,
            pattern("constant.numeric", "graph", "-?\\b[0-9]+(\\.[0-9]+)?([eE][+-]?[0-9]+)?\\b"),
            pattern("constant.language", "graph", "\\b(true|false)\\b"),
        ],
    })
}

#[test]
fn the_grammars_of_textmate_have_the_words_of_the_languages() {
    let all = LANGUAGES.map(|(language, folder)| (language, grammar(language, folder)));
    for (language, grammar) in all.into_iter().chain([("graph", graphs())]) {
        let path = root().join(format!(
            "editors/vscode/syntaxes/{language}.tmLanguage.json"
        ));
        let text = serde_json::to_string_pretty(&grammar).expect("JSON");
        expect_file![path].assert_eq(&format!("{text}\n"));
    }
}

/// Where the packages of the extension are, installed once.
fn packages() -> Result<PathBuf, String> {
    let place = rc_test_support::folder()?.join("vscode");
    let extension = root().join("editors/vscode");
    let lock = std::fs::read_to_string(extension.join("package-lock.json"));
    let lock = lock.map_err(|e| e.to_string())?;
    let known = std::fs::read_to_string(place.join("package-lock.json"));
    if known.is_ok_and(|known| known == lock) {
        return Ok(place);
    }
    let new = place.with_extension(std::process::id().to_string());
    std::fs::create_dir_all(&new).map_err(|e| e.to_string())?;
    for file in ["package.json", "package-lock.json"] {
        std::fs::copy(extension.join(file), new.join(file)).map_err(|e| e.to_string())?;
    }
    let path = new.display().to_string();
    let npm = [
        "ci",
        "--prefix",
        &path,
        "--no-audit",
        "--no-fund",
        "--silent",
    ];
    let made = run(Path::new("npm"), &npm);
    if made.is_ok() {
        let _ = std::fs::remove_dir_all(&place);
        let _ = std::fs::rename(&new, &place);
    }
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| place)
}

#[test]
fn the_extension_of_vs_code_compiles_and_its_tests_pass() {
    let place = match packages() {
        Ok(place) => place,
        Err(reason) => {
            return skipped(
                "the_extension_of_vs_code_compiles_and_its_tests_pass",
                &reason,
            );
        }
    };
    let folder = tempfile::tempdir().expect("a folder");
    let extension = root().join("editors/vscode");
    for part in ["src", "test", "tsconfig.json"] {
        let link = folder.path().join(part);
        let from = extension.join(part).canonicalize().expect("a file");
        // The compiler looks for packages beside the real file of a link.
        let copied = std::process::Command::new("cp")
            .arg("-r")
            .arg(from)
            .arg(link)
            .status();
        assert!(copied.expect("cp").success());
    }
    let modules = place.join("node_modules");
    std::os::unix::fs::symlink(&modules, folder.path().join("node_modules")).expect("a link");
    let compiler = modules.join("typescript/bin/tsc");
    let node = |words: &[&str]| {
        let output = std::process::Command::new("node")
            .args(words)
            .current_dir(folder.path())
            .output()
            .expect("node");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success(),
            "{text}{}",
            String::from_utf8_lossy(&output.stderr)
        );
        text
    };
    node(&[&compiler.display().to_string(), "-p", "."]);
    let told = node(&["--test", "out/test/"]);
    assert!(told.contains("# pass 4"), "{told}");
}

/// The lenses and actions of the server name commands of the extension.
#[test]
fn each_command_of_a_lens_or_an_action_is_one_of_the_extension() {
    let server = [
        include_str!("../../src/server/hints.rs"),
        include_str!("../../src/server/actions.rs"),
    ];
    let strings = server
        .iter()
        .flat_map(|text| text.split('"').skip(1).step_by(2));
    let lenses: BTreeSet<&str> = strings.filter(|word| word.starts_with("rcgen.")).collect();
    for known in ["rcgen.up", "rcgen.updateConfiguration"] {
        assert!(lenses.contains(known), "{lenses:?}");
    }
    let extension = std::fs::read_to_string(root().join("editors/vscode/src/extension.ts"));
    let extension = extension.expect("a file");
    for command in lenses {
        assert!(
            extension.contains(&format!("command(\"{command}\"")),
            "{command}"
        );
    }
}
