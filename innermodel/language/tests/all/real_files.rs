//! Files of robots, where there are some.

use crate::{Disk, loaded};
use innermodel_language::{is_innermodel, print};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("xml"))
        {
            files.push(path);
        }
    }
}

/// The files are in the folder that `RC_REAL_FILES` names.
#[test]
fn real_files_load_and_print_or_are_refused_with_a_place() {
    let Some(folder) = std::env::var_os("RC_REAL_FILES") else {
        return;
    };
    let mut files = Vec::new();
    collect(Path::new(&folder), &mut files);
    let mut refused: BTreeMap<&str, usize> = BTreeMap::new();
    let mut right = 0;
    for path in files {
        let bytes = std::fs::read(&path).expect("a file");
        let text = String::from_utf8_lossy(&bytes);
        let looks_right = text.to_lowercase().contains("<innermodel");
        if !is_innermodel(&text) && !looks_right {
            continue;
        }
        let (document, found, output) = loaded(&Disk, &path, &text);
        if found.has_errors() {
            eprint!("{output}");
            let codes: Vec<&str> = found.iter().map(|d| d.code).collect();
            let malformed = codes.iter().find(|code| **code == "malformed-xml");
            let code = malformed.or(codes.first()).copied().unwrap_or_default();
            *refused.entry(code).or_default() += 1;
            continue;
        }
        let (again, found, output) = loaded(&Disk, &path, &print(&document));
        assert!(!found.has_errors(), "{}: {output}", path.display());
        assert_eq!(again, document, "{}", path.display());
        right += 1;
    }
    eprintln!("{right} files load and print; refused: {refused:?}");
}
