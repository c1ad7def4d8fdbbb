//! The command lines `rcgen config --update` and `rcgen check` for configurations.

use crate::folders::{changed, files, rcgen};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

const CDSL: &str =
    "Component c { Communications { }; language rust; parameters \"c.pdsl\"; period 20ms; };\n";
const PDSL: &str = "ComponentParams c { max_speed double 1.0 0:5 unit \"m/s\"; gain int 3; };\n";
/// One parameter is added, one is renamed, one is removed.
const LATER: &str = "ComponentParams c {\n/// The fastest.\nmaxSpeed double 1.0 0:5 unit \"m/s\";\n\
    /// What is safe.\nsafe_distance double 0.5 unit \"m\";\ntoken string \"s3cret\" secret;\n};\n";

fn component() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "c.cdsl", CDSL);
    write(folder.path(), "c.pdsl", PDSL);
    let (code, _, err) = rcgen(folder.path(), &["c.cdsl"]);
    assert_eq!((code, err.as_str()), (0, ""));
    folder
}

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).expect("a file");
}

fn rights(folder: &Path, mode: u32) {
    let rights = std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(folder.join("etc/config.toml"), rights).expect("to set");
}

fn read(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("etc/config.toml")).expect("a configuration")
}

/// Also one that is written for the first time.
#[test]
fn only_the_owner_reads_a_new_configuration_with_secrets() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "c.cdsl", CDSL);
    write(folder, "c.pdsl", LATER);
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    let metadata = std::fs::metadata(folder.join("etc/config.toml")).expect("a configuration");
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
}

#[test]
fn a_configuration_is_updated_on_request_only() {
    let folder = component();
    let folder = folder.path();
    let mine = "# Mine.\n[parameters]\nmax_speed = 2.0 # fast\ngain = [7]\n";
    write(folder, "etc/config.toml", mine);
    write(folder, "c.pdsl", LATER);
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    assert_eq!(read(folder), mine);

    // The check of the component and of the configuration report the same errors.
    for file in ["c.cdsl", "etc/config.toml", "."] {
        let (code, _, err) = rcgen(folder, &["check", "--format", "short", file]);
        assert_eq!(code, 1);
        for expected in [
            "etc/config.toml:3:1: error[unknown-parameter]: unknown parameter `max_speed`",
            "did you mean `maxSpeed`?",
            "etc/config.toml:4:1: error[unknown-parameter]: unknown parameter `gain`",
            "etc/config.toml:2:1: note[unset-parameter]: not set, so the defaults apply: `safe_distance` = 0.5",
        ] {
            assert!(err.contains(expected), "{expected}\n{err}");
        }
        assert_eq!(err.matches("`gain`").count(), 1, "{err}");
        assert!(!err.contains("s3cret"), "{err}");
    }

    let before = files(folder);
    let changes = "etc/config.toml: rename `max_speed` to `maxSpeed`\n\
        etc/config.toml: comment out `gain`, which is not a parameter\n\
        etc/config.toml: add `safe_distance` = 0.5\n\
        etc/config.toml: add `token` = ***\n";
    let (code, out, _) = rcgen(folder, &["config", "--update", "--dry-run", "c.cdsl"]);
    assert_eq!((code, out.as_str()), (0, changes));
    let (code, out, err) = rcgen(folder, &["config", "--update", "--check", "c.cdsl"]);
    assert_eq!((code, out.as_str()), (1, changes));
    assert_eq!(
        err,
        "etc/config.toml is not up to date: rcgen config --update etc/config.toml\n"
    );
    assert_eq!(changed(&before, &files(folder)), [""; 0]);

    // A read-only file is not written. Permissions are preserved.
    rights(folder, 0o400);
    let (code, _, err) = rcgen(folder, &["config", "--update", "c.cdsl"]);
    assert_eq!(code, 3);
    assert!(err.contains("the file is read-only"), "{err}");
    assert_eq!(changed(&before, &files(folder)), [""; 0]);
    rights(folder, 0o600);
    let (code, out, err) = rcgen(folder, &["config", "--update", "c.cdsl"]);
    let output = "etc/config.toml: 1 value has become a comment\n";
    assert_eq!((code, out.as_str(), err.as_str()), (0, changes, output));
    let metadata = std::fs::metadata(folder.join("etc/config.toml")).expect("a configuration");
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    assert_eq!(changed(&before, &files(folder)), ["etc/config.toml"]);
    let updated = "# Mine.\n[parameters]\nmaxSpeed = 2.0 # fast\n\n# What is safe.\n# double, in m\n\
        safe_distance = 0.5\n\n# string; secret\ntoken = \"s3cret\"\n\n\
        # No longer a parameter (rcgen config --update):\n# gain = [7]\n";
    assert_eq!(read(folder), updated);
    for arguments in [&["--update"][..], &["--update", "--check"]] {
        let arguments = [&["config"], arguments, &["etc/config.toml"]].concat();
        assert_eq!(rcgen(folder, &arguments), (0, String::new(), String::new()));
    }
    assert_eq!(read(folder), updated);
    assert_eq!(
        rcgen(folder, &["check", "."]),
        (0, String::new(), String::new())
    );
}

