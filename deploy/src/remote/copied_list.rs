//! List of the copies of a network, next to their folder: a copy that is no longer needed is
//! removed, a file that a component wrote next to the copies stays.

use super::copies::{beside, mirrored};
use rc_deploy_client::error::{Error, ErrorContext};
use rc_management::agent::File;
use std::collections::HashSet;
use std::fs;
use std::io::{self, BufReader, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The list of the copies below `root`.
fn list(root: &Path) -> PathBuf {
    beside(root, "copied")
}

/// The paths of the last list. A list that is missing or damaged is empty: nothing is removed then.
fn read(root: &Path) -> io::Result<Vec<PathBuf>> {
    match fs::File::open(list(root)) {
        Ok(file) => Ok(serde_json::from_reader(BufReader::new(file)).unwrap_or_default()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

/// Writes the list of these files, atomically.
fn write(files: &[File], root: &Path) -> io::Result<()> {
    let place = list(root);
    let new = place.with_extension("new");
    let paths: Vec<&Path> = files.iter().map(|file| file.path.as_path()).collect();
    let mut out = BufWriter::new(fs::File::create(&new)?);
    serde_json::to_writer(&mut out, &paths)?;
    out.flush()?;
    fs::rename(&new, &place)
}

/// Removes the copies below `root` that are not among `files`, and lists these: they are received
/// next. `step` is called before each removal.
///
/// # Errors
/// A removal that fails, or that would lead out of `root` by a link that another program has put
/// there.
pub(crate) fn renew(
    files: &[File],
    root: &Path,
    step: &mut dyn FnMut() -> io::Result<()>,
) -> Result<(), Error> {
    let listed = list(root);
    let stale = read(root).context(format!("read {}", listed.display()))?;
    let needed: HashSet<PathBuf> = files
        .iter()
        .map(|file| mirrored(root, &file.path))
        .collect();
    let stale = stale.iter().map(|path| mirrored(root, path));
    for path in stale.filter(|path| !needed.contains(path)) {
        step().context("answer its supervisor")?;
        remove(&path, root).context(format!("remove the old copy {}", path.display()))?;
    }
    write(files, root).context(format!("write {}", listed.display()))
}

/// Removes a copy, and the folders above it that are empty then.
fn remove(path: &Path, root: &Path) -> io::Result<()> {
    let folder = path.parent().unwrap_or(root);
    let real = match folder.canonicalize() {
        // A file may have taken the place of a folder above.
        Err(error) if is_missing(&error) => return Ok(()),
        real => real?,
    };
    if !real.starts_with(root.canonicalize()?) {
        let message = format!(
            "a link leads from there to {}, out of {}; remove the link, or the file by hand",
            real.display(),
            root.display()
        );
        // Only existing files are in the way.
        return match path.symlink_metadata() {
            Err(error) if is_missing(&error) => Ok(()),
            _ => Err(io::Error::other(message)),
        };
    }
    match fs::remove_file(path) {
        Err(error) if is_missing(&error) || error.kind() == ErrorKind::IsADirectory => {
            return Ok(());
        }
        removed => removed?,
    }
    let above = folder.ancestors().take_while(|above| *above != root);
    for empty in above {
        if fs::remove_dir(empty).is_err() {
            break;
        }
    }
    Ok(())
}

fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// A folder of copies, and the list of files copied there.
    struct Copies(tempfile::TempDir);

    impl Copies {
        /// These files are copied.
        fn of(names: &[&str]) -> Self {
            let copies = Self(tempfile::tempdir().expect("a folder"));
            copies.renew(names).expect("nothing is stale");
            for name in names {
                copies.write(name);
            }
            copies
        }

        fn root(&self) -> PathBuf {
            self.0.path().join("lab")
        }

        fn write(&self, name: &str) {
            let path = self.root().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, "").expect("a file");
        }

        fn renew(&self, names: &[&str]) -> Result<(), Error> {
            let file = |name: &&str| File {
                path: Path::new("/").join(name),
                hash: String::new(),
                size: 0,
                executable: false,
            };
            let files: Vec<File> = names.iter().map(file).collect();
            renew(&files, &self.root(), &mut || Ok(()))
        }

        fn has(&self, name: &str) -> bool {
            self.root().join(name).symlink_metadata().is_ok()
        }
    }

    #[test]
    fn only_copies_that_are_not_needed_are_removed() {
        let copies = Copies::of(&["src/worker.py", "src/queue.py", "src/old/lens.py"]);
        for own in ["src/calibration.json", "src/__pycache__/worker.pyc"] {
            copies.write(own);
        }
        for _ in 0..2 {
            copies.renew(&["src/worker.py"]).expect("removed");
            let names = ["src/worker.py", "src/calibration.json", "src/__pycache__"];
            assert!(names.iter().all(|name| copies.has(name)));
            assert!(!copies.has("src/queue.py") && !copies.has("src/old"));
        }
        // The remains of an interrupted write are not a list.
        fs::write(list(&copies.root()), "[\"/src/wor").expect("written");
        copies.renew(&[]).expect("nothing is known");
        assert!(copies.has("src/worker.py"));
    }

    #[test]
    fn a_file_becomes_a_folder_and_the_other_way_round() {
        let copies = Copies::of(&["src/lens", "src/eye/left.py"]);
        copies
            .renew(&["src/lens/wide.py", "src/eye"])
            .expect("removed");
        copies.write("src/lens/wide.py");
        copies.write("src/eye");
        // Names of the last list do not lead through a file.
        copies.renew(&["src/lens/wide.py"]).expect("removed");
        assert!(copies.has("src/lens/wide.py") && !copies.has("src/eye"));
    }

    #[test]
    fn nothing_is_removed_through_a_link() {
        let copies = Copies::of(&["src/worker.py", "src/queue.py"]);
        let outside = copies.0.path().join("disk");
        fs::rename(copies.root().join("src"), &outside).expect("moved");
        symlink(&outside, copies.root().join("src")).expect("a link");
        let refused = copies.renew(&["src/worker.py"]).expect_err("it is outside");
        let refused = refused.to_string();
        assert!(refused.contains("a link leads from there"), "{refused}");
        assert!(outside.join("queue.py").exists());
        // The user has followed the advice.
        fs::remove_file(outside.join("queue.py")).expect("a file");
        copies.renew(&["src/worker.py"]).expect("nothing to remove");
        assert!(outside.join("worker.py").exists());
    }
}
