//! Files of a component in Python that another machine needs: its worker and its generated package,
//! the package of the framework with its extension module, and the packages of its environment.

use crate::launcher::Places;
use crate::plan::Environment;
use crate::programs::processor;
use rc_codegen::files::GENERATED;
use rc_ddsl::model::Processor;
use rustix::io::Errno;
use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

/// Most files that a host gets for its components in Python, and most of their bytes.
const MOST_FILES: usize = 100_000;
const MOST_BYTES: u64 = 16 << 30;

/// The files that Python writes next to the modules that it reads.
const COMPILED: &str = "__pycache__";

/// All files that one host gets for its components in Python.
#[derive(Debug, Default)]
pub(crate) struct HostFiles {
    paths: HashSet<PathBuf>,
    bytes: u64,
}

impl HostFiles {
    /// Adds a file of this many bytes.
    fn add(&mut self, path: &Path, bytes: u64) -> io::Result<()> {
        if !self.paths.insert(path.to_path_buf()) {
            return Ok(());
        }
        self.bytes = self.bytes.saturating_add(bytes);
        let limit = if self.paths.len() > MOST_FILES {
            format!("{MOST_FILES} files")
        } else if self.bytes > MOST_BYTES {
            format!("{} GiB", MOST_BYTES >> 30)
        } else {
            return Ok(());
        };
        let message = format!(
            "the components in Python of one host would need more than {limit} there; remove packages that they do not need from \
             `.venv`, or links to large folders from `src`"
        );
        Err(io::Error::new(io::ErrorKind::InvalidInput, message))
    }
}

/// The files that a component needs, and its environment. They are added to those of its host.
pub(crate) fn of(
    places: &Places,
    processor: Option<Processor>,
    host: &mut HostFiles,
) -> io::Result<(Vec<PathBuf>, Option<Environment>)> {
    let environment = Environment::of(&places.folder);
    let mut folders = vec![places.home.join(GENERATED), places.home.join("src")];
    folders.extend(
        places
            .framework
            .iter()
            .map(|python| python.join("robocomp")),
    );
    folders.extend(environment.iter().map(Environment::packages));
    let native = places.native.iter().map(|(_, path)| path);
    let mut files: Vec<PathBuf> = native.cloned().collect();
    for folder in &folders {
        add(folder, &mut Vec::new(), host, &mut files).map_err(|error| {
            let folder = folder.display();
            let message = format!("cannot list the files in {folder}: {error}");
            io::Error::new(error.kind(), message)
        })?;
    }
    if let Some(processor) = processor {
        check_processor(&files, processor)?;
    }
    Ok((files, environment))
}

/// Refuses files with code for another processor than that of the host.
fn check_processor(files: &[PathBuf], wanted: Processor) -> io::Result<()> {
    if processor::own() == Some(wanted) {
        return Ok(());
    }
    let mut numbers = files.iter().map(|file| (file, processor::of(file)));
    let wrong = numbers.find_map(|(file, number)| {
        let number = number.filter(|number| *number != wanted.elf())?;
        Some((file, processor::name(number)))
    });
    let Some((file, of)) = wrong else {
        return Ok(());
    };
    let message = format!(
        "{} is for {of}, and its host is {}; remove `.venv` here, and install the packages on the host",
        file.display(),
        wanted.machine()
    );
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}

/// Adds the files below a folder. `above` are the folders that hold it, without links: one that
/// contains itself is read once.
fn add(
    folder: &Path,
    above: &mut Vec<PathBuf>,
    host: &mut HostFiles,
    files: &mut Vec<PathBuf>,
) -> io::Result<()> {
    let real = match folder.canonicalize() {
        Ok(real) => real,
        Err(error) if leads_nowhere(&error) => return Ok(()),
        Err(error) => return Err(error),
    };
    if above.contains(&real) {
        return Ok(());
    }
    above.push(real);
    for entry in folder.read_dir()? {
        let entry = entry?;
        let path = entry.path();
        let file = match path.metadata() {
            Ok(file) => file,
            Err(error) if leads_nowhere(&error) => continue,
            Err(error) => return Err(error),
        };
        if file.is_dir() && entry.file_name() != COMPILED {
            add(&path, above, host, files)?;
        } else if file.is_file() {
            host.add(&path, file.len())?;
            files.push(path);
        }
    }
    above.pop();
    Ok(())
}

