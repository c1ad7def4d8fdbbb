//! `rcgen fmt`.

use crate::folders::rcgen;
use crate::rcgen::succeeds;

#[test]
fn fmt_formats_valid_files_and_reports_the_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let write = |name: &str, text: &[u8]| {
        std::fs::write(folder.join(name), text).expect("a file");
    };
    // A folder without files of the languages is most likely a typing mistake.
    assert_eq!(rcgen(folder, &["fmt", "--check", "."]).0, 2);
    write("good.idsl", b"module  G { };");
    // Backup files of editors, and a pipe, which would block.
    write(".#good.idsl", b"module");
    let pipe = std::process::Command::new("mkfifo")
        .arg(folder.join("pipe.idsl"))
        .status();
    assert!(pipe.expect("mkfifo").success());
    let (code, out, err) = rcgen(folder, &["fmt", "--check", "."]);
    assert_eq!(
        (code, out.as_str(), err.as_str()),
        (1, "not formatted: ./good.idsl\n", "")
    );
    succeeds(folder, &["fmt", "."]);
    let entries = std::fs::read_dir(folder).expect("a folder");
    assert_eq!(entries.count(), 3, "nothing else was written");
    succeeds(folder, &["fmt", "--check", "."]);
    succeeds(folder, &["check", "."]);
    for command in ["fmt", "check"] {
        let (code, _, err) = rcgen(folder, &[command, "pipe.idsl"]);
        assert_eq!(code, 3);
        assert!(err.contains("pipe.idsl: not a regular file"), "{err}");
    }
    // A system error is reported with the other errors, and determines the exit code.
    write("bad.idsl", b"module {");
    write("bytes.idsl", b"module M\n{ \xff };");
    let (code, _, err) = rcgen(
        folder,
        &[
            "fmt",
            "--format",
            "short",
            "bad.idsl",
            "one.idsl",
            "two.idsl",
            "bytes.idsl",
        ],
    );
    assert_eq!(code, 3);
    for part in [
        "bad.idsl:1:8: error[syntax-error]",
        "bytes.idsl:2:3: error[not-utf8]",
        "one.idsl: No such file",
        "two.idsl: No such file",
    ] {
        assert!(err.contains(part), "{part}: {err}");
    }
}

#[test]
fn processes_are_formatted_as_other_blocks() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let file = folder.join("n.ddsl");
    let text = "Deployment n {\n/// Sees.\nProcess eyes{restart  on_failure hung 5s ;cpu 2,3;\n\
                priority 10; // for both\nhost  h;Component a{cdsl \"a.cdsl\";};\n\n\
                Component b{cdsl \"b.cdsl\";process  legs;};};\n};\n";
    std::fs::write(&file, text).expect("a file");
    succeeds(folder, &["fmt", "."]);
    let formatted = std::fs::read_to_string(&file).expect("a file");
    expect_test::expect![[r#"
        Deployment n
        {
            /// Sees.
            Process eyes
            {
                restart on_failure hung 5s;
                cpu 2, 3;
                priority 10; // for both
                host h;
                Component a
                {
                    cdsl "a.cdsl";
                };

                Component b
                {
                    cdsl "b.cdsl";
                    process legs;
                };
            };
        };
    "#]]
    .assert_eq(&formatted);
    succeeds(folder, &["fmt", "--check", "."]);
}

#[test]
fn the_interfaces_and_networks_of_this_repository_are_formatted() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let root = std::path::Path::new(root);
    let mut files = Vec::new();
    for folder in ["interfaces", "interop", "networks", "../xtask/bench"] {
        let folder = root.join("components").join(folder);
        let entries = std::fs::read_dir(folder).expect("a folder");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        let of_language = |path: &std::path::PathBuf| {
            let ending = path.extension();
            ending.is_some_and(|ending| ending == "idsl" || ending == "ddsl")
        };
        files.extend(paths.filter(of_language));
    }
    let files = files.iter().map(|file| file.to_str().expect("UTF-8"));
    let words: Vec<&str> = ["fmt", "--check"].into_iter().chain(files).collect();
    assert!(words.len() > 50, "{words:?}");
    succeeds(root, &words);
}
