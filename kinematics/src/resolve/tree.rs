//! Reads the robot of an `InnerModel` file: as the URDF that it is exported to, in metres and
//! right-handed.

use rc_diagnostics::{Diagnostics, Severity, SourceId, SourceMap};
use rc_robot::Robot;
use rc_syntax::Loader;
use std::io;
use std::path::{Path, PathBuf};

/// Hands out included files. Meshes do not matter here.
struct Included<'l>(&'l dyn Loader);

impl innermodel_language::Loader for Included<'_> {
    fn read(&self, path: &Path) -> io::Result<String> {
        let found = self.0.find(Path::new(""), &path.to_string_lossy(), "xml");
        let found = found.map_err(|_| io::Error::from(io::ErrorKind::NotFound))?;
        Ok(found.text)
    }

    fn is_file(&self, path: &Path) -> bool {
        let is_xml = path.extension().is_some_and(|ending| ending == "xml");
        !is_xml || self.read(path).is_ok()
    }

    fn search(&self) -> &[PathBuf] {
        &[]
    }
}

pub(super) fn read(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Robot, Diagnostics) {
    let (document, found) = innermodel_language::load(sources, &Included(loader), source);
    // What is drawn and sensed does not matter here.
    let mut errors = Diagnostics::new();
    let only = found
        .into_iter()
        .filter(|one| one.severity == Severity::Error);
    errors.extend(only);
    if errors.has_errors() {
        return (Robot::default(), errors);
    }
    let path = sources.path(source).to_path_buf();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let (text, _) = innermodel_exchange::urdf::write(&document, &name);
    let title = format!("{} as URDF", path.display());
    let urdf = sources.add(title, text);
    let (robot, found) = rc_robot::read(sources, urdf);
    errors.extend(found);
    (robot, errors)
}