#[test]
fn an_ambiguous_rename_stays_an_error_until_the_user_decides() {
    let folder = component();
    let folder = folder.path();
    write(
        folder,
        "c.pdsl",
        "ComponentParams c { top_speed double 300.0 0:500 unit \"m/s\"; gain int 3; mass int 1; };\n",
    );
    let mine = "[parameters]\nmax_speed = 0.5 # slow!\ngain = 7\n";
    write(folder, "etc/config.toml", mine);
    let changes = "etc/config.toml: leave `max_speed` to you: it is not a parameter; \
        rename it if it is `top_speed` (300.0 by default) now, or remove it\n\
        etc/config.toml: add `mass` = 1\n";
    let output = "etc/config.toml: the remaining errors are left to you; correct them, then: \
        rcgen config --update etc/config.toml\n";
    let (code, out, err) = rcgen(folder, &["config", "--update", "c.cdsl"]);
    assert_eq!((code, out.as_str(), err.as_str()), (1, changes, output));
    let updated = format!("{mine}\n# int\nmass = 1\n");
    assert_eq!(read(folder), updated);
    // A second update does not decide either, and the component does not start with the default.
    let (first, _) = changes.split_once('\n').expect("two lines");
    for check in [
        &["config", "--update"][..],
        &["config", "--update", "--check"],
    ] {
        let (code, out, _) = rcgen(folder, &[check, &["c.cdsl"]].concat());
        assert_eq!((code, out.trim_end()), (1, first));
    }
    assert_eq!(read(folder), updated);
    let (code, _, err) = rcgen(folder, &["check", "--format", "short", "c.cdsl"]);
    assert_eq!(code, 1);
    let note = "etc/config.toml:2:1: note[unset-parameter]: not set, so the defaults apply: `top_speed` = 300.0";
    assert!(err.contains(note), "{err}");
    // The user renames the parameter, or removes it to get the default.
    for (decided, says) in [
        (
            updated.replace("max_speed", "top_speed"),
            "top_speed = 0.5 # slow!",
        ),
        (
            updated.replace("max_speed = 0.5 # slow!\n", ""),
            "top_speed = 300.0",
        ),
    ] {
        write(folder, "etc/config.toml", &decided);
        let (code, _, err) = rcgen(folder, &["config", "--update", "c.cdsl"]);
        assert_eq!((code, err.as_str()), (0, ""));
        assert!(read(folder).contains(says), "{}", read(folder));
        assert_eq!(rcgen(folder, &["check", "c.cdsl"]).0, 0);
    }
}

#[test]
fn unset_optional_parameters_are_not_reported() {
    let folder = component();
    let folder = folder.path();
    for text in ["", "[parameters]\ngain = 7\n"] {
        write(folder, "etc/config.toml", text);
        for file in ["c.cdsl", "etc/config.toml", "."] {
            let said = rcgen(folder, &["check", file]);
            assert_eq!(said, (0, String::new(), String::new()));
        }
    }
    // An update lists them.
    let (code, out, _) = rcgen(folder, &["config", "--update", "--dry-run", "c.cdsl"]);
    assert_eq!(
        (code, out.as_str()),
        (0, "etc/config.toml: add `max_speed` = 1.0\n")
    );
    // A note does not quote a secret either.
    write(folder, "c.pdsl", LATER);
    write(
        folder,
        "etc/config.toml",
        "parameters = { tokn = \"hunter2\" }\n",
    );
    let (code, _, err) = rcgen(folder, &["check", "c.cdsl"]);
    assert_eq!(code, 1);
    assert!(
        err.contains("note[unset-parameter]") && !err.contains("hunter2"),
        "{err}"
    );
}