/// Whether it is the error of a path that does not exist, or of a link to nothing or to itself.
fn leads_nowhere(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::NotFound
        || error.raw_os_error() == Some(Errno::LOOP.raw_os_error())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn all_that_python_reads_is_listed_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        };
        for name in [
            "eyes/src/specific_worker.py",
            "eyes/src/__pycache__/specific_worker.pyc",
            "eyes/generated/eyes/__init__.py",
            "eyes/tests/test_worker.py",
            "shared/lens.py",
            "framework/python/robocomp/__init__.py",
            "framework/python/Cargo.toml",
            "eyes/.venv/lib/python3.12/site-packages/numpy/core.so",
        ] {
            write(name);
        }
        let eyes = folder.path().join("eyes");
        let link = |to: &str, name: &str| symlink(folder.path().join(to), eyes.join(name));
        link("shared", "src/shared").expect("a link");
        link("eyes/src", "src/again").expect("a link");
        link("nowhere", "src/nowhere").expect("a link");
        link("eyes/src/itself", "src/itself").expect("a link");
        let mut places = Places {
            folder: eyes.clone(),
            home: eyes.clone(),
            framework: Some(folder.path().join("framework/python")),
            native: vec![("ROBOCOMP_NATIVE", folder.path().join("lib.so"))],
        };
        let listed = |places: &Places| {
            let (files, environment) =
                of(places, None, &mut HostFiles::default()).expect("to list");
            let relative = |path: &PathBuf| {
                let path = path.strip_prefix(folder.path()).expect("a path");
                path.display().to_string()
            };
            let mut files: Vec<String> = files.iter().map(relative).collect();
            files.sort();
            (files, environment)
        };
        let own = [
            "eyes/generated/eyes/__init__.py",
            "eyes/src/shared/lens.py",
            "eyes/src/specific_worker.py",
            "framework/python/robocomp/__init__.py",
            "lib.so",
        ];
        let (files, environment) = listed(&places);
        assert_eq!(files, own);
        assert_eq!(environment, None);

        let venv = eyes.join(".venv");
        std::fs::create_dir(venv.join("bin")).expect("a folder");
        symlink("/bin/sh", venv.join("bin/python")).expect("a link");
        std::fs::write(venv.join("pyvenv.cfg"), "version = 3.12.1\n").expect("a file");
        (places.framework, places.native) = (None, Vec::new());
        let (files, environment) = listed(&places);
        assert_eq!(
            files[0],
            "eyes/.venv/lib/python3.12/site-packages/numpy/core.so"
        );
        assert_eq!(files[1..], own[..3]);
        let environment = environment.expect("it is there");
        assert_eq!(environment.python, (3, 12));
    }

    #[test]
    fn a_host_gets_no_more_than_it_can_take() {
        let path = |number: usize| PathBuf::from(format!("/eyes/src/{number}.py"));
        let mut host = HostFiles::default();
        for number in 0..MOST_FILES {
            host.add(&path(number), 1).expect("room");
        }
        // Another component has it, too.
        host.add(&path(0), 1).expect("it is there");
        let refused = host.add(&path(MOST_FILES), 1).expect_err("too many");
        assert!(
            refused.to_string().contains("more than 100000 files"),
            "{refused}"
        );

        let mut host = HostFiles::default();
        host.add(&path(0), MOST_BYTES).expect("room");
        host.add(&path(0), MOST_BYTES).expect("it is there");
        let refused = host.add(&path(1), 1).expect_err("too much");
        assert_eq!(refused.kind(), io::ErrorKind::InvalidInput);
        assert!(
            refused.to_string().contains("more than 16 GiB"),
            "{refused}"
        );
    }

    #[test]
    fn a_large_file_behind_a_link_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let source = folder.path().join("eyes/src");
        std::fs::create_dir_all(&source).expect("a folder");
        let data = folder.path().join("data");
        std::fs::create_dir(&data).expect("a folder");
        let bag = std::fs::File::create(data.join("long.bag")).expect("a file");
        bag.set_len(MOST_BYTES + 1).expect("a file with a hole");
        symlink(&data, source.join("data")).expect("a link");
        let eyes = folder.path().join("eyes");
        let places = Places {
            folder: eyes.clone(),
            home: eyes,
            framework: None,
            native: Vec::new(),
        };
        let refused = of(&places, None, &mut HostFiles::default()).expect_err("too much");
        let refused = refused.to_string();
        assert!(refused.contains(&source.display().to_string()), "{refused}");
    }
}
