//! `rcgen config --update` and what `rcgen check` says of configurations, as people type them.

mod folders;

use folders::{changed, files, rcgen};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

const CDSL: &str =
    "Component c { Communications { }; language rust; parameters \"c.pdsl\"; period 20ms; };\n";
const PDSL: &str = "ComponentParams c { max_speed double 1.0 0:5 unit \"m/s\"; gain int 3; };\n";
/// One is new, one has another spelling, one is gone.
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

#[test]
fn a_configuration_follows_its_pdsl_on_request_and_only_then() {
    let folder = component();
    let folder = folder.path();
    let mine = "# Mine.\n[parameters]\nmax_speed = 2.0 # fast\ngain = 7\n";
    write(folder, "etc/config.toml", mine);
    write(folder, "c.pdsl", LATER);
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    assert_eq!(read(folder), mine);

    // What is wrong is found by the component and by the configuration alike.
    for file in ["c.cdsl", "etc/config.toml", "."] {
        let (code, _, err) = rcgen(folder, &["check", "--format", "short", file]);
        assert_eq!(code, 1);
        for expected in [
            "etc/config.toml:3:1: error[unknown-parameter]: unknown parameter `max_speed`",
            "did you mean `maxSpeed`?",
            "etc/config.toml:4:1: error[unknown-parameter]: unknown parameter `gain`",
            "etc/config.toml:2:1: note[unset-parameter]: not set, so that defaults hold: `safe_distance` = 0.5",
        ] {
            assert!(err.contains(expected), "{expected}\n{err}");
        }
        assert_eq!(err.matches("`gain`").count(), 1, "{err}");
        assert!(!err.contains("s3cret"), "{err}");
    }

    let before = files(folder);
    let changes = "etc/config.toml: rename `max_speed` to `maxSpeed`\n\
        etc/config.toml: comment out `gain`, which is no parameter any more\n\
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

    // Nothing is written into what nobody may write into; what only its owner may read stays so.
    rights(folder, 0o400);
    let (code, _, err) = rcgen(folder, &["config", "--update", "c.cdsl"]);
    assert_eq!(code, 3);
    assert!(err.contains("it is read-only"), "{err}");
    assert_eq!(changed(&before, &files(folder)), [""; 0]);
    rights(folder, 0o600);
    let (code, out, err) = rcgen(folder, &["config", "--update", "c.cdsl"]);
    assert_eq!((code, out.as_str(), err.as_str()), (0, changes, ""));
    let metadata = std::fs::metadata(folder.join("etc/config.toml")).expect("a configuration");
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    assert_eq!(changed(&before, &files(folder)), ["etc/config.toml"]);
    let updated = "# Mine.\n[parameters]\nmaxSpeed = 2.0 # fast\n\n# What is safe.\n# double, in m\n\
        safe_distance = 0.5\n\n# string\ntoken = \"s3cret\"\n\n\
        # No parameter any more (rcgen config --update):\n# gain = 7\n";
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
fn what_cannot_be_updated_is_said_and_stays() {
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
    // Nothing but an update is there to be asked for.
    assert_eq!(rcgen(folder, &["config", "c.cdsl"]).0, 2);
}

#[test]
fn the_page_and_the_schema_follow_every_generation() {
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
    assert!(page("parameters.md").contains("| `token` | string |  |  | secret |"));
    assert!(!page("parameters.md").contains(row));
    let schema = page("config.schema.json");
    assert!(
        schema.contains("\"maxSpeed\": {") && !schema.contains("s3cret"),
        "{schema}"
    );
    assert!(
        schema.contains("The fastest.\\ndouble, from 0 to 5, in m/s."),
        "{schema}"
    );
    // A component without parameters has no page of them.
    write(
        folder,
        "c.cdsl",
        &CDSL.replace("parameters \"c.pdsl\";", ""),
    );
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    assert_eq!(page("parameters.md"), "");
    assert!(page("config.schema.json").contains("This component has none."));
}