#[test]
fn a_configuration_that_cannot_be_updated_is_reported_and_unchanged() {
    let folder = component();
    let folder = folder.path();
    let update = |file: &str| rcgen(folder, &["config", "--update", "--format", "short", file]);
    write(folder, "etc/config.toml", "[parameters\n");
    let (code, _, err) = update("c.cdsl");
    assert_eq!(code, 1);
    assert!(
        err.contains("config.toml:1:12: error[toml-syntax]"),
        "{err}"
    );
    std::fs::write(folder.join("etc/config.toml"), b"# \xff\n").expect("a file");
    for file in ["c.cdsl", "etc/config.toml"] {
        let (code, _, err) = update(file);
        assert_eq!(code, 1);
        assert!(err.contains("config.toml:1:3: error[not-utf8]"), "{err}");
    }
    std::fs::remove_file(folder.join("etc/config.toml")).expect("to remove it");
    let (code, _, err) = update("c.cdsl");
    assert_eq!(code, 1);
    assert!(err.contains("error[no-configuration]"), "{err}");
    let (code, _, err) = update("etc/config.toml");
    assert_eq!(code, 3, "{err}");
    write(folder, "c.pdsl", "ComponentParams c { x int };");
    write(folder, "etc/config.toml", "[parameters]\ny = 1\n");
    assert_eq!(update("c.cdsl").0, 1);
    assert_eq!(read(folder), "[parameters]\ny = 1\n");
    // `config` requires `--update`.
    assert_eq!(rcgen(folder, &["config", "c.cdsl"]).0, 2);
}

#[test]
fn page_and_schema_are_generated() {
    let folder = component();
    let folder = folder.path();
    assert!(read(folder).starts_with("#:schema ../generated/config.schema.json\n"));
    assert!(read(folder).contains("# period = \"20ms\" "));
    let page = |name: &str| {
        std::fs::read_to_string(folder.join("generated").join(name)).unwrap_or_default()
    };
    let row = "| `max_speed` | double | from 0 to 5 | m/s | `1.0` | fixed at the start |  |\n";
    assert!(page("parameters.md").contains(row));
    write(folder, "c.pdsl", LATER);
    assert_eq!(rcgen(folder, &["c.cdsl", "--check"]).0, 1);
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    assert!(
        page("parameters.md")
            .contains("| `token` | string |  |  | not shown | fixed at the start; secret |")
    );
    assert!(!page("parameters.md").contains(row));
    let schema = page("config.schema.json");
    assert!(
        schema.contains("\"maxSpeed\":") && !schema.contains("s3cret"),
        "{schema}"
    );
    assert!(
        schema.contains("The fastest.\\ndouble, from 0 to 5, in m/s."),
        "{schema}"
    );
    // A component without parameters has no page.
    write(
        folder,
        "c.cdsl",
        &CDSL.replace("parameters \"c.pdsl\";", ""),
    );
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    assert_eq!(page("parameters.md"), "");
    assert!(page("config.schema.json").contains("This component has no parameters."));
}

#[test]
fn an_address_for_a_slot_that_is_not_there_is_found() {
    let folder = component();
    let folder = folder.path();
    write(
        folder,
        "etc/config.toml",
        "[bindings]\nlaser = \"robot/laser\"\n",
    );
    for file in ["c.cdsl", "etc/config.toml"] {
        let (code, _, err) = rcgen(folder, &["check", "--format", "short", file]);
        assert_eq!(code, 1, "{err}");
        let expected = "etc/config.toml:2:1: error[unknown-slot]: `laser` is not a slot of c";
        assert!(err.contains(expected), "{err}");
    }
}
