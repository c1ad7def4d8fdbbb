//! Files of dconv, which the paper comes with.

use crate::loaded;
use crate::printing::tree;
use rc_prototypes::format;
use std::path::PathBuf;

/// The files in the folder `dproto` that `RC_REAL_FILES` names: each is printed, and read again as the
/// same.
#[test]
fn files_of_dconv_are_printed_and_read_again() {
    let Some(folder) = std::env::var_os("RC_REAL_FILES") else {
        println!("skipped: real files of dconv: RC_REAL_FILES names no folder");
        return;
    };
    let folder = PathBuf::from(folder).join("dproto");
    let Ok(entries) = folder.read_dir() else {
        println!(
            "skipped: real files of dconv: there is no {}",
            folder.display()
        );
        return;
    };
    let mut count = 0;
    for entry in entries {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|own| own != "dproto") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a text");
        let name = path.display();
        let printed = format(&text);
        assert_eq!(tree(&text), tree(&printed), "{name}");
        assert_eq!(format(&printed), printed, "{name}");
        let (library, found) = loaded(&text);
        assert_eq!(found, "", "{name}");
        let (again, found) = loaded(&printed);
        assert_eq!(found, "", "{name}");
        let json = |of| serde_json::to_string(of).expect("JSON");
        assert_eq!(json(&library), json(&again), "{name}");
        assert!(library.prototypes.len() > 4, "{name}");
        count += 1;
    }
    assert!(count > 0, "{} has no files", folder.display());
}
