//! Suggests the most likely path for one that does not exist.

use rc_diagnostics::nearest;
use std::fmt;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

/// How many entries of a folder are compared for a suggestion.
const MOST_ENTRIES: usize = 2000;

/// The error of a file that does not exist. Only who shows it looks for a suggestion.
#[derive(Debug)]
struct Missing(PathBuf);

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("No such file or directory")?;
        match nearest_path(&self.0) {
            Some(near) => write!(f, "; did you mean `{}`?", near.display()),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Missing {}

/// The error of the system about `path`, with a suggestion if there is no such file.
pub(crate) fn explained(path: &Path, error: io::Error) -> io::Error {
    if error.kind() == ErrorKind::NotFound {
        io::Error::new(ErrorKind::NotFound, Missing(path.to_owned()))
    } else {
        error
    }
}

/// The path of an existing file or folder that differs from `wanted` in a few letters: of a file
/// before its ending, of the folders that lead to it anywhere.
pub fn nearest_path(wanted: &Path) -> Option<PathBuf> {
    let mut found = PathBuf::new();
    let mut parts = wanted.components().peekable();
    while let Some(part) = parts.next() {
        let next = found.join(part);
        let is_last = parts.peek().is_none();
        let exists = if is_last {
            next.exists()
        } else {
            next.is_dir()
        };
        found = match part {
            Component::Normal(name) if !exists => {
                found.join(near(&found, name.to_str()?, is_last)?)
            }
            _ => next,
        };
    }
    (found != wanted && found.exists()).then_some(found)
}

/// The entry of `folder` that `name` most likely means.
fn near(folder: &Path, name: &str, is_last: bool) -> Option<String> {
    let here = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let ending = Path::new(name).extension().filter(|_| is_last);
    let stem = |name: &str| match ending.and_then(|e| e.to_str()) {
        Some(ending) => {
            let stem = name.strip_suffix(ending)?.strip_suffix('.')?;
            Some(stem.to_owned())
        }
        None => Some(name.to_owned()),
    };
    let entries = std::fs::read_dir(here).ok()?.flatten().take(MOST_ENTRIES);
    let names = entries.filter(|entry| is_last || entry.path().is_dir());
    let mut known: Vec<String> = names
        .filter_map(|entry| stem(entry.file_name().to_str()?))
        .collect();
    known.sort_unstable();
    let nearest = nearest(&stem(name)?, known.iter().map(String::as_str))?;
    Some(match ending.and_then(|e| e.to_str()) {
        Some(ending) => format!("{nearest}.{ending}"),
        None => nearest.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_path_that_leads_nowhere_gets_the_nearest_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        fs::create_dir_all(root.join("components/avoider/etc")).expect("a file");
        for file in ["avoider.cdsl", "avoider.pdsl", "a.map", "etc/config.toml"] {
            fs::write(root.join("components/avoider").join(file), "").expect("a file");
        }
        let meant = |wanted: &str| {
            let near = nearest_path(&root.join(wanted))?;
            Some(
                near.strip_prefix(root)
                    .expect("a file")
                    .display()
                    .to_string(),
            )
        };
        let avoider = Some("components/avoider/avoider.cdsl".to_owned());
        for wanted in [
            "components/avoider/avoidr.cdsl",
            "componets/avoider/Avoider.cdsl",
            "components/avoidr/avoidre.cdsl",
            "components/avoider/etc/../avoidr.cdsl",
        ] {
            let found = meant(wanted).map(|near| near.replace("etc/../", ""));
            assert_eq!(found, avoider, "{wanted}");
        }
        let config = meant("components/avoider/etc/confg.toml");
        assert_eq!(
            config.as_deref(),
            Some("components/avoider/etc/config.toml")
        );
        for none in [
            "components/avoider/b.map",
            "components/avoider/simulator.cdsl",
            "components/avoider/avoidr.smdsl",
            "maps/avoider/avoider.cdsl",
            "components/avoider/avoider.cdsl",
        ] {
            assert_eq!(meant(none), None, "{none}");
        }
    }

    #[test]
    fn readers_of_files_say_what_was_meant() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("patrol.ddsl"), "").expect("a file");
        let wrong = folder.path().join("patorl.ddsl");
        let errors = [
            crate::read(&wrong).unwrap_err(),
            crate::read_bytes(&wrong).unwrap_err(),
            crate::open_regular(&wrong).unwrap_err(),
        ];
        for error in errors {
            assert_eq!(error.kind(), ErrorKind::NotFound);
            let text = error.to_string();
            assert!(
                text.starts_with("No such file or directory; did you mean `"),
                "{text}"
            );
            assert!(text.ends_with("/patrol.ddsl`?"), "{text}");
        }
    }
}
